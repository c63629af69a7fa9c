//! Suite `accuracy`: hard shadows of every shipped scene against the truth, over the size of the map.

use super::judge::{contenders, frame, hard, is_fixed, label, mask, mean, renderer, save, tracer};
use super::{Args, SIZE, plot};
use crate::cli::progress::Progress;
use crate::cli::report::{self, Origin};
use crate::cli::stage::Stage;
use crate::cli::techniques::Choice;
use crate::cli::{console, truth::Tracer};
use edgeshade::host::Host;
use edgeshade::metrics::{self, Report};
use edgeshade::picture::write_atomic;
use edgeshade::scene::Masked;
use edgeshade::scene::shipped::{self, Shipped};
use edgeshade::table::number;
use edgeshade::{Error, Result};
use serde::Serialize;
use serde_json::{Map, Value};
use std::collections::BTreeMap;

/// Sides of the shadow maps, texels.
const MAPS: [u32; 4] = [512, 1024, 2048, 4096];
/// The one scene and the size of the image of a quick run.
const QUICK: (&str, [u32; 2]) = ("jenga", [320, 180]);

/// What the suite writes.
#[derive(Serialize)]
struct Figures {
    suite: &'static str,
    #[serde(flatten)]
    origin: Origin,
    size: [u32; 2],
    results: Vec<Row>,
    /// Over the scenes.
    means: Vec<Mean>,
}

/// What is judged in a scene.
pub struct Plan<'a> {
    pub suite: &'static str,
    pub masked: Masked,
    pub maps: &'a [u32],
    pub size: [u32; 2],
    pub choices: &'a [Choice],
    /// Whether the result does not depend on the shadow map: then it is judged once a scene.
    pub has_no_map: fn(&Choice) -> bool,
}

/// One technique in one scene with one map.
#[derive(Serialize)]
pub struct Row {
    pub scene: &'static str,
    /// Null where the result does not depend on a map.
    pub shadow_map: Option<u32>,
    pub technique: &'static str,
    pub params: Map<String, Value>,
    #[serde(skip)]
    pub label: String,
    #[serde(flatten)]
    pub report: Report,
    /// What the passes of the frame counted, by name.
    #[serde(skip_serializing_if = "BTreeMap::is_empty")]
    pub counts: BTreeMap<&'static str, u64>,
}

/// Mean over the scenes that have the figure.
#[derive(Serialize)]
pub struct Mean {
    pub shadow_map: Option<u32>,
    pub technique: &'static str,
    pub params: Map<String, Value>,
    #[serde(skip)]
    pub label: String,
    pub scenes: usize,
    pub mismatch: Option<f64>,
    pub mismatch_per_boundary: Option<f64>,
    pub over: Option<f64>,
    pub under: Option<f64>,
    pub boundary_mean: Option<f64>,
    pub boundary_p95: Option<f64>,
}

/// Pixels of all frames, for the estimate of the time.
pub fn pixels(args: &Args) -> Result<u64> {
    let (scenes, maps) = if args.quick { (1, 2) } else { (shipped::ALL.len(), MAPS.len()) };
    let size = args.size.unwrap_or(if args.quick { QUICK.1 } else { SIZE });
    Ok(super::pixels(size, scenes * maps * contenders()?.len(), 1))
}

pub fn run(args: &Args, host: &Host) -> Result<()> {
    let scenes: Vec<&Shipped> = shipped::ALL.iter().filter(|s| !args.quick || s.name == QUICK.0).collect();
    let maps = if args.quick { &MAPS[..2] } else { &MAPS[..] };
    let size = args.size.unwrap_or(if args.quick { QUICK.1 } else { SIZE });
    let choices = contenders()?;
    let has_no_map = |_: &Choice| false;
    let plan = Plan { suite: "accuracy", masked: Masked::Keep, maps, size, choices: &choices, has_no_map };
    let mut results = vec![];
    for scene in scenes {
        results.extend(one_scene(host, scene, &plan)?);
    }
    let means = means(&results, &plan);
    let figures = Figures { suite: "accuracy", origin: Origin::new(host), size, results, means };
    let path = save(args, host, figures.suite, &figures, &page(&figures))?.with_extension("svg");
    write_atomic(&path, chart(&figures.means, &plan)?.as_bytes())?;
    args.say(format_args!("wrote {}", super::shown(&path)))
}

