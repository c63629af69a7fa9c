//! Mirror of `glsl/lib/penumbra.glsl`, as far as it tells which points lie on one surface.

use super::view::{Decision, ROUNDING};
use glam::DVec3;

/// A vector between two points, with the bound of its error.
#[derive(Clone, Copy)]
pub(crate) struct Apart {
    pub vector: DVec3,
    pub error: f64,
}

/// A pixel's world width and the bound of its error.
pub(crate) type Width = (f64, f64);

/// `nearPlane` of `glsl/lib/penumbra.glsl`; `normal` with the bound of its error.
pub(crate) fn near_plane(
    (normal, normal_error): (DVec3, f64),
    apart: &Apart,
    pixels: f64,
    (width, width_error): Width,
    tolerance: f64,
) -> Decision {
    let limit = tolerance * width * pixels;
    let error = apart.error
        + apart.vector.length() * (normal_error + ROUNDING)
        + tolerance * width_error * pixels
        + ROUNDING * limit;
    Decision::positive(limit - normal.dot(apart.vector).abs(), error)
}

/// `sameDepth` of `glsl/lib/penumbra.glsl`; depths `a` and `b`, off by up to `error` together.
pub(crate) fn same_depth(a: f64, b: f64, error: f64, tolerance: f64) -> Decision {
    let limit = tolerance * a.abs().min(b.abs());
    let error = (1.0 + tolerance) * error + ROUNDING * (limit + (a - b).abs());
    Decision::positive(limit - (a - b).abs(), error)
}
