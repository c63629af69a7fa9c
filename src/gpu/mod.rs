//! Vulkan objects with owners: images, buffers, pipelines, and what reflection finds in the shaders.

mod bind;
mod buffer;
mod device;
mod image;
mod image_ref;
mod interface;
mod pipeline;
mod raster_pipeline;
mod recorded;
mod reflect;
mod shader_struct;

pub(crate) use bind::bindings;
pub use bind::{Bind, Bindings, Declared};
pub use buffer::{Buffer, BufferDesc, MemoryKind};
pub use device::{ContextDesc, Device};
#[cfg(feature = "app")]
pub(crate) use image::aspect;
pub use image::{Image, ImageDesc};
pub(crate) use image::{full_aspect, has_stencil};
pub use image_ref::ImageRef;
pub use interface::Constant;
pub(crate) use interface::{Interface, Slot};
pub use pipeline::ComputePipeline;
pub use raster_pipeline::{Blend, DepthState, RasterPipeline, RasterState, StencilFace, StencilState};
pub(crate) use recorded::Recorded;
pub use reflect::{Binding, Block, Member, Reflection, ResourceAccess, ResourceKind};
pub use shader_struct::ShaderStruct;
pub(crate) use shader_struct::shader_struct;
