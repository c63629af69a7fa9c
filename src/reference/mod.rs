//! The CPU side of every claim: exact visibility by ray tracing, and a mirror in `f64` of each pass.

pub mod accumulate;
pub mod depth_bounds;
pub mod pcf;
pub mod ray_traced;
pub mod shade;
pub mod sm;
mod view;

pub use view::{FrameData, Mirror};
