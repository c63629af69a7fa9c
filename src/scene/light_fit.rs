//! Fit of a shadow map's view to a light of the file.

use super::{Bounds, Instance, Light, LightShape, Mesh, Scene};
use crate::view::{CameraView, LightView};
use glam::{DAffine3, DMat3, DMat4, DVec2, DVec3, DVec4, Vec3, dvec2, dvec3};

/// Largest field of view of a spot's shadow map, radians. Wider frusta waste most of the map; points outside count as
/// lit.
pub const MAX_SPOT_FOV: f64 = 160.0 * std::f64::consts::PI / 180.0;
/// Smallest ratio of near to far plane. Nearer objects are clamped to the near plane and still cast shadows.
const MIN_NEAR: f64 = 1e-3;
/// Full angular width of a sun whose file gives none, radians: 1.5 degrees, a hazy sun.
const DEFAULT_ANGLE: f64 = 1.5 * std::f64::consts::PI / 180.0;
/// Full width of a spot whose file gives none, as a fraction of its distance to the scene's middle.
const DEFAULT_SIZE: f64 = 0.03;
/// Largest widening of a sun's map for penumbrae beside the casters, in diagonals of the box around all casters.
const MOST_PENUMBRA: f64 = 2.0;
/// Largest ratio of the longer sides, cut to uncut, at which a map is cut to the part that a camera needs.
const WORTH_CUTTING: f64 = 0.5;
/// Margin of a cut map around the visible part, as a fraction of the longer side.
const SEEN_MARGIN: f64 = 0.1;
/// Largest number of triangles of a mesh that is tested for convexity.
const CONVEX_LIMIT: usize = 256;

/// Returns the shadow-map view of a light, as tight as the scene allows.
///
/// A spot keeps its cone; its near and far planes enclose the part of the scene inside the cone. The farther the near
/// plane, the finer the map's depth, so a ground that passes under the light must not pull the plane to the light. A
/// directional light gets the box of everything that can cast a shadow on anything. The ground below all other objects
/// does not count, however far it reaches, and points beside the casters are lit without a lookup. A sun with a size
/// casts penumbrae beside its casters, so its box is widened by the reach of the farthest of them.
///
/// The view is valid for any camera; see [`light_view_for`] for a given one.
pub fn light_view(scene: &Scene, light: &Light) -> LightView {
    fit(scene, light, None)
}

/// Returns [`light_view`], unless the camera sees so little of a sun's scene that most of the map would be wasted.
/// Then the map covers only what can cast a shadow on something visible.
///
/// If the camera sees half of the scene or more, along the longer side of the map, the map is the one for any camera.
/// Shadows therefore stay still while the camera moves.
pub fn light_view_for(scene: &Scene, light: &Light, camera: &CameraView) -> LightView {
    fit(scene, light, Some(camera))
}

fn fit(scene: &Scene, light: &Light, camera: Option<&CameraView>) -> LightView {
    let bounds = scene.bounds();
    match light.shape {
        LightShape::Spot { outer, size } => {
            let distance = (bounds.center() - light.world_from_light.translation).length();
            let size = size.unwrap_or(DEFAULT_SIZE * distance);
            let fov = (2.0 * outer).min(MAX_SPOT_FOV);
            // Planes of the sides, and one behind the light, which looks along its -Z.
            let slope = (0.5 * fov).tan();
            let side = |x: f64, y: f64| (dvec3(x, y, -slope), 0.5 * size);
            let planes = [side(1.0, 0.0), side(-1.0, 0.0), side(0.0, 1.0), side(0.0, -1.0), (DVec3::NEG_Z, 0.0)];
            let view_from_world = light.world_from_light.inverse();
            let lit = depth_range(scene, |i| view_from_world * i.world_from_object, &planes);
            let far = lit.map_or(0.0, |[_, far]| far * 1.001);
            let far = if far > 0.0 { far } else { bounds.radius().max(f64::MIN_POSITIVE.sqrt()) };
            let near = lit.map_or(far, |[near, _]| near * 0.999).clamp(far * MIN_NEAR, far * 0.5);
            LightView::spot(light.world_from_light, fov, near, far, size)
        }
        LightShape::Directional { angle } => directional(scene, light, angle.unwrap_or(DEFAULT_ANGLE), camera),
    }
}

