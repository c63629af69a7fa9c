//! Suite `soft`: soft shadows of area lights against the ray-traced truth, over scenes, sizes of map and of light.

use super::driver::*;
use super::judge::{mask, tracer};
use crate::cli::stats::{self, Span};
use crate::cli::truth::{self, Seed};
use crate::cli::view;
use edgeshade::metrics::{self, Report};
use edgeshade::picture::Picture;
use edgeshade::scene::{Light, LightShape, RenderDesc, Renderer, light_view};
use edgeshade::technique::OutputFormat;
use edgeshade::view::{LightKind, LightView};

pub static SUITE: Suite<Soft> = Suite {
    name: "soft",
    about: "error and GPU time of soft shadows over scenes, maps and light sizes, with a plot",
    extent: |quick| match quick {
        true => Extent { scenes: vec!["jenga", "robot"], maps: &[1024], size: [192, 108] },
        false => Extent { scenes: every_scene(), maps: &[512, 1024, 2048, 4096], size: [640, 360] },
    },
    variants: |_| Ok(available(&CONTENDERS)),
    frames: |plan| SCALES.len() as u32 * (plan.frames + 1),
    shows_scenes: true,
    measure,
    settings: |plan| {
        let (samples, left_out) = (samples(plan).into(), plan.left_out.clone().into());
        Record::of([("samples", samples), ("frames", plan.frames.into()), ("left_out", left_out)])
    },
    summary,
    page,
    chart: Some(chart),
    ..Suite::BASE
};

/// Sizes of the light by the scene's own.
const SCALES: [f64; 3] = [0.25, 1.0, 4.0];

