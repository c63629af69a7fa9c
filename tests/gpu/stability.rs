//! A scene moved and scaled gives the same image.

use crate::common::{desc, differing, every_shipped, renderer, visibility, with_gpu};
use glam::{DAffine3, DVec3, dvec3};

const SIZE: [u32; 2] = [320, 180];
const FAR: DVec3 = dvec3(1e5, 1e5, -1e5);

#[test]
fn scaled_and_moved_scenes_give_the_same_image() {
    let cases = [
        ("scale 1e-3", 1e-3, DVec3::ZERO),
        ("scale 1e3", 1e3, DVec3::ZERO),
        ("moved 1e5", 1.0, FAR),
        ("1e-3, moved 1e5", 1e-3, FAR),
        ("1e3, moved 1e5", 1e3, FAR),
    ];
    with_gpu(|host| {
        let mut bad = vec![];
        println!("pixels of {} that differ:", SIZE[0] * SIZE[1]);
        println!(
            "{:10} {:>16} {:>16} {:>16} {:>16} {:>16}",
            "scene", cases[0].0, cases[1].0, cases[2].0, cases[3].0, cases[4].0
        );
        for scene in every_shipped() {
            let plain = visibility(&mut renderer(host, &scene, desc(SIZE, 1024)), "sm", &[]);
            let mut line = format!("{:10}", scene.name);
            for (name, scale, translation) in cases {
                let mut changed = scene.clone();
                changed.transform(&DAffine3 { translation, ..DAffine3::from_scale(DVec3::splat(scale)) });
                let seen = visibility(&mut renderer(host, &changed, desc(SIZE, 1024)), "sm", &[]);
                let off = differing(&plain, &seen, 0.0);
                line += &format!(" {:>16}", format!("{off} ({:.3} %)", 100.0 * off as f64 / plain.len() as f64));
                if off * 500 > plain.len() {
                    bad.push(format!("{} {name}: {off} pixels", scene.name));
                }
            }
            println!("{line}");
        }
        assert!(bad.is_empty(), "more than 0.2 %:\n{}", bad.join("\n"));
    });
}

/// The comparison is worth something only if it can fail: a light turned by half a degree is another image.
#[test]
fn a_turned_light_is_noticed() {
    with_gpu(|host| {
        let scene = crate::common::shipped_scene("jenga");
        let plain = visibility(&mut renderer(host, &scene, desc(SIZE, 1024)), "sm", &[]);
        let mut changed = scene;
        let light = &mut changed.lights[0].world_from_light;
        *light = DAffine3::from_rotation_y(0.5f64.to_radians()) * *light;
        let seen = visibility(&mut renderer(host, &changed, desc(SIZE, 1024)), "sm", &[]);
        assert!(differing(&plain, &seen, 0.0) * 500 > plain.len());
    });
}