/// Plane as normal and offset; positive inside.
type Plane = (DVec3, f64);

/// Returns the smallest and largest distance along the light's axis inside all planes; `None` if the scene has nothing
/// there. Planes and the instances' transforms are in a view that looks along -Z.
fn depth_range(scene: &Scene, view_from_object: impl Fn(&Instance) -> DAffine3, planes: &[Plane]) -> Option<[f64; 2]> {
    let inside = bounds_inside(scene, view_from_object, planes, &[2]);
    (!inside.is_empty()).then_some([-inside.max.z, -inside.min.z])
}

/// Returns the bounds, along the given axes, of the part of the scene inside all planes; other axes are arbitrary. The
/// bounds are empty if nothing lies inside.
fn bounds_inside(
    scene: &Scene,
    view_from_object: impl Fn(&Instance) -> DAffine3,
    planes: &[Plane],
    axes: &[usize],
) -> Bounds {
    let mut bounds = Bounds::EMPTY;
    let (mut polygon, mut clipped) = (vec![], vec![]);
    let widens = |bounds: &Bounds, points: &[DVec3]| {
        let outside = |p: &DVec3| axes.iter().any(|&k| p[k] < bounds.min[k] || p[k] > bounds.max[k]);
        points.iter().any(outside)
    };
    for instance in &scene.instances {
        let mesh = &scene.meshes[instance.mesh];
        if mesh.bounds.is_empty() {
            continue;
        }
        let view_from_object = view_from_object(instance);
        let corners = mesh.bounds.corners().map(|c| view_from_object.transform_point3(c));
        let is_outside = |&(n, o): &Plane| corners.iter().all(|&c| n.dot(c) + o < 0.0);
        if !widens(&bounds, &corners) || planes.iter().any(is_outside) {
            continue;
        }
        let at = |i: u32| view_from_object.transform_point3(Vec3::from(mesh.positions[i as usize]).as_dvec3());
        for t in mesh.indices.chunks_exact(3) {
            let triangle = [at(t[0]), at(t[1]), at(t[2])];
            if !widens(&bounds, &triangle) {
                continue;
            }
            polygon.clear();
            polygon.extend(triangle);
            for &(normal, offset) in planes {
                clip(&polygon, |p| normal.dot(p) + offset, &mut clipped);
                std::mem::swap(&mut polygon, &mut clipped);
            }
            polygon.iter().for_each(|&p| bounds.include(p));
        }
    }
    bounds
}

/// Clips a convex polygon to the part where `inside` is not negative (Sutherland, Hodgman 1974).
fn clip(polygon: &[DVec3], inside: impl Fn(DVec3) -> f64, out: &mut Vec<DVec3>) {
    out.clear();
    for (i, &a) in polygon.iter().enumerate() {
        let b = polygon[(i + 1) % polygon.len()];
        let (da, db) = (inside(a), inside(b));
        if da >= 0.0 {
            out.push(a);
        }
        if (da >= 0.0) != (db >= 0.0) {
            out.push(a.lerp(b, da / (da - db)));
        }
    }
}

