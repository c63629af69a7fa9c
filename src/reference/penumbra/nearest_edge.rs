//! Mirror of `glsl/penumbra/nearest_block.comp`, `nearest_quad.comp` and `nearest_edge.comp`, and of `line_blocks.comp`,
//! `line_quads.comp`, `nearest_line.glsl` and `beyond_edge.glsl`: the nearest edge by brute force over all seeds, and the
//! intensity of a penumbra of fixed width. `soft` has the forms under an area light.

pub mod soft;

use super::edge_seeds::{self, Seed};
use crate::reference::common::surface::{
    Apart, CURVED, Normal, Width, is_smooth, one_patch, same_depth, turn, turns_evenly,
};
use crate::reference::common::view::{Decision, FrameData, ROUNDING, Receiver, View};
use crate::reference::distance_transform::edt::{self, Mask};
use crate::technique::common::surface::SurfaceTest;
use crate::technique::distance_transform::NO_SEED;
use crate::{Error, Result};
use glam::DVec3;
use std::collections::HashMap;

/// Settings of the passes.
#[derive(Clone, Copy, Debug)]
pub struct Settings {
    /// Settings of the seeds.
    pub seeds: edge_seeds::Settings,
    /// Full width of the penumbra, world units.
    pub penumbra: f32,
    /// Width of the mean filter, world units.
    pub filter_width: f32,
    /// Seeds are short lines along the edge, not points.
    pub lines: bool,
}

impl Settings {
    /// Returns the distance from an edge, world units, within which the image may differ from hard shadows.
    pub fn reach(&self) -> f64 {
        // The passes use a slightly larger reach, so that rounding excludes nothing.
        0.5 * (f64::from(self.penumbra) + f64::from(self.filter_width)) * 1.000001f64.sqrt()
    }
}

/// Nearest shadow edge of a pixel.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Nearest {
    /// Label of the exact nearest seed, `x + 65536 y`; [`NO_SEED`] if none is in reach.
    pub label: u32,
    /// Distance to the seed's point, world units; infinite if there is none.
    pub distance: f64,
    /// Smallest and largest distance that is possible by rounding, by another point, or by another decision about
    /// which seeds exist or lie on the pixel's surface.
    pub range: [f64; 2],
}

const NOTHING: Nearest = Nearest { label: NO_SEED, distance: f64::INFINITY, range: [f64::INFINITY; 2] };

/// Link between a pixel and the seed of its label.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Link {
    /// Distance from the pixel's point to the edge's, world units.
    pub distance: f64,
    /// Bound on the distance's error in single precision, world units.
    pub error: f64,
    /// `true` if the edge lies on the pixel's surface.
    pub on_surface: bool,
    /// `true` where that decision lies within the rounding, or the seed itself is in doubt.
    pub doubtful: bool,
}

/// Returns every pixel's nearest seed in the world, among those on its surface and in reach.
///
/// # Errors
/// Fails if the images do not fit the constants.
pub fn in_world(data: &FrameData<'_>, settings: &Settings, seeds: &[Seed]) -> Result<Vec<Nearest>> {
    let view = View::new(data)?;
    Ok(view.every_pixel(|pixel| {
        let Some(p) = view.receiver(pixel) else { return NOTHING };
        let (reach, p_error) = (settings.reach(), p.position_error.length());
        let mut found = NOTHING;
        for seed in seeds {
            // Most seeds are clearly too far away.
            let (half_line, line_error) = if settings.lines { half_line(&view, seed) } else { (0.0, 0.0) };
            let limit = 1.00001 * (reach.min(found.range[1]) + p_error + seed.off() + half_line + line_error);
            if p.position.distance_squared(seed.point) > limit * limit {
                continue;
            }
            consider(&view, settings, pixel, &p, seed, &mut found);
        }
        found
    }))
}

/// Returns every pixel's nearest seed in the image, as in the paper. There is none if that seed lies on another
/// surface or out of reach.
///
/// # Errors
/// Fails if the images do not fit the constants.
pub fn in_image(data: &FrameData<'_>, settings: &Settings, seeds: &[Seed]) -> Result<Vec<Nearest>> {
    let view = View::new(data)?;
    let mut mask = Mask { size: view.size, seeds: vec![false; view.size[0] * view.size[1]] };
    let mut index = HashMap::new();
    for (i, seed) in seeds.iter().enumerate() {
        mask.seeds[view.index(seed.pixel)] = true;
        index.insert(seed.label(), i);
    }
    let labels = edt::nearest_fast(&mask, None);
    Ok(view.every_pixel(|pixel| {
        let seed = index.get(&labels[view.index(pixel)]);
        let (Some(&seed), Some(p)) = (seed, view.receiver(pixel)) else { return NOTHING };
        let mut found = NOTHING;
        consider(&view, settings, pixel, &p, &seeds[seed], &mut found);
        found
    }))
}

