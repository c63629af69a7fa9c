//! Mirror of `glsl/soft/rbssm.comp`, with every tap computed separately.

use crate::Result;
use crate::reference::common::area_light::AreaLight;
use crate::reference::common::blockers::{self, Bounded, SoftReceiver, floors};
pub use crate::reference::common::blockers::{Class, ClassBy, Classified, MapClasses, SearchForm};
use crate::reference::common::hsm::Hsm;
use crate::reference::common::map_receiver::{MapReceiver, OpenReceiver, receive};
use crate::reference::common::rbsm_receiver::{PLACE_ROUNDING, Tests};
use crate::reference::common::view::{FrameData, Mirror, ROUNDING, Verdict, View};
use crate::reference::revectorization::rbsm;
use crate::reference::revectorization::revectorize::{self, Discontinuity, Function, Outcome};
use crate::technique::common::blocker_search::SearchWindow;
use crate::technique::soft::rbssm::{RbssmVisibility, Reuse};
use glam::{DVec2, DVec4, dvec2};

/// Settings of the technique.
#[derive(Clone, Copy, Debug)]
pub struct Settings {
    /// Number of blocker-search taps per axis.
    pub search_taps: u32,
    /// Number of filter taps per axis.
    pub filter_taps: u32,
    /// Rule for the size of the search window.
    pub window: SearchWindow,
    /// Form of the search; the filter compares texels with the same depth.
    pub form: SearchForm,
    /// Way to find the ends of runs. Only [`Reuse::AsPrinted`] changes the image.
    pub reuse: Reuse,
    /// Visibility function that the filter averages.
    pub visibility: RbssmVisibility,
    /// Smallest width of the filter, texels.
    pub least_width: f32,
    /// `MAXDIST`, texels.
    pub max_distance: u32,
    /// Normal offset, in multiples of what a plane needs.
    pub normal_offset: f32,
    /// Depth bias, as a fraction of the depth slope per texel, summed over both axes.
    pub depth_bias: f32,
}

impl Settings {
    pub(super) fn hard(&self) -> rbsm::Settings {
        rbsm::Settings {
            function: match self.visibility {
                RbssmVisibility::Recovery => Function::Silhouette,
                RbssmVisibility::Improved => Function::Star,
            },
            fixed_depth: self.form.fixed_depth,
            max_distance: self.max_distance,
            normal_offset: self.normal_offset,
            depth_bias: self.depth_bias,
            slack: 0.0,
        }
    }
}

/// Returns the visibility of every pixel.
///
/// # Errors
/// Fails if the images do not fit the constants.
pub fn visibility(data: &FrameData<'_>, settings: &Settings) -> Result<Mirror> {
    let view = View::new(data)?;
    let light = AreaLight::of(data.constants, 0);
    let hsm = Hsm::of_search(data, settings.window);
    let pixels = view.every_pixel(|p| match receive(&view, p, settings.normal_offset, settings.depth_bias) {
        MapReceiver::Decided(verdict) => verdict,
        MapReceiver::Open(open) => {
            let pixel = Pixel::new(&view, &light, &open, settings);
            let Some(windows) = pixel.soft.search_windows(&light, &view, hsm.as_ref(), 1.0) else {
                return open.with_doubts(Verdict::ANYTHING);
            };
            let verdicts = windows.into_iter().map(|window| pixel.search_and_filter(pixel.at_least(window)));
            open.with_doubts(verdicts.reduce(Verdict::or_verdict).unwrap_or(Verdict::sure(1.0)))
        }
    });
    Ok(Mirror::collect(pixels))
}

/// Returns the class of every pixel by its own window. The shader looks at one window for 2 x 2 pixels: it may leave pixels
/// open that the bounds under their own windows decide, or decide some by the slopes of coarser blocks.
///
/// # Errors
/// Fails if the images do not fit the constants.
pub fn classes(data: &FrameData<'_>, settings: &Settings, map: &MapClasses, by: ClassBy) -> Result<Vec<Classified>> {
    let view = View::new(data)?;
    let light = AreaLight::of(data.constants, 0);
    let hsm = (settings.window == SearchWindow::Blockers).then_some(&map.hsm);
    Ok(view.every_pixel(|p| match receive(&view, p, settings.normal_offset, settings.depth_bias) {
        MapReceiver::Decided(verdict) => Classified::decided(verdict),
        MapReceiver::Open(open) => {
            let pixel = Pixel::new(&view, &light, &open, settings);
            match pixel.soft.search_windows(&light, &view, hsm, 1.0) {
                Some(windows) if !open.is_doubtful() => {
                    let windows: Vec<_> = windows.into_iter().map(|w| pixel.at_least(w)).collect();
                    // Includes the ring of texels around the window, which discontinuities depend on.
                    match by {
                        ClassBy::Bounds => pixel.soft.classify(&view, map, &windows, 1.0),
                        ClassBy::Texels => pixel.soft.classify_texels(&view, &windows, 1.0),
                    }
                }
                _ => Classified::OPEN,
            }
        }
    }))
}

