//! Suite `soft-cost`: what soft shadows of an area light cost, next to hard ones and to each other.

use super::Variant;
use super::judge::{Wanted, available, label, left_out_note};
use super::penumbrae::passes;
use crate::cli::report::{Bench, BenchRow};
use edgeshade::Result;
use edgeshade::scene::shipped;
use edgeshade::table::number;

/// Side of the map of all of them, texels.
const MAP: u32 = 1024;
/// What the others are set against.
const RIVAL: &str = "pcss";

/// As far as the registry has them.
const VARIANTS: [Wanted; 13] = [
    ("sm", &[]),
    ("pcf", &[("width", "15")]),
    ("pcss", &[]),
    ("pcss", &[("skip", "off")]),
    ("rbssm", &[]),
    ("rbssm-naive", &[]),
    ("rbssm", &[("skip", "off")]),
    ("rbssm", &[("reuse", "off")]),
    ("ssrbssm", &[]),
    ("ssabss", &[]),
    ("edtssm", &[]),
    ("edtssm-star", &[]),
    ("soft-auto", &[]),
];

/// What a technique has, and the variant without it.
const SAVINGS: [(&str, &str, &str); 4] = [
    ("hierarchical map", "pcss", "pcss skip=off"),
    ("hierarchical map", "rbssm", "rbssm skip=off"),
    ("run reuse", "rbssm", "rbssm reuse=off"),
    ("both", "rbssm", "rbssm-naive"),
];

/// Every scene under its own light.
pub fn variants() -> Result<Vec<Variant>> {
    let (choices, _) = available(&VARIANTS);
    let pairs = shipped::ALL.iter().flat_map(|scene| choices.iter().map(move |c| (scene, c)));
    Ok(pairs.map(|(scene, choice)| Variant::new(scene, choice.clone(), MAP, scene.name)).collect())
}

/// What the table's figures come to.
pub fn conclusions(figures: &Bench, variants: &[Variant]) -> String {
    let labels: Vec<_> = variants.iter().map(|v| label(&v.choice)).collect();
    let rows: Vec<_> = figures.results.iter().zip(labels.iter().map(String::as_str)).collect();
    let groups: Vec<_> = rows.chunk_by(|a, b| a.0.group == b.0.group).collect();
    let note = left_out_note(&available(&VARIANTS).1);
    let note = if note.is_empty() { note } else { format!("\n{}\n", note.trim_end()) };
    note + &added(&groups) + &savings(&groups) + &shares(&groups)
}

/// Rows of one group with their labels.
type Group<'a> = [(&'a BenchRow, &'a str)];

fn find<'a>(group: &Group<'a>, name: &str) -> Option<&'a BenchRow> {
    group.iter().find(|(_, label)| *label == name).map(|(row, _)| *row)
}

/// By how many times a variant adds what the rival adds to the same frame of `sm`; where that adds nothing, nothing.
fn by_rival(group: &Group<'_>, row: &BenchRow) -> Option<f64> {
    let rival = find(group, RIVAL)?.added_to_frame.filter(|a| *a > 0.0)?;
    Some(row.added_to_frame? / rival)
}

