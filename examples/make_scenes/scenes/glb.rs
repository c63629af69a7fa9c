//! Writes a [`Scene`] as binary glTF 2.0.
//!
//! Large meshes are quantised (`KHR_mesh_quantization`). A mesh with many instances is placed by
//! `EXT_mesh_gpu_instancing`. The light is a `KHR_lights_punctual` light with its size in `extras.edgeshade`. Equal
//! data is stored only once.

use super::texture::png;
use edgeshade::scene::{Instance, LightShape, Mesh, Projection, Scene, Texture, Wrap};
use glam::{DAffine3, DMat3, DMat4, DQuat, DVec3, Vec3};
use serde_json::{Map, Value, json};
use std::collections::BTreeMap;

/// Number of vertices above which a mesh is quantised; smaller meshes are not worth the rounding.
const QUANTIZE_ABOVE: usize = 600;
/// Number of instances from which on a mesh is instanced; fewer are written as plain nodes.
const INSTANCES_FROM: usize = 5;

const FLOAT: u32 = 5126;
const U16: u32 = 5123;
const U32: u32 = 5125;
const I8: u32 = 5120;
const VERTICES: u32 = 34962;
const INDICES: u32 = 34963;

/// Encodes the scene as a `.glb` file. The bytes are the same on every platform.
pub fn encode(scene: &Scene) -> Vec<u8> {
    let mut file = Writer::default();
    let mut meshes = Vec::new();
    let mut dequantize = Vec::new();
    for mesh in &scene.meshes {
        let (json, from_stored) = file.mesh(mesh, scene.materials[mesh.material].texture.is_some());
        meshes.push(json);
        dequantize.push(from_stored);
    }
    for (index, mesh) in scene.meshes.iter().enumerate() {
        let places: Vec<DAffine3> = scene
            .instances
            .iter()
            .filter(|i: &&Instance| i.mesh == index)
            .map(|i| i.world_from_object * dequantize[index])
            .collect();
        file.nodes_of(index, &mesh.name, &places);
    }
    for (index, camera) in scene.cameras.iter().enumerate() {
        let mut node = pose(&camera.world_from_camera);
        node.insert("camera".into(), json!(index));
        node.insert("name".into(), json!(camera.name));
        file.nodes.push(node.into());
    }
    for (index, light) in scene.lights.iter().enumerate() {
        let mut node = pose(&light.world_from_light);
        node.insert("extensions".into(), json!({ "KHR_lights_punctual": { "light": index } }));
        node.insert("name".into(), json!(light.name));
        file.nodes.push(node.into());
    }
    let images: Vec<Value> = scene.textures.iter().map(|t| file.image(t)).collect();

    let mut required = Vec::new();
    for (used, name) in [(file.instanced, "EXT_mesh_gpu_instancing"), (file.quantized, "KHR_mesh_quantization")] {
        if used {
            required.push(name);
        }
    }
    let mut used = required.clone();
    used.push("KHR_lights_punctual");
    let mut root = json!({
        "asset": { "version": "2.0", "generator": "Edgeshade" },
        "extensionsUsed": used,
        "extensions": { "KHR_lights_punctual": { "lights": lights(scene) } },
        "scene": 0,
        "scenes": [{ "name": scene.name, "nodes": (0..file.nodes.len()).collect::<Vec<_>>() }],
        "nodes": file.nodes,
        "meshes": meshes,
        "materials": materials(scene),
        "cameras": cameras(scene),
        "accessors": file.accessors,
        "bufferViews": file.views,
        "buffers": [{ "byteLength": file.bin.len() }],
    });
    // glTF does not allow empty arrays.
    if !required.is_empty() {
        root["extensionsRequired"] = json!(required);
    }
    if !images.is_empty() {
        root["images"] = json!(images);
        root["textures"] = (0..images.len()).map(|i| json!({ "source": i, "sampler": i })).collect();
        root["samplers"] = scene.textures.iter().map(sampler).collect();
    }
    // The same file whatever the order in which serde_json keeps fields.
    root.sort_all_objects();
    container(root.to_string().into_bytes(), file.bin)
}

