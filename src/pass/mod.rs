//! Shared steps: a file a step; those that are a pass of their own have their shader under `glsl/pass/` by the same stem.

pub mod accumulate;
mod classified;
pub mod depth_bounds;
pub mod edge_place;
pub mod edge_seeds;
pub mod edt;
pub mod hsm;
pub mod mean_filter;
pub mod nearest_edge;
pub mod pcf;
pub mod pcss;
pub mod penumbra;
pub mod penumbra_width;
pub mod pixels;
pub mod rbsm;
pub mod rbsm_view;
pub mod rbssm;
pub mod rpcf;
pub mod screen_filter;
pub mod seed_width;
pub mod silhouettes;
pub mod sm;
pub mod soft;
pub mod soft_auto;
pub mod tiles;
pub mod view;
