//! Mirror of the search where every seed has its own penumbra width (`SOFT` of `glsl/penumbra/nearest_edge.glsl` and
//! `nearest_line.glsl`), and of `beyond_edge.glsl`.

use super::{Link, Nearest, half_line, on_surface, to_seed};
use crate::reference::FrameData;
use crate::reference::common::surface::{Apart, one_patch, same_depth};
use crate::reference::common::view::{Decision, ROUNDING, Receiver, View};
use crate::reference::penumbra::edge_seeds::{self, Seed};
use crate::technique::common::surface::SurfaceTest;
use crate::technique::distance_transform::NO_SEED;
use crate::technique::penumbra::seed_width::{Meet, Metric};
use crate::{Error, Result};
use glam::{DVec2, DVec3, dvec2};
use std::collections::HashMap;

/// Settings of the passes.
#[derive(Clone, Copy, Debug)]
pub struct Settings {
    /// Settings of the seeds.
    pub seeds: edge_seeds::Settings,
    /// Rule for which edge counts where several are in reach.
    pub meet: Meet,
    /// Measure of distances.
    pub metric: Metric,
    /// Width of the mean filter, as a fraction of the penumbra's width or in world units.
    pub filter_width: f32,
    /// The filter has one width in the world.
    pub filter_in_world: bool,
    /// Seeds are short lines along the edge, not points.
    pub lines: bool,
}

impl Settings {
    /// Returns the distance from an edge, as a fraction of its penumbra's `width` in world units, within which the image
    /// may differ from hard shadows.
    pub fn reach(&self, width: f64) -> f64 {
        let unit = if self.filter_in_world { width } else { 1.0 };
        // The passes use a slightly larger reach, so that rounding excludes nothing.
        0.5 * (1.0 + f64::from(self.filter_width) / unit) * 1.000001f64.sqrt()
    }

    fn on_surface(&self) -> super::Settings {
        super::Settings { seeds: self.seeds, penumbra: 1.0, filter_width: self.filter_width, lines: self.lines }
    }
}

/// Seed with its penumbra width and its cosine, as the pass stored them.
pub type WideSeed = (Seed, [f32; 2]);

/// `ROUNDED` of `glsl/penumbra/nearest_edge.glsl`.
const ROUNDED: f64 = 0.5;

/// Measured distance, world units, and the bound of its error.
struct Measured(f64, f64);

/// Data of a pixel that distances are measured with.
struct Place {
    p: Receiver,
    axis: DVec3,
    ray: DVec3,
    ray_error: f64,
    sides: [DVec3; 2],
}

impl Place {
    fn new(view: &View<'_>, p: Receiver) -> Self {
        let (towards, error) = view.towards_light(p.position, p.position_error);
        let axis = match view.light_axis() {
            none if none == DVec3::ZERO => -towards,
            axis => axis,
        };
        let facing = (-towards).dot(axis).max(0.05);
        let ray_error = (error + 2.0 * ROUNDING) * 2.0 / (facing * facing);
        let sides = view.light_sides().map(|side| (side - side.dot(axis) * axis).normalize_or_zero());
        Self { p, axis, ray: -towards / facing, ray_error, sides }
    }

    fn measure(&self, view: &View<'_>, s: &Settings, (seed, [_, cosine]): &WideSeed) -> Measured {
        let (apart, error) = to_seed(view, s.lines, &self.p, seed);
        let length = apart.length();
        if s.metric == Metric::World {
            return Measured(length, error);
        }
        let across = apart - apart.dot(self.axis) * self.ray;
        let stretch = 1.0 + self.ray.length();
        let across_error = error * stretch + length * (self.ray_error + 6.0 * ROUNDING * stretch);
        let cosine = f64::from(*cosine);
        let larger = self.sides.map(|side| across.dot(side).abs()).into_iter().fold(0.0, f64::max);
        let rounded = (larger + ROUNDED * across.length()) / (1.0 + ROUNDED);
        Measured(rounded.max(length * cosine), across_error.max(error * cosine))
    }
}

