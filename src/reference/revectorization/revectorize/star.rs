//! Equation 7 of Macedo 2018.

use super::Discontinuity;
use glam::DVec4;

/// Returns the improved visibility of a point in a texel with a discontinuity: `0 if (1 - s) + (2 s - 1)(alpha_x +
/// alpha_y) < 0.5, else 1`. A tie is lit on either side.
///
/// `nrd` is [`super::normalized`]. For an L shape its positions are `alpha`, measured from the corner where the
/// point's own run meets the opposite visibility. A straight line cuts a step of length L: from half a texel up at one
/// end, through the discontinuity in mid-run, to half a texel down at the other. Other shapes keep the test.
pub fn star_visibility(d: Discontinuity, nrd: DVec4) -> f64 {
    if star_ramp(d, nrd) < 0.5 { 0.0 } else { 1.0 }
}

/// Returns the left side of the comparison in equation 7, clamped: a ramp across L shapes. Other shapes keep the test.
pub fn star_ramp(d: Discontinuity, nrd: DVec4) -> f64 {
    let s = f64::from(u8::from(d.lit));
    if nrd.z != 0.0 || nrd.w != 0.0 {
        return s;
    }
    ((1.0 - s) + (2.0 * s - 1.0) * (nrd.x + nrd.y)).clamp(0.0, 1.0)
}
