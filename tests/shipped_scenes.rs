//! Checks that the committed scenes, the shipped ones and those for judging, equal the generator's output, and that
//! every file is valid glTF.
//!
//! The files are read without any of the crate's own code: JSON by `serde_json`, the binary chunk by hand.
#![cfg(feature = "app")]

#[path = "../examples/make_scenes/scenes/mod.rs"]
mod scenes;

use edgeshade::casters::topology::Topology;
use edgeshade::scene::{LightShape, Mesh, Projection, Scene, load_bytes, shipped};
use glam::{DAffine3, DMat3, DMat4, DQuat, DVec3, Vec3};
use serde_json::Value;
use std::path::Path;

/// Scene that the generator makes.
fn generated(name: &str) -> Scene {
    scenes::ALL.iter().chain(&scenes::JUDGING).find(|s| s.0 == name).unwrap().1()
}

/// Names and files of all scenes, those for judging as the generator makes them: the package is without their files.
fn files() -> impl Iterator<Item = (&'static str, Vec<u8>)> {
    let shipped = shipped::ALL.iter().map(|s| (s.name, s.bytes.to_vec()));
    shipped.chain(scenes::JUDGING.iter().map(|&(name, stage)| (name, scenes::encode(&stage()))))
}

#[test]
fn committed_files_are_what_the_generator_makes() {
    assert!(scenes::ALL.iter().map(|s| s.0).eq(shipped::ALL.iter().map(|s| s.name)));
    let mut total = 0;
    for scene in shipped::ALL {
        let fresh = scenes::encode(&generated(scene.name));
        assert!(scene.bytes == fresh, "assets/{}.glb is not what the generator makes: run `make scenes`", scene.name);
        assert!(fresh == scenes::encode(&generated(scene.name)), "{}: two runs differ", scene.name);
        total += fresh.len();
    }
    assert!(total < 8_000_000, "the scenes take {total} bytes");
}

#[test]
fn committed_files_for_judging_are_what_the_generator_makes() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    // Cargo puts this file into packages only.
    if root.join("Cargo.toml.orig").exists() {
        println!("skipped: the package is without the scenes for judging");
        return;
    }
    let folder = root.join("assets/judging");
    for (name, stage) in scenes::JUDGING {
        let path = folder.join(name).with_extension("glb");
        let committed = std::fs::read(&path).unwrap_or_else(|e| panic!("{}: {e}", path.display()));
        let fresh = scenes::encode(&stage());
        assert!(committed == fresh, "{} is not what the generator makes: run `make scenes`", path.display());
        assert!(fresh == scenes::encode(&stage()), "{name}: two runs differ");
        assert!(fresh.len() <= 1_000_000, "{name} takes {} bytes", fresh.len());
    }
    assert_eq!(std::fs::read_dir(&folder).unwrap().count(), scenes::JUDGING.len());
}

/// Suites measure the shipped scenes, and rules are chosen on them: no scene for judging is among them.
#[test]
fn scenes_for_judging_are_not_shipped() {
    for (name, _) in scenes::JUDGING {
        assert!(shipped::find(name).is_none() && scenes::ALL.iter().all(|s| s.0 != name), "{name}");
    }
}

#[test]
fn meshes_of_scenes_for_judging_are_closed() {
    let mut open = Vec::new();
    for (name, stage) in scenes::JUDGING {
        let scene = stage();
        println!("{name}: {} triangles", scene.triangles());
        assert!(scene.triangles() <= 60_000, "{name} has {} triangles", scene.triangles());
        let lowest = lowest_point(&scene);
        for mesh in &scene.meshes {
            // Only the ground may be open: it is flat, nothing lies below it, and it shadows nothing.
            let ground = mesh.bounds.min.y == mesh.bounds.max.y && mesh.bounds.max.y <= lowest;
            if !ground && !outward(mesh) {
                open.push(format!("{name}: {}", mesh.name));
            }
        }
    }
    assert!(open.is_empty(), "{open:?}");
    // The check itself can fail.
    let mut mesh = generated("stones").meshes.pop().unwrap();
    assert!(outward(&mesh));
    mesh.indices.truncate(mesh.indices.len() - 3);
    assert!(!outward(&mesh));
}

/// Height of the lowest vertex.
fn lowest_point(scene: &Scene) -> f64 {
    let heights = scene.instances.iter().flat_map(|i| {
        let points = scene.meshes[i.mesh].positions.iter();
        points.map(|&p| i.world_from_object.transform_point3(Vec3::from(p).as_dvec3()).y)
    });
    heights.fold(f64::INFINITY, f64::min)
}

