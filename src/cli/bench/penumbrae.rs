//! Suite `penumbrae`: what fixed-size penumbrae cost, next to hard shadows and to a filter of the same width.

use super::Variant;
use super::judge::label;
use crate::cli::report::{Bench, BenchRow};
use crate::cli::stats::{FRAME_PASSES, PassStats};
use crate::cli::techniques::Choice;
use edgeshade::Result;
use edgeshade::scene::shipped::{self, Shipped};
use edgeshade::table::number;

/// Side of the map of all of them, texels: that which the default penumbra is 15 texels of.
const MAP: u32 = 1024;
const SUBJECT: &str = "edtsm-star";
const FILTER: &str = "pcf width=15";

/// Passes below this share of the technique's time are told together.
const SMALL_SHARE: f64 = 0.01;

const VARIANTS: [(&str, &[(&str, &str)]); 8] = [
    ("sm", &[]),
    ("pcf", &[("width", "15")]),
    ("rbsm-star", &[]),
    ("edtsm-star", &[]),
    ("edtsm-star", &[("skip", "off")]),
    ("edtsm-star", &[("nearest", "pixel")]),
    ("edtsm", &[]),
    ("edtsm-star", &[("filter_taps", "7")]),
];
/// Of these, what is timed where there is no shadow edge.
const ALONE: [&str; 4] = ["sm", FILTER, SUBJECT, "edtsm-star skip=off"];

/// Every scene, and the ground of the default one without a shadow.
pub fn variants() -> Result<Vec<Variant>> {
    let mut found = vec![];
    let stages = shipped::ALL.iter().map(|s| (s, false)).chain([(super::default_scene()?, true)]);
    for (scene, ground_alone) in stages {
        for (id, settings) in VARIANTS {
            let settings: Vec<_> = settings.iter().map(|&(n, v)| (n.to_owned(), v.to_owned())).collect();
            let choice = Choice::new(id, &settings)?;
            if !ground_alone || ALONE.contains(&label(&choice).as_str()) {
                found.push(variant(scene, ground_alone, choice));
            }
        }
    }
    Ok(found)
}

fn variant(scene: &'static Shipped, ground_alone: bool, choice: Choice) -> Variant {
    let group = if ground_alone { format!("{}, ground alone", scene.name) } else { scene.name.to_owned() };
    Variant { ground_alone, ..Variant::new(scene, choice, MAP, group) }
}

/// What the table's figures come to.
pub fn conclusions(figures: &Bench, variants: &[Variant]) -> String {
    let mut sums = "\n## What penumbrae add\n\n\
                    Milliseconds that a technique's passes take more than those of `sm`; `by pcf's`: what `edtsm-star` adds by \
                    what `pcf` of 15x15 texels adds; `frame`: the whole frame by that of `sm`. Medians over the turns. With \
                    the ground alone no shadow edge is seen.\n\n\
                    | scene | pcf adds ms | edtsm-star adds ms | by pcf's | frame with pcf | frame with edtsm-star |\n\
                    |---|--:|--:|--:|--:|--:|\n"
        .to_owned();
    let mut shares =
        "\n## Passes of `edtsm-star`\n\nShare of the technique's time; tiles that were worked on, of all.\n\n\
                      | scene | passes |\n|---|---|\n"
            .to_owned();
    let labels: Vec<_> = variants.iter().map(|v| label(&v.choice)).collect();
    for first in figures.results.chunk_by(|a, b| a.group == b.group).filter_map(<[_]>::first) {
        let find = |name: &str| {
            let mut rows = figures.results.iter().zip(&labels);
            rows.find(|(r, l)| r.group == first.group && *l == name).map(|(r, _)| r)
        };
        let (Some(subject), Some(filter)) = (find(SUBJECT), find(FILTER)) else { continue };
        // Both are shares of the same frame of `sm`.
        let ratio = subject.added_to_frame.zip(filter.added_to_frame).map(|(a, b)| a / b);
        sums += &format!(
            "| {} | {} | {} | {} | {} | {} |\n",
            first.group,
            number(filter.added_ms, 3),
            number(subject.added_ms, 3),
            number(ratio, 2),
            number(filter.frame_ratio, 3),
            number(subject.frame_ratio, 3)
        );
        shares += &format!("| {} | {} |\n", first.group, passes(subject));
    }
    sums + &shares
}