#[derive(Default)]
struct Writer {
    bin: Vec<u8>,
    views: Vec<Value>,
    accessors: Vec<Value>,
    nodes: Vec<Value>,
    /// Indices of the accessors already stored, by accessor without its view and bytes.
    known: BTreeMap<(String, Vec<u8>), usize>,
    instanced: bool,
    quantized: bool,
}

impl Writer {
    fn view(&mut self, bytes: &[u8], stride: Option<usize>, target: Option<u32>) -> usize {
        self.bin.resize(self.bin.len().next_multiple_of(4), 0);
        let mut view = json!({ "buffer": 0, "byteOffset": self.bin.len(), "byteLength": bytes.len() });
        if let Some(stride) = stride {
            view["byteStride"] = json!(stride);
        }
        if let Some(target) = target {
            view["target"] = json!(target);
        }
        self.bin.extend_from_slice(bytes);
        self.views.push(view);
        self.views.len() - 1
    }

    fn accessor(&mut self, mut json: Value, bytes: Vec<u8>, stride: Option<usize>, target: Option<u32>) -> usize {
        let key = (json.to_string(), bytes);
        if let Some(&index) = self.known.get(&key) {
            return index;
        }
        json["bufferView"] = json!(self.view(&key.1, stride, target));
        self.accessors.push(json);
        self.known.insert(key, self.accessors.len() - 1);
        self.accessors.len() - 1
    }

    fn floats<const N: usize>(&mut self, data: &[[f32; N]], target: Option<u32>) -> usize {
        let kind = ["SCALAR", "VEC2", "VEC3", "VEC4"][N - 1];
        let json = json!({ "componentType": FLOAT, "count": data.len(), "type": kind });
        let bytes = data.iter().flatten().flat_map(|x| x.to_le_bytes()).collect();
        self.accessor(json, bytes, None, target)
    }

    /// Stores a mesh. Returns the mesh and the transform from its stored space to its own.
    fn mesh(&mut self, mesh: &Mesh, textured: bool) -> (Value, DAffine3) {
        let quantized = mesh.positions.len() > QUANTIZE_ABOVE;
        self.quantized |= quantized;
        let mut from_stored = DAffine3::IDENTITY;
        let mut corners = mesh.indices.clone();
        let mut attributes = Map::new();
        let position = if quantized {
            // The origin is a grid point, so that symmetric parts of an object still meet exactly.
            let step = (mesh.bounds.max - mesh.bounds.min).max_element() / 65534.0;
            let low = (mesh.bounds.min / step).floor() * step;
            let stored: Vec<[u16; 3]> = mesh
                .positions
                .iter()
                .map(|&p| ((Vec3::from(p).as_dvec3() - low) / step).to_array().map(|x| x.round() as u16))
                .collect();
            // Stored positions are read as 0 to 1. One scale for all axes keeps the normals right.
            from_stored = DAffine3 { matrix3: DMat3::from_diagonal(DVec3::splat(step * 65535.0)), translation: low };
            corners = distinct(&corners, &stored);
            self.positions_u16(&stored)
        } else {
            self.positions_f32(&mesh.positions)
        };
        attributes.insert("POSITION".into(), json!(position));
        let normal = if quantized {
            let bytes = mesh
                .normals
                .iter()
                .flat_map(|n| {
                    let [x, y, z] = n.map(|c| (c * 127.0).round() as i8 as u8);
                    [x, y, z, 0]
                })
                .collect();
            let json = json!({ "componentType": I8, "normalized": true, "count": mesh.normals.len(), "type": "VEC3" });
            self.accessor(json, bytes, Some(4), Some(VERTICES))
        } else {
            self.floats(&mesh.normals, Some(VERTICES))
        };
        attributes.insert("NORMAL".into(), json!(normal));
        if textured {
            let small = mesh.uvs.iter().flatten().all(|u| (0.0..=1.0).contains(u));
            let uv = if quantized && small {
                let bytes =
                    mesh.uvs.iter().flatten().flat_map(|u| ((u * 65535.0).round() as u16).to_le_bytes()).collect();
                let json = json!({ "componentType": U16, "normalized": true, "count": mesh.uvs.len(), "type": "VEC2" });
                self.accessor(json, bytes, None, Some(VERTICES))
            } else {
                self.floats(&mesh.uvs, Some(VERTICES))
            };
            attributes.insert("TEXCOORD_0".into(), json!(uv));
        }
        let (kind, bytes) = if mesh.positions.len() < 65535 {
            (U16, corners.iter().flat_map(|&i| (i as u16).to_le_bytes()).collect())
        } else {
            (U32, corners.iter().flat_map(|i| i.to_le_bytes()).collect::<Vec<u8>>())
        };
        let json = json!({ "componentType": kind, "count": corners.len(), "type": "SCALAR" });
        let indices = self.accessor(json, bytes, None, Some(INDICES));
        let primitive = json!({ "attributes": attributes, "indices": indices, "material": mesh.material });
        (json!({ "name": mesh.name, "primitives": [primitive] }), from_stored)
    }

