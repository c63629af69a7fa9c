//! Mirror of `glsl/common/soft_receiver.glsl`, `blockers.glsl`, and of `searchWindow` and `classify` in `hsm.glsl`.
//!
//! Positions, widths and distances carry a bound on what rounding may have changed in them. If a tap's position or
//! test is in doubt, it may or may not have found a blocker. Then the mean distance lies in an interval, and so does
//! the width of the filter.
//!
//! `quad_classes.glsl` decides four pixels by one window around theirs. `SoftReceiver::classify_texels` tells which of
//! its decisions are right.

use super::area_light::AreaLight;
use super::depth_bounds;
use super::hsm::Hsm;
use super::map_receiver::OpenReceiver;
use super::view::{Decision, ROUNDING, Verdict, View, shadow_test};
use crate::technique::common::depth_bounds::BLOCKS;
use glam::{DVec2, dvec2};

/// Class of a pixel by the depths in its search window. The test is conservative: the visibility of `Umbra` and `Lit`
/// is final.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Class {
    /// All texels of the window shadow the pixel.
    Umbra,
    /// No texel of the window shadows the pixel.
    Lit,
    /// Undecided.
    Penumbra,
}

/// Way to classify a pixel.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ClassBy {
    /// Depth bounds of the map under the window, as the shaders do.
    Bounds,
    /// Tests of all texels in the window.
    Texels,
}

/// Class of a pixel, with the other classes that rounding may lead to.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Classified {
    /// Class in exact arithmetic.
    pub likely: Class,
    /// `true` for each class that is possible, indexed by [`Class`].
    possible: [bool; 3],
}

impl Classified {
    pub(crate) const OPEN: Self = Self { likely: Class::Penumbra, possible: [true; 3] };

    pub(crate) fn sure(class: Class) -> Self {
        let mut possible = [false; 3];
        possible[class as usize] = true;
        Self { likely: class, possible }
    }

    /// Returns whether the class is possible.
    pub fn explains(&self, class: Class) -> bool {
        self.possible[class as usize]
    }

    /// Returns whether more than one class is possible.
    pub fn is_doubtful(&self) -> bool {
        self.possible.iter().filter(|p| **p).count() > 1
    }

    /// Returns the class of a pixel that is decided without reading a texel.
    pub(crate) fn decided(verdict: Verdict) -> Self {
        if verdict.doubt > 0.0 {
            return Self::OPEN;
        }
        Self::sure(if verdict.visibility > 0.5 { Class::Lit } else { Class::Umbra })
    }

    /// Returns the class of the first decision that holds.
    fn first_of(decisions: impl IntoIterator<Item = (Decision, Class)>) -> Self {
        let (mut likely, mut possible) = (None, [false; 3]);
        for (decision, class) in decisions {
            possible[class as usize] |= decision != Decision::No;
            if decision.is_yes() {
                likely = likely.or(Some(class));
            }
            if decision == Decision::Yes {
                return Self { likely: likely.unwrap_or(class), possible };
            }
        }
        possible[Class::Penumbra as usize] = true;
        Self { likely: likely.unwrap_or(Class::Penumbra), possible }
    }

    fn or(self, other: Self) -> Self {
        let possible = std::array::from_fn(|i| self.possible[i] || other.possible[i]);
        Self { possible, ..self }
    }
}

/// Depth bounds that pixels are classified by.
#[derive(Clone, Debug)]
pub struct MapClasses {
    /// Pyramid of smallest and largest depths.
    pub hsm: Hsm,
    /// Depth bounds around sloped planes, from the smallest blocks up.
    pub blocks: [depth_bounds::Level; BLOCKS.len()],
}

impl MapClasses {
    /// Builds the bounds from a map's depths, row by row from the top.
    pub fn new(shadow_map: &[f32], map_size: [u32; 2]) -> Self {
        Self { hsm: Hsm::new(shadow_map, map_size), blocks: depth_bounds::blocks(shadow_map, map_size) }
    }
}

/// Largest error of a position, texels, that is followed up. A position with a larger error may give anything, and
/// trying everything that it may read would take too long. Up to this error, at most two texels per axis are possible.
const MOST_DOUBTED: f64 = 0.5;

/// Returns whether a position whose error is bounded by `error` texels is followed up; NaN is not.
pub(crate) fn is_followed(error: DVec2) -> bool {
    error.cmple(DVec2::splat(MOST_DOUBTED)).all()
}

/// Value with a bound on its error.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Bounded<T> {
    pub value: T,
    pub error: T,
}

