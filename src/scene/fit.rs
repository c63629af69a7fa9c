//! Camera and light for scenes that have none, fitted to their bounds.
//!
//! Both are finite for every scene: for an empty one, a single point, a flat one, and one of any size and position.

use super::{Bounds, Camera, Instance, Light, LightShape, Material, Mesh, Projection, Scene};
use crate::view::look_along;
use glam::{DAffine3, DMat3, DVec3, dvec3};

/// Full vertical field of view of the fitted camera, radians (40 degrees).
const FOV_Y: f64 = 40.0 * std::f64::consts::PI / 180.0;
/// Direction towards the fitted camera: from the front, the right and above. No component is 0, so a flat scene is
/// never seen edge-on.
const TOWARDS_CAMERA: DVec3 = dvec3(0.55, 0.5, 0.8);
/// Direction towards the fitted sun: 55 degrees high, from the left, so that shadows fall across the view.
const TOWARDS_SUN: DVec3 = dvec3(-0.5, 1.0, 0.45);

/// Number of corners of the ground; few enough for the light's fit to treat it as flat and convex.
const GROUND_CORNERS: u32 = 96;
/// Radius of the ground, in half diagonals of the scene.
const GROUND_RADIUS: f64 = 100.0;

/// Largest height of a floor above the scene's lowest point, as a fraction of the scene's size.
const FLOOR_RISE: f64 = 1e-3;
/// Smallest fraction of the scene's ground area that a floor covers.
const FLOOR_SHARE: f64 = 0.5;
/// Longest shadow that a fitted camera frames, in diagonals of its caster. The shadow of a sun near the horizon has no
/// end.
const LONGEST_SHADOW: f64 = 1.0;

/// Floor of a scene: the level triangles at its lowest height that can be seen from above. They must cover at least
/// half of the scene's ground area.
struct Floor {
    /// Bounds of the scene without the floor.
    rest: Bounds,
    /// Bounds of the floor.
    bounds: Bounds,
}

/// Returns every triangle in world space, once per instance, and whether it is double-sided.
fn triangles(scene: &Scene) -> impl Iterator<Item = ([DVec3; 3], bool)> {
    scene.instances.iter().flat_map(|instance| {
        let mesh = &scene.meshes[instance.mesh];
        let double_sided = scene.materials.get(mesh.material).is_some_and(|m| m.double_sided);
        let at = |i: u32| {
            let p = glam::Vec3::from(mesh.positions[i as usize]).as_dvec3();
            instance.world_from_object.transform_point3(p)
        };
        // A mirroring transform reverses the winding.
        let mirrored = instance.world_from_object.matrix3.determinant() < 0.0;
        mesh.indices.chunks_exact(3).map(move |t| {
            let [a, b, c] = [at(t[0]), at(t[1]), at(t[2])];
            (if mirrored { [a, c, b] } else { [a, b, c] }, double_sided)
        })
    })
}

/// Returns the area of a triangle that is almost level and nowhere higher than `top`, negative if it faces down; 0 for any
/// other triangle.
fn level_area([a, b, c]: [DVec3; 3], top: f64) -> f64 {
    let normal = (b - a).cross(c - a);
    let is_level = [a, b, c].iter().all(|p| p.y <= top) && normal.y.abs() > 0.99 * normal.length();
    if is_level { 0.5 * normal.y } else { 0.0 }
}

fn floor(scene: &Scene) -> Option<Floor> {
    let bounds = scene.bounds();
    let size = bounds.max - bounds.min;
    let top = bounds.min.y + FLOOR_RISE * size.max_element();
    let mut floor = Floor { rest: Bounds::EMPTY, bounds: Bounds::EMPTY };
    let (mut area, mut turned) = (0.0, 0.0);
    for ([a, b, c], double_sided) in triangles(scene) {
        // A floor that faces down is double-sided.
        let up = level_area([a, b, c], top);
        let is_floor = up > 0.0 || up < 0.0 && double_sided;
        let part = if is_floor { &mut floor.bounds } else { &mut floor.rest };
        [a, b, c].iter().for_each(|&p| part.include(p));
        area += if is_floor { up.abs() } else { 0.0 };
        turned += if is_floor { (-up).max(0.0) } else { 0.0 };
    }
    // The bottom of a double-sided box faces down too, but reaches no farther than the box.
    let reach = |b: &Bounds| if b.is_empty() { 0.0 } else { (b.max - b.min).x * (b.max - b.min).z };
    let is_bottom = turned > 0.5 * area && reach(&floor.bounds) <= 1.5 * reach(&floor.rest);
    (area > 0.0 && area >= FLOOR_SHARE * size.x * size.z && !is_bottom).then_some(floor)
}

/// Returns the height for a ground under the scene: its lowest height. If something level that is seen from above lies
/// there, such as a rug, the ground lies just below it, because both would otherwise have the same depth.
fn ground_height(scene: &Scene) -> f64 {
    let (bounds, size) = extent(scene);
    let top = bounds.min.y + FLOOR_RISE * size;
    if triangles(scene).any(|(triangle, _)| level_area(triangle, top) > 0.0) {
        bounds.min.y - FLOOR_RISE * size
    } else {
        bounds.min.y
    }
}

/// Returns whether the scene has its own floor to receive shadows.
pub fn has_floor(scene: &Scene) -> bool {
    floor(scene).is_some()
}