    fn positions_u16(&mut self, stored: &[[u16; 3]]) -> usize {
        let fold = |start: u16, f: fn(u16, u16) -> u16| {
            stored.iter().fold([start; 3], |m, p| std::array::from_fn(|k| f(m[k], p[k])))
        };
        let json = json!({
            "componentType": U16, "normalized": true, "count": stored.len(), "type": "VEC3",
            "min": fold(u16::MAX, u16::min), "max": fold(0, u16::max),
        });
        let bytes = stored.iter().flat_map(|p| [p[0], p[1], p[2], 0]).flat_map(u16::to_le_bytes).collect();
        self.accessor(json, bytes, Some(8), Some(VERTICES))
    }

    fn positions_f32(&mut self, positions: &[[f32; 3]]) -> usize {
        let fold = |start: f32, f: fn(f32, f32) -> f32| {
            let m = positions.iter().fold([start; 3], |m, p| std::array::from_fn(|k| f(m[k], p[k])));
            m.map(number)
        };
        let json = json!({
            "componentType": FLOAT, "count": positions.len(), "type": "VEC3",
            "min": fold(f32::INFINITY, f32::min), "max": fold(f32::NEG_INFINITY, f32::max),
        });
        let bytes = positions.iter().flatten().flat_map(|x| x.to_le_bytes()).collect();
        self.accessor(json, bytes, None, Some(VERTICES))
    }

    fn nodes_of(&mut self, mesh: usize, name: &str, places: &[DAffine3]) {
        let parts: Vec<Option<Trs>> = places.iter().map(Trs::of).collect();
        let simple: Vec<Trs> = parts.iter().flatten().copied().collect();
        let together = simple.len() >= INSTANCES_FROM;
        for (place, trs) in places.iter().zip(&parts) {
            let mut node = match trs {
                Some(_) if together => continue,
                Some(trs) => trs.json(),
                None => {
                    let m = DMat4::from(*place).to_cols_array().map(|x| number(x as f32));
                    Map::from_iter([("matrix".to_string(), m.into_iter().collect())])
                }
            };
            node.insert("mesh".into(), json!(mesh));
            node.insert("name".into(), json!(name));
            self.nodes.push(node.into());
        }
        if together {
            self.instanced = true;
            let t: Vec<[f32; 3]> = simple.iter().map(|p| p.translation).collect();
            let r: Vec<[f32; 4]> = simple.iter().map(|p| p.rotation).collect();
            let s: Vec<[f32; 3]> = simple.iter().map(|p| p.scale).collect();
            let mut attributes = Map::new();
            attributes.insert("TRANSLATION".into(), json!(self.floats(&t, None)));
            if r.iter().any(|&r| r != UPRIGHT) {
                attributes.insert("ROTATION".into(), json!(self.floats(&r, None)));
            }
            if s.iter().any(|&s| s != [1.0; 3]) {
                attributes.insert("SCALE".into(), json!(self.floats(&s, None)));
            }
            let extension = json!({ "EXT_mesh_gpu_instancing": { "attributes": attributes } });
            self.nodes.push(json!({ "mesh": mesh, "name": name, "extensions": extension }));
        }
    }

