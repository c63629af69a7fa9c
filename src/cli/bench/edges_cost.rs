//! Suite `edges-cost`: what hard shadows cost that know the casters' edges, as \[Kenzel 2013\] sets them side by side in figures
//! 5.2 to 5.4: the update of the shadow map, the shading, what goes through the pipeline, memory.

use super::driver::*;
use super::judge::mapless;
use crate::cli::stats::{self, FRAME_PASSES, PassStats, Span};
use edgeshade::Need;
use edgeshade::scene::{RenderDesc, Renderer, Scene};
use edgeshade::technique::Technique;
use edgeshade::timing::{FrameTiming, PassTiming, Statistics};
use glam::{DAffine3, DVec3, dvec3};
use std::collections::BTreeMap;
use std::ops::AddAssign;

pub static SUITE: Suite<Cost> = Suite {
    name: "edges-cost",
    about: "GPU time, primitives and memory of hard shadows, casters standing and moving",
    // Few triangles and many, as in the thesis.
    extent: |quick| match quick {
        true => Extent { scenes: vec!["jenga"], maps: &[MAP], size: [320, 180] },
        false => Extent { scenes: vec!["jenga", KNOTS], maps: &[MAP], size: SIZE },
    },
    variants: |device| Ok(mapless(possible(available(&CONTENDERS), device))),
    frames: |plan| STATES.len() as u32 * (plan.frames + 1),
    shows_scenes: true,
    measure,
    settings: |plan| {
        let left_out = plan.left_out.clone().into();
        Record::of([("shadow_map", MAP.into()), ("frames", plan.frames.into()), ("left_out", left_out)])
    },
    page,
    ..Suite::BASE
};

/// Side of the map, texels.
const MAP: u32 = 1024;
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

/// Several of the scene `knot` on one floor.
const KNOTS: &str = "knots";
/// Where they stand, by the place of the shipped one, metres: side by side as the light sees them.
const PLACES: [DVec3; 2] = [dvec3(-0.6, 0.0, 0.9), dvec3(2.0, 0.0, -1.4)];
/// The one object of the scene that is not repeated.
const FLOOR: &str = "studio";

/// Whether map and casters' edges are kept from frame to frame, and what a page says of it.
const STATES: [(&str, &str); 2] = [("standing", "light and casters stand still"), ("moving", "light or casters move")];

/// Of one technique in one scene in one state.
#[derive(Serialize)]
pub struct Cost {
    times: Parts<Time>,
    /// Of the whole frame, with G-buffer and lighting.
    frame: Time,
    /// Null where the device counts nothing.
    statistics: Option<Parts<Through>>,
    memory: Memory,
    passes: Vec<PassStats>,
}

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

/// Tells the passes of a technique's update from those of its shading.
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

    /// Sums something over the passes that the technique answers for: not the G-buffer nor the lighting, and a shadow map only
    /// if it looks at one. Passes beyond those of a frame in which nothing has moved are of the update. `None` where a pass
    /// has none of it.
    fn sum<T: AddAssign + Copy + Default>(
        &self,
        frame: &FrameTiming,
        of: fn(&PassTiming) -> Option<T>,
    ) -> Option<Parts<T>> {
        let mut sum = Parts::default();
        for (i, pass) in frame.passes.iter().enumerate() {
            let is_own = if pass.name == MAP_PASS { self.has_map } else { !FRAME_PASSES.contains(&pass.name.as_str()) };
            if !is_own {
                continue;
            }
            let repeat = frame.passes[..i].iter().filter(|p| p.name == pass.name).count();
            let is_kept = repeat < self.kept.get(&pass.name).copied().unwrap_or(0);
            let value = of(pass)?;
            *if is_kept { &mut sum.shading } else { &mut sum.update } += value;
            sum.both += value;
        }
        Some(sum)
    }

    /// Milliseconds.
    fn ms(&self, frame: &FrameTiming) -> Parts<f64> {
        self.sum(frame, |pass| Some(pass.gpu_ms)).unwrap_or_default()
    }

    /// `None` without statistics.
    fn through(&self, frame: &FrameTiming) -> Option<Parts<Through>> {
        self.sum(frame, |pass| {
            let Statistics { input_primitives, fragment_invocations, compute_invocations, .. } = pass.statistics?;
            Some(Through {
                primitives: input_primitives,
                fragments: fragment_invocations,
                compute: compute_invocations,
            })
        })
    }
}