/// Returns the points that a fitted camera shows: the casters and their shadow on the ground. The camera shows only the
/// part of a floor that lies below these.
fn framed(scene: &Scene, light: Option<&Light>) -> Vec<DVec3> {
    let floor = floor(scene).filter(|f| !f.rest.is_empty());
    let (bounds, _) = extent(scene);
    let subject = floor.as_ref().map_or(bounds, |f| f.rest);
    let mut points = subject.corners().to_vec();
    let towards = match light {
        None => TOWARDS_SUN.normalize(),
        Some(l) if matches!(l.shape, LightShape::Spot { .. }) => {
            (l.world_from_light.translation - subject.center()).normalize_or(TOWARDS_SUN.normalize())
        }
        Some(l) => l.world_from_light.matrix3.z_axis,
    };
    let ground = floor.as_ref().map_or(subject.min.y, |f| f.bounds.max.y);
    if towards.y > 0.0 {
        let longest = LONGEST_SHADOW * 2.0 * subject.radius();
        for corner in subject.corners() {
            let along = ((corner.y - ground) / towards.y).clamp(0.0, longest);
            let mut shadow = corner - along * towards;
            if let Some(floor) = &floor {
                shadow = shadow.clamp(floor.bounds.min, floor.bounds.max.max(subject.max));
            }
            points.push(shadow);
        }
    }
    points
}

/// Returns a three-quarter view of the whole scene and its shadow in an image of the given size. It does not show all
/// of a floor that reaches beyond them. The light is the scene's first one, or else the fitted one.
///
/// The near plane lies in front of everything that is shown.
pub fn camera(scene: &Scene, image: [u32; 2]) -> Camera {
    camera_under(scene, scene.lights.first(), image)
}

/// Returns [`camera`] under a given light; `None` means the fitted one.
pub fn camera_under(scene: &Scene, light: Option<&Light>, image: [u32; 2]) -> Camera {
    let points = framed(scene, light);
    let mut bounds = Bounds::EMPTY;
    points.iter().for_each(|&p| bounds.include(p));
    let size = resolvable_radius(&bounds);
    let center = bounds.center();
    let towards = TOWARDS_CAMERA.normalize();
    // The camera is turned first, then moved back until every corner is inside. This is tighter than a bounding sphere.
    let turned = look_along(center, -towards);
    let slope = (0.5 * FOV_Y).tan();
    let aspect = f64::from(image[0].max(1)) / f64::from(image[1].max(1));
    let corner_distance = |corner: DVec3| {
        let p = turned.matrix3.transpose() * (corner - center);
        p.z + (p.x.abs() / aspect).max(p.y.abs()) / slope
    };
    let tight = points.into_iter().map(corner_distance).fold(size, f64::max);
    // The margin also keeps the nearest corner behind the near plane, at a twentieth of the distance or more.
    let distance = 1.1 * tight;
    Camera {
        name: "fitted".into(),
        world_from_camera: DAffine3 { translation: center + towards * distance, ..turned },
        projection: Projection::Perspective { fov_y: FOV_Y, near: 0.01 * distance },
    }
}

/// Adds a round floor under the scene, far larger than a fitted camera shows, as a receiver for a lone object's
/// shadow. Fit camera and light first. An empty scene stays unchanged.
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
            translation: dvec3(center.x, ground_height(scene), center.z),
        },
    });
    scene.meshes.push(mesh);
    scene.materials.push(Material {
        name: "ground".into(),
        base_color: [0.27, 0.265, 0.26, 1.0],
        ..Material::default()
    });
}

/// Returns a directional light from high up on the fitted camera's left, far enough away to have the whole scene in
/// front of it.
///
/// Its angle is unset, as in a file that does not give one.
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

/// Returns the scene's bounds (a point if it is empty) and half their diagonal. For a point, the latter is a length
/// that its coordinates can resolve.
fn extent(scene: &Scene) -> (Bounds, f64) {
    let bounds = scene.bounds();
    let bounds = if bounds.is_empty() { Bounds { min: DVec3::ZERO, max: DVec3::ZERO } } else { bounds };
    (bounds, resolvable_radius(&bounds))
}

/// Returns half the diagonal of a box; for a point, a length that its coordinates can resolve.
fn resolvable_radius(bounds: &Bounds) -> f64 {
    let resolvable = 1e-13 * bounds.center().abs().max_element();
    let radius = bounds.radius();
    // The square of a radius below 1e-30 would underflow.
    if radius > resolvable.max(1e-30) { radius } else { resolvable.max(1.0) }
}

/// Smallest near plane of a perspective, as a fraction of the distance to the scene's end; it keeps depth a normal
/// number.
const LEAST_NEAR: f64 = 1e-12;

/// Margin of clip planes beyond the scene, as a fraction of its size.
const CLIP_AIR: f64 = 1e-3;

/// Returns the camera with near and far planes that lie outside the scene moved to its beginning and end along the
/// view. Depth is finer the closer the planes are, and exporters write arbitrary planes.
pub fn clamp_clip_planes(scene: &Scene, camera: &Camera) -> Camera {
    let bounds = scene.bounds();
    let mut out = camera.clone();
    if bounds.is_empty() {
        return out;
    }
    let view_from_world = camera.world_from_camera.inverse();
    let depths = bounds.corners().map(|c| -view_from_world.transform_point3(c).z);
    let air = CLIP_AIR * bounds.radius() + 1e-12 * depths.iter().fold(0.0, |a: f64, d| a.max(d.abs()));
    let first = depths.iter().copied().fold(f64::INFINITY, f64::min) - air;
    let last = depths.iter().copied().fold(f64::NEG_INFINITY, f64::max) + air;
    match &mut out.projection {
        // Depth is reversed and has no far plane, so a small near plane costs no precision.
        Projection::Perspective { near, .. } => *near = near.max(LEAST_NEAR * last.max(0.0)),
        Projection::Orthographic { near, far, .. } if first < *far && last > *near => {
            (*near, *far) = (near.max(first), far.min(last));
        }
        // The range between the planes is empty, so nothing is seen.
        Projection::Orthographic { .. } => {}
    }
    out
}