pub(super) struct Pixel<'a> {
    view: &'a View<'a>,
    light: &'a AreaLight,
    settings: &'a Settings,
    hard: rbsm::Settings,
    pub soft: SoftReceiver,
    pub tests: Tests<'a>,
}

impl<'a> Pixel<'a> {
    pub fn new(view: &'a View<'a>, light: &'a AreaLight, open: &OpenReceiver, settings: &'a Settings) -> Self {
        let hard = settings.hard();
        let (soft, tests) = (
            SoftReceiver::new(view, light, open, settings.form),
            Tests::new(view, open, &hard.receiver()).with_map_going_on(true),
        );
        Self { view, light, settings, hard, soft, tests }
    }

    /// Returns the smallest half-width of the filter, texels.
    fn least(&self) -> Bounded<DVec2> {
        let near = self.light.near();
        let near = Bounded { value: near, error: ROUNDING * near };
        let possible = blockers::texels(self.view, blockers::half_width(self.light, self.soft.z, near));
        let least = DVec2::splat(0.5 * f64::from(self.settings.least_width));
        let error = dvec2(
            if possible.value.x - possible.error.x < least.x { possible.error.x } else { 0.0 },
            if possible.value.y - possible.error.y < least.y { possible.error.y } else { 0.0 },
        );
        Bounded { value: least.min(possible.value), error }
    }

    /// Widens a search window to the smallest filter.
    pub fn at_least(&self, window: Bounded<DVec2>) -> Bounded<DVec2> {
        let (least, extent) = (self.least(), self.view.map_extent());
        Bounded {
            value: window.value.max(least.value / extent),
            error: window.error.max(least.error / extent + ROUNDING * least.value / extent),
        }
    }

    fn search_and_filter(&self, window: Bounded<DVec2>) -> Verdict {
        if !blockers::is_followed(self.soft.at.error + window.error * self.view.map_extent()) {
            return Verdict::ANYTHING;
        }
        let found = blockers::find_blockers(
            self.view,
            &self.soft,
            self.light,
            window,
            self.settings.search_taps.into(),
            self.settings.form,
        );
        let Some(z) = found.z else {
            let next_door = self.neighbouring_blockers(|z| self.filter(self.width(window, z)));
            return if found.range.is_some() { next_door.or(0.0).or(1.0) } else { next_door };
        };
        let verdict = self.filter_for(window, z, found.range);
        if found.doubtful { verdict.or(0.0).or(1.0) } else { verdict }
    }

    /// Filters for blockers at a mean distance. `range` holds the distances that decisions in doubt may lead to.
    pub fn filter_for(&self, window: Bounded<DVec2>, z: Bounded<f64>, range: Option<[f64; 2]>) -> Verdict {
        let mut verdict = self.filter(self.width(window, z));
        if range.is_some() {
            verdict.doubt = self.filter(self.width_for(window, z, range)).doubt;
        }
        verdict
    }

    /// Returns the half-width of the filter, texels, for blockers as in [`Self::filter_for`].
    pub fn width_for(&self, window: Bounded<DVec2>, z: Bounded<f64>, range: Option<[f64; 2]>) -> Bounded<DVec2> {
        let texels = self.width(window, z);
        let apart = range.map_or(DVec2::ZERO, |range| {
            let [a, b] = range.map(|value| self.width(window, Bounded { value, ..z }));
            (a.value - texels.value).abs().max((b.value - texels.value).abs())
        });
        Bounded { error: texels.error + apart, ..texels }
    }

    /// Returns the half-width of the filter, texels.
    fn width(&self, window: Bounded<DVec2>, z: Bounded<f64>) -> Bounded<DVec2> {
        let h = blockers::texels(self.view, blockers::half_width(self.light, self.soft.z, z));
        let (searched, least) = (blockers::texels(self.view, window), self.least());
        let clamped = |h: DVec2| h.max(least.value).min(searched.value);
        let value = clamped(h.value);
        // Rounding does not change a width that a clamp holds, but the clamps themselves may change.
        let moved = (clamped(h.value + h.error) - clamped(h.value - h.error)).max(DVec2::ZERO);
        Bounded { value, error: moved + searched.error.min(value * 1e-3) + least.error + ROUNDING * value }
    }