fn directional(scene: &Scene, light: &Light, angle: f64, camera: Option<&CameraView>) -> LightView {
    let mut world_from_view = light.world_from_light;
    let rotation = world_from_view.matrix3.transpose();
    // The box is in the light's axes but around the scene's own middle, so that it is precise far from the origin.
    let bounds = scene.bounds();
    let center = bounds.center();
    let axes = Axes { rotation, origin: center };
    let view_from_object = |i: &Instance| axes.of_object(i);
    let around = |i: &Instance| scene.meshes[i.mesh].bounds.transformed(&view_from_object(i));
    let all = scene.instances.iter().map(around).fold(Bounds::EMPTY, Bounds::union);
    if all.is_empty() {
        return LightView::directional(world_from_view, [1.0; 2], 0.0, 1.0, angle);
    }
    let towards = -light.world_from_light.transform_vector3(DVec3::NEG_Z);
    // The test runs once per mesh, because thousands of instances may share one.
    let convex: Vec<bool> = scene.meshes.iter().map(is_convex).collect();
    // The slack depends on the instance's own size: a scene may be so large that a millionth of it exceeds the objects
    // in it.
    let slack = |i: &Instance| 1e-6 * scene.instance_bounds(i).radius();
    let casting = scene.instances.iter().filter(|i| !convex[i.mesh] || can_shadow(scene, i, towards, slack(i)));
    let casters: Vec<Bounds> = casting.map(around).filter(|b| !b.is_empty()).collect();
    let mut sides = if casters.is_empty() {
        all
    } else {
        with_penumbrae(&casters, angle, |planes| depth_range(scene, view_from_object, planes))
    };
    let mut depths = [all.min.z, all.max.z];
    let seen = camera.map(|c| {
        let planes = axes.frustum(&c.world_from_view, &c.clip_from_view);
        bounds_inside(scene, view_from_object, &planes, &[0, 1, 2])
    });
    if let Some(needed) = seen.and_then(|seen| needed(&casters, &seen, angle)) {
        let longest = |b: &Bounds| (b.max - b.min).truncate().max_element();
        if longest(&needed) <= WORTH_CUTTING * longest(&sides) {
            sides = needed;
            // These planes enclose everything that casts shadows into the map. The ground below the visible part does
            // not count.
            let planes = [
                (DVec3::X, -needed.min.x),
                (DVec3::NEG_X, needed.max.x),
                (DVec3::Y, -needed.min.y),
                (DVec3::NEG_Y, needed.max.y),
                (DVec3::Z, -needed.min.z),
            ];
            if let Some([nearest, farthest]) = depth_range(scene, view_from_object, &planes) {
                depths = [-farthest, -nearest];
            }
            (sides.min.z, sides.max.z) = (depths[0], depths[1]);
        }
    }
    let [lowest, highest] = depths;
    let size = if depths == [all.min.z, all.max.z] { all.radius() } else { sides.radius() };
    // A small margin keeps everything off the border, and gives a single point a box.
    let air = 1e-3 * (sides.max - sides.min).max_element() + 1e-6 * size.max(1e-30);
    let half = 0.5 * (sides.max - sides.min) + air;
    let depth_air = 1e-3 * (highest - lowest) + air;
    let middle = sides.center();
    world_from_view.translation = center + world_from_view.matrix3 * dvec3(middle.x, middle.y, highest + depth_air);
    let far = highest - lowest + 2.0 * depth_air;
    LightView::directional(world_from_view, [half.x, half.y], 0.0, far, angle)
}

/// Frame of reference: its axes as the rows of a rotation, and its origin in the world.
#[derive(Clone, Copy)]
struct Axes {
    rotation: DMat3,
    origin: DVec3,
}

impl Axes {
    /// Returns the transform from an instance's own space to these axes.
    fn of_object(&self, instance: &Instance) -> DAffine3 {
        let mut moved = instance.world_from_object;
        moved.translation -= self.origin;
        DAffine3 { matrix3: self.rotation, translation: DVec3::ZERO } * moved
    }

    /// Returns the planes of a view's frustum, without a far plane at infinity.
    fn frustum(&self, world_from_view: &DAffine3, clip_from_view: &DMat4) -> Vec<Plane> {
        let [x, y, z, w] = [0, 1, 2, 3].map(|i| clip_from_view.row(i));
        let eye = self.rotation * (world_from_view.translation - self.origin);
        let planes = [w + x, w - x, w + y, w - y, w - z, z].into_iter().filter(|p| p.truncate() != DVec3::ZERO);
        let plane = |p: DVec4| {
            let normal = self.rotation * (world_from_view.matrix3 * p.truncate());
            let length = normal.length();
            (normal / length, (p.w - normal.dot(eye)) / length)
        };
        planes.map(plane).collect()
    }
}

