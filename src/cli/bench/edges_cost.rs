//! Suite `edges-cost`: what hard shadows cost that know the casters' edges, as \[Kenzel 2013\] sets them side by side in figures
//! 5.2 to 5.4: the update of the shadow map, the shading, what goes through the pipeline, memory.

use super::edges::has_no_map;
use super::judge::{Wanted, available, label, left_out_note, possible, save};
use super::{Args, SIZE};
use crate::cli::progress::Progress;
use crate::cli::report::{self, Origin};
use crate::cli::stage::Stage;
use crate::cli::stats::{self, FRAME_PASSES, PassStats, Span};
use crate::cli::techniques::Choice;
use edgeshade::host::Host;
use edgeshade::scene::shipped::{self, Shipped};
use edgeshade::scene::{RenderDesc, Renderer, Scene};
use edgeshade::table::number;
use edgeshade::technique::Technique;
use edgeshade::timing::{FrameTiming, PassTiming, Statistics};
use edgeshade::{Error, Need, Result};
use glam::{DAffine3, DVec3, dvec3};
use serde::Serialize;
use serde_json::{Map, Value};
use std::collections::BTreeMap;

/// Side of the map, texels.
const MAP: u32 = 1024;
/// Size of the image of a quick run, which draws the first scene alone.
const QUICK: [u32; 2] = [320, 180];
/// What the others are set against.
const BASE: &str = "sm";

/// As far as registry and device have them.
const CONTENDERS: [Wanted; 6] = [
    (BASE, &[]),
    ("pcf", &[("width", "5")]),
    ("sssm", &[]),
    ("edsm", &[]),
    ("edsm-x", &[("slots", "2")]),
    ("shadow-volumes", &[("path", "compute")]),
];

/// The one pass of every frame that draws the casters into the map.
const MAP_PASS: &str = "shadow map";

/// Names of the scenes: few triangles and many, as in the thesis.
const SCENES: [&str; 2] = ["jenga", "knots"];
/// Where the knots stand, by the place of the shipped one, metres: side by side as the light sees them.
const KNOTS: [DVec3; 2] = [dvec3(-0.6, 0.0, 0.9), dvec3(2.0, 0.0, -1.4)];
/// The one object of the knot's scene that is not repeated.
const FLOOR: &str = "studio";

/// What the suite writes.
#[derive(Serialize)]
struct Figures {
    suite: &'static str,
    #[serde(flatten)]
    origin: Origin,
    size: [u32; 2],
    shadow_map: u32,
    /// Frames measured of each row, drawn in turns.
    frames: u32,
    /// What registry or device do not have.
    left_out: Vec<String>,
    results: Vec<Row>,
}

/// One technique in one scene in one state.
#[derive(Serialize)]
struct Row {
    scene: &'static str,
    triangles: usize,
    state: State,
    technique: &'static str,
    params: Map<String, Value>,
    #[serde(skip)]
    label: String,
    times: Parts<Time>,
    /// Of the whole frame, with G-buffer and lighting.
    frame: Time,
    /// Null where the device counts nothing.
    statistics: Option<Parts<Through>>,
    memory: Memory,
    passes: Vec<PassStats>,
}

/// Whether map and casters' edges are kept from frame to frame.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
enum State {
    Standing,
    Moving,
}

const STATES: [State; 2] = [State::Standing, State::Moving];

/// Something of a frame in its two parts, and of both.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
struct Parts<T> {
    /// The shadow map and what the technique makes of the casters: what a light that stands still spares.
    update: T,
    /// What the technique does in every frame.
    shading: T,
    both: T,
}

/// Null where there is nothing, or no timestamps.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
struct Time {
    median_ms: Option<f64>,
    least_ms: Option<f64>,
    /// By the time of the base in the same turn, median over the turns.
    ratio: Option<f64>,
}

/// What goes through the pipeline in one frame.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
struct Through {
    /// Assembled from the draws' vertices.
    primitives: u64,
    /// Runs of fragment shaders.
    fragments: u64,
    /// Runs of compute shaders.
    compute: u64,
}

/// Bytes of device memory.
#[derive(Clone, Copy, Serialize)]
struct Memory {
    technique_bytes: u64,
    /// 0 where none is looked at.
    shadow_map_bytes: u64,
    /// Adjacency of the casters' triangles, shared by all techniques; 0 for those that do not need it.
    casters_bytes: u64,
}

