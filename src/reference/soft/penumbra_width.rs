//! Mirror of `glsl/soft/penumbra_width.comp`.

use crate::Result;
use crate::reference::common::area_light::AreaLight;
pub use crate::reference::common::blockers::SearchForm;
use crate::reference::common::blockers::{self, Blockers, Bounded, SoftReceiver};
use crate::reference::common::hsm::Hsm;
use crate::reference::common::map_receiver::{MapReceiver, receive};
use crate::reference::common::view::{Decision, FrameData, ROUNDING, View};
use crate::technique::common::blocker_search::SearchWindow;
use glam::DVec2;

/// `NARROWEST_SEARCH` of the shader, texels.
const NARROWEST: f64 = 1.0;
/// Factor and texels by which `windowRange` of `hsm.glsl` enlarges a window.
const RANGE: (f64, f64) = (1.00001, 0.51);

/// Settings of the pass.
#[derive(Clone, Copy, Debug)]
pub struct Settings {
    /// Number of search taps per axis.
    pub taps: u32,
    /// Rule for the size of the search window.
    pub window: SearchWindow,
    /// Form of the search.
    pub form: SearchForm,
    /// Averages windows exactly if they have no more texels than taps.
    pub exact_box: bool,
    /// Normal offset, in multiples of what a plane needs.
    pub normal_offset: f32,
    /// Depth bias, as a fraction of the depth slope per texel, summed over both axes.
    pub depth_bias: f32,
    /// Reach of the filter that follows, in penumbra half-widths.
    pub reach: f32,
}

/// Result that the pass may have at a pixel.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Width {
    /// Width of the penumbra, world units; 0 without blockers.
    pub width: f64,
    /// Smallest and largest width that rounding, and decisions within it, may lead to.
    pub range: [f64; 2],
    /// `true` if 0 is right as well: possibly no blocker, or only blockers.
    pub none: bool,
    /// `true` if every texel that a tap may touch is surely in shadow.
    pub umbra: bool,
}

impl Width {
    /// Returns whether the pass may have found this width.
    pub fn explains(&self, found: f64) -> bool {
        self.none && found == 0.0 || (self.range[0]..=self.range[1]).contains(&found)
    }

    fn or(self, other: Self) -> Self {
        let range = [self.range[0].min(other.range[0]), self.range[1].max(other.range[1])];
        Self { range, none: self.none || other.none, umbra: self.umbra && other.umbra, ..self }
    }
}

const NONE: Width = Width { width: 0.0, range: [0.0; 2], none: true, umbra: false };

/// Result where rounding leaves everything open.
const ANY: Width = Width { range: [0.0, f64::INFINITY], ..NONE };

/// Returns the penumbra width of every pixel.
///
/// # Errors
/// Fails if the images do not fit the constants.
pub fn widths(data: &FrameData<'_>, settings: &Settings) -> Result<Vec<Width>> {
    let view = View::new(data)?;
    let light = AreaLight::of(data.constants, 0);
    let hsm = Hsm::of_search(data, settings.window);
    Ok(view.every_pixel(|p| match receive(&view, p, settings.normal_offset, settings.depth_bias) {
        MapReceiver::Decided(verdict) if verdict.doubt == 0.0 => NONE,
        // If the decision goes the other way, any width is possible.
        MapReceiver::Decided(_) => ANY,
        MapReceiver::Open(open) => {
            let r = SoftReceiver::new(&view, &light, &open, settings.form);
            let least = NARROWEST / view.map_extent();
            let Some(windows) = r.search_windows(&light, &view, hsm.as_ref(), settings.reach.into()) else {
                return ANY;
            };
            let found = windows.into_iter().map(|w| {
                let window = Bounded { value: w.value.max(least), ..w };
                Search { view: &view, light: &light, r: &r, settings }.width(window)
            });
            let found = found.reduce(Width::or).unwrap_or(NONE);
            match open.is_doubtful() {
                true => Width { width: found.width, umbra: found.umbra, ..ANY },
                false => found,
            }
        }
    }))
}

struct Search<'a> {
    view: &'a View<'a>,
    light: &'a AreaLight,
    r: &'a SoftReceiver,
    settings: &'a Settings,
}

