//! Mirror of `glsl/filtering/msm.comp`.

use super::moments::{self, Settings, Stored, unpack};
use crate::Result;
use crate::reference::common::view::{FrameData, Mirror};

/// Settings of the technique beyond those of the lookup.
#[derive(Clone, Copy, Debug)]
pub struct Reconstruction {
    /// Depths outside the map's range are excluded.
    pub hausdorff: bool,
    /// The moments were stored as 16-bit integers.
    pub bits_16: bool,
    /// Share of moments that are certainly possible.
    pub moment_bias: f32,
}

/// Returns the visibility of every pixel from filtered moments.
///
/// # Errors
/// Fails if the images do not fit the constants.
pub fn visibility(
    data: &FrameData<'_>,
    stored: &Stored<'_>,
    settings: &Settings,
    reconstruction: &Reconstruction,
) -> Result<Mirror> {
    moments::visibility(data, stored, settings, |found| {
        let shadow = |moments: [f64; 4], t: f64| shadow(moments, t, reconstruction.hausdorff);
        let b = biased(found.moments, reconstruction);
        let exact = shadow(b, found.depth);
        // The reconstruction in single precision is that of moments a few steps off. Each may move the result either way.
        let step = 8.0 * f64::from(f32::EPSILON);
        let e = found.own;
        let own = match reconstruction.bits_16 {
            true => [0.34 * e[0] + 1.74 * e[2], 0.13 * e[1] + e[3], 0.75 * e[0] + 1.3 * e[2], 0.13 * e[1] + e[3]],
            false => e,
        };
        let mut rounding = step;
        let mut may_be = |others: &[([f64; 4], f64)]| {
            rounding += others.iter().map(|&(b, t)| (shadow(b, t) - exact).abs()).fold(0.0, f64::max);
        };
        for i in 0..4 {
            // Points between the ends count too: if the moments hardly leave two depths, the share is not monotonic.
            may_be(&[-1.0, -0.3, -0.1, 0.1, 0.3, 1.0].map(|part| {
                let mut other = b;
                other[i] += part * (own[i] + step);
                (other, found.depth)
            }));
        }
        for group in &found.others {
            let others: Vec<_> = group.iter().map(|m| (biased(*m, reconstruction), found.depth)).collect();
            may_be(&others);
        }
        may_be(&[-1.0, -0.5, 0.5, 1.0].map(|part| (b, found.depth + part * (found.depth_error + step))));
        // Rounding decides whether the divisors are large enough.
        let near = (0.5..2.0).contains(&(fourth_depth(b, found.depth).1 / LEAST_DIVISOR));
        if reconstruction.hausdorff && near {
            rounding += (exact - self::shadow(b, found.depth, false)).abs().max(0.05);
        }
        (1.0 - exact, rounding)
    })
}

/// Returns the moments, a share of them replaced by those that are certainly possible.
fn biased(stored: [f64; 4], reconstruction: &Reconstruction) -> [f64; 4] {
    let b = if reconstruction.bits_16 { unpack(stored) } else { stored };
    let fourth = if reconstruction.bits_16 { 0.628 } else { 0.375 };
    let (share, possible) = (f64::from(reconstruction.moment_bias), [0.0, fourth, 0.0, fourth]);
    std::array::from_fn(|i| (1.0 - share) * b[i] + share * possible[i])
}