    fn image(&mut self, texture: &Texture) -> Value {
        let view = self.view(&png(texture), None, None);
        json!({ "name": texture.name, "mimeType": "image/png", "bufferView": view })
    }
}

const UPRIGHT: [f32; 4] = [0.0, 0.0, 0.0, 1.0];

/// Translation, rotation (x, y, z, w) and scale of an affine transform without shear or mirroring.
#[derive(Clone, Copy)]
struct Trs {
    translation: [f32; 3],
    rotation: [f32; 4],
    scale: [f32; 3],
}

impl Trs {
    fn of(t: &DAffine3) -> Option<Self> {
        let m: DMat3 = t.matrix3;
        let scale = DVec3::new(m.x_axis.length(), m.y_axis.length(), m.z_axis.length());
        let r = DMat3::from_cols(m.x_axis / scale.x, m.y_axis / scale.y, m.z_axis / scale.z);
        let shear = r.x_axis.dot(r.y_axis).abs() + r.y_axis.dot(r.z_axis).abs() + r.z_axis.dot(r.x_axis).abs();
        if scale.min_element() <= 0.0 || shear > 1e-6 || r.determinant() < 0.0 {
            return None;
        }
        let mut q = DQuat::from_mat3(&r).normalize();
        // Chooses one of the two signs, so that equal rotations have equal bytes.
        if q.w < 0.0 {
            q = -q;
        }
        // `+ 0.0` turns -0 into 0.
        Some(Self {
            translation: t.translation.to_array().map(|x| x as f32 + 0.0),
            rotation: q.to_array().map(|x| x as f32 + 0.0),
            scale: scale.to_array().map(|x| if (x - 1.0).abs() < 1e-9 { 1.0 } else { x as f32 }),
        })
    }

    fn json(&self) -> Map<String, Value> {
        let mut out = Map::new();
        if self.translation != [0.0; 3] {
            out.insert("translation".into(), self.translation.map(number).into_iter().collect());
        }
        if self.rotation != UPRIGHT {
            out.insert("rotation".into(), self.rotation.map(number).into_iter().collect());
        }
        if self.scale != [1.0; 3] {
            out.insert("scale".into(), self.scale.map(number).into_iter().collect());
        }
        out
    }
}

fn pose(rigid: &DAffine3) -> Map<String, Value> {
    Trs::of(rigid).map(|t| t.json()).unwrap_or_default()
}

/// Shortest decimal number that reads back as the same `f32`.
fn number(x: f32) -> Value {
    (x + 0.0).to_string().parse::<f64>().map_or(Value::Null, |x| json!(x))
}

/// Triangles whose corners are still three different points.
fn distinct(indices: &[u32], points: &[[u16; 3]]) -> Vec<u32> {
    let mut out = Vec::with_capacity(indices.len());
    for t in indices.chunks_exact(3) {
        let [a, b, c] = [t[0], t[1], t[2]].map(|i| points[i as usize]);
        if a != b && b != c && c != a {
            out.extend_from_slice(t);
        }
    }
    out
}

