//! Edgeshade: real-time shadows with sharp and smooth edges, recorded into your own command buffer.
#![warn(missing_docs)]

mod context;
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
pub use error::{Error, Result};
pub use frame::{Bind, Draw, Frame, Pass, Target, Threads};
pub use inputs::{Handoff, ImageRef, Inputs, NormalEncoding};
