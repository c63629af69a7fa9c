//! The page and the plot of suite `penumbra`.

use super::{Figures, GROUPS, Row, SUBJECT};
use crate::cli::bench::plot;
use crate::cli::report::Origin;
use edgeshade::table::number;
use edgeshade::{Error, Result};

const FIGURES: &str = "RMSE | in the band | MAE | over | under |\n";

/// Everything in tables.
pub fn page(figures: &Figures) -> String {
    let [w, h] = figures.size;
    let Origin { device, driver, version, .. } = &figures.origin;
    let mut text = format!(
        "# Suite `penumbra`\n\n{device}, {driver}; Edgeshade {version}; {w}x{h}, against ray-traced penumbrae of a \
         fixed width.\n\n\
         All of a group are meant to be equally wide: 15 or 7 texels of the map at hand. Kernels are that wide in \
         texels; the truth and the techniques that know widths in the world are given P, world units: so many times \
         the width of a texel on what the camera sees, which is the square root of the area that a texel covers on \
         the surface, the median over the judged pixels. Where a texel is larger or smaller than there, kernels are \
         wider or narrower than the truth, and that is an error of theirs.\n\n\
         `RMSE`, `MAE`: over the judged pixels; `in the band`: RMSE within 8 px of the true penumbra; `over`, `under`: \
         too dark, too light, mean over the judged pixels.\n\n"
    );
    text += &beaten(figures);
    text += &format!(
        "\n## Mean over the scenes\n\n| texels | map | variant | lowest in | {FIGURES}|--:|--:|---|--:|--:|--:|--:|--:|--:|\n"
    );
    for group in &GROUPS {
        for m in figures.means.iter().filter(|m| m.texels == group.texels) {
            text += &format!("| {} | {} | {} | {} of {} |", m.texels, m.shadow_map, m.variant, m.lowest, m.scenes);
            text += &cells([m.rmse, m.penumbra_rmse, m.mae, m.over, m.under]);
        }
    }
    let mut scene = "";
    for Row { scene: name, shadow_map, texels, penumbra, variant, report, .. } in &figures.results {
        if *name != scene {
            scene = name;
            text += &format!(
                "\n## {scene}\n\n| map | texels | P | variant | {FIGURES}|--:|--:|--:|---|--:|--:|--:|--:|--:|\n"
            );
        }
        text += &format!("| {shadow_map} | {texels} | {penumbra} | {variant} |");
        let mean = [report.mae, report.over, report.under].map(Some);
        text += &cells([Some(report.rmse), report.penumbra_rmse, mean[0], mean[1], mean[2]]);
    }
    text
}

fn cells(values: [Option<f64>; 5]) -> String {
    values.map(|v| format!(" {} |", number(v, 4))).concat() + "\n"
}

/// Says where the subject is not the lowest.
fn beaten(figures: &Figures) -> String {
    let count = figures.beaten.len();
    let total = figures.results.iter().filter(|r| r.variant == SUBJECT).count();
    let list = figures.beaten.iter().map(|b| {
        let (mine, other) = (number(b.rmse, 4), number(b.by_rmse, 4));
        format!("{} {}, {} texels ({mine}; {} {other})", b.scene, b.shadow_map, b.texels, b.by)
    });
    let list: Vec<_> = list.collect();
    match count {
        0 => format!("`{SUBJECT}` has the lowest RMSE of its group in all {total} cells.\n"),
        _ => format!("`{SUBJECT}` is not the lowest of its group in {count} of {total} cells: {}.\n", list.join(", ")),
    }
}

/// Mean RMSE over the map's size, a line a variant and group.
pub fn chart(figures: &Figures) -> Result<String> {
    let groups = GROUPS.iter().flat_map(|g| g.contenders.iter().map(move |c| (g.texels, c.name)));
    let line = |(texels, variant)| {
        let mine = figures.means.iter().filter(|m| m.texels == texels && m.variant == variant);
        let points = mine.filter_map(|m| Some((f64::from(m.shadow_map), m.rmse?))).collect();
        plot::Line { name: format!("{texels} texels: {variant}"), points }
    };
    let lines: Vec<_> = groups.map(line).collect();
    let title = "Error against penumbrae of the same width, mean over the scenes";
    plot::svg(title, ["shadow map, texels a side", "RMSE"], &lines)
        .map_err(|e| Error::Usage(format!("drawing the plot of suite penumbra: {e}")))
}
