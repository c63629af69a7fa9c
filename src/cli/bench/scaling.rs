//! Suite `scaling`: how the time of every technique grows with the shadow map, the picture and the casters.

use super::driver::*;
use super::judge::real_time;
use super::meshes::{ball, ground};
use crate::cli::stats::{self, Span, fit};
use edgeshade::scene::{
    Camera, Instance, Light, LightShape, Material, Projection, RenderDesc, Renderer, Scene, shipped,
};
use edgeshade::view::look_at;
use glam::{DAffine3, DVec3, dvec3};

pub static SUITE: Suite = Suite {
    name: "scaling",
    about: "time of every technique over the size of map and picture, and over the number of triangles",
    extent: |quick| {
        let size = if quick { [320, 180] } else { SIZE };
        Extent { scenes: AXES.to_vec(), maps: &[MAP], size }
    },
    variants: |device| Ok(possible(available(&real_time().collect::<Vec<_>>().join(" ")), device)),
    quick_techniques: &["sm", "pcf", "vsm", "rbsm-star", "edtsm-star", "pcss", "edsm-x", "exact-hard"],
    frames: |plan| 2 * (plan.frames + 1) * sizes(plan.quick, plan.size, AXES[0]).len() as u32,
    measure,
    settings: |plan| Record::of([("frames", plan.frames.into()), ("left_out", plan.left_out.clone().into())]),
    summary: |_, rows| Record::of([("growth", Field::Rows(growth(rows)))]),
    page,
    ..Suite::BASE
};

/// Quantities that vary, one at a time.
const AXES: [&str; 3] = ["shadow map", "picture", "triangles"];
/// Side of the map where the map does not vary, texels.
const MAP: u32 = 1024;
/// Balls that the triangles are divided among.
const BALLS: u32 = 25;

/// A picture to draw along an axis.
#[derive(Clone, Copy)]
struct Place {
    /// Texels along a side of the map, pixels, or triangles.
    amount: f64,
    size: [u32; 2],
    map: u32,
    /// Triangles of the casters; `None` takes the default scene.
    triangles: Option<u32>,
}

/// The pictures along an axis, from the smallest on.
fn sizes(quick: bool, size: [u32; 2], axis: &str) -> Vec<Place> {
    let base = Place { amount: 0.0, size, map: MAP, triangles: None };
    match axis {
        "shadow map" => {
            let maps: &[u32] = if quick { &[512, 1024] } else { &[256, 512, 1024, 2048, 4096, 8192] };
            maps.iter().map(|&map| Place { amount: map.into(), map, ..base }).collect()
        }
        "picture" => {
            let all: &[[u32; 2]] =
                if quick { &[[160, 90], [320, 180]] } else { &[[854, 480], [1280, 720], [1920, 1080], [3840, 2160]] };
            all.iter().map(|&size| Place { amount: f64::from(size[0] * size[1]), size, ..base }).collect()
        }
        _ => {
            let all: &[u32] = if quick { &[1000, 10_000] } else { &[1000, 10_000, 100_000, 1_000_000] };
            all.iter().map(|&n| Place { amount: n.into(), triangles: Some(n), ..base }).collect()
        }
    }
}

