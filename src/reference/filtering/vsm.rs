//! Mirror of `glsl/filtering/vsm.comp`.

use super::moments::{self, Settings, Stored, chebyshev};
use crate::Result;
use crate::reference::common::view::{FrameData, Mirror, ROUNDING};

/// Returns the visibility of every pixel from filtered moments. `least_deviation` is of signed depths.
///
/// # Errors
/// Fails if the images do not fit the constants.
pub fn visibility(
    data: &FrameData<'_>,
    stored: &Stored<'_>,
    settings: &Settings,
    least_deviation: f32,
) -> Result<Mirror> {
    let least = f64::from(least_deviation).powi(2);
    moments::visibility(data, stored, settings, |found| {
        let ([mean, square, ..], [mean_error, square_error, ..]) = (found.moments, found.error);
        let receiver = (found.depth, found.depth_error);
        chebyshev([mean, square], [mean_error, square_error], receiver, (least, ROUNDING * least))
    })
}
