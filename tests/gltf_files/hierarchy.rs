//! Tests of node transforms, scenes and placement.

use super::builder::{File, assert_sound, assert_world};
use edgeshade::scene::{load_bytes, load_scene};
use serde_json::json;

#[test]
fn transforms_compose_from_root_to_leaf() {
    let mut file = File::triangle();
    // Scale (2, 3, 4), then a quarter turn about z (x to y), then a translation; the child moves by (1, 0, 0) first.
    let half = 0.5_f64.sqrt();
    file.json["nodes"] = json!([
        { "children": [1], "translation": [10, 20, 30], "rotation": [0, 0, half, half], "scale": [2, 3, 4] },
        { "mesh": 0, "translation": [1, 0, 0] },
    ]);
    let scene = file.load();
    // (1,0,0) -> (2,0,0) -> (0,2,0); (2,0,0) -> (4,0,0) -> (0,4,0); (1,1,0) -> (2,3,0) -> (-3,2,0).
    assert_world(&scene, &[[10.0, 22.0, 30.0], [10.0, 24.0, 30.0], [7.0, 22.0, 30.0]], 1e-12);
    assert_sound(&scene);
}

#[test]
fn a_matrix_is_column_major_and_may_mirror() {
    let mut file = File::triangle();
    file.json["nodes"][0]["matrix"] = json!([-1, 0, 0, 0, 0, 0, 2, 0, 0, 5, 0, 0, 7, 8, 9, 1]);
    let scene = file.load();
    assert_world(&scene, &[[7.0, 8.0, 9.0], [6.0, 8.0, 9.0], [7.0, 8.0, 11.0]], 0.0);
    let scale = scene.instances[0].world_from_object.matrix3.determinant();
    assert!((scale - 10.0).abs() < 1e-12, "{scale}");
    file.json["nodes"][0] = json!({ "mesh": 0, "scale": [1, -1, 1] });
    assert!(file.load().instances[0].world_from_object.matrix3.determinant() < 0.0);
}

#[test]
fn a_place_far_from_the_origin_keeps_its_digits() {
    let mut file = File::triangle();
    // f32 would round to sixteenths here.
    file.json["nodes"][0] = json!({ "children": [1], "translation": [1e6, 1e6, -1e6] });
    file.push("nodes", json!({ "mesh": 0, "translation": [0.001, 0.002, 0.003] }));
    let base = [1_000_000.001, 1_000_000.002, -999_999.997];
    let corner = |x: f64, y: f64| [base[0] + x, base[1] + y, base[2]];
    assert_world(&file.load(), &[corner(0.0, 0.0), corner(1.0, 0.0), corner(0.0, 1.0)], 1e-9);
}

#[test]
fn a_mesh_is_stored_once() {
    let mut file = File::triangle();
    for x in 1..100 {
        file.node(json!({ "mesh": 0, "translation": [x, 0, 0] }));
    }
    let scene = file.load();
    assert_eq!((scene.meshes.len(), scene.instances.len(), scene.triangles()), (1, 100, 100));
}

#[test]
fn every_primitive_of_a_mesh_is_placed() {
    let mut file = File::triangle();
    let twice = file.json["meshes"][0]["primitives"][0].clone();
    file.json["meshes"][0]["primitives"].as_array_mut().unwrap().push(twice);
    file.json["meshes"][0]["name"] = "pair".into();
    let scene = file.load();
    assert_eq!((scene.meshes.len(), scene.instances.len()), (2, 2));
    assert_eq!([&*scene.meshes[0].name, &*scene.meshes[1].name], ["pair/0", "pair/1"]);
}