/// Returns whether a mesh is closed and winds counter-clockwise as seen from outside.
fn outward(mesh: &Mesh) -> bool {
    Topology::new(&mesh.positions, &mesh.indices).unwrap().outward
}

#[test]
fn names_are_unique_and_found() {
    assert!(shipped::find(shipped::DEFAULT).is_some());
    assert!(shipped::find("no such scene").is_none());
    for (i, scene) in shipped::ALL.iter().enumerate() {
        assert_eq!(shipped::ALL.iter().position(|s| s.name == scene.name), Some(i));
        assert_eq!(shipped::find(scene.name).unwrap().about, scene.about);
        assert!(!scene.about.contains('\n') && scene.about.len() < 120, "{}: {}", scene.name, scene.about);
    }
}

#[test]
fn write_all_makes_a_folder_of_files() {
    let dir = tempfile::tempdir().unwrap();
    let written = shipped::write_all(dir.path().join("new")).unwrap();
    assert_eq!(written.len(), shipped::ALL.len());
    for (path, scene) in written.iter().zip(shipped::ALL) {
        assert!(std::fs::read(path).unwrap() == scene.bytes, "{}", path.display());
    }
    // A file where the folder should be gives an error that names it.
    let file = dir.path().join("file");
    std::fs::write(&file, b"x").unwrap();
    let message = shipped::write_all(&file).unwrap_err().to_string();
    assert!(message.contains("file"), "{message}");
}

#[test]
fn every_file_is_sound() {
    for (name, bytes) in files() {
        if let Err(problem) = check(name, &bytes) {
            panic!("{name}: {problem}");
        }
    }
}

/// The check itself can fail.
#[test]
fn a_damaged_file_is_noticed() {
    let scene = shipped::find("jenga").unwrap();
    let good = scene.bytes.to_vec();
    let bin = 20 + u32::from_le_bytes(good[12..16].try_into().unwrap()) as usize + 8;
    let file = Glb::parse(&good).unwrap();
    let primitive = &file.json["meshes"][0]["primitives"][0];
    let offset = |accessor: &Value| {
        let view = &file.json["accessors"][accessor.as_u64().unwrap() as usize]["bufferView"];
        bin + file.json["bufferViews"][view.as_u64().unwrap() as usize]["byteOffset"].as_u64().unwrap() as usize
    };
    let damage = |at: usize, bytes: &[u8]| {
        let mut bad = good.clone();
        bad[at..at + bytes.len()].copy_from_slice(bytes);
        check(scene.name, &bad).unwrap_err()
    };
    assert!(damage(offset(&primitive["indices"]), &[0xff, 0xff]).contains("index"));
    assert!(damage(offset(&primitive["attributes"]["POSITION"]), &f32::NAN.to_le_bytes()).contains("finite"));
    assert!(damage(offset(&primitive["attributes"]["POSITION"]), &9.0f32.to_le_bytes()).contains("bounds"));
    assert!(damage(offset(&primitive["attributes"]["NORMAL"]), &3.0f32.to_le_bytes()).contains("normal"));
    // Two corners of the first triangle are exchanged, so it winds the wrong way.
    let at = offset(&primitive["indices"]);
    let swapped = [&good[at + 2..at + 4], &good[at..at + 2]].concat();
    assert!(damage(at, &swapped).contains("wind"));
}

