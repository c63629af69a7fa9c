//! Materials: base colour, its texture, and the holes of an alpha mask.

use super::document::Document;
use super::fault::{Fault, Loaded, Warnings, fault, label};
use super::image::{self, Use};
use crate::scene::{Material, Texture};
use gltf::json;
use gltf::json::material::AlphaMode;
use gltf::json::texture::Info;
use gltf::json::validation::Checked;
use serde::Deserialize;
use std::collections::HashMap;

/// Diffuse part of `KHR_materials_pbrSpecularGlossiness`, which replaces the base colour.
#[derive(Deserialize)]
#[serde(default, rename_all = "camelCase")]
struct SpecularGlossiness {
    diffuse_factor: [f32; 4],
    diffuse_texture: Option<Info>,
}

impl Default for SpecularGlossiness {
    fn default() -> Self {
        Self { diffuse_factor: [1.0; 4], diffuse_texture: None }
    }
}

/// Texture coordinates that the base colour reads, and their affine map.
#[derive(Clone, Copy, Debug)]
pub struct UvMap {
    /// Number of the coordinate set: `TEXCOORD_<set>`.
    pub set: u32,
    /// Rows of a 2 x 3 matrix; `None` for the identity.
    pub matrix: Option<[[f32; 3]; 2]>,
}

/// Returns base-colour factor and texture.
fn base_color(material: &json::Material, index: usize) -> Loaded<([f32; 4], Option<Info>)> {
    let extension = material.extensions.as_ref().and_then(|e| e.others.get("KHR_materials_pbrSpecularGlossiness"));
    if let Some(value) = extension {
        let place = || format!("materials[{index}].extensions.KHR_materials_pbrSpecularGlossiness");
        let diffuse = SpecularGlossiness::deserialize(value).map_err(|e| fault(place(), e.to_string()))?;
        return Ok((diffuse.diffuse_factor, diffuse.diffuse_texture));
    }
    let pbr = &material.pbr_metallic_roughness;
    Ok((pbr.base_color_factor.0, pbr.base_color_texture.clone()))
}

/// Returns whether a material is transparent all over: blended with an alpha below one half and no texture, or with an
/// untextured transmission of one half or more.
pub fn is_glass(material: &json::Material) -> bool {
    let Ok((color, texture)) = base_color(material, 0) else { return false };
    let blended = material.alpha_mode == Checked::Valid(AlphaMode::Blend) && texture.is_none() && color[3] < 0.5;
    blended || transmission(material).is_some_and(|(factor, textured)| factor >= 0.5 && !textured)
}

/// Returns the fraction of light that `KHR_materials_transmission` lets through, and whether a texture modulates it;
/// `None` if nothing passes.
fn transmission(material: &json::Material) -> Option<(f64, bool)> {
    let extension = material.extensions.as_ref()?.others.get("KHR_materials_transmission")?;
    let factor = extension.get("transmissionFactor").and_then(serde_json::Value::as_f64).unwrap_or(0.0);
    (factor > 0.0).then(|| (factor, extension.get("transmissionTexture").is_some()))
}

/// Returns how the base-colour texture of a material reads its coordinates; `None` without a texture.
pub fn uv_map(document: &Document, index: usize) -> Loaded<Option<UvMap>> {
    let (_, Some(texture)) = base_color(&document.materials[index], index)? else { return Ok(None) };
    let transform = texture.extensions.and_then(|e| e.texture_transform);
    let Some(t) = transform else { return Ok(Some(UvMap { set: texture.tex_coord, matrix: None })) };
    let (sin, cos) = t.rotation.0.sin_cos();
    let ([sx, sy], [ox, oy]) = (t.scale.0, t.offset.0);
    // The rotation is counter-clockwise on the image, whose v axis points down.
    let matrix = [[cos * sx, sin * sy, ox], [-sin * sx, cos * sy, oy]];
    if matrix.iter().flatten().any(|v| !v.is_finite()) {
        return Err(fault(format!("materials[{index}]"), "KHR_texture_transform is not finite"));
    }
    Ok(Some(UvMap { set: t.tex_coord.unwrap_or(texture.tex_coord), matrix: Some(matrix) }))
}

