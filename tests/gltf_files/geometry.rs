//! Tests of accessors, topology and normals.

use super::builder::{F32, File, I8, I16, TRIANGLE, U8, U16, U32, assert_sound, assert_world};
use serde_json::json;

const SQUARE: [[f32; 3]; 4] = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [1.0, 1.0, 0.0]];
const NORMALS: [[f32; 3]; 4] = [[0.0, 0.0, 1.0]; 4];

/// A square with normals, so that vertices stay shared, drawn with the given mode.
fn square(mode: u32, indices: Option<&[u16]>) -> File {
    let mut file = File::empty();
    let (positions, normals) = (file.vec3(&SQUARE), file.vec3(&NORMALS));
    let mut primitive = json!({ "attributes": { "POSITION": positions, "NORMAL": normals }, "mode": mode });
    if let Some(indices) = indices {
        primitive["indices"] = file.indices(indices).into();
    }
    file.mesh(primitive);
    file.node(json!({ "mesh": 0 }));
    file
}

#[test]
fn strips_fans_and_lists() {
    let indices = |mode, indices| square(mode, indices).load().meshes[0].indices.clone();
    assert_eq!(indices(4, Some(&[0, 1, 2, 2, 1, 3][..])), [0, 1, 2, 2, 1, 3]);
    // Without indices, and with one corner too many.
    assert_eq!(indices(4, None), [0, 1, 2]);
    // The second triangle of a strip is reversed, so that both face the same way.
    assert_eq!(indices(5, None), [0, 1, 2, 1, 3, 2]);
    // Joined strips: repeated corners draw nothing.
    assert_eq!(indices(5, Some(&[0, 1, 2, 2, 1, 1, 2, 3])), [0, 1, 2, 1, 3, 2]);
    assert_eq!(indices(6, Some(&[0, 1, 3, 2])), [1, 3, 0, 3, 2, 0]);
    assert_eq!(square(4, None).load().warnings.len(), 1);
}

#[test]
fn strip_and_fan_triangles_face_the_same_way() {
    for (mode, corners) in [(5, [0, 1, 2, 3]), (6, [0, 1, 3, 2])] {
        let scene = square(mode, Some(&corners)).load();
        for t in super::builder::world(&scene).as_chunks::<3>().0 {
            assert!((t[1] - t[0]).cross(t[2] - t[0]).z > 0.0, "mode {mode}: {t:?}");
        }
    }
}

#[test]
fn points_and_lines_are_left_out_with_a_warning() {
    for mode in 0..4 {
        let scene = square(mode, None).load();
        assert!(scene.meshes.is_empty() && scene.instances.is_empty());
        assert_eq!(scene.warnings, ["meshes[0].primitives[0]: points and lines are not drawn"]);
    }
}

#[test]
fn indices_of_every_width() {
    for (component, bytes) in
        [(U8, vec![2, 1, 0]), (U16, vec![2, 0, 1, 0, 0, 0]), (U32, vec![2, 0, 0, 0, 1, 0, 0, 0, 0, 0, 0, 0])]
    {
        let mut file = square(4, None);
        let indices = file.accessor(&bytes, component, "SCALAR", 3, false);
        file.json["meshes"][0]["primitives"][0]["indices"] = indices.into();
        assert_eq!(file.load().meshes[0].indices, [2, 1, 0]);
    }
}

