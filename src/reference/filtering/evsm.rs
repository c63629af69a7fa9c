//! Mirror of `glsl/filtering/evsm.comp`.

use super::moments::{self, Settings, Stored, chebyshev};
use crate::Result;
use crate::reference::common::view::{FrameData, Mirror, ROUNDING};

/// Settings of the technique beyond those of the lookup.
#[derive(Clone, Copy, Debug)]
pub struct Warps {
    /// Exponents of both warps.
    pub exponents: [f32; 2],
    /// The negative warp counts too.
    pub both: bool,
    /// Least deviation of signed depths.
    pub least_deviation: f32,
}

/// Returns the visibility of every pixel from filtered moments.
///
/// # Errors
/// Fails if the images do not fit the constants.
pub fn visibility(data: &FrameData<'_>, stored: &Stored<'_>, settings: &Settings, warps: &Warps) -> Result<Mirror> {
    moments::visibility(data, stored, settings, |found| {
        let one = |i: usize, sign: f64| {
            let c = f64::from(warps.exponents[i]);
            let t = sign * (sign * c * found.depth).exp();
            // Vulkan's exp errs by 3 + 2 |x| units in the last place.
            let relative = c * found.depth_error + (3.0 + 3.0 * c) * f64::from(f32::EPSILON);
            let least = (f64::from(warps.least_deviation) * c * t).powi(2);
            let moments = [found.moments[2 * i], found.moments[2 * i + 1]];
            let error = [found.error[2 * i], found.error[2 * i + 1]];
            chebyshev(moments, error, (t, t.abs() * relative.exp_m1()), (least, least * (2.0 * relative + ROUNDING)))
        };
        let positive = one(0, 1.0);
        if !warps.both {
            return positive;
        }
        let negative = one(1, -1.0);
        // The smaller of two moves no further than either.
        (positive.0.min(negative.0), positive.1.max(negative.1))
    })
}