/// Balls over a ground under a spot light, with about as many triangles.
fn balls(triangles: u32) -> Scene {
    // A ball of n rings and 2n sectors has 4 n (n - 1) triangles.
    let rings = (0.5 + (0.25 + f64::from(triangles) / f64::from(4 * BALLS)).sqrt()).round().max(2.0) as u32;
    let mut scene = Scene {
        name: format!("{triangles} triangles"),
        materials: vec![Material::default()],
        meshes: vec![ground(7.0), ball(rings, 2 * rings)],
        cameras: vec![Camera {
            name: "camera".into(),
            world_from_camera: look_at(dvec3(1.0, 7.0, 10.0), dvec3(0.0, 0.5, 0.0)),
            projection: Projection::Perspective { fov_y: 0.8, near: 0.1 },
        }],
        lights: vec![Light {
            name: "lamp".into(),
            world_from_light: look_at(dvec3(3.0, 9.0, 2.5), DVec3::ZERO),
            shape: LightShape::Spot { outer: 0.6, size: Some(0.8) },
            color: [1.0; 3],
        }],
        ..Scene::default()
    };
    scene.instances.push(Instance { mesh: 0, world_from_object: DAffine3::IDENTITY });
    for i in 0..BALLS {
        let at = dvec3(f64::from(i % 5) - 2.0, 0.0, f64::from(i / 5) - 2.0) * 2.1 + dvec3(0.0, 1.0, 0.0);
        let scale = DVec3::splat(0.7);
        let world_from_object = DAffine3::from_translation(at) * DAffine3::from_scale(scale);
        scene.instances.push(Instance { mesh: 1, world_from_object });
    }
    scene
}

fn measure(host: &Host, run: &mut Run<'_>, axis: &'static str) -> Result<()> {
    run.start(axis);
    let plan = run.plan;
    let Some((base, _)) = plan.variants.split_first() else { return Ok(()) };
    for place in sizes(plan.quick, plan.size, axis) {
        let Place { size, map, .. } = place;
        let stage = match place.triangles {
            Some(n) => {
                let scene = balls(n);
                Stage { camera: scene.cameras[0].view(size), light: scene.lights[0].clone(), scene }
            }
            None => Stage::shipped(find_scene(shipped::DEFAULT)?, size)?,
        };
        let desc = RenderDesc { size, map_size: map, ..RenderDesc::default() };
        let mut renderers = match Renderer::new(host, &stage.scene, stage.camera, &stage.light, desc) {
            Ok(renderer) => [renderer],
            Err(e) => {
                run.push(problem_row(axis, place, base, &limit(e)?), 0);
                continue;
            }
        };
        for variant in &plan.variants {
            // Two techniques at a time: all of them together may need more memory than there is.
            let row = match run.in_turns(&mut renderers, &[(0, base), (0, variant)]) {
                Ok(drawn) => timed_row(axis, place, variant, &drawn),
                Err(e) => problem_row(axis, place, variant, &limit(e)?),
            };
            run.push(row, 0);
        }
    }
    Ok(())
}

/// Text of an error that says that something does not fit this device; other errors stay errors.
fn limit(error: Error) -> Result<String> {
    match error {
        Error::Usage(_) | Error::Parameter(_) | Error::Allocation { .. } => Ok(error.to_string()),
        error => Err(error),
    }
}

/// A row without figures; `amount` is that of the place.
fn new_row(axis: &str, place: Place, variant: &Variant, figures: Record) -> Row {
    let Place { amount, size, map, .. } = place;
    let at = [
        ("axis", axis.into()),
        ("amount", amount.into()),
        ("width", size[0].into()),
        ("height", size[1].into()),
        ("shadow_map", map.into()),
    ];
    Row::of(at, variant, &format!("{axis}, {amount}"), figures)
}

fn problem_row(axis: &str, place: Place, variant: &Variant, problem: &str) -> Row {
    new_row(axis, place, variant, Record::of([("problem", problem.into())]))
}

fn timed_row(axis: &str, place: Place, variant: &Variant, drawn: &[Drawn]) -> Row {
    let [base, mine] = [&drawn[0].frames, &drawn[1].frames];
    let added = Span::of(mine.iter().zip(base).map(|(m, b)| stats::technique_ms(m) - stats::technique_ms(b)));
    let own = stats::technique(mine);
    let figures = [
        ("gpu_ms", own.map(|s| s.median).into()),
        ("gpu_ms_min", own.map(|s| s.min).into()),
        ("added_ms", added.map(|s| s.median).into()),
        ("memory_bytes", drawn[1].memory_bytes.into()),
    ];
    new_row(axis, place, variant, Record::of(figures))
}

