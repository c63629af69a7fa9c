//! Mirror of the layers over a receiver: every triangle is tested against the path from the receiver to the light.
//!
//! A triangle is in doubt if single precision may move its border, its plane or the receiver across each other. A
//! triangle in the receiver's own plane is not: the shader must never count it.

use super::grid::{GRAZING, GridReceiver, Place, far_vertices, place};
use crate::Result;
use crate::reference::caster_edges::edge_segments::clip_from_object;
use crate::reference::caster_edges::shadow_volumes::Caster;
use crate::reference::caster_edges::silhouettes::Facing;
use crate::reference::common::view::{FrameData, Mirror, Verdict, View};
use crate::view::{CameraView, LightView};
use glam::{DVec3, DVec4, Vec3};

/// Relative error of a vertex in the light's view, and of what single precision computes from it.
pub(super) const VERTEX: f64 = 16.0 * f32::EPSILON as f64;

/// A triangle that the technique counts, in camera view space.
#[derive(Clone, Debug)]
pub(super) struct Triangle {
    pub corners: [DVec3; 3],
    /// Bound of the corners' error, world units.
    pub error: f64,
    /// Counter-clockwise seen from the light's centre.
    pub front: bool,
    /// Triangle of a closed mesh of which the front faces alone count.
    pub shell: bool,
    /// Index of the instance, and of the triangle in its mesh.
    pub index: [usize; 2],
}

/// Number of layers: a range where it is in doubt.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Layers {
    /// Smallest possible number.
    pub least: u32,
    /// Largest possible number.
    pub most: u32,
}

/// All triangles, and the light, in camera view space.
pub(super) struct Occluders {
    /// Triangles that the technique counts.
    pub triangles: Vec<Triangle>,
    /// Other faces of shells: those turned away from the light's centre.
    pub back_faces: Vec<Triangle>,
    /// `w` is 1 for a position and 0 for a direction.
    pub light: DVec4,
    /// Extent of a sun's frustum, world units.
    extent: f64,
}

