//! Lookups compared with their mirrors, given the GPU's own maps.

use super::{KERNELS, config, distances, maps, receiver_settings};
use crate::common::{Shot, desc, renderer, shipped_scene, visibility, with_gpu};
use crate::made::{spot, still_life};
use crate::mirrors::compare;
use edgeshade::reference::caster_edges::{edsm, sssm};
use edgeshade::scene::Scene;
use edgeshade::technique::caster_edges::edsm::{BorderKernel, DistanceConfig};
use glam::{DVec3, dvec3};

const SIZE: [u32; 2] = [256, 144];

fn scenes() -> Vec<Scene> {
    let mut all: Vec<_> = ["fence", "jenga", "drum", "courtyard"].map(shipped_scene).into();
    all.push(still_life(spot(dvec3(2.0, 7.0, 3.0), DVec3::ZERO, 0.9)));
    all
}

#[test]
fn hard_lookups_equal_their_mirrors() {
    with_gpu(|host| {
        for scene in scenes() {
            for map in [512, 99] {
                let mut r = renderer(host, &scene, desc(SIZE, map));
                let seen = ["sssm", "edsm"].map(|id| visibility(&mut r, id, &[]));
                let shot = Shot::of(host, &r, true);
                let m = maps(host, &r, true);
                let mirror = sssm::visibility(&shot.data(), &receiver_settings("sssm"), &m.points).unwrap();
                compare(&seen[0], &mirror, 0.5).check(&format!("sssm {} {map}", scene.name), 0.02);
                let settings = receiver_settings("edsm");
                let hard = |distances: &[f32]| {
                    edsm::visibility(&shot.data(), &settings, distances, 0.0, BorderKernel::Disc).unwrap()
                };
                compare(&seen[1], &hard(&m.distances[0]), 0.5).check(&format!("edsm {} {map}", scene.name), 0.02);
                // Without the maps the images differ.
                let turned: Vec<f32> = m.distances[0].iter().map(|d| -d).collect();
                assert!(compare(&seen[1], &hard(&turned), 0.5).wrong > 10, "{}", scene.name);
                let none = vec![sssm::MIDDLE; m.points.len()];
                let other = sssm::visibility(&shot.data(), &receiver_settings("sssm"), &none).unwrap();
                assert!(compare(&seen[0], &other, 0.5).wrong > 10, "{}", scene.name);
            }
        }
    });
}

#[test]
fn soft_borders_equal_their_mirror() {
    with_gpu(|host| {
        let scene = shipped_scene("jenga");
        for (word, kernel) in KERNELS {
            for width in [1.0f32, 6.0] {
                let mut r = renderer(host, &scene, desc(SIZE, 256));
                let seen = visibility(&mut r, "edsm", &[("border", &width.to_string()), ("kernel", word)]);
                let shot = Shot::of(host, &r, true);
                // Map width that a border of this width needs.
                let wide = DistanceConfig { half_width: 0.5 * width + 1.5, ..config(false, true) };
                let distances = distances(host, &r, wide);
                let mirror =
                    edsm::visibility(&shot.data(), &receiver_settings("edsm"), &distances, width.into(), kernel)
                        .unwrap();
                let what = format!("edsm border {width} {word}");
                compare(&seen, &mirror, 0.01).check(&what, 0.1);
                let between = seen.iter().filter(|v| (0.05..0.95).contains(*v)).count();
                assert!(between > 300, "{what}: {between} pixels in the border");
            }
        }
    });
}
