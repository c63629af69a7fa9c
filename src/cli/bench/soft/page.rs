//! The page and the plot of suite `soft`.

use super::{Cell, Figures, Mean, ORDER, Row, SCALES};
use crate::cli::bench::judge::left_out_note;
use crate::cli::bench::plot;
use crate::cli::report::Origin;
use crate::cli::stats::Span;
use edgeshade::table::number;
use edgeshade::{Error, Result};

const FIGURES: &str = "RMSE | in the band | MAE | over | under | FLIP | GPU ms |\n";
const RULES: &str = "--:|--:|--:|--:|--:|--:|--:|\n";

/// Everything in tables.
pub fn page(figures: &Figures) -> String {
    let [w, h] = figures.size;
    let Origin { device, driver, version, .. } = &figures.origin;
    let mut text = format!(
        "# Suite `soft`\n\n{device}, {driver}; Edgeshade {version}; {w}x{h}, against ray-traced shadows of the area \
         light, {} rays a pixel.\n\n\
         `RMSE`, `MAE`: over the judged pixels; `in the band`: RMSE within 8 px of the true penumbra; `over`, `under`: \
         too dark, too light, mean over the judged pixels; `FLIP`: of the lit pictures; `GPU ms`: the technique's own \
         passes, median of {} frames, with all that is made of the shadow map anew.\n\n",
        figures.samples, figures.frames
    );
    text += &left_out_note(&figures.left_out);
    text += &lights(figures);
    text += &conclusions(&figures.cells);
    for scale in SCALES.into_iter().map(Some).chain([None]) {
        text += &format!(
            "\n## Mean over the scenes, {}\n\n| map | technique | {FIGURES}|--:|---|{RULES}",
            scale.map_or_else(|| "all sizes of the light".to_owned(), |s| format!("light x {s}"))
        );
        for m in figures.means.iter().filter(|m| m.light_scale == scale) {
            let Mean { rmse, penumbra_rmse, mae, over, under, flip, gpu_ms, .. } = *m;
            text += &format!("| {} | {} |", m.shadow_map, m.label);
            text += &values([rmse, penumbra_rmse, mae, over, under, flip], gpu_ms);
        }
    }
    let mut scene = "";
    for r in &figures.results {
        if r.scene != scene {
            scene = r.scene;
            text += &format!("\n## {scene}\n\n| light | map | technique | {FIGURES}|--:|--:|---|{RULES}");
        }
        let report = &r.report;
        let known = [report.mae, report.over, report.under, r.flip].map(Some);
        text += &format!("| x {} | {} | {} |", r.light_scale, r.shadow_map, r.label);
        text += &values([Some(report.rmse), report.penumbra_rmse, known[0], known[1], known[2], known[3]], r.gpu_ms);
    }
    text
}

fn values(errors: [Option<f64>; 6], gpu_ms: Option<f64>) -> String {
    let errors = errors.map(|v| format!(" {} |", number(v, 4))).concat();
    format!("{errors} {} |\n", number(gpu_ms, 3))
}

/// How large the lights are.
fn lights(figures: &Figures) -> String {
    let heads = SCALES.map(|s| format!(" x {s} |")).concat();
    let mut text = format!(
        "## Sizes of the lights\n\nBy the scene's own: full width of a spot's square in world units, full angle of a \
         sun in degrees.\n\n| scene | light |{heads}\n|---|---|--:|--:|--:|\n"
    );
    for rows in figures.results.chunk_by(|a, b| a.scene == b.scene) {
        let Some(Row { scene, light_unit, .. }) = rows.first() else { continue };
        let kind = if *light_unit == "degrees" { "sun" } else { "spot" };
        let of = |scale| rows.iter().find(|r| r.light_scale == scale).map(|r| r.light_size);
        let sizes = SCALES.map(|s| format!(" {} |", number(of(s), 4))).concat();
        text += &format!("| {scene} | {kind}, {light_unit} |{sizes}\n");
    }
    text
}

/// Whether the papers' order holds, and where not.
fn conclusions(cells: &[Cell]) -> String {
    let mut text = format!(
        "\n## Order by error\n\nThe papers find {} in RMSE. `rbssm below pcss`: per cent of the RMSE of `pcss`. The \
         lowest is that of all in the cell.\n\n",
        ORDER.map(|id| format!("`{id}`")).join(" < ")
    );
    let judged: Vec<_> = cells.iter().filter(|c| c.holds.is_some()).collect();
    let counted = |n: usize, of: usize| format!("{n} of {of} cells");
    if !judged.is_empty() {
        let held = judged.iter().filter(|c| c.holds == Some(true)).count();
        text += &format!("* The whole order, of those that there are: {}.\n", counted(held, judged.len()));
    }
    for pair in ORDER.windows(2) {
        let places = |c: &&Cell| {
            let place = |id| c.order.iter().position(|o| *o == id);
            Some(place(pair[0])? < place(pair[1])?)
        };
        let found: Vec<bool> = cells.iter().filter_map(|c| places(&c)).collect();
        if !found.is_empty() {
            let held = found.iter().filter(|h| **h).count();
            text += &format!("* `{}` below `{}`: {}.\n", pair[0], pair[1], counted(held, found.len()));
        }
    }
    for scale in SCALES {
        let mine = cells.iter().filter(|c| c.light_scale == scale);
        if let Some(s) = Span::of(mine.filter_map(|c| c.rbssm_below_pcss_percent)) {
            let [median, min, max] = [s.median, s.min, s.max].map(|v| number(v, 1));
            text += &format!("* Light x {scale}: `rbssm` is {median} % below `pcss` (median; {min} to {max} %).\n");
        }
    }
    text += "\n| scene | light | map | from the lowest | as the papers | rbssm below pcss % | edtssm-star | lowest | RMSE |\n\
             |---|--:|--:|---|---|--:|--:|---|--:|\n";
    for c in cells {
        text += &format!(
            "| {} | x {} | {} | {} | {} | {} | {} | {} | {} |\n",
            c.scene,
            c.light_scale,
            c.shadow_map,
            if c.order.is_empty() { "-".to_owned() } else { c.order.join(" < ") },
            c.holds.map_or("-", |h| if h { "yes" } else { "no" }),
            number(c.rbssm_below_pcss_percent, 1),
            number(c.edtssm_star, 4),
            c.lowest,
            number(c.lowest_rmse, 4)
        );
    }
    text
}

/// Mean RMSE over mean GPU time, a line a technique through the sizes of the map.
pub fn chart(figures: &Figures) -> Result<String> {
    let all = || figures.means.iter().filter(|m| m.light_scale.is_none());
    let mut lines: Vec<plot::Line> = vec![];
    for m in all() {
        if lines.iter().all(|l| l.name != m.label) {
            let mine = all().filter(|o| o.label == m.label);
            lines.push(plot::Line {
                name: m.label.clone(),
                points: mine.filter_map(|m| Some((m.gpu_ms?, m.rmse?))).collect(),
            });
        }
    }
    let maps: Vec<_> = all().map(|m| m.shadow_map).collect();
    let range = |m: Option<&u32>| number(m.map(|&m| f64::from(m)), 0);
    let (low, high) = (range(maps.iter().min()), range(maps.iter().max()));
    let title = format!("Error of soft shadows over GPU time, maps of {low} to {high}, mean over scenes and lights");
    plot::svg(&title, ["GPU ms of the technique's passes", "RMSE"], &lines)
        .map_err(|e| Error::Usage(format!("drawing the plot of suite soft: {e}")))
}
