//! Suite `motion`: stability of shadow boundaries while light or camera move by less than a texel per frame.

use super::driver::*;
use super::judge::{hard, is_fixed, mask, renderer, tracer};
use crate::cli::techniques::Choice;
use edgeshade::metrics::{self, Motion, Shot};
use edgeshade::scene::Renderer;
use edgeshade::view::{CameraView, LightView};
use glam::{DAffine3, DMat3, DMat4, DVec2, DVec3, dvec2, dvec3};
use serde_json::json;

pub static SUITE: Suite = Suite {
    name: "motion",
    about: "change and flicker as light and camera move by sub-texels",
    // Thin bars under a sun and wooden blocks under a spot light; a texel is about as wide as a pixel.
    extent: |quick| match quick {
        true => Extent { scenes: vec!["jenga"], maps: &[MAP], size: [160, 90] },
        false => Extent { scenes: vec!["fence", "jenga"], maps: &[MAP], size: [640, 360] },
    },
    variants,
    frames: |plan| MOVEMENTS.len() as u32 * frames(plan),
    measure,
    settings: |plan| {
        Record::of([
            ("shadow_map", MAP.into()),
            ("frames", frames(plan).into()),
            ("step_texels", STEP.into()),
            ("band_px", BAND.into()),
        ])
    },
    page,
    ..Suite::BASE
};

/// Side of the shadow map in texels.
const MAP: u32 = 512;
/// Length of a step in texels per frame.
const STEP: f64 = 0.125;
/// Direction of the steps in the map in radians, chosen along neither axis nor the diagonal.
const DIRECTION: f64 = 0.5;
/// Distance in pixels up to which a pixel counts as near a boundary.
const BAND: u32 = 4;
/// Margin of a sun's map around its casters on each side in texels, which keeps them inside the map.
const MARGIN: f64 = 4.0;

/// Kind of movement.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Movement {
    /// A spot turns about its own position, so that only the map's texels move. A sun turns about the middle of its
    /// view, so that the shadow of a caster half the map's width above its receiver moves by the step.
    LightTurned,
    /// A spot moves so far that a texel at the scene's middle moves by the step. A sun moves across its own
    /// direction, so that only the map's texels move.
    LightMoved,
    /// The camera moves to the right by a step at the scene's middle.
    CameraMoved,
}

const MOVEMENTS: [(Movement, &str); 3] = [
    (Movement::LightTurned, "light-turned"),
    (Movement::LightMoved, "light-moved"),
    (Movement::CameraMoved, "camera-moved"),
];

/// Figures in the order of the JSON.
const FIGURES: [&str; 7] = ["pairs", "change", "change_truth", "change_error", "triples", "flicker", "flicker_truth"];

const COLUMNS: [Column; 4] = [
    ("<technique", "label", 0),
    ("change", "change", 3),
    ("not the truth's", "change_error", 3),
    ("flicker", "flicker", 3),
];

fn frames(plan: &Plan) -> u32 {
    if plan.quick { 4 } else { 16 }
}

/// The truth and all contenders except those with one fixed depth for all texels, whose acne would hide any motion.
fn variants(_: DeviceFeatures) -> Result<Variants> {
    let truth = Choice::new("ray-traced", &[("samples".into(), "1".into())])?;
    let mut variants = contenders()?;
    variants.found.retain(|v| !is_fixed(&v.choice));
    variants.found.insert(0, Variant::new(truth));
    Ok(variants)
}

/// Camera and light of one frame, with its truth.
struct Pose {
    camera: CameraView,
    light: LightView,
    truth: Vec<f32>,
    mask: Vec<bool>,
}

fn measure(host: &Host, run: &mut Run<'_>, scene: &'static str) -> Result<()> {
    let plan = run.plan;
    run.start(scene);
    let mut stage = plan.stage(scene)?;
    stage.light = hard(&stage.light);
    let mut renderer = renderer(host, &stage, plan.size, MAP)?;
    let start = with_margin(renderer.light());
    let mut tracer = tracer(&stage, &start, plan.size).quiet();
    for (movement, name) in MOVEMENTS {
        let mut poses = vec![];
        for i in 0..frames(plan) {
            let (camera, light) = moved(&stage, &start, movement, STEP * f64::from(i));
            tracer.look(camera, &light);
            let truth = tracer.hard()?;
            pose(&mut renderer, &stage, camera, light)?;
            let mask = mask(host, &mut renderer, &truth)?;
            poses.push(Pose { camera, light, truth: truth.visibility, mask });
        }
        for (variant, _) in plan.members(scene, MAP) {
            let motion = judge(&mut renderer, &stage, &poses, &variant.choice, plan.size)?;
            let mut json = json!(motion);
            let figures = FIGURES.map(|name| (name, json[name].take().into()));
            let group = format!("{scene}, {}", name.replace('-', " "));
            let place = [("scene", scene.into()), ("movement", name.into())];
            let percent = |v: Option<f64>| v.map(|v| 100.0 * v).into();
            let row = Row::of(place, variant, &group, Record::of(figures)).and_shown([
                ("change", percent(motion.change)),
                ("change_error", percent(motion.change_error)),
                ("flicker", percent(motion.flicker)),
            ]);
            run.push(row, frames(plan));
        }
    }
    Ok(())
}

