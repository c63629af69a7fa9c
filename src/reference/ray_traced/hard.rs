//! Hard shadows: one ray per pixel to the centre of the light.

use super::frame::{Lamp, Progress, Shade, render};
use super::trace::{Hit, RayScene};
use super::truth::Truth;
use crate::Result;
use crate::view::{CameraView, LightView};

/// Traces exact hard shadows of a point or directional light: visibility is 0 or 1. The light's size is ignored.
///
/// # Errors
/// Fails if the image has no pixels or too many, or if a view is not finite.
pub fn hard(
    scene: &RayScene,
    camera: &CameraView,
    light: &LightView,
    size: [u32; 2],
    progress: &Progress,
) -> Result<Truth> {
    let lamp = Lamp::new(scene, light);
    let (mut truth, seconds) = render(scene, camera, light, size, progress, |point, last| {
        let visibility = if is_lit(scene, &lamp, point.hit, last) { 1.0 } else { 0.0 };
        Shade { visibility, rays: 1 }
    })?;
    truth.seconds = seconds;
    Ok(truth)
}

/// Returns whether a point that faces the light sees its centre; `last` is the slot of the last occluder.
pub(super) fn is_lit(scene: &RayScene, lamp: &Lamp, hit: &Hit, last: &mut u32) -> bool {
    let origin = scene.above(hit);
    let (direction, t_max) =
        if lamp.directional { (lamp.axes[2], f64::INFINITY) } else { (lamp.position - origin, 1.0) };
    !scene.occluded_local(origin, direction, t_max, hit.triangle, last)
}
