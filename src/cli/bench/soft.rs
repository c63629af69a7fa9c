//! Suite `soft`: soft shadows of area lights against the ray-traced truth, for several scenes, map sizes and light
//! sizes.

use super::driver::*;
use super::errors::{self, LEGEND, lowest};
use super::judge::{mask, tracer};
use crate::cli::stats::{self, Span};
use crate::cli::truth::{self, Seed};
use crate::cli::view;
use edgeshade::metrics::{self, Report};
use edgeshade::picture::Picture;
use edgeshade::scene::{Light, LightShape, RenderDesc, Renderer, light_view};
use edgeshade::technique::OutputFormat;
use edgeshade::view::{LightKind, LightView};

pub static SUITE: Suite = Suite {
    name: "soft",
    about: "error and GPU time of soft shadows over scenes, maps and light sizes, with a plot",
    extent: |quick| match quick {
        true => Extent { scenes: vec!["jenga", "robot"], maps: &[1024], size: [192, 108] },
        false => Extent { scenes: every_scene(), maps: &[512, 1024, 2048, 4096], size: [640, 360] },
    },
    variants: |_| Ok(available(CONTENDERS)),
    frames: |plan| SCALES.len() as u32 * (plan.frames + 1),
    shows_scenes: true,
    resumes: true,
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

/// Sizes of the light relative to the scene's own.
const SCALES: [f64; 3] = [0.25, 1.0, 4.0];

/// Techniques to compare, if the registry has them: without penumbrae, with penumbrae of a fixed width, with those of
/// the light.
const CONTENDERS: &str = "sm pcf:width=15 pcss pcss:preset=published rbssm rbssm:preset=published ssrbssm \
                          ssrbssm:preset=published ssabss ssabss:preset=published edtssm edtssm:preset=published \
                          edtssm-star soft-auto exact-soft";
/// Techniques from the lowest error to the highest, as the papers report. Their order here is that of the published forms.
const ORDER: [&str; 4] = ["rbssm", "pcss", "ssrbssm", "ssabss"];
/// Technique that the papers do not rank.
const BESIDE: &str = "edtssm-star";

/// Errors, and the times measured with them.
fn columns() -> Vec<Column> {
    [&errors::COLUMNS[..], &[("FLIP", "flip", 4), ("GPU ms", "gpu_ms", 3)]].concat()
}

/// A light of one size, and the truth under it.
struct Measure {
    scale: f64,
    light: LightView,
    truth: Vec<f32>,
    mask: Vec<bool>,
    /// The scene lit with the truth.
    picture: Picture,
}

/// Rays per pixel of the truth.
fn samples(plan: &Plan) -> u32 {
    if plan.quick { 64 } else { 1024 }
}

/// The light with its size scaled from the scene's own, or from the default size if the scene's light is a point.
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

/// Width of a spot in world units or angle of a sun in degrees, with the unit.
fn width(light: &LightView) -> (f64, &'static str) {
    match light.kind {
        LightKind::Spot { size } => (size, "world units"),
        LightKind::Directional { angle } => (angle.to_degrees(), "degrees"),
    }
}

fn measure(host: &Host, run: &mut Run<'_>, scene: &'static str) -> Result<()> {
    let plan = run.plan;
    let stage = plan.stage(scene)?;
    // The map is drawn in every frame, so that everything derived from it counts.
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
                let report = metrics::compare(&test, &measure.truth, &measure.mask, plan.size).map_err(place)?;
                let view = format!("{scene}, light {light_size} {unit}");
                run.picture(&view, map, variant, [&test, &measure.truth], &measure.mask)?;
                let flip = truth::flip(&picture, &measure.picture, &measure.mask)?;
                // The technique's own passes, median over the frames.
                let gpu_ms = stats::technique(&frames).map(|s| s.median);
                let figures = figures(flip, &report, gpu_ms, technique.memory_bytes());
                let light = (measure.scale, light_size, unit);
                run.push(row(scene, light, map, variant, figures), plan.frames + 1);
            }
        }
    }
    let scale = |r: &Row| SCALES.iter().position(|s| r.number("light_scale") == Some(*s));
    run.rows[first..].sort_by_key(|r| (scale(r), r.number("shadow_map").map(f64::to_bits)));
    Ok(())
}