    /// Mirror of `neighbouringBlockers`; `follow` computes the verdict from their mean distance.
    pub fn neighbouring_blockers(&self, follow: impl Fn(Bounded<f64>) -> Verdict) -> Verdict {
        let mut found: Option<Verdict> = None;
        for own in self.tests.texels() {
            let texels = [[0, 0], [-1, 0], [1, 0], [0, 1], [0, -1]].map(|[x, y]| [own[0] + x, own[1] + y]);
            let tests = texels.map(|t| self.tests.test(own, t));
            let blockers: Vec<_> = (0..5)
                .filter(|&k| !tests[k].is_yes())
                .map(|k| self.settings.form.value(self.light, self.view.stored(self.view.nearest_texel(texels[k]))))
                .collect();
            let mut verdict = Verdict::sure(1.0);
            if !blockers.is_empty() {
                let mean = blockers.iter().sum::<f64>() / blockers.len() as f64;
                let farthest = blockers.iter().copied().fold(mean, f64::max);
                verdict = follow(self.settings.form.distance_of_mean(self.light, mean, farthest, 8.0));
            }
            if tests.iter().any(|t| t.is_doubtful()) {
                verdict = verdict.or(0.0).or(1.0);
            }
            found = Some(found.map_or(verdict, |first| first.or_verdict(verdict)));
        }
        // The loop visits at least the exact texel.
        found.unwrap_or(Verdict::sure(1.0))
    }

    /// Returns the mean of the taps over a half-width in texels.
    fn filter(&self, half: Bounded<DVec2>) -> Verdict {
        if !blockers::is_followed(half.error) {
            return Verdict::ANYTHING;
        }
        if self.settings.reuse == Reuse::AsPrinted {
            return self.filter_as_printed(half);
        }
        let n = i64::from(self.settings.filter_taps);
        let axis = |axis| (0..n).map(|i| self.soft.tap(half, axis, i, n)).collect::<Vec<_>>();
        let (columns, rows) = (axis(0), axis(1));
        let mut sum = Verdict::sure(0.0);
        for &(y, y_error) in &rows {
            for &(x, x_error) in &columns {
                let tap = self.tap(dvec2(x, y), dvec2(x_error, y_error));
                sum.visibility += tap.visibility;
                sum.doubt += tap.doubt;
            }
        }
        let taps = (n * n) as f64;
        Verdict { visibility: sum.visibility / taps, doubt: (sum.doubt / taps).min(1.0), rounding: ROUNDING }
    }

    /// Mirror of `filterAsPrinted` over a half-width in texels.
    fn filter_as_printed(&self, half: Bounded<DVec2>) -> Verdict {
        let n = i64::from(self.settings.filter_taps);
        let own = [self.tests.place.x.floor() as i64, self.tests.place.y.floor() as i64];
        let step = Bounded { value: 2.0 * half.value.x / n as f64, error: 2.0 * half.error.x / n as f64 };
        let (mut lit, mut in_doubt) = (0.0, 0.0);
        for j in 0..n {
            let (y, y_error) = self.soft.tap(half, 1, j, n);
            // Discontinuity and signed distances of the tap before, and how often they were moved; `in_doubt` from a
            // tap that rounding may change up to the next one without an edge.
            let mut before: Option<(Discontinuity, DVec4, f64)> = None;
            let mut doubtful = false;
            for i in 0..n {
                let (x, x_error) = self.soft.tap(half, 0, i, n);
                let texel = [x.floor() as i64, y.floor() as i64];
                let error = dvec2(x_error, y_error);
                let ((d, ends), unsure) = self.found(own, texel, dvec2(x, y), error);
                doubtful |= unsure;
                let Some(ends) = ends else {
                    before = None;
                    lit += f64::from(u8::from(d.lit));
                    in_doubt += f64::from(u8::from(doubtful));
                    doubtful = unsure;
                    continue;
                };
                let fraction = dvec2(x, y) - dvec2(texel[0] as f64, texel[1] as f64);
                let (distances, moves) = match before {
                    Some((last, mut rd, moves)) if last.mask & d.mask & 0b1100 != 0 => {
                        let by = if rd.y > 0.0 { -step.value } else { step.value };
                        (rd.x, rd.y) = (rd.x + by, rd.y + by);
                        (rd, moves + 1.0)
                    }
                    _ => (revectorize::distance_to_edge(fraction, ends), 0.0),
                };
                before = Some((d, distances, moves));
                let error = error.length() + PLACE_ROUNDING + moves * (step.error + ROUNDING * 64.0);
                // A distance near 0 may have either sign.
                doubtful |= moves > 0.0 && distances.x.abs().min(distances.y.abs()) <= error;
                let (visibility, margin) = visibility_at(self.hard.function, d, distances);
                lit += visibility;
                in_doubt += f64::from(u8::from(doubtful || margin <= error));
            }
        }
        let taps = (n * n) as f64;
        Verdict { visibility: lit / taps, doubt: (in_doubt / taps).min(1.0), rounding: ROUNDING }
    }