impl AddAssign for Through {
    fn add_assign(&mut self, more: Self) {
        self.primitives += more.primitives;
        self.fragments += more.fragments;
        self.compute += more.compute;
    }
}

fn stage(name: &str, plan: &Plan) -> Result<Stage> {
    if name != KNOTS {
        return plan.stage(name);
    }
    let mut stage = plan.stage("knot")?;
    repeat_knot(&mut stage.scene);
    Ok(stage)
}

/// About half a million triangles: the knot with its foot several times on one floor.
fn repeat_knot(scene: &mut Scene) {
    let Scene { instances, meshes, .. } = scene;
    let (floor, knot): (Vec<_>, Vec<_>) = instances.drain(..).partition(|i| meshes[i.mesh].name == FLOOR);
    *instances = floor;
    for offset in PLACES {
        instances.extend(knot.iter().map(|i| {
            let mut moved = *i;
            moved.world_from_object = DAffine3::from_translation(offset) * i.world_from_object;
            moved
        }));
    }
}

fn measure(host: &Host, run: &mut Run<'_, Cost>, scene: &'static str) -> Result<()> {
    let plan = run.plan;
    let stage = stage(scene, plan)?;
    let renderer = |is_moving: bool, statistics: bool| {
        let desc = RenderDesc {
            size: plan.size,
            map_size: MAP,
            dynamic_light: is_moving,
            statistics,
            ..RenderDesc::default()
        };
        Renderer::new(host, &stage.scene, stage.camera, &stage.light, desc)
    };
    run.start(scene);
    let mut measured: Vec<[Vec<FrameTiming>; 2]> = plan.variants.iter().map(|_| [vec![], vec![]]).collect();
    let mut memory = vec![];
    {
        let mut renderers = [renderer(false, false)?, renderer(true, false)?];
        let mut prepared: Vec<[Box<dyn Technique>; 2]> = vec![];
        for Variant { choice, .. } in &plan.variants {
            let prepare = |r: &Renderer<'_>| r.prepare(choice.info.id, &choice.params);
            prepared.push([prepare(&renderers[0])?, prepare(&renderers[1])?]);
        }
        // Turn 0 warms up: a light that stands still has its map and edges then.
        for turn in 0..=plan.frames {
            for (techniques, found) in prepared.iter_mut().zip(&mut measured) {
                for ((renderer, technique), found) in renderers.iter_mut().zip(techniques).zip(found) {
                    let timing = renderer.frame(technique.as_mut())?;
                    found.extend((turn > 0).then_some(timing));
                    run.drawn(1);
                }
            }
        }
        let adjacency = renderers[0].casters().map_or(0, |c| c.casters.memory_bytes());
        memory.extend(plan.variants.iter().zip(&prepared).map(|(variant, techniques)| Memory {
            technique_bytes: techniques[0].memory_bytes(),
            shadow_map_bytes: if variant.has_no_map { 0 } else { renderers[0].shadow_map().memory_bytes() },
            casters_bytes: if variant.choice.info.needs.contains(&Need::Casters) { adjacency } else { 0 },
        }));
    }
    // Counting may slow the passes down: it has a frame of its own.
    let mut counted = vec![None; plan.variants.len()];
    if host.context().features().pipeline_statistics {
        let mut renderer = renderer(true, true)?;
        for (Variant { choice, .. }, counted) in plan.variants.iter().zip(&mut counted) {
            let mut technique = renderer.prepare(choice.info.id, &choice.params)?;
            *counted = Some(renderer.frame(technique.as_mut())?);
        }
    }
    let split = |(variant, [standing, _]): (&Variant, &[Vec<FrameTiming>; 2])| {
        Split::new(standing.last().unwrap_or(&FrameTiming::default()), !variant.has_no_map)
    };
    let splits: Vec<_> = plan.variants.iter().zip(&measured).map(split).collect();
    let base = plan.variants.iter().position(|v| v.label == BASE);
    let triangles = stage.scene.triangles();
    for (s, (state, meaning)) in STATES.into_iter().enumerate() {
        let base_frames = base.map_or(&[][..], |b| &measured[b][s]);
        let base_ms: Vec<_> = base_frames.iter().filter_map(|f| Some(splits[base?].ms(f))).collect();
        for (i, variant) in plan.variants.iter().enumerate() {
            let frames = &measured[i][s];
            let mine: Vec<_> = frames.iter().filter(|f| !f.passes.is_empty()).map(|f| splits[i].ms(f)).collect();
            let through = counted[i].as_ref().and_then(|f| splits[i].through(f));
            let figures = Cost {
                times: times(&mine, &base_ms),
                frame: whole(frames, base_frames),
                statistics: through.map(|t| if state == "moving" { t } else { standing(t) }),
                memory: memory[i],
                passes: stats::passes(frames),
            };
            let place = [("scene", scene.into()), ("triangles", triangles.into()), ("state", state.into())];
            run.push(Row::new(place, variant, &format!("{scene}, {triangles} triangles, {meaning}"), figures));
        }
    }
    Ok(())
}

