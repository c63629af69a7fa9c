//! Soft shadows with extreme numbers: scales and positions of the world, grazing light, blockers at the light's near
//! plane, receivers at its far plane, lights without size and as large as the scene, and kernels with the fewest and
//! the most taps.

use crate::common::enlarged;
use crate::common::{assert_in_range, desc, differing, is_full_sweep, prepare, with_gpu};
use crate::made::{self, cuboid, moved, perspective, plane, spot, still_life, sun};
use edgeshade::host::Host;
use edgeshade::scene::{Camera, Light, LightShape, Renderer, Scene, light_view};
use edgeshade::technique::Technique;
use edgeshade::view::{LightKind, LightView, look_along, look_at};
use glam::{DAffine3, DMat4, DVec3, dvec3};

const SIZE: [u32; 2] = [128, 72];
const MAP: u32 = 256;

type Set = &'static [(&'static str, &'static str)];

/// Technique with settings besides its defaults: kernels of 1, 3 and 63 taps.
struct Subject {
    id: &'static str,
    kernels: [Set; 3],
}

const SUBJECTS: [Subject; 6] = [
    Subject { id: "pcss", kernels: [TAPS[0], TAPS[1], TAPS[2]] },
    Subject { id: "rbssm", kernels: [TAPS[0], TAPS[1], TAPS[2]] },
    Subject { id: "ssrbssm", kernels: [TAPS[0], TAPS[1], TAPS[2]] },
    Subject { id: "ssabss", kernels: [TAPS[0], TAPS[1], TAPS[2]] },
    Subject { id: "edtssm", kernels: [TAPS[0], TAPS[1], TAPS[2]] },
    Subject {
        id: "edtssm-star",
        kernels: [
            &[("search_taps", "1"), ("filter_taps", "1"), ("line_taps", "0")],
            &[("search_taps", "3"), ("filter_taps", "3"), ("line_taps", "1")],
            &[("search_taps", "63"), ("filter_taps", "63"), ("line_taps", "64")],
        ],
    },
];
const TAPS: [Set; 3] = [
    &[("search_taps", "1"), ("filter_taps", "1")],
    &[("search_taps", "3"), ("filter_taps", "3")],
    &[("search_taps", "63"), ("filter_taps", "63")],
];

/// Factors of a light's size: none, almost none, unchanged, half the scene.
const SIZES: [f64; 4] = [0.0, 1e-5, 1.0, 10.0];

/// Scales and positions of the world; the first is the identity.
const WORLDS: [(&str, f64, DVec3); 4] = [
    ("", 1.0, DVec3::ZERO),
    ("scale 1e-3", 1e-3, DVec3::ZERO),
    ("scale 1e3", 1e3, DVec3::ZERO),
    ("moved 1e5", 1.0, dvec3(1e5, 1e5, -1e5)),
];
/// Largest difference of a pixel that counts as equal, and the fraction of pixels that may differ by more.
const SAME: f32 = 0.02;
const MOST_OFF: f64 = 0.005;

struct Case {
    name: &'static str,
    scene: Scene,
    light: LightView,
}

fn with_size(light: Light, size: f64) -> Light {
    let shape = match light.shape {
        LightShape::Spot { outer, .. } => LightShape::Spot { outer, size: Some(size) },
        LightShape::Directional { .. } => LightShape::Directional { angle: Some(size) },
    };
    Light { shape, ..light }
}

/// Returns a slab and a post over a ground.
fn slab(bottom: f64, camera: Camera) -> Scene {
    let parts = vec![
        (plane(8.0), DAffine3::IDENTITY),
        (cuboid(dvec3(1.5, 0.1, 0.8)), moved(dvec3(0.3, bottom + 0.1, 0.2))),
        (cuboid(dvec3(0.1, 0.8, 0.1)), moved(dvec3(-2.0, 0.8, 1.0))),
    ];
    made::scene(parts, camera, sun(DVec3::Y))
}

