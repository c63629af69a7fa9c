//! Techniques that use the plain tests of the shadow map: one per pixel, or the mean of many.

pub(super) mod pcf;
pub(super) mod sm;