impl Memory {
    fn total(&self) -> u64 {
        self.technique_bytes + self.shadow_map_bytes + self.casters_bytes
    }
}

/// Which part of a frame a pass belongs to.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Part {
    Update,
    Shading,
}

/// Tells a technique's passes apart.
struct Split {
    /// How often a pass of each name comes in a frame in which nothing has moved.
    kept: BTreeMap<String, usize>,
    has_map: bool,
}

impl Split {
    fn new(standing: &FrameTiming, has_map: bool) -> Self {
        let mut kept = BTreeMap::new();
        for pass in &standing.passes {
            *kept.entry(pass.name.clone()).or_default() += 1;
        }
        Self { kept, has_map }
    }

    /// The passes that the technique answers for: not the G-buffer nor the lighting, and a shadow map only if it looks at one.
    /// A pass that a frame has oftener than one in which nothing has moved is of the update.
    fn passes<'a>(&'a self, frame: &'a FrameTiming) -> impl Iterator<Item = (Part, &'a PassTiming)> {
        let own = |pass: &PassTiming| match &pass.name[..] {
            MAP_PASS => self.has_map,
            name => !FRAME_PASSES.contains(&name),
        };
        frame.passes.iter().enumerate().filter(move |(_, pass)| own(pass)).map(|(i, pass)| {
            let repeat = frame.passes[..i].iter().filter(|p| p.name == pass.name).count();
            let is_kept = repeat < self.kept.get(&pass.name).copied().unwrap_or(0);
            (if is_kept { Part::Shading } else { Part::Update }, pass)
        })
    }

    /// Milliseconds.
    fn ms(&self, frame: &FrameTiming) -> Parts<f64> {
        let mut sum = Parts::default();
        for (part, pass) in self.passes(frame) {
            *match part {
                Part::Update => &mut sum.update,
                Part::Shading => &mut sum.shading,
            } += pass.gpu_ms;
            sum.both += pass.gpu_ms;
        }
        sum
    }

    /// `None` without statistics.
    fn through(&self, frame: &FrameTiming) -> Option<Parts<Through>> {
        let mut sum = Parts::<Through>::default();
        for (part, pass) in self.passes(frame) {
            let statistics = pass.statistics?;
            match part {
                Part::Update => sum.update.add(&statistics),
                Part::Shading => sum.shading.add(&statistics),
            }
            sum.both.add(&statistics);
        }
        Some(sum)
    }
}

impl Through {
    fn add(&mut self, s: &Statistics) {
        self.primitives += s.input_primitives;
        self.fragments += s.fragment_invocations;
        self.compute += s.compute_invocations;
    }
}

/// Pixels of all frames, for the estimate of the time.
pub fn pixels(args: &Args) -> Result<u64> {
    let scenes = if args.quick { 1 } else { SCENES.len() };
    let size = args.size.unwrap_or(if args.quick { QUICK } else { SIZE });
    Ok(super::pixels(size, scenes * STATES.len() * CONTENDERS.len(), args.frames + 1))
}

pub fn run(args: &Args, host: &Host) -> Result<()> {
    let size = args.size.unwrap_or(if args.quick { QUICK } else { SIZE });
    let (choices, mut left_out) = available(&CONTENDERS);
    let (choices, impossible) = possible(choices, host.context().features());
    left_out.extend(impossible);
    let mut results = vec![];
    for name in SCENES.into_iter().take(if args.quick { 1 } else { SCENES.len() }) {
        results.extend(one_scene(host, name, &stage(name, size)?, size, args.frames, &choices)?);
    }
    let figures = Figures {
        suite: "edges-cost",
        origin: Origin::new(host),
        size,
        shadow_map: MAP,
        frames: args.frames,
        left_out,
        results,
    };
    save(args, host, figures.suite, &figures, &page(&figures)).map(drop)
}

fn stage(name: &str, size: [u32; 2]) -> Result<Stage> {
    let find = |name: &str| -> Result<&'static Shipped> {
        shipped::find(name).ok_or_else(|| Error::Usage(format!("there is no scene {name}")))
    };
    if name == SCENES[0] {
        return Stage::shipped(find(name)?, size);
    }
    let mut stage = Stage::shipped(find("knot")?, size)?;
    repeat_knot(&mut stage.scene);
    Ok(stage)
}

