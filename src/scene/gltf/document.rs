//! JSON of a glTF file, parsed and checked as far as possible without binary data.
//!
//! Most objects are those of the `gltf` crate. Nodes and scenes are defined here, because the crate rounds their
//! transforms to `f32`, which is too coarse for a scene far from the origin, and requires `scenes[i].nodes`, which
//! glTF makes optional. Animations are not read, so a file is not rejected because of one.

use super::fault::{Fault, Loaded, fault};
use gltf::json;
use serde::Deserialize;
use serde::de::{DeserializeSeed, Deserializer, IgnoredAny, MapAccess, SeqAccess, Visitor};
use std::fmt;

/// Root object.
#[derive(Debug, Default, Deserialize)]
#[serde(default, rename_all = "camelCase")]
pub struct Document {
    pub asset: Option<json::Asset>,
    pub accessors: Vec<json::Accessor>,
    pub buffers: Vec<json::Buffer>,
    pub buffer_views: Vec<json::buffer::View>,
    pub cameras: Vec<json::Camera>,
    pub images: Vec<json::Image>,
    pub materials: Vec<json::Material>,
    pub meshes: Vec<json::Mesh>,
    pub nodes: Vec<Node>,
    pub samplers: Vec<json::texture::Sampler>,
    pub scene: Option<usize>,
    pub scenes: Vec<SceneEntry>,
    pub skins: Vec<json::Skin>,
    pub textures: Vec<json::Texture>,
    pub extensions_required: Vec<String>,
    pub extensions_used: Vec<String>,
    pub extensions: Option<json::extensions::Root>,
}

/// Entry of `nodes`.
#[derive(Debug, Default, Deserialize)]
#[serde(default)]
pub struct Node {
    pub name: Option<String>,
    pub children: Vec<usize>,
    pub mesh: Option<usize>,
    pub skin: Option<usize>,
    pub camera: Option<usize>,
    pub matrix: Option<[f64; 16]>,
    pub translation: Option<[f64; 3]>,
    pub rotation: Option<[f64; 4]>,
    pub scale: Option<[f64; 3]>,
    pub weights: Option<Vec<f32>>,
    pub extensions: Option<json::extensions::scene::Node>,
    pub extras: json::Extras,
}

/// Entry of `scenes`.
#[derive(Debug, Default, Deserialize)]
#[serde(default)]
pub struct SceneEntry {
    pub nodes: Vec<usize>,
}

/// Extensions that a file may require, besides those that change only a surface's appearance.
const SUPPORTED: [&str; 6] = [
    "EXT_mesh_gpu_instancing",
    "KHR_lights_punctual",
    "KHR_mesh_quantization",
    "KHR_node_visibility",
    "KHR_texture_transform",
    "KHR_materials_*",
];

/// Further extensions that change nothing here. They concern animation, texture encodings (checked where a texture is
/// read), or metadata.
const HARMLESS: [&str; 11] = [
    "EXT_texture_avif",
    "EXT_texture_webp",
    "FB_ngon_encoding",
    "KHR_animation_pointer",
    "KHR_node_hoverability",
    "KHR_node_selectability",
    "KHR_texture_basisu",
    "KHR_xmp",
    "KHR_xmp_json_ld",
    "KHR_draco_mesh_compression",
    "MSFT_texture_dds",
];

fn is_supported(extension: &str) -> bool {
    SUPPORTED.contains(&extension) || extension.starts_with("KHR_materials_")
}

impl Document {
    /// Parses the JSON. Rejects other versions of glTF and required extensions that are not supported.
    pub fn parse(text: &[u8]) -> Loaded<Self> {
        let document: Self = match serde_json::from_slice(text) {
            Ok(document) => document,
            Err(error) => {
                // glTF 1.0 has objects where 2.0 has arrays, so its version is found only here.
                #[derive(Deserialize)]
                struct Version {
                    asset: Option<json::Asset>,
                }
                if let Ok(Version { asset: Some(asset) }) = serde_json::from_slice(text) {
                    check_version(&asset)?;
                }
                return Err(locate(text, &error));
            }
        };
        match &document.asset {
            Some(asset) => check_version(asset)?,
            None => return Err(fault("asset", "is missing, so this is not a glTF 2.0 file")),
        }
        let mut check = serde_json::Deserializer::from_slice(text);
        BigIndex { key: "" }.deserialize(&mut check).map_err(|e| fault("JSON", e.to_string()))?;
        for (i, extension) in document.extensions_required.iter().enumerate() {
            if !is_supported(extension) {
                let problem = format!(
                    "the file cannot be read without {extension}, which is not supported; export it without that extension (supported: {})",
                    SUPPORTED.join(", ")
                );
                return Err(fault(format!("extensionsRequired[{i}]"), problem));
            }
        }
        Ok(document)
    }

    /// Returns the extensions that the file uses and that are not read.
    pub fn unread_extensions(&self) -> impl Iterator<Item = &str> {
        let used = self.extensions_used.iter().map(String::as_str);
        used.filter(|e| !is_supported(e) && !HARMLESS.contains(e))
    }