#[test]
fn quantized_positions() {
    for (component, normalized, bytes, unit) in [
        (I8, false, vec![0, 0, 0, 0, 100, 0, 0, 0, 0, 156, 0, 0], 100.0),
        (U8, false, vec![0, 0, 0, 0, 200, 0, 0, 0, 0, 200, 0, 0], 200.0),
        (I8, true, vec![0, 0, 0, 0, 127, 0, 0, 0, 0, 128, 0, 0], 1.0),
        (U8, true, vec![0, 0, 0, 0, 255, 0, 0, 0, 0, 255, 0, 0], 1.0),
    ] {
        let mut file = File::triangle();
        // Elements of 3 bytes are padded to a stride of 4.
        let positions = file.accessor(&bytes, component, "VEC3", 3, normalized);
        let view = file.json["accessors"][positions]["bufferView"].as_u64().unwrap() as usize;
        file.json["bufferViews"][view]["byteStride"] = 4.into();
        file.json["meshes"][0]["primitives"][0]["attributes"]["POSITION"] = positions.into();
        file.json["extensionsRequired"] = json!(["KHR_mesh_quantization"]);
        let y = if component == I8 { -unit } else { unit };
        assert_world(&file.load(), &[[0.0; 3], [unit, 0.0, 0.0], [0.0, y, 0.0]], 0.0);
    }
    let mut file = File::triangle();
    let values: [i16; 9] = [0, 0, 0, 32_767, 0, 0, 0, -32_768, 0];
    let bytes: Vec<u8> = values.iter().flat_map(|v| v.to_le_bytes()).collect();
    let positions = file.accessor(&bytes, I16, "VEC3", 3, true);
    file.json["meshes"][0]["primitives"][0]["attributes"]["POSITION"] = positions.into();
    assert_world(&file.load(), &[[0.0; 3], [1.0, 0.0, 0.0], [0.0, -1.0, 0.0]], 0.0);
}

#[test]
fn interleaved_attributes() {
    let mut file = File::empty();
    let mut bytes = vec![0xff; 8];
    for position in TRIANGLE {
        for value in position.into_iter().chain([0.0, 0.0, -1.0]) {
            bytes.extend_from_slice(&f32::to_le_bytes(value));
        }
    }
    let view = file.view(&bytes);
    file.json["bufferViews"][view]["byteStride"] = 24.into();
    let accessor =
        |offset| json!({ "bufferView": view, "byteOffset": offset, "componentType": F32, "type": "VEC3", "count": 3 });
    let (positions, normals) = (file.push("accessors", accessor(8)), file.push("accessors", accessor(20)));
    file.mesh(json!({ "attributes": { "POSITION": positions, "NORMAL": normals } }));
    file.node(json!({ "mesh": 0 }));
    let scene = file.load();
    assert_world(&scene, &TRIANGLE.map(|p| p.map(f64::from)), 0.0);
    assert_eq!(scene.meshes[0].normals, [[0.0, 0.0, -1.0]; 3]);
}

#[test]
fn sparse_accessors_with_and_without_a_base() {
    for base in [true, false] {
        let mut file = File::triangle();
        let positions = file.vec3(&TRIANGLE);
        let indices = file.view(&[1, 2]);
        let values: Vec<u8> = [4.0_f32, 0.0, 0.0, 0.0, 5.0, 0.0].iter().flat_map(|v| v.to_le_bytes()).collect();
        let values = file.view(&values);
        file.json["accessors"][positions]["sparse"] = json!({
            "count": 2, "indices": { "bufferView": indices, "componentType": U8 }, "values": { "bufferView": values },
        });
        if !base {
            file.json["accessors"][positions].as_object_mut().unwrap().remove("bufferView");
        }
        file.json["meshes"][0]["primitives"][0]["attributes"]["POSITION"] = positions.into();
        assert_world(&file.load(), &[[0.0; 3], [4.0, 0.0, 0.0], [0.0, 5.0, 0.0]], 0.0);
    }
}

#[test]
fn without_normals_every_triangle_is_flat() {
    let mut file = File::empty();
    // A roof: two triangles share the edge from (0,0,0) to (0,0,2); a third one has no area.
    let positions = file.vec3(&[[0.0, 0.0, 0.0], [0.0, 0.0, 2.0], [1.0, -1.0, 0.0], [-1.0, -1.0, 0.0]]);
    let colors = file.vec3(&[[0.1, 0.0, 0.0], [0.2, 0.0, 0.0], [0.3, 0.0, 0.0], [0.4, 0.0, 0.0]]);
    let indices = file.indices(&[0, 1, 2, 1, 0, 3, 0, 0, 1]);
    file.mesh(json!({ "attributes": { "POSITION": positions, "COLOR_0": colors }, "indices": indices }));
    file.node(json!({ "mesh": 0 }));
    let scene = file.load();
    let mesh = &scene.meshes[0];
    assert_eq!(mesh.indices, [0, 1, 2, 3, 4, 5]);
    let s = 0.5_f32.sqrt();
    for (i, normal) in mesh.normals.iter().enumerate() {
        let expected = if i < 3 { [s, s, 0.0] } else { [-s, s, 0.0] };
        assert!(normal.iter().zip(expected).all(|(a, b)| (a - b).abs() < 1e-6), "{i}: {normal:?}");
    }
    assert_eq!(mesh.colors.iter().map(|c| c[0]).collect::<Vec<_>>(), [0.1, 0.2, 0.3, 0.2, 0.1, 0.4]);
    assert!(mesh.colors.iter().all(|c| c[3] == 1.0));
    assert_eq!(mesh.uvs, [[0.0; 2]; 6]);
    assert_sound(&scene);
}