/// About half a million triangles: the knot with its foot several times on one floor.
fn repeat_knot(scene: &mut Scene) {
    let Scene { instances, meshes, .. } = scene;
    let (floor, knot): (Vec<_>, Vec<_>) = instances.drain(..).partition(|i| meshes[i.mesh].name == FLOOR);
    *instances = floor;
    for offset in KNOTS {
        instances.extend(knot.iter().map(|i| {
            let mut moved = *i;
            moved.world_from_object = DAffine3::from_translation(offset) * i.world_from_object;
            moved
        }));
    }
}

/// The frames of one technique in one state.
type Frames = Vec<FrameTiming>;

fn one_scene(
    host: &Host,
    name: &'static str,
    stage: &Stage,
    size: [u32; 2],
    frames: u32,
    choices: &[Choice],
) -> Result<Vec<Row>> {
    let renderer = |state: State, statistics: bool| {
        let dynamic_light = state == State::Moving;
        let desc = RenderDesc { size, map_size: MAP, dynamic_light, statistics, ..RenderDesc::default() };
        Renderer::new(host, &stage.scene, stage.camera, &stage.light, desc)
    };
    let progress = Progress::start(format!("suite edges-cost, {name}"));
    let total = u64::from(frames) * (choices.len() * STATES.len()) as u64;
    let mut measured: Vec<[Frames; 2]> = choices.iter().map(|_| [vec![], vec![]]).collect();
    let mut memory = vec![];
    {
        let mut renderers = [renderer(STATES[0], false)?, renderer(STATES[1], false)?];
        let mut prepared: Vec<[Box<dyn Technique>; 2]> = vec![];
        for choice in choices {
            let [a, b] = &renderers;
            let prepare = |r: &Renderer<'_>| r.prepare(choice.info.id, &choice.params);
            prepared.push([prepare(a)?, prepare(b)?]);
        }
        // Turn 0 warms up: a light that stands still has its map and edges then.
        let mut done = 0;
        for turn in 0..=frames {
            for (techniques, found) in prepared.iter_mut().zip(&mut measured) {
                for ((renderer, technique), found) in renderers.iter_mut().zip(techniques).zip(found) {
                    let timing = renderer.frame(technique.as_mut())?;
                    if turn > 0 {
                        found.push(timing);
                        done += 1;
                        progress.set(done, total);
                    }
                }
            }
        }
        let adjacency = renderers[0].casters().map_or(0, |c| c.casters.memory_bytes());
        memory.extend(choices.iter().zip(&prepared).map(|(choice, techniques)| Memory {
            technique_bytes: techniques[0].memory_bytes(),
            shadow_map_bytes: if has_no_map(choice) { 0 } else { renderers[0].shadow_map().memory_bytes() },
            casters_bytes: if choice.info.needs.contains(&Need::Casters) { adjacency } else { 0 },
        }));
    }
    // Counting may slow the passes down: it has a frame of its own.
    let mut counted = vec![None; choices.len()];
    if host.context().features().pipeline_statistics {
        let mut renderer = renderer(State::Moving, true)?;
        for (choice, counted) in choices.iter().zip(&mut counted) {
            let mut technique = renderer.prepare(choice.info.id, &choice.params)?;
            *counted = Some(renderer.frame(technique.as_mut())?);
        }
    }
    let base = choices.iter().position(|c| label(c) == BASE);
    let splits: Vec<_> = choices
        .iter()
        .zip(&measured)
        .map(|(choice, [standing, _])| {
            Split::new(standing.last().unwrap_or(&FrameTiming::default()), !has_no_map(choice))
        })
        .collect();
    let mut rows = vec![];
    for (s, state) in STATES.into_iter().enumerate() {
        for (i, choice) in choices.iter().enumerate() {
            let base_frames = base;
            let base: Vec<_> = base.map_or_else(Vec::new, |b| measured[b][s].iter().map(|f| splits[b].ms(f)).collect());
            let mine: Vec<_> =
                measured[i][s].iter().filter(|f| !f.passes.is_empty()).map(|f| splits[i].ms(f)).collect();
            let through = counted[i].as_ref().and_then(|f| splits[i].through(f));
            rows.push(Row {
                scene: name,
                triangles: stage.scene.triangles(),
                state,
                technique: choice.info.id,
                params: report::params(choice.info, &choice.params),
                label: label(choice),
                times: times(&mine, &base),
                frame: whole(&measured[i][s], base_frames.map_or(&[], |b| &measured[b][s])),
                statistics: through.map(|t| if state == State::Moving { t } else { standing(t) }),
                memory: memory[i],
                passes: stats::passes(&measured[i][s]),
            });
        }
    }
    Ok(rows)
}

