//! Moments that the techniques keep of a shadow map's depths, and the measure of depth that they are taken in.

use crate::view::{LightKind, LightView};

/// Kind of moments: `KIND` of `glsl/filtering/moment_kind.glsl`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Kind {
    /// A depth and its square.
    Variance,
    /// Two warps of a depth, each with its square.
    Warped,
    /// Four moments of a depth in a basis that suits integers.
    Packed,
    /// The first four powers of a depth.
    Powers,
}

/// Returns far over near, minus 1, of a light's projection; 0 for a parallel one. Limited to what single precision tells
/// from an infinitely far plane.
pub fn range(light: &LightView) -> f32 {
    match light.kind {
        // The matrix holds -f/(f-n), which is -1 - 1/(range).
        LightKind::Spot { .. } => (1.0 / (-light.clip_from_view.z_axis.z - 1.0)).clamp(0.0, 1e7) as f32,
        LightKind::Directional { .. } => 0.0,
    }
}