/// Checks that a file is valid and agrees with the scene in memory.
fn check(name: &str, bytes: &[u8]) -> Result<(), String> {
    let file = Glb::parse(bytes)?;
    let memory = generated(name);
    let mut triangles = 0;
    let (mut low, mut high) = (DVec3::INFINITY, DVec3::NEG_INFINITY);
    let nodes = file.json["nodes"].as_array().ok_or("no nodes")?;
    let (mut cameras, mut lights) = (0, 0);
    for node in nodes {
        let local = transform(node);
        if node["camera"].is_u64() {
            cameras += 1;
            let expected = memory.cameras[0].world_from_camera;
            same_pose(&local, &expected).map_err(|e| format!("camera: {e}"))?;
        }
        if !node["extensions"]["KHR_lights_punctual"].is_null() {
            lights += 1;
            same_pose(&local, &memory.lights[0].world_from_light).map_err(|e| format!("light: {e}"))?;
        }
        let Some(mesh) = node["mesh"].as_u64() else { continue };
        let instancing = &node["extensions"]["EXT_mesh_gpu_instancing"]["attributes"];
        let places = if instancing.is_null() {
            vec![local]
        } else {
            file.instances(instancing)?.into_iter().map(|i| local * i).collect()
        };
        for primitive in file.json["meshes"][mesh as usize]["primitives"].as_array().ok_or("no primitives")? {
            let shape = file.shape(primitive)?;
            triangles += places.len() * shape.indices.len() / 3;
            for place in &places {
                for &i in &shape.indices {
                    let p = place.transform_point3(shape.positions[i]);
                    (low, high) = (low.min(p), high.max(p));
                }
            }
        }
    }
    if cameras != 1 || lights != 1 {
        return Err(format!("{cameras} cameras and {lights} lights"));
    }
    let expected = memory.bounds();
    let size = expected.radius();
    // Bounds of transformed boxes contain those of the transformed points; otherwise they agree up to the file's
    // rounding.
    if (low - expected.min).min_element() < -1e-4 * size || (expected.max - high).min_element() < -1e-4 * size {
        return Err(format!("bounds {low} .. {high}, expected within {} .. {}", expected.min, expected.max));
    }
    let missing = memory.triangles() as i64 - triangles as i64;
    // Quantisation may collapse a sliver.
    if !(0..=memory.triangles() as i64 / 1000).contains(&missing) {
        return Err(format!("{triangles} triangles, expected {}", memory.triangles()));
    }
    let light = &file.json["extensions"]["KHR_lights_punctual"]["lights"][0];
    let size = &light["extras"]["edgeshade"];
    let given = match memory.lights[0].shape {
        LightShape::Spot { size: Some(s), outer } => {
            let angle = light["spot"]["outerConeAngle"].as_f64().ok_or("no cone")?;
            (angle - outer).abs() < 1e-6 && (size["size"].as_f64().ok_or("no light size")? - s).abs() < 1e-6
        }
        LightShape::Directional { angle: Some(a) } => (size["angle"].as_f64().ok_or("no angle")? - a).abs() < 1e-6,
        _ => false,
    };
    let Projection::Perspective { fov_y, .. } = memory.cameras[0].projection else { return Err("projection".into()) };
    let fov = file.json["cameras"][0]["perspective"]["yfov"].as_f64().ok_or("no yfov")?;
    if !given || (fov - fov_y).abs() > 1e-6 {
        return Err("light size or field of view differ".into());
    }
    for i in 0..file.json["images"].as_array().map_or(0, Vec::len) {
        let view = file.json["images"][i]["bufferView"].as_u64().ok_or("image without view")?;
        let image = image::load_from_memory(file.view(view as usize)?).map_err(|e| e.to_string())?.to_rgba8();
        if image.as_raw().as_slice() != memory.textures[i].rgba.as_flattened() {
            return Err(format!("image {i} differs"));
        }
    }
    Ok(())
}

fn same_pose(a: &DAffine3, b: &DAffine3) -> Result<(), String> {
    if a.abs_diff_eq(*b, 1e-5) { Ok(()) } else { Err(format!("{a} is not {b}")) }
}

/// A glTF file with two chunks.
struct Glb<'a> {
    json: Value,
    bin: &'a [u8],
}

struct Shape {
    positions: Vec<DVec3>,
    indices: Vec<usize>,
}

impl<'a> Glb<'a> {
    fn parse(bytes: &'a [u8]) -> Result<Self, String> {
        let word = |at: usize| u32::from_le_bytes(bytes[at..at + 4].try_into().unwrap()) as usize;
        if &bytes[..4] != b"glTF" || word(4) != 2 || word(8) != bytes.len() {
            return Err("header".into());
        }
        let length = word(12);
        if &bytes[16..20] != b"JSON" || !length.is_multiple_of(4) || &bytes[24 + length..28 + length] != b"BIN\0" {
            return Err("chunks".into());
        }
        let json: Value = serde_json::from_slice(&bytes[20..20 + length]).map_err(|e| e.to_string())?;
        let bin = &bytes[28 + length..];
        if bin.len() != word(20 + length)
            || bin.len().abs_diff(json["buffers"][0]["byteLength"].as_u64().unwrap() as usize) > 3
        {
            return Err("binary chunk".into());
        }
        Ok(Self { json, bin })
    }