/// Where nothing moves only the shading is left.
fn standing(moving: Parts<Through>) -> Parts<Through> {
    Parts { update: Through::default(), shading: moving.shading, both: moving.shading }
}

/// Of the turns; `base` has the same ones.
fn times(mine: &[Parts<f64>], base: &[Parts<f64>]) -> Parts<Time> {
    let of = |pick: fn(&Parts<f64>) -> f64| {
        let span = Span::of(mine.iter().map(pick));
        let ratios = mine.iter().zip(base).map(|(a, b)| pick(a) / pick(b)).filter(|r| r.is_finite());
        Time {
            median_ms: span.map(|s| s.median),
            least_ms: span.map(|s| s.min),
            ratio: Span::of(ratios).map(|s| s.median),
        }
    };
    Parts { update: of(|p| p.update), shading: of(|p| p.shading), both: of(|p| p.both) }
}

/// Whole frames; `base` has the same turns.
fn whole(mine: &[FrameTiming], base: &[FrameTiming]) -> Time {
    let span = Span::of(mine.iter().filter(|f| !f.passes.is_empty()).map(|f| f.total_gpu_ms));
    let ratios = mine.iter().zip(base).map(|(a, b)| a.total_gpu_ms / b.total_gpu_ms).filter(|r| r.is_finite());
    Time { median_ms: span.map(|s| s.median), least_ms: span.map(|s| s.min), ratio: Span::of(ratios).map(|s| s.median) }
}

