//! Suite `prefiltered`: techniques that filter the shadow map once, beside those that filter it anew for every pixel.

use super::driver::*;
use super::errors;
use super::judge::{mask, tracer};
use crate::cli::stats;
use crate::cli::truth::Seed;
use edgeshade::metrics::{self, Report};
use edgeshade::scene::{Moving, RenderDesc, Renderer};
use edgeshade::technique::OutputFormat;
use edgeshade::timing::FrameTiming;

pub static SUITE: Suite = Suite {
    name: "prefiltered",
    about: "error, leaks, time and memory of prefiltered shadow maps, next to filters of every pixel",
    extent: |quick| match quick {
        true => Extent { scenes: vec!["jenga"], maps: &[512, 1024], size: [320, 180] },
        false => Extent { scenes: every_scene(), maps: &[512, 1024, 2048, 4096], size: [640, 360] },
    },
    variants: |_| Ok(available(VARIANTS)),
    frames: |plan| 2 * (plan.frames + 1),
    shows_scenes: true,
    resumes: true,
    measure,
    settings: |plan| Record::of([("frames", plan.frames.into()), ("samples", samples(plan).into())]),
    summary,
    page,
    ..Suite::BASE
};

/// Variant that the times of the others are compared with.
const BASE: &str = "sm";

/// Variants to judge, if the registry has them; [`BASE`] comes first. Their penumbrae are a filter of few texels, a
/// filter of many, those of the light, and again those of the light from moments.
const VARIANTS: &str = "sm pcf:width=3 vsm evsm msm pcf:width=31 vsm:width=31 evsm:width=31 msm:width=31 edtsm-star \
                        pcss rbssm vssm mssm";

/// Figures of a row, for tables and means.
const COLUMNS: [Column; 9] = [
    ("RMSE", "rmse", 4),
    ("over", "over", 4),
    ("under", "under", 4),
    ("leak", "light_leak", 4),
    ("leaking %", "light_leak_share", 2),
    ("false shadow %", "false_shadow_share", 2),
    ("adds ms", "added_ms", 3),
    ("standing ms", "standing_ms", 3),
    ("MiB", "mib", 1),
];

/// Rays per pixel of the truth.
fn samples(plan: &Plan) -> u32 {
    if plan.quick { 64 } else { 1024 }
}

fn measure(host: &Host, run: &mut Run<'_>, scene: &'static str) -> Result<()> {
    let plan = run.plan;
    let stage = plan.stage(scene)?;
    let renderer = |map_size, moving| {
        let desc = RenderDesc { size: plan.size, map_size, output: OutputFormat::R32, moving, ..RenderDesc::default() };
        Renderer::new(host, &stage.scene, stage.camera, &stage.light, desc)
    };
    let (truth, mask) = {
        let mut renderer = renderer(plan.maps[0], Moving::Everything)?;
        let (truth, _) = tracer(&stage, renderer.light(), plan.size).truth(samples(plan), Seed::Truth)?;
        let mask = mask(host, &mut renderer, &truth)?;
        (truth.visibility, mask)
    };
    run.start(scene);
    for &map in plan.maps {
        // With the first light all that the map yields is made anew in every frame; with the second it is kept.
        let mut renderers = [renderer(map, Moving::Everything)?, renderer(map, Moving::Camera)?];
        let members: Vec<_> = plan.members(scene, map).map(|(variant, _)| variant).collect();
        let both: Vec<_> = [0, 1].into_iter().flat_map(|r| members.iter().map(move |v| (r, *v))).collect();
        let drawn = run.in_turns(&mut renderers, &both)?;
        let (moving, standing) = drawn.split_at(members.len());
        for (i, variant) in members.into_iter().enumerate() {
            let seen = renderers[0].visibility(moving[i].technique.as_ref())?;
            run.picture(scene, map, variant, [&seen, &truth], &mask)?;
            let report = metrics::compare(&seen, &truth, &mask, plan.size)?;
            let times = [added(&moving[i], &moving[0]), added(&standing[i], &standing[0])];
            run.push(row(scene, map, variant, &report, times, moving[i].technique.memory_bytes()), 0);
        }
    }
    Ok(())
}

/// Milliseconds of a technique's own passes beyond those of [`BASE`], least times over the turns.
fn added(mine: &Drawn, base: &Drawn) -> Option<f64> {
    let least = |frames: &[FrameTiming]| stats::technique(frames).map(|s| s.min);
    Some(least(&mine.frames)? - least(&base.frames)?)
}