/// What is judged, as far as the registry has it: without penumbrae, with those of a fixed width, with those of the light.
const CONTENDERS: [Wanted; 9] = [
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

/// Of one technique in one scene with one map under a light of one size.
#[derive(Serialize)]
pub struct Soft {
    /// Mean FLIP difference of the lit pictures.
    flip: f64,
    #[serde(flatten)]
    report: Report,
    /// The technique's own passes, median over the frames.
    gpu_ms: Option<f64>,
    memory_bytes: u64,
}

/// What tables and means show.
const COLUMNS: [Column<Soft>; 7] = [
    Column::new("rmse", "RMSE", 4, |s| Some(s.report.rmse)),
    Column::new("penumbra_rmse", "in the band", 4, |s| s.report.penumbra_rmse),
    Column::new("mae", "MAE", 4, |s| Some(s.report.mae)),
    Column::new("over", "over", 4, |s| Some(s.report.over)),
    Column::new("under", "under", 4, |s| Some(s.report.under)),
    Column::new("flip", "FLIP", 4, |s| Some(s.flip)),
    Column::new("gpu_ms", "GPU ms", 3, |s| s.gpu_ms),
];

/// A light of one size, and what is compared with under it.
struct Measure {
    scale: f64,
    light: LightView,
    truth: Vec<f32>,
    mask: Vec<bool>,
    /// Lit with the truth.
    picture: Picture,
}

/// Rays a pixel of the truth.
fn samples(plan: &Plan) -> u32 {
    if plan.quick { 64 } else { 1024 }
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

fn measure(host: &Host, run: &mut Run<'_, Soft>, scene: &'static str) -> Result<()> {
    let plan = run.plan;
    let stage = plan.stage(scene)?;
    // The map is drawn every frame, and what is made of it alone counts.
    let renderer = |map_size| {
        let desc = RenderDesc { size: plan.size, map_size, output: OutputFormat::R32, ..RenderDesc::default() };
        Renderer::new(host, &stage.scene, stage.camera, &stage.light, desc)
    };
    let measures = measures(host, &stage, plan, &mut renderer(plan.maps[0])?)?;
    run.start(scene);
    let first = run.rows.len();
    for &map in plan.maps {
        let mut renderer = renderer(map)?;
        for (variant, _) in plan.members(scene, map) {
            let mut technique = renderer.prepare(variant.choice.info.id, &variant.choice.params)?;
            for measure in &measures {
                renderer.set_light(&stage.scene, measure.light);
                // The first frame warms up.
                renderer.frame(technique.as_mut())?;
                let frames =
                    (0..plan.frames).map(|_| renderer.frame(technique.as_mut())).collect::<Result<Vec<_>>>()?;
                let test = renderer.visibility(technique.as_ref())?;
                let picture = view::picture(host, renderer.picture())?;
                let (light_size, unit) = width(&measure.light);
                let place = |e| {
                    let place = format!("{scene}, map {map}, light {light_size} {unit}, {}", variant.label);
                    Error::Usage(format!("{place}: {e}"))
                };
                let figures = Soft {
                    flip: truth::flip(&picture, &measure.picture, &measure.mask)?,
                    report: metrics::compare(&test, &measure.truth, &measure.mask, plan.size).map_err(place)?,
                    gpu_ms: stats::technique(&frames).map(|s| s.median),
                    memory_bytes: technique.memory_bytes(),
                };
                run.push(row(scene, (measure.scale, light_size, unit), map, variant, figures));
                run.drawn(plan.frames + 1);
            }
        }
    }
    let scale = |r: &Row<Soft>| SCALES.iter().position(|s| r.place.number("light_scale") == Some(*s));
    run.rows[first..].sort_by_key(|r| (scale(r), r.place.get("shadow_map").as_u64()));
    Ok(())
}

fn row(scene: &str, (scale, size, unit): (f64, f64, &str), map: u32, variant: &Variant, figures: Soft) -> Row<Soft> {
    let place = [
        ("scene", scene.into()),
        ("light_scale", scale.into()),
        ("light_size", size.into()),
        ("light_unit", unit.into()),
        ("shadow_map", map.into()),
    ];
    Row::new(place, variant, &format!("{scene} {scale} {map}"), figures)
}

/// The truth under the light of every size.
fn measures(host: &Host, stage: &Stage, plan: &Plan, renderer: &mut Renderer<'_>) -> Result<Vec<Measure>> {
    let start = *renderer.light();
    let mut tracer = tracer(stage, &start, plan.size);
    let mut one = |scale| {
        let light = light_view(&stage.scene, &sized(stage, scale));
        tracer.look(stage.camera, &light);
        let (truth, _) = tracer.truth(samples(plan), Seed::Truth)?;
        renderer.set_light(&stage.scene, light);
        let mask = mask(host, renderer, &truth)?;
        let picture = view::picture(host, renderer.picture())?;
        Ok(Measure { scale, light, truth: truth.visibility, mask, picture })
    };
    SCALES.into_iter().map(&mut one).collect()
}

/// Means for every size of the light and for all together, and the order by error in every scene, light and map.
fn summary(plan: &Plan, rows: &[Row<Soft>]) -> Summary {
    let scales = SCALES.into_iter().map(Some).chain([None]);
    let key = |scale: Option<f64>, (map, variant): (Option<u32>, &Variant)| {
        let mut place = Record::of([("light_scale", scale.into()), ("shadow_map", map.into())]);
        place.0.extend(variant.fields());
        (variant.label.clone(), place)
    };
    let keys = scales.flat_map(|scale| plan.cells().map(move |cell| key(scale, cell)));
    let mut means = means(rows, keys, &COLUMNS, |mine| Record::of([("rows", mine.len().into())]));
    means.retain(|m| m.figures.number("rows") > Some(0.0));
    let cells = groups(rows).filter_map(cell).map(Row::from).collect();
    Fields(vec![("means", means), ("cells", cells)])
}

/// Says who errs least in one scene with one map under a light of one size.
fn cell(rows: &[Row<Soft>]) -> Option<Record> {
    let rmse = |id: &str| rows.iter().find(|r| r.label == id).map(|r| r.figures.report.rmse);
    let mut order: Vec<(&'static str, f64)> = ORDER.iter().filter_map(|&id| Some((id, rmse(id)?))).collect();
    // Stable: of equal ones the papers' order is kept.
    order.sort_by(|a, b| a.1.total_cmp(&b.1));
    let order: Vec<_> = order.into_iter().map(|o| o.0).collect();
    // Whether that is the papers' order; of fewer than two there is none.
    let holds = (order.len() > 1).then(|| order.iter().eq(ORDER.iter().filter(|id| order.contains(id))));
    let below = rmse(ORDER[0]).zip(rmse(ORDER[1])).map(|(a, b)| 100.0 * (1.0 - a / b));
    let lowest = rows.iter().min_by(|a, b| a.figures.report.rmse.total_cmp(&b.figures.report.rmse))?;
    let mut cell = lowest.place.only(&["scene", "light_scale", "shadow_map"]);
    cell.0.extend([
        ("order", order.into()),
        ("holds", holds.into()),
        ("rbssm_below_pcss_percent", below.into()),
        ("edtssm_star", rmse(BESIDE).into()),
        ("lowest", lowest.label.as_str().into()),
        ("lowest_rmse", lowest.figures.report.rmse.into()),
    ]);
    Some(cell)
}

/// Everything in tables.
fn page(results: &Results<'_, Soft>) -> String {
    let plan = results.plan;
    let about = format!("against ray-traced shadows of the area light, {} rays a pixel.", samples(plan));
    let mut text = results.head(&about)
        + &format!(
            "`RMSE`, `MAE`: over the judged pixels; `in the band`: RMSE within 8 px of the true penumbra; `over`, `under`: too \
             dark, too light, mean over the judged pixels; `FLIP`: of the lit pictures; `GPU ms`: the technique's own passes, \
             median of {} frames, with all that is made of the shadow map anew.\n\n",
            plan.frames
        );
    text += &left_out_note(&plan.left_out);
    text += &lights(&results.rows);
    text += &conclusions(results.list("cells"));
    for scale in SCALES.into_iter().map(Some).chain([None]) {
        let light = scale.map_or_else(|| "all sizes of the light".to_owned(), |s| format!("light x {s}"));
        let means = results.list("means").iter().filter(|m| m.place.number("light_scale") == scale);
        let cells = |m: &Row<Record>| [m.place.text("shadow_map"), m.label.clone()];
        let table = table_of(("map | <technique", cells), (&COLUMNS, Column::of_mean), means);
        text += &format!("\n## Mean over the scenes, {light}\n\n{table}");
    }
    for (scene, rows) in by_scene(&results.rows) {
        let cells = |r: &Row<Soft>| [x(&r.place), r.place.text("shadow_map"), r.label.clone()];
        let table = table_of(("light | map | <technique", cells), (&COLUMNS, Column::of_row), rows);
        text += &format!("\n## {scene}\n\n{table}");
    }
    text
}

/// The light's size by the scene's own.
fn x(place: &Record) -> String {
    format!("x {}", place.text("light_scale"))
}

/// How large the lights are.
fn lights(rows: &[Row<Soft>]) -> String {
    let line = |(scene, rows): (String, &[Row<Soft>])| {
        let unit = rows[0].place.text("light_unit");
        let kind = if unit == "degrees" { "sun" } else { "spot" };
        let of = |scale| rows.iter().find(|r| r.place.number("light_scale") == Some(scale))?.place.number("light_size");
        [scene, format!("{kind}, {unit}")].into_iter().chain(SCALES.map(|s| number(of(s), 4))).collect()
    };
    let heads = SCALES.map(|s| format!(" | x {s}")).concat();
    "## Sizes of the lights\n\nBy the scene's own: full width of a spot's square in world units, full angle of a sun in \
     degrees.\n\n"
        .to_owned()
        + &table(&format!("<scene | <light{heads}"), by_scene(rows).map(line))
}

/// Whether the papers' order holds, and where not.
fn conclusions(cells: &[Row<Record>]) -> String {
    let mut text = format!(
        "\n## Order by error\n\nThe papers find {} in RMSE. `rbssm below pcss`: per cent of the RMSE of `pcss`. The \
         lowest is that of all in the cell.\n\n",
        ORDER.map(|id| format!("`{id}`")).join(" < ")
    );
    let order = |c: &Row<Record>| -> Vec<String> {
        let ids = c.figures.get("order").as_array().into_iter().flatten();
        ids.filter_map(|id| Some(id.as_str()?.to_owned())).collect()
    };
    let mut say_how_often = |what: String, found: Vec<bool>| {
        if !found.is_empty() {
            let held = found.iter().filter(|h| **h).count();
            text += &format!("* {what}: {held} of {} cells.\n", found.len());
        }
    };
    let holds = |c: &Row<Record>| c.figures.get("holds").as_bool();
    say_how_often("The whole order, of those that there are".into(), cells.iter().filter_map(holds).collect());
    for pair in ORDER.windows(2) {
        let is_below = |c: &Row<Record>| {
            let order = order(c);
            let place = |id| order.iter().position(|o| o == id);
            Some(place(pair[0])? < place(pair[1])?)
        };
        say_how_often(format!("`{}` below `{}`", pair[0], pair[1]), cells.iter().filter_map(is_below).collect());
    }
    for scale in SCALES {
        let mine = cells.iter().filter(|c| c.figures.number("light_scale") == Some(scale));
        if let Some(s) = Span::of(mine.filter_map(|c| c.figures.number("rbssm_below_pcss_percent"))) {
            let [median, min, max] = [s.median, s.min, s.max].map(|v| number(v, 1));
            text += &format!("* Light x {scale}: `rbssm` is {median} % below `pcss` (median; {min} to {max} %).\n");
        }
    }
    let line = |c: &Row<Record>| {
        let (figures, order) = (&c.figures, order(c));
        vec![
            figures.text("scene"),
            x(figures),
            figures.text("shadow_map"),
            if order.is_empty() { "-".to_owned() } else { order.join(" < ") },
            holds(c).map_or("-", |h| if h { "yes" } else { "no" }).to_owned(),
            number(figures.number("rbssm_below_pcss_percent"), 1),
            number(figures.number("edtssm_star"), 4),
            figures.text("lowest"),
            number(figures.number("lowest_rmse"), 4),
        ]
    };
    let heads =
        "<scene | light | map | <from the lowest | <as the papers | rbssm below pcss % | edtssm-star | <lowest | RMSE";
    text + "\n" + &table(heads, cells.iter().map(line))
}

/// Mean RMSE over mean GPU time, a line a technique through the sizes of the map.
fn chart(results: &Results<'_, Soft>) -> Chart {
    let plan = results.plan;
    let line = |v: &Variant| {
        let all = results.list("means").iter().filter(|m| m.place.get("light_scale").is_null() && m.label == v.label);
        let points = all.filter_map(|m| Some((m.figures.number("gpu_ms")?, m.figures.number("rmse")?))).collect();
        Line { name: v.label.clone(), points }
    };
    let [low, high] = [plan.maps.iter().min(), plan.maps.iter().max()].map(|map| number(map.map(|&m| f64::from(m)), 0));
    Chart {
        title: format!("Error of soft shadows over GPU time, maps of {low} to {high}, mean over scenes and lights"),
        axes: ["GPU ms of the technique's passes", "RMSE"],
        lines: plan.variants.iter().map(line).collect(),
    }
}

#[cfg(test)]
mod tests {
    use super::super::judge::hard;
    use super::*;
    use serde_json::Value;

    /// A row in which every pixel is too dark by so much.
    fn row(scene: &'static str, scale: f64, map: u32, technique: &'static str, error: f32) -> Row<Soft> {
        let figures = Soft {
            flip: f64::from(2.0 * error),
            report: metrics::compare(&[1.0 - error; 4], &[1.0; 4], &[true; 4], [2, 2]).unwrap(),
            gpu_ms: (technique != "sm").then(|| 8.0 * f64::from(error)),
            memory_bytes: 0,
        };
        let variant = available(&[(technique, &[])]).found.remove(0);
        super::row(scene, (scale, scale, "degrees"), map, &variant, figures)
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
        let cells: Vec<_> = groups(&rows).filter_map(cell).collect();
        let holds = |c: &Record| c.get("holds").as_bool();
        let found: Vec<_> = cells.iter().map(|c| (c.text("shadow_map"), c.text("light_scale"), holds(c))).collect();
        let expected = [("512", "1", Some(true)), ("1024", "1", Some(false)), ("512", "4", None)];
        assert_eq!(found, expected.map(|(map, light, holds)| (map.to_owned(), light.to_owned(), holds)));
        assert_eq!(*cells[1].get("order"), Value::from(vec!["pcss", "rbssm", "ssrbssm", "ssabss"]));
        let below: Vec<_> = cells.iter().map(|c| c.number("rbssm_below_pcss_percent")).collect();
        assert_eq!(below, [Some(50.0), Some(-100.0), None]);
        assert_eq!((cells[0].number("edtssm_star"), cells[0].text("lowest")), (Some(0.125), BESIDE.to_owned()));
        assert!(cells[2].get("edtssm_star").is_null());
        // Where one of the four is missing, the others' order still counts.
        rows.retain(|r| r.label != "pcss");
        let found: Vec<_> = groups(&rows).filter_map(cell).map(|c| holds(&c)).collect();
        assert_eq!(found, [Some(true), Some(true), None]);
    }

    #[test]
    fn means_are_of_their_own_light_and_of_all() {
        let mut rows = vec![];
        for (scene, scale, errors) in
            [("a", 0.25, [0.5, 0.25]), ("a", 1.0, [0.5, 0.5]), ("b", 0.25, [0.25, 0.75]), ("b", 1.0, [0.25, 0.5])]
        {
            rows.extend(["sm", "pcss"].iter().zip(errors).map(|(id, e)| row(scene, scale, 512, id, e)));
        }
        let plan = SUITE.plan(false, 1, None, DeviceFeatures::default()).unwrap();
        let summary = summary(&Plan { maps: &[512, 1024], ..plan }, &rows);
        let means = &summary.0[0].1;
        let of = |scale: Option<f64>, id, figure| {
            let mut mine = means.iter().filter(|m| m.place.number("light_scale") == scale);
            mine.find(|m| m.label == id).unwrap().figures.number(figure)
        };
        assert_eq!(["rmse", "rows"].map(|f| of(Some(0.25), "sm", f)), [Some(0.375), Some(2.0)]);
        assert_eq!(["rmse", "over"].map(|f| of(Some(0.25), "pcss", f)), [Some(0.5), Some(0.5)]);
        assert_eq!(["rmse", "rows", "gpu_ms"].map(|f| of(None, "pcss", f)), [Some(0.5), Some(4.0), Some(4.0)]);
        assert_eq!(["gpu_ms", "flip"].map(|f| of(None, "sm", f)), [None, Some(0.75)]);
        // 4 is a size without rows, 1024 a map without.
        assert_eq!(means.len(), 2 * 3);
    }

    #[test]
    fn lights_grow_from_the_scenes_own_and_from_a_usual_one_where_that_is_a_point() {
        for name in every_scene() {
            let mut stage = Stage::shipped(find_scene(name).unwrap(), SIZE).unwrap();
            let of = |stage: &Stage, scale| width(&light_view(&stage.scene, &sized(stage, scale))).0;
            let own = width(&light_view(&stage.scene, &stage.light)).0;
            for scale in SCALES {
                assert!(own > 0.0 && (of(&stage, scale) / (scale * own) - 1.0).abs() < 1e-12, "{name}");
            }
            stage.light = hard(&stage.light);
            let usual = of(&stage, 1.0);
            assert!(usual > 0.0 && (of(&stage, 4.0) / usual - 4.0).abs() < 1e-12, "{name}");
        }
    }
}
