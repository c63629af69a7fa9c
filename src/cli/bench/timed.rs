//! Variants timed in turns, A B A B, so that what drifts drifts for all of them: what the suites of that kind share, and
//! those of them that draw no conclusions.

use super::driver::*;
use super::judge::real_time;
use crate::cli::report::{self, BenchRow};
use crate::cli::stats::{self, FRAME_PASSES, PassStats, Span};
use crate::cli::techniques::Choice;
use edgeshade::scene::{RenderDesc, Renderer, shipped};
use edgeshade::technique::Technique;
use edgeshade::timing::FrameTiming;
use std::collections::BTreeMap;
use std::collections::btree_map::Entry;

pub const BASE: Suite<BenchRow> = Suite {
    frames: |plan| plan.frames + 1,
    measure,
    settings: |plan| Record::of([("frames", plan.frames.into())]),
    page,
    ..Suite::BASE
};

pub static TECHNIQUES: Suite<BenchRow> = Suite {
    name: "techniques",
    about: "every real-time technique on every shipped scene",
    extent: |quick| extent(quick, every_scene(), &[1024]),
    variants: |_| Ok(available(&defaults())),
    ..BASE
};

pub static MAP_SIZES: Suite<BenchRow> = Suite {
    name: "map-sizes",
    about: "every real-time technique, maps of 512 to 4096 texels",
    extent: |quick| extent(quick, vec![shipped::DEFAULT], &[512, 1024, 2048, 4096]),
    variants: |_| Ok(available(&defaults())),
    group: |_, _, variant| Some(variant.label.clone()),
    ..BASE
};

pub static REVECTORIZATION: Suite<BenchRow> = Suite {
    name: "revectorization",
    about: "what the RBSM family adds to sm, maps of 512 to 4096 texels",
    extent: |quick| extent(quick, vec![shipped::DEFAULT, "robot"], &[512, 1024, 2048, 4096]),
    variants: |_| Ok(available(&FAMILY)),
    group: |scene, map, variant| {
        let is_averaged = ["pcf", "rpcf"].contains(&variant.choice.info.id);
        Some(format!("{scene} {map} {}", if is_averaged { "averaged" } else { "hard" }))
    },
    ..BASE
};

pub static PCF: Suite<BenchRow> = Suite {
    name: "pcf",
    about: "pcf of widths 3 to 31, loop and gather, with and without skipping",
    extent: |quick| extent(quick, vec![shipped::DEFAULT], &[1024]),
    variants: |_| widths(),
    group: |_, _, variant| Some(format!("width {}", variant.choice.params.int("width"))),
    ..BASE
};

const FAMILY: [Wanted; 21] = [
    ("sm", &[]),
    ("rbsm", &[("skip", "off")]),
    ("rbsm", &[("skip", "list")]),
    ("rbsm-branches", &[("skip", "off")]),
    ("rbsm-branches", &[("skip", "list")]),
    ("rbsm-filtered", &[("skip", "off")]),
    ("rbsm-filtered", &[("skip", "list")]),
    ("rbsm-branches", &[("variant", "filtered"), ("skip", "off")]),
    ("rbsm-branches", &[("variant", "filtered"), ("skip", "list")]),
    ("rbsm-star", &[("skip", "off")]),
    ("rbsm-star", &[("skip", "list")]),
    ("rbsm-profile", &[("skip", "off")]),
    ("rbsm-profile", &[("skip", "list")]),
    ("rbsm-profile", &[("quality", "neighbours")]),
    ("rbsm-profile", &[("quality", "line")]),
    ("pcf", &[("width", "7")]),
    ("rpcf", &[("skip", "off")]),
    ("rpcf", &[("skip", "list")]),
    ("rpcf", &[("skip", "bounds")]),
    ("rpcf", &[("visibility", "star")]),
    ("rpcf", &[("visibility", "profile")]),
];

/// These scenes and maps; of a quick run the default scene alone, with and without what stands on its ground.
pub fn extent(quick: bool, mut scenes: Vec<&'static str>, maps: &'static [u32]) -> Extent {
    scenes.retain(|s| !quick || s.starts_with(shipped::DEFAULT));
    Extent { scenes, maps, size: SIZE }
}

fn defaults() -> Vec<Wanted> {
    real_time().map(|id| (id, &[][..])).collect()
}

fn widths() -> Result<Variants> {
    let mut found = vec![];
    for width in ["3", "7", "15", "31"] {
        for skip in ["off", "pixels", "tiles"] {
            for fetch in ["loop", "gather"] {
                let settings = [("width", width), ("fetch", fetch), ("skip", skip)];
                let choice = Choice::new("pcf", &settings.map(|(n, v)| (n.to_owned(), v.to_owned())))?;
                found.push(Variant::new(choice));
            }
        }
    }
    Ok(Variants { found, left_out: vec![] })
}

/// After the name of a scene: nothing is drawn but what its objects stand on.
const GROUND_ALONE: &str = ", ground alone";

