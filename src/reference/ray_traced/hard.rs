//! One ray a pixel to the centre of the light.

use super::frame::{Lamp, Progress, Shade, render};
use super::trace::RayScene;
use super::truth::Truth;
use crate::Result;
use crate::view::{CameraView, LightView};

/// Exact hard shadows of a point or parallel light: visibility is 0 or 1. The light's size is ignored.
///
/// # Errors
/// If the size is zero or absurd, or a view is not finite.
pub fn hard(
    scene: &RayScene,
    camera: &CameraView,
    light: &LightView,
    size: [u32; 2],
    progress: &Progress,
) -> Result<Truth> {
    let lamp = Lamp::new(scene, light);
    let (mut truth, seconds) = render(scene, camera, light, size, progress, |point, last| {
        let (direction, t_max) =
            if lamp.directional { (lamp.axes[2], f64::INFINITY) } else { (lamp.position - point.origin, 1.0) };
        let blocked = scene.occluded_local(point.origin, direction, t_max, point.hit.triangle, last);
        Shade { visibility: if blocked { 0.0 } else { 1.0 }, rays: 1 }
    })?;
    truth.seconds = seconds;
    Ok(truth)
}
