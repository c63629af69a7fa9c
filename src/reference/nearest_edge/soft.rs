//! The search where every seed has a penumbra width of its own (`SOFT` of `glsl/pass/nearest_edge.glsl`).

use super::{Link, Nearest, on_surface};
use crate::pass::edt::NO_SEED;
use crate::pass::penumbra_width::{Meet, Metric};
use crate::reference::FrameData;
use crate::reference::edge_seeds::{self, Seed};
use crate::reference::view::{Decision, ROUNDING, Receiver, View};
use crate::{Error, Result};
use glam::DVec3;
use std::collections::HashMap;

/// Settings of the passes.
#[derive(Clone, Copy, Debug)]
pub struct Settings {
    /// Those of the seeds.
    pub seeds: edge_seeds::Settings,
    /// Which edge counts.
    pub meet: Meet,
    /// How distances are measured.
    pub metric: Metric,
    /// Width of the mean filter, a share of the penumbra's.
    pub filter_width: f32,
}

impl Settings {
    /// Within this distance of an edge, a share of its penumbra's width, the image may differ from hard shadows.
    pub fn reach(&self) -> f64 {
        // The passes take a little more, so that rounding takes nothing off.
        0.5 * (1.0 + f64::from(self.filter_width)) * 1.000001f64.sqrt()
    }

    fn on_surface(&self) -> super::Settings {
        super::Settings { seeds: self.seeds, penumbra: 1.0, filter_width: self.filter_width }
    }
}

/// A seed with the penumbra's width and the cosine that it was given.
pub type WideSeed = (Seed, [f32; 2]);

/// A distance as it is measured, in world units, and the bound of its error.
struct Measured(f64, f64);

/// What of a pixel distances are measured by.
struct Place {
    p: Receiver,
    axis: DVec3,
    ray: DVec3,
    ray_error: f64,
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
        Self { p, axis, ray: -towards / facing, ray_error }
    }

    fn measure(&self, s: &Settings, (seed, [_, cosine]): &WideSeed) -> Measured {
        let apart = seed.point - self.p.position;
        let length = apart.length();
        let error = self.p.position_error.length() + seed.error + 2.0 * ROUNDING * length;
        if s.metric == Metric::World {
            return Measured(length, error);
        }
        let across = apart - apart.dot(self.axis) * self.ray;
        let stretch = 1.0 + self.ray.length();
        let across_error = error * stretch + length * (self.ray_error + 2.0 * ROUNDING * stretch);
        let cosine = f64::from(*cosine);
        Measured(across.length().max(length * cosine), across_error.max(error * cosine))
    }
}

/// Every pixel's exact nearest seed, on its surface: with [`Meet::Weighted`] by the share of its penumbra's width, of those
/// in reach; with [`Meet::Nearest`] in world units, of all.
///
/// # Errors
/// Images that do not fit the constants.
pub fn in_world(data: &FrameData<'_>, settings: &Settings, seeds: &[WideSeed]) -> Result<Vec<Nearest>> {
    let view = View::new(data)?;
    let reach = settings.reach();
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
            let reach = if settings.meet == Meet::Weighted { reach } else { f64::INFINITY };
            // Most are too far off by any measure.
            let limit = 1.00001 * (reach.min(found.range[1]) * unit / cosine + p.position_error.length() + seed.error);
            if place.p.position.distance_squared(seed.point) > limit * limit {
                continue;
            }
            let Measured(distance, error) = place.measure(settings, wide);
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

/// Every pixel with the seed of its label, and the distance to it as a share of the penumbra's width there; `None` for
/// [`NO_SEED`].
///
/// # Errors
/// Images that do not fit the constants, or a label that is no seed's.
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
            let problem = format!("mirror: pixel {pixel:?} has the label {x}, {y}, which is no seed with a penumbra");
            return Err(Error::Usage(problem));
        };
        let Some(p) = view.receiver(pixel) else {
            return Err(Error::Usage(format!("mirror: pixel {pixel:?} has the label {x}, {y}, but no surface")));
        };
        let width = f64::from(wide.1[0]);
        let Measured(distance, error) = Place::new(&view, p).measure(settings, wide);
        let (distance, error) = (distance / width, error / width + 2.0 * ROUNDING * distance / width);
        let on_surface = on_surface(&view, &settings.on_surface(), pixel, &p, &wide.0);
        let doubtful = on_surface.is_doubtful() || !wide.0.sure;
        Ok(Some(Link { distance, error, on_surface: on_surface.is_yes(), doubtful }))
    };
    view.every_pixel(link).into_iter().collect()
}

/// Every pixel's point and unit normal in camera view space; `None` for the sky.
///
/// # Errors
/// Images that do not fit the constants.
pub fn points(data: &FrameData<'_>) -> Result<Vec<Option<(DVec3, DVec3)>>> {
    let view = View::new(data)?;
    Ok(view.every_pixel(|pixel| view.receiver(pixel).map(|r| (r.position, r.normal))))
}
