//! The geometry that casts: what techniques that know it work from.

mod gpu;
pub mod topology;

#[cfg(test)]
pub(crate) mod shapes;

pub use gpu::{CHUNK, CasterCounts, CasterInstance, CasterMesh, Casters, VertexBuffer, Vertices};
