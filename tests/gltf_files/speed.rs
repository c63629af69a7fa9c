//! How long large files take. A measurement, not a test:
//! `cargo test --release --test scene_files speed -- --ignored --nocapture`.

use super::builder::{File, U32, png};
use edgeshade::scene::load_bytes;
use serde_json::json;
use std::time::Instant;

/// A million triangles over a grid of half a million vertices.
fn grid(with_normals: bool) -> File {
    let (w, h) = (1000_usize, 500_usize);
    let (mut positions, mut normals, mut uvs) = (Vec::new(), Vec::new(), Vec::new());
    for y in 0..=h {
        for x in 0..=w {
            let (x, y) = (x as f32, y as f32);
            positions.push([x, (x * 0.1).sin() * (y * 0.1).cos(), y]);
            normals.push([0.0, 1.0, 0.0]);
            uvs.push([x / w as f32, y / h as f32]);
        }
    }
    let mut indices = Vec::new();
    for y in 0..h {
        for x in 0..w {
            let i = (y * (w + 1) + x) as u32;
            let below = i + w as u32 + 1;
            indices.extend([i, below, i + 1, i + 1, below, below + 1].iter().flat_map(|v| v.to_le_bytes()));
        }
    }
    let mut file = File::empty();
    let (p, n, t) = (file.vec3(&positions), file.vec3(&normals), file.vec2(&uvs));
    let i = file.accessor(&indices, U32, "SCALAR", indices.len() / 4, false);
    let mut attributes = json!({ "POSITION": p, "TEXCOORD_0": t });
    if with_normals {
        attributes["NORMAL"] = n.into();
    }
    file.mesh(json!({ "attributes": attributes, "indices": i }));
    file.node(json!({ "mesh": 0 }));
    file
}

/// A hundred thousand nodes that show ten thousand meshes of a hundred triangles.
fn crowd() -> File {
    let mut file = grid(true);
    let count = json!({ "bufferView": 3, "componentType": U32, "type": "SCALAR", "count": 300 });
    let part = file.push("accessors", count);
    let primitive = json!({ "attributes": { "POSITION": 4 }, "indices": part });
    let corners: Vec<[f32; 3]> = (0..1200).map(|i| [i as f32, (i % 7) as f32, 1.0]).collect();
    let positions = file.vec3(&corners);
    file.json["meshes"] = (0..10_000)
        .map(|_| {
            let mut primitive = primitive.clone();
            primitive["attributes"]["POSITION"] = positions.into();
            json!({ "primitives": [primitive] })
        })
        .collect();
    file.json["nodes"] = (0..100_000).map(|i| json!({ "mesh": i % 10_000, "translation": [i, 0, 0] })).collect();
    file.json["scenes"][0]["nodes"] = (0..100_000).collect();
    file
}

fn textured(images: usize) -> File {
    let mut file = File::triangle();
    let noise: Vec<u8> = (0..1024 * 1024 * 4_u32).map(|i| (i.wrapping_mul(2_654_435_761) >> 27) as u8).collect();
    let encoded = png(1024, 1024, &noise);
    for _ in 0..images {
        let material = file.textured_material(&encoded);
        let mut primitive = file.json["meshes"][0]["primitives"][0].clone();
        primitive["material"] = material.into();
        file.json["meshes"][0]["primitives"].as_array_mut().unwrap().push(primitive);
    }
    file
}

#[test]
#[ignore = "a measurement"]
fn large_files() {
    for (name, file) in [
        ("a million triangles, with normals", grid(true)),
        ("a million triangles, without normals", grid(false)),
        ("a million triangles in 10,000 meshes, 100,000 nodes", crowd()),
        ("16 images of 1024 x 1024", textured(16)),
    ] {
        let bytes = file.glb();
        let mut times: Vec<f64> = (0..5)
            .map(|_| {
                let start = Instant::now();
                let scene = load_bytes("large", &bytes).unwrap();
                let took = start.elapsed().as_secs_f64() * 1e3;
                assert!(scene.triangles() > 0);
                took
            })
            .collect();
        times.sort_by(f64::total_cmp);
        println!("{name}: {:.0} ms (median of 5; {:.1} MB)", times[2], bytes.len() as f64 / 1e6);
    }
}
