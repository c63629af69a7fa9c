//! Suite `skip`: the time that techniques add to `sm` against the share of the picture at a shadow edge, and the time
//! of frames that keep something of the frame before.

use super::driver::*;
use super::judge::real_time;
use crate::cli::stats::{self, Span, fit};
use edgeshade::scene::{Moving, RenderDesc, Renderer, shipped};
use edgeshade::view::CameraView;
use glam::{DMat4, DVec3, dvec3};

pub static SUITE: Suite = Suite {
    name: "skip",
    about: "time that every technique adds to sm against the share of tiles at a shadow edge, and of frames that keep something",
    extent: |quick| match quick {
        true => Extent { scenes: vec![shipped::DEFAULT], maps: &[MAP], size: [320, 180] },
        false => Extent { scenes: vec![shipped::DEFAULT, "jenga", "fence"], maps: &[MAP], size: SIZE },
    },
    variants: |device| Ok(possible(available(&real_time().collect::<Vec<_>>().join(" ")), device)),
    quick_techniques: &["sm", "pcf", "vsm", "rbsm-star", "edtsm-star", "pcss", "rbssm", "exact-soft"],
    frames: |plan| (views().count() + MOVES.len()) as u32 * (plan.frames + 1),
    resumes: true,
    measure,
    settings: |plan| Record::of([("frames", plan.frames.into()), ("left_out", plan.left_out.clone().into())]),
    summary: |_, rows| Record::of([("fits", Field::Rows(fits(rows))), ("kept", Field::Rows(kept(rows)))]),
    page,
    chart: Some(chart),
    ..Suite::BASE
};

/// Side of the shadow map, texels.
const MAP: u32 = 1024;
/// The picture is divided into this many windows along each side.
const WINDOWS: i32 = 3;
/// Side of a tile, pixels.
const TILE: usize = 8;
/// Names of the things that move from frame to frame.
const MOVES: [(&str, Moving); 3] =
    [("everything", Moving::Everything), ("camera", Moving::Camera), ("nothing", Moving::Nothing)];

/// A part of a scene's picture, enlarged to the size of the picture.
#[derive(Clone, Copy)]
struct View {
    /// Column and row of the window.
    window: [i32; 2],
    /// The ground of the scene alone, which has no shadow.
    ground_alone: bool,
}

/// The ground alone, and all windows of the picture.
fn views() -> impl Iterator<Item = View> {
    let windows = (0..WINDOWS * WINDOWS).map(|i| View { window: [i % WINDOWS, i / WINDOWS], ground_alone: false });
    [View { window: [WINDOWS / 2; 2], ground_alone: true }].into_iter().chain(windows)
}

impl View {
    fn name(self) -> String {
        let [x, y] = self.window;
        if self.ground_alone { "ground alone".into() } else { format!("window {x}, {y}") }
    }

    /// The camera that sees this window of another camera's picture.
    fn camera(self, whole: &CameraView) -> CameraView {
        let n = f64::from(WINDOWS);
        let [x, y] = self.window.map(|i| f64::from(WINDOWS - 1 - 2 * i));
        let enlarged = DMat4::from_translation(dvec3(x, y, 0.0)) * DMat4::from_scale(DVec3::new(n, n, 1.0));
        CameraView { clip_from_view: enlarged * whole.clip_from_view, ..*whole }
    }
}

/// Share of the tiles that hold both lit and shadowed pixels.
fn edge_share(visibility: &[f32], [width, height]: [u32; 2]) -> f64 {
    let (width, height) = (width as usize, height as usize);
    let (columns, rows) = (width.div_ceil(TILE), height.div_ceil(TILE));
    let is_edge = |tile: usize| {
        let [x, y] = [tile % columns * TILE, tile / columns * TILE];
        let lines = (y..height.min(y + TILE)).map(|j| &visibility[j * width + x..j * width + width.min(x + TILE)]);
        let lit = |v: &f32| *v > 0.5;
        lines.clone().flatten().any(lit) && !lines.flatten().all(lit)
    };
    let edges = (0..columns * rows).filter(|&tile| is_edge(tile)).count();
    edges as f64 / (columns * rows) as f64
}

