//! Broken files, one per row, with the expected error.

use super::builder::{File, TRIANGLE, U8, U32, glb, png};
use edgeshade::scene::load_bytes;
use serde_json::{Value, json};

type Row = (&'static str, fn(&mut File), &'static str);

/// Changes to a valid file of one textured, indexed triangle, and the error that each must cause.
const ROWS: &[Row] = &[
    // Indices into the file's own lists.
    ("mesh", |f| f.json["nodes"][0]["mesh"] = 7.into(), "nodes[0].mesh: is 7, but the file has 1 meshes: 0 to 0"),
    ("camera", |f| f.json["nodes"][0]["camera"] = 0.into(), "nodes[0].camera: is 0, but the file has no cameras"),
    ("skin", |f| f.json["nodes"][0]["skin"] = 2.into(), "nodes[0].skin: is 2"),
    ("light", |f| light(f, json!({ "light": 3 })), "nodes[0].extensions.KHR_lights_punctual.light: is 3"),
    ("child", |f| f.json["nodes"][0]["children"] = json!([0, 9]), "nodes[0].children[1]: is 9"),
    ("scene", |f| f.json["scene"] = 4.into(), "scene: is 4"),
    ("root", |f| f.json["scenes"][0]["nodes"] = json!([0, 5]), "scenes[0].nodes[1]: is 5"),
    ("material", |f| primitive(f)["material"] = 3.into(), "meshes[0].primitives[0].material: is 3"),
    ("texture", |f| base_texture(f)["index"] = 3.into(), "materials[0]: texture index: is 3"),
    ("image", |f| f.json["textures"][0]["source"] = 3.into(), "textures[0].source: is 3"),
    ("sampler", |f| f.json["textures"][0]["sampler"] = 3.into(), "textures[0].sampler: is 3"),
    ("accessor", |f| primitive(f)["attributes"]["POSITION"] = 99.into(), "attributes: is 99"),
    ("index accessor", |f| primitive(f)["indices"] = 99.into(), "meshes[0].primitives[0].indices: is 99"),
    ("view", |f| f.json["accessors"][0]["bufferView"] = 99.into(), "accessors[0].bufferView: is 99"),
    ("buffer", |f| f.json["bufferViews"][0]["buffer"] = 9.into(), "bufferViews[0].buffer: is 9"),
    ("2^32", |f| primitive(f)["material"] = json!(1_u64 << 32), "material: 4294967296 is out of range"),
    ("2^32 attribute", |f| primitive(f)["attributes"]["POSITION"] = json!(1_u64 << 32), "attributes: 4294967296"),
    ("negative", |f| f.json["nodes"][0]["mesh"] = json!(-1), "nodes[0]: invalid value: integer `-1`"),
    // Accessors.
    ("count", |f| f.json["accessors"][0]["count"] = json!(4_294_967_295_u32), "accessors[0]: 4294967295 elements"),
    ("count 2^64", |f| f.json["accessors"][0]["count"] = json!(u64::MAX), "18446744073709551615"),
    (
        "count by one",
        |f| f.json["accessors"][0]["count"] = 4.into(),
        "accessors[0]: 4 elements, 12 bytes each, at byte 0",
    ),
    (
        "offset",
        |f| f.json["accessors"][0]["byteOffset"] = 1.into(),
        "accessors[0]: 3 elements, 12 bytes each, at byte 1",
    ),
    ("offset 2^64", |f| f.json["accessors"][0]["byteOffset"] = json!(u64::MAX), "accessors[0]: 3 elements"),
    ("stride", |f| f.json["bufferViews"][0]["byteStride"] = 16.into(), "3 elements, 16 bytes each"),
    ("stride 0", |f| f.json["bufferViews"][0]["byteStride"] = 0.into(), "bufferView's byteStride is 0"),
    ("stride 2^63", |f| f.json["bufferViews"][0]["byteStride"] = json!(1_u64 << 63), "3 elements"),
    ("view length", |f| f.json["bufferViews"][0]["byteLength"] = 9999.into(), "bufferViews[0]: 9999 bytes at 0 leave"),
    ("view offset", |f| f.json["bufferViews"][0]["byteOffset"] = json!(u64::MAX), "bufferViews[0]: 36 bytes at"),
    (
        "buffer length",
        |f| f.json["buffers"] = json!([{ "byteLength": 9_999_999 }]),
        "buffers[0].byteLength: is 9999999",
    ),
    (
        "no buffer",
        |f| f.json["buffers"] = json!([{ "byteLength": 36 }, { "byteLength": 4 }]),
        "buffers[1].uri: is missing",
    ),
    ("zeros", |f| zeros(f, 2_000_000), "accessors[0].count: is 2000000, but an accessor without bufferView"),
    ("zeros 2^64", |f| zeros(f, u64::MAX), "accessors[0].count: is 18446744073709551615, but an accessor without"),
    ("component", |f| f.json["accessors"][0]["componentType"] = 5124.into(), "accessors[0].componentType: must be"),
    ("type", |f| f.json["accessors"][0]["type"] = "VEC5".into(), "accessors[0].type: must be SCALAR"),
    ("wrong type", |f| f.json["accessors"][0]["type"] = "VEC2".into(), "has 2 components, but 3 are needed"),
    ("float indices", |f| f.json["accessors"][1]["componentType"] = 5122.into(), "unsigned integers are needed"),
    ("index range", |f| primitive_indices(f, &[0, 1, 3]), "element 2 is 3, but there are 3 vertices"),
    ("index 2^32", |f| primitive_indices(f, &[0, u32::MAX, 1]), "element 1 is 4294967295"),
    ("uv count", |f| short(f, "TEXCOORD_0"), "attributes.TEXCOORD_0: "),
    ("normal count", |f| short(f, "NORMAL"), "attributes.NORMAL: has 2 elements, but POSITION has 3"),
    ("sparse index", |f| sparse(f, 1, 3), "accessors[0].sparse.indices: hold 3, but the accessor has 3"),
    ("sparse count", |f| sparse(f, 4_000_000_000, 0), "accessors[0].sparse.indices: 4000000000 elements"),
    // Nodes.
    ("self", |f| f.json["nodes"][0]["children"] = json!([0]), "nodes[0]: is its own ancestor"),
    (
        "cycle",
        |f| f.json["nodes"] = json!([{}, { "children": [2] }, { "name": "ring", "children": [1] }]),
        "is its own ancestor",
    ),
    (
        "two parents",
        |f| f.json["nodes"] = json!([{ "children": [2] }, { "children": [2] }, { "name": "shared" }]),
        "nodes[2] \"shared\": has two parents, nodes[0] and nodes[1]",
    ),
    ("twice a child", |f| f.json["nodes"] = json!([{ "children": [1, 1] }, {}]), "nodes[1]: has two parents"),
    ("doubling", doubling, "has two parents"),
    ("overflow", |f| f.json["nodes"] = chain(json!([1e200, 1, 1])), "its transform is not finite"),
    ("1e999", |f| f.json["nodes"][0]["translation"] = json!([0, 0, "HUGE"]), "nodes[0]: invalid type: string"),
    (
        "far away",
        |f| f.json["nodes"][0]["translation"] = json!([1e19, 0, 0]),
        "nodes[0]: its mesh reaches further than 1e18",
    ),
    (
        "quaternion",
        |f| f.json["nodes"][0]["rotation"] = json!([0, 0, 0, 0]),
        "nodes[0]: its rotation is a quaternion of length 0",
    ),
    (
        "matrix",
        |f| f.json["nodes"][0]["matrix"] = json!([1, 0, 0, 1, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1]),
        "0 0 0 1 as last row",
    ),
    ("short matrix", |f| f.json["nodes"][0]["matrix"] = json!([1, 0, 0]), "nodes[0]: invalid length 3"),
    ("weights", |f| f.json["nodes"][0]["weights"] = json!([1e300]), "morph weight that is not finite"),
    // Instances.
    ("many instances", many_instances, "more than 4194304 instances"),
    ("instances", |f| instancing(f, json!({ "TRANSLATION": "x" }), 3), "must be the index of an accessor"),
    ("no instances", |f| instancing(f, json!({}), 3), "must have TRANSLATION, ROTATION or SCALE"),
    ("unequal", |f| instancing(f, json!({ "TRANSLATION": 0, "SCALE": 1 }), 2), "SCALE: has 3 elements, but the other"),
    ("draco data", draco, "meshes[0].primitives[0]: is compressed with KHR_draco_mesh_compression"),
    // Skins and morph targets.
    ("no joints", |f| skin(f, json!({ "joints": [] })), "skins[0].joints: is empty"),
    ("joint", |f| skin(f, json!({ "joints": [4] })), "skins[0].joints[0]: is 4"),
    ("vertex joint", |f| skin(f, json!({ "joints": [0] })), "JOINTS_0: is 1, but the file has 1 joints in its skin"),
    ("binds", |f| skin(f, json!({ "joints": [0], "inverseBindMatrices": 0 })), "accessors[0].type: has 3 components"),
    ("target", |f| target(f, json!([{ "POSITION": 77 }])), "targets: is 77"),
    ("target count", short_target, "targets[0].POSITION: has 2 elements"),
    // Surfaces.
    ("mode", |f| primitive(f)["mode"] = 7.into(), "meshes[0].primitives[0].mode: must be 0 to 6"),
    ("alpha mode", |f| f.json["materials"][0]["alphaMode"] = "GLASS".into(), "alphaMode must be"),
    ("wrap", |f| sampler(f, json!({ "wrapT": 1 })), "textures[0].sampler.wrapT: must be"),
    ("filter", |f| sampler(f, json!({ "magFilter": 1 })), "textures[0].sampler.magFilter: must be"),
    // The file as a whole.
    ("no asset", |f| drop(f.json.as_object_mut().unwrap().remove("asset")), "asset: is missing"),
    (
        "glTF 1.0",
        |f| f.json = json!({ "asset": { "version": "1.0" }, "meshes": {}, "nodes": {} }),
        "asset.version: is glTF 1.0, but only glTF 2.0 is read",
    ),
    ("glTF 3.0", |f| f.json["asset"]["version"] = "3.0".into(), "is glTF 3.0"),
    ("minVersion", |f| f.json["asset"] = json!({ "version": "2.1", "minVersion": "2.1" }), "is glTF 2.1"),
    (
        "draco",
        |f| f.json["extensionsRequired"] = json!(["KHR_draco_mesh_compression"]),
        "extensionsRequired[0]: the file cannot be read without KHR_draco_mesh_compression",
    ),
    (
        "meshopt",
        |f| f.json["extensionsRequired"] = json!(["KHR_lights_punctual", "EXT_meshopt_compression"]),
        "extensionsRequired[1]: the file cannot be read without EXT_meshopt_compression",
    ),
    (
        "basisu",
        |f| f.json["extensionsRequired"] = json!(["KHR_texture_basisu"]),
        "(supported: EXT_mesh_gpu_instancing, KHR_lights_punctual,",
    ),
    ("object", |f| f.json["nodes"] = json!({}), "nodes: must be an array"),
    (
        "no count",
        |f| drop(f.json["accessors"][1].as_object_mut().unwrap().remove("count")),
        "accessors[1]: missing field `count`",
    ),
    ("deep JSON", |f| f.json["extensions"] = deep(), "JSON: recursion limit exceeded"),
];

