//! Suite `soft`: soft shadows of area lights against the ray-traced truth, over scenes, sizes of map and of light.

mod page;

use super::judge::{available, label, mask, mean, save, tracer};
use super::{Args, shown};
use crate::cli::progress::Progress;
use crate::cli::report::{self, Origin};
use crate::cli::stage::Stage;
use crate::cli::techniques::Choice;
use crate::cli::truth::{self, Seed};
use crate::cli::{stats, view};
use edgeshade::host::Host;
use edgeshade::metrics::{self, Report};
use edgeshade::picture::{Picture, write_atomic};
use edgeshade::scene::shipped::{self, Shipped};
use edgeshade::scene::{Light, LightShape, RenderDesc, Renderer, light_view};
use edgeshade::technique::{OutputFormat, Technique};
use edgeshade::view::{LightKind, LightView};
use edgeshade::{Error, Result};
use serde::Serialize;
use serde_json::{Map, Value};

/// Sides of the shadow maps, texels.
const MAPS: [u32; 4] = [512, 1024, 2048, 4096];
/// Sizes of the light by the scene's own.
const SCALES: [f64; 3] = [0.25, 1.0, 4.0];
const SIZE: [u32; 2] = [640, 360];
/// Rays a pixel of the truth.
const SAMPLES: u32 = 1024;
/// Scenes, maps, size of the image and rays a pixel of a quick run.
const QUICK: ([&str; 2], [u32; 1], [u32; 2], u32) = (["jenga", "robot"], [1024], [192, 108], 64);

/// What is judged, as far as the registry has it: without penumbrae, with those of a fixed width, with those of the light.
const CONTENDERS: [super::judge::Wanted; 9] = [
    ("sm", &[]),
    ("pcf", &[("width", "15")]),
    ("pcss", &[]),
    ("rbssm", &[]),
    ("ssrbssm", &[]),
    ("ssabss", &[]),
    ("edtssm", &[]),
    ("edtssm-star", &[]),
    ("soft-auto", &[]),
];
/// From the lowest error to the highest, as the papers find them.
const ORDER: [&str; 4] = ["rbssm", "pcss", "ssrbssm", "ssabss"];
/// What the papers do not place.
const BESIDE: &str = "edtssm-star";

/// What the suite writes.
#[derive(Serialize)]
struct Figures {
    suite: &'static str,
    #[serde(flatten)]
    origin: Origin,
    size: [u32; 2],
    /// Rays a pixel of the truth.
    samples: u32,
    frames: u32,
    /// What the registry does not have.
    left_out: Vec<String>,
    results: Vec<Row>,
    /// Over the scenes.
    means: Vec<Mean>,
    /// The order by error in every cell.
    cells: Vec<Cell>,
}

/// One technique in one scene with one map under a light of one size.
#[derive(Serialize)]
struct Row {
    scene: &'static str,
    /// By the scene's own size.
    light_scale: f64,
    /// Width of a spot, world units, or angle of a sun, degrees.
    light_size: f64,
    light_unit: &'static str,
    shadow_map: u32,
    #[serde(skip)]
    label: String,
    technique: &'static str,
    params: Map<String, Value>,
    /// Mean FLIP difference of the lit pictures.
    flip: f64,
    #[serde(flatten)]
    report: Report,
    /// The technique's own passes, median over the frames.
    gpu_ms: Option<f64>,
    memory_bytes: u64,
}

/// Mean over the scenes; of all sizes of the light where none is given.
#[derive(Serialize)]
struct Mean {
    light_scale: Option<f64>,
    shadow_map: u32,
    #[serde(skip)]
    label: String,
    technique: &'static str,
    params: Map<String, Value>,
    /// Of so many rows.
    rows: usize,
    rmse: Option<f64>,
    penumbra_rmse: Option<f64>,
    mae: Option<f64>,
    over: Option<f64>,
    under: Option<f64>,
    flip: Option<f64>,
    gpu_ms: Option<f64>,
}

/// Who errs least in one scene with one map under a light of one size.
#[derive(Serialize)]
struct Cell {
    scene: &'static str,
    light_scale: f64,
    shadow_map: u32,
    /// Those of the papers' order that there are, from the lowest RMSE.
    order: Vec<&'static str>,
    /// Whether that is the papers' order; null of fewer than two.
    holds: Option<bool>,
    /// How far the RMSE of `rbssm` is below that of `pcss`, per cent of the latter; negative where it is above.
    rbssm_below_pcss_percent: Option<f64>,
    /// RMSE of `edtssm-star`.
    edtssm_star: Option<f64>,
    /// The lowest of all.
    lowest: String,
    lowest_rmse: f64,
}

/// A light of one size, and what is compared with under it.
struct Measure {
    scale: f64,
    light: LightView,
    truth: Vec<f32>,
    mask: Vec<bool>,
    /// Lit with the truth.
    picture: Picture,
}

