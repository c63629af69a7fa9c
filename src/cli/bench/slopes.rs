//! Suite `slopes`: plates over a plane that is tilted increasingly against the light.

use super::driver::*;
use super::judge::{mask, renderer, tracer, visibility};
use super::tilted::{Edge, Lamp, MAP, Tilted, is_complete};
use edgeshade::metrics;

pub static SUITE: Suite = Suite {
    name: "slopes",
    about: "false shadow and boundary error over the receiver's tilt",
    // 4.4 pixels per texel, or 1.7 in a quick run.
    extent: |quick| {
        let side = if quick { 384 } else { 1024 };
        Extent { scenes: vec!["sun", "spot"], maps: &[MAP], size: [side; 2] }
    },
    variants: |_| contenders(),
    frames: |plan| tilts(plan).len() as u32,
    measure: |host, run, scene| {
        run.start(scene);
        let lamp = if scene == "sun" { Lamp::Sun } else { Lamp::Spot };
        tilts(run.plan).iter().try_for_each(|&tilt| one_tilt(host, run, (scene, lamp), tilt))
    },
    settings: |plan| {
        let texel_px = Tilted::new(Lamp::Sun, 0.0, plan.size).texel_px;
        Record::of([("shadow_map", MAP.into()), ("texel_px", texel_px.into())])
    },
    page,
    ..Suite::BASE
};

/// Distance in texels from every true shadow beyond which a dark pixel counts as false shadow.
const NEAR: f64 = 2.0;

/// Tables: title, name of the figure, and the factor applied to it.
const TABLES: [(&str, &str, f64); 5] = [
    (
        "Displacement of the boundary, texels (mismatched area per length of the true boundary)",
        "displacement_texels",
        1.0,
    ),
    ("False shadow, % of the pixels that are lit up to two texels around", "false_shadow", 100.0),
    ("Displacement of straight edges, texels", "straight_texels", 1.0),
    ("Displacement of curved edges, texels", "curved_texels", 1.0),
    ("Displacement of thin bars, texels", "thin_texels", 1.0),
];

/// Angles between the plane's normal and the light in degrees.
fn tilts(plan: &Plan) -> &'static [u32] {
    if plan.quick { &[0, 60, 80] } else { &[0, 10, 30, 45, 60, 70, 75, 80, 85] }
}

fn one_tilt(host: &Host, run: &mut Run<'_>, (scene, lamp): (&'static str, Lamp), tilt: u32) -> Result<()> {
    let plan = run.plan;
    let size = plan.size;
    let tilted = Tilted::new(lamp, f64::from(tilt).to_radians(), size);
    let mut renderer = renderer(host, &tilted.stage, size, MAP)?;
    renderer.set_light(&tilted.stage.scene, tilted.light);
    let truth = tracer(&tilted.stage, &tilted.light, size).quiet().hard()?;
    let mask = mask(host, &mut renderer, &truth)?;
    if !is_complete(&tilted, &truth, &mask) {
        let [w, h] = size;
        return Err(Error::Usage(format!("suite slopes: {w}x{h} pixels are too few to show every plate's shadow")));
    }
    let truth = &truth.visibility;
    let [straight, curved, thin] = [Edge::Straight, Edge::Curved, Edge::Thin].map(|edge| tilted.part(&mask, edge));
    for (variant, group) in plan.members(scene, MAP) {
        let test = visibility(&mut renderer, &variant.choice)?;
        let report = metrics::compare(&test, truth, &mask, size)?;
        let acne = metrics::false_shadow(&test, truth, &mask, size, tilted.near_px(NEAR))?;
        let texels = |px: Option<f64>| px.map(|px| px / tilted.texel_px).into();
        let along = |part: &[bool]| Ok::<_, Error>(texels(metrics::mismatch_per_boundary(&test, truth, part, size)?));
        let figures = Record::of([
            // Share and number of the dark pixels where the truth is lit, there and two texels around.
            ("false_shadow", acne.share().into()),
            ("false_shadow_pixels", acne.dark.into()),
            // Mean distance between the boundary and the true one: the mismatched area per length of the true
            // boundary. Below, the same for each kind of plate.
            ("displacement_texels", texels(report.mismatch_per_boundary)),
            ("straight_texels", along(&straight)?),
            ("curved_texels", along(&curved)?),
            ("thin_texels", along(&thin)?),
            // Signed mean and unsigned 95th percentile over the tested boundary.
            ("boundary_mean_texels", texels(report.boundary.map(|b| b.mean))),
            ("boundary_p95_texels", texels(report.boundary.map(|b| b.p95))),
            ("over", report.over.into()),
            ("under", report.under.into()),
        ]);
        let place = [("light", scene.into()), ("tilt_degrees", tilt.into())];
        run.push(Row::of(place, variant, &group, figures), 1);
    }
    Ok(())
}