/// A group at a time: its variants are compared with each other.
fn measure(host: &Host, run: &mut Run<'_, BenchRow>, scene: &'static str) -> Result<()> {
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
        let mut renderers: BTreeMap<u32, Renderer<'_>> = BTreeMap::new();
        let mut prepared: Vec<(Box<dyn Technique>, u64, Vec<FrameTiming>)> = vec![];
        for &(_, map_size, variant) in members {
            let renderer = match renderers.entry(map_size) {
                Entry::Occupied(entry) => entry.into_mut(),
                Entry::Vacant(entry) => {
                    let desc = RenderDesc { size, map_size, ..RenderDesc::default() };
                    entry.insert(Renderer::new(host, &stage.scene, stage.camera, &stage.light, desc)?)
                }
            };
            let technique = renderer.prepare(variant.choice.info.id, &variant.choice.params)?;
            let memory = technique.memory_bytes();
            prepared.push((technique, memory, vec![]));
        }
        // Turn 0 warms up.
        for turn in 0..=plan.frames {
            for ((_, map, _), (technique, _, frames)) in members.iter().zip(&mut prepared) {
                let Some(renderer) = renderers.get_mut(map) else { continue };
                let timing = renderer.frame(technique.as_mut())?;
                frames.extend((turn > 0).then_some(timing));
                run.drawn(1);
            }
        }
        for ((group, shadow_map, variant), (_, memory_bytes, frames)) in members.iter().zip(&prepared) {
            let Choice { info, params } = &variant.choice;
            let figures = BenchRow {
                scene: shipped.name,
                ground_alone: ground.is_some(),
                technique: info.id,
                params: report::params(info, params),
                shadow_map: *shadow_map,
                group: group.clone(),
                memory_bytes: *memory_bytes,
                ..times(frames, &prepared[0].2)
            };
            run.push(Row { label: variant.label.clone(), group: group.clone(), ..Row::from(figures) });
        }
    }
    Ok(())
}

/// What a frame's technique takes more than that of another frame.
fn added_ms(mine: &FrameTiming, base: &FrameTiming) -> f64 {
    stats::technique_ms(mine) - stats::technique_ms(base)
}

/// The times of a row; `first` has the same turns of the group's first variant.
fn times(frames: &[FrameTiming], first: &[FrameTiming]) -> BenchRow {
    let span = stats::technique(frames);
    let over_turns = |f: fn(&FrameTiming, &FrameTiming) -> f64| {
        let values = frames.iter().zip(first).map(|(mine, base)| f(mine, base));
        Span::of(values.filter(|v| v.is_finite())).map(|s| s.median)
    };
    BenchRow {
        gpu_ms: span.map(|s| s.median),
        gpu_ms_min: span.map(|s| s.min),
        gpu_ms_max: span.map(|s| s.max),
        ratio: over_turns(|mine, base| stats::technique_ms(mine) / stats::technique_ms(base)),
        added_ms: span.and(over_turns(added_ms)),
        added_to_frame: over_turns(|mine, base| added_ms(mine, base) / base.total_gpu_ms),
        frame_ratio: over_turns(|mine, base| mine.total_gpu_ms / base.total_gpu_ms),
        passes: stats::passes(frames),
        total_gpu_ms: stats::total(frames).map(|s| s.median),
        ..BenchRow::default()
    }
}

/// The times of all rows.
pub fn page(results: &Results<'_, BenchRow>) -> String {
    let mut text = results.head(&format!("{} frames a variant, drawn in turns.", results.plan.frames));
    text += "GPU milliseconds, median (range). `technique` is its own passes; `ratio` is against the first row of the group, and \
             `adds` what it adds to that row's whole frame.\n\n";
    let heads =
        "<scene | <technique | <settings | map | technique ms | ratio | adds | shadow map ms | frame ms | tiles | MiB";
    let line = |row: &Row<BenchRow>| {
        let r = &row.figures;
        let map_ms = r.passes.iter().find(|p| p.name == "shadow map").map(|p| p.gpu_ms);
        let tiles = r.passes.iter().find_map(|p| Some((p.tiles_active?, p.tiles_total?)));
        let [median, min, max] = [r.gpu_ms, r.gpu_ms_min, r.gpu_ms_max].map(|ms| number(ms, 3));
        vec![
            if r.ground_alone { r.group.clone() } else { r.scene.to_owned() },
            r.technique.to_owned(),
            row.label.split_once(' ').map_or("-", |(_, settings)| settings).to_owned(),
            r.shadow_map.to_string(),
            format!("{median} ({min}–{max})"),
            number(r.ratio, 3),
            r.added_to_frame.map_or_else(|| "-".into(), |a| format!("{:+.1} %", 100.0 * a)),
            number(map_ms, 3),
            number(r.total_gpu_ms, 3),
            tiles.map_or_else(|| "-".into(), |(active, total)| format!("{active} of {total}")),
            number(r.memory_bytes as f64 / f64::from(1 << 20), 1),
        ]
    };
    text += &table(heads, results.rows.iter().map(line));
    let note = left_out_note(&results.plan.left_out);
    if note.is_empty() { text } else { text + "\n" + note.trim_end() + "\n" }
}

/// Passes below this share of the technique's time are told together.
const SMALL_SHARE: f64 = 0.01;

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
pub mod tests {
    use super::*;

    /// A row that takes so many times as long as the first of its group, whose frame takes 100 ms.
    pub fn row(group: &str, label: &str, gpu_ms: f64, base: f64) -> Row<BenchRow> {
        let added = gpu_ms - base;
        let figures = BenchRow {
            scene: "jenga",
            group: group.into(),
            gpu_ms: Some(gpu_ms),
            added_ms: Some(added),
            added_to_frame: Some(added / 100.0),
            frame_ratio: Some(1.0 + added / 100.0),
            ..BenchRow::default()
        };
        Row { label: label.into(), group: group.into(), ..Row::from(figures) }
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
        let row = BenchRow { passes: passes_ms.into(), ..BenchRow::default() };
        assert_eq!(passes(&row), "hard 74.0 %, filter (2 times) 25.0 % (2 of 8), 2 others 1.0 %");
    }
}
