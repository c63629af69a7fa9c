//! Variants timed in turns, shared by the suites of that kind.

use super::driver::*;
use crate::cli::stats::{self, FRAME_PASSES, PassStats, Span};
use edgeshade::scene::{RenderDesc, Renderer, shipped};
use edgeshade::timing::FrameTiming;

pub const BASE: Suite = Suite {
    frames: |plan| plan.frames + 1,
    measure,
    settings: |plan| Record::of([("frames", plan.frames.into())]),
    page,
    ..Suite::BASE
};

/// The given scenes and maps. A quick run uses the default scene alone, complete and with its ground alone.
pub fn extent(quick: bool, mut scenes: Vec<&'static str>, maps: &'static [u32]) -> Extent {
    scenes.retain(|s| !quick || s.starts_with(shipped::DEFAULT));
    Extent { scenes, maps, size: SIZE }
}

/// Suffix of a scene whose ground alone is drawn.
const GROUND_ALONE: &str = ", ground alone";

/// Draws one group at a time, because its variants are compared with each other.
fn measure(host: &Host, run: &mut Run<'_>, scene: &'static str) -> Result<()> {
    let plan = run.plan;
    let size = plan.size;
    run.start(scene);
    let ground = scene.strip_suffix(GROUND_ALONE);
    let shipped = find_scene(ground.unwrap_or(scene))?;
    let stage = if ground.is_some() { Stage::ground(shipped, size)? } else { Stage::shipped(shipped, size)? };
    let cells = plan.maps.iter().flat_map(|&map| plan.members(scene, map).map(move |(v, group)| (group, map, v)));
    let mut cells: Vec<(String, u32, &Variant)> = cells.collect();
    let names: Vec<_> = cells.iter().map(|c| c.0.clone()).collect();
    cells.sort_by_key(|c| names.iter().position(|name| *name == c.0));
    for members in cells.chunk_by(|a, b| a.0 == b.0) {
        let mut maps: Vec<u32> = members.iter().map(|m| m.1).collect();
        maps.dedup();
        let renderer = |&map_size: &u32| {
            let desc = RenderDesc { size, map_size, ..RenderDesc::default() };
            Renderer::new(host, &stage.scene, stage.camera, &stage.light, desc)
        };
        let mut renderers = maps.iter().map(renderer).collect::<Result<Vec<_>>>()?;
        let place = |map| maps.iter().position(|&m| m == map).unwrap_or(0);
        let variants: Vec<_> = members.iter().map(|&(_, map, variant)| (place(map), variant)).collect();
        let drawn = run.in_turns(&mut renderers, &variants)?;
        for ((group, map, variant), mine) in members.iter().zip(&drawn) {
            let place = Record::of([("scene", shipped.name.into())])
                .and(ground.map(|_| ("ground_alone", true.into())))
                .and(variant.fields())
                .and([("shadow_map", (*map).into()), ("group", group.as_str().into())]);
            let row = row(&variant.label, group, place, &mine.frames, &drawn[0].frames, mine.memory_bytes);
            run.push(row.and_shown([("scene", scene.into())]), 0);
        }
    }
    Ok(())
}

/// Milliseconds that a technique takes in `mine` beyond those in `base`.
fn added_ms(mine: &FrameTiming, base: &FrameTiming) -> f64 {
    stats::technique_ms(mine) - stats::technique_ms(base)
}