/// `SoftReceiver`.
pub(crate) struct SoftReceiver {
    /// Position in the map, texels.
    pub at: Bounded<DVec2>,
    pub depth: Bounded<f64>,
    /// Depth slope of the receiver plane per texel.
    pub slope: Bounded<DVec2>,
    pub z: Bounded<f64>,
}

/// Form of a blocker search.
#[derive(Clone, Copy, Debug, Default)]
pub struct SearchForm {
    /// Stored depths are averaged, and the mean's distance is taken, instead of distances.
    pub mean_depth: bool,
    /// All texels are compared with the receiver's own depth instead of its plane.
    pub fixed_depth: bool,
}

/// Mirror of `lightDistance` for a depth.
pub(crate) fn distance(a: &AreaLight, depth: f64, error: f64) -> Bounded<f64> {
    let value = a.distance(depth);
    let error = if a.depth_scale > 0.0 {
        value * value / a.depth_scale * (error + ROUNDING * a.depth_offset)
    } else {
        error * a.depth_offset
    };
    Bounded { value, error: error + ROUNDING * value.abs() }
}

/// Mirror of `filterHalfWidth`.
pub(crate) fn half_width(a: &AreaLight, z: Bounded<f64>, z_blocker: Bounded<f64>) -> Bounded<DVec2> {
    let value = a.filter_half_width(z.value, z_blocker.value);
    let between = z.error + z_blocker.error + ROUNDING * (z.value.abs() + z_blocker.value.abs());
    let (inverse, relative) = if a.depth_scale > 0.0 {
        (1.0 / (z.value * z_blocker.value), z.error / z.value + z_blocker.error / z_blocker.value)
    } else {
        (1.0, 0.0)
    };
    Bounded { value, error: a.uv * between * inverse.abs() + value * (relative.abs() + 2.0 * ROUNDING) }
}

/// Mirror of `windowTexels`.
pub(crate) fn texels(view: &View<'_>, half_width: Bounded<DVec2>) -> Bounded<DVec2> {
    let extent = view.map_extent();
    let value = (half_width.value * extent).min(DVec2::splat(65536.0));
    Bounded { value, error: half_width.error * extent + ROUNDING * value }
}

/// Returns all integers that rounding the value down may give.
pub(crate) fn floors(value: f64, error: f64) -> std::ops::RangeInclusive<i64> {
    (value - error).floor() as i64..=(value + error).floor() as i64
}

impl SoftReceiver {
    pub fn new(view: &View<'_>, a: &AreaLight, r: &OpenReceiver, form: SearchForm) -> Self {
        let (l, plane, extent) = (&r.light, &r.plane, view.map_extent());
        let at = l.uv * extent;
        let flat = if form.fixed_depth { 0.0 } else { 1.0 };
        let slope = flat * plane.slope / extent;
        let depth = l.depth - r.bias;
        let depth_error = l.depth_error + r.bias_error + ROUNDING;
        Self {
            at: Bounded { value: at, error: l.uv_error * extent + ROUNDING * at.abs() },
            depth: Bounded { value: depth, error: depth_error },
            slope: Bounded { value: slope, error: flat * plane.error / extent + ROUNDING * slope.abs() },
            z: distance(a, depth, depth_error),
        }
    }

    /// Mirror of `softReference`.
    fn reference(&self, texel: [i64; 2]) -> (f64, f64) {
        let away = dvec2(texel[0] as f64, texel[1] as f64) + 0.5 - self.at.value;
        let (slope, slope_error) = (self.slope.value.abs(), self.slope.error);
        let error = self.depth.error
            + slope.dot(self.at.error)
            + slope_error.dot(away.abs())
            + ROUNDING * (1.0 + slope.dot(away.abs() + 1.0));
        (self.depth.value + self.slope.value.dot(away), error)
    }

    /// Tests a texel against the receiver's plane: yes if lit. Outside the map its border texels repeat.
    pub fn test(&self, view: &View<'_>, texel: [i64; 2]) -> Decision {
        let texel = view.nearest_texel(texel);
        let (depth, error) = self.reference(texel);
        shadow_test(depth, error, view.stored(texel))
    }

    /// Returns the position of tap `i` of `n` along an axis of a window, and the bound of its error.
    pub fn tap(&self, half: Bounded<DVec2>, axis: usize, i: i64, n: i64) -> (f64, f64) {
        let t = (2 * i + 1) as f64 / n as f64 - 1.0;
        let place = self.at.value[axis] + t * half.value[axis];
        let error = self.at.error[axis]
            + t.abs() * half.error[axis]
            + ROUNDING * (self.at.value[axis].abs() + half.value[axis]);
        (place, error)
    }

