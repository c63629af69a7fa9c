//! Mirrors of the passes for shadow edges in the image and the penumbrae around them.
//!
//! [`edge_seeds`] covers `seed_format.glsl`, `edge_marks.glsl`, `edge_pixels.comp` and `edge_pixels.glsl`.

pub mod edge_seeds;
pub mod mean_filter;
pub mod nearest_edge;
pub mod seed_width;
