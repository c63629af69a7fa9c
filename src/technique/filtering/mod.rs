//! Techniques that use the plain tests of the shadow map, one per pixel or the mean of many, and those that filter the map
//! before it is tested.

pub mod evsm;
pub mod moment_kind;
pub mod moments;
pub mod msm;
pub(super) mod pcf;
pub(super) mod sm;
pub mod summed_area;
pub mod vsm;
