//! Mirror of `glsl/soft/soft_filter.glsl`: the mean of the tests in a window, exact or by taps.

use crate::reference::common::blockers::{Bounded, SoftReceiver, floors};
use crate::reference::common::view::{ROUNDING, Verdict, View};
use glam::{DVec2, dvec2};

/// Mirror of `filterBox` over a half-width in texels.
pub(super) fn filter_box(view: &View<'_>, r: &SoftReceiver, half: Bounded<DVec2>) -> Verdict {
    let (low, high) = (r.at.value - half.value, r.at.value + half.value);
    let error = r.at.error + half.error + ROUNDING * (r.at.value.abs() + half.value);
    let share = |t: i64, axis: usize| ((t + 1) as f64).min(high[axis]) - (t as f64).max(low[axis]);
    let area = 4.0 * half.value.x * half.value.y;
    let (mut sum, mut doubtful) = (0.0, 0.0);
    let (mut lit, mut dark) = (false, false);
    for y in (low.y - error.y).floor() as i64..=(high.y + error.y).floor() as i64 {
        for x in (low.x - error.x).floor() as i64..=(high.x + error.x).floor() as i64 {
            let test = r.test(view, [x, y]);
            let weight = share(x, 0).max(0.0) * share(y, 1).max(0.0);
            if test.is_yes() {
                sum += weight;
            }
            if test.is_doubtful() {
                doubtful += weight;
            }
            lit |= test.is_yes() || test.is_doubtful();
            dark |= !test.is_yes() || test.is_doubtful();
        }
    }
    // A window that moves or grows by its error changes by at most a strip at each side.
    let slid = 2.0 * (error / half.value).element_sum();
    let rounding = if lit && dark { slid + ROUNDING * half.value.element_sum() } else { 0.0 };
    Verdict { visibility: (sum / area).clamp(0.0, 1.0), doubt: (doubtful / area).min(1.0), rounding: rounding.min(1.0) }
}

/// Mirror of `filterTaps` over a half-width in texels.
pub(super) fn filter_taps(view: &View<'_>, r: &SoftReceiver, half: Bounded<DVec2>, n: i64, bilinear: bool) -> Verdict {
    let mut verdict = Verdict::sure(0.0);
    let columns: Vec<_> = (0..n).map(|i| r.tap(half, 0, i, n)).collect();
    let rows: Vec<_> = (0..n).map(|j| r.tap(half, 1, j, n)).collect();
    for &(y, y_error) in &rows {
        for &(x, x_error) in &columns {
            let tap = if bilinear {
                tap_2x2(view, r, dvec2(x, y) - 0.5, dvec2(x_error, y_error))
            } else {
                tap_texel(view, r, dvec2(x, y), dvec2(x_error, y_error))
            };
            verdict.visibility += tap.visibility;
            verdict.doubt += tap.doubt;
            verdict.rounding += tap.rounding;
        }
    }
    let taps = (n * n) as f64;
    let uniform = verdict.visibility == 0.0 || verdict.visibility == taps;
    Verdict {
        visibility: verdict.visibility / taps,
        doubt: (verdict.doubt / taps).min(1.0),
        rounding: verdict.rounding / taps + if uniform { 0.0 } else { ROUNDING * (2 * n) as f64 },
    }
}

fn tap_texel(view: &View<'_>, r: &SoftReceiver, place: DVec2, error: DVec2) -> Verdict {
    let likely = r.test(view, [place.x.floor() as i64, place.y.floor() as i64]);
    let mut doubtful = likely.is_doubtful();
    for y in floors(place.y, error.y) {
        for x in floors(place.x, error.x) {
            let test = r.test(view, [x, y]);
            doubtful |= test.is_doubtful() || test.is_yes() != likely.is_yes();
        }
    }
    Verdict { visibility: f64::from(likely.is_yes()), doubt: f64::from(doubtful), rounding: 0.0 }
}

fn tap_2x2(view: &View<'_>, r: &SoftReceiver, place: DVec2, error: DVec2) -> Verdict {
    let first = place.floor();
    let f = place - first;
    let (mut sum, mut doubt) = (0.0, 0.0);
    let (mut lit, mut dark) = (false, false);
    for y in (place.y - error.y).floor() as i64..=(place.y + error.y).floor() as i64 + 1 {
        for x in (place.x - error.x).floor() as i64..=(place.x + error.x).floor() as i64 + 1 {
            let test = r.test(view, [x, y]);
            let weight = |t: i64, axis: usize| match t - first[axis] as i64 {
                0 => 1.0 - f[axis],
                1 => f[axis],
                _ => 0.0,
            };
            let weight = weight(x, 0) * weight(y, 1);
            sum += if test.is_yes() { weight } else { 0.0 };
            doubt += if test.is_doubtful() { weight } else { 0.0 };
            lit |= test.is_yes() || test.is_doubtful();
            dark |= !test.is_yes() || test.is_doubtful();
        }
    }
    let rounding = if lit && dark { (error.element_sum() + ROUNDING).min(1.0) } else { 0.0 };
    let visibility = if lit && dark { sum } else { f64::from(lit) };
    Verdict { visibility, doubt, rounding }
}