fn measure(host: &Host, run: &mut Run<'_>, scene: &'static str) -> Result<()> {
    run.start(scene);
    let plan = run.plan;
    let whole = plan.stage(scene)?;
    // Some scenes have no ground.
    let ground = Stage::ground(find_scene(scene)?, plan.size).ok();
    let desc = |moving| RenderDesc { size: plan.size, map_size: MAP, moving, ..RenderDesc::default() };
    let new = |stage: &Stage, moving| Renderer::new(host, &stage.scene, stage.camera, &stage.light, desc(moving));
    // Every window has the map of the whole picture.
    let light = *new(&whole, Moving::Everything)?.light();
    for view in views() {
        let Some(stage) = (if view.ground_alone { ground.as_ref() } else { Some(&whole) }) else { continue };
        let mut renderer =
            Renderer::new(host, &stage.scene, view.camera(&whole.camera), &stage.light, desc(Moving::Everything))?;
        renderer.set_light(&stage.scene, light);
        turns(run, renderer, [scene, &view.name(), MOVES[0].0])?;
    }
    for (name, moving) in MOVES {
        turns(run, new(&whole, moving)?, [scene, "whole", name])?;
    }
    Ok(())
}

/// Draws all variants in turns, and adds a row for each.
fn turns(run: &mut Run<'_>, renderer: Renderer<'_>, [scene, view, moving]: [&str; 3]) -> Result<()> {
    let plan = run.plan;
    let variants: Vec<_> = plan.variants.iter().map(|v| (0, v)).collect();
    let mut renderers = [renderer];
    let mut drawn = run.in_turns(&mut renderers, &variants)?;
    let renderer = &mut renderers[0];
    renderer.frame(drawn[0].technique.as_mut())?;
    let share = edge_share(&renderer.visibility(drawn[0].technique.as_ref())?, plan.size);
    for ((_, variant), mine) in variants.iter().zip(&drawn) {
        let added = mine.frames.iter().zip(&drawn[0].frames);
        let added = Span::of(added.map(|(m, base)| stats::technique_ms(m) - stats::technique_ms(base)));
        let own = stats::technique(&mine.frames);
        let place =
            [("scene", scene.into()), ("view", view.into()), ("moving", moving.into()), ("edge_share", share.into())];
        let figures = Record::of([
            ("gpu_ms", own.map(|s| s.median).into()),
            ("gpu_ms_min", own.map(|s| s.min).into()),
            ("added_ms", added.map(|s| s.median).into()),
        ]);
        run.push(Row::of(place, variant, &format!("{scene}, {view}, {moving}"), figures), 0);
    }
    Ok(())
}

/// Labels in the order of the rows.
fn labels(rows: &[Row]) -> Vec<&str> {
    let mut all: Vec<&str> = vec![];
    for row in rows {
        if !all.contains(&row.label.as_str()) {
            all.push(&row.label);
        }
    }
    all
}

/// Shares and added times of a variant over all views of all scenes.
fn points(rows: &[Row], label: &str) -> Vec<(f64, f64)> {
    let mine = rows.iter().filter(|r| r.label == label && r.text("view") != "whole");
    mine.filter_map(|r| Some((r.number("edge_share")?, r.number("added_ms")?))).collect()
}

/// The line of each variant, and the ratio of its own time to that of `sm` where nothing casts a shadow.
fn fits(rows: &[Row]) -> Vec<Row> {
    let without_edge = |label: &str| {
        let mine = rows.iter().filter(|r| r.label == label && r.text("view") == "ground alone");
        mine.filter_map(|r| r.number("gpu_ms_min")).sum::<f64>()
    };
    let base = without_edge("sm");
    let one = |label: &str| {
        let points = points(rows, label);
        let fit = fit(&points)?;
        let most = points.iter().map(|p| p.0).fold(0.0, f64::max);
        let nothing = (base > 0.0).then(|| without_edge(label) / base);
        Some(Row::new(
            label,
            "",
            Record::of([
                ("variant", label.into()),
                ("slope_ms", (0.01 * fit.slope).into()),
                ("intercept_ms", fit.intercept.into()),
                ("r2", fit.r2.into()),
                ("most_edges", most.into()),
                ("views", points.len().into()),
                ("nothing_by_sm", nothing.into()),
            ]),
        ))
    };
    labels(rows).into_iter().filter_map(one).collect()
}