    /// Mirror of `searchWindow`, in uv. Returns every window that rounding may lead to, the most likely first; `None`
    /// where positions are in doubt by more than [`MOST_DOUBTED`]. `reach` is the half-width of the filter, as a
    /// multiple of the penumbra's half-width.
    pub fn search_windows(
        &self,
        a: &AreaLight,
        view: &View<'_>,
        hsm: Option<&Hsm>,
        reach: f64,
    ) -> Option<Vec<Bounded<DVec2>>> {
        let near = a.near();
        let near = Bounded { value: near, error: ROUNDING * near };
        let window = |z_nearest| {
            let w = half_width(a, self.z, z_nearest);
            // Multiplying by 1 does not round.
            let rounding = if reach == 1.0 { 0.0 } else { ROUNDING };
            Bounded { value: w.value * reach, error: w.error * reach + rounding * reach * w.value }
        };
        let mut windows = vec![window(near)];
        if !is_followed(self.at.error) {
            return None;
        }
        let Some(hsm) = hsm else { return Some(windows) };
        for _ in 0..2 {
            let mut next: Vec<Bounded<DVec2>> = vec![];
            for wide in windows {
                for [first, last] in self.ranges(texels(view, wide), 0.0)? {
                    let nearest = distance(a, hsm.bounds(first, last)[0].into(), 0.0);
                    let nearest = if nearest.value < near.value { near } else { nearest };
                    let narrow = window(nearest);
                    if !next.contains(&narrow) {
                        next.push(narrow);
                    }
                }
            }
            windows = next;
        }
        Some(windows)
    }

    /// Mirror of `classify` by pyramid and blocks, for any of these windows (uv).
    pub fn classify(&self, view: &View<'_>, map: &MapClasses, windows: &[Bounded<DVec2>], margin: f64) -> Classified {
        let mut found: Option<Classified> = None;
        for window in windows {
            let Some(ranges) = self.ranges(texels(view, *window), margin) else { return Classified::OPEN };
            for range in ranges {
                let class = self.classify_range(view, map, range);
                found = Some(found.map_or(class, |f| f.or(class)));
            }
        }
        found.unwrap_or(Classified::OPEN)
    }

    /// Classifies by the tests of all texels in the windows: the class that no bounds can improve.
    pub fn classify_texels(&self, view: &View<'_>, windows: &[Bounded<DVec2>], margin: f64) -> Classified {
        let mut found: Option<Classified> = None;
        for window in windows {
            let Some(ranges) = self.ranges(texels(view, *window), margin) else { return Classified::OPEN };
            for [first, last] in ranges {
                let (mut lit, mut dark) = (Decision::Yes, Decision::Yes);
                for y in first[1]..=last[1] {
                    for x in first[0]..=last[0] {
                        let test = self.test(view, [x, y]);
                        (lit, dark) = (lit.and(test), dark.and(test.opposite()));
                    }
                    if (lit, dark) == (Decision::No, Decision::No) {
                        break;
                    }
                }
                let class = Classified::first_of([(lit, Class::Lit), (dark, Class::Umbra)]);
                found = Some(found.map_or(class, |f| f.or(class)));
            }
        }
        found.unwrap_or(Classified::OPEN)
    }

    fn classify_range(&self, view: &View<'_>, map: &MapClasses, [first, last]: [[i64; 2]; 2]) -> Classified {
        let [low, high] = map.hsm.bounds(first, last).map(f64::from);
        let corner = |t: [i64; 2]| dvec2(t[0] as f64, t[1] as f64);
        let slope = self.slope.value.abs();
        let (middle, reach) =
            (0.5 * (corner(first) + corner(last)) + 0.5 - self.at.value, 0.5 * (corner(last) - corner(first)));
        let (depth, rise) = (self.depth.value + self.slope.value.dot(middle), slope.dot(reach));
        let away = middle.abs() + reach;
        let rounding = 2.5e-7 + 5e-7 * slope.dot(away);
        let error = self.depth.error
            + slope.dot(self.at.error)
            + self.slope.error.dot(away)
            + ROUNDING * (1.0 + 2.0 * slope.dot(away));
        // An empty texel never shadows, whatever the reference.
        let lit = match low < 1.0 {
            true => Decision::positive(low - (depth + rise + rounding), error),
            false => Decision::Yes,
        };
        let dark = match high < 1.0 {
            true => Decision::positive(depth - rise - rounding - high, error),
            false => Decision::No,
        };
        let by_hsm = [(lit, Class::Lit), (dark, Class::Umbra)];
        let wider = (last[0] - first[0]).max(last[1] - first[1]);
        let inside = (0..2).all(|i| first[i] >= 0 && last[i] < view.map_size[i] as i64);
        if !inside || wider >= 192 {
            return Classified::first_of(by_hsm);
        }
        let level = [24, 48, 96].iter().filter(|&&n| wider >= n).count();
        let [lit, dark] = self.decide_blocks(&map.blocks[level], [first, last], error);
        Classified::first_of(by_hsm.into_iter().chain([(lit, Class::Lit), (dark, Class::Umbra)]))
    }

