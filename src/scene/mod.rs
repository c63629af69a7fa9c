//! Scenes: what stands where (no Vulkan), how it comes from a file, and how it is rasterised.

pub mod fit;
mod gltf;
mod model;

pub use gltf::{load, load_bytes, load_scene};
pub use model::*;
