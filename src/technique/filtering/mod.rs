//! The shadow map's own tests: one a pixel, or the mean of many.

pub mod pcf;
pub mod sm;