    fn view(&self, index: usize) -> Result<&'a [u8], String> {
        let view = &self.json["bufferViews"][index];
        let start = view["byteOffset"].as_u64().unwrap_or(0) as usize;
        let length = view["byteLength"].as_u64().ok_or("view without length")? as usize;
        if !start.is_multiple_of(4) {
            return Err(format!("view {index} starts at {start}"));
        }
        self.bin.get(start..start + length).ok_or_else(|| format!("view {index} leaves the buffer"))
    }

    /// All components as numbers, normalised if the accessor says so.
    fn accessor(&self, index: &Value) -> Result<Vec<Vec<f64>>, String> {
        let accessor = &self.json["accessors"][index.as_u64().ok_or("no accessor")? as usize];
        let view_index = accessor["bufferView"].as_u64().ok_or("accessor without view")? as usize;
        let bytes = self.view(view_index)?;
        let columns = match accessor["type"].as_str() {
            Some("SCALAR") => 1,
            Some("VEC2") => 2,
            Some("VEC3") => 3,
            Some("VEC4") => 4,
            other => return Err(format!("type {other:?}")),
        };
        let kind = accessor["componentType"].as_u64().ok_or("no component type")?;
        let normalized = accessor["normalized"].as_bool().unwrap_or(false);
        let (width, scale) = match kind {
            5120 => (1, 127.0),
            5123 => (2, 65535.0),
            5125 => (4, 1.0),
            5126 => (4, 1.0),
            other => return Err(format!("component type {other}")),
        };
        let stride =
            self.json["bufferViews"][view_index]["byteStride"].as_u64().map_or(columns * width, |s| s as usize);
        let one = |at: usize| -> Option<f64> {
            let b = bytes.get(at..at + width)?;
            let x = match kind {
                5120 => f64::from(b[0] as i8),
                5123 => f64::from(u16::from_le_bytes(b.try_into().ok()?)),
                5125 => f64::from(u32::from_le_bytes(b.try_into().ok()?)),
                _ => f64::from(f32::from_le_bytes(b.try_into().ok()?)),
            };
            Some(if normalized { (x / scale).max(-1.0) } else { x })
        };
        let count = accessor["count"].as_u64().ok_or("no count")? as usize;
        (0..count)
            .map(|row| (0..columns).map(|c| one(row * stride + c * width)).collect::<Option<Vec<f64>>>())
            .collect::<Option<Vec<_>>>()
            .ok_or_else(|| "accessor leaves its view".into())
    }

    fn instances(&self, attributes: &Value) -> Result<Vec<DAffine3>, String> {
        let t = self.accessor(&attributes["TRANSLATION"])?;
        let optional = |name: &str, default: Vec<f64>| match &attributes[name] {
            Value::Null => Ok(vec![default; t.len()]),
            index => self.accessor(index),
        };
        let r = optional("ROTATION", vec![0.0, 0.0, 0.0, 1.0])?;
        let s = optional("SCALE", vec![1.0; 3])?;
        if r.len() != t.len() || s.len() != t.len() {
            return Err("instance attributes of different length".into());
        }
        (0..t.len())
            .map(|i| {
                let q = DQuat::from_slice(&r[i]);
                if (q.length() - 1.0).abs() > 1e-5 {
                    return Err("instance rotation is not a unit".to_string());
                }
                Ok(DAffine3::from_scale_rotation_translation(DVec3::from_slice(&s[i]), q, DVec3::from_slice(&t[i])))
            })
            .collect()
    }

    fn shape(&self, primitive: &Value) -> Result<Shape, String> {
        let attributes = &primitive["attributes"];
        let to_points = |rows: Vec<Vec<f64>>| rows.iter().map(|r| DVec3::from_slice(r)).collect::<Vec<_>>();
        let positions = to_points(self.accessor(&attributes["POSITION"])?);
        let normals = to_points(self.accessor(&attributes["NORMAL"])?);
        let indices: Vec<usize> = self.accessor(&primitive["indices"])?.iter().map(|r| r[0] as usize).collect();
        let declared = &self.json["accessors"][attributes["POSITION"].as_u64().unwrap() as usize];
        if positions.len() != normals.len() || indices.is_empty() || !indices.len().is_multiple_of(3) {
            return Err("vertex or index count".into());
        }
        if let Some(bad) = indices.iter().find(|&&i| i >= positions.len()) {
            return Err(format!("index {bad} of {} vertices", positions.len()));
        }
        if positions.iter().chain(&normals).any(|p| !p.is_finite()) {
            return Err("a vertex is not finite".into());
        }
        let scale = if declared["normalized"].as_bool().unwrap_or(false) { 65535.0 } else { 1.0 };
        for (key, fold) in [("min", DVec3::min as fn(DVec3, DVec3) -> DVec3), ("max", DVec3::max)] {
            let found = positions.iter().copied().reduce(fold).unwrap() * scale;
            let said = DVec3::from_array(std::array::from_fn(|k| declared[key][k].as_f64().unwrap()));
            if (found - said).abs().max_element() > 1e-6 * said.abs().max_element().max(1.0) {
                return Err(format!("accessor bounds: {key} is {found}, the file says {said}"));
            }
        }
        let mut against = 0;
        for t in indices.chunks_exact(3) {
            let [a, b, c] = [t[0], t[1], t[2]].map(|i| positions[i]);
            if a == b || b == c || c == a {
                return Err("a triangle has two corners in one point".into());
            }
            let face = (b - a).cross(c - a);
            let mean = normals[t[0]] + normals[t[1]] + normals[t[2]];
            against += usize::from(face.dot(mean) < -1e-3 * face.length());
        }
        for n in &normals {
            // With eight bits per component a normal has unit length up to about one percent.
            if (n.length() - 1.0).abs() > 0.012 {
                return Err(format!("normal {n} of length {}", n.length()));
            }
        }
        if against > 0 {
            return Err(format!("{against} triangles wind against their normals"));
        }
        Ok(Shape { positions, indices })
    }
}