    /// Mirror of `decideBlocks` as `classify` calls it: whether all texels are lit, and whether all are in shadow.
    fn decide_blocks(&self, level: &depth_bounds::Level, [first, last]: [[i64; 2]; 2], error: f64) -> [Decision; 2] {
        let size = level.block as i64;
        let vector = |t: [i64; 2]| dvec2(t[0] as f64, t[1] as f64);
        let plane = self.slope.value;
        let to_first = vector(first) + 0.5 - self.at.value;
        let spread = to_first.abs() + vector([last[0] - first[0], last[1] - first[1]]);
        let rounding = 2.5e-7 + 5e-7 * plane.abs().dot(spread);
        let (mut lit, mut dark) = (Decision::Yes, Decision::Yes);
        for y in first[1] / size..=last[1] / size {
            for x in first[0] / size..=last[0] / size {
                let bounds = level.at([x as usize, y as usize]);
                let corner = [size * x, size * y];
                let low = vector([first[0].max(corner[0]), first[1].max(corner[1])]);
                let high = vector([last[0].min(corner[0] + size - 1), last[1].min(corner[1] + size - 1)]);
                let (middle, half) = (0.5 * (low + high), 0.5 * (high - low));
                let from_block = middle - vector(corner) - 0.5 * (size as f64 - 1.0);
                let reach = bounds.slope.abs();
                let depth = self.depth.value + plane.dot(middle + 0.5 - self.at.value);
                let stored = bounds.slope.dot(from_block);
                let off = rounding + 5e-7 * (plane.abs() + reach).dot(DVec2::splat(size as f64));
                let slack = (plane - bounds.slope).abs().dot(half) + off;
                // The bounds themselves have single precision.
                let error = error + 3e-7 * (1.0 + (plane.abs() + reach).dot(DVec2::splat(size as f64)));
                lit = lit.and(Decision::positive(stored + bounds.low - depth - slack, error));
                let farthest = stored + bounds.high + reach.dot(half);
                let filled = match reach == DVec2::ZERO {
                    // Exact: no slope was subtracted.
                    true if farthest < 1.0 => Decision::Yes,
                    true => Decision::No,
                    false => Decision::positive(1.0 - farthest - off, error),
                };
                dark = dark.and(Decision::positive(depth - slack - stored - bounds.high, error)).and(filled);
            }
        }
        [lit, dark]
    }

    /// Mirror of `windowRange`: returns at most 16 ranges.
    pub fn ranges(&self, half: Bounded<DVec2>, margin: f64) -> Option<Vec<[[i64; 2]; 2]>> {
        let reach = half.value * 1.00001 + (margin + 0.01);
        let error = half.error + self.at.error + ROUNDING * (self.at.value.abs() + reach);
        if !is_followed(error) {
            return None;
        }
        let mut ranges = vec![[[0; 2]; 2]];
        for (end, axis) in [(0, 0), (0, 1), (1, 0), (1, 1)] {
            let place = self.at.value[axis] + if end == 0 { -reach[axis] } else { reach[axis] };
            let likely = place.floor() as i64;
            let mut all = vec![];
            for t in std::iter::once(likely).chain(floors(place, error[axis]).filter(|&t| t != likely)) {
                for range in &ranges {
                    let mut range = *range;
                    range[end][axis] = t;
                    all.push(range);
                }
            }
            ranges = all;
        }
        Some(ranges)
    }
}

impl SearchForm {
    /// Mirror of `blockerValue`: what is averaged for a stored depth.
    pub(crate) fn value(self, a: &AreaLight, stored: f64) -> f64 {
        if self.mean_depth { stored } else { a.distance(stored) }
    }