/// What is run.
struct Plan {
    scenes: Vec<&'static Shipped>,
    maps: Vec<u32>,
    size: [u32; 2],
    samples: u32,
    frames: u32,
    choices: Vec<Choice>,
}

/// Pixels of all frames, for the estimate of the time.
pub fn pixels(args: &Args) -> Result<u64> {
    let (scenes, maps) = if args.quick { (QUICK.0.len(), QUICK.1.len()) } else { (shipped::ALL.len(), MAPS.len()) };
    let size = args.size.unwrap_or(if args.quick { QUICK.2 } else { SIZE });
    Ok(super::pixels(size, scenes * maps * SCALES.len() * CONTENDERS.len(), args.frames + 1))
}

pub fn run(args: &Args, host: &Host) -> Result<()> {
    let (quick_scenes, quick_maps, quick_size, quick_samples) = QUICK;
    let (choices, left_out) = available(&CONTENDERS);
    let plan = Plan {
        scenes: shipped::ALL.iter().filter(|s| !args.quick || quick_scenes.contains(&s.name)).collect(),
        maps: if args.quick { quick_maps.to_vec() } else { MAPS.to_vec() },
        size: args.size.unwrap_or(if args.quick { quick_size } else { SIZE }),
        samples: if args.quick { quick_samples } else { SAMPLES },
        frames: args.frames,
        choices,
    };
    let mut results = vec![];
    for scene in &plan.scenes {
        results.extend(one_scene(host, scene, &plan)?);
    }
    let figures = Figures {
        suite: "soft",
        origin: Origin::new(host),
        size: plan.size,
        samples: plan.samples,
        frames: plan.frames,
        left_out,
        means: means(&results, &plan.maps),
        cells: by_cell(&results).filter_map(cell).collect(),
        results,
    };
    let path = save(args, host, figures.suite, &figures, &page::page(&figures))?.with_extension("svg");
    write_atomic(&path, page::chart(&figures)?.as_bytes())?;
    args.say(format_args!("wrote {}", shown(&path)))
}

/// The light so many times as large as the scene's own; where that has no size, as one that says nothing of it.
fn sized(stage: &Stage, scale: f64) -> Light {
    let with = |spot, sun| {
        let shape = match stage.light.shape {
            LightShape::Spot { outer, .. } => LightShape::Spot { outer, size: spot },
            LightShape::Directional { .. } => LightShape::Directional { angle: sun },
        };
        Light { shape, ..stage.light.clone() }
    };
    let width = |light: &Light| match light_view(&stage.scene, light).kind {
        LightKind::Spot { size } => size,
        LightKind::Directional { angle } => angle,
    };
    let own = match width(&stage.light) {
        0.0 => width(&with(None, None)),
        own => own,
    };
    with(Some(scale * own), Some(scale * own))
}

/// Width of a spot in world units, or angle of a sun in degrees, and the unit.
fn width(light: &LightView) -> (f64, &'static str) {
    match light.kind {
        LightKind::Spot { size } => (size, "world units"),
        LightKind::Directional { angle } => (angle.to_degrees(), "degrees"),
    }
}

fn one_scene(host: &Host, scene: &'static Shipped, plan: &Plan) -> Result<Vec<Row>> {
    let stage = Stage::shipped(scene, plan.size)?;
    // The map is drawn every frame, and what is made of it alone counts.
    let renderer = |map_size| {
        let desc = RenderDesc { size: plan.size, map_size, output: OutputFormat::R32, ..RenderDesc::default() };
        Renderer::new(host, &stage.scene, stage.camera, &stage.light, desc)
    };
    let measures = match plan.maps.first() {
        Some(&map) => measures(host, &stage, plan, &mut renderer(map)?)?,
        None => vec![],
    };
    let progress = Progress::start(format!("suite soft, {}", scene.name));
    let total = (plan.maps.len() * plan.choices.len() * measures.len()) as u64;
    let mut rows = vec![];
    for &map in &plan.maps {
        let mut renderer = renderer(map)?;
        for choice in &plan.choices {
            let mut technique = renderer.prepare(choice.info.id, &choice.params)?;
            for measure in &measures {
                renderer.set_light(&stage.scene, measure.light);
                let row = judge(host, (scene, map, choice), &mut renderer, technique.as_mut(), measure, plan)?;
                rows.push(row);
                progress.set(rows.len() as u64, total);
            }
        }
    }
    rows.sort_by(|a, b| a.light_scale.total_cmp(&b.light_scale).then(a.shadow_map.cmp(&b.shadow_map)));
    Ok(rows)
}

