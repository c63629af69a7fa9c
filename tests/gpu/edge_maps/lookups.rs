//! The lookups against their mirrors, with the maps as the GPU has them.

use super::{maps, receiver_settings};
use crate::common::{Shot, desc, renderer, shipped_scene, visibility, with_gpu};
use crate::made::{spot, still_life};
use crate::mirrors::compare;
use edgeshade::pass::edsm::{BorderKernel, DistanceConfig, EdgeDistances};
use edgeshade::reference::{edsm, sssm};
use edgeshade::scene::Scene;
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
                let m = maps(host, &scene, &r, true);
                let mirror = sssm::visibility(&shot.data(), &receiver_settings("sssm"), &m.points).unwrap();
                compare(&seen[0], &mirror, 0.5).check(&format!("sssm {} {map}", scene.name), 0.02);
                let settings = receiver_settings("edsm");
                let hard = |distances: &[f32]| {
                    edsm::visibility(&shot.data(), &settings, distances, 0.0, BorderKernel::Disc).unwrap()
                };
                compare(&seen[1], &hard(&m.distances[0]), 0.5).check(&format!("edsm {} {map}", scene.name), 0.02);
                // Without the maps these are other images.
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
        for (word, kernel) in
            [("box", BorderKernel::Box), ("smoothstep", BorderKernel::Smoothstep), ("disc", BorderKernel::Disc)]
        {
            for width in [1.0f32, 6.0] {
                let mut r = renderer(host, &scene, desc(SIZE, 256));
                let seen = visibility(&mut r, "edsm", &[("border", &width.to_string()), ("kernel", word)]);
                let shot = Shot::of(host, &r, true);
                let distances = wide(host, &scene, &r, width);
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

/// The distances that a border of that width needs.
fn wide(host: &edgeshade::host::Host, scene: &Scene, r: &edgeshade::scene::Renderer<'_>, border: f32) -> Vec<f32> {
    let gpu = edgeshade::scene::GpuScene::new(host, scene).unwrap();
    let placed = edgeshade::scene::SceneCasters::new(host.context(), scene, &gpu).unwrap();
    let config = DistanceConfig { cosine: false, kill: true, half_width: 0.5 * border + 1.5 };
    let size = r.shadow_map().extent();
    let mut map = EdgeDistances::new(host.context(), "test", &placed.casters, size, config).unwrap();
    let inputs = edgeshade::Inputs {
        camera: r.camera(),
        depth: r.gbuffer().depth.as_ref(),
        normal: None,
        shadow_map: r.shadow_map().as_ref(),
        light: std::slice::from_ref(r.light()),
        light_version: None,
        casters: &placed.transforms,
    };
    host.run(|cmd| {
        // SAFETY: `cmd` is recording and is waited for.
        let mut frame = unsafe { edgeshade::Frame::begin(host.context(), cmd, edgeshade::Handoff::default(), None) };
        map.record(&mut frame, &inputs)?;
        frame.end();
        Ok(())
    })
    .unwrap();
    host.read_values(map.distances()).unwrap()
}
