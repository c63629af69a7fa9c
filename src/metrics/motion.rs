//! Change of a sequence of visibility pictures, compared with the change of the truth.

use super::{LIT_THRESHOLD, Planes, penumbra_band, sum_pixels};
use crate::{Error, Result};

/// Frame of a sequence: planes of the same size, row by row from the top.
#[derive(Clone, Copy, Debug)]
pub struct Shot<'a> {
    /// Visibility under test.
    pub test: &'a [f32],
    /// True visibility.
    pub truth: &'a [f32],
    /// Mask of pixels that can be judged.
    pub mask: &'a [bool],
}

/// Result of [`motion`]. `Vt` is the visibility under test, `Vr` the truth; `d` is the difference of two consecutive
/// frames. Means cover *pairs*: a pixel in two consecutive frames that is in both masks and near the truth's boundary
/// in either frame.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize)]
pub struct Motion {
    /// Number of pairs.
    pub pairs: u64,
    /// Mean of `|dVt|`; `None` without pairs, like the other means.
    pub change: Option<f64>,
    /// Mean of `|dVr|`: the change of the truth itself.
    pub change_truth: Option<f64>,
    /// Mean of `|dVt - dVr|`: change that the truth does not have, and change of the truth that is missing. It is 0
    /// for the truth, and for any picture with the same error in all frames.
    pub change_error: Option<f64>,
    /// Number of *triples*: a pixel in three consecutive frames that is in all three masks and near the truth's
    /// boundary in one of them.
    pub triples: u64,
    /// Fraction of the triples that are lit, dark, lit or dark, lit, dark (at 0.5); `None` without triples.
    pub flicker: Option<f64>,
    /// Fraction of such triples in the truth.
    pub flicker_truth: Option<f64>,
}

/// Measures how a sequence changes near the shadow boundaries.
///
/// *Near* means within `radius` pixels of a pixel that is partly lit in the truth, or that has a neighbour on the
/// other side of the boundary. A sequence of fewer than two frames has no pairs.
///
/// # Errors
/// Fails like [`super::compare`]; the message has the number of the frame, counted from 0.
pub fn motion(shots: &[Shot<'_>], size: [u32; 2], radius: u32) -> Result<Motion> {
    let frame = |(i, s): (usize, &Shot<'_>)| -> Result<(Vec<bool>, Vec<bool>, Vec<bool>)> {
        let planes = Planes::new(s.test, s.truth, s.mask, size)
            .map_err(|e| Error::Usage(format!("frame {i} of a sequence: {e}")))?;
        let lit = |values: &[f32]| values.iter().map(|&v| v >= LIT_THRESHOLD).collect();
        Ok((penumbra_band(&planes, radius), lit(s.test), lit(s.truth)))
    };
    let frames = shots.iter().enumerate().map(frame).collect::<Result<Vec<_>>>()?;

    let mut pairs = [0.0; 4];
    for (s, f) in shots.windows(2).zip(frames.windows(2)) {
        let planes = planes(&s[0], size);
        add(
            &mut pairs,
            sum_pixels(&planes, |i| {
                if !s[1].mask[i] || !(f[0].0[i] || f[1].0[i]) {
                    return [0.0; 4];
                }
                let test = f64::from(s[1].test[i]) - f64::from(s[0].test[i]);
                let truth = f64::from(s[1].truth[i]) - f64::from(s[0].truth[i]);
                [1.0, test.abs(), truth.abs(), (test - truth).abs()]
            }),
        );
    }
    let mut triples = [0.0; 3];
    for (s, f) in shots.windows(3).zip(frames.windows(3)) {
        let planes = planes(&s[0], size);
        add(
            &mut triples,
            sum_pixels(&planes, |i| {
                if !s[1].mask[i] || !s[2].mask[i] || !f.iter().any(|f| f.0[i]) {
                    return [0.0; 3];
                }
                let flips = |lit: [bool; 3]| f64::from(u8::from(lit[0] == lit[2] && lit[0] != lit[1]));
                [1.0, flips([f[0].1[i], f[1].1[i], f[2].1[i]]), flips([f[0].2[i], f[1].2[i], f[2].2[i]])]
            }),
        );
    }
    let mean = |sum: f64, count: f64| (count > 0.0).then(|| sum / count);
    Ok(Motion {
        pairs: pairs[0] as u64,
        change: mean(pairs[1], pairs[0]),
        change_truth: mean(pairs[2], pairs[0]),
        change_error: mean(pairs[3], pairs[0]),
        triples: triples[0] as u64,
        flicker: mean(triples[1], triples[0]),
        flicker_truth: mean(triples[2], triples[0]),
    })
}

/// Returns the planes of a frame that has been checked.
fn planes<'a>(shot: &Shot<'a>, size: [u32; 2]) -> Planes<'a> {
    let Shot { test, truth, mask } = *shot;
    Planes { test, truth, mask, width: size[0] as usize, height: size[1] as usize }
}

fn add<const N: usize>(total: &mut [f64; N], part: [f64; N]) {
    total.iter_mut().zip(part).for_each(|(t, p)| *t += p);
}