/// Share and tiles of each of a technique's own passes, those of one name together, the smallest last in one.
pub fn passes(row: &BenchRow) -> String {
    let mut own: Vec<(PassStats, u32)> = vec![];
    for pass in row.passes.iter().filter(|p| !FRAME_PASSES.contains(&p.name.as_str())) {
        match own.iter_mut().find(|(p, _)| p.name == pass.name) {
            Some((p, times)) => {
                p.gpu_ms += pass.gpu_ms;
                *times += 1;
            }
            None => own.push((pass.clone(), 1)),
        }
    }
    let sum: f64 = own.iter().map(|(p, _)| p.gpu_ms).sum();
    let share = |ms: f64| number((sum > 0.0).then(|| 100.0 * ms / sum), 1);
    let (shown, small): (Vec<_>, Vec<_>) = own.iter().partition(|(p, _)| p.gpu_ms >= SMALL_SHARE * sum);
    let mut text: Vec<_> = shown
        .iter()
        .map(|(p, times)| {
            let times = if *times > 1 { format!(" ({times} times)") } else { String::new() };
            let tiles = p.tiles_active.zip(p.tiles_total).map(|(active, total)| format!(" ({active} of {total})"));
            format!("{}{times} {} %{}", p.name, share(p.gpu_ms), tiles.unwrap_or_default())
        })
        .collect();
    if !small.is_empty() {
        text.push(format!("{} others {} %", small.len(), share(small.iter().map(|(p, _)| p.gpu_ms).sum())));
    }
    text.join(", ")
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::cli::report::Origin;

    #[test]
    fn shares_are_of_the_techniques_own_passes() {
        let pass = |name: &str, gpu_ms, tiles_active: Option<u32>| PassStats {
            name: name.into(),
            gpu_ms,
            gpu_ms_min: gpu_ms,
            gpu_ms_max: gpu_ms,
            tiles_total: tiles_active.map(|_| 8),
            tiles_active,
            counts: Default::default(),
            statistics: None,
        };
        let passes_ms = [
            pass("g-buffer", 50.0, None),
            pass("hard", 29.6, None),
            pass("filter", 5.0, Some(2)),
            pass("mark", 0.1, None),
            pass("filter", 5.0, Some(2)),
            pass("clear", 0.3, None),
        ];
        let row = row("jenga", passes_ms.into());
        assert_eq!(passes(&row), "hard 74.0 %, filter (2 times) 25.0 % (2 of 8), 2 others 1.0 %");
    }

    fn row(group: &str, passes: Vec<PassStats>) -> BenchRow {
        BenchRow {
            scene: "jenga",
            ground_alone: false,
            technique: "edtsm-star",
            params: serde_json::Map::new(),
            shadow_map: MAP,
            group: group.into(),
            gpu_ms: Some(40.0),
            gpu_ms_min: None,
            gpu_ms_max: None,
            ratio: None,
            added_ms: None,
            added_to_frame: None,
            frame_ratio: None,
            passes,
            total_gpu_ms: None,
            memory_bytes: 0,
        }
    }

    #[test]
    fn ratios_are_between_rows_of_one_group() {
        let variants = variants().unwrap();
        let mut results: Vec<_> = variants.iter().map(|v| row(&v.group, vec![])).collect();
        for (r, v) in results.iter_mut().zip(&variants) {
            let far = if v.ground_alone { 8.0 } else { 2.0 };
            r.added_to_frame = match label(&v.choice).as_str() {
                FILTER => Some(0.5),
                SUBJECT => Some(0.5 * far),
                _ => Some(100.0),
            };
            r.frame_ratio = r.added_to_frame.map(|a| 1.0 + a);
        }
        let origin = Origin::default();
        let text = conclusions(&Bench { suite: "penumbrae", origin, size: [1, 1], frames: 1, results }, &variants);
        assert_eq!(text.matches("| - | - | 2.00 | 1.500 | 2.000 |").count(), shipped::ALL.len(), "{text}");
        assert_eq!(text.matches("ground alone | - | - | 8.00 | 1.500 | 5.000 |").count(), 1, "{text}");
    }

    #[test]
    fn the_ground_is_a_group_of_its_own() {
        let variants = variants().unwrap();
        let ground: Vec<_> = variants.iter().filter(|v| v.ground_alone).collect();
        assert_eq!(ground.iter().map(|v| label(&v.choice)).collect::<Vec<_>>(), ALONE);
        assert!(ground.iter().all(|v| v.group == ground[0].group));
        assert!(variants.iter().filter(|v| !v.ground_alone).all(|v| v.group == v.scene.name));
        assert_eq!(variants.len(), 8 * shipped::ALL.len() + 4);
    }
}