/// All maps and techniques in one scene, under its light without size.
pub fn one_scene(host: &Host, scene: &'static Shipped, plan: &Plan<'_>) -> Result<Vec<Row>> {
    let Plan { size, choices, .. } = *plan;
    let mut stage = Stage::shipped(scene, size)?;
    stage.light = hard(&stage.light);
    stage.scene.set_masked(plan.masked);
    let mut rows = vec![];
    let mut truth_and_mask = None;
    let mut progress = None;
    let total = cells(plan).count() as u64;
    for &map in plan.maps {
        let mut renderer = renderer(host, &stage, size, map)?;
        let (truth, mask) = match &truth_and_mask {
            Some(known) => known,
            None => {
                let light = *renderer.light();
                let mut tracer: Tracer<'_> = tracer(&stage, &light, size);
                let truth = tracer.hard()?;
                let mask = mask(host, &mut renderer, &truth)?;
                truth_and_mask.insert((truth, mask))
            }
        };
        let progress = progress.get_or_insert_with(|| Progress::start(format!("suite {}, {}", plan.suite, scene.name)));
        let once = |c: &&Choice| !(plan.has_no_map)(c) || Some(&map) == plan.maps.first();
        for choice in choices.iter().filter(once) {
            let (test, timing) = match frame(&mut renderer, choice) {
                // What no buffer of this device holds: the other cells are wanted all the same.
                Err(Error::Parameter(problem)) => {
                    console::note(format_args!("{}, map {map}, {}: {problem}", scene.name, label(choice)));
                    continue;
                }
                found => found?,
            };
            let mut counts = BTreeMap::new();
            for &(name, n) in timing.passes.iter().flat_map(|p| &p.counts) {
                *counts.entry(name).or_default() += u64::from(n);
            }
            rows.push(Row {
                scene: scene.name,
                shadow_map: (!(plan.has_no_map)(choice)).then_some(map),
                technique: choice.info.id,
                params: report::params(choice.info, &choice.params),
                label: label(choice),
                report: metrics::compare(&test, &truth.visibility, mask, size)?,
                counts,
            });
            progress.set(rows.len() as u64, total);
        }
    }
    Ok(rows)
}

/// Every map with every technique that depends on it, and first those that depend on none.
fn cells<'a>(plan: &'a Plan<'_>) -> impl Iterator<Item = (Option<u32>, &'a Choice)> {
    let has_map = |c: &&Choice| !(plan.has_no_map)(c);
    let without = plan.choices.iter().filter(move |c| !has_map(c)).map(|c| (None, c));
    without
        .chain(plan.maps.iter().flat_map(move |&map| plan.choices.iter().filter(has_map).map(move |c| (Some(map), c))))
}

/// Over the scenes.
pub fn means(rows: &[Row], plan: &Plan<'_>) -> Vec<Mean> {
    cells(plan).map(|(map, choice)| average(rows, map, choice)).collect()
}

fn average(rows: &[Row], map: Option<u32>, choice: &Choice) -> Mean {
    let label = label(choice);
    let rows: Vec<&Report> =
        rows.iter().filter(|r| r.shadow_map == map && r.label == label).map(|r| &r.report).collect();
    let of = |f: fn(&Report) -> Option<f64>| mean(rows.iter().map(|r| f(r)));
    Mean {
        shadow_map: map,
        technique: choice.info.id,
        params: report::params(choice.info, &choice.params),
        label,
        scenes: rows.len(),
        mismatch: of(|r| Some(r.mismatch)),
        mismatch_per_boundary: of(|r| r.mismatch_per_boundary),
        over: of(|r| Some(r.over)),
        under: of(|r| Some(r.under)),
        boundary_mean: of(|r| r.boundary.map(|b| b.mean)),
        boundary_p95: of(|r| r.boundary.map(|b| b.p95)),
    }
}