/// Changes that leave the texture without an image: an error if the material is alpha-masked, otherwise a warning.
const IMAGES: &[Row] = &[
    ("image view", |f| f.json["images"][0]["bufferView"] = 99.into(), "images[0].bufferView: is 99"),
    ("not an image", |f| image(f, b"BM this is no PNG"), "images[0]: is neither PNG nor JPEG"),
    ("no bytes", |f| image(f, b""), "images[0]: is neither PNG nor JPEG"),
    ("cut image", |f| image(f, &png(8, 8, &[7; 256])[..60]), "images[0]: cannot be decoded"),
    ("huge image", |f| image(f, &claiming(65_535, 65_535)), "images[0]"),
    ("wide image", |f| image(f, &claiming(16_385, 1)), "images[0]"),
    ("large image", |f| image(f, &claiming(16_384, 16_384)), "images[0]"),
    ("no image", |f| f.json["images"][0] = json!({}), "images[0]: must have a uri or a bufferView"),
    (
        "basis image",
        |f| f.json["textures"][0] = json!({ "extensions": { "KHR_texture_basisu": { "source": 0 } } }),
        "textures[0].source: has no image that can be read",
    ),
];

/// Changes that make a camera or light unusable, while the rest of the file stays usable.
const VIEWS: &[Row] = &[
    (
        "fov",
        |f| camera(f, json!({ "type": "perspective", "perspective": { "yfov": 4, "znear": 1 } })),
        "cameras[0].perspective.yfov: is 4",
    ),
    (
        "near",
        |f| camera(f, json!({ "type": "perspective", "perspective": { "yfov": 1, "znear": 0 } })),
        "cameras[0].perspective.znear: is 0",
    ),
    (
        "ymag",
        |f| {
            camera(
                f,
                json!({ "type": "orthographic", "orthographic": { "xmag": 1, "ymag": 0, "znear": 0, "zfar": 1 } }),
            )
        },
        "cameras[0].orthographic.ymag",
    ),
    (
        "zfar",
        |f| {
            camera(
                f,
                json!({ "type": "orthographic", "orthographic": { "xmag": 1, "ymag": 1, "znear": 2, "zfar": 1 } }),
            )
        },
        "cameras[0].orthographic.zfar",
    ),
    (
        "camera type",
        |f| camera(f, json!({ "type": "orthographic", "perspective": { "yfov": 1, "znear": 1 } })),
        "cameras[0].type: must be",
    ),
    (
        "cone",
        |f| lit(f, json!({ "type": "spot", "spot": { "outerConeAngle": 2 } })),
        "KHR_lights_punctual.lights[0].spot.outerConeAngle: is 2",
    ),
    ("light type", |f| lit(f, json!({ "type": "area" })), "KHR_lights_punctual.lights[0].type: must be"),
    (
        "size",
        |f| lit(f, json!({ "type": "spot", "extras": { "edgeshade": { "size": -1 } } })),
        "lights[0].extras.edgeshade.size: is -1",
    ),
    (
        "angle",
        |f| lit(f, json!({ "type": "directional", "extras": { "edgeshade": { "angle": "wide" } } })),
        "lights[0].extras.edgeshade.angle: is \"wide\"",
    ),
];

