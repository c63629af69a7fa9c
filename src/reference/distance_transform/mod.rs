//! Mirror of the exact Euclidean distance transform.
//!
//! [`edt`] covers `edt_envelope.glsl` and `edt_pack.glsl`.

pub mod edt;