    /// Returns [`Self::ends`] at a place in a texel, and whether rounding may lead to others. On one run the next texel's
    /// ends are as far from the place.
    fn found(&self, own: [i64; 2], texel: [i64; 2], place: DVec2, error: DVec2) -> (Ends, bool) {
        let ask = |t: [i64; 2]| self.tests.ask(own, fingerprint, |lit| self.ends(&|t| lit(t), t));
        let distances = |t: [i64; 2], ends: Option<[i64; 4]>| {
            ends.map(|ends| revectorize::distance_to_edge(place - dvec2(t[0] as f64, t[1] as f64), ends))
        };
        let (found, doubt) = ask(texel);
        let here = distances(texel, found.1);
        let mut unsure = doubt > 0.0;
        for y in floors(place.y, error.y) {
            for x in floors(place.x, error.x) {
                let ((d, ends), doubt) = ask([x, y]);
                let same = match (here, distances([x, y], ends)) {
                    (Some(a), Some(b)) => (a - b).abs().max_element() < 1e-9,
                    (a, b) => a.is_none() && b.is_none(),
                };
                unsure |= doubt > 0.0 || d != found.0 || !same;
            }
        }
        (found, unsure)
    }

    /// Returns the discontinuity of a texel and the ends of its runs, if it is followed.
    fn ends(&self, lit: &impl Fn([i64; 2]) -> bool, texel: [i64; 2]) -> Ends {
        let d = revectorize::discontinuity(lit, texel);
        let followed = d.mask != 0 && (d.lit || self.hard.function != Function::Silhouette);
        (d, followed.then(|| revectorize::traverse_all(lit, texel, d, self.hard.max_distance)))
    }

    /// Returns the revectorized visibility at a position.
    fn tap(&self, place: DVec2, error: DVec2) -> Verdict {
        let own = [self.tests.place.x.floor() as i64, self.tests.place.y.floor() as i64];
        let likely = [place.x.floor() as i64, place.y.floor() as i64];
        let mut found = self.in_texel(own, likely, place, error);
        for y in floors(place.y, error.y) {
            for x in floors(place.x, error.x) {
                if [x, y] != likely {
                    found = found.or_verdict(self.in_texel(own, [x, y], place, error));
                }
            }
        }
        found
    }

    fn in_texel(&self, own: [i64; 2], texel: [i64; 2], place: DVec2, error: DVec2) -> Verdict {
        let corner = dvec2(texel[0] as f64, texel[1] as f64);
        let fraction = (place - corner).clamp(DVec2::ZERO, DVec2::splat(1.0 - f64::EPSILON));
        let (outcome, doubt) = self.tests.ask(
            own,
            |o: &Outcome| o.visibility,
            |lit| {
                let (function, most) = (self.hard.function, self.hard.max_distance);
                revectorize::visibility(&|t| lit(t), texel, fraction, function, most)
            },
        );
        let verdict = Verdict { doubt, ..Verdict::sure(outcome.visibility) };
        let on_line = outcome.margin <= error.length() + PLACE_ROUNDING;
        if on_line { verdict.or(1.0 - outcome.visibility) } else { verdict }
    }
}

/// Discontinuity of a texel, and the ends of its runs if they are followed.
type Ends = (Discontinuity, Option<[i64; 4]>);

/// Returns a number that tells the results of `Pixel::ends` apart.
fn fingerprint((d, ends): &Ends) -> f64 {
    let ends = ends.map_or(-1.0, |ends| ends.iter().fold(0.0, |sum, &t| 256.0 * sum + (t + 128) as f64));
    32.0 * ends + f64::from(2 * d.mask + u8::from(d.lit))
}

