//! Suite `soft-cost`: cost of soft shadows of an area light, compared with hard shadows and with each other.

use super::driver::*;
use super::timed;

pub static SUITE: Suite = Suite {
    name: "soft-cost",
    about: "cost that soft shadows of an area light add to sm, pass by pass, and savings from skipping",
    extent: |quick| timed::extent(quick, every_scene(), &[1024]),
    variants: |_| Ok(available(VARIANTS)),
    page: |results| timed::page(results) + &added(&results.rows) + &savings(&results.rows) + &shares(&results.rows),
    ..timed::BASE
};

/// Variant that the others are compared with.
const RIVAL: &str = "pcss";

/// Variants to time, if the registry has them.
const VARIANTS: &str = "sm pcf:width=15 pcss pcss:skip=off rbssm rbssm-naive rbssm:skip=off rbssm:reuse=off ssrbssm ssabss edtssm \
                        edtssm-star soft-auto exact-soft pcss:preset=published rbssm:preset=published \
                        rbssm-naive:preset=published ssrbssm:preset=published ssabss:preset=published \
                        edtssm:preset=published";

/// Accelerations, each with a variant that uses it and one that does not.
const SAVINGS: [(&str, &str, &str); 4] = [
    ("hierarchical map", "pcss", "pcss skip=off"),
    ("hierarchical map", "rbssm", "rbssm skip=off"),
    ("run reuse", "rbssm", "rbssm reuse=off"),
    ("both", "rbssm", "rbssm-naive"),
];

fn find<'a>(group: &'a [Row], name: &str) -> Option<&'a Row> {
    group.iter().find(|r| r.label == name)
}

/// Ratio of the time that a variant adds to the frame of `sm` to the time that the rival adds; `None` if the rival
/// adds nothing.
fn by_rival(group: &[Row], row: &Row) -> Option<f64> {
    let rival = find(group, RIVAL)?.number("added_to_frame").filter(|a| *a > 0.0)?;
    Some(row.number("added_to_frame")? / rival)
}

fn added(rows: &[Row]) -> String {
    let mut lines = vec![];
    // Ratios over the scenes for each label.
    let mut all: Vec<(&str, Vec<f64>)> = vec![];
    for group in groups(rows) {
        for row in &group[1..] {
            let ratio = by_rival(group, row);
            match all.iter_mut().find(|(label, _)| *label == row.label) {
                Some((_, found)) => found.extend(ratio),
                None => all.push((&row.label, ratio.into_iter().collect())),
            }
            let [added, frame] = ["added_ms", "frame_ratio"].map(|name| number(row.number(name), 3));
            lines.push(vec![row.group.clone(), row.label.clone(), added, number(ratio, 2), frame]);
        }
    }
    let spreads = all.iter().map(|(label, ratios)| {
        let [mean, least, most] = spread(ratios).map(|v| number(v, 2));
        vec![(*label).to_owned(), mean, least, most]
    });
    format!(
        "\n## What soft shadows add\n\n\
         `adds`: milliseconds that a technique's passes take in addition to those of `sm`; `by {RIVAL}'s`: ratio to what \
         `{RIVAL}` adds; `frame`: ratio of the whole frame to that of `sm`. Medians over the turns.\n\n{}\n\
         Over the scenes, by {RIVAL}'s:\n\n{}",
        plain_table(&format!("<scene | <technique | adds ms | by {RIVAL}'s | frame"), lines),
        plain_table("<technique | geometric mean | least | most", spreads)
    )
}

/// Geometric mean, smallest and largest of ratios; the mean requires positive ratios.
fn spread(ratios: &[f64]) -> [Option<f64>; 3] {
    let has = !ratios.is_empty();
    let mean = (ratios.iter().map(|r| r.ln()).sum::<f64>() / ratios.len() as f64).exp();
    let least = ratios.iter().copied().fold(f64::INFINITY, f64::min);
    let most = ratios.iter().copied().fold(f64::NEG_INFINITY, f64::max);
    [has.then_some(mean), has.then_some(least), has.then_some(most)]
}

