//! Mirrors of the shadow map's own tests.
//!
//! [`pcf`] covers `pcf_receiver.glsl`.

pub mod pcf;
pub mod sm;