/// Mean times of each variant over the scenes, by what moves.
fn kept(rows: &[Row]) -> Vec<Row> {
    let mean = |label: &str, moving: &str| {
        let mine = rows.iter().filter(|r| r.label == label && r.text("view") == "whole" && r.text("moving") == moving);
        let times: Vec<f64> = mine.filter_map(|r| r.number("gpu_ms")).collect();
        (!times.is_empty()).then(|| times.iter().sum::<f64>() / times.len() as f64)
    };
    let one = |label: &str| {
        let [everything, camera, nothing] = MOVES.map(|(moving, _)| mean(label, moving));
        Row::new(
            label,
            "",
            Record::of([
                ("variant", label.into()),
                ("everything_ms", everything.into()),
                ("camera_ms", camera.into()),
                ("nothing_ms", nothing.into()),
            ]),
        )
    };
    labels(rows).into_iter().map(one).collect()
}

fn page(results: &Results<'_>) -> String {
    const FITS: [Column; 6] = [
        ("<technique", "label", 0),
        ("ms per % of edge tiles", "slope_ms", 3),
        ("ms without edges", "intercept_ms", 2),
        ("R²", "r2", 3),
        ("most edge tiles %", "most_edges", 1),
        ("own ms by sm's, no caster", "nothing_by_sm", 2),
    ];
    const KEPT: [Column; 4] = [
        ("<technique", "label", 0),
        ("everything moves", "everything_ms", 2),
        ("camera moves", "camera_ms", 2),
        ("nothing moves", "nothing_ms", 2),
    ];
    let plan = results.plan;
    let about = format!("shadow map {MAP}, {} frames per variant and view, drawn in turns.", plan.frames);
    let mut text = results.head(&about);
    text += &format!(
        "The views are the {0} x {0} windows of each scene's picture, enlarged to the size of the picture, and the \
         ground of a scene alone, where it has one. An edge tile has {TILE} x {TILE} pixels, some lit and some in shadow in the image of `sm`. A line is \
         fitted to the milliseconds that a technique adds to `sm` (medians), over the share of edge tiles: its slope, its \
         value without edges, and the share of the variance that it explains. Scenes: {1}.\n\n",
        WINDOWS,
        plan.scenes.join(", ")
    );
    text += &left_out_note(&plan.left_out);
    text += &table(&FITS, results.list("fits"));
    text += "\n## Frames that keep something\n\nMilliseconds of a technique's own passes in the whole picture, mean over the \
             scenes. A technique keeps what it made of the map while light and casters stand still, and its picture while \
             nothing moves.\n\n";
    text += &table(&KEPT, results.list("kept"));
    text
}

/// Time over the share of edge tiles, a line for each technique.
fn chart(results: &Results<'_>) -> Chart {
    let line = |label: &str| {
        let mut points: Vec<_> = points(&results.rows, label).into_iter().map(|(x, y)| (100.0 * x, y)).collect();
        points.sort_by(|a, b| a.0.total_cmp(&b.0));
        Line { name: label.to_owned(), points }
    };
    Chart {
        title: "Time that techniques add to sm, over the share of tiles at a shadow edge".into(),
        axes: ["edge tiles, %", "added GPU ms"],
        lines: labels(&results.rows).into_iter().filter(|&label| label != "sm").map(line).collect(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::DVec4;

    #[test]
    fn edge_tiles_hold_lit_and_shadowed_pixels() {
        // Three columns and two rows of tiles, of which the last ones are cut off.
        let size = [20, 12];
        let mut image = vec![1.0; 240];
        assert_eq!(edge_share(&image, size), 0.0);
        image[19] = 0.0;
        image[11 * 20] = 0.0;
        assert_eq!(edge_share(&image, size), 2.0 / 6.0);
        image.fill(0.0);
        assert_eq!(edge_share(&image, size), 0.0);
    }

    #[test]
    fn windows_cover_the_picture() {
        let whole = CameraView::perspective(glam::DAffine3::IDENTITY, 0.8, 1.5, 0.1);
        let at = |camera: &CameraView, p: DVec4| {
            let q = camera.clip_from_view * p;
            [q.x / q.w, q.y / q.w]
        };
        let p = dvec3(0.31, -0.13, -1.0).extend(1.0);
        let [x, y] = at(&whole, p);
        let inside = views().filter(|v| !v.ground_alone).filter(|v| {
            let [a, b] = at(&v.camera(&whole), p);
            a.abs() < 1.0 && b.abs() < 1.0
        });
        let inside: Vec<_> = inside.map(|v| v.window).collect();
        let window = [x, y].map(|v| ((v + 1.0) * 1.5) as i32);
        assert_eq!(inside, [window]);
    }
}
