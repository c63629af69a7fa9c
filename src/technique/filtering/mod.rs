//! The shadow map's own tests, one a pixel or the mean of many, and maps that are filtered before they are tested.

pub mod evsm;
pub mod moment_kind;
pub mod moments;
pub mod msm;
pub mod pcf;
pub mod sm;
pub mod summed_area;
pub mod vsm;
