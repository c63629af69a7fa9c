//! Mirror of `glsl/soft/soft_auto.comp` and of the passes that work on its lists, composed of the mirrors of those
//! passes.
//!
//! `on_demand.comp` has no mirror of its own: it decides only whether the depth pyramid is made.
//!
//! The filter itself gives the same result where the shader decides a pixel by its filter's window.

use super::{pcss, rbssm};
use crate::Result;
use crate::reference::common::area_light::AreaLight;
use crate::reference::common::blockers::{self, Bounded};
use crate::reference::common::hsm::Hsm;
use crate::reference::common::map_receiver::{MapReceiver, receive};
use crate::reference::common::view::{Decision, FrameData, Mirror, ROUNDING, Verdict, View};
use glam::DVec2;

/// `NARROWEST_SEARCH` of the shader, texels.
const NARROWEST: f64 = 1.0;

/// Settings of the technique.
#[derive(Clone, Copy, Debug)]
pub struct Settings {
    /// Settings of the search, and of the filter of narrow penumbrae.
    pub kernel: rbssm::Settings,
    /// Number of taps per axis of the filter of wide penumbrae.
    pub filter_taps: u32,
    /// Width in the map, texels, below which the filter averages revectorized visibility.
    pub kernel_texels: f32,
    /// Distance from the receiver, in texel widths, above which revectorized visibility is not used beside bars and
    /// gaps one texel wide.
    pub thin_distance: f32,
}

impl Settings {
    fn is_revectorized(&self) -> bool {
        self.kernel_texels > 0.0
    }

    fn wide(&self) -> pcss::Settings {
        pcss::Settings {
            search_taps: self.kernel.search_taps,
            filter_taps: self.filter_taps,
            window: self.kernel.window,
            form: self.kernel.form,
            bilinear: true,
            exact_box: true,
            normal_offset: self.kernel.normal_offset,
            depth_bias: self.kernel.depth_bias,
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
    let hsm = Hsm::of_search(data, settings.kernel.window);
    let pixels = view.every_pixel(|p| {
        let open = match receive(&view, p, settings.kernel.normal_offset, settings.kernel.depth_bias) {
            MapReceiver::Decided(verdict) => return verdict,
            MapReceiver::Open(open) => open,
        };
        let narrow = rbssm::Pixel::new(&view, &light, &open, &settings.kernel);
        let pixel = Pixel { view: &view, light: &light, settings, texel_depth: open.texel_depth, narrow };
        let Some(windows) = pixel.narrow.soft.search_windows(&light, &view, hsm.as_ref(), 1.0) else {
            return open.with_doubts(Verdict::ANYTHING);
        };
        let verdicts = windows.into_iter().map(|window| pixel.search(window)).reduce(Verdict::or_verdict);
        open.with_doubts(verdicts.unwrap_or(Verdict::sure(1.0)))
    });
    Ok(Mirror::collect(pixels))
}

struct Pixel<'a> {
    view: &'a View<'a>,
    light: &'a AreaLight,
    settings: &'a Settings,
    /// Change of depth over a texel's world size.
    texel_depth: f64,
    narrow: rbssm::Pixel<'a>,
}

/// Returns one of two verdicts, combined with the other where the decision is in doubt.
fn either(decision: Decision, yes: impl Fn() -> Verdict, no: impl Fn() -> Verdict) -> Verdict {
    match decision {
        Decision::Yes => yes(),
        Decision::No => no(),
        Decision::Doubtful(true) => yes().or_verdict(no()),
        Decision::Doubtful(false) => no().or_verdict(yes()),
    }
}

/// Decides whether a test differs from both others.
fn is_between(middle: Decision, ends: [Decision; 2]) -> Decision {
    let may_be = |d: Decision, lit: bool| d.is_yes() == lit || d.is_doubtful();
    let possible = [false, true].iter().any(|&lit| may_be(middle, lit) && ends.iter().all(|&e| may_be(e, !lit)));
    let likely = ends.iter().all(|e| e.is_yes() != middle.is_yes());
    match (possible, ends.iter().chain([&middle]).any(|d| d.is_doubtful())) {
        (false, _) => Decision::No,
        (true, true) => Decision::Doubtful(likely),
        (true, false) => Decision::Yes,
    }
}

impl Pixel<'_> {
    fn search(&self, window: Bounded<DVec2>) -> Verdict {
        let revectorized = self.settings.is_revectorized();
        let extent = self.view.map_extent();
        let window = match revectorized {
            true => self.narrow.at_least(window),
            false => Bounded { value: window.value.max(NARROWEST / extent), ..window },
        };
        let soft = &self.narrow.soft;
        if !blockers::is_followed(soft.at.error + window.error * extent) {
            return Verdict::ANYTHING;
        }
        let taps = self.settings.kernel.search_taps.into();
        let found = blockers::find_blockers(self.view, soft, self.light, window, taps, self.settings.kernel.form);
        let Some(z) = found.z else {
            let next_door = match revectorized {
                true => self.narrow.neighbouring_blockers(|z| self.filter(window, z, None)),
                false => Verdict::sure(1.0),
            };
            // If the only blocker is in doubt, its filter may give anything.
            return if found.range.is_some() { next_door.or(0.0).or(1.0) } else { next_door };
        };
        let verdict = self.filter(window, z, found.range);
        if found.doubtful { verdict.or(0.0).or(1.0) } else { verdict }
    }

