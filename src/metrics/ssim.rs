//! Structural similarity after Wang, Bovik, Sheikh and Simoncelli, "Image Quality Assessment: From Error Visibility to
//! Structural Similarity" (2004): one scale, grey, with a mask.

use super::{Planes, sum::sum_rows};

const TAPS: usize = 11;
const SIGMA: f64 = 1.5;
const C1: f64 = 0.01 * 0.01;
const C2: f64 = 0.03 * 0.03;

/// Returns the mean over the windows that lie entirely in picture and mask; `None` if there is none.
pub(crate) fn ssim(planes: &Planes) -> Option<f64> {
    if planes.width < TAPS || planes.height < TAPS {
        return None;
    }
    let weights = gaussian();
    let [count, sum] = sum_rows(planes.height - TAPS + 1, |top| window_row(planes, &weights, top));
    (count > 0.0).then(|| sum / count)
}

/// Returns the weights of the window along one dimension; their sum is 1.
fn gaussian() -> [f64; TAPS] {
    let centre = (TAPS / 2) as f64;
    let w: [f64; TAPS] = std::array::from_fn(|i| (-(i as f64 - centre).powi(2) / (2.0 * SIGMA * SIGMA)).exp());
    let sum: f64 = w.iter().sum();
    w.map(|v| v / sum)
}

/// Returns the number of windows whose first row is `top`, and the sum of their similarities.
fn window_row(planes: &Planes, weights: &[f64; TAPS], top: usize) -> [f64; 2] {
    let width = planes.width;
    // Vertically weighted x, y, x^2, y^2, xy of every column.
    let mut columns = vec![[0.0f64; 5]; width];
    let mut complete = vec![true; width];
    for (dy, &weight) in weights.iter().enumerate() {
        for (x, i) in planes.row(top + dy).enumerate() {
            complete[x] &= planes.mask[i];
            let (a, b) = (f64::from(planes.test[i]), f64::from(planes.truth[i]));
            let terms = [a, b, a * a, b * b, a * b];
            (0..5).for_each(|k| columns[x][k] += weight * terms[k]);
        }
    }
    let mut run = 0;
    let mut result = [0.0; 2];
    for x in 0..width {
        run = if complete[x] { run + 1 } else { 0 };
        if run < TAPS {
            continue;
        }
        let mut m = [0.0; 5];
        for (column, &weight) in columns[x + 1 - TAPS..=x].iter().zip(weights) {
            (0..5).for_each(|k| m[k] += weight * column[k]);
        }
        result[0] += 1.0;
        result[1] += similarity(m);
    }
    result
}

/// Returns the similarity from the weighted means of `x, y, x^2, y^2, xy`.
fn similarity([mx, my, mxx, myy, mxy]: [f64; 5]) -> f64 {
    let (vx, vy, cov) = (mxx - mx * mx, myy - my * my, mxy - mx * my);
    ((2.0 * (mx * my) + C1) * (2.0 * cov + C2)) / ((mx * mx + my * my + C1) * (vx + vy + C2))
}
