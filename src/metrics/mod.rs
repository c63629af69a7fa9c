//! Error of a visibility picture against the truth.
//!
//! Visibility is 1 in full light and 0 in full shadow. Every measure covers the pixels of a mask, which excludes the
//! sky, the terminator and whatever else should not be judged. It sums in `f64` in a fixed order, row by row, so it
//! gives the same bits with any number of threads. A measure over an empty set of pixels is `None` or 0, never NaN.

mod boundary;
mod distance;
mod false_shadow;
mod flip;
mod motion;
mod ssim;
mod sum;

pub use boundary::Displacement;
pub use false_shadow::{FalseShadow, false_shadow};
pub use flip::{FLIP_PIXELS_PER_DEGREE, flip};
pub use motion::{Motion, Shot, motion};

use crate::{Error, Result};
use sum::sum_rows;

/// Largest side of a picture that [`compare`] takes, in pixels.
pub const MAX_SIDE_PX: u32 = 16384;

/// Smallest visibility that counts as lit where a measure needs a yes or no.
pub const LIT_THRESHOLD: f32 = 0.5;

/// Reach of the penumbra band beyond penumbra and hard boundary, in pixels.
const BAND_PX: u32 = 8;

/// Distance, in pixels, by which the lit and the shadowed set are eroded before acne and light leaks are searched.
const ERODE_PX: u32 = 3;

/// Deviation from the truth above which a pixel counts as false shadow or light leak in the `*_share` figures.
const SHARE_THRESHOLD: f64 = 0.05;

/// Result of [`compare`]. `Vt` is the visibility under test, `Vr` the truth.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize)]
pub struct Report {
    /// Number of pixels in the mask.
    pub pixels: u64,
    /// Root of the mean of `(Vt - Vr)^2`.
    pub rmse: f64,
    /// Mean of `|Vt - Vr|`; equals `over + under`.
    pub mae: f64,
    /// Structural similarity, 1 for equal pictures: 11x11 Gaussian window with sigma 1.5, `K1 = 0.01`, `K2 = 0.03`, `L
    /// = 1`. It is the mean over the windows that lie entirely in the picture **and** in the mask; a window that
    /// touches a single masked-out pixel is left out. `None` if there is no such window.
    pub ssim: Option<f64>,
    /// Fraction of the pixels where `Vt >= 0.5` and `Vr >= 0.5` differ.
    pub mismatch: f64,
    /// Number of those pixels per pixel of `boundary_length`: the mean distance between the two boundaries, in pixels,
    /// by the area between them. Unlike `mismatch` it does not depend on how much of the picture is boundary, so it
    /// can be compared between scenes and image sizes. `None` if the truth has no boundary.
    pub mismatch_per_boundary: Option<f64>,
    /// Length of the truth's boundary in pixels, by marching squares: exact for boundaries at multiples of 45 degrees,
    /// up to 8.2 % too long in between.
    pub boundary_length: f64,
    /// Mean of `max(0, Vr - Vt)`: over-darkening, the shadow is overestimated.
    pub over: f64,
    /// Mean of `max(0, Vt - Vr)`: the result is too light, the shadow is underestimated.
    pub under: f64,
    /// Distance of the shadow boundary under test from the true one; `None` if either is missing.
    pub boundary: Option<Displacement>,
    /// Distance of the true boundary from the one under test. It is large where `boundary` is small if a shadow, or a
    /// hole in one, is missing altogether.
    pub boundary_reverse: Option<Displacement>,
    /// Mean of `1 - Vt` over the lit set (`Vr = 1`) eroded by 3 px: acne and other false shadow. The erosion excludes
    /// displaced boundaries. `None` if the eroded set is empty.
    pub false_shadow: Option<f64>,
    /// Fraction of that set with `Vt < 0.95`.
    pub false_shadow_share: Option<f64>,
    /// Mean of `Vt` over the umbra (`Vr = 0`) eroded by 3 px; `None` where that set is empty.
    pub light_leak: Option<f64>,
    /// Fraction of that set with `Vt > 0.05`.
    pub light_leak_share: Option<f64>,
    /// RMSE over the pixels within 8 px of the penumbra (`0 < Vr < 1`) or of the hard boundary; the rest of the
    /// picture does not dilute it. `None` if the truth has neither.
    pub penumbra_rmse: Option<f64>,
    /// Number of pixels in that band.
    pub penumbra_pixels: u64,
}

