//! Macedo 2018 equation 7.

use super::Discontinuity;
use glam::DVec4;

/// The improved visibility of a point in a texel with a discontinuity: `0 if (1 - s) + (2 s - 1)(alpha_x + alpha_y) <
/// 0.5, else 1`, so that a tie is lit on either side.
///
/// `nrd` is [`super::normalized`]: for an L shape its positions are `alpha`, from the corner where the point's own run
/// meets the opposite visibility. A step of length L is cut by a straight line from half a texel up at one end, through
/// the edge in mid-run, to half a texel down at the other. Other shapes keep the test.
pub fn star_visibility(d: Discontinuity, nrd: DVec4) -> f64 {
    let s = f64::from(u8::from(d.lit));
    if nrd.z != 0.0 || nrd.w != 0.0 {
        return s;
    }
    if (1.0 - s) + (2.0 * s - 1.0) * (nrd.x + nrd.y) < 0.5 { 0.0 } else { 1.0 }
}
