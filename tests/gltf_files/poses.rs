//! Tests of morph targets and skins.

use super::builder::{File, TRIANGLE, U8, U16, assert_sound, assert_world};
use serde_json::{Value, json};

fn morphed(mesh_weights: Value) -> File {
    let mut file = File::triangle();
    let up = file.vec3(&[[0.0, 0.0, 2.0]; 3]);
    let right = file.vec3(&[[4.0, 0.0, 0.0]; 3]);
    file.json["meshes"][0]["primitives"][0]["targets"] = json!([{ "POSITION": up }, { "POSITION": right }]);
    file.json["meshes"][0]["weights"] = mesh_weights;
    file
}

fn moved(x: f64, z: f64) -> Vec<[f64; 3]> {
    TRIANGLE.iter().map(|p| [f64::from(p[0]) + x, f64::from(p[1]), f64::from(p[2]) + z]).collect()
}

#[test]
fn morph_weights_come_from_the_node_then_the_mesh() {
    let mut file = morphed(json!([0.5, 0.25]));
    assert_world(&file.load(), &moved(1.0, 1.0), 1e-6);
    file.node(json!({ "mesh": 0, "weights": [1, 0] }));
    file.node(json!({ "mesh": 0, "weights": [1, 0] }));
    let scene = file.load();
    assert_world(&scene, &[moved(1.0, 1.0), moved(0.0, 2.0), moved(0.0, 2.0)].concat(), 1e-6);
    // Two poses, three instances.
    assert_eq!((scene.meshes.len(), scene.instances.len()), (2, 3));
    assert_eq!(scene.meshes[1].bounds.max.z, 2.0);
    file.json["meshes"][0].as_object_mut().unwrap().remove("weights");
    assert_world(&file.load(), &[moved(0.0, 0.0), moved(0.0, 2.0), moved(0.0, 2.0)].concat(), 1e-6);
}

#[test]
fn morphed_normals_are_unit() {
    let mut file = morphed(json!([1, 0]));
    let normals = file.vec3(&[[0.0, 0.0, 1.0]; 3]);
    let change = file.vec3(&[[1.0, 0.0, 0.0]; 3]);
    file.json["meshes"][0]["primitives"][0]["attributes"]["NORMAL"] = normals.into();
    file.json["meshes"][0]["primitives"][0]["targets"][0]["NORMAL"] = change.into();
    let s = 0.5_f32.sqrt();
    for n in &file.load().meshes[0].normals {
        assert!((n[0] - s).abs() < 1e-6 && (n[2] - s).abs() < 1e-6, "{n:?}");
    }
}

/// A triangle whose corners follow joint 0, joint 1, and both in equal parts; joint 1 is a child of joint 0.
fn skinned(joint_component: u32) -> File {
    let mut file = File::triangle();
    let ids: [u16; 12] = [0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0];
    let bytes: Vec<u8> = match joint_component {
        U8 => ids.iter().map(|&v| v as u8).collect(),
        _ => ids.iter().flat_map(|v| v.to_le_bytes()).collect(),
    };
    let joints = file.accessor(&bytes, joint_component, "VEC4", 3, false);
    // The last vertex has weights that do not add up to 1, as some exporters write them.
    let weights = file.vec4(&[[1.0, 0.0, 0.0, 0.0], [1.0, 0.0, 0.0, 0.0], [0.25, 0.25, 0.0, 0.0]]);
    let attributes = &mut file.json["meshes"][0]["primitives"][0]["attributes"];
    attributes["JOINTS_0"] = joints.into();
    attributes["WEIGHTS_0"] = weights.into();
    let normals = file.vec3(&[[0.0, 0.0, 1.0]; 3]);
    file.json["meshes"][0]["primitives"][0]["attributes"]["NORMAL"] = normals.into();
    // The bind position of joint 1 is (0, 2, 0).
    let mut bind = [[0.0_f32; 16]; 2];
    for (b, y) in bind.iter_mut().zip([0.0, -2.0]) {
        (b[0], b[5], b[10], b[15], b[13]) = (1.0, 1.0, 1.0, 1.0, y);
    }
    let binds = file.floats(&bind, "MAT4");
    file.json["nodes"][0] = json!({ "mesh": 0, "skin": 0, "translation": [500, 500, 500], "scale": [9, 9, 9] });
    file.node(json!({ "translation": [10, 0, 0], "children": [2] }));
    file.push("nodes", json!({ "translation": [0, 2, 5] }));
    file.push("skins", json!({ "joints": [1, 2], "inverseBindMatrices": binds }));
    file
}

#[test]
fn a_skin_follows_its_joints_and_not_its_node() {
    for component in [U8, U16] {
        let scene = skinned(component).load();
        // Joint 0 moves by (10, 0, 0), and joint 1 by (10, 0, 5) from its bind position.
        assert_world(&scene, &[[10.0, 0.0, 0.0], [11.0, 0.0, 5.0], [10.0, 1.0, 2.5]], 1e-6);
        assert_sound(&scene);
        assert!(scene.warnings.is_empty(), "{:?}", scene.warnings);
    }
}

#[test]
fn a_skinned_figure_far_away_keeps_its_shape() {
    let mut file = skinned(U8);
    file.json["nodes"][1]["translation"] = json!([1e7, 0, 0]);
    assert_world(&file.load(), &[[1e7, 0.0, 0.0], [1e7 + 1.0, 0.0, 5.0], [1e7, 1.0, 2.5]], 1e-6);
}

#[test]
fn normals_turn_with_the_joints() {
    let mut file = skinned(U8);
    let half = 0.5_f64.sqrt();
    // A quarter turn about x takes z to -y; the scale must not tilt it.
    file.json["nodes"][1] = json!({ "rotation": [half, 0, 0, half], "scale": [1, 1, 7], "children": [2] });
    let normal = file.load().meshes[0].normals[0];
    assert!((normal[1] + 1.0).abs() < 1e-6, "{normal:?}");
}

#[test]
fn a_mirrored_skin_keeps_its_front() {
    let mut file = skinned(U8);
    file.json["nodes"][1]["scale"] = json!([-1, 1, 1]);
    let scene = file.load();
    let c = super::builder::world(&scene);
    let normal = glam::Vec3::from(scene.meshes[0].normals[0]).as_dvec3();
    assert!((c[1] - c[0]).cross(c[2] - c[0]).dot(normal) > 0.0);
}

#[test]
fn a_skin_without_joints_on_the_mesh_is_ignored_with_a_warning() {
    let mut file = skinned(U8);
    file.json["meshes"][0]["primitives"][0]["attributes"].as_object_mut().unwrap().remove("JOINTS_0");
    let scene = file.load();
    assert!(scene.warnings[0].contains("no JOINTS_0"), "{:?}", scene.warnings);
    assert_eq!(scene.instances[0].world_from_object.translation.x, 500.0);
}
