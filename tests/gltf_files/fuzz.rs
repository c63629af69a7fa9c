//! Mutants of valid files: loading always returns quickly, and either fails or returns a valid scene.

use super::builder::{File, I8, TRIANGLE, U8, assert_sound, glb, png};
use edgeshade::scene::load_bytes;
use serde_json::json;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::time::{Duration, Instant};

const MUTANTS: u64 = 20_000;
/// Time for all mutants together; a slow machine tries fewer.
const BUDGET: Duration = Duration::from_secs(30);
/// Time limit for one mutant.
const LIMIT: Duration = Duration::from_secs(2);

/// Numbers that break code which does not check them.
const HOSTILE: [&str; 22] = [
    "0",
    "1",
    "2",
    "3",
    "4",
    "7",
    "12",
    "-1",
    "255",
    "256",
    "65535",
    "65536",
    "2147483648",
    "4294967295",
    "4294967296",
    "9223372036854775807",
    "18446744073709551615",
    "1e38",
    "1e300",
    "-1e-300",
    "0.5",
    "null",
];

const FLOATS: [f32; 8] = [f32::NAN, f32::INFINITY, f32::NEG_INFINITY, f32::MAX, f32::MIN_POSITIVE, -0.0, 0.0, 1e17];

/// The `splitmix64` generator: small, and the same everywhere.
struct Random(u64);

impl Random {
    fn next(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let z = (self.0 ^ self.0 >> 30).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        let z = (z ^ z >> 27).wrapping_mul(0x94d0_49bb_1331_11eb);
        z ^ z >> 31
    }

    fn below(&mut self, n: usize) -> usize {
        (self.next() % n.max(1) as u64) as usize
    }
}

/// A file that uses every feature the loader reads.
fn rich() -> File {
    let mut file = File::triangle();
    let indices = file.accessor(&[0, 1, 2, 2, 1, 0], U8, "SCALAR", 6, false);
    let (normals, uvs) = (file.vec3(&[[0.0, 0.0, 1.0]; 3]), file.vec2(&[[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]]));
    let colors = file.accessor(&[200; 12], U8, "VEC4", 3, true);
    let joints = file.accessor(&[0, 1, 0, 0].repeat(3), U8, "VEC4", 3, false);
    let weights = file.vec4(&[[0.5, 0.5, 0.0, 0.0]; 3]);
    let mut bind = [[0.0; 16]; 2];
    bind.iter_mut().for_each(|b| (b[0], b[5], b[10], b[15]) = (1.0, 1.0, 1.0, 1.0));
    let binds = file.floats(&bind, "MAT4");
    let change = file.vec3(&TRIANGLE);
    let (sparse_indices, sparse_values) = (file.view(&[1, 2]), file.view(&[63; 24]));
    file.json["accessors"][change]["sparse"] = json!({
        "count": 2, "indices": { "bufferView": sparse_indices, "componentType": U8 },
        "values": { "bufferView": sparse_values },
    });
    let (translation, rotation) = (file.vec3(&TRIANGLE), file.accessor(&[0, 0, 0, 127].repeat(3), I8, "VEC4", 3, true));
    let material = file.textured_material(&png(3, 3, &[90; 36]));
    file.json["materials"][material]["alphaMode"] = "MASK".into();
    file.json["materials"][material]["alphaCutoff"] = 0.5.into();
    file.json["materials"][material]["pbrMetallicRoughness"]["baseColorTexture"]["extensions"] =
        json!({ "KHR_texture_transform": { "offset": [0, 1], "rotation": 1, "scale": [2, 3], "texCoord": 0 } });
    file.json["samplers"] = json!([{ "magFilter": 9728, "wrapS": 33071, "wrapT": 33648 }]);
    file.json["textures"][0]["sampler"] = 0.into();
    let attributes = json!({
        "POSITION": 0, "NORMAL": normals, "TEXCOORD_0": uvs, "COLOR_0": colors, "JOINTS_0": joints, "WEIGHTS_0": weights,
    });
    let skinned = json!({
        "attributes": attributes, "indices": indices, "material": material, "targets": [{ "POSITION": change }],
    });
    file.push("meshes", json!({ "primitives": [skinned], "weights": [1] }));
    file.mesh(json!({ "attributes": { "POSITION": 0 }, "mode": 5 }));
    file.node(json!({ "mesh": 2 }));
    file.push("skins", json!({ "joints": [3, 4], "inverseBindMatrices": binds }));
    file.node(json!({ "mesh": 1, "skin": 0 }));
    file.node(json!({ "translation": [1, 2, 3], "children": [4] }));
    file.push("nodes", json!({ "rotation": [0, 0, 0, 1], "scale": [1, 2, 3] }));
    let instancing = json!({ "attributes": { "TRANSLATION": translation, "ROTATION": rotation } });
    file.node(json!({ "mesh": 1, "weights": [0.5], "extensions": { "EXT_mesh_gpu_instancing": instancing } }));
    file.push("cameras", json!({ "type": "perspective", "perspective": { "yfov": 1, "znear": 0.1 } }));
    let projection = json!({ "xmag": 1, "ymag": 1, "znear": 0, "zfar": 9 });
    file.push("cameras", json!({ "type": "orthographic", "orthographic": projection }));
    let spot = json!({ "type": "spot", "spot": { "outerConeAngle": 0.7 }, "extras": { "edgeshade": { "size": 1 } } });
    file.json["extensions"] = json!({ "KHR_lights_punctual": { "lights": [spot, { "type": "directional" }] } });
    let light = |index: usize| json!({ "KHR_lights_punctual": { "light": index } });
    file.node(
        json!({ "camera": 0, "extensions": light(0), "matrix": [1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 1, 2, 3, 1] }),
    );
    file.node(json!({ "camera": 1, "extensions": light(1) }));
    file
}

