//! Shared steps: a file a step, each with its shader of the same stem under `glsl/pass/`.

pub mod accumulate;
pub mod depth_bounds;
pub mod pcf;
pub mod pixels;
pub mod rbsm;
pub mod rbsm_view;
pub mod rpcf;
pub mod sm;
pub mod tiles;
pub mod view;