fn added(groups: &[&Group<'_>]) -> String {
    let mut text = format!(
        "\n## What soft shadows add\n\n\
         `adds`: milliseconds that a technique's passes take more than those of `sm`; `by {RIVAL}'s`: that by what \
         `{RIVAL}` adds; `frame`: the whole frame by that of `sm`. Medians over the turns.\n\n\
         | scene | technique | adds ms | by {RIVAL}'s | frame |\n|---|---|--:|--:|--:|\n"
    );
    // By label, over the scenes.
    let mut all: Vec<(&str, Vec<f64>)> = vec![];
    for group in groups {
        for &(row, label) in group.iter().skip(1) {
            let ratio = by_rival(group, row);
            if all.iter().all(|(l, _)| *l != label) {
                all.push((label, vec![]));
            }
            all.iter_mut().filter(|(l, _)| *l == label).for_each(|(_, found)| found.extend(ratio));
            text += &format!(
                "| {} | {label} | {} | {} | {} |\n",
                row.group,
                number(row.added_ms, 3),
                number(ratio, 2),
                number(row.frame_ratio, 3)
            );
        }
    }
    text += &format!(
        "\nOver the scenes, by {RIVAL}'s:\n\n| technique | geometric mean | least | most |\n|---|--:|--:|--:|\n"
    );
    for (label, ratios) in all {
        let [mean, least, most] = spread(&ratios);
        text += &format!("| {label} | {} | {} | {} |\n", number(mean, 2), number(least, 2), number(most, 2));
    }
    text
}

/// Geometric mean, least and most of ratios; a mean only of positive ones.
fn spread(ratios: &[f64]) -> [Option<f64>; 3] {
    let has = !ratios.is_empty();
    let mean = (ratios.iter().map(|r| r.ln()).sum::<f64>() / ratios.len() as f64).exp();
    let least = ratios.iter().copied().fold(f64::INFINITY, f64::min);
    let most = ratios.iter().copied().fold(f64::NEG_INFINITY, f64::max);
    [has.then_some(mean), has.then_some(least), has.then_some(most)]
}

fn savings(groups: &[&Group<'_>]) -> String {
    let mut lines = String::new();
    for group in groups {
        for (what, with, without) in SAVINGS {
            let (Some(a), Some(b)) = (find(group, with), find(group, without)) else { continue };
            let saved = a.gpu_ms.zip(b.gpu_ms).map(|(a, b)| 100.0 * (1.0 - a / b));
            lines += &format!(
                "| {} | {what} | {with} | {} | {} | {} |\n",
                a.group,
                number(a.gpu_ms, 3),
                number(b.gpu_ms, 3),
                number(saved, 1)
            );
        }
    }
    if lines.is_empty() {
        return lines;
    }
    "\n## What the accelerations save\n\n\
     Milliseconds of the technique's own passes, with and without; `saved`: per cent of those without, negative where it \
     costs more than it saves.\n\n\
     | scene | what | technique | with ms | without ms | saved % |\n|---|---|---|--:|--:|--:|\n"
        .to_owned()
        + &lines
}

fn shares(groups: &[&Group<'_>]) -> String {
    let mut text =
        "\n## Passes\n\nShare of the technique's time; in brackets tiles or pixels that were worked on, of all.\n\n\
                    | scene | technique | passes |\n|---|---|---|\n"
            .to_owned();
    for group in groups {
        for (row, label) in group.iter() {
            text += &format!("| {} | {label} | {} |\n", row.group, passes(row));
        }
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::cli::report::Origin;

    fn row(group: &str, gpu_ms: f64, base: f64) -> BenchRow {
        BenchRow {
            scene: "jenga",
            ground_alone: false,
            technique: "sm",
            params: serde_json::Map::new(),
            shadow_map: MAP,
            group: group.into(),
            gpu_ms: Some(gpu_ms),
            gpu_ms_min: None,
            gpu_ms_max: None,
            ratio: None,
            added_ms: Some(gpu_ms - base),
            added_to_frame: Some((gpu_ms - base) / 100.0),
            frame_ratio: Some(1.0 + (gpu_ms - base) / 100.0),
            passes: vec![],
            total_gpu_ms: None,
            memory_bytes: 0,
        }
    }

    #[test]
    fn ratios_are_between_rows_of_one_group() {
        let rows = [
            (row("a", 2.0, 2.0), "sm"),
            (row("a", 6.0, 2.0), "pcss"),
            (row("a", 8.0, 2.0), "pcss skip=off"),
            (row("a", 10.0, 2.0), "rbssm"),
            (row("a", 40.0, 2.0), "rbssm-naive"),
            (row("b", 2.0, 2.0), "sm"),
            (row("b", 12.0, 2.0), "pcss"),
            (row("b", 7.0, 2.0), "rbssm"),
        ];
        let rows: Vec<_> = rows.iter().map(|(r, l)| (r, *l)).collect();
        let groups: Vec<_> = rows.chunk_by(|a, b| a.0.group == b.0.group).collect();
        let text = added(&groups);
        let lines = [
            "| a | pcss | 4.000 | 1.00 | 1.040 |",
            "| a | rbssm | 8.000 | 2.00 | 1.080 |",
            "| b | rbssm | 5.000 | 0.50 | 1.050 |",
            "| rbssm | 1.00 | 0.50 | 2.00 |",
            "| rbssm-naive | 9.50 | 9.50 | 9.50 |",
        ];
        for line in lines {
            assert!(text.contains(line), "{line}: {text}");
        }
        assert!(!text.contains("| a | sm |"), "{text}");
        let text = savings(&groups);
        assert!(text.contains("| a | hierarchical map | pcss | 6.000 | 8.000 | 25.0 |"), "{text}");
        assert!(text.contains("| a | both | rbssm | 10.000 | 40.000 | 75.0 |"), "{text}");
        assert_eq!(text.matches("\n| b |").count(), 0, "nothing to set it against: {text}");
    }

    #[test]
    fn without_the_rival_there_is_no_ratio() {
        let rows = [(row("a", 2.0, 2.0), "sm"), (row("a", 6.0, 2.0), "pcf width=15")];
        let rows: Vec<_> = rows.iter().map(|(r, l)| (r, *l)).collect();
        let text = added(&[&rows[..]]);
        assert!(text.contains("| a | pcf width=15 | 4.000 | - | 1.040 |"), "{text}");
        assert!(text.contains("| pcf width=15 | - | - | - |"), "{text}");
    }

    #[test]
    fn hard_shadows_come_first_and_what_is_missing_is_named() {
        let variants = variants().unwrap();
        for group in variants.chunk_by(|a, b| a.group == b.group) {
            assert_eq!(label(&group[0].choice), "sm");
        }
        let results = variants.iter().map(|v| row(&v.group, 2.0, 1.0)).collect();
        let origin = Origin::default();
        let text = conclusions(&Bench { suite: "soft-cost", origin, size: [1, 1], frames: 1, results }, &variants);
        let missing = available(&VARIANTS).1;
        assert!(missing.iter().all(|m| text.contains(m.as_str())), "{text}");
        for (_, with, without) in SAVINGS {
            let has = |name: &str| VARIANTS.iter().any(|(id, s)| super::super::judge::wanted_label(id, s) == name);
            assert!(has(with) && has(without), "{with} {without}");
        }
    }
}
