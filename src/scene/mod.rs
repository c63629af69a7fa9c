//! Scenes: their content (without Vulkan), loading them from files, and rasterising them.

mod casters;
pub mod cull;
pub mod fit;
mod gltf;
mod gpu_scene;
mod light_fit;
mod model;
mod raster;
mod renderer;
mod shade;
pub mod shipped;

pub use casters::SceneCasters;
pub use gltf::{load, load_bytes, load_scene};
pub use gpu_scene::GpuScene;
pub use light_fit::{MAX_SPOT_FOV, light_view, light_view_for, texel_in_pixels};
pub use model::*;
pub use raster::{CasterFaces, CasterOptions, GBuffer, ShadowMap};
pub use renderer::{MAX_SIZE, Moving, RenderDesc, Renderer};
pub use shade::{Shade, ShadeOptions, ShadePush};
