//! Hard shadows against the truth for several sizes of the map, shared by the suites of that kind.

use super::driver::*;
use super::errors;
use super::judge::{frame, hard, is_fixed, mask, renderer, tracer};
use crate::cli::console;
use edgeshade::metrics::{self, Report};
use edgeshade::scene::Masked;
use std::collections::BTreeMap;

/// Errors of hard shadows, for tables and means.
pub const COLUMNS: [Column; 6] = [
    ("mismatch %", "mismatch", 3),
    ("per boundary px", "mismatch_per_boundary", 3),
    ("over %", "over", 3),
    ("under %", "under", 3),
    ("boundary px", "boundary_mean", 3),
    ("p95 px", "boundary_p95", 2),
];

/// Explanation of these columns.
const LEGEND: &str = "`mismatch`: share of the judged pixels on the wrong side of 0.5. `per boundary px`: mismatched pixels \
                      per pixel of the true boundary, which is the mean distance between the two boundaries, px. `over`, \
                      `under`: too dark, too light. `boundary`: signed mean distance of the boundary from the true one, \
                      positive where the shadow is too large; `p95`: its unsigned 95th percentile.";

pub const BASE: Suite = Suite { shows_scenes: true, summary, chart: Some(chart), ..Suite::BASE };

/// All scenes with the given maps. A quick run uses one small scene with the first two maps.
pub fn extent(quick: bool, maps: &'static [u32]) -> Extent {
    match quick {
        true => Extent { scenes: vec!["jenga"], maps: &maps[..2], size: [320, 180] },
        false => Extent { scenes: every_scene(), maps, size: SIZE },
    }
}

/// Judges all maps and variants in one scene, whose light is given no size.
pub fn measure(host: &Host, run: &mut Run<'_>, scene: &'static str, masked: Masked) -> Result<()> {
    let plan = run.plan;
    let mut stage = plan.stage(scene)?;
    stage.light = hard(&stage.light);
    stage.scene.set_masked(masked);
    let (truth, mask) = {
        let mut renderer = renderer(host, &stage, plan.size, plan.maps[0])?;
        let truth = tracer(&stage, renderer.light(), plan.size).hard()?;
        let mask = mask(host, &mut renderer, &truth)?;
        (truth.visibility, mask)
    };
    run.start(scene);
    for &map in plan.maps {
        let mut renderer = renderer(host, &stage, plan.size, map)?;
        for (variant, _) in plan.members(scene, map) {
            let (test, timing) = match frame(&mut renderer, &variant.choice) {
                // No buffer of this device can hold it; the other cells are still measured.
                Err(Error::Parameter(problem)) => {
                    console::note(format_args!("{scene}, map {map}, {}: {problem}", variant.label));
                    continue;
                }
                found => found?,
            };
            run.picture(scene, map, variant, [&test, &truth], &mask)?;
            let report = metrics::compare(&test, &truth, &mask, plan.size)?;
            // Values that the passes of the frame counted, by name.
            let mut counts: BTreeMap<_, u64> = BTreeMap::new();
            for &(name, n) in timing.passes.iter().flat_map(|p| &p.counts) {
                *counts.entry(name).or_default() += u64::from(n);
            }
            let map = (!variant.has_no_map).then_some(map);
            run.push(row(scene, map, variant, &report, counts), 1);
        }
    }
    Ok(())
}

pub fn row(
    scene: &str,
    map: Option<u32>,
    variant: &Variant,
    report: &Report,
    counts: BTreeMap<&'static str, u64>,
) -> Row {
    let counts = Record::default().and(counts.into_iter().map(|(name, n)| (name, n.into())));
    let counts = (!counts.0.is_empty()).then(|| ("counts", counts.into()));
    let place = [("scene", scene.into()), ("shadow_map", map.into())];
    let boundary =
        [("boundary_mean", report.boundary.map(|b| b.mean)), ("boundary_p95", report.boundary.map(|b| b.p95))];
    Row::of(place, variant, scene, errors::figures(report).and(counts)).and_shown(boundary.map(|(n, v)| (n, v.into())))
}

fn summary(plan: &Plan, rows: &[Row]) -> Record {
    let count = |mine: &[&Row]| Record::of([("scenes", mine.len().into())]);
    let means = means(rows, plan.keys(&Record::default()), &COLUMNS, count);
    Record::of([("means", Field::Rows(means))])
}

/// Tables of means over the scenes, then tables of every scene with the additional columns `more`.
pub fn page(results: &Results<'_>, about: &str, note: &str, more: &[Column]) -> String {
    let columns = [&[("<technique", "label", 0), ("map", "shadow_map", 0)], &COLUMNS[..]].concat();
    let mut text = results.head(about) + LEGEND + note + "\n\n" + &left_out_note(&results.plan.left_out);
    text += &format!("## Mean over the scenes\n\n{}", table(&columns, results.list("means")));
    text + &tables_by_scene(&[&columns, more].concat(), &results.rows)
}

/// Mean mismatch over the size of the map, one line for each variant. Variants with a fixed depth, whose mismatch is
/// ten times as large, appear only in the tables. A variant without a map is a horizontal line.
fn chart(results: &Results<'_>) -> Chart {
    let plan = results.plan;
    let line = |variant: &Variant| {
        let mine = results.list("means").iter().filter(|m| m.label == variant.label);
        let points = mine.filter_map(|m| {
            let percent = 100.0 * m.number("mismatch")?;
            let maps = plan.maps.iter().map(|&map| f64::from(map));
            let here = maps.filter(|map| m.number("shadow_map").is_none_or(|mine| mine == *map));
            Some(here.map(|map| (map, percent)).collect::<Vec<_>>())
        });
        Line { name: variant.label.clone(), points: points.flatten().collect() }
    };
    Chart {
        title: "Mismatched pixels, mean over the scenes".into(),
        axes: ["shadow map, texels a side", "mismatch, %"],
        lines: plan.variants.iter().filter(|v| !is_fixed(&v.choice)).map(line).collect(),
    }
}
