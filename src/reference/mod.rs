//! CPU reference for every result: exact visibility by ray tracing, and a mirror in `f64` of each pass.
//!
//! Mirrors live in the rooms of their shaders: `<room>::<name>` mirrors `glsl/<room>/<name>.comp`. Where a mirror
//! covers more than the shader of its name, the head of its file or of its room says so; `tests/mirrors_exist.rs`
//! reads both.

pub mod caster_edges;
pub mod common;
pub mod distance_transform;
pub mod exact;
pub mod filtering;
pub mod penumbra;
pub mod ray_traced;
pub mod revectorization;
pub mod soft;

pub use common::view::{FrameData, Mirror};