#[test]
fn scenes_are_chosen() {
    let mut file = File::triangle();
    file.json["nodes"] = json!([
        { "mesh": 0, "translation": [0, 0, 0] }, { "mesh": 0, "translation": [1, 0, 0] }, { "children": [3] },
        { "mesh": 0, "translation": [2, 0, 0] },
    ]);
    file.json["scenes"] = json!([{ "nodes": [0] }, { "nodes": [1, 2] }, {}]);
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("several.glb");
    let mut xs = |scene: Option<usize>, default: Option<usize>| -> Vec<f64> {
        file.json["scene"] = default.into();
        if default.is_none() {
            file.json.as_object_mut().unwrap().remove("scene");
        }
        std::fs::write(&path, file.glb()).unwrap();
        let scene = load_scene(&path, scene).unwrap();
        assert_eq!(scene.name, "several");
        scene.instances.iter().map(|i| i.world_from_object.translation.x).collect()
    };
    assert_eq!(xs(None, None), [0.0]);
    assert_eq!(xs(None, Some(1)), [1.0, 2.0]);
    assert_eq!(xs(Some(0), Some(1)), [0.0]);
    assert_eq!(xs(Some(2), None), [0.0; 0]);
    let error = load_scene(&path, Some(3)).unwrap_err().to_string();
    assert!(error.contains("the scene asked for: is 3, but the file has 3 scenes: 0 to 2"), "{error}");
    file.json.as_object_mut().unwrap().remove("scenes");
    assert_eq!(file.load().instances.len(), 3);
}

#[test]
fn an_empty_file_is_an_empty_scene() {
    let scene = load_bytes("nothing", &File::empty().glb()).unwrap();
    assert!(scene.instances.is_empty() && scene.meshes.is_empty() && scene.warnings.is_empty());
    assert_eq!(scene.name, "nothing");
    let scene = load_bytes("text", &File::empty().text()).unwrap();
    assert!(scene.bounds().is_empty());
}

#[test]
fn a_very_deep_chain_is_composed() {
    let mut file = File::triangle();
    let depth = 100_000;
    let link = |i: usize| json!({ "children": [i + 1], "translation": [1, 0, 0] });
    let mut nodes: Vec<_> = (0..depth).map(link).collect();
    nodes.push(json!({ "mesh": 0 }));
    file.json["nodes"] = nodes.into();
    assert_eq!(file.load().instances[0].world_from_object.translation.x, depth as f64);
}

#[test]
fn hidden_objects_are_left_out_and_flattened_ones_stay() {
    let mut file = File::triangle();
    file.json["nodes"][0]["scale"] = json!([0, 0, 0]);
    assert_eq!(file.load().instances.len(), 0);
    file.json["nodes"][0]["scale"] = json!([1, 0, 0]);
    assert_eq!(file.load().instances.len(), 0);
    file.json["nodes"][0]["scale"] = json!([1e-200, 1e-200, 0]);
    assert_eq!(file.load().instances.len(), 1);
}

#[test]
fn gpu_instances_are_placed() {
    let mut file = File::triangle();
    let translation = file.vec3(&[[1.0, 0.0, 0.0], [2.0, 0.0, 0.0]]);
    // The second normalized rotation is a half turn about z, as precise as 8 bits allow.
    let rotation = file.accessor(&[0, 0, 0, 127, 0, 0, 127, 0], super::builder::I8, "VEC4", 2, true);
    let scale = file.vec3(&[[1.0, 1.0, 1.0], [3.0, 3.0, 3.0]]);
    file.json["extensionsRequired"] = json!(["EXT_mesh_gpu_instancing"]);
    let attributes = json!({ "TRANSLATION": translation, "ROTATION": rotation, "SCALE": scale, "_ID": 0 });
    file.json["nodes"][0]["extensions"] = json!({ "EXT_mesh_gpu_instancing": { "attributes": attributes } });
    file.json["nodes"][0]["translation"] = json!([0, 10, 0]);
    let scene = file.load();
    assert_eq!((scene.meshes.len(), scene.instances.len()), (1, 2));
    let first = [[1.0, 10.0, 0.0], [2.0, 10.0, 0.0], [1.0, 11.0, 0.0]];
    let second = [[2.0, 10.0, 0.0], [-1.0, 10.0, 0.0], [2.0, 7.0, 0.0]];
    assert_world(&scene, &[first, second].concat(), 1e-6);
}