/// A valid file of one textured, indexed triangle with all attributes except normals.
fn sound() -> File {
    let mut file = File::triangle();
    let indices = file.indices(&[0, 1, 2]);
    let uvs = file.vec2(&[[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]]);
    let material = file.textured_material(&png(1, 1, &[255; 4]));
    primitive(&mut file)["attributes"]["TEXCOORD_0"] = uvs.into();
    primitive(&mut file)["indices"] = indices.into();
    primitive(&mut file)["material"] = material.into();
    file
}

fn primitive(file: &mut File) -> &mut Value {
    &mut file.json["meshes"][0]["primitives"][0]
}

fn base_texture(file: &mut File) -> &mut Value {
    &mut file.json["materials"][0]["pbrMetallicRoughness"]["baseColorTexture"]
}

fn light(file: &mut File, extension: Value) {
    file.json["nodes"][0]["extensions"] = json!({ "KHR_lights_punctual": extension });
}

fn lit(file: &mut File, value: Value) {
    light(file, json!({ "light": 0 }));
    file.json["extensions"] = json!({ "KHR_lights_punctual": { "lights": [value] } });
}

fn camera(file: &mut File, camera: Value) {
    file.json["cameras"] = json!([camera]);
    file.json["nodes"][0]["camera"] = 0.into();
}