impl Occluders {
    pub fn new(camera: &CameraView, light_view: &LightView, casters: &[Caster<'_>]) -> Self {
        let rotation = camera.world_from_view.matrix3.transpose();
        let origin = camera.world_from_view.translation;
        let at_light = light_view.world_from_view.translation;
        let (light, extent) = if light_view.is_directional() {
            let p = &light_view.clip_from_view;
            let extent = 1.0 / p.x_axis.x.abs() + 1.0 / p.y_axis.y.abs() + 1.0 / p.z_axis.z.abs();
            ((rotation * -light_view.direction()).extend(0.0), extent)
        } else {
            ((rotation * (at_light - origin)).extend(1.0), 0.0)
        };
        let (mut triangles, mut back_faces) = (vec![], vec![]);
        for (instance, c) in casters.iter().enumerate() {
            let t = &c.world_from_object;
            let outer = t.matrix3.determinant() > 0.0;
            for (i, corners) in c.topology.triangles.iter().enumerate() {
                let object = corners.map(|v| t.matrix3 * Vec3::from(c.positions[v as usize]).as_dvec3());
                let view = object.map(|p| rotation * (p + (t.translation - origin)));
                let front = Facing::of(view, light).sign() > 0;
                let terms = object.map(|p| p.length() + (t.translation - at_light).length());
                let size = terms.into_iter().fold(extent, f64::max);
                let error = VERTEX * size;
                let list = if c.shells && front != outer { &mut back_faces } else { &mut triangles };
                list.push(Triangle { corners: view, error, front, shell: c.shells, index: [instance, i] });
            }
        }
        Self { triangles, back_faces, light, extent }
    }

    /// A sun overhead, along +Z.
    pub fn sun(triangles: Vec<Triangle>) -> Self {
        Self { triangles, back_faces: vec![], light: DVec3::Z.extend(0.0), extent: 0.0 }
    }

    /// Vector from a point to the light: its direction for a sun.
    pub fn to_light(&self, p: DVec3) -> DVec3 {
        self.light.truncate() - self.light.w * p
    }

    /// Decides whether a triangle lies between a receiver and the light; `None` where it is in doubt.
    pub fn covers(&self, t: &Triangle, g: &GridReceiver) -> Option<bool> {
        let p = g.receiver.position;
        let to_light = self.to_light(p);
        let is_sun = self.light.w == 0.0;
        let distance = if is_sun { 1.0 } else { to_light.length() };
        let d = to_light / distance;
        let [a, b, c] = t.corners.map(|v| v - p);
        let (ab, ac) = (b - a, c - a);
        let n = ab.cross(ac);
        let length = n.length();
        if length == 0.0 {
            return Some(false);
        }
        // Distances from the planes through the light and each side, positive inside.
        let sign = if n.dot(d) > 0.0 { 1.0 } else { -1.0 };
        let side = |a: DVec3, b: DVec3| {
            let plane = if is_sun { (b - a).cross(d) } else { (a - to_light).cross(b - to_light) };
            let size = plane.length();
            if size > 0.0 { sign * a.cross(b).dot(d) / size * if is_sun { 1.0 } else { distance } } else { 0.0 }
        };
        let sides = [side(a, b), side(b, c), side(c, a)];
        let nearest =
            if is_sun { 1.0 } else { [a, b, c].iter().map(|&v| (v - to_light).length()).fold(f64::INFINITY, f64::min) };
        let spread = if is_sun { 1.0 } else { distance / nearest };
        let off = t.error * spread + 4.0 * g.receiver.position_error.length() + VERTEX * (p.length() + distance);
        if sides.iter().any(|&s| s < -off) {
            return Some(false);
        }
        let sure_inside = sides.iter().all(|&s| s > off);
        // Distance to the plane along the path, and how far the plane may be off there. The plane of a sliver is known
        // as well as its shorter sides tell.
        let slope = length / n.dot(d).abs();
        let along = n.dot(a) / n.dot(d);
        let mut lengths = [ab.length(), ac.length(), (c - b).length()];
        lengths.sort_by(f64::total_cmp);
        let [short, middle, _] = lengths;
        let sliver = short * middle / length;
        let size = t.error / VERTEX;
        let plane_off = t.error * (1.0 + sliver * (short + middle) / size) * slope * spread.max(1.0);
        let doubt = 2.0 * (plane_off + g.step + g.step_error) + 4.0 * g.receiver.position_error.length() * slope;
        let doubt = doubt + VERTEX * (p.length() + distance + self.extent);
        // The receiver's own plane, which the shader must not count.
        let parallel = (n.dot(g.receiver.normal) / length).abs() > 1.0 - 1e-6;
        if parallel && (n.dot(a) / length).abs() < 4.0 * (t.error + g.receiver.position_error.length()) {
            return Some(false);
        }
        if along < -doubt || !is_sun && along > distance + doubt {
            return Some(false);
        }
        let sure_between = along > doubt && (is_sun || along < distance - t.error * slope);
        (sure_inside && sure_between).then_some(true)
    }

    /// Counts the layers over a receiver.
    pub fn layers(&self, g: &GridReceiver) -> Layers {
        let mut found = Layers::default();
        for t in &self.triangles {
            match self.covers(t, g) {
                Some(true) => (found.least, found.most) = (found.least + 1, found.most + 1),
                Some(false) => {}
                None => found.most += 1,
            }
        }
        if g.facing < GRAZING { Layers { least: 0, most: found.most + 1 } } else { found }
    }
}

/// Mirror of `exact_hard.comp` for scenes without masked casters.
///
/// # Errors
/// Fails if the images do not fit the constants.
pub fn visibility(
    data: &FrameData<'_>,
    camera: &CameraView,
    light: &LightView,
    casters: &[Caster<'_>],
) -> Result<Mirror> {
    let view = View::new(data)?;
    let (occluders, far) = (Occluders::new(camera, light, casters), far_vertices(casters));
    Ok(Mirror::collect(view.every_pixel(|pixel| match place(&view, far, pixel) {
        Place::Decided(verdict) => verdict,
        Place::Open(g) => g.with_doubts(match occluders.layers(&g) {
            Layers { most: 0, .. } => Verdict::sure(1.0),
            Layers { least: 0, .. } => Verdict::sure(1.0).or(0.0),
            _ => Verdict::sure(0.0),
        }),
    })))
}

/// Returns for every pixel the triangles that lie between it and the light beyond doubt: instance and index in its mesh.
///
/// # Errors
/// Fails if the images do not fit the constants.
pub fn covering(
    data: &FrameData<'_>,
    camera: &CameraView,
    light: &LightView,
    casters: &[Caster<'_>],
) -> Result<Vec<Vec<[usize; 2]>>> {
    let view = View::new(data)?;
    let (occluders, far) = (Occluders::new(camera, light, casters), far_vertices(casters));
    Ok(view.every_pixel(|pixel| match place(&view, far, pixel) {
        Place::Decided(_) => vec![],
        Place::Open(g) => {
            let all = occluders.triangles.iter();
            all.filter(|t| occluders.covers(t, &g) == Some(true)).map(|t| t.index).collect()
        }
    }))
}

/// A triangle in the light's image.
#[derive(Clone, Copy, Debug)]
pub struct Projected {
    /// Instance, and index in its mesh.
    pub index: [usize; 2],
    /// Corners: places in the light's image, and depth (-1/w of a spot light, the map's depth of a sun).
    pub corners: [DVec3; 3],
}

/// Returns place and depth of a point in the light's grid; `None` if it does not lie beyond the near plane.
pub fn grid_point(light: &LightView, q: DVec4) -> Option<DVec3> {
    let depth = if light.is_directional() { q.z } else { -1.0 / q.w };
    let near = if light.is_directional() {
        0.0
    } else {
        (light.clip_from_view.w_axis.z / light.clip_from_view.z_axis.z).abs()
    };
    (q.w > near).then(|| (q.truncate() / q.w).truncate().extend(depth))
}

/// Returns the triangles that count, of those that lie entirely beyond the light's near plane.
pub fn projected(camera: &CameraView, light: &LightView, casters: &[Caster<'_>]) -> Vec<Projected> {
    let occluders = Occluders::new(camera, light, casters);
    let project = |t: &Triangle| {
        let c = &casters[t.index[0]];
        let corners = c.topology.triangles[t.index[1]]
            .map(|v| grid_point(light, clip_from_object(light, &c.world_from_object, c.positions[v as usize])));
        Some(Projected { index: t.index, corners: [corners[0]?, corners[1]?, corners[2]?] })
    };
    occluders.triangles.iter().filter_map(project).collect()
}