/// Returns the width of a shadow-map texel in pixels of the camera's image, in the middle of the part that both see;
/// `None` if they see nothing in common. Above a few pixels, shadows look coarse.
pub fn texel_in_pixels(
    scene: &Scene,
    camera: &CameraView,
    image: [u32; 2],
    light: &LightView,
    map_size: u32,
) -> Option<f64> {
    let axes = Axes { rotation: DMat3::IDENTITY, origin: scene.bounds().center() };
    let mut planes = axes.frustum(&camera.world_from_view, &camera.clip_from_view);
    planes.extend(axes.frustum(&light.world_from_view, &light.clip_from_view));
    let common = bounds_inside(scene, |i| axes.of_object(i), &planes, &[0, 1, 2]);
    if common.is_empty() {
        return None;
    }
    // World width, at the middle, of one of `n` units across a view.
    let width = |world_from_view: &DAffine3, clip_from_view: &DMat4, n: u32| {
        let distance = -world_from_view.inverse().transform_point3(axes.origin + common.center()).z;
        let w = clip_from_view.row(3).dot(dvec3(0.0, 0.0, -distance).extend(1.0));
        2.0 * w / (clip_from_view.y_axis.y.abs() * f64::from(n))
    };
    let texel = width(&light.world_from_view, &light.clip_from_view, map_size);
    let pixel = width(&camera.world_from_view, &camera.clip_from_view, image[1]);
    (pixel > 0.0).then_some(texel / pixel)
}

/// Returns the part of a sun's map that the visible receivers need, in the light's axes: it contains the casters above
/// them and their penumbrae. The ground below the lowest receiver casts nothing on them. `None` if nothing visible can
/// be shadowed.
fn needed(casters: &[Bounds], seen: &Bounds, angle: f64) -> Option<Bounds> {
    if seen.is_empty() {
        return None;
    }
    let slope = (0.5 * angle).tan();
    let highest = casters.iter().fold(f64::NEG_INFINITY, |h, c| h.max(c.max.z));
    // Filters read texels beside their receivers, and the camera may move a little.
    let reach = slope * (highest - seen.min.z).max(0.0);
    let most = MOST_PENUMBRA * (seen.max - seen.min).length();
    let margin = DVec2::splat(reach.min(most)) + SEEN_MARGIN * (seen.max - seen.min).truncate().max_element();
    let (low, high) = (seen.min - margin.extend(0.0), seen.max + margin.extend(0.0));
    let mut needed = Bounds::EMPTY;
    for caster in casters.iter().filter(|c| c.max.z > seen.min.z) {
        let throws = DVec3::new(1.0, 1.0, 0.0) * (slope * (caster.max.z - seen.min.z)).min(most);
        let part = Bounds { min: (caster.min - throws).max(low), max: (caster.max + throws).min(high) };
        if part.min.truncate().cmple(part.max.truncate()).all() {
            needed = needed.union(part);
        }
    }
    // The height range begins at the lowest receiver.
    needed.min.z = seen.min.z;
    needed.max.z = highest;
    (!needed.is_empty()).then_some(needed)
}