/// Exponent of the power of the amount that the time grows with: the slope of a line through their logarithms, by least
/// squares. `None` for fewer than two places.
fn exponent(points: &[(f64, f64)]) -> Option<f64> {
    let logs = points.iter().filter(|p| p.0 > 0.0 && p.1 > 0.0).map(|p| (p.0.ln(), p.1.ln()));
    fit(&logs.collect::<Vec<_>>()).map(|line| line.slope)
}

/// Exponent of every variant along every axis.
fn growth(rows: &[Row]) -> Vec<Row> {
    let mut keys: Vec<(&str, &str)> = vec![];
    for row in rows {
        let key = (row.text("axis"), row.label.as_str());
        if !keys.contains(&key) {
            keys.push(key);
        }
    }
    let one = |(axis, label): (&str, &str)| {
        let mine = rows.iter().filter(|r| r.text("axis") == axis && r.label == label);
        let points: Vec<_> = mine.filter_map(|r| Some((r.number("amount")?, r.number("gpu_ms_min")?))).collect();
        let fields = [("axis", axis.into()), ("variant", label.into()), ("exponent", exponent(&points).into())];
        Row::new(label, axis, Record::of(fields))
    };
    keys.into_iter().map(one).collect()
}

fn page(results: &Results<'_>) -> String {
    let plan = results.plan;
    let about =
        format!("map {MAP}, {} frames per variant, drawn in turns with `sm`; one of the three varies.", plan.frames);
    let mut text = results.head(&about);
    text += &format!(
        "Milliseconds of a technique's own passes, least over the frames; everything moves, so nothing is kept. `exponent`: \
         the power of the map's side, of the number of pixels or of triangles that the time grows with, by a line through \
         the logarithms; 0 is no growth, 1 in proportion. Map and picture vary in the scene {}; the triangles are those of \
         {BALLS} balls over a ground.\n\n",
        shipped::DEFAULT
    );
    text += &left_out_note(&plan.left_out);
    for axis in AXES {
        let places = sizes(plan.quick, plan.size, axis);
        let heads: Vec<_> = places.iter().map(|p| head(axis, *p)).collect();
        let lines = results.list("growth").iter().filter(|g| g.text("axis") == axis).map(|g| {
            let time = |p: &Place| {
                let at =
                    |r: &&Row| r.label == g.label && r.text("axis") == axis && r.number("amount") == Some(p.amount);
                number(results.rows.iter().find(at).and_then(|r| r.number("gpu_ms_min")), 2)
            };
            let mut line = vec![g.label.clone()];
            line.extend(places.iter().map(time));
            line.push(number(g.number("exponent"), 2));
            line
        });
        let heads = format!("<technique | {} | exponent", heads.join(" | "));
        text += &format!("## {axis}\n\n{}\n", plain_table(&heads, lines));
    }
    let problems = results.rows.iter().filter(|r| !r.text("problem").is_empty());
    let lines: Vec<_> = problems
        .map(|r| {
            format!("* {}, {} {}: {}\n", r.label, r.text("axis"), number(r.number("amount"), 0), r.text("problem"))
        })
        .collect();
    if lines.is_empty() { text } else { text + "## Not measured\n\n" + &lines.concat() }
}

/// Head of the column of a place.
fn head(axis: &str, place: Place) -> String {
    match axis {
        "picture" => format!("{}x{}", place.size[0], place.size[1]),
        _ => number(Some(place.amount), 0),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn exponents_are_those_of_powers() {
        let power = |e: f64| [1.0_f64, 2.0, 8.0].map(|x| (x, 3.0 * x.powf(e)));
        for e in [-1.0, 0.0, 0.5, 2.0] {
            assert!((exponent(&power(e)).unwrap() - e).abs() < 1e-12);
        }
        assert_eq!(exponent(&[(1.0, 2.0)]), None);
    }

    #[test]
    fn casters_have_about_as_many_triangles_as_they_should() {
        for place in sizes(false, SIZE, "triangles") {
            let made = balls(place.triangles.unwrap()).triangles() as f64;
            assert!((0.7..1.3).contains(&(made / place.amount)), "{}: {made}", place.amount);
        }
    }
}