    /// Computes the pixel's verdict from the blockers' distance.
    fn filter(&self, window: Bounded<DVec2>, z: Bounded<f64>, range: Option<[f64; 2]>) -> Verdict {
        let width = self.narrow.width_for(window, z, range);
        let apart = range.map_or(0.0, |[a, b]| (a - z.value).abs().max((b - z.value).abs()));
        let z_any = Bounded { error: z.error + apart, ..z };
        let wide = || {
            let settings = self.settings.wide();
            pcss::filter_for(self.view, self.light, &self.narrow.soft, window, (z, range), &settings)
        };
        let kernel = || self.narrow.filter_for(window, z, range);
        either(self.is_kernel(width, z_any), kernel, wide)
    }

    fn is_kernel(&self, half: Bounded<DVec2>, z_blocker: Bounded<f64>) -> Decision {
        let most = f64::from(self.settings.kernel_texels);
        let narrow = match most {
            0.0 => Decision::No,
            most => Decision::positive(most - 2.0 * half.value.max_element(), 2.0 * half.error.max_element()),
        };
        let far = self.is_far(z_blocker);
        match (narrow, far) {
            (Decision::No, _) | (_, Decision::No) => narrow,
            _ => narrow.and(far.and(self.is_thick().opposite()).opposite()),
        }
    }

    /// Decides whether `blockerDistance` exceeds the threshold.
    fn is_far(&self, z: Bounded<f64>) -> Decision {
        let (light, r) = (self.light, &self.narrow.soft);
        let (depth, error) = match light.depth_scale > 0.0 {
            true => {
                let below = light.depth_scale / z.value;
                (light.depth_offset - below, below / z.value * z.error + ROUNDING * (light.depth_offset + below))
            }
            false => {
                (z.value / light.depth_offset, z.error / light.depth_offset + ROUNDING * z.value / light.depth_offset)
            }
        };
        let between = r.depth.value - depth;
        let texels = between / self.texel_depth;
        let error = (error + r.depth.error) / self.texel_depth + 8.0 * ROUNDING * texels.abs();
        Decision::positive(texels - f64::from(self.settings.thin_distance), error)
    }

    /// Decides the opposite of `isThin`.
    fn is_thick(&self) -> Decision {
        let tests = &self.narrow.tests;
        let around = |own: [i64; 2]| {
            let test = |x: i64, y: i64| tests.test(own, [own[0] + x, own[1] + y]);
            let mut thick = Decision::Yes;
            for (x, y) in (-1..=1).flat_map(|y| (-1..=1).map(move |x| (x, y))) {
                let middle = test(x, y);
                for ends in [[test(x - 1, y), test(x + 1, y)], [test(x, y - 1), test(x, y + 1)]] {
                    thick = thick.and(is_between(middle, ends).opposite());
                }
            }
            thick
        };
        let found: Vec<_> = tests.texels().into_iter().map(around).collect();
        // The texel itself may be in doubt; the loop visits at least the exact one.
        match found[..] {
            [first, ref others @ ..] if others.iter().any(|o| *o != first) => Decision::Doubtful(first.is_yes()),
            [first, ..] => first,
            [] => Decision::Doubtful(true),
        }
    }
}
