//! Opaque casters of a scene, grouped into solids.

use super::{GpuScene, Mesh, Scene};
use crate::casters::{CasterMesh, Casters, VertexBuffer, Vertices};
use crate::{Context, Result};
use glam::DAffine3;
use std::collections::HashMap;
use std::sync::Arc;

/// Casters with their transforms.
#[derive(Clone, Debug)]
pub struct SceneCasters {
    /// Casters for [`Setup::casters`](field@crate::technique::Setup::casters).
    pub casters: Arc<Casters>,
    /// Transforms for [`crate::Inputs::casters`].
    pub transforms: Vec<DAffine3>,
}

/// Groups meshes into solids. A solid is the opaque parts of one glTF mesh; its instances are consecutive and have the
/// same transform.
fn groups(scene: &Scene) -> (Vec<Vec<usize>>, Vec<(usize, DAffine3)>, bool) {
    let masked = |mesh: usize| scene.materials[scene.meshes[mesh].material].alpha_cutoff.is_some();
    let (mut known, mut meshes, mut placed) = (HashMap::new(), vec![], vec![]);
    let mut has_masked = false;
    for parts in scene.instances.chunk_by(|a, b| a.mesh + 1 == b.mesh && a.world_from_object == b.world_from_object) {
        let solid: Vec<usize> = parts.iter().map(|i| i.mesh).filter(|&m| !masked(m)).collect();
        has_masked |= solid.len() < parts.len();
        if solid.is_empty() {
            continue;
        }
        let index = *known.entry(solid.clone()).or_insert_with(|| {
            meshes.push(solid);
            meshes.len() - 1
        });
        placed.push((index, parts[0].world_from_object));
    }
    (meshes, placed, has_masked)
}

impl SceneCasters {
    /// Builds the adjacency of the scene's solids. The shaders read positions from the buffers of `gpu`.
    pub fn new(context: &Context, scene: &Scene, gpu: &GpuScene) -> Result<Self> {
        let (groups, placed, masked) = groups(scene);
        let mut first_vertex = vec![0u32];
        for mesh in &scene.meshes {
            first_vertex.push(first_vertex[first_vertex.len() - 1] + mesh.positions.len() as u32);
        }
        // The parts of a group are consecutive in the vertex buffer too.
        let joined: Vec<(Vec<[f32; 3]>, Vec<u32>)> =
            groups.iter().map(|g| join(&scene.meshes, g, &first_vertex)).collect();
        let meshes: Vec<_> = (groups.iter().zip(&joined))
            .map(|(group, (positions, indices))| CasterMesh {
                name: &scene.meshes[group[0]].name,
                positions,
                indices,
                first_vertex: first_vertex[group[0]],
            })
            .collect();
        let positions = &gpu.positions;
        // SAFETY: the buffer has the needed usage, is already filled, and its owner outlives the casters.
        let vertices = Vertices::Buffer(unsafe { VertexBuffer::new(positions.handle(), positions.size(), 12) });
        let instances: Vec<_> = placed.iter().map(|p| p.0).collect();
        let casters = Arc::new(Casters::new(context, vertices, &meshes, &instances, masked)?);
        Ok(Self { casters, transforms: placed.into_iter().map(|p| p.1).collect() })
    }
}

/// Returns the positions of all meshes from the group's first to its last, and the indices of the group's own meshes.
fn join(meshes: &[Mesh], group: &[usize], first_vertex: &[u32]) -> (Vec<[f32; 3]>, Vec<u32>) {
    let last = group[group.len() - 1];
    let positions = meshes[group[0]..=last].iter().flat_map(|m| m.positions.iter().copied()).collect();
    let base = first_vertex[group[0]];
    let indices = group.iter().flat_map(|&m| {
        let offset = first_vertex[m] - base;
        meshes[m].indices.iter().map(move |i| i + offset)
    });
    (positions, indices.collect())
}
