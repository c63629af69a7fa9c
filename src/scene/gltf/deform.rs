//! Morph targets and skins, applied once: the scene keeps the pose of the file.

use super::accessor::Data;
use super::fault::{Loaded, entry, fault};
use super::node::{Tree, node_label};
use crate::scene::cull::normal_matrix;
use glam::{DAffine3, DMat3, DMat4, DVec3};
use gltf::json::mesh::{Primitive, Semantic};
use gltf::json::validation::Checked;

/// Adds the morph targets' weighted displacements.
pub fn morph(
    data: &Data<'_>,
    primitive: &Primitive,
    weights: &[f32],
    place: &str,
    positions: &mut [[f32; 3]],
    normals: Option<&mut Vec<[f32; 3]>>,
) -> Loaded<()> {
    let mut normals = normals;
    for (t, (target, &weight)) in primitive.targets.iter().flatten().zip(weights).enumerate() {
        if weight == 0.0 {
            continue;
        }
        let place = |name: &str| format!("{place}.targets[{t}].{name}");
        if let Some(accessor) = target.positions {
            add(data, accessor.value(), weight, positions, || place("POSITION"))?;
        }
        if let (Some(accessor), Some(normals)) = (target.normals, normals.as_deref_mut()) {
            add(data, accessor.value(), weight, normals, || place("NORMAL"))?;
        }
    }
    Ok(())
}

fn add(data: &Data<'_>, accessor: usize, weight: f32, to: &mut [[f32; 3]], place: impl Fn() -> String) -> Loaded<()> {
    let change = data.floats::<3>(accessor, &place)?;
    if change.len() != to.len() {
        return Err(fault(place(), format!("has {} elements, but there are {} vertices", change.len(), to.len())));
    }
    for (v, d) in to.iter_mut().zip(change) {
        for (v, d) in v.iter_mut().zip(d) {
            *v += weight * d;
        }
    }
    Ok(())
}

/// Joint matrices of a skin. They are relative to `world_from_object`, so that a figure far from the origin keeps its
/// precision in `f32`.
#[derive(Debug)]
pub struct Palette {
    /// Transform that places the deformed mesh in the world.
    pub world_from_object: DAffine3,
    /// Transforms from the mesh's own space to object space, one per joint.
    matrices: Vec<DAffine3>,
}

/// Returns the joint matrices of a skin.
pub fn palette(data: &Data<'_>, tree: &Tree, index: usize) -> Loaded<Palette> {
    let skin = &data.document.skins[index];
    let mut joints = Vec::with_capacity(skin.joints.len());
    for (k, joint) in skin.joints.iter().enumerate() {
        joints.push(*entry(&tree.worlds, "nodes", joint.value(), || format!("skins[{index}].joints[{k}]"))?);
    }
    let Some(first) = joints.first() else {
        return Err(fault(format!("skins[{index}].joints"), "is empty, but a skin needs at least one joint"));
    };
    let world_from_object = DAffine3::from_translation(first.translation);
    let place = || format!("skins[{index}].inverseBindMatrices");
    let binds = match skin.inverse_bind_matrices {
        Some(accessor) => data.floats::<16>(accessor.value(), place)?,
        None => vec![DMat4::IDENTITY.as_mat4().to_cols_array(); joints.len()],
    };
    if binds.len() < joints.len() {
        return Err(fault(place(), format!("has {} matrices for {} joints", binds.len(), joints.len())));
    }
    let matrix = |(k, (world, bind)): (usize, (&DAffine3, &[f32; 16]))| {
        let relative = DAffine3 { translation: world.translation - first.translation, ..*world };
        let matrix = relative * DAffine3::from_mat4(DMat4::from_cols_array(&bind.map(f64::from)));
        if matrix.is_finite() {
            return Ok(matrix);
        }
        let joint = node_label(data.document, skin.joints[k].value());
        Err(fault(place(), format!("has a matrix that is not finite, for {joint}")))
    };
    let matrices = joints.iter().zip(&binds).enumerate().map(matrix).collect::<Loaded<_>>()?;
    Ok(Palette { world_from_object, matrices })
}

impl Palette {
    /// Returns whether the joints mirror the mesh, which turns front faces into back faces.
    pub fn mirrors(&self) -> bool {
        self.matrices.iter().map(|m| m.matrix3.determinant().signum()).sum::<f64>() < 0.0
    }
}

/// Deforms positions and normals by linear blend skinning.
pub fn skin(
    data: &Data<'_>,
    primitive: &Primitive,
    palette: &Palette,
    place: &str,
    positions: &mut [[f32; 3]],
    normals: Option<&mut Vec<[f32; 3]>>,
) -> Loaded<()> {
    let zero = DAffine3 { matrix3: DMat3::ZERO, translation: DVec3::ZERO };
    let mut blended = vec![(zero, 0.0_f64); positions.len()];
    for set in 0.. {
        let attribute = |semantic| primitive.attributes.get(&Checked::Valid(semantic)).map(|a| a.value());
        let Some(joints) = attribute(Semantic::Joints(set)) else { break };
        let place = |name: &str| format!("{place}.attributes.{name}_{set}");
        let Some(weights) = attribute(Semantic::Weights(set)) else {
            return Err(fault(place("WEIGHTS"), format!("is missing, but there is JOINTS_{set}")));
        };
        let joints = data.integers::<4>(joints, || place("JOINTS"))?;
        let weights = data.floats::<4>(weights, || place("WEIGHTS"))?;
        if joints.len() != positions.len() || weights.len() != positions.len() {
            let problem =
                format!("has {} or {} elements for {} vertices", joints.len(), weights.len(), positions.len());
            return Err(fault(place("JOINTS"), problem));
        }
        for ((blend, joints), weights) in blended.iter_mut().zip(&joints).zip(&weights) {
            for (&joint, &weight) in joints.iter().zip(weights) {
                // This also skips NaN.
                if !(weight > 0.0 && weight.is_finite()) {
                    continue;
                }
                let matrix = entry(&palette.matrices, "joints in its skin", joint as usize, || place("JOINTS"))?;
                let weight = f64::from(weight);
                blend.0.matrix3 += matrix.matrix3 * weight;
                blend.0.translation += matrix.translation * weight;
                blend.1 += weight;
            }
        }
    }
    // Exporters round, so the weights of a vertex rarely add up to 1. A vertex without weights follows the first
    // joint.
    let blended = blended.into_iter().map(|(m, total)| {
        if total > 0.0 {
            DAffine3 { matrix3: m.matrix3 * total.recip(), translation: m.translation / total }
        } else {
            palette.matrices[0]
        }
    });
    let mut normals = normals.map(|n| n.iter_mut());
    for (position, matrix) in positions.iter_mut().zip(blended) {
        *position = matrix.transform_point3(DVec3::from(position.map(f64::from))).as_vec3().into();
        if let Some(normal) = normals.as_mut().and_then(Iterator::next) {
            let bent = normal_matrix(&matrix.matrix3) * DVec3::from(normal.map(f64::from));
            *normal = (bent / bent.abs().max_element()).as_vec3().into();
        }
    }
    Ok(())
}