fn pose(renderer: &mut Renderer<'_>, stage: &Stage, camera: CameraView, light: LightView) -> Result<()> {
    renderer.set_light(&stage.scene, light);
    renderer.set_camera(&stage.scene, camera)
}

fn judge(
    renderer: &mut Renderer<'_>,
    stage: &Stage,
    poses: &[Pose],
    choice: &Choice,
    size: [u32; 2],
) -> Result<Motion> {
    let mut frames = vec![];
    if !choice.is_reference() {
        let mut technique = renderer.prepare(choice.info.id, &choice.params)?;
        for p in poses {
            pose(renderer, stage, p.camera, p.light)?;
            renderer.frame(technique.as_mut())?;
            frames.push(renderer.visibility(technique.as_ref())?);
        }
    }
    let shots: Vec<Shot<'_>> = poses
        .iter()
        .enumerate()
        .map(|(i, p)| Shot { test: frames.get(i).unwrap_or(&p.truth), truth: &p.truth, mask: &p.mask })
        .collect();
    metrics::motion(&shots, size, BAND)
}

/// Widens a sun's view slightly beyond its casters; leaves a spot's view as it is.
fn with_margin(light: &LightView) -> LightView {
    let narrower = 1.0 / (1.0 + 2.0 * MARGIN / f64::from(MAP));
    let scale = if light.is_directional() { dvec3(narrower, narrower, 1.0) } else { DVec3::ONE };
    LightView { clip_from_view: DMat4::from_scale(scale) * light.clip_from_view, ..*light }
}

/// Width and height of a texel in world units: at distance 1 for a spot, everywhere for a sun. A sun's map need not
/// be square in the world.
fn texel(light: &LightView) -> DVec2 {
    let p = &light.clip_from_view;
    dvec2(p.x_axis.x, p.y_axis.y).abs().recip() * (2.0 / f64::from(MAP))
}

/// Camera and light after a movement by `texels`.
fn moved(stage: &Stage, light: &LightView, movement: Movement, texels: f64) -> (CameraView, LightView) {
    let (mut camera, mut light) = (stage.camera, *light);
    let view = light.world_from_view;
    let to_middle = view.inverse().transform_point3(stage.scene.bounds().center());
    let distance = if light.is_directional() { 1.0 } else { -to_middle.z };
    // Step across the light's axis: at distance 1 for a spot, anywhere for a sun.
    let step = (texels * texel(&light) * DVec2::from_angle(DIRECTION)).extend(0.0);
    match movement {
        Movement::LightTurned => {
            // Turns about the axis across the direction, so that points ahead move along the direction.
            let axis = step.cross(DVec3::Z).try_normalize().unwrap_or(DVec3::X);
            let turn = |slope: f64| DAffine3::from_mat3(DMat3::from_axis_angle(axis, slope.atan()));
            light.world_from_view = if light.is_directional() {
                let pivot = DAffine3::from_translation(to_middle);
                view * pivot * turn(step.length() * light.clip_from_view.x_axis.x) * pivot.inverse()
            } else {
                view * turn(step.length())
            };
        }
        Movement::LightMoved => light.world_from_view = view * DAffine3::from_translation(distance * step),
        Movement::CameraMoved => {
            let right = camera.world_from_view.matrix3.x_axis;
            camera.world_from_view.translation += distance * step.length() * right;
        }
    }
    (camera, light)
}

fn page(results: &Results<'_>) -> String {
    let frames = frames(results.plan);
    let about = format!("map {MAP}, {frames} frames, {STEP} texels per frame, lights without size.");
    let mut text = results.head(&about)
        + &format!(
            "Over the pixels within {BAND} pixels of the true boundary in either frame, in percent: `change` is the mean absolute \
             difference between consecutive frames; `not the truth's` is the mean absolute difference between a pixel's change \
             and its change in the ray-traced truth; `flicker` is the share of pixels that go lit, dark, lit or dark, lit, dark in three frames.\n"
        );
    for rows in groups(&results.rows) {
        text += &format!("\n## {}\n\n{}", rows[0].group, table(&COLUMNS, rows));
    }
    text
}

