//! Builder of glTF files in memory.

use edgeshade::scene::{self, Scene};
use glam::DVec3;
use serde_json::{Value, json};

/// Values of glTF's `componentType`.
pub const I8: u32 = 5120;
pub const U8: u32 = 5121;
pub const I16: u32 = 5122;
pub const U16: u32 = 5123;
pub const U32: u32 = 5125;
pub const F32: u32 = 5126;

/// A triangle in the plane `z = 0`.
pub const TRIANGLE: [[f32; 3]; 3] = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]];

/// A file under construction: its JSON, which tests may change, and its binary chunk.
pub struct File {
    pub json: Value,
    pub bin: Vec<u8>,
}

impl File {
    /// A file without content.
    pub fn empty() -> Self {
        Self { json: json!({ "asset": { "version": "2.0" } }), bin: Vec::new() }
    }

    /// One triangle, one node, one scene.
    pub fn triangle() -> Self {
        let mut file = Self::empty();
        let positions = file.vec3(&TRIANGLE);
        file.mesh(json!({ "attributes": { "POSITION": positions } }));
        file.node(json!({ "mesh": 0 }));
        file
    }

    /// Appends a value to a top-level array and returns its index.
    pub fn push(&mut self, list: &str, value: Value) -> usize {
        let root = self.json.as_object_mut().unwrap();
        let list = root.entry(list).or_insert_with(|| json!([])).as_array_mut().unwrap();
        list.push(value);
        list.len() - 1
    }

    /// Appends bytes as a buffer view.
    pub fn view(&mut self, bytes: &[u8]) -> usize {
        self.bin.resize(self.bin.len().next_multiple_of(4), 0);
        let offset = self.bin.len();
        self.bin.extend_from_slice(bytes);
        self.push("bufferViews", json!({ "buffer": 0, "byteOffset": offset, "byteLength": bytes.len() }))
    }

    /// Appends an accessor with its own bytes.
    pub fn accessor(&mut self, bytes: &[u8], component: u32, kind: &str, count: usize, normalized: bool) -> usize {
        let view = self.view(bytes);
        let accessor = json!({
            "bufferView": view, "componentType": component, "type": kind, "count": count, "normalized": normalized,
        });
        self.push("accessors", accessor)
    }

    pub fn floats<const N: usize>(&mut self, values: &[[f32; N]], kind: &str) -> usize {
        let bytes: Vec<u8> = values.as_flattened().iter().flat_map(|v| v.to_le_bytes()).collect();
        self.accessor(&bytes, F32, kind, values.len(), false)
    }

    pub fn vec2(&mut self, values: &[[f32; 2]]) -> usize {
        self.floats(values, "VEC2")
    }

    pub fn vec3(&mut self, values: &[[f32; 3]]) -> usize {
        self.floats(values, "VEC3")
    }

    pub fn vec4(&mut self, values: &[[f32; 4]]) -> usize {
        self.floats(values, "VEC4")
    }

    /// Appends 16-bit indices.
    pub fn indices(&mut self, values: &[u16]) -> usize {
        let bytes: Vec<u8> = values.iter().flat_map(|v| v.to_le_bytes()).collect();
        self.accessor(&bytes, U16, "SCALAR", values.len(), false)
    }

    /// Appends a mesh of one primitive.
    pub fn mesh(&mut self, primitive: Value) -> usize {
        self.push("meshes", json!({ "primitives": [primitive] }))
    }

    /// Appends a node, which becomes a root of scene 0.
    pub fn node(&mut self, node: Value) -> usize {
        let index = self.push("nodes", node);
        if self.json.get("scenes").is_none() {
            self.push("scenes", json!({ "nodes": [] }));
        }
        self.json["scenes"][0]["nodes"].as_array_mut().unwrap().push(index.into());
        index
    }

    /// Appends a PNG or JPEG image in a buffer view, its texture, and a material that uses it.
    pub fn textured_material(&mut self, encoded: &[u8]) -> usize {
        let view = self.view(encoded);
        let image = self.push("images", json!({ "bufferView": view, "mimeType": "image/png" }));
        let texture = self.push("textures", json!({ "source": image }));
        let pbr = json!({ "baseColorTexture": { "index": texture } });
        self.push("materials", json!({ "pbrMetallicRoughness": pbr }))
    }

    /// JSON text of the file, with a buffer for the binary chunk if there is one.
    pub fn text(&self) -> Vec<u8> {
        let mut json = self.json.clone();
        if !self.bin.is_empty() && json.get("buffers").is_none() {
            json["buffers"] = json!([{ "byteLength": self.bin.len() }]);
        }
        serde_json::to_vec(&json).unwrap()
    }

