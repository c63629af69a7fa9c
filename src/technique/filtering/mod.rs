//! The shadow map's own tests: one a pixel, or the mean of many.

pub(super) mod pcf;
pub(super) mod sm;