fn cases() -> Vec<Case> {
    let fitted = |name, light: Light| {
        let mut scene = still_life(light);
        scene.cameras = vec![perspective(dvec3(0.7, 3.5, 6.0), dvec3(0.0, 0.8, 0.0), 0.1)];
        let light = light_view(&scene, &scene.lights[0]);
        Case { name, scene, light }
    };
    let above = || perspective(dvec3(1.0, 6.0, 9.0), dvec3(0.0, 0.5, 0.0), 0.1);
    // The scene is 16 units wide, and half of that is 10 times the spot's width; the sun's 4 degrees become 40.
    let (lamp, angle) = (0.8, 0.07);
    let spot_at = |eye: DVec3, near: f64, far: f64| {
        let half_angle = 0.6;
        LightView::spot(look_at(eye, DVec3::ZERO), 2.0 * half_angle, near, far, lamp)
    };
    let down = |height: f64, far: f64| {
        let view = look_along(dvec3(0.0, height, 0.0), DVec3::NEG_Y);
        LightView::directional(view, [5.0; 2], 0.0, far, angle)
    };
    let case = |name, scene, light| Case { name, scene, light };
    vec![
        fitted("spot", with_size(spot(dvec3(3.0, 9.0, 4.0), DVec3::ZERO, 0.8), lamp)),
        fitted("sun", with_size(sun(dvec3(-1.0, 2.0, 1.0)), angle)),
        // The ground's depth changes by 30 texel widths per texel.
        fitted("grazing sun", with_size(sun(dvec3(1.0, 0.033, 0.2)), angle)),
        // The slab's upper face lies in the near plane, or in front of it.
        case("spot, blocker at the near plane", slab(7.8, above()), spot_at(dvec3(0.0, 9.0, 0.0), 1.0, 9.5)),
        case("spot, blocker before the near plane", slab(8.3, above()), spot_at(dvec3(0.0, 9.0, 0.0), 1.0, 9.5)),
        // The nearest near plane that a fitted light may have.
        case("spot, a near plane at the light", slab(3.0, above()), spot_at(dvec3(0.0, 9.0, 0.0), 9.5e-3, 9.5)),
        case("sun, blocker at the near plane", slab(3.0, above()), down(3.2, 4.0)),
        // The ground lies in the far plane, except for a margin that rounding may need.
        case("spot, receiver at the far plane", slab(3.0, above()), spot_at(dvec3(0.0, 9.0, 0.0), 2.0, 9.0 * 1.00001)),
        case("sun, receiver at the far plane", slab(3.0, above()), down(5.0, 5.0 * 1.00001)),
    ]
}

/// Returns the same light in a world that is scaled and moved.
fn in_world(light: &LightView, scale: f64, translation: DVec3) -> LightView {
    let mut moved = *light;
    moved.world_from_view.translation = scale * light.world_from_view.translation + translation;
    moved.clip_from_view = light.clip_from_view * DMat4::from_scale(DVec3::splat(1.0 / scale));
    moved.kind = match light.kind {
        LightKind::Spot { size } => LightKind::Spot { size: scale * size },
        directional => directional,
    };
    if !light.is_directional() {
        // Scales the homogeneous coordinates so that w is the distance again.
        moved.clip_from_view *= scale;
    }
    moved
}

/// Case in one of the worlds.
struct Stage<'h> {
    scene: Scene,
    light: LightView,
    renderer: Renderer<'h>,
}

impl<'h> Stage<'h> {
    fn new(host: &'h Host, case: &Case, (_, scale, translation): (&str, f64, DVec3)) -> Self {
        let mut scene = case.scene.clone();
        scene.transform(&DAffine3 { translation, ..DAffine3::from_scale(DVec3::splat(scale)) });
        let camera = scene.cameras[0].view(SIZE);
        let renderer = Renderer::new(host, &scene, camera, &scene.lights[0], desc(SIZE, MAP)).unwrap();
        Self { light: in_world(&case.light, scale, translation), scene, renderer }
    }

    fn image(&mut self, technique: &mut dyn Technique, factor: f64) -> Vec<f32> {
        self.renderer.set_light(&self.scene, enlarged(&self.light, factor));
        self.renderer.frame(technique).unwrap();
        self.renderer.visibility(technique).unwrap()
    }
}

