//! Mirrors of the techniques for penumbrae of an area light.
//!
//! [`rbssm`] covers `edge_blockers.glsl` and `revectorized_filter.glsl`.

pub mod mssm;
pub mod pcss;
pub mod penumbra_width;
pub mod rbssm;
pub mod screen_filter;
pub mod soft_auto;
mod soft_filter;
pub mod vssm;
pub mod window_moments;