fn row(scene: &str, (scale, size, unit): (f64, f64, &str), map: u32, variant: &Variant, figures: Record) -> Row {
    let place = [
        ("scene", scene.into()),
        ("light_scale", scale.into()),
        ("light_size", size.into()),
        ("light_unit", unit.into()),
        ("shadow_map", map.into()),
    ];
    let row = Row::of(place, variant, &format!("{scene} {scale} {map}"), figures);
    row.and_shown([("light", format!("x {scale}").into())])
}

fn figures(flip: f64, report: &Report, gpu_ms: Option<f64>, memory_bytes: u64) -> Record {
    let beside = [("gpu_ms", gpu_ms.into()), ("memory_bytes", memory_bytes.into())];
    Record::of([("flip", flip.into())]).and(errors::figures(report).0).and(beside)
}

/// Truths for every size of the light.
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

/// Means for every size of the light and for all sizes together, and the order by error in every scene, light and
/// map.
fn summary(plan: &Plan, rows: &[Row]) -> Record {
    let scales = SCALES.into_iter().map(Some).chain([None]);
    let keys = scales.flat_map(|scale| plan.keys(&Record::of([("light_scale", scale.into())])));
    let count = |mine: &[&Row]| Record::of([("rows", mine.len().into())]);
    let mut means = means(rows, keys.collect(), &columns(), count);
    means.retain(|m| m.number("rows") > Some(0.0));
    let cells = groups(rows).filter_map(cell).collect();
    Record::of([("means", Field::Rows(means)), ("cells", Field::Rows(cells))])
}