/// The truth under the light of every size.
fn measures(host: &Host, stage: &Stage, plan: &Plan, renderer: &mut Renderer<'_>) -> Result<Vec<Measure>> {
    let start = *renderer.light();
    let mut tracer = tracer(stage, &start, plan.size);
    let mut one = |scale| {
        let light = light_view(&stage.scene, &sized(stage, scale));
        tracer.look(stage.camera, &light);
        let (truth, _) = tracer.truth(plan.samples, Seed::Truth)?;
        renderer.set_light(&stage.scene, light);
        let mask = mask(host, renderer, &truth)?;
        let picture = view::picture(host, renderer.picture())?;
        Ok(Measure { scale, light, truth: truth.visibility, mask, picture })
    };
    SCALES.into_iter().map(&mut one).collect()
}

/// Renders, times and judges; the first frame warms up.
fn judge(
    host: &Host,
    (scene, map, choice): (&'static Shipped, u32, &Choice),
    renderer: &mut Renderer<'_>,
    technique: &mut dyn Technique,
    measure: &Measure,
    plan: &Plan,
) -> Result<Row> {
    renderer.frame(technique)?;
    let frames = (0..plan.frames).map(|_| renderer.frame(technique)).collect::<Result<Vec<_>>>()?;
    let test = renderer.visibility(technique)?;
    let picture = view::picture(host, renderer.picture())?;
    let (light_size, light_unit) = width(&measure.light);
    let label = label(choice);
    let report = metrics::compare(&test, &measure.truth, &measure.mask, plan.size);
    let place = |e| Error::Usage(format!("{}, map {map}, light {light_size} {light_unit}, {label}: {e}", scene.name));
    Ok(Row {
        scene: scene.name,
        light_scale: measure.scale,
        light_size,
        light_unit,
        shadow_map: map,
        technique: choice.info.id,
        params: report::params(choice.info, &choice.params),
        flip: truth::flip(&picture, &measure.picture, &measure.mask)?,
        report: report.map_err(place)?,
        label,
        gpu_ms: stats::technique(&frames).map(|s| s.median),
        memory_bytes: technique.memory_bytes(),
    })
}

/// Rows of the same scene, light and map, one group after another.
fn by_cell(rows: &[Row]) -> impl Iterator<Item = &[Row]> {
    rows.chunk_by(|a, b| (a.scene, a.light_scale, a.shadow_map) == (b.scene, b.light_scale, b.shadow_map))
}

fn cell(rows: &[Row]) -> Option<Cell> {
    let rmse = |id: &str| rows.iter().find(|r| r.technique == id).map(|r| r.report.rmse);
    let mut order: Vec<(&'static str, f64)> = ORDER.iter().filter_map(|&id| Some((id, rmse(id)?))).collect();
    // Stable: of equal ones the papers' order is kept.
    order.sort_by(|a, b| a.1.total_cmp(&b.1));
    let order: Vec<_> = order.into_iter().map(|o| o.0).collect();
    let expected = ORDER.iter().filter(|id| order.contains(id));
    let lowest = rows.iter().min_by(|a, b| a.report.rmse.total_cmp(&b.report.rmse))?;
    Some(Cell {
        scene: lowest.scene,
        light_scale: lowest.light_scale,
        shadow_map: lowest.shadow_map,
        holds: (order.len() > 1).then(|| order.iter().eq(expected)),
        order,
        rbssm_below_pcss_percent: rmse(ORDER[0]).zip(rmse(ORDER[1])).map(|(a, b)| 100.0 * (1.0 - a / b)),
        edtssm_star: rmse(BESIDE),
        lowest: lowest.label.clone(),
        lowest_rmse: lowest.report.rmse,
    })
}

/// For every size of the light, and for all together.
fn means(rows: &[Row], maps: &[u32]) -> Vec<Mean> {
    let mut found: Vec<Mean> = vec![];
    for scale in SCALES.into_iter().map(Some).chain([None]) {
        for &map in maps {
            let here = |r: &&Row| r.shadow_map == map && scale.is_none_or(|s| r.light_scale == s);
            let first = found.len();
            for row in rows.iter().filter(here) {
                if found[first..].iter().any(|m| m.label == row.label) {
                    continue;
                }
                let mine: Vec<&Row> = rows.iter().filter(here).filter(|r| r.label == row.label).collect();
                let of = |f: fn(&Row) -> Option<f64>| mean(mine.iter().map(|r| f(r)));
                found.push(Mean {
                    light_scale: scale,
                    shadow_map: map,
                    label: row.label.clone(),
                    technique: row.technique,
                    params: row.params.clone(),
                    rows: mine.len(),
                    rmse: of(|r| Some(r.report.rmse)),
                    penumbra_rmse: of(|r| r.report.penumbra_rmse),
                    mae: of(|r| Some(r.report.mae)),
                    over: of(|r| Some(r.report.over)),
                    under: of(|r| Some(r.report.under)),
                    flip: of(|r| Some(r.flip)),
                    gpu_ms: of(|r| r.gpu_ms),
                });
            }
        }
    }
    found
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A row in which every pixel is too dark by so much.
    fn row(scene: &'static str, light_scale: f64, shadow_map: u32, technique: &'static str, error: f32) -> Row {
        Row {
            scene,
            light_scale,
            light_size: light_scale,
            light_unit: "degrees",
            shadow_map,
            label: technique.into(),
            technique,
            params: Map::new(),
            flip: f64::from(2.0 * error),
            report: metrics::compare(&[1.0 - error; 4], &[1.0; 4], &[true; 4], [2, 2]).unwrap(),
            gpu_ms: (technique != "sm").then(|| 8.0 * f64::from(error)),
            memory_bytes: 0,
        }
    }

    #[test]
    fn cells_say_whether_the_papers_order_holds() {
        let mut rows = vec![];
        for (map, errors) in [(512, [0.25, 0.5, 0.625, 0.75]), (1024, [0.5, 0.25, 0.625, 0.75])] {
            rows.push(row("a", 1.0, map, "sm", 0.875));
            rows.extend(ORDER.iter().zip(errors).map(|(id, e)| row("a", 1.0, map, id, e)));
            rows.push(row("a", 1.0, map, BESIDE, 0.125));
        }
        rows.extend([row("a", 4.0, 512, "sm", 0.5), row("a", 4.0, 512, "pcss", 0.5)]);
        let cells: Vec<_> = by_cell(&rows).filter_map(cell).collect();
        let holds: Vec<_> = cells.iter().map(|c| (c.shadow_map, c.light_scale, c.holds)).collect();
        assert_eq!(holds, [(512, 1.0, Some(true)), (1024, 1.0, Some(false)), (512, 4.0, None)]);
        assert_eq!(cells[1].order, ["pcss", "rbssm", "ssrbssm", "ssabss"]);
        let below: Vec<_> = cells.iter().map(|c| c.rbssm_below_pcss_percent).collect();
        assert_eq!(below, [Some(50.0), Some(-100.0), None]);
        assert_eq!((cells[0].edtssm_star, &cells[0].lowest[..], cells[2].edtssm_star), (Some(0.125), BESIDE, None));
        // Where one of the four is missing, the others' order still counts.
        rows.retain(|r| r.technique != "pcss");
        let cells: Vec<_> = by_cell(&rows).filter_map(cell).collect();
        assert_eq!(cells.iter().map(|c| c.holds).collect::<Vec<_>>(), [Some(true), Some(true), None]);
    }

    #[test]
    fn means_are_of_their_own_light_and_of_all() {
        let mut rows = vec![];
        for (scene, scale, errors) in
            [("a", 0.25, [0.5, 0.25]), ("a", 1.0, [0.5, 0.5]), ("b", 0.25, [0.25, 0.75]), ("b", 1.0, [0.25, 0.5])]
        {
            rows.extend(["sm", "pcss"].iter().zip(errors).map(|(id, e)| row(scene, scale, 512, id, e)));
        }
        let means = means(&rows, &[512, 1024]);
        let of = |scale, id| means.iter().find(|m| m.light_scale == scale && m.technique == id).unwrap();
        assert_eq!((of(Some(0.25), "sm").rmse, of(Some(0.25), "sm").rows), (Some(0.375), 2));
        assert_eq!((of(Some(0.25), "pcss").rmse, of(Some(0.25), "pcss").over), (Some(0.5), Some(0.5)));
        assert_eq!((of(None, "pcss").rmse, of(None, "pcss").rows, of(None, "pcss").gpu_ms), (Some(0.5), 4, Some(4.0)));
        assert_eq!((of(None, "sm").gpu_ms, of(None, "sm").flip), (None, Some(0.75)));
        // 4 is a size without rows, 1024 a map without.
        assert_eq!(means.len(), 2 * 3);
    }

    #[test]
    fn lights_grow_from_the_scenes_own_and_from_a_usual_one_where_that_is_a_point() {
        for shipped in shipped::ALL {
            let mut stage = Stage::shipped(shipped, SIZE).unwrap();
            let of = |stage: &Stage, scale| width(&light_view(&stage.scene, &sized(stage, scale))).0;
            let own = width(&light_view(&stage.scene, &stage.light)).0;
            for scale in SCALES {
                assert!(own > 0.0 && (of(&stage, scale) / (scale * own) - 1.0).abs() < 1e-12, "{}", shipped.name);
            }
            stage.light = super::super::judge::hard(&stage.light);
            let usual = of(&stage, 1.0);
            assert!(usual > 0.0 && (of(&stage, 4.0) / usual - 4.0).abs() < 1e-12, "{}", shipped.name);
        }
    }
}