/// Returns the box of the casters in a sun's axes, widened by the penumbrae that they cast. The penumbra of a point at
/// height `z` widens on each side by `tan(angle / 2)` per unit of height down to the receiver. `depths` is
/// [`depth_range`].
fn with_penumbrae(casters: &[Bounds], angle: f64, depths: impl Fn(&[Plane]) -> Option<[f64; 2]>) -> Bounds {
    let bare = casters.iter().copied().fold(Bounds::EMPTY, Bounds::union);
    let slope = (0.5 * angle).tan();
    if slope <= 0.0 {
        return bare;
    }
    // Receivers in a penumbra lie within the casters' box, widened away from the sun.
    let top = slope * bare.max.z;
    let planes = [
        (dvec3(-1.0, 0.0, -slope), bare.max.x + top),
        (dvec3(1.0, 0.0, -slope), top - bare.min.x),
        (dvec3(0.0, -1.0, -slope), bare.max.y + top),
        (dvec3(0.0, 1.0, -slope), top - bare.min.y),
    ];
    let lowest = depths(&planes).map_or(bare.min.z, |[_, farthest]| -farthest);
    let mut wide = bare;
    for caster in casters {
        let reach = DVec2::splat((slope * (caster.max.z - lowest)).max(0.0)).extend(0.0);
        wide = wide.union(Bounds { min: caster.min - reach, max: caster.max + reach });
    }
    // A sun near the horizon would otherwise cast penumbrae over the whole ground.
    let most = MOST_PENUMBRA * (bare.max - bare.min).length();
    let clamped = |w: f64, b: f64| w.clamp(b - most, b + most);
    Bounds {
        min: dvec2(clamped(wide.min.x, bare.min.x), clamped(wide.min.y, bare.min.y)).extend(bare.min.z),
        max: dvec2(clamped(wide.max.x, bare.max.x), clamped(wide.max.y, bare.max.y)).extend(bare.max.z),
    }
}

/// Returns `false` only if an instance of a convex mesh surely casts no shadow on anything: all other instances lie
/// beyond one face of its box that faces the light, up to `slack`.
fn can_shadow(scene: &Scene, instance: &Instance, towards: DVec3, slack: f64) -> bool {
    let b = &scene.meshes[instance.mesh].bounds;
    if b.is_empty() {
        return false;
    }
    let m = instance.world_from_object.matrix3;
    let cofactors = [m.y_axis.cross(m.z_axis), m.z_axis.cross(m.x_axis), m.x_axis.cross(m.y_axis)];
    let mirrored = if m.determinant() < 0.0 { -1.0 } else { 1.0 };
    (0..6).all(|face| {
        let (axis, up) = (face / 2, face % 2 == 1);
        let mut normal = cofactors[axis] * if up { mirrored } else { -mirrored };
        // A flat box has two faces in one plane and no volume; its cofactors still give the normal.
        normal = normal.normalize_or_zero();
        if normal.dot(towards) <= 0.0 {
            return true;
        }
        let on_face = instance.world_from_object.transform_point3(if up { b.max } else { b.min });
        let others = scene.instances.iter().filter(|other| !std::ptr::eq(*other, instance));
        !others.map(|o| lowest(scene, o, normal, on_face)).all(|low| low >= -slack)
    })
}

/// Returns the smallest signed distance of an instance's box from a plane.
fn lowest(scene: &Scene, instance: &Instance, normal: DVec3, on_plane: DVec3) -> f64 {
    let corners = scene.meshes[instance.mesh].bounds.corners();
    let distance = |c| normal.dot(instance.world_from_object.transform_point3(c) - on_plane);
    corners.into_iter().map(distance).fold(f64::INFINITY, f64::min)
}

