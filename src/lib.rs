//! Edgeshade: real-time shadows with sharp and smooth edges, recorded into your own command buffer.
#![warn(missing_docs)]

pub mod error;
#[cfg(feature = "app")]
pub mod metrics;
#[cfg(feature = "app")]
pub mod picture;
#[cfg(feature = "app")]
pub mod reference;
#[cfg(feature = "app")]
pub mod scene;
#[cfg(feature = "app")]
pub mod table;
pub mod view;

pub use error::{Error, Result};
