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
//!         camera_version: None,
//!         casters: &[],
//!     },
//! )?;
//! // Leaves the image as the hand-off says: here in SHADER_READ_ONLY_OPTIMAL, for a fragment shader.
//! let visibility = frame.finish(shadows.output());
//! let view = visibility.view; // bind this, in visibility.layout
//! # Ok(())
//! # }
//! ```
//!
//! `examples/embed` is a complete small engine around these calls, with two frames in flight.
//!
//! # The contract
//!
//! * **Inputs** are read in the layouts that you state and are left in them. Make them visible to compute-shader
//!   reads before the technique runs, and do not write them until it has finished.
//! * **What you state about an image** ([`ImageRef`]: format, extent, layers, samples, layout) is checked: it must be
//!   what the technique reads and was prepared for. Multisampled images are rejected; resolve them first, depth by
//!   sample 0. Vulkan offers no way to check that the statement is true: the contract of [`Frame::begin`] makes you
//!   responsible for that.
//! * **Views** are checked every frame. Matrices must be finite and invertible, and the view must be rigid. The
//!   projection must fit the kind of light and the stated depth range, and sizes and angles must be possible. Shadow
//!   maps have depth 0 near to 1 far; reversed-Z maps are rejected.
//! * **Formats of the shadow map**: every depth format, and `R32_SFLOAT`. The rounding error of D16 and D24 is
//!   subtracted from the receivers' depth, so that a surface does not shadow itself. With D16, keep the near and far
//!   planes close to the scene.
//! * **Several lights, one technique**: results kept from frame to frame belong to one combination of map, light and
//!   [`Inputs::light_version`]. A technique that alternates between two lights gives correct results but recomputes
//!   everything each time; prepare one technique for each light to keep both results.
//! * **Nothing has changed**: if both [`Inputs::light_version`] and [`Inputs::camera_version`] are given, a technique
//!   records no pass in a frame whose inputs equal those of the frame before, and its output keeps the visibility.
//! * **The output** belongs to the technique and is reused every frame. [`Handoff`] says how you read it. The library
//!   emits the barrier for those reads, and in the next frame waits for them before it writes again.
//! * **Frames in flight**: any number on one queue, submitted in the order in which they were recorded. You may drop
//!   a technique, a [`Context`] or [`timing::Timings`] once the GPU has finished all frames that used it.
//! * **Errors**: after an error a technique forgets what it recorded in that call. You may continue the frame, or
//!   drop it without [`Frame::finish`]. The command buffer may be submitted or discarded.
//! * **Command buffers discarded** after [`Frame::finish`]: call [`technique::Technique::reset`] on every technique
//!   in them before it records again, because layouts and kept results are tracked as recorded.
//! * **Times**: [`timing::Timings`] reports a frame's times under the names of its own passes, or not at all.
//!   [`timing::Timings::lost`] counts the frames whose slot was reused too early or that never ran.
//! * **Casters** in a vertex buffer of yours ([`casters::VertexBuffer`]): the library checks that all vertices lie
//!   within the size that you state. That the buffer has this size is your promise, made in an `unsafe` call.
//! * **Descriptors** are pushed, so there is no pool to size. Every object has a debug name; every pass has a label
//!   and, if you pass [`timing::Timings`], two timestamps.
//! * **Precision**: pass your matrices in `f64`. They are composed relative to the camera before they are rounded, so
//!   a scene a million units from the origin keeps its shadows.
//! * **Skipping**: work that no pixel needs is skipped. Techniques that skip have a parameter to turn it off; the
//!   image is the same either way.
//!
//! # Features
//!
//! The bare library (`default-features = false`) depends on `ash`, `gpu-allocator`, `glam`, `bytemuck` and
//! `thiserror`. The feature `app`, on by default, adds scenes, the CPU reference, metrics and the command-line tool.
//! The feature `shaderc` compiles the shaders at build time instead of embedding the committed SPIR-V.
// Tests may unwrap; nothing else may.
#![cfg_attr(not(test), warn(clippy::unwrap_used))]

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
mod loader;
#[cfg(feature = "app")]
pub mod metrics;
#[cfg(feature = "app")]
pub mod picture;
#[cfg(feature = "app")]
pub mod reference;
#[cfg(feature = "app")]
mod sampling;
#[cfg(feature = "app")]
pub mod scene;
pub mod shaders;
#[cfg(feature = "app")]
pub mod table;
pub mod technique;
pub mod timing;
pub mod view;

pub use context::{Context, Requirements, requirements};
pub use device_features::{DeviceFeatures, Need};
pub use error::{Error, Result};
pub use frame::Frame;
pub(crate) use frame::{Bind, Pass, Threads};
pub use gpu::{ContextDesc, ImageRef};
pub use inputs::{Handoff, Inputs, NormalEncoding};