impl Search<'_> {
    /// Searches over a window in uv.
    fn width(&self, window: Bounded<DVec2>) -> Width {
        let n = f64::from(self.settings.taps);
        let texels = blockers::texels(self.view, window);
        let is_box = match self.settings.exact_box {
            true => (0..2)
                .map(|axis| Decision::positive(n - 2.0 * texels.value[axis], 2.0 * texels.error[axis]))
                .fold(Decision::Yes, Decision::and),
            false => Decision::No,
        };
        let (view, r, a, form) = (self.view, self.r, self.light, self.settings.form);
        let by_taps = || self.width_from(&blockers::find_blockers(view, r, a, window, n as i64, form));
        let by_box = || self.width_from(&find_blockers_box(view, r, a, texels, form));
        let found = match is_box {
            Decision::Yes => by_box(),
            Decision::No => by_taps(),
            Decision::Doubtful(true) => by_box().or(by_taps()),
            Decision::Doubtful(false) => by_taps().or(by_box()),
        };
        let (all, sure) = self.all_in_shadow(texels);
        Width { none: found.none || all, umbra: sure, ..found }
    }

    fn width_from(&self, found: &Blockers) -> Width {
        let Some([low, high]) = found.range.or(found.z.map(|z| [z.value; 2])) else { return NONE };
        let error = found.z.map_or(ROUNDING * high, |z| z.error);
        let width = |z: f64, blocker: f64| self.light.penumbra_width(z, blocker);
        let z = self.r.z;
        let least = width(z.value - z.error, high + error) * (1.0 - 4.0 * ROUNDING);
        let most = width(z.value + z.error, low - error) * (1.0 + 4.0 * ROUNDING);
        Width {
            width: found.z.map_or(0.0, |b| width(z.value, b.value)),
            range: [least, most],
            // The blocker is in front of the receiver's plane, but no nearer to the light than the receiver.
            none: found.doubtful || least == 0.0,
            umbra: false,
        }
    }

    /// Returns whether all texels that the classification reads are in shadow: possibly, and surely.
    fn all_in_shadow(&self, half: Bounded<DVec2>) -> (bool, bool) {
        let at = self.r.at;
        let reach = half.value * RANGE.0 + RANGE.1;
        let error = half.error + at.error + ROUNDING * (at.value.abs() + reach);
        let range = |axis: usize, by: f64| {
            let reach = reach[axis] + by;
            (at.value[axis] - reach).floor() as i64..=(at.value[axis] + reach).floor() as i64
        };
        let (mut possibly, mut sure) = (true, true);
        for y in range(1, error.y) {
            for x in range(0, error.x) {
                let lit = self.r.test(self.view, [x, y]);
                sure &= lit == Decision::No;
                let inner = range(1, -error.y).contains(&y) && range(0, -error.x).contains(&x);
                possibly &= !(inner && lit == Decision::Yes);
                if !possibly {
                    return (false, false);
                }
            }
        }
        (true, sure)
    }
}

/// Texel that may block: its distance, its likely share of the window, and the smallest and largest share.
type Share = (f64, f64, [f64; 2]);

/// Mirror of `findBlockersBox` over a half-width in texels.
fn find_blockers_box(
    view: &View<'_>,
    r: &SoftReceiver,
    a: &AreaLight,
    half: Bounded<DVec2>,
    form: SearchForm,
) -> Blockers {
    let error = r.at.error + half.error + ROUNDING * (r.at.value.abs() + half.value);
    // Share of a texel in a window that is wider by `by` on each side.
    let share = |t: i64, axis: usize, by: f64| {
        let (low, high) = (r.at.value[axis] - half.value[axis] - by, r.at.value[axis] + half.value[axis] + by);
        (((t + 1) as f64).min(high) - (t as f64).max(low)).max(0.0)
    };
    let range = |axis: usize| {
        let reach = half.value[axis] + error[axis];
        (r.at.value[axis] - reach).floor() as i64..=(r.at.value[axis] + reach).floor() as i64
    };
    let mut found: Vec<Share> = vec![];
    for y in range(1) {
        for x in range(0) {
            let lit = r.test(view, [x, y]);
            if lit == Decision::Yes {
                continue;
            }
            let weight = |sign: f64| share(x, 0, sign * error.x) * share(y, 1, sign * error.y);
            let least = if lit.is_doubtful() { 0.0 } else { weight(-1.0) };
            let likely = if lit.is_yes() { 0.0 } else { weight(0.0) };
            found.push((form.value(a, view.stored(view.nearest_texel([x, y]))), likely, [least, weight(1.0)]));
        }
    }
    found.sort_by(|a, b| a.0.total_cmp(&b.0));
    let sum = |of: &dyn Fn(&Share) -> f64| found.iter().map(of).sum::<f64>();
    let (likely, least, most) = (sum(&|t| t.1), sum(&|t| t.2[0]), sum(&|t| t.2[1]));
    // The mean is extreme if the weights on its far side are as large as possible.
    let extreme = |order: &mut dyn Iterator<Item = &Share>, farther: fn(f64, f64) -> bool| {
        let (mut weighted, mut weight) = (sum(&|t| t.2[0] * t.0), least);
        for &(z, _, [least, most]) in order {
            if weight == 0.0 || farther(z, weighted / weight) {
                (weighted, weight) = (weighted + (most - least) * z, weight + most - least);
            }
        }
        weighted / weight
    };
    Blockers {
        z: (likely > 0.0).then(|| {
            let (mean, farthest) = (sum(&|t| t.1 * t.0) / likely, found.iter().map(|t| t.0).fold(0.0, f64::max));
            form.distance_of_mean(a, mean, farthest, 4.0 * half.value.max_element() + 4.0)
        }),
        range: (most > 0.0).then(|| {
            [extreme(&mut found.iter(), |a, b| a < b), extreme(&mut found.iter().rev(), |a, b| a > b)]
                .map(|mean| form.distance(a, mean))
        }),
        doubtful: most > 0.0 && least <= 0.0,
    }
}