    /// Returns the lights of `KHR_lights_punctual`.
    pub fn lights(&self) -> &[json::extensions::scene::khr_lights_punctual::Light] {
        let lights = self.extensions.as_ref().and_then(|e| e.khr_lights_punctual.as_ref());
        lights.map_or(&[], |l| &l.lights)
    }
}

fn check_version(asset: &json::Asset) -> Loaded<()> {
    // A 2.0 reader may read a 2.x file that needs only 2.0.
    let needed = asset.min_version.as_ref().unwrap_or(&asset.version);
    if asset.version.starts_with("2.") && (asset.min_version.is_none() || needed == "2.0") {
        return Ok(());
    }
    let problem = format!("is glTF {needed}, but only glTF 2.0 is read; convert the file to glTF 2.0");
    Err(fault("asset.version", problem))
}

/// Finds the object that does not parse; the parser itself knows only line and column.
fn locate(text: &[u8], error: &serde_json::Error) -> Fault {
    use serde_json::{Value, from_slice};
    fn first<'a, T: Deserialize<'a>>(root: &'a Value, key: &str) -> Option<(String, String)> {
        let list = match root.get(key)? {
            Value::Array(list) => list,
            _ => return Some((key.into(), "must be an array".into())),
        };
        let bad = |(i, v)| T::deserialize(v).err().map(|e: serde_json::Error| (format!("{key}[{i}]"), e.to_string()));
        list.iter().enumerate().find_map(bad)
    }
    let found = from_slice::<Value>(text).ok().and_then(|root| {
        first::<json::Accessor>(&root, "accessors")
            .or_else(|| first::<json::Buffer>(&root, "buffers"))
            .or_else(|| first::<json::buffer::View>(&root, "bufferViews"))
            .or_else(|| first::<json::Camera>(&root, "cameras"))
            .or_else(|| first::<json::Image>(&root, "images"))
            .or_else(|| first::<json::Material>(&root, "materials"))
            .or_else(|| first::<json::Mesh>(&root, "meshes"))
            .or_else(|| first::<Node>(&root, "nodes"))
            .or_else(|| first::<json::texture::Sampler>(&root, "samplers"))
            .or_else(|| first::<SceneEntry>(&root, "scenes"))
            .or_else(|| first::<json::Skin>(&root, "skins"))
            .or_else(|| first::<json::Texture>(&root, "textures"))
    });
    match found {
        Some((place, problem)) => fault(place, problem),
        None if error.is_eof() => fault("JSON", format!("{error}: the file is cut short; copy or export it again")),
        None => fault("JSON", error.to_string()),
    }
}

/// Visitor that rejects indices of 2^32 or more. The `gltf` crate would truncate them to 32 bits and use another
/// object.
#[derive(Clone, Copy)]
struct BigIndex<'k> {
    key: &'k str,
}

/// Members that hold an index or the code of an enumeration.
const INDEX_KEYS: [&str; 18] = [
    "attributes",
    "targets",
    "buffer",
    "bufferView",
    "camera",
    "componentType",
    "index",
    "indices",
    "inverseBindMatrices",
    "joints",
    "light",
    "magFilter",
    "material",
    "mode",
    "sampler",
    "source",
    "wrapS",
    "wrapT",
];

impl<'de> DeserializeSeed<'de> for BigIndex<'_> {
    type Value = ();
    fn deserialize<D: Deserializer<'de>>(self, deserializer: D) -> Result<(), D::Error> {
        deserializer.deserialize_any(self)
    }
}

impl<'de> Visitor<'de> for BigIndex<'_> {
    type Value = ();

    fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("JSON")
    }

    fn visit_u64<E: serde::de::Error>(self, value: u64) -> Result<(), E> {
        if value > u64::from(u32::MAX) && INDEX_KEYS.contains(&self.key) {
            return Err(E::custom(format!("{}: {value} is out of range", self.key)));
        }
        Ok(())
    }

    fn visit_map<A: MapAccess<'de>>(self, mut map: A) -> Result<(), A::Error> {
        while let Some(key) = map.next_key::<std::borrow::Cow<'_, str>>()? {
            match &*key {
                "extras" => drop(map.next_value::<IgnoredAny>()?),
                // Below these, the members are semantics, and every number is an index.
                _ if matches!(self.key, "attributes" | "targets") => map.next_value_seed(self)?,
                key => map.next_value_seed(BigIndex { key })?,
            }
        }
        Ok(())
    }

    fn visit_seq<A: SeqAccess<'de>>(self, mut seq: A) -> Result<(), A::Error> {
        while seq.next_element_seed(self)?.is_some() {}
        Ok(())
    }

    fn visit_bool<E>(self, _: bool) -> Result<(), E> {
        Ok(())
    }
    fn visit_i64<E>(self, _: i64) -> Result<(), E> {
        Ok(())
    }
    fn visit_f64<E>(self, _: f64) -> Result<(), E> {
        Ok(())
    }
    fn visit_str<E>(self, _: &str) -> Result<(), E> {
        Ok(())
    }
    fn visit_unit<E>(self) -> Result<(), E> {
        Ok(())
    }
}
