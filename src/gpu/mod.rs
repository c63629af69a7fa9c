//! Vulkan objects with owners: images, buffers, pipelines, and what the shaders say of themselves.

mod buffer;
mod device;
mod image;
mod pipeline;
mod reflect;
mod shader_struct;

pub use buffer::{Buffer, BufferDesc, MemoryKind};
pub use device::Device;
#[cfg(feature = "app")]
pub(crate) use image::aspect;
pub(crate) use image::full_aspect;
pub use image::{Image, ImageDesc};
pub use pipeline::{ComputePipeline, RasterPipeline, RasterState};
pub use reflect::{Binding, Block, Member, Reflection, ResourceAccess, ResourceKind};
pub use shader_struct::ShaderStruct;
pub(crate) use shader_struct::shader_struct;