/// Returns the visibility of a point by its signed distances to the ends of its edge, and how far, in texels, these may
/// change before it jumps.
fn visibility_at(function: Function, d: Discontinuity, distances: DVec4) -> (f64, f64) {
    let ends = |a: f64, b: f64| 0.5 * (a.signum() + b.signum());
    let lengths = dvec2(distances.x.abs() + distances.y.abs(), distances.z.abs() + distances.w.abs());
    let position = dvec2(distances.x.max(distances.y), distances.z.max(distances.w)) / lengths;
    let nrd = DVec4::new(position.x, position.y, ends(distances.x, distances.y), ends(distances.z, distances.w));
    let (visibility, sum, is_l) = match function {
        Function::Silhouette => {
            let short = d.mask & 0b11 == 0b11 || d.mask & 0b1100 == 0b1100;
            (revectorize::silhouette_visibility(d, nrd), 1.0, !short && nrd.z == 0.0 && nrd.w == 0.0)
        }
        _ => (revectorize::star_visibility(d, nrd), 0.5, nrd.z == 0.0 && nrd.w == 0.0),
    };
    let margin = if is_l { (nrd.x + nrd.y - sum).abs() / (1.0 / lengths).length() } else { f64::INFINITY };
    (visibility, margin)
}

#[cfg(test)]
mod tests {
    use crate::reference::revectorization::revectorize::{Discontinuity, Side, discontinuity, traverse};
    use rand_pcg::Pcg32;
    use rand_pcg::rand_core::{Rng as _, SeedableRng as _};

    const MOST: u32 = 16;

    /// Mirror of the shader's `sameRun`: signed distances to the left and the right end, `by` texels farther right.
    fn moved([left, right]: [i64; 2], by: i64) -> Option<[i64; 2]> {
        let most = i64::from(MOST);
        let limited = |sign: i64, d: i64| if d > most { -(most + 1) } else { sign.signum() * d };
        let known = right.abs() <= most && right.abs() > by;
        known.then(|| [limited(left, left.abs() + by), limited(right, right.abs() - by)])
    }

    /// The paper's two branches as printed, with steps in texels: right where exactly one end is an edge end.
    fn as_printed([left, right]: [i64; 2], by: i64) -> Option<[i64; 2]> {
        (right.abs() <= i64::from(MOST) && right.abs() > by)
            .then(|| if left > right { [left + by, right + by] } else { [left - by, right - by] })
    }

    /// Returns how often a reuse is possible along the rows of a noise pattern, and how often it is wrong.
    fn reuses(reuse: impl Fn([i64; 2], i64) -> Option<[i64; 2]>) -> (usize, usize) {
        let (mut possible, mut wrong) = (0, 0);
        for seed in 0..40 {
            let mut random = Pcg32::seed_from_u64(seed);
            let wide = 3 + seed % 20;
            let blocks: Vec<bool> = (0..64 * 40).map(|_| random.next_u32() & 1 == 0).collect();
            let lit = |[x, y]: [i64; 2]| {
                let inside = (0..64).contains(&x) && (0..40).contains(&y);
                !inside || blocks[(x / wide as i64 + y / 2 * 64) as usize]
            };
            let ends = |t: [i64; 2], d: Discontinuity| [Side::Left, Side::Right].map(|s| traverse(&lit, t, d, s, MOST));
            for y in 0..40 {
                for x in 0..50 {
                    let d = discontinuity(&lit, [x, y]);
                    for by in [0, 1, 2, 5, 13] {
                        let next = discontinuity(&lit, [x + by, y]);
                        let same_sides = |m: u8| m & 0b1100;
                        if d.lit != next.lit || d.mask == 0 || same_sides(d.mask) != same_sides(next.mask) {
                            continue;
                        }
                        if let Some(found) = reuse(ends([x, y], d), by) {
                            possible += 1;
                            wrong += usize::from(found != ends([x + by, y], next));
                        }
                    }
                }
            }
        }
        (possible, wrong)
    }

    #[test]
    fn runs_are_reused_along_a_row() {
        let (possible, wrong) = reuses(moved);
        println!("{possible} runs reused, {wrong} wrongly");
        assert!(possible > 10_000 && wrong == 0, "{wrong} of {possible}");
        // The printed form is wrong, and so is one without the limit on the run's length.
        let (possible, wrong) = reuses(as_printed);
        assert!(wrong * 10 > possible, "{wrong} of {possible}");
        let unlimited = |[left, right]: [i64; 2], by: i64| {
            let steps = [left.signum() * (left.abs() + by), right.signum() * (right.abs() - by)];
            moved([left, right], by).map(|_| steps)
        };
        assert!(reuses(unlimited).1 > 0);
    }
}
