//! Geometry of the casters, for the techniques that use it.

mod gpu;
pub mod topology;

#[cfg(test)]
pub(crate) mod shapes;

pub use gpu::{CHUNK, CasterCounts, CasterInstance, CasterMesh, Casters, VertexBuffer, Vertices};
