//! The CPU side of every claim: exact visibility by ray tracing, and a mirror in `f64` of each pass.

pub mod ray_traced;