fn transform(node: &Value) -> DAffine3 {
    let numbers = |key: &str| node[key].as_array().map(|a| a.iter().map(|x| x.as_f64().unwrap()).collect::<Vec<_>>());
    if let Some(m) = numbers("matrix") {
        return DAffine3::from_mat4(DMat4::from_cols_slice(&m));
    }
    let t = numbers("translation").map_or(DVec3::ZERO, |v| DVec3::from_slice(&v));
    let r = numbers("rotation").map_or(DQuat::IDENTITY, |v| DQuat::from_slice(&v));
    let s = numbers("scale").map_or(DVec3::ONE, |v| DVec3::from_slice(&v));
    DAffine3::from_scale_rotation_translation(s, r, t)
}

/// Checks that the crate's own loader reads back the scene that the generator made.
#[test]
fn the_loader_reads_what_the_generator_meant() {
    for (name, bytes) in files() {
        let (read, meant) = (load_bytes(name, &bytes).unwrap(), generated(name));
        assert!(read.warnings.is_empty(), "{name}: {:?}", read.warnings);
        assert_eq!(read.instances.len(), meant.instances.len(), "{name}");
        assert_eq!(read.textures.len(), meant.textures.len(), "{name}");
        assert_eq!(read.materials.len(), meant.materials.len(), "{name}");
        assert!(meant.triangles() - read.triangles() <= meant.triangles() / 1000, "{name}");
        let (a, b) = (read.bounds(), meant.bounds());
        let slack = 1e-4 * b.radius();
        assert!(a.min.abs_diff_eq(b.min, slack) && a.max.abs_diff_eq(b.max, slack), "{name}: {a:?} is not {b:?}");
        assert!(read.lights[0].world_from_light.abs_diff_eq(meant.lights[0].world_from_light, 1e-4), "{name}");
        match (read.lights[0].shape, meant.lights[0].shape) {
            (LightShape::Spot { outer: a, size: Some(s) }, LightShape::Spot { outer: b, size: Some(t) }) => {
                assert!((a - b).abs() < 1e-6 && (s - t).abs() < 1e-6, "{name}");
            }
            (LightShape::Directional { angle: Some(a) }, LightShape::Directional { angle: Some(b) }) => {
                assert!((a - b).abs() < 1e-6, "{name}");
            }
            other => panic!("{name}: {other:?}"),
        }
        for (a, b) in read.materials.iter().zip(&meant.materials) {
            assert_eq!((&a.name, a.alpha_cutoff, a.double_sided), (&b.name, b.alpha_cutoff, b.double_sided), "{name}");
            // The loader may number the images differently.
            let image = |scene: &Scene, texture: Option<usize>| texture.map(|t| scene.textures[t].rgba.clone());
            assert!(image(&read, a.texture) == image(&meant, b.texture), "{name}: the image of {}", a.name);
        }
    }
}

#[test]
fn every_light_rakes_and_every_mesh_stands_somewhere() {
    for (name, stage) in scenes::ALL.into_iter().chain(scenes::JUDGING) {
        let scene = stage();
        assert_eq!((scene.cameras.len(), scene.lights.len()), (1, 1), "{name}");
        let m: DMat3 = scene.lights[0].world_from_light.matrix3;
        let elevation = m.z_axis.y.asin().to_degrees();
        assert!((20.0..=60.0).contains(&elevation), "{name}: the light stands at {elevation} degrees");
        for (mesh, index) in scene.meshes.iter().zip(0..) {
            assert!(scene.instances.iter().any(|i| i.mesh == index), "{name}: {} stands nowhere", mesh.name);
            assert!(mesh.normals.iter().all(|&n| (Vec3::from(n).length() - 1.0).abs() < 1e-5), "{}", mesh.name);
            assert!(mesh.colors.is_empty() && mesh.uvs.len() == mesh.positions.len(), "{}", mesh.name);
        }
    }
}
