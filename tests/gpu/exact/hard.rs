//! Hard shadows compared with brute force over all triangles, and with ray-traced truth.

use super::{SIZE, Stage, stages};
use crate::caster_edges::shadow_volumes::is_on_boundary;
use crate::common::{every_shipped, shipped_scene, with_gpu};
use crate::mirrors::compare;
use edgeshade::host::Host;
use edgeshade::reference::exact::layers;
use edgeshade::reference::ray_traced::{RayScene, hard};
use edgeshade::scene::{Instance, Scene};
use glam::{DAffine3, DVec3, dvec3};

#[test]
fn hard_shadows_equal_brute_force() {
    with_gpu(|host| {
        for mut stage in stages(host).chain(["jenga", "fence"].map(|name| Stage::shipped(host, name))) {
            let seen = stage.seen("exact-hard", &[]);
            let (shot, casters) = (stage.shot(host), stage.casters());
            let r = &stage.renderer;
            let expected = layers::visibility(&shot.data(), r.camera(), r.light(), &casters).unwrap();
            compare(&seen, &expected, 0.5).check(&stage.name, 0.03);
            // The shadows of needles are thinner than a pixel.
            if stage.name == "needles" {
                continue;
            }
            assert!(seen.contains(&0.0) && seen.contains(&1.0), "{}: no shadow or no light", stage.name);
            // With the first caster alone the picture differs, so the comparison can fail.
            let first = &casters[..1];
            let other = layers::visibility(&shot.data(), r.camera(), r.light(), first).unwrap();
            let wrong = compare(&seen, &other, 0.5).wrong;
            assert!(wrong > 0, "{}: no pixel misses the other casters", stage.name);
        }
    });
}

/// Pixels judged, those in shadow, wrong ones, and wrong ones where the truth does not change within a 64th of a pixel.
#[derive(Debug)]
struct Against {
    judged: usize,
    dark: usize,
    wrong: usize,
    elsewhere: usize,
}

fn against_truth(host: &Host, stage: &Stage<'_>, seen: &[f32]) -> Against {
    let r = &stage.renderer;
    let rays = RayScene::build(&stage.scene).unwrap();
    let truth = hard(&rays, r.camera(), r.light(), SIZE, &|_, _| ()).unwrap();
    let judged = truth.judged(&host.read_image::<u32>(&r.gbuffer().triangle).unwrap());
    let judged: Vec<usize> = (0..seen.len()).filter(|&i| judged[i]).collect();
    let wrong: Vec<usize> =
        judged.iter().copied().filter(|&i| (seen[i] > 0.5) != (truth.visibility[i] > 0.5)).collect();
    let elsewhere: Vec<_> = wrong.iter().copied().filter(|&i| !is_on_boundary(&rays, r, &truth, i)).collect();
    for i in &elsewhere {
        println!("  {}: pixel {} {} is {}", stage.name, i % SIZE[0] as usize, i / SIZE[0] as usize, seen[*i]);
    }
    Against {
        dark: judged.iter().filter(|&&i| truth.visibility[i] == 0.0).count(),
        judged: judged.len(),
        wrong: wrong.len(),
        elsewhere: elsewhere.len(),
    }
}

/// Checks that at most one pixel in ten thousand is wrong, and none except where the truth changes within the pixel.
fn check(host: &Host, stage: &mut Stage<'_>, failed: &mut Vec<String>) {
    let seen = stage.seen("exact-hard", &[]);
    let found = against_truth(host, stage, &seen);
    println!("{:32} {found:?}", stage.name);
    // The shadows of needles are thinner than a pixel.
    let dark = found.dark > 20 || stage.name == "needles";
    assert!(dark && found.judged > 400, "{}: {found:?}", stage.name);
    if found.wrong * 10_000 > found.judged.max(10_000) || found.elsewhere > 0 {
        failed.push(format!("{}: {found:?}", stage.name));
    }
}

#[test]
fn hard_shadows_equal_ray_traced_truth() {
    with_gpu(|host| {
        let mut failed = vec![];
        let shipped = every_shipped().map(|scene| Stage::new(host, &scene.name.clone(), scene));
        for mut stage in stages(host).chain(shipped) {
            check(host, &mut stage, &mut failed);
        }
        // A shadow map has wrong pixels, so the check can fail.
        let mut stage = Stage::shipped(host, "jenga");
        let seen = stage.seen("sm", &[]);
        let found = against_truth(host, &stage, &seen);
        assert!(found.wrong > 20 && found.elsewhere > 10, "{found:?}");
        assert!(failed.is_empty(), "{}", failed.join("\n"));
    });
}

/// Returns the scene with every position multiplied by `factor`, then moved.
pub fn transformed(scene: &Scene, factor: f64, by: DVec3) -> Scene {
    let scale = DAffine3::from_scale(DVec3::splat(factor));
    let place = |t: DAffine3| DAffine3 { translation: factor * t.translation + by, ..t };
    let mut all = scene.clone();
    for Instance { world_from_object, .. } in &mut all.instances {
        *world_from_object = DAffine3::from_translation(by) * scale * *world_from_object;
    }
    for camera in &mut all.cameras {
        camera.world_from_camera = place(camera.world_from_camera);
        camera.projection = super::scaled(camera.projection, factor);
    }
    for light in &mut all.lights {
        light.world_from_light = place(light.world_from_light);
    }
    all
}

/// Returns the scene with the vertices themselves in the world, moved by 1024 units, where single precision is spaced by
/// 1/8192 unit. They are rounded to that spacing before.
pub fn with_far_vertices(scene: &Scene) -> Scene {
    const SPACING: f64 = 1.0 / 8192.0;
    let by = DVec3::splat(1024.0);
    let mut all = transformed(scene, 1.0, by);
    all.meshes.clear();
    for (i, instance) in all.instances.iter_mut().enumerate() {
        let place = scene.instances[i].world_from_object;
        let mut mesh = scene.meshes[scene.instances[i].mesh].clone();
        for p in &mut mesh.positions {
            let world = place.transform_point3(DVec3::from(p.map(f64::from)));
            *p = ((world / SPACING).round() * SPACING + by).as_vec3().to_array();
        }
        for n in &mut mesh.normals {
            *n = (place.matrix3 * DVec3::from(n.map(f64::from))).normalize().as_vec3().to_array();
        }
        mesh.compute_bounds();
        all.meshes.push(mesh);
        *instance = Instance { mesh: i, world_from_object: DAffine3::IDENTITY };
    }
    all
}

#[test]
fn scale_and_place_of_a_scene_do_not_matter() {
    with_gpu(|host| {
        let mut failed = vec![];
        let still_life = |light| crate::made::still_life(light);
        let scenes = [
            ("jenga", shipped_scene("jenga")),
            ("sun", still_life(crate::made::sun(dvec3(0.7, 2.0, 0.4)))),
            ("spot", still_life(crate::made::spot(dvec3(2.0, 7.0, 3.0), DVec3::ZERO, 0.9))),
        ];
        for (name, scene) in scenes {
            for (factor, by) in [(1e-3, DVec3::ZERO), (1e3, DVec3::ZERO), (1.0, dvec3(1e5, -1e5, 1e5))] {
                let changed = transformed(&scene, factor, by);
                let mut stage = Stage::new(host, &format!("{name} times {factor}, moved {}", by.x), changed);
                check(host, &mut stage, &mut failed);
            }
            let mut stage =
                Stage::new(host, &format!("{name}, vertices far from their origin"), with_far_vertices(&scene));
            check(host, &mut stage, &mut failed);
        }
        assert!(failed.is_empty(), "{}", failed.join("\n"));
    });
}
