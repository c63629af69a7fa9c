//! Tests of materials, textures and images.

use super::builder::{File, U8, assert_sound, png};
use edgeshade::scene::{Texture, Wrap};
use serde_json::{Value, json};

const RED: [u8; 4] = [255, 0, 0, 255];

/// A textured triangle with texture coordinates.
fn textured(encoded: &[u8]) -> File {
    let mut file = File::triangle();
    let uvs = file.vec2(&[[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]]);
    let material = file.textured_material(encoded);
    let primitive = &mut file.json["meshes"][0]["primitives"][0];
    primitive["attributes"]["TEXCOORD_0"] = uvs.into();
    primitive["material"] = material.into();
    file
}

fn with_material(material: Value) -> File {
    let mut file = File::triangle();
    let material = file.push("materials", material);
    file.json["meshes"][0]["primitives"][0]["material"] = material.into();
    file
}

#[test]
fn a_primitive_without_material_is_white() {
    let scene = File::triangle().load();
    assert_eq!(scene.materials.len(), 1);
    let material = &scene.materials[scene.meshes[0].material];
    assert_eq!((material.base_color, material.texture, material.alpha_cutoff), ([1.0; 4], None, None));
}

#[test]
fn only_used_materials_are_kept() {
    let mut file = File::triangle();
    for name in ["a", "b", "c"] {
        let index = file.push("materials", json!({ "name": name }));
        if name != "b" {
            let mut primitive = file.json["meshes"][0]["primitives"][0].clone();
            primitive["material"] = index.into();
            file.json["meshes"][0]["primitives"].as_array_mut().unwrap().push(primitive);
        }
    }
    let scene = file.load();
    let names: Vec<_> = scene.meshes.iter().map(|m| &*scene.materials[m.material].name).collect();
    assert_eq!(names, ["unspecified", "a", "c"]);
    assert_eq!(scene.materials.len(), 3);
}

#[test]
fn base_colour_mask_and_sides() {
    let scene = with_material(json!({
        "name": "leaf", "doubleSided": true, "alphaMode": "MASK", "alphaCutoff": 0.25,
        "pbrMetallicRoughness": { "baseColorFactor": [0.1, 0.2, 0.3, 0.4] },
    }))
    .load();
    let m = &scene.materials[0];
    assert_eq!((&*m.name, m.double_sided, m.alpha_cutoff), ("leaf", true, Some(0.25)));
    assert_eq!(m.base_color, [0.1, 0.2, 0.3, 0.4]);
    assert_eq!(with_material(json!({ "alphaMode": "MASK" })).load().materials[0].alpha_cutoff, Some(0.5));
    // A cutoff has no meaning for other alpha modes.
    assert_eq!(with_material(json!({ "alphaCutoff": 0.3 })).load().materials[0].alpha_cutoff, None);
}

#[test]
fn blended_surfaces_are_opaque_but_glass_is_left_out() {
    let blend =
        |alpha: f32| json!({ "alphaMode": "BLEND", "pbrMetallicRoughness": { "baseColorFactor": [1, 1, 1, alpha] } });
    let scene = with_material(blend(0.5)).load();
    assert_eq!((scene.instances.len(), scene.materials[0].alpha_cutoff), (1, None));
    assert!(scene.warnings[0].contains("drawn as opaque"), "{:?}", scene.warnings);
    let scene = with_material(blend(0.4)).load();
    assert_eq!((scene.instances.len(), scene.meshes.len()), (0, 0));
    assert!(scene.warnings[0].contains("taken for glass"), "{:?}", scene.warnings);
    // With a texture the alpha of the factor tells little.
    let mut file = textured(&png(1, 1, &RED));
    file.json["materials"][0]["alphaMode"] = "BLEND".into();
    file.json["materials"][0]["pbrMetallicRoughness"]["baseColorFactor"] = json!([1, 1, 1, 0.1]);
    assert_eq!(file.load().instances.len(), 1);
}

#[test]
fn specular_glossiness_and_unlit() {
    let mut file = with_material(json!({ "extensions": {
        "KHR_materials_pbrSpecularGlossiness": { "diffuseFactor": [0.5, 0.25, 0, 1] }, "KHR_materials_unlit": {},
    } }));
    file.json["extensionsRequired"] = json!(["KHR_materials_pbrSpecularGlossiness", "KHR_materials_unlit"]);
    assert_eq!(file.load().materials[0].base_color, [0.5, 0.25, 0.0, 1.0]);
    let mut file = textured(&png(1, 1, &RED));
    let extension = json!({ "KHR_materials_pbrSpecularGlossiness": { "diffuseTexture": { "index": 0 } } });
    file.json["materials"][0] = json!({ "extensions": extension });
    assert_eq!(file.load().textures[0].rgba, [RED]);
}

