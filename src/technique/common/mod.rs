//! Parts that several rooms use: views of camera and light, receivers, tiles and lists of pixels, depth bounds of the map.

pub mod accumulate;
pub(crate) mod bindings;
pub mod blocker_search;
pub mod depth_bounds;
pub mod hsm;
pub(crate) mod kept;
pub mod pixels;
pub mod rbsm_receiver;
pub mod receiver;
pub mod surface;
pub mod tiles;
pub mod view;