    /// Bytes of the binary file.
    pub fn glb(&self) -> Vec<u8> {
        glb(&self.text(), &self.bin)
    }

    pub fn load(&self) -> Scene {
        scene::load_bytes("test", &self.glb()).unwrap()
    }

    /// Message of the error that loading causes.
    pub fn error(&self) -> String {
        scene::load_bytes("test", &self.glb()).err().map_or_else(|| "no error".into(), |e| e.to_string())
    }
}

/// Joins chunks to a binary file.
pub fn glb(json: &[u8], bin: &[u8]) -> Vec<u8> {
    let mut chunks = Vec::new();
    for (kind, data, pad) in [(b"JSON", json, b' '), (b"BIN\0", bin, 0)] {
        if kind == b"BIN\0" && data.is_empty() {
            continue;
        }
        let length = data.len().next_multiple_of(4);
        chunks.extend_from_slice(&(length as u32).to_le_bytes());
        chunks.extend_from_slice(kind);
        chunks.extend_from_slice(data);
        chunks.resize(chunks.len() + length - data.len(), pad);
    }
    let mut file = b"glTF".to_vec();
    file.extend_from_slice(&2_u32.to_le_bytes());
    file.extend_from_slice(&(chunks.len() as u32 + 12).to_le_bytes());
    file.extend(chunks);
    file
}

/// Encodes texels as a PNG file.
pub fn png(width: u32, height: u32, rgba: &[u8]) -> Vec<u8> {
    let image = image::RgbaImage::from_raw(width, height, rgba.to_vec()).unwrap();
    let mut bytes = std::io::Cursor::new(Vec::new());
    image.write_to(&mut bytes, image::ImageFormat::Png).unwrap();
    bytes.into_inner()
}

/// World-space corners of all triangles, in order.
pub fn world(scene: &Scene) -> Vec<DVec3> {
    let corners = |i: &scene::Instance| {
        let (mesh, place) = (&scene.meshes[i.mesh], i.world_from_object);
        let corner = move |&v: &u32| place.transform_point3(glam::Vec3::from(mesh.positions[v as usize]).as_dvec3());
        mesh.indices.iter().map(corner).collect::<Vec<_>>()
    };
    scene.instances.iter().flat_map(corners).collect()
}

/// Fails unless the world-space corners equal the expected ones to within `tolerance`.
#[track_caller]
pub fn assert_world(scene: &Scene, expected: &[[f64; 3]], tolerance: f64) {
    let found = world(scene);
    assert_eq!(found.len(), expected.len(), "{found:?}");
    for (f, e) in found.iter().zip(expected) {
        assert!(f.abs_diff_eq(DVec3::from(*e), tolerance), "found {found:?}\nexpected {expected:?}");
    }
}

/// Checks the properties that every loaded scene has.
#[track_caller]
pub fn assert_sound(scene: &Scene) {
    for mesh in &scene.meshes {
        let n = mesh.positions.len();
        assert_eq!((mesh.normals.len(), mesh.uvs.len()), (n, n));
        assert!(mesh.colors.is_empty() || mesh.colors.len() == n);
        assert!(!mesh.indices.is_empty() && mesh.indices.len() % 3 == 0);
        assert!(mesh.indices.iter().all(|&i| (i as usize) < n));
        assert!(mesh.positions.as_flattened().iter().all(|v| v.is_finite()));
        assert!(mesh.uvs.as_flattened().iter().all(|v| v.is_finite()));
        assert!(mesh.normals.iter().all(|n| (glam::Vec3::from(*n).length() - 1.0).abs() < 1e-4));
        assert!(mesh.material < scene.materials.len());
        let mut again = mesh.clone();
        again.compute_bounds();
        assert_eq!(again.bounds, mesh.bounds);
    }
    for material in &scene.materials {
        assert!(material.texture.is_none_or(|t| t < scene.textures.len()));
    }
    for texture in &scene.textures {
        assert_eq!(texture.rgba.len(), texture.size[0] as usize * texture.size[1] as usize);
        assert!(!texture.rgba.is_empty());
    }
    for instance in &scene.instances {
        assert!(instance.mesh < scene.meshes.len() && instance.world_from_object.is_finite());
    }
    let rigid = |m: &glam::DAffine3| {
        let error = m.matrix3.transpose() * m.matrix3 - glam::DMat3::IDENTITY;
        m.is_finite() && error.to_cols_array().iter().all(|e| e.abs() < 1e-9) && m.matrix3.determinant() > 0.0
    };
    assert!(scene.cameras.iter().all(|c| rigid(&c.world_from_camera)));
    assert!(scene.lights.iter().all(|l| rigid(&l.world_from_light)));
}