fn share(a: &[f32], b: &[f32]) -> f64 {
    differing(a, b, SAME) as f64 / a.len() as f64
}

#[test]
fn soft_shadows_stay_in_range_and_scale_with_the_world() {
    with_gpu(|host| {
        let cases = cases();
        let worlds = if is_full_sweep() { &WORLDS[..] } else { &WORLDS[..2] };
        let stages = |case| worlds.iter().map(|world| Stage::new(host, case, *world)).collect();
        let mut stages: Vec<Vec<Stage<'_>>> = cases.iter().map(stages).collect();
        let mut bad = vec![];
        println!(
            "share of {} pixels that differ from the world as it is, most of all lights' sizes",
            SIZE[0] * SIZE[1]
        );
        for subject in &SUBJECTS {
            // The defaults run everywhere. The kernels with few and with many taps run in every third case, under the
            // largest light, at one other scale.
            let defaults: Set = &[];
            for (k, set) in std::iter::once(defaults).chain(subject.kernels).enumerate() {
                let mut technique = prepare(&stages[0][0].renderer, subject.id, set);
                let (sizes, worlds) = if k == 0 { (&SIZES[..], worlds.len()) } else { (&SIZES[3..], 2) };
                for (c, (case, stages)) in cases.iter().zip(&mut stages).enumerate() {
                    if k > 0 && (c + k) % 3 != 0 {
                        continue;
                    }
                    let mut most = [0.0; WORLDS.len()];
                    for &factor in sizes {
                        let mut images = vec![];
                        for ((world, ..), stage) in WORLDS.iter().zip(&mut *stages).take(worlds) {
                            let image = stage.image(technique.as_mut(), factor);
                            let what = format!("{} {set:?}, {} {world}, light x {factor}", subject.id, case.name);
                            if image.iter().any(|v| !(0.0..=1.0).contains(v)) {
                                bad.push(format!("{what}: out of range"));
                            }
                            // Nothing small hides a light as large as half the scene.
                            let dark = image.iter().filter(|v| **v < if factor > 1.0 { 1.0 } else { 0.5 }).count();
                            let lit = image.iter().filter(|v| **v > 0.5).count();
                            assert!(dark * 100 > image.len() && lit * 100 > image.len(), "{what}: {dark}, {lit}");
                            images.push(image);
                        }
                        for (k, image) in images.iter().enumerate().skip(1) {
                            let off = share(&images[0], image);
                            most[k] = f64::max(most[k], off);
                            if off > MOST_OFF {
                                let what = format!("{} {set:?}, {}, {}", subject.id, case.name, WORLDS[k].0);
                                bad.push(format!("{what}, light x {factor}: {:.3} %", 100.0 * off));
                            }
                        }
                    }
                    let shares = (1..worlds).map(|k| format!(" {} {:.3} %,", WORLDS[k].0, 100.0 * most[k]));
                    println!("{:12} {set:?} {:36}{}", subject.id, case.name, shares.collect::<String>());
                }
            }
        }
        assert!(bad.is_empty(), "{}", bad.join("\n"));
    });
}

/// The comparison can fail: a light of twice the size gives another image, and so does one without size.
#[test]
fn another_size_is_noticed() {
    with_gpu(|host| {
        let cases = cases();
        for subject in &SUBJECTS {
            let mut technique = None;
            for case in &cases[..2] {
                let mut stage = Stage::new(host, case, WORLDS[1]);
                let technique = technique.get_or_insert_with(|| prepare(&stage.renderer, subject.id, &[]));
                let plain = stage.image(technique.as_mut(), 1.0);
                assert_in_range(&plain, subject.id);
                for factor in [0.0, 2.0] {
                    let off = share(&plain, &stage.image(technique.as_mut(), factor));
                    println!("{} {}: light x {factor} is off in {:.2} %", subject.id, case.name, 100.0 * off);
                    assert!(off > MOST_OFF, "{} {}: light x {factor} goes unnoticed, {off}", subject.id, case.name);
                }
            }
        }
    });
}
