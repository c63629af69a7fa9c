//! Penumbrae of a fixed width around the exact boundary of hard shadows.
//!
//! This is the model of Macedo and Apolinário, *Euclidean distance transform soft shadow mapping*, 2018, eq. 8,
//! without its approximations: no map, no image-space distance, no nearest *pixel*. `D` is the distance in the world
//! from a point to the nearest boundary of the hard shadow on the same surface, and `P` is the width of the penumbra:
//!
//! ```text
//! I = 1/2 + D/P  if lit,  1/2 - D/P  if in shadow,  where D <= P/2;  else the hard visibility
//! ```
//!
//! # Boundary
//!
//! The boundary lies where the hard visibility, of rays to the light's centre, changes on a surface. Samples lie on a
//! lattice of `S x S` per pixel, one of them in the pixel's centre. Between two neighbours that differ, bisection with
//! camera rays finds the change to 2^-20 of their distance. A line joins the changes on the sides of a lattice cell if
//! there are two.
//!
//! The terminator, where a surface turns away from the light, is such a change. So a smooth body has a penumbra on
//! both sides of it, even where a technique leaves pixels dark because they face away. The crease of a box is no
//! boundary: the surface ends there.
//!
//! # Same surface
//!
//! Two points are on the same surface if
//!
//! * their triangles are connected over edges that turn by less than 30 degrees, and neither point lies farther than
//!   45 degrees from the other's tangent plane (a quarter of a cylinder), as on a drum or a terrain; or
//! * they lie in one plane, within a thousandth of their distance and of a radian, as on a floor of several objects or
//!   on two sides of a gap.
//!
//! A bisected change counts only if the surface is the same there too and has no gap in depth: the outline of an
//! object in front of a shadow is no boundary. None of this depends on the scene's scale.
//!
//! # Accuracy
//!
//! Let `h` be the diagonal of a lattice cell projected onto the surface, in world units. Where the boundary passes
//! through cells as a smooth curve of curvature `k`, `D` is exact to `h^2 k / 8`, and to rounding for straight
//! boundaries on planes. Where the boundary has a corner in a cell, or ends there at an outline, `D` is off by at most
//! `h`. Lit or dark specks that fit between the samples, less than `1/S` pixel across, may be missed entirely; `D` is
//! then too large near them.
//!
//! Boundary that the camera does not see is also missed: behind an object, or outside the picture by more than the
//! margin. The margin is the widest projection of `P/2` at the picture's border, but at most an eighth of the longer
//! side.

mod boundary;
mod nearest;

pub use boundary::Lattice;

use super::frame::{Eye, Lamp, Progress, check};
use super::hard::hard;
use super::trace::RayScene;
use super::truth::{SKY, Truth};
use crate::view::{CameraView, LightView};
use crate::{Error, Result};
use boundary::Boundary;
use glam::DVec3;
use nearest::{Nearest, Place};
use rayon::prelude::*;
use std::sync::atomic::{AtomicU64, Ordering};
use std::time::Instant;

/// Largest number of samples along a pixel's side.
pub const MAX_SUBSAMPLES: u32 = 16;

/// Cosine of 30 degrees: a surface continues over an edge that turns by less.
const SMOOTH_COSINE: f64 = 0.866_025_403_784_438_6;

/// Settings of [`fixed_penumbra`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FixedPenumbraSettings {
    /// Full width of the penumbra, world units; greater than 0.
    pub penumbra: f64,
    /// Number of samples along a pixel's side for finding the boundary, 1 to [`MAX_SUBSAMPLES`].
    pub subsamples: u32,
}