#[cfg(test)]
mod tests {
    use super::super::judge::visibility;
    use super::*;
    use edgeshade::host::HostDesc;
    use edgeshade::view::{DepthRange, look_along};

    fn staged(name: &str) -> (Stage, LightView) {
        let mut stage = Stage::shipped(find_scene(name).unwrap(), [640, 360]).unwrap();
        stage.light = hard(&stage.light);
        let light = with_margin(&edgeshade::scene::light_view(&stage.scene, &stage.light));
        (stage, light)
    }

    /// Position of a point in the map, texels.
    fn place(light: &LightView, p: DVec3) -> DVec2 {
        let clip = light.clip_from_view * light.world_from_view.inverse().transform_point3(p).extend(1.0);
        0.5 * f64::from(MAP) * clip.truncate().truncate() / clip.w
    }

    #[test]
    fn a_step_is_a_step_in_the_map() {
        for name in ["fence", "jenga"] {
            let (stage, light) = staged(name);
            let middle = stage.scene.bounds().center();
            let aside = light.world_from_view.transform_vector3(DVec3::Z) / light.clip_from_view.x_axis.x;
            for texels in [STEP, 1.0] {
                let shift = |movement, p: DVec3| {
                    let light_after = moved(&stage, &light, movement, texels).1;
                    place(&light_after, p) - place(&light, p)
                };
                // A point that stands still moves against the light; v points down in the map but up in the view.
                let [cos, sin] = DVec2::from_angle(DIRECTION).to_array();
                let expected = texels * dvec2(-cos, sin);
                let assert_near = |found: DVec2, expected: DVec2, tolerance: f64| {
                    assert!(found.distance(expected) < tolerance * texels, "{name}: {found}, expected {expected}");
                };
                assert_near(shift(Movement::LightMoved, middle), expected, 1e-6);
                if light.is_directional() {
                    assert_near(shift(Movement::LightTurned, middle), DVec2::ZERO, 1e-6);
                    let above = shift(Movement::LightTurned, middle + aside);
                    assert_near(above, expected * above.dot(expected).signum(), 1e-3);
                } else {
                    let ahead = shift(Movement::LightTurned, light.position() + light.direction());
                    assert_near(ahead, expected * ahead.dot(expected).signum(), 1e-3);
                }
            }
            let camera = moved(&stage, &light, Movement::CameraMoved, STEP);
            assert_eq!(camera.1, light);
            assert_ne!(camera.0, stage.camera);
        }
    }

    #[test]
    fn a_renderer_that_was_moved_draws_what_a_new_one_there_draws() {
        let host = Host::new(&HostDesc { validation: true, ..HostDesc::default() }).unwrap();
        let size = [160, 90];
        let (mut stage, _) = staged("jenga");
        let choice = Choice::new("sm", &[]).unwrap();
        let home = stage.camera;
        // Begins with a camera that looks up into the sky: nothing is visible, so the map stays empty.
        stage.camera.world_from_view = look_along(home.position() + 10.0 * DVec3::Y, DVec3::Y);
        let mut travelled = renderer(&host, &stage, size, MAP).unwrap();
        assert!(visibility(&mut travelled, &choice).unwrap().iter().all(|&v| v == 1.0));
        let start = *travelled.light();
        let mut seen: Vec<Vec<f32>> = vec![];
        for movement in [None, Some(Movement::CameraMoved), Some(Movement::LightMoved)] {
            stage.camera = home;
            let (camera, light) = movement.map_or((home, start), |m| moved(&stage, &start, m, 20.0));
            travelled.set_camera(&stage.scene, camera).unwrap();
            if light != start {
                travelled.set_light(&stage.scene, light);
            }
            assert_eq!((*travelled.camera(), *travelled.light()), (camera, light));
            let found = visibility(&mut travelled, &choice).unwrap();
            stage.camera = camera;
            let mut fresh = renderer(&host, &stage, size, MAP).unwrap();
            fresh.set_light(&stage.scene, light);
            assert!(found == visibility(&mut fresh, &choice).unwrap(), "{movement:?}");
            assert!(!seen.contains(&found), "{movement:?} changes nothing");
            seen.push(found);
        }
        let backwards = CameraView { depth: DepthRange::Standard, ..home };
        let problem = travelled.set_camera(&stage.scene, backwards).unwrap_err().to_string();
        assert!(problem.contains("reversed"), "{problem}");
        drop((travelled, seen));
        let messages = host.messages().clone();
        drop(host);
        assert_eq!(messages.all(), Vec::<String>::new());
    }
}