/// Planes under comparison, row by row, all of the same size.
#[derive(Clone, Copy)]
pub(crate) struct Planes<'a> {
    test: &'a [f32],
    truth: &'a [f32],
    mask: &'a [bool],
    width: usize,
    height: usize,
}

impl<'a> Planes<'a> {
    /// Rejects slices of the wrong length, pictures that are too large, and values that are not finite.
    fn new(test: &'a [f32], truth: &'a [f32], mask: &'a [bool], size: [u32; 2]) -> Result<Self> {
        let pixels = pixel_count(size)?;
        check_length("the visibility under test", test.len(), pixels, size)?;
        check_length("the truth", truth.len(), pixels, size)?;
        check_length("the mask", mask.len(), pixels, size)?;
        let planes = Self { test, truth, mask, width: size[0] as usize, height: size[1] as usize };
        check_finite("visibility under test", test, &planes)?;
        check_finite("truth", truth, &planes)?;
        Ok(planes)
    }

    fn row(&self, y: usize) -> std::ops::Range<usize> {
        y * self.width..(y + 1) * self.width
    }
}

/// Compares a visibility picture with the truth over the pixels where `mask` is `true`.
///
/// All three have `size[0] * size[1]` values, row by row from the top. Values should be in `[0, 1]`; others are used
/// as they are. Pixels outside the mask are never read.
///
/// # Errors
/// Fails for a slice of the wrong length, a side beyond [`MAX_SIDE_PX`], or a value in the mask that is not finite;
/// the message names the place.
pub fn compare(test: &[f32], truth: &[f32], mask: &[bool], size: [u32; 2]) -> Result<Report> {
    let planes = Planes::new(test, truth, mask, size)?;

    // Number of pixels, squared error, too dark, too light, mismatches.
    let [count, squared, over, under, mismatches] = sum_pixels(&planes, |i| {
        let e = f64::from(test[i]) - f64::from(truth[i]);
        let differs = (test[i] >= LIT_THRESHOLD) != (truth[i] >= LIT_THRESHOLD);
        [1.0, e * e, (-e).max(0.0), e.max(0.0), f64::from(u8::from(differs))]
    });
    let mean = |sum: f64| if count > 0.0 { sum / count } else { 0.0 };
    let (over, under) = (mean(over), mean(under));

    let umbra = |i: usize| truth[i] <= 0.0;
    let lit = |i: usize| truth[i] >= 1.0;
    let leak = deviation(&planes, &eroded(&planes, ERODE_PX, umbra), |i| f64::from(test[i]));
    let acne = deviation(&planes, &eroded(&planes, ERODE_PX, lit), |i| 1.0 - f64::from(test[i]));

    let band = penumbra_band(&planes, BAND_PX);
    let [band_count, band_squared] = sum_pixels(&planes, |i| {
        let e = f64::from(test[i]) - f64::from(truth[i]);
        if band[i] { [1.0, e * e] } else { [0.0; 2] }
    });

    let (boundary, boundary_reverse) = boundary::displacements(&planes);
    let boundary_length = boundary::length(&planes, truth);
    Ok(Report {
        pixels: count as u64,
        rmse: mean(squared).sqrt(),
        mae: over + under,
        ssim: ssim::ssim(&planes),
        mismatch: mean(mismatches),
        mismatch_per_boundary: (boundary_length > 0.0).then(|| mismatches / boundary_length),
        boundary_length,
        over,
        under,
        boundary,
        boundary_reverse,
        false_shadow: acne.map(|d| d[0]),
        false_shadow_share: acne.map(|d| d[1]),
        light_leak: leak.map(|d| d[0]),
        light_leak_share: leak.map(|d| d[1]),
        penumbra_rmse: (band_count > 0.0).then(|| (band_squared / band_count).sqrt()),
        penumbra_pixels: band_count as u64,
    })
}