/// Replaces numbers in the JSON by hostile ones.
fn splice(text: &[u8], random: &mut Random) -> Vec<u8> {
    let is_number = |b: u8| b.is_ascii_digit() || b"+-.eE".contains(&b);
    let starts: Vec<usize> =
        (1..text.len()).filter(|&i| text[i].is_ascii_digit() && b":,[".contains(&text[i - 1])).collect();
    let start = starts[random.below(starts.len())];
    let end = (start..text.len()).find(|&i| !is_number(text[i])).unwrap_or(text.len());
    [&text[..start], HOSTILE[random.below(HOSTILE.len())].as_bytes(), &text[end..]].concat()
}

fn mutant(file: &File, random: &mut Random) -> Vec<u8> {
    let (mut text, mut bin) = (file.text(), file.bin.clone());
    match random.below(5) {
        // One or several numbers.
        0..=2 => {
            for _ in 0..=random.below(2) {
                text = splice(&text, random);
            }
            glb(&text, &bin)
        }
        // The binary data.
        3 => {
            for _ in 0..=random.below(20) {
                let at = random.below(bin.len() - 4);
                match random.below(2) {
                    0 => bin[at] = random.next() as u8,
                    _ => bin[at & !3..][..4].copy_from_slice(&FLOATS[random.below(FLOATS.len())].to_le_bytes()),
                }
            }
            glb(&text, &bin)
        }
        // The whole file: bytes flipped, the file cut, or a piece moved elsewhere.
        _ => {
            let mut whole = glb(&text, &bin);
            match random.below(3) {
                0 => {
                    for _ in 0..=random.below(8) {
                        let at = random.below(whole.len());
                        whole[at] ^= 1 << random.below(8);
                    }
                }
                1 => whole.truncate(random.below(whole.len())),
                _ => {
                    let (from, to) = (random.below(whole.len()), random.below(whole.len()));
                    let piece = whole[from..whole.len().min(from + 1 + random.below(40))].to_vec();
                    let end = whole.len().min(to + piece.len());
                    whole.splice(to..end, piece);
                }
            }
            whole
        }
    }
}

#[test]
fn mutants_neither_panic_nor_hang() {
    let files = [rich(), File::triangle()];
    for file in &files {
        assert_sound(&file.load());
    }
    assert!(files[0].load().warnings.is_empty(), "{:?}", files[0].load().warnings);
    let begin = Instant::now();
    let (mut sound, mut tried) = (0, 0);
    for seed in 0..MUTANTS {
        if begin.elapsed() > BUDGET {
            break;
        }
        let mut random = Random(seed);
        let bytes = mutant(&files[usize::from(seed % 8 == 0)], &mut random);
        let start = Instant::now();
        let loaded = catch_unwind(AssertUnwindSafe(|| {
            let scene = load_bytes("mutant", &bytes);
            scene.iter().for_each(assert_sound);
            scene.is_ok()
        }));
        let took = start.elapsed();
        sound += u64::from(loaded.unwrap_or_else(|_| panic!("the mutant of seed {seed} panicked")));
        tried += 1;
        assert!(took < LIMIT, "the mutant of seed {seed} took {took:?}");
    }
    // If too few or too many load, the mutants are too broken or too intact to test anything.
    println!("{tried} mutants tried, {sound} of them load");
    assert!(tried >= 500 && sound * 20 > tried && sound * 20 < tried * 19, "{sound} of {tried} mutants load");
}
