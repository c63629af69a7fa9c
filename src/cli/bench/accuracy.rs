//! Suite `accuracy`: hard shadows of every shipped scene against the truth, over the size of the map.

use super::judge::{contenders, hard, is_fixed, label, mask, mean, renderer, save, tracer, visibility};
use super::{Args, SIZE, plot};
use crate::cli::progress::Progress;
use crate::cli::report::{self, Origin};
use crate::cli::stage::Stage;
use crate::cli::techniques::Choice;
use crate::cli::{console, truth::Tracer};
use edgeshade::host::Host;
use edgeshade::metrics::{self, Report};
use edgeshade::picture::write_atomic;
use edgeshade::scene::shipped::{self, Shipped};
use edgeshade::table::number;
use edgeshade::{Error, Result};
use serde::Serialize;
use serde_json::{Map, Value};

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

/// One technique in one scene with one map.
#[derive(Serialize)]
struct Row {
    scene: &'static str,
    shadow_map: u32,
    technique: &'static str,
    params: Map<String, Value>,
    #[serde(skip)]
    label: String,
    #[serde(flatten)]
    report: Report,
}

/// Mean over the scenes that have the figure.
#[derive(Serialize)]
struct Mean {
    shadow_map: u32,
    technique: &'static str,
    params: Map<String, Value>,
    #[serde(skip)]
    label: String,
    scenes: usize,
    mismatch: Option<f64>,
    mismatch_per_boundary: Option<f64>,
    over: Option<f64>,
    under: Option<f64>,
    boundary_mean: Option<f64>,
    boundary_p95: Option<f64>,
}

pub fn run(args: &Args, host: &Host) -> Result<()> {
    let scenes: Vec<&Shipped> = shipped::ALL.iter().filter(|s| !args.quick || s.name == QUICK.0).collect();
    let maps = if args.quick { &MAPS[..2] } else { &MAPS[..] };
    let size = args.size.unwrap_or(if args.quick { QUICK.1 } else { SIZE });
    let choices = contenders()?;
    let mut results = vec![];
    for scene in scenes {
        results.extend(one_scene(host, scene, maps, size, &choices)?);
    }
    let means = maps.iter().flat_map(|&map| choices.iter().map(move |c| (map, c)));
    let means = means.map(|(map, choice)| average(&results, map, choice)).collect();
    let figures = Figures { suite: "accuracy", origin: Origin::new(host.info()), size, results, means };
    let path = save(args, host, figures.suite, &figures, &page(&figures))?.with_extension("svg");
    write_atomic(&path, chart(&figures, &choices)?.as_bytes())?;
    console::print(format_args!("wrote {}\n", super::shown(&path)))
}

fn one_scene(
    host: &Host,
    scene: &'static Shipped,
    maps: &[u32],
    size: [u32; 2],
    choices: &[Choice],
) -> Result<Vec<Row>> {
    let mut stage = Stage::shipped(scene, size)?;
    stage.light = hard(&stage.light);
    let mut rows = vec![];
    let mut truth_and_mask = None;
    let mut progress = None;
    for &map in maps {
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
        let progress = progress.get_or_insert_with(|| Progress::start(format!("suite accuracy, {}", scene.name)));
        for choice in choices {
            let test = visibility(&mut renderer, choice)?;
            rows.push(Row {
                scene: scene.name,
                shadow_map: map,
                technique: choice.info.id,
                params: report::params(choice.info, &choice.params),
                label: label(choice),
                report: metrics::compare(&test, &truth.visibility, mask, size)?,
            });
            progress.set(rows.len() as u64, (maps.len() * choices.len()) as u64);
        }
    }
    Ok(rows)
}

fn average(rows: &[Row], map: u32, choice: &Choice) -> Mean {
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

const HEADER: &str = "| technique | map | mismatch % | per boundary px | over % | under % | boundary px | p95 px |\n\
                      |---|--:|--:|--:|--:|--:|--:|--:|\n";

fn page(figures: &Figures) -> String {
    let [w, h] = figures.size;
    let Origin { device, driver, version } = &figures.origin;
    let mut text = format!(
        "# Suite `accuracy`\n\n{device}, {driver}; Edgeshade {version}; {w}x{h}, lights without size, against the \
         ray-traced truth.\n\n\
         `mismatch`: share of the judged pixels on the wrong side of one half. `per boundary px`: mismatched pixels per \
         pixel of the truth's boundary, the mean distance between the two boundaries, px. `over`, `under`: too dark, \
         too light. `boundary`: signed mean distance of the boundary from the true one, + where the shadow is too \
         large; `p95`: its unsigned 95th percentile.\n\n## Mean over the scenes\n\n{HEADER}"
    );
    for m in &figures.means {
        text += &line(
            &m.label,
            m.shadow_map,
            [m.mismatch, m.mismatch_per_boundary, m.over, m.under, m.boundary_mean, m.boundary_p95],
        );
    }
    let mut scene = "";
    for r in &figures.results {
        if r.scene != scene {
            scene = r.scene;
            text += &format!("\n## {scene}\n\n{HEADER}");
        }
        let Report { mismatch, over, under, .. } = r.report;
        text += &line(
            &r.label,
            r.shadow_map,
            [
                Some(mismatch),
                r.report.mismatch_per_boundary,
                Some(over),
                Some(under),
                r.report.boundary.map(|b| b.mean),
                r.report.boundary.map(|b| b.p95),
            ],
        );
    }
    text
}

fn line(label: &str, map: u32, [mismatch, per_px, over, under, mean, p95]: [Option<f64>; 6]) -> String {
    let percent = |v: Option<f64>| number(v.map(|v| 100.0 * v), 3);
    format!(
        "| {label} | {map} | {} | {} | {} | {} | {} | {} |\n",
        percent(mismatch),
        number(per_px, 3),
        percent(over),
        percent(under),
        number(mean, 3),
        number(p95, 2)
    )
}

/// Mean mismatch over the map's size, a line a technique. The fixed depth, ten times as far off, is left to the tables.
fn chart(figures: &Figures, choices: &[Choice]) -> Result<String> {
    let lines: Vec<_> = choices
        .iter()
        .filter(|c| !is_fixed(c))
        .map(|c| {
            let name = label(c);
            let mine = figures.means.iter().filter(|m| m.label == name);
            let points = mine.filter_map(|m| Some((f64::from(m.shadow_map), 100.0 * m.mismatch?))).collect::<Vec<_>>();
            plot::Line { name, points }
        })
        .collect();
    let title = "Mismatched pixels, mean over the scenes";
    plot::svg(title, ["shadow map, texels a side", "mismatch, %"], &lines)
        .map_err(|e| Error::Usage(format!("drawing the plot of suite accuracy: {e}")))
}
