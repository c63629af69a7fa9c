//! How a sequence of visibility pictures changes, next to how the truth does.

use super::{LIT_THRESHOLD, Planes, penumbra_band, sum_pixels};
use crate::{Error, Result};

/// One frame of a sequence: planes of the same size, row by row from the top.
#[derive(Clone, Copy, Debug)]
pub struct Shot<'a> {
    /// Visibility under test.
    pub test: &'a [f32],
    /// True visibility.
    pub truth: &'a [f32],
    /// Pixels that can be judged.
    pub mask: &'a [bool],
}

/// What [`motion`] finds. `Vt` is the visibility under test, `Vr` the truth; `d` is the difference of
/// two frames in a row. Means run over *pairs*, a pixel in two frames in a row each, that are in both
/// masks and near the truth's boundary in either frame.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize)]
pub struct Motion {
    /// Pairs.
    pub pairs: u64,
    /// Mean of `|dVt|`; `None` without a pair, as are the other means.
    pub change: Option<f64>,
    /// Mean of `|dVr|`: what the truth itself changes.
    pub change_truth: Option<f64>,
    /// Mean of `|dVt - dVr|`: change that is not the truth's, and change of the truth's that is
    /// missing. 0 for the truth, and for any picture that is off by the same amount in all frames.
    pub change_error: Option<f64>,
    /// *Triples*: a pixel in three frames in a row, in all three masks and near the truth's boundary
    /// in one of them.
    pub triples: u64,
    /// Share of the triples that are lit, dark, lit or dark, lit, dark (at 0.5); `None` without a triple.
    pub flicker: Option<f64>,
    /// The same of the truth.
    pub flicker_truth: Option<f64>,
}

/// Measures how a sequence changes near the shadow boundaries.
///
/// *Near* is within `radius` pixels of a pixel that is partly lit in the truth, or that has a neighbour on
/// the other side of the boundary. A sequence of fewer than two frames has no pairs.
///
/// # Errors
/// As [`super::compare`], with the number of the frame, counted from 0.
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

/// Of a frame that has been checked.
fn planes<'a>(shot: &Shot<'a>, size: [u32; 2]) -> Planes<'a> {
    let Shot { test, truth, mask } = *shot;
    Planes { test, truth, mask, width: size[0] as usize, height: size[1] as usize }
}

fn add<const N: usize>(total: &mut [f64; N], part: [f64; N]) {
    total.iter_mut().zip(part).for_each(|(t, p)| *t += p);
}