fn page(figures: &Figures) -> String {
    let [w, h] = figures.size;
    let Origin { device, driver, version, .. } = &figures.origin;
    let mut text = format!(
        "# Suite `edges-cost`\n\n{device}, {driver}; Edgeshade {version}; {w}x{h}, shadow map {MAP}x{MAP}, {} frames a row, \
         drawn in turns.\n\n\
         `update`: the shadow map and what the technique makes of the casters, all that is spared while light and casters \
         stand still; `shading`: the technique's passes of every frame; `both`: their sum, without G-buffer and lighting. GPU \
         milliseconds, median (least); `x`: by those of `{BASE}` in the same turn, median over the turns. `shadow-volumes` \
         looks at no shadow map: none is counted for it. `frame`: all of it, with G-buffer and lighting. A driver on the CPU \
         puts off what is drawn and not what is computed, so that its times of single passes of an update mean little: \
         there only `frame` tells, and an update is a moving frame less a standing one.\n\n{}",
        figures.frames,
        left_out_note(&figures.left_out)
    );
    let groups = || figures.results.chunk_by(|a, b| (a.scene, a.state) == (b.scene, b.state));
    for group in groups() {
        let state = match group[0].state {
            State::Standing => "light and casters stand still",
            State::Moving => "light or casters move",
        };
        text += &format!(
            "## {}, {} triangles, {state}\n\n\
             | technique | update ms | x | shading ms | x | both ms | x | frame ms | x |\n|---|--:|--:|--:|--:|--:|--:|--:|--:|\n",
            group[0].scene, group[0].triangles
        );
        for r in group {
            let cells = [r.times.update, r.times.shading, r.times.both, r.frame].map(|t| {
                let least = number(t.least_ms, 3);
                format!("{} ({least}) | {}", number(t.median_ms, 3), number(t.ratio, 2))
            });
            text += &format!("| {} | {} |\n", r.label, cells.join(" | "));
        }
        text.push('\n');
    }
    for group in groups().filter(|g| g[0].state == State::Moving) {
        text += &format!(
            "## {}: what a frame with an update sends through the pipeline, and memory\n\n\
             Primitives that draws assemble and runs of fragment shaders, as in the thesis, and runs of compute shaders, which \
             take the place of both where edges are written by compute; counted in a frame that is not timed. `MiB`: of the \
             technique itself, with its shadow map, and with the adjacency of the casters' triangles, which techniques share.\n\n\
             | technique | primitives, update | shading | fragments, update | shading | compute, update | shading \
             | MiB | with map | with adjacency |\n|---|--:|--:|--:|--:|--:|--:|--:|--:|--:|\n",
            group[0].scene
        );
        for r in group {
            let count = |pick: fn(&Through) -> u64| match &r.statistics {
                Some(s) => format!("{} | {}", pick(&s.update), pick(&s.shading)),
                None => "- | -".to_owned(),
            };
            let mib = |bytes: u64| number(bytes as f64 / f64::from(1 << 20), 1);
            text += &format!(
                "| {} | {} | {} | {} | {} | {} | {} |\n",
                r.label,
                count(|t| t.primitives),
                count(|t| t.fragments),
                count(|t| t.compute),
                mib(r.memory.technique_bytes),
                mib(r.memory.technique_bytes + r.memory.shadow_map_bytes),
                mib(r.memory.total())
            );
        }
        text.push('\n');
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;
    use edgeshade::scene::load_bytes;

    fn frame(passes: &[(&str, f64, u64)]) -> FrameTiming {
        let pass = |&(name, gpu_ms, n): &(&str, f64, u64)| PassTiming {
            name: name.into(),
            gpu_ms,
            tiles: None,
            counts: vec![],
            statistics: (n > 0).then(|| Statistics {
                input_primitives: n,
                fragment_invocations: 10 * n,
                compute_invocations: 100 * n,
                ..Statistics::default()
            }),
        };
        FrameTiming { passes: passes.iter().map(pass).collect(), total_gpu_ms: 0.0 }
    }

    const STILL: &[(&str, f64, u64)] = &[("g-buffer", 9.0, 5), ("scan", 2.0, 1), ("lookup", 4.0, 2), ("shade", 9.0, 5)];
    const MOVED: &[(&str, f64, u64)] = &[
        ("shadow map", 1.0, 3),
        ("g-buffer", 9.0, 5),
        ("edges", 0.5, 4),
        ("scan", 2.0, 1),
        ("scan", 0.25, 6),
        ("lookup", 4.0, 2),
        ("shade", 9.0, 5),
    ];

    #[test]
    fn what_a_standing_light_spares_is_the_update() {
        let split = Split::new(&frame(STILL), true);
        assert_eq!(split.ms(&frame(MOVED)), Parts { update: 1.75, shading: 6.0, both: 7.75 });
        assert_eq!(split.ms(&frame(STILL)), Parts { update: 0.0, shading: 6.0, both: 6.0 });
        let through = split.through(&frame(MOVED)).unwrap();
        let of = |n| Through { primitives: n, fragments: 10 * n, compute: 100 * n };
        assert_eq!(through, Parts { update: of(13), shading: of(3), both: of(16) });
        assert_eq!(standing(through), Parts { update: of(0), shading: of(3), both: of(3) });
        assert_eq!(split.through(&frame(&[("edges", 1.0, 0)])), None);
        // Of who looks at no map none is counted.
        let split = Split::new(&frame(STILL), false);
        assert_eq!(split.ms(&frame(MOVED)), Parts { update: 0.75, shading: 6.0, both: 6.75 });
    }

    #[test]
    fn ratios_are_of_the_same_turn() {
        let part = |update, shading| Parts { update, shading, both: update + shading };
        let found =
            times(&[part(2.0, 4.0), part(9.0, 3.0), part(4.0, 8.0)], &[part(1.0, 0.0), part(3.0, 1.0), part(8.0, 4.0)]);
        assert_eq!(found.update, Time { median_ms: Some(4.0), least_ms: Some(2.0), ratio: Some(2.0) });
        // By nothing there is no ratio.
        assert_eq!(found.shading, Time { median_ms: Some(4.0), least_ms: Some(3.0), ratio: Some(2.5) });
        assert_eq!(found.both.ratio, Some(3.0));
        assert_eq!(times(&[], &[]), Parts::default());
    }

    #[test]
    fn the_page_has_a_table_for_each_state_and_one_of_counts() {
        let (choices, left_out) = available(&CONTENDERS);
        assert!(left_out.is_empty(), "{left_out:?}");
        let mut results = vec![];
        for state in STATES {
            results.extend(choices.iter().map(|choice| Row {
                scene: "jenga",
                triangles: 12,
                state,
                technique: choice.info.id,
                params: report::params(choice.info, &choice.params),
                label: label(choice),
                times: times(&[Parts { update: 1.0, shading: 2.0, both: 3.0 }], &[]),
                frame: whole(&[FrameTiming { total_gpu_ms: 7.0, ..frame(STILL) }], &[]),
                statistics: (choice.info.id != "pcf").then(Parts::default),
                memory: Memory { technique_bytes: 1 << 20, shadow_map_bytes: 4 << 20, casters_bytes: 8 << 20 },
                passes: vec![],
            }));
        }
        let origin = Origin::default();
        let figures = Figures {
            suite: "edges-cost",
            origin,
            size: [4, 4],
            shadow_map: MAP,
            frames: 1,
            left_out: vec!["none".into()],
            results,
        };
        let text = page(&figures);
        assert!(text.contains("Left out, as this version has none: none."), "{text}");
        assert_eq!(text.matches("\n## jenga").count(), 3);
        assert_eq!(
            text.matches("\n| sm | 1.000 (1.000) | - | 2.000 (2.000) | - | 3.000 (3.000) | - | 7.000 (7.000) | - |\n")
                .count(),
            2
        );
        assert!(text.contains("\n| edsm | 0 | 0 | 0 | 0 | 0 | 0 | 1.0 | 5.0 | 13.0 |\n"), "{text}");
        assert!(text.contains("\n| pcf width=5 | - | - | - | - | - | - | 1.0 |"), "{text}");
        assert_eq!(label(&choices[0]), BASE);
    }

    #[test]
    fn the_large_scene_has_half_a_million_triangles_apart_from_each_other_and_in_the_light() {
        let shipped = shipped::find("knot").unwrap();
        let one = load_bytes(shipped.name, shipped.bytes).unwrap();
        let floor = one.instances.iter().filter(|i| one.meshes[i.mesh].name == FLOOR).count();
        assert_eq!(floor, 1);
        let stage = stage(SCENES[1], [1280, 720]).unwrap();
        let scene = &stage.scene;
        assert!((500_000..600_000).contains(&scene.triangles()), "{}", scene.triangles());
        let knot = one.instances.len() - floor;
        assert_eq!(scene.instances.len(), floor + KNOTS.len() * knot);
        // The floor is as it was; the knots do not touch, and light and camera see all of both.
        let points = |i: &edgeshade::scene::Instance| {
            let to_world = i.world_from_object;
            scene.meshes[i.mesh]
                .positions
                .iter()
                .map(move |&p| to_world.transform_point3(DVec3::from(p.map(f64::from))))
        };
        let knots: Vec<Vec<DVec3>> =
            scene.instances[floor..].chunks(knot).map(|all| all.iter().flat_map(points).collect()).collect();
        let extent = |points: &[DVec3]| {
            let low = points.iter().copied().reduce(DVec3::min).unwrap();
            let high = points.iter().copied().reduce(DVec3::max).unwrap();
            (0.5 * (low + high), 0.5 * (high - low).max_element())
        };
        let [(a, a_radius), (b, b_radius)] = [extent(&knots[0]), extent(&knots[1])];
        assert!(a.distance(b) > a_radius + b_radius, "{a} {b} {a_radius} {b_radius}");
        let light = edgeshade::scene::light_view(scene, &stage.light);
        for [projection, world_from_view] in [
            [stage.camera.clip_from_view, stage.camera.world_from_view.into()],
            [light.clip_from_view, light.world_from_view.into()],
        ] {
            let clip_from_world = projection * glam::DMat4::inverse(&world_from_view);
            for p in knots.iter().flatten() {
                let clip = clip_from_world * p.extend(1.0);
                assert!(clip.w > 0.0 && clip.x.abs().max(clip.y.abs()) <= clip.w, "{p} {clip}");
            }
        }
    }
}