#[test]
fn normals_become_unit_and_broken_ones_are_mended() {
    let mut file = square(5, None);
    let normals = file.vec3(&[[0.0, 0.0, 1e-30], [3.0, 0.0, 4.0], [f32::NAN, 0.0, 0.0], [0.0; 3]]);
    file.json["meshes"][0]["primitives"][0]["attributes"]["NORMAL"] = normals.into();
    let scene = file.load();
    assert_eq!(scene.meshes[0].normals, [[0.0, 0.0, 1.0], [0.6, 0.0, 0.8], [0.0, 0.0, 1.0], [0.0, 0.0, 1.0]]);
    assert_eq!(scene.warnings.len(), 1);
    assert_sound(&scene);
}

#[test]
fn triangles_with_nan_or_infinite_positions_are_dropped() {
    let mut file = File::empty();
    let mut corners = [TRIANGLE; 4].concat();
    corners[4] = [f32::NAN, 0.0, 0.0];
    corners[6] = [0.0, f32::INFINITY, 0.0];
    let positions = file.vec3(&corners);
    file.mesh(json!({ "attributes": { "POSITION": positions } }));
    file.node(json!({ "mesh": 0 }));
    let scene = file.load();
    assert_eq!(scene.triangles(), 2);
    let expected = "meshes[0].primitives[0] and 1 more: a triangle with a NaN or infinite position was dropped";
    assert_eq!(scene.warnings, [expected]);
    assert_sound(&scene);
    assert_eq!(scene.bounds().max.to_array(), [1.0, 1.0, 0.0]);

    // With shared vertices the broken positions stay in the array, replaced by zeros.
    let mut file = square(5, None);
    let mut positions = SQUARE;
    positions[3] = [f32::NEG_INFINITY; 3];
    let positions = file.vec3(&positions);
    file.json["meshes"][0]["primitives"][0]["attributes"]["POSITION"] = positions.into();
    let scene = file.load();
    assert_eq!(scene.meshes[0].indices, [0, 1, 2]);
    assert_sound(&scene);

    // Nothing is left: no mesh, no instance, and no error.
    let mut file = File::triangle();
    let positions = file.vec3(&[[f32::NAN; 3]; 3]);
    file.json["meshes"][0]["primitives"][0]["attributes"]["POSITION"] = positions.into();
    let scene = file.load();
    assert!(scene.meshes.is_empty() && scene.instances.is_empty());
}

#[test]
fn colours_of_every_kind() {
    for (component, kind, normalized, bytes) in [
        (U8, "VEC4", true, vec![255, 0, 51, 102]),
        (U16, "VEC4", true, vec![255, 255, 0, 0, 0x33, 0x33, 0x66, 0x66]),
        (F32, "VEC4", false, [1.0_f32, 0.0, 0.2, 0.4].iter().flat_map(|v| v.to_le_bytes()).collect()),
    ] {
        let mut file = File::triangle();
        let colors = file.accessor(&bytes.repeat(3), component, kind, 3, normalized);
        file.json["meshes"][0]["primitives"][0]["attributes"]["COLOR_0"] = colors.into();
        for color in &file.load().meshes[0].colors {
            let expected = [1.0, 0.0, 0.2, 0.4];
            assert!(color.iter().zip(expected).all(|(a, b)| (a - b).abs() < 1e-6), "{component}: {color:?}");
        }
    }
}
