//! Mirrors of the plain shadow-map test, of its filters, and of maps that are filtered before they are tested.
//!
//! [`pcf`] covers `pcf_receiver.glsl`.

pub mod evsm;
pub mod moments;
pub mod msm;
pub mod pcf;
pub mod sm;
pub mod summed_area;
pub mod vsm;
