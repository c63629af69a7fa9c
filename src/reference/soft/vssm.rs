//! Mirror of `glsl/soft/vssm.comp`.

use super::window_moments::{self, Pixel, Settings, Window};
use crate::Result;
use crate::reference::common::view::{FrameData, Mirror};
use glam::dvec2;

/// Returns the visibility of every pixel from the table that the GPU made. `cells` are the parts of a window along each
/// axis, and `least_variance` is of signed depths.
///
/// # Errors
/// Fails if the images do not fit the constants.
pub fn visibility(
    data: &FrameData<'_>,
    table: &[[u32; 4]],
    settings: &Settings,
    (cells, least_variance): (u32, f32),
) -> Result<Mirror> {
    let least = f64::from(least_variance);
    window_moments::visibility(data, table, settings, |p| {
        let w = p.search_window();
        let Some((moments, _)) = blocking(p, &w, cells) else { return 1.0 };
        let blocker = blocker(moments, w.t, least).max(p.nearest).min(w.t);
        let w = p.filter_window(blocker);
        let Some((moments, share)) = blocking(p, &w, cells) else { return 1.0 };
        p.reduced(1.0 - share * (1.0 - chebyshev(moments, w.t, least)))
    })
}

/// Returns the mean and the mean square over the cells whose mean lies in front of the receiver, and the share of the
/// window that they cover; `None` without any.
fn blocking(p: &Pixel<'_>, w: &Window, most: u32) -> Option<([f64; 2], f64)> {
    let size = w.high - w.low;
    let n = ((size.min_element() + 0.5) as u32).clamp(1, most);
    let cell = |i: u32, j: u32| w.low + size * dvec2(i.into(), j.into()) / f64::from(n);
    let all = (0..n).flat_map(|j| (0..n).map(move |i| (i, j)));
    let found: Vec<[f64; 2]> = all
        .map(|(i, j)| {
            let [unit, square, ..] = p.mean(w, cell(i, j), cell(i + 1, j + 1));
            let [mean, square, ..] = p.reconstructed(w, [2.0 * unit - 1.0, square, 0.0, 0.0]);
            [mean, square]
        })
        .filter(|[mean, _]| *mean < w.t)
        .collect();
    let count = found.len() as f64;
    let sum = |c: usize| found.iter().map(|m| m[c]).sum::<f64>();
    (count > 0.0).then(|| ([sum(0) / count, sum(1) / count], count / f64::from(n * n)))
}

fn chebyshev([mean, square]: [f64; 2], t: f64, least_variance: f64) -> f64 {
    let (variance, d) = ((square - mean * mean).max(least_variance), t - mean);
    if d <= 0.0 { 1.0 } else { variance / (variance + d * d) }
}

/// Returns the mean depth of what blocks, if everything else has the receiver's depth `t`.
///
/// ```
/// use edgeshade::reference::soft::vssm::blocker;
/// // A third of the depths at -0.5, the rest at the receiver's 0.25.
/// let [mean, square] = [-0.5 / 3.0 + 0.25 * 2.0 / 3.0, 0.25 / 3.0 + 0.0625 * 2.0 / 3.0];
/// assert!((blocker([mean, square], 0.25, 1e-9) + 0.5).abs() < 1e-9);
/// ```
pub fn blocker(moments: [f64; 2], t: f64, least_variance: f64) -> f64 {
    let lit = chebyshev(moments, t, least_variance).min(0.999);
    (moments[0] - lit * t) / (1.0 - lit)
}