/// Returns the least share of depths in front of `t`: over all distributions with the moments `b`, or with `hausdorff`
/// over those from -1 to 1.
///
/// The distribution that has it consists of `t` and two more depths: the roots of the quadratic polynomial that is
/// orthogonal, under the moments, to all that vanish at `t`.
///
/// ```
/// use edgeshade::reference::filtering::msm::shadow;
/// // A quarter of the depths at -0.5, the rest at 0.25: behind both, and between them.
/// let b = std::array::from_fn(|i| 0.25 * (-0.5f64).powi(i as i32 + 1) + 0.75 * 0.25f64.powi(i as i32 + 1));
/// assert!((shadow(b, 0.1, false) - 0.25).abs() < 1e-6);
/// assert!((shadow(b, 0.6, false) - 1.0).abs() < 1e-6);
/// assert!(shadow(b, -0.9, false) < 1e-6);
/// ```
pub fn shadow(b: [f64; 4], t: f64, hausdorff: bool) -> f64 {
    let [b1, b2, b3, _] = b;
    let hamburger = match others(b, t) {
        // Only the mean and the variance are left.
        None => {
            let (d, variance) = (t - b1, (b2 - b1 * b1).max(1e-7));
            return if d > 0.0 { d * d / (variance + d * d) } else { 0.0 };
        }
        Some(depths) => depths,
    };
    let share = hamburger.iter().filter(|(z, _)| *z < t).map(|(_, w)| w).sum::<f64>().clamp(0.0, 1.0);
    if !hausdorff || hamburger.iter().all(|(z, _)| z.abs() <= 1.0) || t.abs() >= 1.0 {
        return share;
    }
    let (z, divisor) = fourth_depth(b, t);
    if z.is_nan() || z.abs() >= 1.0 || divisor < LEAST_DIVISOR {
        return share;
    }
    // Mean of a polynomial of degree 3 with these roots.
    let mean = |[p, q, r]: [f64; 3]| b3 - (p + q + r) * b2 + (p * q + q * r + r * p) * b1 - p * q * r;
    let at_near = mean([z, t, 1.0]) / ((-1.0 - z) * (-1.0 - t) * -2.0);
    let at_z = mean([-1.0, t, 1.0]) / ((z + 1.0) * (z - t) * (z - 1.0));
    share.max(at_near + if z < t { at_z } else { 0.0 }).min(1.0)
}

/// Smallest divisor of the shader's weights.
const LEAST_DIVISOR: f64 = 1e-4;

/// Returns the depth that goes with `t` and both ends of the range, and the smallest number that weights are divided by:
/// 1 - x^2 times the two factors of the depths has the mean 0.
fn fourth_depth([b1, b2, b3, b4]: [f64; 4], t: f64) -> (f64, f64) {
    let z = (b4 - b2 + t * (b1 - b3)) / (t * (1.0 - b2) + b3 - b1);
    (z, ((1.0 - z * z) * (z - t).abs()).min((1.0 + z) * (1.0 + t)))
}

/// Returns the two depths beside `t` with their weights; `None` if the moments are not possible.
pub(crate) fn others([b1, b2, b3, b4]: [f64; 4], t: f64) -> Option<[(f64, f64); 2]> {
    // Polynomials of degree 1 and 2 that are orthogonal to those of lower degree, and the means of their squares.
    let d1 = b2 - b1 * b1;
    let l = (b3 - b1 * b2) / d1;
    let (p1, p2) = (t - b1, t * t - b2 - l * (t - b1));
    let spread = b4 - b2 * b2;
    let d2 = (spread - l * l * d1).max(spread / 4194304.0);
    if d1 <= 0.0 || d2 <= 0.0 {
        return None;
    }
    // 1 + p1(t) p1(x) / d1 + p2(t) p2(x) / d2 vanishes at the other two depths; times d2.
    let c2 = p2;
    let c1 = d2 * p1 / d1 - p2 * l;
    let c0 = d2 * (1.0 - p1 * b1 / d1) + p2 * (l * b1 - b2);
    if c2.abs() < 1e-12 * c1.abs() || c2 == 0.0 {
        let z = if c1 == 0.0 { return Some([(2.0, 0.0); 2]) } else { -c0 / c1 };
        let w = if z == t { 0.0 } else { ((b1 - t) / (z - t)).clamp(0.0, 1.0) };
        return Some([(z, w), (2.0, 0.0)]);
    }
    // The root of the larger size first, without cancellation.
    let root = (c1 * c1 - 4.0 * c2 * c0).max(0.0).sqrt();
    let q = -0.5 * (c1 + if c1 >= 0.0 { root } else { -root });
    let (z1, z2) = (q / c2, if q == 0.0 { 0.0 } else { c0 / q });
    let weight = |z: f64, other: f64| {
        let area = (z - t) * (z - other);
        if area == 0.0 { 0.0 } else { (b2 - b1 * (t + other) + t * other) / area }
    };
    Some([(z1, weight(z1, z2)), (z2, weight(z2, z1))])
}
