//! Tests of cameras and lights.

use super::builder::{File, assert_sound};
use edgeshade::scene::{LightShape, Projection};
use glam::dvec3;
use serde_json::{Value, json};
use std::f64::consts::{FRAC_PI_2, FRAC_PI_4};

fn with_camera(camera: Value) -> File {
    let mut file = File::triangle();
    let camera = file.push("cameras", camera);
    file.node(json!({ "camera": camera, "name": "eye" }));
    file
}

fn with_lights(lights: Value) -> File {
    let mut file = File::triangle();
    for light in 0..lights.as_array().unwrap().len() {
        file.node(json!({ "extensions": { "KHR_lights_punctual": { "light": light } } }));
    }
    file.json["extensions"] = json!({ "KHR_lights_punctual": { "lights": lights } });
    file.json["extensionsRequired"] = json!(["KHR_lights_punctual"]);
    file
}

#[test]
fn perspective_cameras_with_and_without_a_far_plane() {
    for far in [json!(null), json!(100)] {
        let camera = json!({ "type": "perspective", "perspective": { "yfov": 0.5, "znear": 0.125, "zfar": far } });
        let scene = with_camera(camera).load();
        assert_eq!(scene.cameras[0].name, "eye");
        assert_eq!(scene.cameras[0].projection, Projection::Perspective { fov_y: 0.5, near: 0.125 });
    }
}

#[test]
fn orthographic_cameras() {
    let projection = json!({ "xmag": 2, "ymag": 3, "znear": 0, "zfar": 10 });
    let scene = with_camera(json!({ "name": "own", "type": "orthographic", "orthographic": projection })).load();
    assert_eq!(scene.cameras[0].name, "own");
    let expected = Projection::Orthographic { half_height: 3.0, near: 0.0, far: 10.0 };
    assert_eq!(scene.cameras[0].projection, expected);
}

#[test]
fn cameras_lose_their_scale_but_keep_their_direction() {
    let mut file = with_camera(json!({ "type": "perspective", "perspective": { "yfov": 1, "znear": 1 } }));
    let half = 0.5_f64.sqrt();
    // A parent that mirrors and stretches; before that the camera looks along -x.
    file.json["nodes"][1]["rotation"] = json!([0, half, 0, half]);
    file.node(json!({ "children": [1], "scale": [-3, 5, 7], "translation": [1, 2, 3] }));
    file.json["scenes"][0]["nodes"] = json!([0, 2]);
    let scene = file.load();
    assert_sound(&scene);
    let view = scene.cameras[0].world_from_camera;
    assert_eq!(view.translation, dvec3(1.0, 2.0, 3.0));
    assert!(view.transform_vector3(dvec3(0.0, 0.0, -1.0)).abs_diff_eq(dvec3(1.0, 0.0, 0.0), 1e-12));
    assert!(view.transform_vector3(dvec3(0.0, 1.0, 0.0)).abs_diff_eq(dvec3(0.0, 1.0, 0.0), 1e-12));
}

#[test]
fn a_camera_scaled_to_nothing_is_left_out() {
    let mut file = with_camera(json!({ "type": "perspective", "perspective": { "yfov": 1, "znear": 1 } }));
    file.json["nodes"][1]["scale"] = json!([0, 0, 0]);
    let scene = file.load();
    assert!(scene.cameras.is_empty());
    assert!(scene.warnings[0].contains("leaves it no direction"), "{:?}", scene.warnings);
    // Flattened along its up axis, the camera still has a direction.
    file.json["nodes"][1]["scale"] = json!([1, 0, 1]);
    let scene = file.load();
    assert_eq!(scene.cameras.len(), 1);
    assert_sound(&scene);
}

#[test]
fn spot_and_directional_lights() {
    let mut file = with_lights(json!([
        { "type": "spot", "name": "lamp", "color": [1, 0.5, 0.25], "intensity": 40, "spot": { "outerConeAngle": 0.5 } },
        { "type": "spot", "spot": {} },
        { "type": "directional" },
    ]));
    file.json["nodes"][1]["scale"] = json!([2, 2, 2]);
    file.json["nodes"][1]["translation"] = json!([1, 2, 3]);
    let scene = file.load();
    assert_sound(&scene);
    assert_eq!(scene.lights.len(), 3);
    let lamp = &scene.lights[0];
    assert_eq!((&*lamp.name, lamp.color), ("lamp", [1.0, 0.5, 0.25]));
    assert_eq!(lamp.world_from_light.translation, dvec3(1.0, 2.0, 3.0));
    assert_eq!(lamp.shape, LightShape::Spot { outer: 0.5, size: None });
    let LightShape::Spot { outer, .. } = scene.lights[1].shape else { panic!() };
    assert!((outer - FRAC_PI_4).abs() < 1e-6);
    assert_eq!(scene.lights[2].shape, LightShape::Directional { angle: None });
}

#[test]
fn the_widest_cone_is_a_right_angle() {
    // The f32 next to pi/2 is larger than pi/2.
    let light = json!([{ "type": "spot", "spot": { "outerConeAngle": 1.5707964 } }]);
    assert_eq!(with_lights(light).load().lights[0].shape, LightShape::Spot { outer: FRAC_PI_2, size: None });
}

#[test]
fn sizes_of_lights_are_extras() {
    let own = |name: &str, value: f64| json!({ "edgeshade": { name: value } });
    let mut file = with_lights(json!([
        { "type": "spot", "spot": { "outerConeAngle": 0.5 }, "extras": own("size", 0.25) },
        { "type": "directional", "extras": own("angle", 0.01) },
        { "type": "directional", "extras": "somebody else's" },
    ]));
    let shapes = |file: &File| file.load().lights.iter().map(|l| l.shape).collect::<Vec<_>>();
    let directional = |angle| LightShape::Directional { angle };
    let spot = |size| LightShape::Spot { outer: 0.5, size };
    assert_eq!(shapes(&file), [spot(Some(0.25)), directional(Some(0.01)), directional(None)]);
    file.json["nodes"][1]["extras"] = own("size", 2.0);
    file.json["nodes"][3]["extras"] = own("angle", 0.0);
    assert_eq!(shapes(&file), [spot(Some(2.0)), directional(Some(0.01)), directional(Some(0.0))]);
}

#[test]
fn point_lights_are_named() {
    let scene = with_lights(json!([{ "type": "point", "name": "bulb" }])).load();
    assert!(scene.lights.is_empty());
    let expected =
        "lights[0] \"bulb\": point lights are not supported yet; a light fitted to the scene is used instead";
    assert_eq!(scene.warnings, [expected]);
    let scene = with_lights(json!([{ "type": "point" }, { "type": "directional" }])).load();
    assert_eq!(scene.lights.len(), 1);
    assert!(scene.warnings[0].ends_with("point lights are not supported yet; it was left out"));
}