fn savings(rows: &[Row]) -> String {
    let mut lines = vec![];
    for group in groups(rows) {
        for (what, with, without) in SAVINGS {
            let (Some(a), Some(b)) = (find(group, with), find(group, without)) else { continue };
            let [a_ms, b_ms] = [a, b].map(|r| r.number("gpu_ms"));
            let saved = a_ms.zip(b_ms).map(|(a, b)| 100.0 * (1.0 - a / b));
            let [with_ms, without_ms] = [a_ms, b_ms].map(|ms| number(ms, 3));
            lines.push(vec![a.group.clone(), what.into(), with.into(), with_ms, without_ms, number(saved, 1)]);
        }
    }
    if lines.is_empty() {
        return String::new();
    }
    "\n## What the accelerations save\n\n\
     Milliseconds of the technique's own passes, with and without the acceleration; `saved` is in percent of the time \
     without, negative where it costs more than it saves.\n\n"
        .to_owned()
        + &plain_table("<scene | <what | <technique | with ms | without ms | saved %", lines)
}

fn shares(rows: &[Row]) -> String {
    let line = |r: &Row| vec![r.group.clone(), r.label.clone(), timed::passes(r)];
    "\n## Passes\n\nShare of the technique's time; in brackets the tiles or pixels worked on, out of all.\n\n"
        .to_owned()
        + &plain_table("<scene | <technique | <passes", rows.iter().map(line))
}

#[cfg(test)]
mod tests {
    use super::timed::tests::row;
    use super::*;
    use crate::cli::report::Origin;

    #[test]
    fn ratios_are_between_rows_of_one_group() {
        let rows = [
            row("a", "sm", 2.0, 2.0),
            row("a", "pcss", 6.0, 2.0),
            row("a", "pcss skip=off", 8.0, 2.0),
            row("a", "rbssm", 10.0, 2.0),
            row("a", "rbssm-naive", 40.0, 2.0),
            row("b", "sm", 2.0, 2.0),
            row("b", "pcss", 12.0, 2.0),
            row("b", "rbssm", 7.0, 2.0),
        ];
        let text = added(&rows);
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
        let text = savings(&rows);
        assert!(text.contains("| a | hierarchical map | pcss | 6.000 | 8.000 | 25.0 |"), "{text}");
        assert!(text.contains("| a | both | rbssm | 10.000 | 40.000 | 75.0 |"), "{text}");
        assert_eq!(text.matches("\n| b |").count(), 0, "nothing to set it against: {text}");
    }

    #[test]
    fn without_the_rival_there_is_no_ratio() {
        let rows = [row("a", "sm", 2.0, 2.0), row("a", "pcf width=15", 6.0, 2.0)];
        let text = added(&rows);
        assert!(text.contains("| a | pcf width=15 | 4.000 | - | 1.040 |"), "{text}");
        assert!(text.contains("| pcf width=15 | - | - | - |"), "{text}");
    }

    #[test]
    fn hard_shadows_come_first_and_what_is_missing_is_named() {
        let plan = SUITE.plan(false, 1, None, DeviceFeatures::default()).unwrap();
        assert_eq!(plan.variants[0].label, "sm");
        let plan = Plan { left_out: vec!["none".into()], ..plan };
        let rows = plan.variants.iter().map(|v| row("a", &v.label, 2.0, 1.0)).collect();
        let text = (SUITE.page)(&SUITE.results(&plan, Origin::default(), rows));
        assert!(text.contains("\n\nLeft out because they are not supported: none.\n\n## What soft"), "{text}");
        for (_, with, without) in SAVINGS {
            let has = |name: &str| plan.variants.iter().any(|v| v.label == name);
            assert!(has(with) && has(without), "{with} {without}");
        }
    }
}