/// Where nothing moves only the shading is left.
fn standing(moving: Parts<Through>) -> Parts<Through> {
    Parts { update: Through::default(), shading: moving.shading, both: moving.shading }
}

/// Statistics per turn; `base[i]` belongs to the same turn as `mine[i]`.
fn times(mine: &[Parts<f64>], base: &[Parts<f64>]) -> Parts<Time> {
    let of = |pick: fn(&Parts<f64>) -> f64| time(mine.iter().map(pick), base.iter().map(pick));
    Parts { update: of(|p| p.update), shading: of(|p| p.shading), both: of(|p| p.both) }
}

/// The same of whole frames.
fn whole(mine: &[FrameTiming], base: &[FrameTiming]) -> Time {
    let timed = mine.iter().filter(|f| !f.passes.is_empty());
    time(timed.map(|f| f.total_gpu_ms), base.iter().map(|f| f.total_gpu_ms))
}

fn time(mine: impl Iterator<Item = f64> + Clone, base: impl Iterator<Item = f64>) -> Time {
    let ratios = mine.clone().zip(base).map(|(a, b)| a / b).filter(|r| r.is_finite());
    let span = Span::of(mine);
    Time { median_ms: span.map(|s| s.median), least_ms: span.map(|s| s.min), ratio: Span::of(ratios).map(|s| s.median) }
}