/// Returns every pixel's exact nearest seed on its surface. With [`Meet::Weighted`] distances are fractions of the
/// penumbra's width, and only seeds in reach count. With [`Meet::Nearest`] distances are in world units, and all seeds
/// count.
///
/// # Errors
/// Fails if the images do not fit the constants.
pub fn in_world(data: &FrameData<'_>, settings: &Settings, seeds: &[WideSeed]) -> Result<Vec<Nearest>> {
    let view = View::new(data)?;
    Ok(view.every_pixel(|pixel| {
        let Some(p) = view.receiver(pixel) else { return super::NOTHING };
        let place = Place::new(&view, p);
        let mut found = super::NOTHING;
        for wide in seeds {
            let (seed, [width, cosine]) = wide;
            let (width, cosine) = (f64::from(*width), f64::from(*cosine));
            let unit = match settings.meet {
                Meet::Weighted if width > 0.0 => width,
                Meet::Weighted => continue,
                Meet::Nearest => 1.0,
            };
            let reach = if settings.meet == Meet::Weighted { settings.reach(width) } else { f64::INFINITY };
            // Most seeds are clearly too far away.
            let (half_line, line_error) = if settings.lines { half_line(&view, seed) } else { (0.0, 0.0) };
            let off = p.position_error.length() + seed.off() + half_line + line_error;
            let limit = 1.00001 * (reach.min(found.range[1]) * unit / cosine + off);
            if place.p.position.distance_squared(seed.point) > limit * limit {
                continue;
            }
            let Measured(distance, error) = place.measure(&view, settings, wide);
            let (distance, error) = (distance / unit, error / unit + 2.0 * ROUNDING * distance / unit);
            if distance - error > reach.min(found.range[1]) {
                continue;
            }
            let on_surface = on_surface(&view, &settings.on_surface(), pixel, &p, seed);
            if on_surface == Decision::No {
                continue;
            }
            found.range[0] = found.range[0].min((distance - error).max(0.0));
            if on_surface == Decision::Yes && seed.sure && distance + error <= reach {
                found.range[1] = found.range[1].min(distance + error);
            }
            if on_surface.is_yes() && distance <= reach && distance < found.distance {
                (found.distance, found.label) = (distance, seed.label());
            }
        }
        found
    }))
}

/// Returns every pixel's link to the seed of its label, with the distance as a fraction of that seed's penumbra width;
/// `None` for [`NO_SEED`].
///
/// # Errors
/// Fails if the images do not fit the constants, or if a label belongs to no seed.
pub fn links(
    data: &FrameData<'_>,
    settings: &Settings,
    seeds: &[WideSeed],
    labels: &[u32],
) -> Result<Vec<Option<Link>>> {
    let view = View::new(data)?;
    if labels.len() != view.size[0] * view.size[1] {
        return Err(Error::Usage(format!("mirror: {} labels for {:?} pixels", labels.len(), view.size)));
    }
    let seeds: HashMap<u32, &WideSeed> = seeds.iter().map(|s| (s.0.label(), s)).collect();
    let link = |pixel: [usize; 2]| {
        let label = labels[view.index(pixel)];
        if label == NO_SEED {
            return Ok(None);
        }
        let (x, y) = (label & 0xffff, label >> 16);
        let Some(wide) = seeds.get(&label).filter(|s| s.1[0] > 0.0) else {
            let problem =
                format!("mirror: pixel {pixel:?} has the label {x}, {y}, but there is no seed with a penumbra");
            return Err(Error::Usage(problem));
        };
        let Some(p) = view.receiver(pixel) else {
            return Err(Error::Usage(format!("mirror: pixel {pixel:?} has the label {x}, {y}, but no surface")));
        };
        let width = f64::from(wide.1[0]);
        let Measured(distance, error) = Place::new(&view, p).measure(&view, settings, wide);
        let (distance, error) = (distance / width, error / width + 2.0 * ROUNDING * distance / width);
        let on_surface = on_surface(&view, &settings.on_surface(), pixel, &p, &wide.0);
        let doubtful = on_surface.is_doubtful() || !wide.0.sure;
        Ok(Some(Link { distance, error, on_surface: on_surface.is_yes(), doubtful }))
    };
    view.every_pixel(link).into_iter().collect()
}

/// Returns every pixel's point and unit normal in camera view space; `None` for the sky.
///
/// # Errors
/// Fails if the images do not fit the constants.
pub fn points(data: &FrameData<'_>) -> Result<Vec<Option<(DVec3, DVec3)>>> {
    let view = View::new(data)?;
    Ok(view.every_pixel(|pixel| view.receiver(pixel).map(|r| (r.position, r.normal))))
}

/// Contribution of a pixel's hard shadows beyond its nearest edge.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Beyond {
    /// Amount to add to eq. 8's intensity.
    pub change: f64,
    /// Largest deviation from `change` by taps whose position or test rounding may change.
    pub doubt: f64,
}

/// `EDGE_PIXELS` of `glsl/penumbra/beyond_edge.glsl`.
const EDGE_PIXELS: f64 = 1.5;

