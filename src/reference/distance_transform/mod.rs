//! Mirror of the exact Euclidean distance transform.
//!
//! [`edt`] covers `edt_envelope.glsl` and the `edt_pack*.comp` shaders.

pub mod edt;
