//! Soft shadows: many rays per pixel to a square light.

use super::frame::{Lamp, Point, Progress, Shade, render};
use super::hard::hard;
use super::pyramid::{Class, Pyramid};
use super::trace::RayScene;
use super::truth::Truth;
use crate::sampling::Stratified;
use crate::view::{CameraView, LightKind, LightView};
use crate::{Error, Result};
use glam::DVec3;

/// Settings of [`soft`].
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct SoftSettings {
    /// Number of rays per pixel, 1 to 2^20. It is rounded to the nearest square, since the rays lie one in each cell
    /// of a grid.
    pub samples: u32,
    /// Decides with one ray, or none, where the light is provably seen entirely or not at all. The result is the same
    /// and takes a fraction of the time.
    pub adaptive: bool,
    /// Seed of the samples. Another seed gives an independent truth; the difference is the noise floor.
    pub seed: u64,
}

impl Default for SoftSettings {
    fn default() -> Self {
        Self { samples: 1024, adaptive: true, seed: 0 }
    }
}

/// Largest number of samples per pixel.
const MAX_SAMPLES: u32 = 1 << 20;

/// Light as a square, in local space.
struct Square {
    /// Middle of the square, or the direction to it for a directional light.
    middle: DVec3,
    /// Half-sides of the square.
    half: [DVec3; 2],
    normal: DVec3,
    directional: bool,
}

/// Traces soft shadows: the fraction of a square light that each pixel sees, by stratified sampling.
///
/// A spot light's square is centred on the light and perpendicular to its view axis. A directional light's square is
/// centred on its direction, with a half width of `tan(angle / 2)` at distance 1. Both are aligned with the axes of
/// the light's view and emit equally from every point. A sample below the horizon of the geometric normal counts as
/// hidden. A pixel whose normal is turned away from the light's *centre* is dark, as in [`hard`]. A light without size
/// gives the result of [`hard`].
///
/// # Errors
/// Fails like [`hard`], or if the number of samples is out of range.
pub fn soft(
    scene: &RayScene,
    camera: &CameraView,
    light: &LightView,
    size: [u32; 2],
    settings: &SoftSettings,
    progress: &Progress,
) -> Result<Truth> {
    if !(1..=MAX_SAMPLES).contains(&settings.samples) {
        return Err(Error::Usage(format!("{} light samples: must be 1 to {MAX_SAMPLES}", settings.samples)));
    }
    let half = match light.kind {
        LightKind::Spot { size } => 0.5 * size / scene.scale(),
        LightKind::Directional { angle } => (0.5 * angle).tan(),
    };
    if half == 0.0 {
        return hard(scene, camera, light, size, progress);
    }
    let lamp = Lamp::new(scene, light);
    let square = Square {
        middle: if lamp.directional { lamp.axes[2] } else { lamp.position },
        half: [lamp.axes[0] * half, lamp.axes[1] * half],
        normal: lamp.axes[2],
        directional: lamp.directional,
    };
    let grid = f64::from(settings.samples).sqrt().round() as u32;
    if settings.adaptive {
        scene.edges();
    }
    let (mut truth, seconds) = render(scene, camera, light, size, progress, |point, last| {
        let samples = Stratified::new(grid, point.pixel, settings.seed);
        let class = if settings.adaptive { square.classify(scene, point) } else { Class::Unknown };
        match class {
            Class::Lit => Shade { visibility: 1.0, rays: 0 },
            Class::Uniform => square.sample(scene, point, &samples, 0..1, last),
            Class::Unknown => square.sample(scene, point, &samples, 0..grid * grid, last),
        }
    })?;
    truth.samples = grid * grid;
    truth.seconds = seconds;
    Ok(truth)
}

impl Square {
    /// Returns the vector from a shadow ray's origin to the point `x, y` in `[-1, 1]` of the square; for a directional
    /// light, the direction.
    fn to(&self, origin: DVec3, x: f64, y: f64) -> DVec3 {
        let on_light = self.middle + self.half[0] * x + self.half[1] * y;
        if self.directional { on_light } else { on_light - origin }
    }

    fn classify(&self, scene: &RayScene, point: &Point) -> Class {
        let rim = [(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)].map(|(x, y)| self.to(point.origin, x, y));
        let lid = (!self.directional).then_some(self.normal);
        match Pyramid::new(point.origin, point.hit.normal, rim, lid) {
            Some(pyramid) => pyramid.classify(scene, point.hit.triangle),
            None => Class::Unknown,
        }
    }

    fn sample(
        &self,
        scene: &RayScene,
        point: &Point,
        samples: &Stratified,
        range: std::ops::Range<u32>,
        last: &mut u32,
    ) -> Shade {
        let t_max = if self.directional { f64::INFINITY } else { 1.0 };
        let (mut seen, mut rays) = (0u32, 0u64);
        let count = range.len() as f64;
        for i in range {
            let [x, y] = samples.point(i).map(|c| 2.0 * c - 1.0);
            let direction = self.to(point.origin, x, y);
            if !(point.hit.normal.dot(direction) > 0.0) {
                continue;
            }
            rays += 1;
            seen += u32::from(!scene.occluded_local(point.origin, direction, t_max, point.hit.triangle, last));
        }
        Shade { visibility: (f64::from(seen) / count) as f32, rays }
    }
}