/// Computes penumbrae of a fixed width around exact hard shadows: see the [module](self). The light's size is ignored.
///
/// The result is that of [`hard`], except for its visibility, `samples` (`subsamples` squared), `rays` and `seconds`.
/// The sky is 1.
///
/// # Errors
/// Fails like [`hard`], or if a setting is out of range.
pub fn fixed_penumbra(
    scene: &RayScene,
    camera: &CameraView,
    light: &LightView,
    size: [u32; 2],
    settings: &FixedPenumbraSettings,
    progress: &Progress,
) -> Result<Truth> {
    let FixedPenumbraSettings { penumbra, subsamples } = *settings;
    if !(penumbra > 0.0 && penumbra.is_finite()) {
        return Err(Error::Usage(format!("a penumbra of {penumbra}: must be a finite width above 0, world units")));
    }
    if !(1..=MAX_SUBSAMPLES).contains(&subsamples) {
        return Err(Error::Usage(format!("{subsamples} samples along a pixel's side: must be 1 to {MAX_SUBSAMPLES}")));
    }
    check(camera, light, size)?;
    let started = Instant::now();
    let (eye, lamp) = (Eye::new(scene, camera, size), Lamp::new(scene, light));
    let lattice = Lattice::new(size, subsamples, margin(scene, &eye, camera, size, 0.5 * penumbra));
    let pixels = u64::from(size[0]) * u64::from(size[1]);
    let total = lattice.samples() + 2 * pixels;

    let mut truth = hard(scene, camera, light, size, &|done, _| progress(done, total))?;
    let surfaces = scene.smooth_surfaces(SMOOTH_COSINE);
    let (segments, rays) = Boundary { scene, eye: &eye, lamp: &lamp, lattice: &lattice, surfaces: &surfaces }
        .trace(&|done| progress(pixels + done, total));
    truth.rays += rays;
    let nearest = Nearest::new(segments);
    let done = AtomicU64::new(pixels + lattice.samples());
    let width = size[0] as usize;
    let reach = 0.5 * penumbra / scene.scale();
    truth.visibility.par_chunks_mut(width).enumerate().for_each(|(y, row)| {
        for (x, visibility) in row.iter_mut().enumerate() {
            // `hard` has traced this ray.
            if truth.triangle[y * width + x] == SKY {
                continue;
            }
            let (origin, direction, t_max) = eye.ray_at([x as f64, y as f64]);
            let Some(hit) = scene.primary_local(origin, direction, t_max) else { continue };
            let place = Place { position: hit.local, normal: hit.normal, surface: surfaces[hit.triangle as usize] };
            if let Some(distance) = nearest.distance(&place, reach) {
                *visibility = intensity(*visibility, distance, 2.0 * reach) as f32;
            }
        }
        let row = row.len() as u64;
        progress(done.fetch_add(row, Ordering::Relaxed) + row, total);
    });
    truth.samples = subsamples * subsamples;
    truth.seconds = started.elapsed().as_secs_f64();
    Ok(truth)
}

/// Evaluates eq. 8 of the paper from the hard visibility and the distance to its boundary, in the unit of `penumbra`.
fn intensity(hard: f32, distance: f64, penumbra: f64) -> f64 {
    let offset = (distance / penumbra).min(0.5);
    if hard > 0.5 { 0.5 + offset } else { 0.5 - offset }
}

/// Returns how many pixels around the picture to search for boundary that is up to `reach` world units away.
fn margin(scene: &RayScene, eye: &Eye, camera: &CameraView, size: [u32; 2], reach: f64) -> u32 {
    let most = size[0].max(size[1]).div_ceil(8);
    let [right, bottom] = size.map(|n| n - 1);
    let columns = (0..size[0]).flat_map(|x| [[x, 0], [x, bottom]]);
    let border: Vec<[u32; 2]> = columns.chain((0..size[1]).flat_map(|y| [[0, y], [right, y]])).collect();
    let widest = border
        .par_iter()
        .filter_map(|pixel| {
            let (origin, direction, t_max) = eye.ray_at(pixel.map(f64::from));
            let hit = scene.primary_local(origin, direction, t_max)?;
            let p = eye.to_view(hit.local);
            let pixel = |p: DVec3| {
                let c = camera.clip_from_view * p.extend(1.0);
                c.truncate().truncate() / c.w * 0.5 * glam::dvec2(size[0].into(), size[1].into())
            };
            let step = |d: DVec3| (pixel(p + reach * d) - pixel(p)).abs().max_element();
            Some(step(DVec3::X).max(step(DVec3::Y)))
        })
        .reduce(|| 0.0, f64::max);
    // The cast saturates, also for NaN and infinity.
    (widest.ceil() as u32).saturating_add(1).min(most)
}

#[cfg(test)]
mod tests;
