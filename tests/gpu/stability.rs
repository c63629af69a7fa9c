//! A scene that is moved and scaled gives the same image.

use crate::common::{desc, differing, every_nth, every_shipped, is_full_sweep, renderer, visibility, with_gpu};
use edgeshade::scene::Scene;
use glam::{DAffine3, DVec3, dvec3};

const SIZE: [u32; 2] = [320, 180];
const FAR: DVec3 = dvec3(1e5, 1e5, -1e5);

/// Scenes for all techniques, chosen because rounding is most visible in them; other scenes run only the first
/// technique.
const CLOSER: [&str; 4] = ["courtyard", "fence", "knot", "ripples"];

type Mode = (&'static str, &'static [(&'static str, &'static str)], f32);

/// Techniques, and the largest difference of a pixel that counts as equal: none for binary results, one 8-bit code for
/// ramps.
const MODES: &[Mode] = &[
    ("sm", &[], 0.0),
    ("rbsm", &[], 0.0),
    ("rbsm-filtered", &[], 1.0 / 255.0),
    ("rbsm-star", &[], 0.0),
    ("rbsm-profile", &[("quality", "line")], 0.0),
    ("rpcf", &[("width", "7")], 1.0 / 255.0),
    ("edtsm-star", &[], 0.02),
    ("edtssm-star", &[], 0.02),
    ("pcss", &[], 0.02),
    ("rbssm", &[], 0.02),
    ("soft-auto", &[], 0.02),
    ("ssrbssm", &[], 0.02),
    ("ssabss", &[], 0.02),
    ("shadow-volumes", &[], 0.0),
    ("sssm", &[], 0.0),
    ("edsm", &[], 0.0),
    ("edsm-x", &[], 0.0),
    ("exact-hard", &[], 0.0),
    ("exact-soft", &[], 0.02),
];

#[test]
fn scaled_and_moved_scenes_give_the_same_image() {
    let cases = [
        ("1e-3, moved 1e5", 1e-3, FAR),
        ("1e3, moved 1e5", 1e3, FAR),
        ("scale 1e-3", 1e-3, DVec3::ZERO),
        ("scale 1e3", 1e3, DVec3::ZERO),
        ("moved 1e5", 1.0, FAR),
    ];
    let cases = if is_full_sweep() { &cases[..] } else { &cases[..2] };
    with_gpu(|host| {
        let mut bad = vec![];
        println!("pixels of {} that differ:", SIZE[0] * SIZE[1]);
        println!(
            "{:10} {:14}{}",
            "scene",
            "technique",
            cases.iter().map(|c| format!(" {:>16}", c.0)).collect::<String>()
        );
        for scene in every_shipped() {
            let is_close = every_nth(2, CLOSER).any(|name| name == scene.name);
            let modes = if is_close { MODES } else { &MODES[..1] };
            let images = |scene: &Scene| {
                let mut r = renderer(host, scene, desc(SIZE, 1024));
                modes.iter().map(|(id, settings, _)| visibility(&mut r, id, settings)).collect::<Vec<_>>()
            };
            let plain = images(&scene);
            let change = |&(_, scale, translation): &(&str, f64, DVec3)| {
                let mut changed = scene.clone();
                changed.transform(&DAffine3 { translation, ..DAffine3::from_scale(DVec3::splat(scale)) });
                images(&changed)
            };
            let changed: Vec<_> = cases.iter().map(change).collect();
            for (k, (id, _, tolerance)) in modes.iter().enumerate() {
                let mut line = format!("{:10} {id:14}", scene.name);
                for (case, images) in cases.iter().zip(&changed) {
                    let off = differing(&plain[k], &images[k], *tolerance);
                    line += &format!(" {:>16}", format!("{off} ({:.3} %)", 100.0 * off as f64 / plain[k].len() as f64));
                    if off * 500 > plain[k].len() {
                        bad.push(format!("{} {id} {}: {off} pixels", scene.name, case.0));
                    }
                }
                println!("{line}");
            }
        }
        assert!(bad.is_empty(), "more than 0.2 %:\n{}", bad.join("\n"));
    });
}

/// The comparison can fail: a light rotated by half a degree gives another image.
#[test]
fn a_turned_light_is_noticed() {
    with_gpu(|host| {
        let scene = crate::common::shipped_scene("jenga");
        let mut changed = scene.clone();
        let light = &mut changed.lights[0].world_from_light;
        *light = DAffine3::from_rotation_y(0.5f64.to_radians()) * *light;
        let [mut a, mut b] = [&scene, &changed].map(|s| renderer(host, s, desc(SIZE, 1024)));
        for (id, settings, tolerance) in MODES {
            let (plain, seen) = (visibility(&mut a, id, settings), visibility(&mut b, id, settings));
            assert!(differing(&plain, &seen, *tolerance) * 500 > plain.len(), "{id}");
        }
    });
}
