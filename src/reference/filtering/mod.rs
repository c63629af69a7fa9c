//! Mirrors of the plain shadow-map test and its filters.
//!
//! [`pcf`] covers `pcf_receiver.glsl`.

pub mod pcf;
pub mod sm;