/// Of [`mean_line`].
pub const HEADER: &str = "| technique | map | mismatch % | per boundary px | over % | under % | boundary px | p95 px |\n\
                          |---|--:|--:|--:|--:|--:|--:|--:|\n";
/// What the columns of [`HEADER`] are.
pub const LEGEND: &str = "`mismatch`: share of the judged pixels on the wrong side of one half. `per boundary px`: mismatched \
                          pixels per pixel of the truth's boundary, the mean distance between the two boundaries, px. \
                          `over`, `under`: too dark, too light. `boundary`: signed mean distance of the boundary from the \
                          true one, + where the shadow is too large; `p95`: its unsigned 95th percentile.";

fn page(figures: &Figures) -> String {
    let [w, h] = figures.size;
    let Origin { device, driver, version, .. } = &figures.origin;
    let mut text = format!(
        "# Suite `accuracy`\n\n{device}, {driver}; Edgeshade {version}; {w}x{h}, lights without size, against the \
         ray-traced truth.\n\n\
         {LEGEND}\n\n## Mean over the scenes\n\n{HEADER}"
    );
    for m in &figures.means {
        text += &mean_line(m);
    }
    let mut scene = "";
    for r in &figures.results {
        if r.scene != scene {
            scene = r.scene;
            text += &format!("\n## {scene}\n\n{HEADER}");
        }
        text += &row_line(r, &[]);
    }
    text
}

/// A line of the table under [`HEADER`].
pub fn mean_line(m: &Mean) -> String {
    let figures = [m.mismatch, m.mismatch_per_boundary, m.over, m.under, m.boundary_mean, m.boundary_p95];
    line(&m.label, m.shadow_map, figures, &[])
}

/// The same of one scene, with `more` columns.
pub fn row_line(r: &Row, more: &[String]) -> String {
    let Report { mismatch, over, under, mismatch_per_boundary, boundary, .. } = r.report;
    let [mean, p95] = [boundary.map(|b| b.mean), boundary.map(|b| b.p95)];
    line(&r.label, r.shadow_map, [Some(mismatch), mismatch_per_boundary, Some(over), Some(under), mean, p95], more)
}

fn line(
    label: &str,
    map: Option<u32>,
    [mismatch, per_px, over, under, mean, p95]: [Option<f64>; 6],
    more: &[String],
) -> String {
    let percent = |v: Option<f64>| number(v.map(|v| 100.0 * v), 3);
    let more: String = more.iter().map(|cell| format!(" {cell} |")).collect();
    format!(
        "| {label} | {} | {} | {} | {} | {} | {} | {} |{more}\n",
        number(map.map(f64::from), 0),
        percent(mismatch),
        number(per_px, 3),
        percent(over),
        percent(under),
        number(mean, 3),
        number(p95, 2)
    )
}

/// Mean mismatch over the map's size, a line a technique. The fixed depth, ten times as far off, is left to the tables.
/// What depends on no map is a level line.
pub fn chart(means: &[Mean], plan: &Plan<'_>) -> Result<String> {
    let lines: Vec<_> = (plan.choices.iter().filter(|c| !is_fixed(c)))
        .map(|c| {
            let name = label(c);
            let mine =
                means.iter().filter(|m| m.label == name).filter_map(|m| Some((m.shadow_map, 100.0 * m.mismatch?)));
            let points = mine.flat_map(|(map, percent)| {
                let maps = map.map_or_else(|| plan.maps.to_vec(), |map| vec![map]);
                maps.into_iter().map(move |map| (f64::from(map), percent))
            });
            let points = points.collect();
            plot::Line { name, points }
        })
        .collect();
    let title = "Mismatched pixels, mean over the scenes";
    plot::svg(title, ["shadow map, texels a side", "mismatch, %"], &lines)
        .map_err(|e| Error::Usage(format!("drawing the plot of suite {}: {e}", plan.suite)))
}