/// Returns the materials listed in `used`, in that order, and the textures that they need.
pub fn materials(document: &Document, used: &[usize], warnings: &mut Warnings) -> Loaded<(Vec<Material>, Vec<Use>)> {
    let mut uses: Vec<Use> = Vec::new();
    let mut known: HashMap<Use, usize> = HashMap::new();
    let mut materials = Vec::with_capacity(used.len());
    for &index in used {
        let material = &document.materials[index];
        let place = || label("materials", index, material.name.as_deref());
        let (factor, info) = base_color(material, index)?;
        let masked = material.alpha_mode == Checked::Valid(AlphaMode::Mask);
        let wanted = info.map(|i| image::of_texture(document, i.index.value(), || format!("materials[{index}]")));
        let wanted = match wanted.transpose()? {
            Some(Err(fault)) if masked => return Err(fault),
            Some(Err(fault)) => {
                without_texture(fault, warnings);
                None
            }
            Some(Ok(wanted)) => Some(wanted),
            None => None,
        };
        let texture = wanted.map(|wanted| {
            *known.entry(wanted).or_insert_with(|| {
                uses.push(wanted);
                uses.len() - 1
            })
        });
        if transmission(material).is_some() {
            warnings.add("light that passes through it is not drawn: it casts a full shadow", 1, place);
        }
        let alpha_cutoff = match material.alpha_mode {
            Checked::Valid(AlphaMode::Opaque) => None,
            // Above 1 everything is a hole, at 0 nothing is; 2 is as good as infinity.
            Checked::Valid(AlphaMode::Mask) => Some(material.alpha_cutoff.unwrap_or_default().0.clamp(0.0, 2.0)),
            Checked::Valid(AlphaMode::Blend) => {
                warnings.add("alpha mode BLEND is drawn as opaque, and casts a full shadow", 1, place);
                None
            }
            Checked::Invalid => return Err(fault(place(), "alphaMode must be OPAQUE, MASK or BLEND")),
        };
        materials.push(Material {
            name: material.name.clone().unwrap_or_else(|| format!("material {index}")),
            base_color: factor.map(|c| c.clamp(0.0, 1.0)),
            texture,
            alpha_cutoff,
            double_sided: material.double_sided,
        });
    }
    Ok((materials, uses))
}

/// Warns that a surface is drawn without a texture that cannot be read. Only a mask's texture changes shadows.
fn without_texture(fault: Fault, warnings: &mut Warnings) {
    let (where_, problem) = fault.into_parts();
    warnings.add(format!("{problem}. It only colours surfaces, which are drawn without it"), 1, || where_);
}

/// Assigns every material its texture. If an image cannot be read, a surface without holes is drawn without it.
///
/// # Errors
/// Fails if a material needs the texture for its holes.
pub fn set_textures(
    materials: &mut [Material],
    textures: Vec<Loaded<Texture>>,
    warnings: &mut Warnings,
) -> Loaded<Vec<Texture>> {
    let (mut kept, mut slots) = (vec![], vec![]);
    for (i, texture) in textures.into_iter().enumerate() {
        match texture {
            Ok(texture) => {
                slots.push(Some(kept.len()));
                kept.push(texture);
            }
            Err(fault) => {
                if materials.iter().any(|m| m.texture == Some(i) && m.alpha_cutoff.is_some()) {
                    return Err(fault);
                }
                slots.push(None);
                without_texture(fault, warnings);
            }
        }
    }
    for material in materials {
        material.texture = material.texture.and_then(|t| slots[t]);
    }
    Ok(kept)
}

/// Returns the material that glTF specifies for a primitive without one.
pub fn unspecified() -> Material {
    Material { name: "unspecified".into(), base_color: [1.0; 4], ..Material::default() }
}
