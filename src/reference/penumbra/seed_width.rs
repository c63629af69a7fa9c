//! Mirror of `glsl/penumbra/seed_width.comp`: the penumbra width at every seed.

use super::edge_seeds::Seed;
use crate::Result;
use crate::reference::common::area_light::AreaLight;
pub use crate::reference::common::blockers::SearchForm;
use crate::reference::common::blockers::{self, Bounded, SoftReceiver};
use crate::reference::common::hsm::Hsm;
use crate::reference::common::map_receiver::{MapReceiver, receive};
use crate::reference::common::view::{FrameData, ROUNDING, View};
use crate::technique::common::blocker_search::SearchWindow;
use crate::technique::penumbra::seed_width::Metric;
use glam::{DVec2, DVec3};
use rayon::prelude::*;

/// `NARROWEST_SEARCH` (texels), `NARROWEST_WIDTH` (pixels) and `LEAST_COSINE` of the shader.
const NARROWEST_SEARCH: f64 = 1.5;
const NARROWEST_WIDTH: f64 = 1e-3;
const LEAST_COSINE: f64 = 0.1;
/// `DIAGONAL` of the shader.
const DIAGONAL: f64 = 0.804737;

/// Settings of the pass.
#[derive(Clone, Copy, Debug)]
pub struct Settings {
    /// Number of blocker-search taps per axis.
    pub search_taps: u32,
    /// Rule for the size of the search window.
    pub window: SearchWindow,
    /// Form of the search.
    pub form: SearchForm,
    /// Measure of the distances that the widths are compared with.
    pub metric: Metric,
    /// Factor on the width.
    pub beta: f32,
    /// Normal offset, in multiples of what a plane needs.
    pub normal_offset: f32,
    /// Depth bias, as a fraction of the depth slope per texel, summed over both axes.
    pub depth_bias: f32,
}

/// Penumbra at a seed.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Width {
    /// Full width, world units; 0 if there is no penumbra.
    pub width: f64,
    /// Smallest and largest width that rounding, or other decisions about what blocks, may give.
    pub range: [f64; 2],
    /// Factor by which the metric may shorten distances.
    pub cosine: f64,
    /// Bound on the cosine's error.
    pub cosine_error: f64,
}

/// Returns the widths of the seeds, in their order.
///
/// # Errors
/// Fails if the images do not fit the constants.
pub fn widths(data: &FrameData<'_>, settings: &Settings, seeds: &[Seed]) -> Result<Vec<Width>> {
    let view = View::new(data)?;
    let light = AreaLight::of(data.constants, 0);
    let hsm = Hsm::of_search(data, settings.window);
    let found = |seed: &Seed| {
        let (width, range) = width_at(&view, &light, hsm.as_ref(), settings, seed);
        let (towards, error) = view.towards_light(seed.point, DVec3::splat(seed.off()));
        let (cosine, cosine_error) = match settings.metric {
            Metric::World => (1.0, 0.0),
            Metric::Light => {
                (DIAGONAL * seed.normal.dot(towards).max(LEAST_COSINE), seed.normal_error + error + ROUNDING)
            }
        };
        Width { width, range, cosine, cosine_error }
    };
    Ok(seeds.par_iter().map(found).collect())
}

fn width_at(view: &View<'_>, light: &AreaLight, hsm: Option<&Hsm>, s: &Settings, seed: &Seed) -> (f64, [f64; 2]) {
    const ANYTHING: [f64; 2] = [0.0, f64::INFINITY];
    let open = match receive(view, seed.pixel, s.normal_offset, s.depth_bias) {
        MapReceiver::Decided(v) => return (0.0, if v.doubt > 0.0 { ANYTHING } else { [0.0; 2] }),
        MapReceiver::Open(open) => open,
    };
    let r = SoftReceiver::new(view, light, &open, s.form);
    let taps = f64::from(s.search_taps);
    let to_rim = taps / (taps - 1.0).max(1.0);
    let of_window = |window: Bounded<DVec2>| {
        let value = window.value.max(NARROWEST_SEARCH / view.map_extent()) * to_rim;
        let window = Bounded { value, error: window.error * to_rim + ROUNDING * value };
        let found = blockers::find_blockers(view, &r, light, window, s.search_taps.into(), s.form);
        let width = |z: Bounded<f64>| scaled(s.beta.into(), light, r.z, z);
        let Some(z) = found.z else {
            let most = found.range.map_or(0.0, |[nearest, _]| {
                let w = width(Bounded { value: nearest, error: ROUNDING * nearest });
                w.value + w.error
            });
            return (0.0, [0.0, most]);
        };
        let likely = width(z);
        let mut range = [likely.value - likely.error, likely.value + likely.error];
        if let Some(of_z) = found.range {
            let [widest, narrowest] = of_z.map(|value| width(Bounded { value, ..z }));
            range = [range[0].min(narrowest.value - narrowest.error), range[1].max(widest.value + widest.error)];
        }
        (likely.value, if found.doubtful { [0.0, range[1]] } else { range })
    };
    let Some(windows) = r.search_windows(light, view, hsm, 1.0) else { return (0.0, ANYTHING) };
    let mut windows = windows.into_iter().map(of_window);
    let (mut width, mut range) = windows.next().unwrap_or((0.0, [0.0; 2]));
    for (_, other) in windows {
        range = [range[0].min(other[0]), range[1].max(other[1])];
    }
    let (pixel, error) = view.pixel_width(seed.point, DVec3::splat(seed.off()));
    let [least, most] = [-1.0, 1.0].map(|side| NARROWEST_WIDTH * (pixel + side * (error + ROUNDING * pixel)));
    if width < NARROWEST_WIDTH * pixel {
        width = 0.0;
    }
    if range[0] < most {
        range[0] = 0.0;
    }
    if range[1] < least {
        range[1] = 0.0;
    }
    (width, if open.is_doubtful() { ANYTHING } else { range })
}

/// Mirror of `penumbraWidth`, times a factor.
fn scaled(beta: f64, light: &AreaLight, z: Bounded<f64>, z_blocker: Bounded<f64>) -> Bounded<f64> {
    let value = beta * light.penumbra_width(z.value, z_blocker.value);
    let (inverse, relative) = match light.depth_scale > 0.0 {
        true => (1.0 / z_blocker.value.max(1e-30), z_blocker.error / z_blocker.value.max(1e-30)),
        false => (1.0, 0.0),
    };
    let between = z.error + z_blocker.error + ROUNDING * (z.value.abs() + z_blocker.value.abs());
    Bounded { value, error: 2.0 * beta * light.world * between * inverse + value * (relative + 2.0 * ROUNDING) }
}