/// Returns whether no vertex lies in front of any triangle's plane; `false` for a large mesh. Affine maps preserve
/// convexity.
fn is_convex(mesh: &Mesh) -> bool {
    if mesh.triangles() > CONVEX_LIMIT {
        return false;
    }
    let at = |i: u32| Vec3::from(mesh.positions[i as usize]).as_dvec3();
    let slack = 1e-6 * mesh.bounds.radius();
    mesh.indices.chunks_exact(3).all(|t| {
        let (a, b, c) = (at(t[0]), at(t[1]), at(t[2]));
        let normal = (b - a).cross(c - a).normalize_or_zero();
        mesh.indices.iter().all(|&i| normal.dot(at(i) - a) <= slack)
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::{Material, load_bytes, shipped};
    use crate::view::look_at;
    use glam::DAffine3;

    fn planes(view: &LightView) -> [f64; 2] {
        let p = &view.clip_from_view;
        [p.w_axis.z / p.z_axis.z, p.w_axis.z / (1.0 + p.z_axis.z)]
    }

    /// Returns a ground of half width 50 at y = 0, and a spot at height 4 that looks down at 45 degrees with a half
    /// angle of 20 degrees.
    fn ground() -> (Scene, Light) {
        let positions = vec![[-50.0, 0.0, -50.0], [-50.0, 0.0, 50.0], [50.0, 0.0, 50.0], [50.0, 0.0, -50.0]];
        let mut mesh = Mesh { positions, indices: vec![0, 1, 2, 0, 2, 3], ..Mesh::default() };
        mesh.compute_bounds();
        let instances = vec![Instance { mesh: 0, world_from_object: DAffine3::IDENTITY }];
        let scene = Scene { meshes: vec![mesh], materials: vec![Material::default()], instances, ..Scene::default() };
        let light = Light {
            name: String::new(),
            world_from_light: look_at(dvec3(0.0, 4.0, 0.0), dvec3(4.0, 0.0, 0.0)),
            shape: LightShape::Spot { outer: 20f64.to_radians(), size: Some(0.0) },
            color: [1.0; 3],
        };
        (scene, light)
    }

    #[test]
    fn a_spot_encloses_what_it_lights() {
        let (scene, light) = ground();
        let [near, far] = planes(&light_view(&scene, &light));
        // The rays 25 and 65 degrees below the horizon meet the ground last and first.
        let along = |degrees: f64| 4.0 / degrees.to_radians().sin() * 20f64.to_radians().cos();
        assert!((near / along(65.0) - 1.0).abs() < 2e-3, "{near}, expected {}", along(65.0));
        assert!((far / along(25.0) - 1.0).abs() < 2e-3, "{far}, expected {}", along(25.0));
    }

    #[test]
    fn a_spot_in_the_ground_or_over_nothing_has_planes() {
        let (scene, mut light) = ground();
        light.world_from_light = look_at(dvec3(0.0, 0.0, 0.0), dvec3(4.0, -0.1, 0.0));
        let [near, far] = planes(&light_view(&scene, &light));
        assert!(near > 0.0 && far.is_finite() && (far / near - 1e3).abs() < 1.0, "{near} {far}");
        light.world_from_light = look_at(dvec3(0.0, 4.0, 0.0), dvec3(0.0, 9.0, 0.0));
        let [near, far] = planes(&light_view(&scene, &light));
        assert!(near > 0.0 && near < far && far.is_finite(), "{near} {far}");
        let [near, far] = planes(&light_view(&Scene::default(), &light));
        assert!(near > 0.0 && near < far && far.is_finite(), "{near} {far}");
    }

    #[test]
    fn shipped_spots_do_not_waste_their_depth() {
        for shipped in shipped::ALL {
            let scene = load_bytes(shipped.name, shipped.bytes).unwrap();
            let view = light_view(&scene, &scene.lights[0]);
            if !view.is_directional() {
                let [near, far] = planes(&view);
                assert!(far < 20.0 * near, "{}: {near} to {far}", shipped.name);
            }
        }
    }

    /// Returns a square of half width `half` at height `y`, facing up.
    fn square(half: f32, y: f32) -> Mesh {
        let positions = vec![[-half, y, -half], [-half, y, half], [half, y, half], [half, y, -half]];
        let mut mesh = Mesh { positions, indices: vec![0, 1, 2, 0, 2, 3], ..Mesh::default() };
        mesh.compute_bounds();
        mesh
    }

    /// Returns a square of half width 1 at height 4 over a ground of half width `ground`, under a sun at an elevation
    /// in radians.
    fn floating(ground: f32, elevation: f64, angle: f64) -> (Scene, Light) {
        let meshes = vec![square(ground, 0.0), square(1.0, 4.0)];
        let instances = (0..2).map(|mesh| Instance { mesh, world_from_object: DAffine3::IDENTITY }).collect();
        let scene = Scene { meshes, materials: vec![Material::default()], instances, ..Scene::default() };
        let light = Light {
            name: String::new(),
            world_from_light: look_at(50.0 * dvec3(elevation.cos(), elevation.sin(), 0.0), DVec3::ZERO),
            shape: LightShape::Directional { angle: Some(angle) },
            color: [1.0; 3],
        };
        (scene, light)
    }

    /// Returns the half extents of a directional light's map.
    fn half(view: &LightView) -> DVec2 {
        dvec2(view.clip_from_view.x_axis.x, view.clip_from_view.y_axis.y).abs().recip()
    }

    #[test]
    fn a_sun_encloses_its_penumbrae() {
        for elevation in [90.0f64, 60.0, 25.0].map(f64::to_radians) {
            for angle in [0.0, 0.01, 0.1, 0.4] {
                let (scene, light) = floating(40.0, elevation, angle);
                let view = light_view(&scene, &light);
                let bare = half(&light_view(&scene, &floating(40.0, elevation, 0.0).1));
                // Rays through the square's corners, along the corners of the sun's square, onto the ground.
                let axes = light.world_from_light.matrix3;
                let (mut outside, mut reach) = (0, DVec2::ZERO);
                for corner in
                    [dvec3(-1.0, 4.0, -1.0), dvec3(-1.0, 4.0, 1.0), dvec3(1.0, 4.0, -1.0), dvec3(1.0, 4.0, 1.0)]
                {
                    for (u, v) in [(-1.0, -1.0), (-1.0, 1.0), (1.0, -1.0), (1.0, 1.0)] {
                        let towards = axes * (dvec2(u, v) * (0.5f64 * angle).tan()).extend(1.0);
                        let on_ground = corner - towards * (corner.y / towards.y);
                        let p = view.world_from_view.inverse().transform_point3(on_ground);
                        let q = view.clip_from_view * p.extend(1.0);
                        outside += usize::from(q.x.abs().max(q.y.abs()) > 1.0);
                        reach = reach.max(p.truncate().abs());
                    }
                }
                assert_eq!(outside, 0, "elevation {elevation}, angle {angle}");
                // The map is no wider than this requires, except for the margin, and because all sides move as far as
                // the farthest one.
                let needed = reach + 2.0 * (reach - bare).max(DVec2::ZERO) + 0.01;
                let got = half(&view);
                assert!(got.cmple(needed).all(), "elevation {elevation}, angle {angle}: {got} for {reach}");
                // A map of the casters alone does not contain them.
                assert_eq!(angle > 0.0, reach.cmpgt(bare).any(), "elevation {elevation}, angle {angle}");
            }
        }
        // This sun has half set, over a wide plain.
        let (scene, light) = floating(1e5, 1f64.to_radians(), 0.1);
        let bare = half(&light_view(&scene, &floating(1e5, 1f64.to_radians(), 0.0).1));
        assert!(half(&light_view(&scene, &light)).max_element() < bare.max_element() + 6.0);
    }

    #[test]
    fn shipped_suns_keep_their_texels() {
        let mut suns = 0;
        for shipped in shipped::ALL {
            let scene = load_bytes(shipped.name, shipped.bytes).unwrap();
            let light = &scene.lights[0];
            let LightShape::Directional { angle } = light.shape else { continue };
            let point = Light { shape: LightShape::Directional { angle: Some(0.0) }, ..light.clone() };
            let [soft, hard] = [light, &point].map(|l| half(&light_view(&scene, l)));
            let wider = soft / hard;
            println!("{}: angle {angle:?}, map wider by {:.4} and {:.4}", shipped.name, wider.x, wider.y);
            assert!(wider.min_element() >= 1.0 && wider.max_element() < 1.15, "{}: {wider}", shipped.name);
            suns += 1;
        }
        assert!(suns > 0);
    }
}
