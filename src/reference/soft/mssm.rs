//! Mirror of `glsl/soft/mssm.comp`.

use super::window_moments::{self, Pixel, Settings, Window};
use crate::Result;
use crate::reference::common::view::{FrameData, Mirror};
use crate::reference::filtering::moments::unpack;
use crate::reference::filtering::msm::{others, shadow};

/// Returns the visibility of every pixel from the table that the GPU made. `moment_bias` is the share of moments that are
/// certainly possible.
///
/// # Errors
/// Fails if the images do not fit the constants.
pub fn visibility(data: &FrameData<'_>, table: &[[u32; 4]], settings: &Settings, moment_bias: f32) -> Result<Mirror> {
    let moments = |p: &Pixel<'_>, w: &Window| {
        let (b, share) = (unpack(p.mean(w, w.low, w.high)), f64::from(moment_bias));
        let possible = [0.0, 0.628, 0.0, 0.628];
        p.reconstructed(w, std::array::from_fn(|i| (1.0 - share) * b[i] + share * possible[i]))
    };
    window_moments::visibility(data, table, settings, |p| {
        let w = p.search_window();
        let b = moments(p, &w);
        let share = shadow(b, w.t, false);
        if share > 0.99 {
            return 0.0;
        }
        let blocker = blocker(b, w.t).max(p.nearest.min(w.t)).min(w.t);
        let w = p.filter_window(blocker);
        p.reduced(1.0 - shadow(moments(p, &w), w.t, false))
    })
}

/// Returns the mean depth of what lies in front of `t`, over the distribution of three depths that has the moments `b`;
/// near `t` itself where hardly anything does.
///
/// ```
/// use edgeshade::reference::soft::mssm::blocker;
/// // A third of the depths at -0.5, the rest at the receiver's 0.25.
/// let b = std::array::from_fn(|i| (-0.5f64).powi(i as i32 + 1) / 3.0 + 0.25f64.powi(i as i32 + 1) * 2.0 / 3.0);
/// assert!((blocker(b, 0.249) + 0.5).abs() < 5e-3);
/// ```
pub fn blocker(b: [f64; 4], t: f64) -> f64 {
    const NOTHING: f64 = 1e-3;
    let depths = others(b, t).unwrap_or_else(|| {
        let (variance, away) = ((b[1] - b[0] * b[0]).max(1e-7), b[0] - t);
        let z = if away == 0.0 { 0.0 } else { b[0] + variance / away };
        [(z, away * away / (variance + away * away)), (0.0, 0.0)]
    });
    let blocking: f64 = depths.iter().filter(|(z, _)| *z < t).map(|(z, w)| z * w).sum();
    (NOTHING * t + blocking) / (NOTHING + shadow(b, t, false))
}