/// Returns every pixel's link to the seed of its label; `None` for [`NO_SEED`].
///
/// # Errors
/// Fails if the images do not fit the constants, or if a label belongs to no seed.
pub fn links(data: &FrameData<'_>, settings: &Settings, seeds: &[Seed], labels: &[u32]) -> Result<Vec<Option<Link>>> {
    let view = View::new(data)?;
    if labels.len() != view.size[0] * view.size[1] {
        return Err(Error::Usage(format!("mirror: {} labels for {:?} pixels", labels.len(), view.size)));
    }
    let seeds: HashMap<u32, &Seed> = seeds.iter().map(|s| (s.label(), s)).collect();
    let link = |pixel: [usize; 2]| {
        let label = labels[view.index(pixel)];
        if label == NO_SEED {
            return Ok(None);
        }
        let (x, y) = (label & 0xffff, label >> 16);
        let Some(seed) = seeds.get(&label) else {
            return Err(Error::Usage(format!("mirror: pixel {pixel:?} has the label {x}, {y}, but there is no seed")));
        };
        let Some(p) = view.receiver(pixel) else {
            return Err(Error::Usage(format!("mirror: pixel {pixel:?} has the label {x}, {y}, but no surface")));
        };
        let (distance, error) = distance(&view, settings, &p, seed);
        let on_surface = on_surface(&view, settings, pixel, &p, seed);
        let doubtful = on_surface.is_doubtful() || !seed.sure;
        Ok(Some(Link { distance, error, on_surface: on_surface.is_yes(), doubtful }))
    };
    view.every_pixel(link).into_iter().collect()
}

/// Evaluates eq. 8: the intensity at a point with hard visibility 0 or 1, at `distance` from the edge of a penumbra of
/// full width `penumbra`. Both are in world units.
///
/// ```
/// # use edgeshade::reference::penumbra::nearest_edge::intensity;
/// assert_eq!([intensity(0.0, 1.0, 4.0), intensity(1.0, 1.0, 4.0), intensity(0.0, 2.5, 4.0)], [0.25, 0.75, 0.0]);
/// ```
pub fn intensity(hard: f64, distance: f64, penumbra: f64) -> f64 {
    if distance.is_nan() || distance > 0.5 * penumbra {
        return hard;
    }
    let side = if hard > 0.5 { 1.0 } else { -1.0 };
    (0.5 + side * distance / penumbra).clamp(0.0, 1.0)
}

/// `HALF_LINE` of `glsl/penumbra/nearest_line.glsl`.
const HALF_LINE: f64 = 0.25;

/// Mirror of `halfLine`: half of the length of a seed's line, world units, and the bound of its error.
fn half_line(view: &View<'_>, seed: &Seed) -> (f64, f64) {
    let facing = seed.along.dot(view.ray(seed.point)).abs();
    let width = HALF_LINE * view.pixel_width(seed.point, DVec3::ZERO).0;
    let length = |facing: f64| width / (1.0 - facing * facing).max(0.01).sqrt();
    let change = length((facing + seed.along_error).min(1.0)) - length((facing - seed.along_error).max(0.0));
    (length(facing), change)
}

/// Returns the offset from a point to the closest point of a seed, and the bound of its error.
fn to_seed(view: &View<'_>, lines: bool, p: &Receiver, seed: &Seed) -> (DVec3, f64) {
    let apart = seed.point - p.position;
    let error = p.position_error.length() + seed.off() + 2.0 * ROUNDING * apart.length();
    if !lines {
        return (apart, error);
    }
    let (half_line, line_error) = half_line(view, seed);
    let closest = apart - apart.dot(seed.along).clamp(-half_line, half_line) * seed.along;
    // A line of unknown direction, or a point, ends half its length off.
    let off = half_line * if seed.along_error < 1.0 { seed.along_error } else { 2.0 };
    (closest, error + off + line_error)
}

/// Returns the distance from a point to a seed, and the bound of its error.
fn distance(view: &View<'_>, s: &Settings, p: &Receiver, seed: &Seed) -> (f64, f64) {
    let (closest, error) = to_seed(view, s.lines, p, seed);
    (closest.length(), error)
}