fn zeros(file: &mut File, count: u64) {
    file.json["accessors"][0].as_object_mut().unwrap().remove("bufferView");
    file.json["accessors"][0]["count"] = count.into();
}

fn primitive_indices(file: &mut File, values: &[u32]) {
    let bytes: Vec<u8> = values.iter().flat_map(|v| v.to_le_bytes()).collect();
    let indices = file.accessor(&bytes, U32, "SCALAR", values.len(), false);
    primitive(file)["indices"] = indices.into();
}

fn short_accessor(file: &mut File) -> usize {
    file.vec3(&TRIANGLE[..2])
}

fn short(file: &mut File, attribute: &str) {
    let accessor = match attribute {
        "NORMAL" => short_accessor(file),
        _ => file.vec2(&[[0.0; 2]; 2]),
    };
    primitive(file)["attributes"][attribute] = accessor.into();
}

fn sparse(file: &mut File, count: u64, index: u8) {
    let (indices, values) = (file.view(&[index]), file.view(&[0; 12]));
    file.json["accessors"][0]["sparse"] = json!({
        "count": count, "indices": { "bufferView": indices, "componentType": U8 }, "values": { "bufferView": values },
    });
}

fn chain(scale: Value) -> Value {
    json!([{ "children": [1], "scale": scale }, { "children": [2], "scale": scale }, { "mesh": 0 }])
}

