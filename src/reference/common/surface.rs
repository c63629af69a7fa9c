//! Mirror of the part of `glsl/lib/penumbra.glsl` that decides which points lie on one surface.

use super::view::{Decision, ROUNDING};
use glam::DVec3;

/// Vector between two points, with the bound of its error.
#[derive(Clone, Copy)]
pub(crate) struct Apart {
    pub vector: DVec3,
    pub error: f64,
}

/// World width of a pixel and the bound of its error.
pub(crate) type Width = (f64, f64);

/// Unit normal and the bound of its error.
pub(crate) type Normal = (DVec3, f64);

/// `CREASE_COSINE` of `glsl/lib/penumbra.glsl`.
pub(crate) const CREASE_COSINE: f64 = 0.8660254;
/// `FARTHEST_COSINE` of `glsl/lib/penumbra.glsl`.
const FARTHEST_COSINE: f64 = 0.1;
/// `CURVED` of `glsl/lib/penumbra.glsl`.
pub(crate) const CURVED: f64 = 0.43;

/// Returns the cosine of the angle between two normals, and the bound of its error.
pub(crate) fn turn(n: Normal, m: Normal) -> (f64, f64) {
    (n.0.dot(m.0), n.1 + m.1 + ROUNDING)
}

/// Decides whether two normals differ by less than the angle of a crease.
pub(crate) fn is_smooth(n: Normal, m: Normal) -> Decision {
    let (cosine, error) = turn(n, m);
    Decision::positive(cosine - CREASE_COSINE, error)
}

/// Mirror of `onePatch` of `glsl/lib/penumbra.glsl`.
pub(crate) fn one_patch(
    n: Normal,
    m: Normal,
    apart: &Apart,
    pixels: f64,
    (width, width_error): Width,
    tolerance: f64,
) -> Decision {
    let (cosine, cosine_error) = turn(n, m);
    let limit = 2.0 * tolerance * width * pixels;
    let error = 2.0 * apart.error
        + apart.vector.length() * (n.1 + m.1 + 2.0 * ROUNDING)
        + 2.0 * tolerance * width_error * pixels
        + ROUNDING * limit;
    let is_level = Decision::positive(limit - (n.0 + m.0).dot(apart.vector).abs(), error);
    Decision::positive(cosine - FARTHEST_COSINE, cosine_error).and(is_level)
}

/// Mirror of `turnsEvenly` of `glsl/lib/penumbra.glsl`, for the turns from `n` to `k` and on to `m`.
pub(crate) fn turns_evenly(n: Normal, k: Normal, m: Normal) -> Decision {
    let ((first, first_error), (second, second_error)) = (turn(n, k), turn(k, m));
    let even = 9.0 * (1.0 - first.max(second)) - (1.0 - first.min(second));
    Decision::positive(even, 10.0 * (first_error + second_error))
}

/// Mirror of `nearPlane` of `glsl/lib/penumbra.glsl`; `normal` comes with the bound of its error.
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

/// Mirror of `sameDepth` of `glsl/lib/penumbra.glsl`. `error` bounds the summed errors of the depths `a` and `b`.
pub(crate) fn same_depth(a: f64, b: f64, error: f64, tolerance: f64) -> Decision {
    let limit = tolerance * a.abs().min(b.abs());
    let error = (1.0 + tolerance) * error + ROUNDING * (limit + (a - b).abs());
    Decision::positive(limit - (a - b).abs(), error)
}