/// The techniques' order by error in one scene with one map and one size of the light.
fn cell(rows: &[Row]) -> Option<Row> {
    let rmse = |label: &str| rows.iter().find(|r| r.label == label)?.number("rmse");
    let published = |id: &str| rmse(&format!("{id} preset=published"));
    let mut order: Vec<(&'static str, f64)> = ORDER.iter().filter_map(|&id| Some((id, published(id)?))).collect();
    // The sort is stable: equal errors keep the papers' order.
    order.sort_by(|a, b| a.1.total_cmp(&b.1));
    let order: Vec<_> = order.into_iter().map(|o| o.0).collect();
    // True if this is the papers' order; fewer than two techniques have none.
    let holds = (order.len() > 1).then(|| order.iter().eq(ORDER.iter().filter(|id| order.contains(id))));
    let below = published(ORDER[0]).zip(published(ORDER[1])).map(|(a, b)| 1.0 - a / b);
    let lowest = lowest(rows)?;
    let shown = [
        ("light", lowest.text("light").into()),
        ("order", if order.is_empty() { "-".into() } else { order.join(" < ").into() }),
        ("holds", holds.map(|h| if h { "yes" } else { "no" }).into()),
        ("rbssm_below_pcss", below.into()),
    ];
    let figures = [
        ("order", order.into()),
        ("holds", holds.into()),
        ("rbssm_below_pcss_percent", below.map(|b| 100.0 * b).into()),
        ("edtssm_star", rmse(BESIDE).into()),
        ("lowest", lowest.label.as_str().into()),
        ("lowest_rmse", lowest.number("rmse").into()),
    ];
    let place = lowest.fields.only(&["scene", "light_scale", "shadow_map"]);
    Some(Row::new("", "", place.and(figures)).and_shown(shown))
}

/// Tables of the lights, of the order by error and of the means, then tables of every scene.
fn page(results: &Results<'_>) -> String {
    let plan = results.plan;
    let about = format!("against ray-traced shadows of the area light, {} rays per pixel.", samples(plan));
    let mut text = results.head(&about)
        + &format!(
            "{LEGEND}; `FLIP`: of the lit pictures; `GPU ms`: the technique's own passes, median of {} frames, in which everything \
             derived from the shadow map is recomputed.\n\n",
            plan.frames
        );
    text += &left_out_note(&plan.left_out);
    text += &lights(&results.rows);
    text += &conclusions(results.list("cells"));
    let lead = [("light", "light", 0), ("map", "shadow_map", 0), ("<technique", "label", 0)];
    let columns = [&lead[..], &columns()].concat();
    for scale in SCALES.into_iter().map(Some).chain([None]) {
        let light = scale.map_or_else(|| "all sizes of the light".to_owned(), |s| format!("light x {s}"));
        let means = results.list("means").iter().filter(|m| m.number("light_scale") == scale);
        text += &format!("\n## Mean over the scenes, {light}\n\n{}", table(&columns[1..], means));
    }
    text + &tables_by_scene(&columns, &results.rows)
}

/// Table of the lights' sizes.
fn lights(rows: &[Row]) -> String {
    let line = |rows: &[Row]| {
        let unit = rows[0].text("light_unit");
        let kind = if unit == "degrees" { "sun" } else { "spot" };
        let of = |scale| rows.iter().find(|r| r.number("light_scale") == Some(scale))?.number("light_size");
        let light = [rows[0].text("scene").to_owned(), format!("{kind}, {unit}")];
        light.into_iter().chain(SCALES.map(|s| number(of(s), 4))).collect()
    };
    let heads = SCALES.map(|s| format!(" | x {s}")).concat();
    "## Sizes of the lights\n\nColumns are factors of the scene's own size: full width of a spot's square in world units, full \
     angle of a sun in degrees.\n\n"
        .to_owned()
        + &plain_table(&format!("<scene | <light{heads}"), by_scene(rows).map(line))
}

/// Says how often the papers' order holds, and where it does not.
fn conclusions(cells: &[Row]) -> String {
    let mut text = format!(
        "\n## Order by error\n\nThe papers find {} in RMSE. The techniques are ordered in the forms that the papers \
         describe (`preset=published`). `rbssm below pcss` is in percent of the RMSE of `pcss`. \
         The lowest is the lowest of all techniques in the cell.\n\n",
        ORDER.map(|id| format!("`{id}`")).join(" < ")
    );
    let mut say_how_often = |what: &str, holds: &dyn Fn(&Row) -> Option<bool>| {
        let found: Vec<_> = cells.iter().filter_map(holds).collect();
        if !found.is_empty() {
            let held = found.iter().filter(|h| **h).count();
            text += &format!("* {what}: {held} of {} cells.\n", found.len());
        }
    };
    say_how_often("The order of all techniques in the cell", &holds);
    for pair in ORDER.windows(2) {
        let is_below = |c: &Row| {
            let place = |id| c.text("order").split(" < ").position(|o| o == id);
            Some(place(pair[0])? < place(pair[1])?)
        };
        say_how_often(&format!("`{}` below `{}`", pair[0], pair[1]), &is_below);
    }
    for scale in SCALES {
        let mine = cells.iter().filter(|c| c.number("light_scale") == Some(scale));
        if let Some(s) = Span::of(mine.filter_map(|c| c.number("rbssm_below_pcss_percent"))) {
            let [median, min, max] = [s.median, s.min, s.max].map(|v| number(v, 1));
            text += &format!("* Light x {scale}: `rbssm` is {median} % below `pcss` (median; {min} to {max} %).\n");
        }
    }
    const COLUMNS: [Column; 9] = [
        ("<scene", "scene", 0),
        ("light", "light", 0),
        ("map", "shadow_map", 0),
        ("<from the lowest", "order", 0),
        ("<as the papers", "holds", 0),
        ("rbssm below pcss %", "rbssm_below_pcss", 1),
        ("edtssm-star", "edtssm_star", 4),
        ("<lowest", "lowest", 0),
        ("RMSE", "lowest_rmse", 4),
    ];
    text + "\n" + &table(&COLUMNS, cells)
}

/// True if the papers' order holds in a cell; `None` if it has fewer than two techniques.
fn holds(cell: &Row) -> Option<bool> {
    Some(cell.text("holds")).filter(|text| !text.is_empty()).map(|text| text == "yes")
}

/// Mean RMSE over mean GPU time; each technique's line connects the sizes of the map.
fn chart(results: &Results<'_>) -> Chart {
    let plan = results.plan;
    let line = |v: &Variant| {
        let all = results.list("means").iter().filter(|m| m.number("light_scale").is_none() && m.label == v.label);
        let points = all.filter_map(|m| Some((m.number("gpu_ms")?, m.number("rmse")?))).collect();
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

    /// A row in which the mean error is `error`, all of it too dark.
    fn row(scene: &'static str, scale: f64, map: u32, technique: &str, error: f32) -> Row {
        let report = metrics::compare(&[1.0 - error; 4], &[1.0; 4], &[true; 4], [2, 2]).unwrap();
        let gpu_ms = (technique != "sm").then(|| 8.0 * f64::from(error));
        let figures = figures(f64::from(2.0 * error), &report, gpu_ms, 0);
        let variant = available(technique).found.remove(0);
        super::row(scene, (scale, scale, "degrees"), map, &variant, figures)
    }

    #[test]
    fn cells_say_whether_the_papers_order_holds() {
        let mut rows = vec![];
        for (map, errors) in [(512, [0.25, 0.5, 0.625, 0.75]), (1024, [0.5, 0.25, 0.625, 0.75])] {
            rows.push(row("a", 1.0, map, "sm", 0.875));
            rows.extend(
                ORDER.iter().zip(errors).map(|(id, e)| row("a", 1.0, map, &format!("{id}:preset=published"), e)),
            );
            // The defaults do not count.
            rows.push(row("a", 1.0, map, "ssabss", 0.0625));
            rows.push(row("a", 1.0, map, BESIDE, 0.125));
        }
        rows.extend([row("a", 4.0, 512, "sm", 0.5), row("a", 4.0, 512, "pcss:preset=published", 0.5)]);
        let cells: Vec<_> = groups(&rows).filter_map(cell).collect();
        let found: Vec<_> = cells.iter().map(|c| (c.number("shadow_map"), c.text("light"), holds(c))).collect();
        let expected =
            [(Some(512.0), "x 1", Some(true)), (Some(1024.0), "x 1", Some(false)), (Some(512.0), "x 4", None)];
        assert_eq!(found, expected);
        assert_eq!(*cells[1].fields.get("order"), vec!["pcss", "rbssm", "ssrbssm", "ssabss"].into());
        let below: Vec<_> = cells.iter().map(|c| c.number("rbssm_below_pcss_percent")).collect();
        assert_eq!(below, [Some(50.0), Some(-100.0), None]);
        assert_eq!((cells[0].number("edtssm_star"), cells[0].text("lowest")), (Some(0.125), "ssabss"));
        assert_eq!(cells[2].number("edtssm_star"), None);
        // If one of the four is missing, the order of the others still counts.
        rows.retain(|r| r.label != "pcss preset=published");
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
        let Field::Rows(means) = summary.get("means") else { panic!("no means") };
        let of = |scale: Option<f64>, id, figure| {
            let mut mine = means.iter().filter(|m| m.number("light_scale") == scale);
            mine.find(|m| m.label == id).unwrap().number(figure)
        };
        assert_eq!(["rmse", "rows"].map(|f| of(Some(0.25), "sm", f)), [Some(0.375), Some(2.0)]);
        assert_eq!(["rmse", "over"].map(|f| of(Some(0.25), "pcss", f)), [Some(0.5), Some(0.5)]);
        assert_eq!(["rmse", "rows", "gpu_ms"].map(|f| of(None, "pcss", f)), [Some(0.5), Some(4.0), Some(4.0)]);
        assert_eq!(["gpu_ms", "flip"].map(|f| of(None, "sm", f)), [None, Some(0.75)]);
        // 4 is a scale without rows, 1024 a map without rows.
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