#[test]
fn texels_run_from_the_top_and_alpha_is_kept() {
    let texels = [RED, [0, 255, 0, 128], [0, 0, 255, 0], [9, 8, 7, 6]];
    let scene = textured(&png(2, 2, texels.as_flattened())).load();
    let Texture { size, rgba, wrap, nearest, .. } = &scene.textures[0];
    assert_eq!((*size, &rgba[..], *wrap, *nearest), ([2, 2], &texels[..], [Wrap::Repeat; 2], false));
    assert_eq!(scene.meshes[0].uvs, [[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]]);
    assert_sound(&scene);
}

#[test]
fn jpeg_images() {
    let image = image::RgbImage::from_pixel(16, 8, image::Rgb([200, 100, 50]));
    let mut bytes = std::io::Cursor::new(Vec::new());
    image.write_to(&mut bytes, image::ImageFormat::Jpeg).unwrap();
    // The content decides, not the type that the file states.
    let scene = textured(&bytes.into_inner()).load();
    let texture = &scene.textures[0];
    assert_eq!(texture.size, [16, 8]);
    for (found, expected) in texture.rgba[0].iter().zip([200, 100, 50, 255]) {
        assert!(found.abs_diff(expected) <= 3, "{:?}", texture.rgba[0]);
    }
}

#[test]
fn samplers() {
    let mut file = textured(&png(1, 1, &RED));
    file.json["samplers"] = json!([{ "magFilter": 9728, "wrapS": 33071, "wrapT": 33648 }]);
    file.json["textures"][0]["sampler"] = 0.into();
    let scene = file.load();
    assert_eq!(scene.textures[0].wrap, [Wrap::ClampToEdge, Wrap::MirroredRepeat]);
    assert!(scene.textures[0].nearest);
}

#[test]
fn an_image_with_two_samplers_is_two_textures_and_with_one_is_one() {
    let mut file = textured(&png(1, 1, &RED));
    file.json["samplers"] = json!([{ "magFilter": 9728 }, {}]);
    file.json["textures"] = json!([{ "source": 0 }, { "source": 0, "sampler": 0 }, { "source": 0, "sampler": 1 }]);
    for texture in [1, 2] {
        let pbr = json!({ "baseColorTexture": { "index": texture } });
        let material = file.push("materials", json!({ "pbrMetallicRoughness": pbr }));
        let mut primitive = file.json["meshes"][0]["primitives"][0].clone();
        primitive["material"] = material.into();
        file.json["meshes"][0]["primitives"].as_array_mut().unwrap().push(primitive);
    }
    let scene = file.load();
    let nearest: Vec<_> =
        scene.meshes.iter().map(|m| scene.textures[scene.materials[m.material].texture.unwrap()].nearest).collect();
    assert_eq!(nearest, [false, true, false]);
    assert_eq!(scene.textures.len(), 2);
    assert!(scene.textures.iter().all(|t| t.rgba == [RED]));
}

#[test]
fn texture_transforms() {
    let mut file = textured(&png(1, 1, &RED));
    let other = file.vec2(&[[0.0, 0.0], [0.5, 1.0], [1.0, 0.0]]);
    file.json["meshes"][0]["primitives"][0]["attributes"]["TEXCOORD_1"] = other.into();
    // The extension's own example: the lower left quarter of the image, turned clockwise.
    let transform = json!({ "offset": [0, 1], "rotation": std::f64::consts::FRAC_PI_2, "scale": [0.5, 0.5] });
    let info = &mut file.json["materials"][0]["pbrMetallicRoughness"]["baseColorTexture"];
    info["extensions"] = json!({ "KHR_texture_transform": transform });
    let close = |found: &[[f32; 2]], expected: [[f32; 2]; 3]| {
        for (f, e) in found.as_flattened().iter().zip(expected.as_flattened()) {
            assert!((f - e).abs() < 1e-6, "{found:?} {expected:?}");
        }
    };
    close(&file.load().meshes[0].uvs, [[0.0, 1.0], [0.0, 0.5], [0.5, 1.0]]);
    // Another set of coordinates, and a non-uniform scale: scaling comes before rotation.
    let transform = json!({ "rotation": std::f64::consts::FRAC_PI_2, "scale": [2, 3], "texCoord": 1 });
    let info = &mut file.json["materials"][0]["pbrMetallicRoughness"]["baseColorTexture"];
    info["extensions"] = json!({ "KHR_texture_transform": transform });
    close(&file.load().meshes[0].uvs, [[0.0, 0.0], [3.0, -1.0], [0.0, -2.0]]);
}

#[test]
fn texture_coordinates_of_every_kind() {
    let mut file = textured(&png(1, 1, &RED));
    let uvs = file.accessor(&[0, 0, 255, 51, 51, 255], U8, "VEC2", 3, true);
    file.json["meshes"][0]["primitives"][0]["attributes"]["TEXCOORD_0"] = uvs.into();
    assert_eq!(file.load().meshes[0].uvs, [[0.0, 0.0], [1.0, 0.2], [0.2, 1.0]]);
    file.json["meshes"][0]["primitives"][0]["attributes"].as_object_mut().unwrap().remove("TEXCOORD_0");
    assert_eq!(file.load().meshes[0].uvs, [[0.0; 2]; 3]);
}