fn consider(view: &View<'_>, s: &Settings, pixel: [usize; 2], p: &Receiver, seed: &Seed, found: &mut Nearest) {
    let (distance, error) = distance(view, s, p, seed);
    let reach = s.reach();
    let slack = error + ROUNDING * reach;
    if distance - slack > reach || distance - error > found.range[1] {
        return;
    }
    let on_surface = on_surface(view, s, pixel, p, seed);
    if on_surface == Decision::No {
        return;
    }
    found.range[0] = found.range[0].min((distance - error).max(0.0));
    if on_surface == Decision::Yes && seed.sure && distance + slack <= reach {
        found.range[1] = found.range[1].min(distance + error);
    }
    if on_surface.is_yes() && distance <= reach && distance < found.distance {
        found.distance = distance;
        found.label = seed.label();
    }
}

/// Decides whether the seed's edge lies on the surface of `p`.
fn on_surface(view: &View<'_>, s: &Settings, pixel: [usize; 2], p: &Receiver, seed: &Seed) -> Decision {
    let tolerance = f64::from(s.seeds.tolerance);
    let vector = seed.point - p.position;
    let error = p.position_error.length() + seed.error + ROUNDING * vector.length();
    if s.seeds.surfaces == SurfaceTest::Depth {
        return same_depth(p.position.z, seed.point.z, error + seed.doubt.z.abs(), tolerance);
    }
    let away = [0, 1].map(|i| pixel[i].abs_diff(seed.pixel[i]) as f64);
    // The distance is at least one pixel: a pixel's own edge lies somewhere on the way to its neighbour.
    let pixels = away[0].hypot(away[1]).max(1.0);
    let width = view.pixel_width(p.position, p.position_error);
    let (n, m) = ((p.normal, p.normal_error), (seed.normal, seed.normal_error));
    // The doubt moves the point along the surface, and hardly off its planes.
    let off_plane = 0.5 * (n.0 + m.0).dot(seed.doubt).abs() + 0.5 * (n.1 + m.1) * seed.doubt.length();
    let patch = |tolerance| one_patch(n, m, &Apart { vector, error: error + off_plane }, pixels, width, tolerance);
    let smooth = is_smooth(n, m);
    let level = smooth.and(patch(tolerance));
    let curved = smooth.opposite().and(patch(CURVED * tolerance));
    if curved == Decision::No {
        return level;
    }
    let there = End { pixel: seed.pixel, position: seed.point, error: seed.off(), normal: m };
    level.or(curved.and(bends_evenly(view, &End::of(pixel, p), &there, width, tolerance)))
}

/// One end of a path over a surface.
struct End {
    pixel: [usize; 2],
    position: DVec3,
    /// Bound of the position's error.
    error: f64,
    normal: Normal,
}

impl End {
    fn of(pixel: [usize; 2], r: &Receiver) -> Self {
        Self { pixel, position: r.position, error: r.position_error.length(), normal: (r.normal, r.normal_error) }
    }
}

/// Mirror of `bendsEvenly` of `glsl/penumbra/nearest_edge.glsl`, between `a` and `b`, whose normals differ by more
/// than a crease's angle. `width` is that of the pixel at which the whole path starts.
fn bends_evenly(view: &View<'_>, a: &End, b: &End, width: Width, tolerance: f64) -> Decision {
    let middle = [0, 1].map(|i| (a.pixel[i] + b.pixel[i]) / 2);
    let Some(r) = view.receiver(middle) else { return Decision::No };
    let at_middle = End::of(middle, &r);
    let k = at_middle.normal;
    let is_patch = |end: &End| {
        let vector = r.position - end.position;
        let error = end.error + at_middle.error + ROUNDING * vector.length();
        let away = [0, 1].map(|i| end.pixel[i].abs_diff(middle[i]) as f64);
        one_patch(end.normal, k, &Apart { vector, error }, away[0].hypot(away[1]).max(1.0), width, tolerance)
    };
    let hidden = is_patch(a).or(is_patch(b)).opposite();
    let smooth = is_smooth(a.normal, k).and(is_smooth(k, b.normal));
    let even = turns_evenly(a.normal, k, b.normal);
    let halves = || {
        if a.pixel[0].abs_diff(b.pixel[0]).max(a.pixel[1].abs_diff(b.pixel[1])) <= 2 {
            return Decision::Yes;
        }
        let before = || bends_evenly(view, a, &at_middle, width, tolerance);
        let after = || bends_evenly(view, &at_middle, b, width, tolerance);
        let ((first, first_error), (second, second_error)) = (turn(a.normal, k), turn(k, b.normal));
        match Decision::positive(second - first, first_error + second_error) {
            Decision::Yes => before(),
            Decision::No => after(),
            Decision::Doubtful(true) => before().unless(after()),
            Decision::Doubtful(false) => after().unless(before()),
        }
    };
    let known = hidden.or(smooth);
    match known {
        Decision::Yes => known,
        _ if even == Decision::No => known,
        _ => known.or(even.and(halves())),
    }
}
