//! A camera and a light for scenes that have none, fitted to their bounds.
//!
//! Both are always finite: for an empty scene, a single point, a flat one, one of any size and place.

use super::{Bounds, Camera, Instance, Light, LightShape, Material, Mesh, Projection, Scene};
use crate::view::look_along;
use glam::{DAffine3, DMat3, DVec3, dvec3};

/// Full vertical angle of the fitted camera, radians (40 degrees).
const FOV_Y: f64 = 40.0 * std::f64::consts::PI / 180.0;
/// Towards the fitted camera: in front, to the right, from above. No axis is 0, so that a flat scene
/// is never seen edge-on.
const TOWARDS_CAMERA: DVec3 = dvec3(0.55, 0.5, 0.8);
/// Towards the fitted sun: 55 degrees high, from the left, so that shadows fall across the view.
const TOWARDS_SUN: DVec3 = dvec3(-0.5, 1.0, 0.45);

/// Corners of the ground, few enough for it to count as flat and convex where the light is fitted.
const GROUND_CORNERS: u32 = 96;
/// Radius of the ground in half diagonals of the scene.
const GROUND_RADIUS: f64 = 100.0;

/// A three-quarter view that shows the whole scene in an image of the given size.
///
/// The near plane lies in front of everything.
pub fn camera(scene: &Scene, image: [u32; 2]) -> Camera {
    let (bounds, size) = extent(scene);
    let center = bounds.center();
    let towards = TOWARDS_CAMERA.normalize();
    // Turned first, then moved back until the last corner is inside: tighter than a bounding sphere.
    let turned = look_along(center, -towards);
    let slope = (0.5 * FOV_Y).tan();
    let aspect = f64::from(image[0].max(1)) / f64::from(image[1].max(1));
    let corner_distance = |corner: DVec3| {
        let p = turned.matrix3.transpose() * (corner - center);
        p.z + (p.x.abs() / aspect).max(p.y.abs()) / slope
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

/// Lays a round floor under the scene, far beyond what a fitted camera sees of it: something for a lone
/// object to throw its shadow on. Fit camera and light first. Nothing happens to an empty scene.
pub fn add_ground(scene: &mut Scene) {
    let (bounds, size) = extent(scene);
    if bounds.is_empty() || scene.instances.is_empty() {
        return;
    }
    let ring = |i: u32| {
        let (sin, cos) = (f64::from(i) / f64::from(GROUND_CORNERS) * std::f64::consts::TAU).sin_cos();
        [sin as f32, 0.0, cos as f32]
    };
    let mut mesh = Mesh {
        name: "ground".into(),
        positions: (0..GROUND_CORNERS).map(ring).collect(),
        normals: vec![[0.0, 1.0, 0.0]; GROUND_CORNERS as usize],
        uvs: vec![[0.0; 2]; GROUND_CORNERS as usize],
        indices: (1..GROUND_CORNERS - 1).flat_map(|i| [0, i, i + 1]).collect(),
        material: scene.materials.len(),
        ..Mesh::default()
    };
    mesh.compute_bounds();
    let center = bounds.center();
    scene.instances.push(Instance {
        mesh: scene.meshes.len(),
        world_from_object: DAffine3 {
            matrix3: DMat3::from_diagonal(DVec3::splat(GROUND_RADIUS * size)),
            translation: dvec3(center.x, bounds.min.y, center.z),
        },
    });
    scene.meshes.push(mesh);
    scene.materials.push(Material {
        name: "ground".into(),
        base_color: [0.27, 0.265, 0.26, 1.0],
        ..Material::default()
    });
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