fn materials(scene: &Scene) -> Vec<Value> {
    let one = |m: &edgeshade::scene::Material| {
        let mut pbr = json!({
            "baseColorFactor": m.base_color.map(number),
            "metallicFactor": 0.0,
            "roughnessFactor": 0.9,
        });
        if let Some(texture) = m.texture {
            pbr["baseColorTexture"] = json!({ "index": texture });
        }
        let mut out = json!({ "name": m.name, "pbrMetallicRoughness": pbr });
        if let Some(cutoff) = m.alpha_cutoff {
            out["alphaMode"] = json!("MASK");
            out["alphaCutoff"] = number(cutoff);
        }
        if m.double_sided {
            out["doubleSided"] = json!(true);
        }
        out
    };
    scene.materials.iter().map(one).collect()
}

fn sampler(texture: &Texture) -> Value {
    let wrap = |w: Wrap| match w {
        Wrap::Repeat => 10497,
        Wrap::MirroredRepeat => 33648,
        Wrap::ClampToEdge => 33071,
    };
    // Magnification linear or nearest; minification linear with mip maps.
    let magnify = if texture.nearest { 9728 } else { 9729 };
    json!({ "magFilter": magnify, "minFilter": 9987, "wrapS": wrap(texture.wrap[0]), "wrapT": wrap(texture.wrap[1]) })
}

fn cameras(scene: &Scene) -> Vec<Value> {
    let one = |c: &edgeshade::scene::Camera| match c.projection {
        Projection::Perspective { fov_y, near } => json!({
            "type": "perspective",
            "perspective": { "yfov": number(fov_y as f32), "znear": number(near as f32) },
        }),
        // The aspect ratio is that of the image, but the file must name one.
        Projection::Orthographic { half_height, near, far } => json!({
            "type": "orthographic",
            "orthographic": {
                "xmag": number(half_height as f32), "ymag": number(half_height as f32),
                "znear": number(near as f32), "zfar": number(far as f32),
            },
        }),
    };
    scene.cameras.iter().map(one).collect()
}

fn lights(scene: &Scene) -> Vec<Value> {
    let center = scene.bounds().center();
    let one = |l: &edgeshade::scene::Light| {
        let mut out = json!({ "name": l.name, "color": l.color.map(number) });
        match l.shape {
            LightShape::Spot { outer, size } => {
                out["type"] = json!("spot");
                out["spot"] = json!({
                    "innerConeAngle": number((0.9 * outer) as f32), "outerConeAngle": number(outer as f32),
                });
                // Intensity in candela that lights the middle of the scene about as brightly as the suns do.
                let distance = l.world_from_light.translation.distance_squared(center);
                out["intensity"] = json!((3.0 * distance).round());
                out["extras"] = size.map_or(json!({}), |s| json!({ "edgeshade": { "size": number(s as f32) } }));
            }
            LightShape::Directional { angle } => {
                out["type"] = json!("directional");
                out["intensity"] = json!(3.0);
                out["extras"] = angle.map_or(json!({}), |a| json!({ "edgeshade": { "angle": number(a as f32) } }));
            }
        }
        out
    };
    scene.lights.iter().map(one).collect()
}

/// Joins header and the two chunks, padded to four bytes as the format requires.
fn container(mut json: Vec<u8>, mut bin: Vec<u8>) -> Vec<u8> {
    json.resize(json.len().next_multiple_of(4), b' ');
    bin.resize(bin.len().next_multiple_of(4), 0);
    let mut out = Vec::with_capacity(28 + json.len() + bin.len());
    out.extend_from_slice(b"glTF");
    out.extend_from_slice(&2u32.to_le_bytes());
    out.extend_from_slice(&(28 + json.len() as u32 + bin.len() as u32).to_le_bytes());
    for (kind, chunk) in [(b"JSON", &json), (b"BIN\0", &bin)] {
        out.extend_from_slice(&(chunk.len() as u32).to_le_bytes());
        out.extend_from_slice(kind);
        out.extend_from_slice(chunk);
    }
    out
}
