//! Tests of the fitted camera and light.

use super::builder::assert_sound;
use edgeshade::scene::{Bounds, Instance, LightShape, Mesh, Scene, fit};
use glam::{DAffine3, DVec3, dvec3};

/// A scene whose bounds are the given box.
fn boxed(min: DVec3, max: DVec3) -> Scene {
    let mesh = Mesh { bounds: Bounds { min: DVec3::ZERO, max: max - min }, ..Mesh::default() };
    let instance = Instance { mesh: 0, world_from_object: DAffine3::from_translation(min) };
    Scene { meshes: vec![mesh], instances: vec![instance], ..Scene::default() }
}

#[track_caller]
fn check(scene: &Scene) {
    let light = fit::light(scene);
    let bounds = if scene.bounds().is_empty() { Bounds { min: DVec3::ZERO, max: DVec3::ZERO } } else { scene.bounds() };
    for size in [[256, 256], [1280, 720], [300, 800], [1, 7]] {
        let camera = fit::camera(scene, size);
        assert_sound(&Scene { cameras: vec![camera.clone()], lights: vec![light.clone()], ..Scene::default() });
        let view = camera.view(size);
        let mut inside = false;
        for corner in bounds.corners() {
            let clip = view.clip_from_view * view.world_from_view.inverse().transform_point3(corner).extend(1.0);
            let ndc = clip.truncate() / clip.w;
            // In front of the near plane and inside the picture.
            assert!(clip.w > 0.0 && ndc.x.abs() < 1.0 && ndc.y.abs() < 1.0 && ndc.z > 0.0 && ndc.z < 1.0, "{ndc}");
            inside |= ndc.truncate().abs().max_element() > 0.5;
        }
        // The scene is not a mere dot in the middle of the picture.
        assert!(inside || bounds.radius() == 0.0);
    }
    let LightShape::Directional { angle: None } = light.shape else { panic!("{light:?}") };
    for corner in bounds.corners() {
        assert!(light.world_from_light.inverse().transform_point3(corner).z < 0.0, "{light:?}");
    }
    let direction = light.world_from_light.matrix3.z_axis;
    assert!(direction.y > 0.5, "the sun shines from above: {direction}");
}

#[test]
fn boxes_of_every_size_and_place() {
    for scale in [1e-6, 1e-3, 1.0, 1e6] {
        for offset in [DVec3::ZERO, dvec3(1e6, -1e6, 1e6), dvec3(0.0, 0.0, -3.0)] {
            for shape in [
                dvec3(1.0, 1.0, 1.0),
                dvec3(1.0, 0.0, 1.0),
                dvec3(0.0, 1.0, 1.0),
                dvec3(1.0, 1.0, 0.0),
                dvec3(100.0, 1.0, 1.0),
                dvec3(1.0, 100.0, 1.0),
                dvec3(1.0, 1.0, 100.0),
                dvec3(0.0, 1.0, 0.0),
            ] {
                check(&boxed(offset, offset + shape * scale));
            }
        }
    }
}

#[test]
fn empty_scenes_and_points() {
    check(&Scene::default());
    for at in [DVec3::ZERO, dvec3(3.0, 2.0, 1.0), dvec3(1e6, 0.0, 0.0), dvec3(0.0, 1e18, 0.0)] {
        check(&boxed(at, at));
    }
}

#[test]
fn the_whole_is_scaled_with_the_scene() {
    let (one, million) = (boxed(DVec3::ZERO, DVec3::ONE), boxed(DVec3::ZERO, DVec3::splat(1e6)));
    let (a, b) = (fit::camera(&one, [1; 2]), fit::camera(&million, [1; 2]));
    let (a, b) = (a.world_from_camera.translation, b.world_from_camera.translation);
    assert!((a * 1e6).abs_diff_eq(b, 1e-6), "{a} {b}");
}

#[test]
fn the_ground_lies_under_the_scene() {
    let mut scene = boxed(dvec3(3.0, -2.0, 5.0), dvec3(4.0, 1.0, 6.0));
    let before = scene.bounds();
    fit::add_ground(&mut scene);
    let ground = scene.instance_bounds(&scene.instances[1]);
    assert_eq!((ground.min.y, ground.max.y), (before.min.y, before.min.y));
    assert!(ground.min.x < before.min.x - 50.0 && ground.max.z > before.max.z + 50.0);
    let mesh = &scene.meshes[1];
    for t in mesh.indices.chunks_exact(3) {
        let [a, b, c] = [t[0], t[1], t[2]].map(|i| glam::Vec3::from(mesh.positions[i as usize]));
        assert!((b - a).cross(c - a).y > 0.0, "wound to face up");
    }
    let mut empty = Scene::default();
    fit::add_ground(&mut empty);
    assert!(empty.instances.is_empty());
}