/// Every node has the next one as a child twice, which makes 2^60 paths.
fn doubling(file: &mut File) {
    let mut nodes: Vec<_> = (0..60).map(|i| json!({ "children": [i + 1, i + 1] })).collect();
    nodes.push(json!({ "mesh": 0 }));
    file.json["nodes"] = nodes.into();
}

fn draco(file: &mut File) {
    zeros(file, 3);
    primitive(file)["extensions"] = json!({ "KHR_draco_mesh_compression": { "bufferView": 0, "attributes": {} } });
}

fn many_instances(file: &mut File) {
    let count = json!({ "bufferView": 0, "componentType": 5126, "type": "VEC3", "count": 10_000_000 });
    let translation = file.push("accessors", count);
    instancing(file, json!({ "TRANSLATION": translation }), 3);
}

fn instancing(file: &mut File, attributes: Value, count: usize) {
    file.json["accessors"][0]["count"] = count.into();
    file.json["nodes"][0]["extensions"] = json!({ "EXT_mesh_gpu_instancing": { "attributes": attributes } });
}

fn skin(file: &mut File, skin: Value) {
    file.json["skins"] = json!([skin]);
    file.json["nodes"][0]["skin"] = 0.into();
    let joints = file.accessor(&[1; 12], U8, "VEC4", 3, false);
    let weights = file.vec4(&[[1.0, 0.0, 0.0, 0.0]; 3]);
    primitive(file)["attributes"]["JOINTS_0"] = joints.into();
    primitive(file)["attributes"]["WEIGHTS_0"] = weights.into();
}

fn target(file: &mut File, targets: Value) {
    primitive(file)["targets"] = targets;
    file.json["meshes"][0]["weights"] = json!([1]);
}

fn short_target(file: &mut File) {
    let accessor = short_accessor(file);
    target(file, json!([{ "POSITION": accessor }]));
}

fn sampler(file: &mut File, sampler: Value) {
    file.json["samplers"] = json!([sampler]);
    file.json["textures"][0]["sampler"] = 0.into();
}

fn image(file: &mut File, encoded: &[u8]) {
    let view = file.view(encoded);
    file.json["images"][0]["bufferView"] = view.into();
}

/// A PNG of one texel whose header claims another size, with a valid checksum.
fn claiming(width: u32, height: u32) -> Vec<u8> {
    let mut bytes = png(1, 1, &[255; 4]);
    bytes[16..20].copy_from_slice(&width.to_be_bytes());
    bytes[20..24].copy_from_slice(&height.to_be_bytes());
    let crc = bytes[12..29].iter().fold(u32::MAX, |crc, &byte| {
        (0..8).fold(crc ^ u32::from(byte), |c, _| if c & 1 == 1 { c >> 1 ^ 0xedb8_8320 } else { c >> 1 })
    });
    bytes[29..33].copy_from_slice(&(!crc).to_be_bytes());
    bytes
}

fn deep() -> Value {
    (0..200).fold(json!(1), |inner, _| json!({ "x": inner }))
}

#[test]
fn the_unbroken_file_loads() {
    let scene = sound().load();
    assert_eq!((scene.triangles(), scene.textures.len(), scene.warnings.len()), (1, 1, 0));
    // The checksum that `claiming` writes must be right, or its rows would test nothing.
    let mut file = sound();
    image(&mut file, &claiming(1, 1));
    assert_eq!(file.load().textures[0].size, [1, 1]);
}

