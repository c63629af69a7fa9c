//! Hard shadows against the truth over the size of the map: what the suites of that kind share.

use super::driver::*;
use super::judge::{frame, hard, is_fixed, mask, renderer, tracer};
use crate::cli::console;
use edgeshade::metrics::{self, Report};
use edgeshade::scene::Masked;
use std::collections::BTreeMap;

/// Of one variant in one scene with one map.
#[derive(Serialize)]
pub struct Hard {
    #[serde(flatten)]
    pub report: Report,
    /// What the passes of the frame counted, by name.
    #[serde(skip_serializing_if = "BTreeMap::is_empty")]
    pub counts: BTreeMap<&'static str, u64>,
}

impl Hard {
    pub fn count(&self, name: &str) -> Option<f64> {
        self.counts.get(name).map(|&n| n as f64)
    }
}

/// What means are made of.
pub const COLUMNS: [Column<Hard>; 6] = [
    Column::new("mismatch", "mismatch %", 3, |h| Some(h.report.mismatch)),
    Column::new("mismatch_per_boundary", "per boundary px", 3, |h| h.report.mismatch_per_boundary),
    Column::new("over", "over %", 3, |h| Some(h.report.over)),
    Column::new("under", "under %", 3, |h| Some(h.report.under)),
    Column::new("boundary_mean", "boundary px", 3, |h| Some(h.report.boundary?.mean)),
    Column::new("boundary_p95", "p95 px", 2, |h| Some(h.report.boundary?.p95)),
];

/// What the columns are.
const LEGEND: &str = "`mismatch`: share of the judged pixels on the wrong side of one half. `per boundary px`: mismatched \
                      pixels per pixel of the truth's boundary, the mean distance between the two boundaries, px. `over`, \
                      `under`: too dark, too light. `boundary`: signed mean distance of the boundary from the true one, + \
                      where the shadow is too large; `p95`: its unsigned 95th percentile.";

pub const BASE: Suite<Hard> = Suite { shows_scenes: true, summary, chart: Some(chart), ..Suite::BASE };

/// The given maps; of a quick run the first two, in one small scene.
pub fn extent(quick: bool, maps: &'static [u32]) -> Extent {
    match quick {
        true => Extent { scenes: vec!["jenga"], maps: &maps[..2], size: [320, 180] },
        false => Extent { scenes: every_scene(), maps, size: SIZE },
    }
}

/// All maps and variants in one scene, under its light without size.
pub fn measure(host: &Host, run: &mut Run<'_, Hard>, scene: &'static str, masked: Masked) -> Result<()> {
    let plan = run.plan;
    let mut stage = plan.stage(scene)?;
    stage.light = hard(&stage.light);
    stage.scene.set_masked(masked);
    let mut truth_and_mask = None;
    for &map in plan.maps {
        let mut renderer = renderer(host, &stage, plan.size, map)?;
        let (truth, mask) = match &truth_and_mask {
            Some(known) => known,
            None => {
                let truth = tracer(&stage, renderer.light(), plan.size).hard()?;
                let mask = mask(host, &mut renderer, &truth)?;
                run.start(scene);
                truth_and_mask.insert((truth, mask))
            }
        };
        for (variant, group) in plan.members(scene, map) {
            let (test, timing) = match frame(&mut renderer, &variant.choice) {
                // What no buffer of this device holds: the other cells are wanted all the same.
                Err(Error::Parameter(problem)) => {
                    console::note(format_args!("{scene}, map {map}, {}: {problem}", variant.label));
                    continue;
                }
                found => found?,
            };
            let report = metrics::compare(&test, &truth.visibility, mask, plan.size)?;
            let mut counts = BTreeMap::new();
            for &(name, n) in timing.passes.iter().flat_map(|p| &p.counts) {
                *counts.entry(name).or_default() += u64::from(n);
            }
            let map = (!variant.has_no_map).then_some(map);
            let place = [("scene", scene.into()), ("shadow_map", map.into())];
            run.push(Row::new(place, variant, &group, Hard { report, counts }));
            run.drawn(1);
        }
    }
    Ok(())
}

fn summary(plan: &Plan, rows: &[Row<Hard>]) -> Summary {
    let key = |(map, variant): (Option<u32>, &Variant)| {
        let mut place = Record::of([("shadow_map", map.into())]);
        place.0.extend(variant.fields());
        (variant.label.clone(), place)
    };
    let count = |mine: &[&Row<Hard>]| Record::of([("scenes", mine.len().into())]);
    Fields(vec![("means", means(rows, plan.cells().map(key), &COLUMNS, count))])
}

/// Means over the scenes, then every scene with all `columns`.
pub fn page(results: &Results<'_, Hard>, about: &str, note: &str, columns: &[Column<Hard>]) -> String {
    let lead = "<technique | map";
    let mut text = results.head(about) + LEGEND + note + "\n\n" + &left_out_note(&results.plan.left_out);
    text += "## Mean over the scenes\n\n";
    text += &table_of((lead, label_and_map), (&COLUMNS, Column::of_mean), results.list("means"));
    for (scene, rows) in by_scene(&results.rows) {
        text += &format!("\n## {scene}\n\n");
        text += &table_of((lead, label_and_map), (columns, Column::of_row), rows);
    }
    text
}

fn label_and_map<F>(row: &Row<F>) -> [String; 2] {
    [row.label.clone(), row.place.text("shadow_map")]
}

/// Mean mismatch over the map's size, a line a variant. The fixed depth, ten times as far off, is left to the tables.
/// What depends on no map is a level line.
fn chart(results: &Results<'_, Hard>) -> Chart {
    let plan = results.plan;
    let line = |variant: &Variant| {
        let mine = results.list("means").iter().filter(|m| m.label == variant.label);
        let points = mine.filter_map(|m| {
            let percent = 100.0 * m.figures.number("mismatch")?;
            let maps = plan.maps.iter().map(|&map| f64::from(map));
            let here = maps.filter(|map| m.place.number("shadow_map").is_none_or(|mine| mine == *map));
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
