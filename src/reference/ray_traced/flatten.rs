//! Conversion of meshes and instances to triangles in local space.

use super::triangle::MASKED;
use crate::scene::{Bounds, Instance, Mesh, Scene};
use crate::{Error, Result};
use glam::{DAffine3, DVec3, Vec3};
use rayon::prelude::*;

/// Transform of an instance into local space. Each vertex is rounded relative to the scene's size, not to its distance
/// from the origin.
pub(super) struct Placement {
    /// Object-space point that maps to near local 0.
    pivot: DVec3,
    local_from_object: DAffine3,
}

impl Placement {
    pub fn new(instance: &Instance, center: DVec3, scale: f64) -> Self {
        let t = &instance.world_from_object;
        let determinant = t.matrix3.determinant();
        let offset = t.translation - center;
        let pivot = if determinant == 0.0 { DVec3::ZERO } else { -(t.matrix3.inverse() * offset) };
        let pivot = if pivot.is_finite() { pivot } else { DVec3::ZERO };
        let residual = t.matrix3 * pivot + offset;
        let local = DAffine3 { matrix3: t.matrix3 * (1.0 / scale), translation: residual / scale };
        Self { pivot, local_from_object: local }
    }

    pub fn apply(&self, p: [f32; 3]) -> DVec3 {
        self.local_from_object.transform_point3(Vec3::from(p).as_dvec3() - self.pivot)
    }
}

/// Returns the smallest power of two that is at least `x > 0`.
pub(super) fn power_of_two_above(x: f64) -> f64 {
    x.log2().ceil().exp2()
}

/// Returns the world-space box around all finite vertices that a triangle uses.
pub(super) fn world_bounds(scene: &Scene) -> Bounds {
    let boxes: Vec<Bounds> = scene
        .meshes
        .par_iter()
        .map(|mesh| {
            let mut bounds = Bounds::EMPTY;
            for &i in &mesh.indices {
                let p = Vec3::from(mesh.positions[i as usize]);
                if p.is_finite() {
                    bounds.include(p.as_dvec3());
                }
            }
            bounds
        })
        .collect();
    scene
        .instances
        .iter()
        .map(|i| boxes[i.mesh].transformed(&i.world_from_object))
        .filter(|b| b.min.is_finite() && b.max.is_finite())
        .fold(Bounds::EMPTY, Bounds::union)
}

/// Checks what [`Mesh`] promises and what indexing relies on.
pub(super) fn check(scene: &Scene) -> Result<()> {
    let wrong = |mesh: &Mesh, problem: String| Err(Error::Usage(format!("mesh {}: {problem}", mesh.name)));
    for mesh in &scene.meshes {
        let n = mesh.positions.len();
        if let Some(i) = mesh.indices.iter().find(|&&i| i as usize >= n) {
            return wrong(mesh, format!("index {i} into {n} positions"));
        }
        if mesh.indices.len() % 3 != 0 {
            return wrong(mesh, format!("{} indices, which is not a multiple of three", mesh.indices.len()));
        }
        let Some(material) = scene.materials.get(mesh.material) else {
            return wrong(mesh, format!("material {} of {}", mesh.material, scene.materials.len()));
        };
        if !mesh.colors.is_empty() && mesh.colors.len() != n {
            return wrong(mesh, format!("{} colours for {n} positions", mesh.colors.len()));
        }
        if material.alpha_cutoff.is_none() {
            continue;
        }
        if let Some(index) = material.texture {
            if mesh.uvs.len() != n {
                return wrong(mesh, format!("{} texture coordinates for {n} positions", mesh.uvs.len()));
            }
            let Some(texture) = scene.textures.get(index) else {
                return wrong(mesh, format!("texture {index} of {}", scene.textures.len()));
            };
            let texels = u64::from(texture.size[0]) * u64::from(texture.size[1]);
            if texels == 0 || texels != texture.rgba.len() as u64 {
                return wrong(
                    mesh,
                    format!("texture {}: {} texels for {:?} pixels", texture.name, texture.rgba.len(), texture.size),
                );
            }
        }
    }
    for (i, instance) in scene.instances.iter().enumerate() {
        if instance.mesh >= scene.meshes.len() {
            return Err(Error::Usage(format!("instance {i}: mesh {} of {}", instance.mesh, scene.meshes.len())));
        }
    }
    if scene.instances.len() >= MASKED as usize {
        return Err(Error::Usage(format!("scene {}: too many instances", scene.name)));
    }
    Ok(())
}
