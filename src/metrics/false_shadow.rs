//! False shadow, such as acne, counted beyond a distance from the true boundaries that the caller chooses.

use super::{LIT_THRESHOLD, Planes, eroded, sum_pixels};
use crate::Result;

/// Result of [`false_shadow`].
#[derive(Clone, Copy, Debug, PartialEq, Eq, serde::Serialize)]
pub struct FalseShadow {
    /// Number of pixels of the mask that are fully lit in the truth, as are all pixels near them.
    pub lit: u64,
    /// Number of those pixels that the test has in shadow (below 0.5).
    pub dark: u64,
}

impl FalseShadow {
    /// Returns the fraction of the lit pixels that are dark; `None` if there are no lit ones.
    pub fn share(&self) -> Option<f64> {
        (self.lit > 0).then(|| self.dark as f64 / self.lit as f64)
    }
}

/// Counts the pixels that are dark although the truth is fully lit there and up to `distance` pixels around.
///
/// This is like [`super::Report::false_shadow`], with a distance that fits the shadow map: boundaries displaced by
/// less than `distance` do not count. Pixels outside the mask or the picture exclude nothing.
///
/// # Errors
/// Fails like [`super::compare`].
pub fn false_shadow(test: &[f32], truth: &[f32], mask: &[bool], size: [u32; 2], distance: u32) -> Result<FalseShadow> {
    let planes = Planes::new(test, truth, mask, size)?;
    let lit = eroded(&planes, distance, |i| truth[i] >= 1.0);
    let [lit, dark] = sum_pixels(&planes, |i| match lit[i] {
        true => [1.0, f64::from(u8::from(test[i] < LIT_THRESHOLD))],
        false => [0.0; 2],
    });
    Ok(FalseShadow { lit: lit as u64, dark: dark as u64 })
}