fn row(scene: &str, map: u32, variant: &Variant, report: &Report, times: [Option<f64>; 2], memory: u64) -> Row {
    let place = [("scene", scene.into()), ("shadow_map", map.into())];
    let [added, standing] = times;
    let beside = [
        ("added_ms", added.into()),
        ("standing_ms", standing.into()),
        ("memory_bytes", memory.into()),
        ("mib", (memory as f64 / f64::from(1 << 20)).into()),
    ];
    Row::of(place, variant, &format!("{scene} {map}"), errors::figures(report).and(beside))
}

fn summary(plan: &Plan, rows: &[Row]) -> Record {
    let count = |mine: &[&Row]| Record::of([("scenes", mine.len().into())]);
    Record::of([("means", Field::Rows(means(rows, plan.keys(&Record::default()), &COLUMNS, count)))])
}

fn page(results: &Results<'_>) -> String {
    let plan = results.plan;
    let columns = [&[("map", "shadow_map", 0), ("<technique", "label", 0)], &COLUMNS[..]].concat();
    let about = format!("against ray-traced shadows of the scenes' own lights, {} rays per pixel.", samples(plan));
    let mut text = results.head(&about);
    text += &format!(
        "`RMSE`: over the judged pixels; `over`, `under`: mean error of being too dark and too light; `leak`: mean light deep in \
         the true shadow; `leaking`, `false shadow`: share of the pixels deep in the shadow and deep in the light that are \
         wrong by more than .05. `adds`: milliseconds beyond `{BASE}` while the light moves; `standing`: while it stands \
         still and all that depends on the map alone is kept; least of {} frames in turns. `MiB`: the technique's own \
         memory.\n\n",
        plan.frames
    );
    text += &left_out_note(&plan.left_out);
    text += &growth(results);
    text += &format!("\n## Mean over the scenes\n\n{}", table(&columns, results.list("means")));
    text + &tables_by_scene(&columns, &results.rows)
}

/// How each technique's figures grow from the smallest map to the largest.
fn growth(results: &Results<'_>) -> String {
    let plan = results.plan;
    let ends = [plan.maps.first(), plan.maps.last()].map(|m| m.map(|&m| f64::from(m)));
    let line = |v: &Variant| {
        let of = |map, name| {
            let mut means = results.list("means").iter().filter(|m| m.label == v.label);
            means.find(|m| m.number("shadow_map") == map)?.number(name)
        };
        let ratio = |name| number(of(ends[1], name).zip(of(ends[0], name)).map(|(a, b)| a / b), 2);
        vec![v.label.clone(), ratio("added_ms"), ratio("standing_ms"), ratio("mib"), ratio("rmse")]
    };
    let lines = plan.variants.iter().filter(|v| v.label != BASE).map(line);
    "## What a larger map costs and buys\n\nFigures with the largest map as multiples of those with the smallest, of the means over the scenes.\n\n"
        .to_owned()
        + &plain_table("<technique | adds | standing | memory | RMSE", lines)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::cli::report::Origin;

    /// A row of `sm` or `vsm` with times and errors of its own.
    fn made(scene: &str, map: u32, variant: &Variant, visibility: f32, ms: f64) -> Row {
        let truth = [1.0, 1.0, 0.0, 0.0];
        let report = metrics::compare(&[1.0, 1.0, visibility, 0.0], &truth, &[true; 4], [2, 2]).unwrap();
        row(scene, map, variant, &report, [Some(ms), Some(0.25 * ms)], u64::from(map) << 20)
    }

    #[test]
    fn means_and_growth_are_over_the_scenes() {
        let plan = SUITE.plan(false, 1, None, DeviceFeatures::default()).unwrap();
        let find = |label: &str| plan.variants.iter().find(|v| v.label == label).unwrap();
        assert_eq!(plan.variants[0].label, BASE);
        assert!(plan.left_out.is_empty(), "{:?}", plan.left_out);
        let vsm = find("vsm");
        let mut rows = vec![];
        for (scene, scale) in [("a", 1.0), ("b", 3.0)] {
            for (map, ms) in [(512, 1.0), (4096, 8.0)] {
                rows.push(made(scene, map, find(BASE), 0.5, 0.0));
                rows.push(made(scene, map, vsm, if map == 512 { 1.0 } else { 0.5 }, scale * ms));
            }
        }
        let plan = Plan { maps: &[512, 4096], ..plan };
        let text = (SUITE.page)(&SUITE.results(&plan, Origin::default(), rows));
        // Mean times 2 and 16, RMSE .5 and .25.
        assert!(text.contains("| vsm | 8.00 | 8.00 | 8.00 | 0.50 |"), "{text}");
        assert!(text.contains("| 512 | vsm | 0.5000 |") && text.contains("| 2.000 | 0.500 | 512.0 |"), "{text}");
        assert!(text.contains("| 4096 | vsm | 0.2500 |"), "{text}");
    }
}
