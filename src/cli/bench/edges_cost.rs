//! Suite `edges-cost`: cost of hard shadows that use silhouette edges of the casters, as in figures 5.2 to 5.4 of
//! \[Kenzel 2013\]: update of the shadow map, shading, pipeline statistics, memory.

use super::driver::*;
use super::judge::mapless;
use crate::cli::stats::{self, FRAME_PASSES, PassStats, Span};
use edgeshade::Need;
use edgeshade::scene::{Moving, RenderDesc, Renderer, Scene};
use edgeshade::timing::{FrameTiming, PassTiming};
use glam::{DAffine3, DVec3, U64Vec3, dvec3, u64vec3};
use serde_json::Value;
use std::collections::BTreeMap;
use std::ops::AddAssign;

pub static SUITE: Suite = Suite {
    name: "edges-cost",
    about: "GPU time, primitives and memory of hard shadows, casters standing and moving",
    // Few triangles and many triangles, as in the thesis.
    extent: |quick| match quick {
        true => Extent { scenes: vec!["jenga"], maps: &[MAP], size: [320, 180] },
        false => Extent { scenes: vec!["jenga", KNOTS], maps: &[MAP], size: SIZE },
    },
    variants: |device| Ok(mapless(possible(available(CONTENDERS), device))),
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

/// Side of the shadow map in texels.
const MAP: u32 = 1024;
/// Variant that the others are compared with.
const BASE: &str = "sm";

/// Techniques to compare, if the registry and the device support them.
const CONTENDERS: &str = "sm pcf:width=5 sssm edsm edsm-x:slots=2 shadow-volumes:path=compute";

/// The pass of every frame that draws the casters into the map.
const MAP_PASS: &str = "shadow map";

/// Scene that repeats the object of `knot` on one floor.
const KNOTS: &str = "knots";
/// Positions of the knots relative to the shipped one in metres: side by side as seen from the light.
const PLACES: [DVec3; 2] = [dvec3(-0.6, 0.0, 0.9), dvec3(2.0, 0.0, -1.4)];
/// The one object of the scene that is not repeated.
const FLOOR: &str = "studio";

/// States of light and casters, with their names on the page. While these stand still, map and edges are kept.
const STATES: [(&str, &str); 2] = [("standing", "light and casters stand still"), ("moving", "light or casters move")];

/// Parts of a frame. The update is the shadow map and everything that the technique derives from the casters, which
/// is skipped while light and casters stand still. The shading is the technique's work in every frame. The last part
/// is the sum of both.
const PARTS: [&str; 3] = ["update", "shading", "both"];

/// A quantity of each of the [`PARTS`].
type Parts<T> = [T; 3];

/// Counts of one frame: primitives assembled from the draws' vertices, fragment shader invocations, compute shader
/// invocations.
type Through = U64Vec3;

/// Separates the passes of a technique's update from those of its shading.
struct Split {
    /// Number of passes of each name in a static frame.
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

    /// Sums a quantity over the passes that the technique is responsible for: not the G-buffer or the lighting, and
    /// the shadow map only if the technique uses one. Passes beyond those of a static frame count as update. Returns
    /// `None` if a pass lacks the quantity.
    fn sum<T: AddAssign + Copy + Default>(
        &self,
        frame: &FrameTiming,
        of: fn(&PassTiming) -> Option<T>,
    ) -> Option<Parts<T>> {
        let mut sum = Parts::<T>::default();
        for (i, pass) in frame.passes.iter().enumerate() {
            let is_own = if pass.name == MAP_PASS { self.has_map } else { !FRAME_PASSES.contains(&pass.name.as_str()) };
            if !is_own {
                continue;
            }
            let repeat = frame.passes[..i].iter().filter(|p| p.name == pass.name).count();
            let is_kept = repeat < self.kept.get(&pass.name).copied().unwrap_or(0);
            let value = of(pass)?;
            sum[usize::from(is_kept)] += value;
            sum[2] += value;
        }
        Some(sum)
    }

    /// Milliseconds of a frame.
    fn ms(&self, frame: &FrameTiming) -> Parts<f64> {
        self.sum(frame, |pass| Some(pass.gpu_ms)).unwrap_or_default()
    }

    /// Counts of a frame; `None` if it has no statistics.
    fn through(&self, frame: &FrameTiming) -> Option<Parts<Through>> {
        self.sum(frame, |pass| {
            let s = pass.statistics?;
            Some(u64vec3(s.input_primitives, s.fragment_invocations, s.compute_invocations))
        })
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

/// Repeats the knot with its foot several times on one floor, which gives about half a million triangles.
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

fn measure(host: &Host, run: &mut Run<'_>, scene: &'static str) -> Result<()> {
    let plan = run.plan;
    let stage = stage(scene, plan)?;
    let renderer = |is_moving: bool, statistics: bool| {
        let desc = RenderDesc {
            size: plan.size,
            map_size: MAP,
            moving: if is_moving { Moving::Everything } else { Moving::Camera },
            statistics,
            ..RenderDesc::default()
        };
        Renderer::new(host, &stage.scene, stage.camera, &stage.light, desc)
    };
    run.start(scene);
    let mut renderers = [renderer(false, false)?, renderer(true, false)?];
    let both: Vec<_> = plan.variants.iter().flat_map(|v| [(0, v), (1, v)]).collect();
    // The warm-up turn draws map and edges once for a light that stands still.
    let drawn = run.in_turns(&mut renderers, &both)?;
    let adjacency = renderers[0].casters().map_or(0, |c| c.casters.memory_bytes());
    // Counting may slow the passes down, so it uses a frame of its own.
    let mut counted = vec![None; plan.variants.len()];
    if host.context().features().pipeline_statistics {
        let mut renderer = renderer(true, true)?;
        for (Variant { choice, .. }, counted) in plan.variants.iter().zip(&mut counted) {
            let mut technique = renderer.prepare(choice.info.id, &choice.params)?;
            *counted = Some(renderer.frame(technique.as_mut())?);
        }
    }
    let split = |(variant, standing_and_moving): (&Variant, &[Drawn])| {
        let standing = standing_and_moving[0].frames.last();
        Split::new(standing.unwrap_or(&FrameTiming::default()), !variant.has_no_map)
    };
    let splits: Vec<_> = plan.variants.iter().zip(drawn.chunks(2)).map(split).collect();
    let base = plan.variants.iter().position(|v| v.label == BASE);
    let triangles = stage.scene.triangles();
    for (s, (state, meaning)) in STATES.into_iter().enumerate() {
        let base_frames = base.map_or(&[][..], |b| &drawn[2 * b + s].frames);
        let base_ms: Vec<_> = base_frames.iter().filter_map(|f| Some(splits[base?].ms(f))).collect();
        for (i, variant) in plan.variants.iter().enumerate() {
            let frames = &drawn[2 * i + s].frames;
            let mine: Vec<_> = frames.iter().filter(|f| !f.passes.is_empty()).map(|f| splits[i].ms(f)).collect();
            let through = counted[i].as_ref().and_then(|f| splits[i].through(f));
            let through = through.map(|t| if state == "moving" { t } else { standing(t) });
            let map_bytes = if variant.has_no_map { 0 } else { renderers[0].shadow_map().memory_bytes() };
            let casters_bytes = if variant.choice.info.needs.contains(&Need::Casters) { adjacency } else { 0 };
            let bytes = [drawn[2 * i].technique.memory_bytes(), map_bytes, casters_bytes];
            let place = [("scene", scene.into()), ("triangles", triangles.into()), ("state", state.into())];
            let group = format!("{scene}, {triangles} triangles, {meaning}");
            let times = (times(&mine, &base_ms), whole(frames, base_frames));
            let row = row(place, variant, &group, times, through, bytes, stats::passes(frames));
            run.push(row, 0);
        }
    }
    Ok(())
}

/// A row of one technique. `bytes` holds the memory of the technique, of the shadow map (0 if it uses none) and of
/// the adjacency of the casters' triangles, which techniques share (0 if it needs none).
fn row<const N: usize>(
    place: [(&'static str, Field); N],
    variant: &Variant,
    group: &str,
    (times, frame): (Parts<Record>, Record),
    through: Option<Parts<Through>>,
    bytes: [u64; 3],
    passes: Vec<PassStats>,
) -> Row {
    let parts = |records: Parts<Record>| Record::default().and(PARTS.into_iter().zip(records.map(Field::from)));
    let statistics =
        |t: Through| Record::of([("primitives", t.x.into()), ("fragments", t.y.into()), ("compute", t.z.into())]);
    let names = ["technique_bytes", "shadow_map_bytes", "casters_bytes"];
    let memory = Record::default().and(names.into_iter().zip(bytes.map(Field::from)));
    let cell = |time: &Record| {
        let [median, least] = ["median_ms", "least_ms"].map(|name| number(time.number(name), 3));
        format!("{median} ({least})").into()
    };
    let mib = |n: usize| (bytes[..n].iter().sum::<u64>() as f64 / f64::from(1 << 20)).into();
    let shown = [
        ("update ms", cell(&times[0])),
        ("shading ms", cell(&times[1])),
        ("both ms", cell(&times[2])),
        ("frame ms", cell(&frame)),
        ("own MiB", mib(1)),
        ("with map", mib(2)),
        ("with adjacency", mib(3)),
    ];
    let figures = Record::of([
        ("times", parts(times).into()),
        // Time of the whole frame, with G-buffer and lighting.
        ("frame", frame.into()),
        ("statistics", through.map_or(Value::Null.into(), |t| parts(t.map(statistics)).into())),
        ("memory", memory.into()),
        ("passes", Field::Passes(passes)),
    ]);
    Row::of(place, variant, group, figures).and_shown(shown)
}

/// Counts of a static frame, in which only the shading is left.
fn standing(moving: Parts<Through>) -> Parts<Through> {
    [Through::ZERO, moving[1], moving[1]]
}

/// Statistics per turn; `base[i]` belongs to the same turn as `mine[i]`.
fn times(mine: &[Parts<f64>], base: &[Parts<f64>]) -> Parts<Record> {
    [0, 1, 2].map(|part| time(mine.iter().map(|ms| ms[part]), base.iter().map(|ms| ms[part])))
}

/// Statistics of whole frames, as in [`times`].
fn whole(mine: &[FrameTiming], base: &[FrameTiming]) -> Record {
    let timed = mine.iter().filter(|f| !f.passes.is_empty());
    time(timed.map(|f| f.total_gpu_ms), base.iter().map(|f| f.total_gpu_ms))
}

/// Statistics over the turns, null without timestamps; `ratio` is the median of the ratios to the base in the same
/// turn.
fn time(mine: impl Iterator<Item = f64> + Clone, base: impl Iterator<Item = f64>) -> Record {
    let ratios = mine.clone().zip(base).map(|(a, b)| a / b).filter(|r| r.is_finite());
    let ratio = Span::of(ratios).map(|s| s.median);
    let span = Span::of(mine);
    let [median, least] = [span.map(|s| s.median), span.map(|s| s.min)];
    Record::of([("median_ms", median.into()), ("least_ms", least.into()), ("ratio", ratio.into())])
}

fn page(results: &Results<'_>) -> String {
    let frames = results.plan.frames;
    let mut text = results.head(&format!("shadow map {MAP}x{MAP}, {frames} frames per row, drawn in turns."))
        + &format!(
            "`update`: the shadow map and everything that the technique derives from the casters, which is skipped while light and \
             casters stand still; `shading`: the technique's passes of every frame; `both`: their sum, without G-buffer and \
             lighting; `frame`: the whole frame, with G-buffer and lighting. Times are GPU milliseconds, median (least); `x` is the \
             ratio to `{BASE}` in the same turn, median over the turns. `shadow-volumes` uses no shadow map, so none counts for \
             it. A driver on the CPU defers draws but not compute passes, so its times of single passes of an update mean \
             little: compare `frame` instead, and take a moving frame minus a standing one as the update.\n\n"
        );
    text += &left_out_note(&results.plan.left_out);
    const TIMES: [Column; 9] = [
        ("<technique", "label", 0),
        ("update ms", "update ms", 0),
        ("x", "times.update.ratio", 2),
        ("shading ms", "shading ms", 0),
        ("x", "times.shading.ratio", 2),
        ("both ms", "both ms", 0),
        ("x", "times.both.ratio", 2),
        ("frame ms", "frame ms", 0),
        ("x", "frame.ratio", 2),
    ];
    const COUNTS: [Column; 10] = [
        ("<technique", "label", 0),
        ("primitives, update", "statistics.update.primitives", 0),
        ("shading", "statistics.shading.primitives", 0),
        ("fragments, update", "statistics.update.fragments", 0),
        ("shading", "statistics.shading.fragments", 0),
        ("compute, update", "statistics.update.compute", 0),
        ("shading", "statistics.shading.compute", 0),
        ("MiB", "own MiB", 1),
        ("with map", "with map", 1),
        ("with adjacency", "with adjacency", 1),
    ];
    for group in groups(&results.rows) {
        text += &format!("## {}\n\n{}\n", group[0].group, table(&TIMES, group));
    }
    for group in groups(&results.rows).filter(|g| g[0].text("state") == "moving") {
        text += &format!(
            "## {}: pipeline statistics of a frame with an update, and memory\n\n\
             Primitives assembled by draws and fragment shader invocations, as in the thesis, and compute shader invocations, \
             which replace both where compute shaders write the edges; counted in a frame that is not timed. `MiB`: memory of \
             the technique itself, then with its shadow map, then with the adjacency of the casters' triangles, which \
             techniques share.\n\n{}\n",
            group[0].text("scene"),
            table(&COUNTS, group)
        );
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::cli::report::Origin;
    use edgeshade::scene::load_bytes;
    use edgeshade::timing::Statistics;

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
        assert_eq!(split.ms(&frame(MOVED)), [1.75, 6.0, 7.75]);
        assert_eq!(split.ms(&frame(STILL)), [0.0, 6.0, 6.0]);
        let through = split.through(&frame(MOVED)).unwrap();
        let of = |n| n * u64vec3(1, 10, 100);
        assert_eq!(through, [of(13), of(3), of(16)]);
        assert_eq!(standing(through), [of(0), of(3), of(3)]);
        assert_eq!(split.through(&frame(&[("edges", 1.0, 0)])), None);
        // The shadow map does not count for a technique that uses none.
        let split = Split::new(&frame(STILL), false);
        assert_eq!(split.ms(&frame(MOVED)), [0.75, 6.0, 6.75]);
    }

    #[test]
    fn ratios_are_of_the_same_turn() {
        let part = |update, shading| [update, shading, update + shading];
        let found =
            times(&[part(2.0, 4.0), part(9.0, 3.0), part(4.0, 8.0)], &[part(1.0, 0.0), part(3.0, 1.0), part(8.0, 4.0)]);
        let of = |time: &Record| ["median_ms", "least_ms", "ratio"].map(|name| time.number(name));
        assert_eq!(of(&found[0]), [Some(4.0), Some(2.0), Some(2.0)]);
        // A base of zero gives no ratio.
        assert_eq!(of(&found[1]), [Some(4.0), Some(3.0), Some(2.5)]);
        assert_eq!(found[2].number("ratio"), Some(3.0));
        assert_eq!(of(&times(&[], &[])[2]), [None; 3]);
    }

    #[test]
    fn the_page_has_a_table_for_each_state_and_one_of_counts() {
        let plan = SUITE.plan(false, 1, Some([4, 4]), DeviceFeatures::default()).unwrap();
        let Variants { found, left_out } = mapless(available(CONTENDERS));
        assert!(left_out.is_empty(), "{left_out:?}");
        let plan = Plan { variants: found, left_out: vec!["none".into()], ..plan };
        let row = |(variant, (state, _)): (&Variant, (&str, &str))| {
            let place = [("scene", "jenga".into()), ("state", state.into())];
            let times = times(&[[1.0, 2.0, 3.0]], &[]);
            let whole = whole(&[FrameTiming { total_gpu_ms: 7.0, ..frame(STILL) }], &[]);
            let through = (variant.choice.info.id != "pcf").then(Parts::default);
            let bytes = [1 << 20, 4 << 20, 8 << 20];
            super::row(place, variant, &format!("jenga, {state}"), (times, whole), through, bytes, vec![])
        };
        let rows = STATES.into_iter().flat_map(|s| plan.variants.iter().map(move |v| row((v, s)))).collect();
        let text = (SUITE.page)(&SUITE.results(&plan, Origin::default(), rows));
        assert!(text.contains("Left out because they are not supported: none."), "{text}");
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
        // The floor is unchanged. The knots do not touch each other, and light and camera see both completely.
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