fn page(results: &Results<'_, Cost>) -> String {
    let frames = results.plan.frames;
    let mut text = results.head(&format!("shadow map {MAP}x{MAP}, {frames} frames a row, drawn in turns."))
        + &format!(
            "`update`: the shadow map and what the technique makes of the casters, all that is spared while light and casters \
             stand still; `shading`: the technique's passes of every frame; `both`: their sum, without G-buffer and lighting. GPU \
             milliseconds, median (least); `x`: by those of `{BASE}` in the same turn, median over the turns. `shadow-volumes` \
             looks at no shadow map: none is counted for it. `frame`: all of it, with G-buffer and lighting. A driver on the CPU \
             puts off what is drawn and not what is computed, so that its times of single passes of an update mean little: \
             there only `frame` tells, and an update is a moving frame less a standing one.\n\n"
        );
    text += &left_out_note(&results.plan.left_out);
    for group in groups(&results.rows) {
        let line = |r: &Row<Cost>| {
            let Cost { times, frame, .. } = &r.figures;
            let cells = [times.update, times.shading, times.both, *frame]
                .map(|t| [format!("{} ({})", number(t.median_ms, 3), number(t.least_ms, 3)), number(t.ratio, 2)]);
            [r.label.clone()].into_iter().chain(cells.into_iter().flatten()).collect()
        };
        let heads = "<technique | update ms | x | shading ms | x | both ms | x | frame ms | x";
        text += &format!("## {}\n\n{}\n", group[0].group, table(heads, group.iter().map(line)));
    }
    for group in groups(&results.rows).filter(|g| g[0].place.text("state") == "moving") {
        let line = |r: &Row<Cost>| {
            let Cost { statistics, memory, .. } = &r.figures;
            let picks: [fn(&Through) -> u64; 3] = [|t| t.primitives, |t| t.fragments, |t| t.compute];
            let counts = picks.into_iter().flat_map(|pick| {
                let count = |t: &Through| pick(t).to_string();
                statistics.map_or_else(|| ["-"; 2].map(str::to_owned), |s| [count(&s.update), count(&s.shading)])
            });
            let with_map = memory.technique_bytes + memory.shadow_map_bytes;
            let bytes = [memory.technique_bytes, with_map, with_map + memory.casters_bytes];
            let mib = bytes.map(|bytes| number(bytes as f64 / f64::from(1 << 20), 1));
            [r.label.clone()].into_iter().chain(counts).chain(mib).collect()
        };
        let heads = "<technique | primitives, update | shading | fragments, update | shading | compute, update | shading \
                     | MiB | with map | with adjacency";
        text += &format!(
            "## {}: what a frame with an update sends through the pipeline, and memory\n\n\
             Primitives that draws assemble and runs of fragment shaders, as in the thesis, and runs of compute shaders, which \
             take the place of both where edges are written by compute; counted in a frame that is not timed. `MiB`: of the \
             technique itself, with its shadow map, and with the adjacency of the casters' triangles, which techniques \
             share.\n\n{}\n",
            group[0].place.text("scene"),
            table(heads, group.iter().map(line))
        );
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::cli::report::Origin;
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
        let plan = SUITE.plan(false, 1, Some([4, 4]), DeviceFeatures::default()).unwrap();
        let Variants { found, left_out } = mapless(available(&CONTENDERS));
        assert!(left_out.is_empty(), "{left_out:?}");
        let plan = Plan { variants: found, left_out: vec!["none".into()], ..plan };
        let row = |(variant, (state, _)): (&Variant, (&str, &str))| {
            let figures = Cost {
                times: times(&[Parts { update: 1.0, shading: 2.0, both: 3.0 }], &[]),
                frame: whole(&[FrameTiming { total_gpu_ms: 7.0, ..frame(STILL) }], &[]),
                statistics: (variant.choice.info.id != "pcf").then(Parts::default),
                memory: Memory { technique_bytes: 1 << 20, shadow_map_bytes: 4 << 20, casters_bytes: 8 << 20 },
                passes: vec![],
            };
            Row::new([("scene", "jenga".into()), ("state", state.into())], variant, &format!("jenga, {state}"), figures)
        };
        let rows = STATES.into_iter().flat_map(|s| plan.variants.iter().map(move |v| row((v, s)))).collect();
        let text = (SUITE.page)(&SUITE.results(&plan, Origin::default(), rows));
        assert!(text.contains("Left out, as this version has none: none."), "{text}");
        assert_eq!(text.matches("\n## jenga").count(), 3);
        assert_eq!(
            text.matches("\n| sm | 1.000 (1.000) | - | 2.000 (2.000) | - | 3.000 (3.000) | - | 7.000 (7.000) | - |\n")
                .count(),
            2
        );
        assert!(text.contains("\n| edsm | 0 | 0 | 0 | 0 | 0 | 0 | 1.0 | 5.0 | 13.0 |\n"), "{text}");
        assert!(text.contains("\n| pcf width=5 | - | - | - | - | - | - | 1.0 |"), "{text}");
        assert_eq!(plan.variants[0].label, BASE);
    }

    #[test]
    fn the_large_scene_has_half_a_million_triangles_apart_from_each_other_and_in_the_light() {
        let shipped = find_scene("knot").unwrap();
        let one = load_bytes(shipped.name, shipped.bytes).unwrap();
        let floor = one.instances.iter().filter(|i| one.meshes[i.mesh].name == FLOOR).count();
        assert_eq!(floor, 1);
        let plan = SUITE.plan(false, 1, None, DeviceFeatures::default()).unwrap();
        let stage = stage(KNOTS, &plan).unwrap();
        let scene = &stage.scene;
        assert!((500_000..600_000).contains(&scene.triangles()), "{}", scene.triangles());
        let knot = one.instances.len() - floor;
        assert_eq!(scene.instances.len(), floor + PLACES.len() * knot);
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