/// A table for every figure and light, with a line for each technique and a column for each tilt.
fn page(results: &Results<'_>) -> String {
    let plan = results.plan;
    let about = format!(
        "map {MAP}, {} pixels per texel at every tilt; triangles, discs and bars 2.5 texels wide over a plane, light without \
         size, against the ray-traced truth. Columns are degrees between the plane's normal and the light.",
        number(results.settings.number("texel_px"), 2)
    );
    let heads = tilts(plan).iter().fold("<technique".to_owned(), |heads, tilt| format!("{heads} | {tilt}"));
    let mut sections = vec![];
    for (title, figure, scale) in TABLES {
        for (scene, light) in [("sun", "sun"), ("spot", "spot light")] {
            let line = |v: &Variant| {
                let mine = results.rows.iter().filter(|r| r.group == scene && r.label == v.label);
                let cells = mine.map(|r| number(r.number(figure).map(|v| scale * v), 3));
                [v.label.clone()].into_iter().chain(cells).collect()
            };
            sections.push(format!("## {title}: {light}\n\n{}", plain_table(&heads, plan.variants.iter().map(line))));
        }
    }
    results.head(&about) + &sections.join("\n")
}

#[cfg(test)]
mod tests {
    use super::*;
    use edgeshade::host::HostDesc;

    #[test]
    fn a_technique_without_bias_is_seen_to_have_acne() {
        let host = Host::new(&HostDesc { validation: true, ..HostDesc::default() }).unwrap();
        let plan = SUITE.plan(false, 1, Some([256, 256]), DeviceFeatures::default()).unwrap();
        let offsets = "sm:normal_offset=0 sm:normal_offset=1 sm:normal_offset=16";
        let plan = Plan { variants: available(offsets).found, ..plan };
        for (scene, lamp) in [("sun", Lamp::Sun), ("spot", Lamp::Spot)] {
            let mut run = Run::new(&SUITE, &plan);
            one_tilt(&host, &mut run, (scene, lamp), 60).unwrap();
            let [bare, usual, large] = &run.rows[..] else { panic!("a row a variant") };
            // Without bias, half of each texel's plane lies above its centre.
            assert!((0.3..0.7).contains(&bare.number("false_shadow").unwrap()), "{bare:?}");
            let of = |name| usual.number(name);
            assert_eq!(["false_shadow", "false_shadow_pixels"].map(of), [Some(0.0); 2]);
            // A large bias moves the boundary by several texels.
            let [large, usual] = [large, usual].map(|f| f.number("displacement_texels").unwrap());
            assert!(large > 3.0 * usual);
        }
        let messages = host.messages().clone();
        drop(host);
        assert_eq!(messages.all(), Vec::<String>::new());
    }

    #[test]
    fn an_image_too_small_to_show_anything_is_refused() {
        let host = Host::new(&HostDesc::default()).unwrap();
        let plan = SUITE.plan(false, 1, Some([2, 2]), DeviceFeatures::default()).unwrap();
        let problem = one_tilt(&host, &mut Run::new(&SUITE, &plan), ("sun", Lamp::Sun), 0).unwrap_err();
        assert!(problem.to_string().contains("2x2"), "{problem}");
    }
}
