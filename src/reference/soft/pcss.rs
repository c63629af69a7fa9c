//! Mirror of `glsl/soft/pcss.comp`.

use super::soft_filter;
use crate::Result;
use crate::reference::common::area_light::AreaLight;
use crate::reference::common::blockers::{self, Bounded, SoftReceiver};
pub use crate::reference::common::blockers::{Class, ClassBy, Classified, MapClasses, SearchForm};
use crate::reference::common::hsm::Hsm;
use crate::reference::common::map_receiver::{MapReceiver, receive};
use crate::reference::common::view::{Decision, FrameData, Mirror, ROUNDING, Verdict, View};
use crate::technique::common::blocker_search::SearchWindow;
use glam::DVec2;

/// `NARROWEST_FILTER` and `NARROWEST_SEARCH` of the shader, texels.
const NARROWEST: [f64; 2] = [0.5, 1.0];

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
    /// Tests 2 x 2 texels per filter tap.
    pub bilinear: bool,
    /// Averages windows exactly if they have no more texels than the filter has taps.
    pub exact_box: bool,
    /// Normal offset, in multiples of what a plane needs.
    pub normal_offset: f32,
    /// Depth bias, as a fraction of the depth slope per texel, summed over both axes.
    pub depth_bias: f32,
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
            let r = SoftReceiver::new(&view, &light, &open, settings.form);
            let Some(windows) = r.search_windows(&light, &view, hsm.as_ref(), 1.0) else {
                return open.with_doubts(Verdict::ANYTHING);
            };
            let verdicts = windows.into_iter().map(|window| {
                let least = NARROWEST[1] / view.map_extent();
                let window = Bounded { value: window.value.max(least), ..window };
                search_and_filter(&view, &light, &r, window, settings)
            });
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
            let r = SoftReceiver::new(&view, &light, &open, settings.form);
            let least = NARROWEST[1] / view.map_extent();
            match r.search_windows(&light, &view, hsm, 1.0) {
                Some(windows) if !open.is_doubtful() => {
                    let windows: Vec<_> =
                        windows.into_iter().map(|w| Bounded { value: w.value.max(least), ..w }).collect();
                    match by {
                        ClassBy::Bounds => r.classify(&view, map, &windows, 0.5),
                        ClassBy::Texels => r.classify_texels(&view, &windows, 0.5),
                    }
                }
                _ => Classified::OPEN,
            }
        }
    }))
}

fn search_and_filter(
    view: &View<'_>,
    light: &AreaLight,
    r: &SoftReceiver,
    window: Bounded<DVec2>,
    settings: &Settings,
) -> Verdict {
    if !blockers::is_followed(r.at.error + window.error * view.map_extent()) {
        return Verdict::ANYTHING;
    }
    let found = blockers::find_blockers(view, r, light, window, settings.search_taps.into(), settings.form);
    let Some(z) = found.z else {
        let none = Verdict::sure(1.0);
        // If the only blocker is in doubt, its filter may give anything in between.
        return if found.range.is_some() { none.or(0.0) } else { none };
    };
    let verdict = filter_for(view, light, r, window, (z, found.range), settings);
    if found.doubtful { verdict.or(1.0) } else { verdict }
}

/// Filters for blockers at a mean distance. `range` holds the distances that decisions in doubt may lead to.
pub(super) fn filter_for(
    view: &View<'_>,
    light: &AreaLight,
    r: &SoftReceiver,
    window: Bounded<DVec2>,
    (z, range): (Bounded<f64>, Option<[f64; 2]>),
    settings: &Settings,
) -> Verdict {
    let width = |z: Bounded<f64>| {
        let h = blockers::half_width(light, r.z, z);
        let clamped = |h: DVec2| {
            let in_search = Bounded { value: h.min(window.value), error: DVec2::ZERO };
            blockers::texels(view, in_search).value.max(DVec2::splat(NARROWEST[0]))
        };
        let value = clamped(h.value);
        // Rounding does not change a width that a clamp holds, but the clamps themselves may change.
        let moved = (clamped(h.value + h.error) - clamped(h.value - h.error)).max(DVec2::ZERO);
        let search = (window.error * view.map_extent()).min(value * 1e-3);
        Bounded { value, error: moved + search + ROUNDING * value }
    };
    let texels = width(z);
    if !blockers::is_followed(texels.error) {
        return Verdict::ANYTHING;
    }
    let mut verdict = filter(view, r, texels, settings);
    if let Some(range) = range {
        let [a, b] = range.map(|value| width(Bounded { value, ..z }));
        let apart = (a.value - texels.value).abs().max((b.value - texels.value).abs());
        let error = texels.error + apart;
        // Blockers in doubt change the width more than rounding does, but it is followed up only within a limit.
        verdict.doubt = if error.max_element() > 2.0 {
            1.0
        } else {
            let other = filter(view, r, Bounded { error, ..texels }, settings);
            (other.doubt + other.rounding).min(1.0)
        };
    }
    verdict
}

/// Filters over a half-width in texels.
fn filter(view: &View<'_>, r: &SoftReceiver, half: Bounded<DVec2>, settings: &Settings) -> Verdict {
    let n = i64::from(settings.filter_taps);
    let taps = || soft_filter::filter_taps(view, r, half, n, settings.bilinear);
    if !settings.exact_box {
        return taps();
    }
    let margin = |axis: usize| Decision::positive(n as f64 - 2.0 * half.value[axis], 2.0 * half.error[axis]);
    match margin(0).and(margin(1)) {
        Decision::Yes => soft_filter::filter_box(view, r, half),
        Decision::No => taps(),
        Decision::Doubtful(true) => soft_filter::filter_box(view, r, half).or_verdict(taps()),
        Decision::Doubtful(false) => taps().or_verdict(soft_filter::filter_box(view, r, half)),
    }
}
