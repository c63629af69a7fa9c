//! Real-time shadows for Vulkan with sharp and smooth edges, recorded into *your* command buffer.
//!
//! You bring a device, a depth buffer and a shadow map; Edgeshade records compute passes that leave a
//! visibility image, 1 lit and 0 in shadow. It creates no queue, submits nothing, waits for nothing, and
//! allocates only when you prepare a technique.
//!
//! ```no_run
//! # use edgeshade::*;
//! # fn example(
//! #     instance: &ash::Instance, physical_device: ash::vk::PhysicalDevice, device: &ash::Device,
//! #     cmd: ash::vk::CommandBuffer, camera: view::CameraView, light: view::LightView,
//! #     depth: ImageRef, shadow_map: ImageRef,
//! # ) -> Result<()> {
//! // Once a device, made with what `requirements()` lists.
//! let context = unsafe {
//!     Context::new(&ContextDesc {
//!         instance,
//!         physical_device,
//!         device,
//!         features: DeviceFeatures::default(), // what the device was made with beyond that
//!         debug_utils: false,
//!         allocator: None,
//!         pipeline_cache: ash::vk::PipelineCache::null(),
//!         keep_alive: None,
//!     })?
//! };
//! // Once a size. Parameters are named values from the technique's table; `edgeshade list` prints it.
//! let setup = technique::Setup {
//!     extent: [1920, 1080],
//!     map_size: [1024, 1024],
//!     output: technique::OutputFormat::R8,
//!     params: technique::Params::parse(technique::find("pcf")?, [("width", "5")])?,
//!     intermediates: false,
//!     casters: None,
//! };
//! let mut shadows = technique::prepare("pcf", &context, &setup)?;
//! // Every frame, outside a render pass, after the barrier that makes your images readable by compute shaders.
//! let mut frame = unsafe { Frame::begin(&context, cmd, Handoff::FRAGMENT_SAMPLED, None) };
//! shadows.record(
//!     &mut frame,
//!     &Inputs {
//!         camera: &camera,
//!         depth,
//!         normal: None,
//!         shadow_map,
//!         light: &[light],
//!         light_version: None,
//!         casters: &[],
//!     },
//! )?;
//! // Leaves the image as the hand-off says: here, for a fragment shader, in SHADER_READ_ONLY_OPTIMAL.
//! let visibility = frame.finish(shadows.output());
//! let view = visibility.view; // bind this, in visibility.layout
//! # Ok(())
//! # }
//! ```
//!
//! `examples/embed` is a whole small engine of its own around these calls, with two frames in flight.
//!
//! # The contract
//!
//! * **Inputs** are read in the layouts that you state, and left in them. Make them visible to
//!   compute-shader reads before the technique, and do not write them before it has run.
//! * **The output** belongs to the technique and is reused every frame. [`Handoff`] says how you read it;
//!   the library emits that barrier, and in the next frame waits for those reads before it writes again.
//! * **Frames in flight**: any number on one queue, submitted in the order of their recording. A technique, a
//!   [`Context`] or [`timing::Timings`] may be dropped once the GPU is done with all frames that used it.
//! * **Descriptors** are pushed, so there is no pool to size; everything has a debug name, and every pass a
//!   label and, if you hand in [`timing::Timings`], a pair of timestamps.
//! * **Precision**: hand in your matrices in `f64`. They are composed relative to the camera before they
//!   are rounded, so a scene a million units from the origin keeps its shadows.
//! * **Skipping**: what no pixel needs is not done. Techniques that skip have a parameter that turns it off, and the
//!   same image either way.
//!
//! # Features
//!
//! The bare library (`default-features = false`) depends on `ash`, `gpu-allocator`, `glam`, `bytemuck` and
//! `thiserror`. The feature `app`, on by default, adds scenes, the CPU reference, metrics and the command-line
//! tool; `shaderc` compiles the shaders at build time instead of taking the committed SPIR-V.
#![warn(missing_docs)]

pub mod casters;
mod context;
mod device_features;
pub mod error;
mod frame;
pub mod gpu;
mod hazard;
#[cfg(feature = "app")]
pub mod host;
mod inputs;
#[cfg(feature = "app")]
pub mod metrics;
pub mod pass;
#[cfg(feature = "app")]
pub mod picture;
#[cfg(feature = "app")]
pub mod reference;
#[cfg(feature = "app")]
pub mod scene;
pub mod shaders;
#[cfg(feature = "app")]
pub mod table;
pub mod technique;
pub mod timing;
pub mod view;

pub use context::{Context, ContextDesc, Requirements, requirements};
pub use device_features::{DeviceFeatures, Need};
pub use error::{Error, Result};
pub use frame::Frame;
pub(crate) use frame::{Bind, Pass, Threads};
pub use inputs::{Handoff, ImageRef, Inputs, NormalEncoding};
