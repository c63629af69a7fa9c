//! Suite `penumbrae`: what fixed-size penumbrae cost, next to hard shadows and to a filter of the same width.

use super::Variant;
use super::judge::label;
use crate::cli::report::{Bench, BenchRow};
use crate::cli::stats::FRAME_PASSES;
use crate::cli::techniques::Choice;
use edgeshade::Result;
use edgeshade::scene::shipped::{self, Shipped};
use edgeshade::table::number;

/// Side of the map of all of them, texels: that which the default penumbra is 15 texels of.
const MAP: u32 = 1024;
const SUBJECT: &str = "edtsm-star";
const FILTER: &str = "pcf width=15";

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

/// Share and tiles of each of a technique's own passes.
fn passes(row: &BenchRow) -> String {
    let own: Vec<_> = row.passes.iter().filter(|p| !FRAME_PASSES.contains(&p.name.as_str())).collect();
    let sum: f64 = own.iter().map(|p| p.gpu_ms).sum();
    let text = own.iter().map(|p| {
        let share = (sum > 0.0).then(|| 100.0 * p.gpu_ms / sum);
        let tiles = p.tiles_active.zip(p.tiles_total).map(|(active, total)| format!(" ({active} of {total})"));
        format!("{} {} %{}", p.name, number(share, 1), tiles.unwrap_or_default())
    });
    text.collect::<Vec<_>>().join(", ")
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::cli::stats::PassStats;

    #[test]
    fn passes_of_the_frame_have_no_share() {
        let pass = |name: &str, gpu_ms, tiles_active: Option<u32>| PassStats {
            name: name.into(),
            gpu_ms,
            gpu_ms_min: gpu_ms,
            gpu_ms_max: gpu_ms,
            tiles_total: tiles_active.map(|_| 8),
            tiles_active,
        };
        let passes_ms = [pass("g-buffer", 5.0, None), pass("hard", 3.0, None), pass("filter", 1.0, Some(2))];
        let row = BenchRow {
            scene: "jenga",
            ground_alone: false,
            technique: "edtsm-star",
            params: serde_json::Map::new(),
            shadow_map: MAP,
            group: "jenga".into(),
            gpu_ms: Some(4.0),
            gpu_ms_min: None,
            gpu_ms_max: None,
            ratio: None,
            added_ms: None,
            added_to_frame: None,
            frame_ratio: None,
            passes: passes_ms.into(),
            total_gpu_ms: None,
            memory_bytes: 0,
        };
        assert_eq!(passes(&row), "hard 75.0 %, filter 25.0 % (2 of 8)");
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