/// Mirror of `beyondEdge` of `glsl/penumbra/beyond_edge.glsl` for every pixel with a label. `shares` holds each
/// pixel's distance to its edge as a fraction of the penumbra's width.
///
/// # Errors
/// Fails if the images do not fit the constants.
pub fn beyond(
    data: &FrameData<'_>,
    settings: &Settings,
    seeds: &[WideSeed],
    hard: &[f32],
    (labels, shares): (&[u32], &[f32]),
    taps: u32,
) -> Result<Vec<Beyond>> {
    let view = View::new(data)?;
    let pixels = view.size[0] * view.size[1];
    if [hard.len(), labels.len(), shares.len()].iter().any(|n| *n != pixels) {
        return Err(Error::Usage(format!("mirror: not all images have {:?} pixels", view.size)));
    }
    let seeds: HashMap<u32, &WideSeed> = seeds.iter().map(|s| (s.0.label(), s)).collect();
    Ok(view.every_pixel(|pixel| {
        let i = view.index(pixel);
        let (Some((seed, _)), Some(p)) = (seeds.get(&labels[i]), view.receiver(pixel)) else {
            return Beyond::default();
        };
        let share = f64::from(shares[i]);
        if share <= 0.0 {
            return Beyond::default();
        }
        let (closest, error) = to_seed(&view, settings.lines, &p, seed);
        let (across, error) = (closest / share, (error - p.position_error.length()) / share);
        let line = Line { view: &view, s: settings, pixel, p, across, share, error };
        let mut found = Beyond::default();
        for k in 0..taps {
            let t = (f64::from(k) + 0.5) / f64::from(taps) - 0.5;
            let own = f64::from(hard[i]);
            let expected = if t < share { own } else { 1.0 - own };
            let [likely, least, most] = line.tap(t, expected, hard);
            found.change += likely / f64::from(taps);
            found.doubt += (likely - least).max(most - likely) / f64::from(taps);
        }
        found
    }))
}

/// Line of a pixel through its nearest edge.
struct Line<'a> {
    view: &'a View<'a>,
    s: &'a Settings,
    pixel: [usize; 2],
    p: Receiver,
    /// Vector across the edge, as long as the penumbra is wide, world units.
    across: DVec3,
    share: f64,
    /// Bound on the error of `across`, world units.
    error: f64,
}

impl Line<'_> {
    /// Returns the image position at parameter `t`, in pixels from the image's corner.
    fn place(&self, t: f64) -> Option<DVec2> {
        let clip = self.view.clip_from_view() * (self.p.position + t * self.across).extend(1.0);
        let size = dvec2(self.view.size[0] as f64, self.view.size[1] as f64);
        (clip.w > 0.0).then(|| (dvec2(clip.x, clip.y) / clip.w * 0.5 + 0.5) * size)
    }

    /// Returns what a tap adds: by the most likely decisions, at least and at most.
    fn tap(&self, t: f64, expected: f64, hard: &[f32]) -> [f64; 3] {
        let ends = [-0.5, 0.5].map(|t| self.place(t));
        let (Some(place), [Some(from), Some(to)]) = (self.place(t), ends) else { return [0.0; 3] };
        let pixels = from.distance(to);
        let (width, _) = self.view.pixel_width(self.p.position, self.p.position_error);
        // Error of a position: the error of the line's end, and the products of a few matrices.
        let error = t.abs() * self.error / width + 1e-4 + 1e-6 * (place.length() + pixels);
        let away = (t - self.share).abs() * pixels - EDGE_PIXELS;
        let far = Decision::positive(away, 1e-3 + 1e-4 * pixels + self.error / width);
        let at = |x: f64, y: f64| {
            let (x, y) = (x.floor(), y.floor());
            let inside = x >= 0.0 && y >= 0.0 && x < self.view.size[0] as f64 && y < self.view.size[1] as f64;
            inside.then_some([x as usize, y as usize])
        };
        let mut values = [0.0f64; 3];
        for (k, (x, y)) in
            [(0.0, 0.0), (-error, -error), (error, -error), (-error, error), (error, error)].into_iter().enumerate()
        {
            let Some(tap) = at(place.x + x, place.y + y) else {
                values = [values[0], values[1].min(0.0), values[2].max(0.0)];
                continue;
            };
            let same = far.and(self.same_surface(tap));
            let value = f64::from(hard[self.view.index(tap)]) - expected;
            if k == 0 {
                values[0] = if same.is_yes() { value } else { 0.0 };
                values = [values[0]; 3];
            }
            let likely = if same.is_yes() { value } else { 0.0 };
            let other = if same.is_doubtful() { value - likely } else { likely };
            values = [values[0], values[1].min(likely).min(other), values[2].max(likely).max(other)];
        }
        values
    }

    fn same_surface(&self, tap: [usize; 2]) -> Decision {
        let Some(q) = self.view.receiver(tap) else { return Decision::No };
        let tolerance = f64::from(self.s.seeds.tolerance);
        let vector = q.position - self.p.position;
        let error = (self.p.position_error + q.position_error).length() + ROUNDING * vector.length();
        if self.s.seeds.surfaces == SurfaceTest::Depth {
            return same_depth(self.p.position.z, q.position.z, error, tolerance);
        }
        let away = [0, 1].map(|i| self.pixel[i].abs_diff(tap[i]) as f64);
        let width = self.view.pixel_width(self.p.position, self.p.position_error);
        let pixels = away[0].hypot(away[1]).max(0.5);
        let (n, m) = ((self.p.normal, self.p.normal_error), (q.normal, q.normal_error));
        one_patch(n, m, &Apart { vector, error }, pixels, width, tolerance)
    }
}