    /// Mirror of `blockerDistance`.
    pub(crate) fn distance(self, a: &AreaLight, mean: f64) -> f64 {
        if self.mean_depth { a.distance(mean) } else { mean }
    }

    /// Returns the distance of a mean of up to `farthest` after so many roundings.
    pub(crate) fn distance_of_mean(self, a: &AreaLight, mean: f64, farthest: f64, roundings: f64) -> Bounded<f64> {
        if self.mean_depth {
            return distance(a, mean, ROUNDING * roundings * farthest);
        }
        // Each distance and each addition is rounded.
        let depth = if a.depth_scale > 0.0 { a.depth_offset - a.depth_scale / farthest } else { 0.0 };
        Bounded { value: mean, error: distance(a, depth, 0.0).error + ROUNDING * roundings * farthest }
    }
}

/// Result of a blocker search.
pub(crate) struct Blockers {
    /// Mean distance by the most likely decisions; `None` without blockers.
    pub z: Option<Bounded<f64>>,
    /// Smallest and largest mean where decisions are in doubt; `None` if no blocker is possible.
    pub range: Option<[f64; 2]>,
    /// `true` if blockers may be found or not, depending on rounding.
    pub doubtful: bool,
}

/// One tap of a blocker search.
struct Tap {
    /// Distance by the most likely decision; `None` if the tap does not block.
    likely: Option<f64>,
    /// Smallest and largest distance that the tap may find.
    range: [f64; 2],
    /// `true` if the tap surely blocks.
    sure: bool,
}

/// Mirror of `findBlockers` over a window in uv.
pub(crate) fn find_blockers(
    view: &View<'_>,
    r: &SoftReceiver,
    a: &AreaLight,
    window: Bounded<DVec2>,
    taps: i64,
    form: SearchForm,
) -> Blockers {
    let half = texels(view, window);
    let columns: Vec<_> = (0..taps).map(|i| r.tap(half, 0, i, taps)).collect();
    let rows: Vec<_> = (0..taps).map(|j| r.tap(half, 1, j, taps)).collect();
    let mut found = vec![];
    for &(y, y_error) in &rows {
        for &(x, x_error) in &columns {
            let likely = [x.floor() as i64, y.floor() as i64];
            let mut tap = Tap { likely: None, range: [f64::INFINITY, f64::NEG_INFINITY], sure: true };
            for v in floors(y, y_error) {
                for u in floors(x, x_error) {
                    let lit = r.test(view, [u, v]);
                    let z = form.value(a, view.stored(view.nearest_texel([u, v])));
                    if !lit.is_yes() || lit.is_doubtful() {
                        tap.range = [tap.range[0].min(z), tap.range[1].max(z)];
                    }
                    if !lit.is_yes() && [u, v] == likely {
                        tap.likely = Some(z);
                    }
                    tap.sure &= !lit.is_yes() && !lit.is_doubtful();
                }
            }
            if tap.range[0] <= tap.range[1] {
                found.push(tap);
            }
        }
    }
    let likely: Vec<f64> = found.iter().filter_map(|t| t.likely).collect();
    let doubtful = !found.is_empty() && !found.iter().any(|t| t.sure);
    let decided = found.iter().all(|t| t.sure && t.range[0] == t.range[1]);
    let extreme = |end: usize, farther: fn(f64, f64) -> bool| {
        let sure: Vec<f64> = found.iter().filter(|t| t.sure).map(|t| t.range[end]).collect();
        let mut open: Vec<f64> = found.iter().filter(|t| !t.sure).map(|t| t.range[end]).collect();
        open.sort_by(|a, b| if farther(*a, *b) { std::cmp::Ordering::Less } else { std::cmp::Ordering::Greater });
        let (mut sum, mut count) = (sure.iter().sum::<f64>(), sure.len());
        for z in open {
            if count == 0 || farther(z, sum / count as f64) {
                (sum, count) = (sum + z, count + 1);
            }
        }
        sum / count as f64
    };
    Blockers {
        z: (!likely.is_empty()).then(|| {
            let mean = likely.iter().sum::<f64>() / likely.len() as f64;
            let farthest = found.iter().map(|t| t.range[1]).fold(mean, f64::max);
            form.distance_of_mean(a, mean, farthest, (2 * taps) as f64)
        }),
        range: (!found.is_empty() && !decided)
            .then(|| [extreme(0, |a, b| a < b), extreme(1, |a, b| a > b)].map(|mean| form.distance(a, mean))),
        doubtful,
    }
}
