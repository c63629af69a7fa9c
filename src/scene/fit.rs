//! A camera and a light for scenes that have none, fitted to their bounds.
//!
//! Both are always finite: for an empty scene, a single point, a flat one, one of any size and place.

use super::{Bounds, Camera, Light, LightShape, Projection, Scene};
use crate::view::look_along;
use glam::{DAffine3, DVec3, dvec3};

/// Full vertical angle of the fitted camera, radians (40 degrees).
const FOV_Y: f64 = 40.0 * std::f64::consts::PI / 180.0;
/// Towards the fitted camera: in front, to the right, from above. No axis is 0, so that a flat scene
/// is never seen edge-on.
const TOWARDS_CAMERA: DVec3 = dvec3(0.55, 0.5, 0.8);
/// Towards the fitted sun: 55 degrees high, from the left, so that shadows fall across the view.
const TOWARDS_SUN: DVec3 = dvec3(-0.5, 1.0, 0.45);

/// A three-quarter view that shows the whole scene in an image at least as wide as high.
///
/// The near plane lies in front of everything.
pub fn camera(scene: &Scene) -> Camera {
    let (bounds, size) = extent(scene);
    let center = bounds.center();
    let towards = TOWARDS_CAMERA.normalize();
    // Turned first, then moved back until the last corner is inside: tighter than a bounding sphere.
    let turned = look_along(center, -towards);
    let slope = (0.5 * FOV_Y).tan();
    let corner_distance = |corner: DVec3| {
        let p = turned.matrix3.transpose() * (corner - center);
        p.z + p.x.abs().max(p.y.abs()) / slope
    };
    let corners = bounds.corners();
    let tight = corners.into_iter().map(corner_distance).fold(size, f64::max);
    // The margin also keeps the nearest corner at a twentieth of the distance or more, behind the near plane.
    let distance = 1.1 * tight;
    Camera {
        name: "fitted".into(),
        world_from_camera: DAffine3 { translation: center + towards * distance, ..turned },
        projection: Projection::Perspective { fov_y: FOV_Y, near: 0.01 * distance },
    }
}

/// A directional light, high and from the left of the fitted camera, at a distance from which it has
/// the whole scene in front of it.
///
/// Its angle is left open, as in a file that does not say.
pub fn light(scene: &Scene) -> Light {
    let (bounds, size) = extent(scene);
    let center = bounds.center();
    let towards = TOWARDS_SUN.normalize();
    Light {
        name: "fitted sun".into(),
        world_from_light: look_along(center + towards * 2.0 * size, -towards),
        shape: LightShape::Directional { angle: None },
        color: [1.0; 3],
    }
}

/// Bounds of the scene, a point if it is empty, and half their diagonal; for a point some length that
/// its coordinates can resolve.
fn extent(scene: &Scene) -> (Bounds, f64) {
    let bounds = scene.bounds();
    let bounds = if bounds.is_empty() { Bounds { min: DVec3::ZERO, max: DVec3::ZERO } } else { bounds };
    let resolvable = 1e-13 * bounds.center().abs().max_element();
    let radius = bounds.radius();
    // Below 1e-30 its square would be lost.
    if radius > resolvable.max(1e-30) { (bounds, radius) } else { (bounds, resolvable.max(1.0)) }
}
