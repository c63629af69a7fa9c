//! Scenes: what stands where (no Vulkan), how it comes from a file, and how it is rasterised.

mod model;
pub mod shipped;

pub use model::*;
