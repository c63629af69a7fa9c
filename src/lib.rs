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
//! * **What you state of an image** ([`ImageRef`]: format, extent, layers, samples, layout) is checked: it must be what the
//!   technique reads and was prepared for. Multisampled images are refused: resolve them, depth by sample 0. Whether the
//!   statement is true nobody can ask Vulkan; that is your part, in the contract of [`Frame::begin`].
//! * **Views** are checked every frame: matrices finite, invertible and of a rigid view, the projection of the light's
//!   kind and of the depth range that the view states, sizes and angles possible. Shadow maps have depth 0 near to 1 far:
//!   reversed-Z maps are refused.
//! * **Formats of the shadow map**: every depth format, and `R32_SFLOAT`. What D16 and D24 round away is taken off the
//!   receivers' depth, so that a surface does not shadow itself; with D16 keep the planes near and far tight.
//! * **Several lights, one technique**: what is kept from frame to frame belongs to the map, the light and
//!   [`Inputs::light_version`] together. A technique that alternates between two lights is right, and makes everything anew
//!   each time: prepare one a light to keep both.
//! * **The output** belongs to the technique and is reused every frame. [`Handoff`] says how you read it;
//!   the library emits that barrier, and in the next frame waits for those reads before it writes again.
//! * **Frames in flight**: any number on one queue, submitted in the order of their recording. A technique, a
//!   [`Context`] or [`timing::Timings`] may be dropped once the GPU is done with all frames that used it.
//! * **Errors**: after an error a technique forgets what it had recorded in that call. The frame may go on, or be dropped
//!   without [`Frame::finish`]; the command buffer may be submitted or thrown away.
//! * **Command buffers that are thrown away** after [`Frame::finish`]: call [`technique::Technique::reset`] on every
//!   technique in them before it records again. Layouts and kept results are tracked as recorded.
//! * **Times**: [`timing::Timings`] gives a frame's times under its own passes' names or not at all;
//!   [`timing::Timings::lost`] counts the frames whose slot came round too early, or that never ran.
//! * **Casters** in a vertex buffer of yours ([`casters::VertexBuffer`]): that all vertices lie within the size that you
//!   state is checked; that the buffer has it is yours to say, in an `unsafe` call.
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