#[test]
fn every_broken_file_names_its_fault() {
    let mut wrong = Vec::new();
    for (name, change, expected) in ROWS {
        let mut file = sound();
        change(&mut file);
        let error = file.error();
        if !error.contains(expected) || !error.starts_with("test: ") {
            wrong.push(format!("{name}: expected \"{expected}\", found \"{error}\""));
        }
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}

#[test]
fn an_image_is_needed_for_holes_alone() {
    for (name, change, expected) in IMAGES {
        let mut file = sound();
        change(&mut file);
        for mode in ["OPAQUE", "BLEND"] {
            file.json["materials"][0]["alphaMode"] = mode.into();
            let scene = file.load();
            assert_eq!((scene.triangles(), scene.textures.len(), scene.materials[0].texture), (1, 0, None), "{name}");
            let told = scene.warnings.iter().filter(|w| w.contains(expected) && w.contains("drawn without it")).count();
            assert_eq!(told, 1, "{name}: {:?}", scene.warnings);
        }
        file.json["materials"][0]["alphaMode"] = "MASK".into();
        let error = file.error();
        assert!(error.contains(expected) && error.starts_with("test: "), "{name}: {error}");
    }
}

#[test]
fn a_broken_view_leaves_the_others() {
    for (name, change, expected) in VIEWS {
        let mut file = sound();
        change(&mut file);
        let scene = file.load();
        assert_eq!((scene.triangles(), scene.cameras.len(), scene.lights.len()), (1, 0, 0), "{name}");
        let broken: Vec<_> = scene.broken_cameras.iter().chain(&scene.broken_lights).collect();
        let [broken] = broken[..] else { panic!("{name}: {broken:?}") };
        let text = format!("{}: {}", broken.place, broken.problem);
        assert!(text.contains(expected) && broken.number == 0, "{name}: {text}");
        assert!(scene.warnings.iter().any(|w| w.contains(expected)), "{name}: {:?}", scene.warnings);
    }
}

#[test]
fn numbers_beyond_f64_are_refused() {
    let text = String::from_utf8(sound().text()).unwrap();
    let text = text.replace("\"nodes\":[{", "\"nodes\":[{\"translation\":[1e999,0,0],");
    let error = load_bytes("test", &glb(text.as_bytes(), &sound().bin)).unwrap_err().to_string();
    assert!(error.contains("number out of range"), "{error}");
}

#[test]
fn not_gltf_at_all() {
    for (bytes, expected) in [
        (&b""[..], "the file is empty"),
        (b"  \n ", "the file is empty"),
        (b"OFF\n3 1 0", "this is not glTF 2.0"),
        (b"\x89PNG\r\n\x1a\n", "this is not glTF 2.0"),
        (b"glT", "this is not glTF 2.0"),
        (b"glTF", "header: the file is cut short"),
        (b"{}", "asset: is missing"),
        (b"{ \"asset\"", "JSON: "),
        (b"glTF\x01\0\0\0\x14\0\0\0\0\0\0\0\0\0\0\0", "header: binary glTF version 1"),
        (b"glTF\x02\0\0\0\x04\0\0\0\0\0\0\0\0\0\0\0", "header: the file is cut short"),
        (b"glTF\x02\0\0\0\x14\0\0\0\xff\xff\xff\xffJSON", "chunk 0: its header says 4294967295 bytes, but 0 are left"),
        (b"glTF\x02\0\0\0\x0c\0\0\0", "chunk 0: the first chunk of a binary glTF must be its JSON"),
        (b"glTF\x02\0\0\0\x14\0\0\0\0\0\0\0BIN\0", "chunk 0: the first chunk of a binary glTF must be its JSON"),
        (b"glTF\x02\0\0\0\x10\0\0\0\0\0\0\0", "chunk 0: the file is cut short"),
    ] {
        let error = load_bytes("x", bytes).unwrap_err().to_string();
        assert!(error.contains(expected), "{bytes:?}: {error}");
    }
}

#[test]
fn every_truncation_is_an_error() {
    let mut file = sound();
    image(&mut file, &png(40, 40, &(0..6400).map(|i| (i * i % 251) as u8).collect::<Vec<_>>()));
    file.view(&[0; 4096]);
    let bytes = file.glb();
    assert!(load_bytes("x", &bytes).is_ok());
    for length in (0..100).chain((100..bytes.len()).step_by(1024)).chain(bytes.len() - 100..bytes.len()) {
        assert!(load_bytes("x", &bytes[..length]).is_err(), "{length} of {} bytes", bytes.len());
    }
    let text = file.text();
    for length in (0..100).chain((100..text.len()).step_by(64)) {
        assert!(load_bytes("x", &text[..length]).is_err(), "{length} of {} bytes", text.len());
    }
}