/// A row of times. `first` holds the same turns of the group's first variant.
fn row(label: &str, group: &str, place: Record, frames: &[FrameTiming], first: &[FrameTiming], memory: u64) -> Row {
    let over_turns = |f: fn(&FrameTiming, &FrameTiming) -> f64| {
        let values = frames.iter().zip(first).map(|(mine, base)| f(mine, base));
        Span::of(values.filter(|v| v.is_finite())).map(|s| s.median)
    };
    let span = stats::technique(frames);
    let [median, min, max] = [span.map(|s| s.median), span.map(|s| s.min), span.map(|s| s.max)];
    let added_to_frame = over_turns(|mine, base| added_ms(mine, base) / base.total_gpu_ms);
    let passes = stats::passes(frames);
    let map_ms = passes.iter().find(|p| p.name == "shadow map").map(|p| p.gpu_ms);
    let tiles = passes.iter().find_map(|p| Some(format!("{} of {}", p.tiles_active?, p.tiles_total?)));
    let shown = [
        ("settings", label.split_once(' ').map_or("-", |(_, settings)| settings).into()),
        ("range", format!("{} ({}–{})", number(median, 3), number(min, 3), number(max, 3)).into()),
        ("adds", added_to_frame.map(|a| format!("{:+.1} %", 100.0 * a)).into()),
        ("map_ms", map_ms.into()),
        ("tiles", tiles.into()),
        ("mib", (memory as f64 / f64::from(1 << 20)).into()),
    ];
    let figures = [
        // Times of the technique's own passes: median and range over the frames.
        ("gpu_ms", median.into()),
        ("gpu_ms_min", min.into()),
        ("gpu_ms_max", max.into()),
        // Comparisons with the group's first variant in the same turn, as medians over the turns: ratio of the own
        // passes, milliseconds added, milliseconds added as a share of the first variant's whole frame, and ratio of
        // the whole frames.
        ("ratio", over_turns(|mine, base| stats::technique_ms(mine) / stats::technique_ms(base)).into()),
        ("added_ms", span.and(over_turns(added_ms)).into()),
        ("added_to_frame", added_to_frame.into()),
        ("frame_ratio", over_turns(|mine, base| mine.total_gpu_ms / base.total_gpu_ms).into()),
        ("passes", Field::Passes(passes)),
        ("total_gpu_ms", stats::total(frames).map(|s| s.median).into()),
        ("memory_bytes", memory.into()),
    ];
    Row::new(label, group, place.and(figures)).and_shown(shown)
}

/// A table of the times of all rows.
pub fn page(results: &Results<'_>) -> String {
    const COLUMNS: [Column; 11] = [
        ("<scene", "scene", 0),
        ("<technique", "technique", 0),
        ("<settings", "settings", 0),
        ("map", "shadow_map", 0),
        ("technique ms", "range", 0),
        ("ratio", "ratio", 3),
        ("adds", "adds", 0),
        ("shadow map ms", "map_ms", 3),
        ("frame ms", "total_gpu_ms", 3),
        ("tiles", "tiles", 0),
        ("MiB", "mib", 1),
    ];
    let mut text = results.head(&format!("{} frames per variant, drawn in turns.", results.plan.frames));
    text += "GPU milliseconds, median (range). `technique`: its own passes; `ratio`: to the first row of the group; `adds`: share \
             that it adds to the whole frame of that row.\n\n";
    text += &table(&COLUMNS, &results.rows);
    let note = left_out_note(&results.plan.left_out);
    if note.is_empty() { text } else { text + "\n" + note.trim_end() + "\n" }
}

/// Share of the technique's time below which passes are summed up.
const SMALL_SHARE: f64 = 0.01;

/// Share and tiles of each of a technique's own passes. Passes of the same name are joined, and the smallest passes
/// are summed up at the end.
pub fn passes(row: &Row) -> String {
    let Field::Passes(passes) = row.fields.get("passes") else { return String::new() };
    let mut own: Vec<(PassStats, u32)> = vec![];
    for pass in passes.iter().filter(|p| !FRAME_PASSES.contains(&p.name.as_str())) {
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
pub mod tests {
    use super::*;

    /// A row of a technique that takes `gpu_ms`. The first of its group takes `base` in a frame of 100 ms.
    pub fn row(group: &str, label: &str, gpu_ms: f64, base: f64) -> Row {
        let added = gpu_ms - base;
        let figures = Record::of([
            ("gpu_ms", gpu_ms.into()),
            ("added_ms", added.into()),
            ("added_to_frame", (added / 100.0).into()),
            ("frame_ratio", (1.0 + added / 100.0).into()),
        ]);
        Row::new(label, group, figures)
    }

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
        let row = Row::new("", "", Record::of([("passes", Field::Passes(passes_ms.into()))]));
        assert_eq!(passes(&row), "hard 74.0 %, filter (2 times) 25.0 % (2 of 8), 2 others 1.0 %");
    }
}