/// Returns [`Report::mismatch_per_boundary`] alone, for many masks of one picture.
///
/// # Errors
/// Fails like [`compare`].
pub fn mismatch_per_boundary(test: &[f32], truth: &[f32], mask: &[bool], size: [u32; 2]) -> Result<Option<f64>> {
    let planes = Planes::new(test, truth, mask, size)?;
    let differs = |i: usize| (test[i] >= LIT_THRESHOLD) != (truth[i] >= LIT_THRESHOLD);
    let [mismatches] = sum_pixels(&planes, |i| [f64::from(u8::from(differs(i)))]);
    let length = boundary::length(&planes, truth);
    Ok((length > 0.0).then(|| mismatches / length))
}

/// Sums `term(index)` over the pixels of the mask.
fn sum_pixels<const N: usize>(planes: &Planes, term: impl Fn(usize) -> [f64; N] + Sync) -> [f64; N] {
    sum_rows(planes.height, |y| {
        let mut row = [0.0; N];
        for i in planes.row(y).filter(|&i| planes.mask[i]) {
            let t = term(i);
            (0..N).for_each(|k| row[k] += t[k]);
        }
        row
    })
}

/// Returns the mean of `value` over `set`, and the fraction of the set where it is above [`SHARE_THRESHOLD`].
fn deviation(planes: &Planes, set: &[bool], value: impl Fn(usize) -> f64 + Sync) -> Option<[f64; 2]> {
    let [count, sum, above] = sum_pixels(planes, |i| {
        if !set[i] {
            return [0.0; 3];
        }
        let v = value(i);
        [1.0, v, f64::from(u8::from(v > SHARE_THRESHOLD))]
    });
    (count > 0.0).then(|| [sum / count, above / count])
}

/// Returns the pixels of the mask that are in the set and more than `radius` pixels away from every pixel of the mask
/// that is not. Pixels outside the mask or the picture do not erode the set, because no boundary is known there.
fn eroded(planes: &Planes, radius: u32, member: impl Fn(usize) -> bool + Sync) -> Vec<bool> {
    let outside: Vec<bool> = (0..planes.mask.len()).map(|i| planes.mask[i] && !member(i)).collect();
    let near = distance::within(&outside, planes.width, planes.height, radius);
    (0..planes.mask.len()).map(|i| planes.mask[i] && member(i) && !near[i]).collect()
}

/// Returns the pixels of the mask within `radius` pixels of a partly lit pixel or of one at the hard boundary.
fn penumbra_band(planes: &Planes, radius: u32) -> Vec<bool> {
    let mut seed: Vec<bool> =
        (0..planes.mask.len()).map(|i| planes.mask[i] && planes.truth[i] > 0.0 && planes.truth[i] < 1.0).collect();
    boundary::for_each_crack(planes, planes.truth, |crack| {
        seed[crack.first] = true;
        seed[crack.second] = true;
    });
    let mut band = distance::within(&seed, planes.width, planes.height, radius);
    band.iter_mut().zip(planes.mask).for_each(|(b, &m)| *b &= m);
    band
}

/// Returns the number of pixels of a picture; fails if it is too large to compare.
fn pixel_count(size: [u32; 2]) -> Result<usize> {
    if size[0].max(size[1]) > MAX_SIDE_PX {
        return Err(Error::Usage(format!(
            "metrics: a picture of {}x{} px has a side longer than {MAX_SIDE_PX} px; compare it in parts",
            size[0], size[1]
        )));
    }
    Ok(size[0] as usize * size[1] as usize)
}

fn check_length(what: &str, length: usize, pixels: usize, size: [u32; 2]) -> Result<()> {
    if length == pixels {
        return Ok(());
    }
    Err(Error::Usage(format!("metrics: {what} has {length} values, {}x{} px need {pixels}", size[0], size[1])))
}

fn check_finite(what: &str, values: &[f32], planes: &Planes) -> Result<()> {
    let bad = (0..values.len()).find(|&i| planes.mask[i] && !values[i].is_finite());
    let Some(i) = bad else { return Ok(()) };
    Err(Error::Usage(format!(
        "metrics: the {what} is {} at pixel ({}, {}); mask such pixels out or repair the technique",
        values[i],
        i % planes.width,
        i / planes.width
    )))
}
