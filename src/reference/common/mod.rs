//! Mirrors of code that several rooms use.
//!
//! `view` covers `receiver.glsl`. `pixel_steps.glsl` is covered by the passes that take these steps, and
//! `pcf_bounds.glsl` by [`pcf`](super::filtering::pcf). `tiles.glsl` has no mirror of its own: it only packs the
//! numbers of tiles and pixels that [`pcf::listed`](super::filtering::pcf::listed) counts.

pub mod accumulate;
pub mod area_light;
pub mod blockers;
pub mod depth_bounds;
pub mod hsm;
pub(crate) mod map_receiver;
pub mod rbsm_receiver;
pub mod shade;
pub(crate) mod shadow_map_test;
pub(crate) mod surface;
pub(crate) mod view;
