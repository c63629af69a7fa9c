//! Mirror of the shadow volumes. It counts the occluders between a point and the light by testing all triangles.
//!
//! It knows nothing of edges, caps or stencils. By construction, z-fail counts the triangles between point and light
//! (in a closed mesh: those that face the light).

use super::silhouettes::Facing;
use crate::Result;
use crate::casters::topology::Topology;
use crate::reference::common::shadow_map_test;
use crate::reference::common::view::{FrameData, Mirror, Receiver, Verdict, View};
use crate::view::{CameraView, LightKind, LightView};
use glam::{DAffine3, DVec3, DVec4, Vec3};

/// An instance that casts shadows.
#[derive(Clone, Copy, Debug)]
pub struct Caster<'a> {
    /// Object-space positions.
    pub positions: &'a [[f32; 3]],
    /// Triangles of the mesh.
    pub topology: &'a Topology,
    /// Transform of the instance.
    pub world_from_object: DAffine3,
    /// Counts only triangles that face the light, as for a closed mesh counted by shells.
    pub shells: bool,
}

/// Number of volumes that contain a pixel's point: a range where the point lies too close to a boundary to tell.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Count {
    /// Smallest possible count. It may be -1, because one side of a very thin volume may count while the other does
    /// not.
    pub least: i32,
    /// Largest possible count.
    pub most: i32,
}

/// Largest error of a pixel's point, in pixels of the image: rasterisers round vertices to 1/256.
const OFF: f64 = 1.0 / 64.0;
/// Cosine to the light below which a surface may coincide with the side of a volume.
const ALONG: f64 = 1e-3;

/// Returns the count of every pixel; `None` for the sky.
///
/// # Errors
/// Fails if the images do not fit the constants.
pub fn counts(
    data: &FrameData<'_>,
    camera: &CameraView,
    light: &LightView,
    casters: &[Caster<'_>],
) -> Result<Vec<Option<Count>>> {
    let view = View::new(data)?;
    let seen = Seen::new(camera, light, casters);
    Ok(view.every_pixel(|pixel| view.receiver(pixel).map(|r| seen.count(&view, &r))))
}

/// Occluders and light in camera view space.
struct Seen {
    triangles: Vec<[DVec3; 3]>,
    light: DVec4,
}

impl Seen {
    fn new(camera: &CameraView, light: &LightView, casters: &[Caster<'_>]) -> Self {
        let rotation = camera.world_from_view.matrix3.transpose();
        let origin = camera.world_from_view.translation;
        let light = match light.kind {
            LightKind::Spot { .. } => (rotation * (light.world_from_view.translation - origin)).extend(1.0),
            LightKind::Directional { .. } => (rotation * -light.direction()).extend(0.0),
        };
        let mut triangles = vec![];
        for c in casters {
            let t = &c.world_from_object;
            let at = |v: u32| {
                let p = Vec3::from(c.positions[v as usize]).as_dvec3();
                rotation * (t.matrix3 * p + (t.translation - origin))
            };
            // A mirroring transform reverses the winding.
            let outer = if t.matrix3.determinant() < 0.0 { -1 } else { 1 };
            let all = c.topology.triangles.iter().map(|corners| corners.map(at));
            triangles.extend(all.filter(|&corners| !c.shells || Facing::of(corners, light).sign() == outer));
        }
        Self { triangles, light }
    }

    fn count(&self, view: &View<'_>, r: &Receiver) -> Count {
        // A surface parallel to the light's rays may lie in a side of its own volume or of its neighbours'.
        if r.normal.dot(view.towards_light(r.position, r.position_error).0).abs() < ALONG {
            return Count { least: i32::MIN, most: i32::MAX };
        }
        // A grazing view stretches a pixel over the surface.
        let slant = 1.0 / r.normal.dot(view.ray(r.position)).abs().max(1e-2);
        let off = view.pixel_width(r.position, DVec3::ZERO).0 * slant * OFF;
        // The surface itself must not count as an occluder of its visible side.
        let above = r.normal * (2.0 * r.allowance + r.position_error.length());
        let mut count = Count { least: i32::MAX, most: 0 };
        for lift in [1.0, 8.0] {
            let p = r.position + lift * above;
            let [sure, unsure] = self.occluders(p, off);
            count = Count { least: count.least.min(sure - unsure), most: count.most.max(sure + unsure) };
        }
        count
    }

    /// Counts the triangles between a point and the light, and those that may or may not be there for a point `off`
    /// away.
    fn occluders(&self, p: DVec3, off: f64) -> [i32; 2] {
        let to_light = self.light.truncate() - self.light.w * p;
        let mut found = [0; 2];
        for t in &self.triangles {
            match crosses(p, to_light, self.light.w == 0.0, t, off) {
                Crossing::Yes => found[0] += 1,
                Crossing::Unsure => found[1] += 1,
                Crossing::No => {}
            }
        }
        found
    }
}

/// Result of testing whether a triangle blocks a path.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Crossing {
    Yes,
    No,
    /// The path passes too close to an edge to tell.
    Unsure,
}

/// Tests whether a triangle blocks the path from `p` along `d`: up to its end, or without end if `endless`.
fn crosses(p: DVec3, d: DVec3, endless: bool, t: &[DVec3; 3], off: f64) -> Crossing {
    let [a, b, c] = t.map(|v| v - p);
    let n = (b - a).cross(c - a);
    let at = n.dot(a) / n.dot(d);
    if !(at > 0.0 && (endless || at < 1.0)) {
        return Crossing::No;
    }
    // Distances of `p` from the planes through the light and each edge, where the edges' shadows run.
    let distance = |a: DVec3, b: DVec3| {
        let plane = if endless { (b - a).cross(d) } else { (a - d).cross(b - d) };
        let length = plane.length();
        if length > 0.0 { a.cross(b).dot(d) / length } else { 0.0 }
    };
    let sides = [distance(a, b), distance(b, c), distance(c, a)];
    let (left, right) = (sides.iter().filter(|&&s| s > off).count(), sides.iter().filter(|&&s| s < -off).count());
    match (left, right) {
        (3, 0) | (0, 3) => Crossing::Yes,
        (1.., 1..) => Crossing::No,
        _ => Crossing::Unsure,
    }
}

/// Mirror of `glsl/caster_edges/shadow_volumes.comp`, from the GPU's own counts. With `masked`, the shadow map's test
/// with this normal offset decides where no volume contains the pixel.
///
/// # Errors
/// Fails if the images or the counts do not fit the constants.
pub fn visibility(data: &FrameData<'_>, counts: &[f32], masked: Option<f32>) -> Result<Mirror> {
    let view = View::new(data)?;
    if counts.len() != view.size[0] * view.size[1] {
        return Err(crate::Error::Usage(format!("mirror: {} counts for {:?} pixels", counts.len(), view.size)));
    }
    Ok(Mirror::collect(view.every_pixel(|at| {
        let Some(r) = view.receiver(at) else { return Verdict::sure(1.0) };
        let facing = view.faces_light(&r);
        let inside = view.light_point(r.position, r.position_error).inside;
        let shadowed = counts[view.index(at)] != 0.0;
        let within = match (shadowed, masked) {
            (true, _) => Verdict::sure(0.0),
            (false, Some(offset)) => shadow_map_test::test(&view, &r, offset.into(), 0.0),
            (false, None) => Verdict::sure(1.0),
        };
        let lit = match inside.is_yes() {
            true if inside.is_doubtful() => within.or(1.0),
            true => within,
            false if inside.is_doubtful() => Verdict::sure(1.0).or(within.visibility),
            false => Verdict::sure(1.0),
        };
        match facing.is_yes() {
            true if facing.is_doubtful() => lit.or(0.0),
            true => lit,
            false if facing.is_doubtful() => Verdict::sure(0.0).or(lit.visibility + lit.doubt),
            false => Verdict::sure(0.0),
        }
    })))
}

/// A `VkDrawIndirectCommand`: vertices, copies, first vertex, first copy.
pub type DrawArguments = [u32; 4];

/// Mirror of `glsl/caster_edges/volume_draws.comp`. Makes one draw per instance from the instances' numbers of
/// silhouettes, in order; `shells` marks the instances counted by shells. `copies` is the largest weight of any edge,
/// 1 where weights are blended.
pub fn draws(edges: &[u32], shells: &[bool], copies: u32) -> Vec<DrawArguments> {
    let mut first = 0;
    (edges.iter().zip(shells))
        .map(|(&n, &shells)| {
            let arguments = [6 * n, if shells { 1 } else { copies }, 6 * first, 0];
            first += n;
            arguments
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::casters::shapes::{Shape, cube, joined, moved, soup, sphere, two_sided_quad};
    use crate::reference::caster_edges::silhouettes::{facing, silhouettes};
    use glam::dvec3;

    /// Sums the signed volume faces that a ray from `p` meets: what z-fail adds up behind a surface. The volumes are
    /// built from the silhouettes, as the shaders build them.
    fn behind(shape: &Shape, topology: &Topology, light: DVec4, p: DVec3, ray: DVec3, shells: bool) -> i32 {
        let at = |v: u32| Vec3::from(shape.0[v as usize]).as_dvec3();
        // Far enough away to count as infinity for the test's rays.
        let far = |v: u32| {
            let p = at(v);
            p + 1e7 * (light.w * p - light.truncate()).normalize()
        };
        let sigma: Vec<i32> = facing(topology, &shape.0, light).iter().map(Facing::sign).collect();
        let mut faces: Vec<([DVec3; 3], i32)> = vec![];
        for (&[i, j, k], &s) in topology.triangles.iter().zip(&sigma) {
            if shells && s < 0 {
                continue;
            }
            let (j, k) = if s > 0 { (j, k) } else { (k, j) };
            faces.push(([at(i), at(j), at(k)], 1));
            faces.push(([far(k), far(j), far(i)], 1));
        }
        for e in silhouettes(topology, &sigma, shells) {
            let [a, b] = e.ends;
            faces.push(([at(a), far(a), at(b)], e.weight as i32));
            faces.push(([at(b), far(a), far(b)], e.weight as i32));
        }
        let met = |(t, weight): &([DVec3; 3], i32)| match crosses(p, ray, true, t, 0.0) {
            Crossing::No | Crossing::Unsure => 0,
            // A face that the ray leaves through counts +1.
            Crossing::Yes => {
                if (t[1] - t[0]).cross(t[2] - t[0]).dot(ray) > 0.0 {
                    *weight
                } else {
                    -weight
                }
            }
        };
        faces.iter().map(met).sum()
    }

    #[test]
    fn volumes_from_silhouettes_count_occluders() {
        let mut random = crate::casters::shapes::Random(11);
        let mut point = |size: f64| size * DVec3::from_array([0; 3].map(|_| random.signed()));
        let nested = joined(sphere(2), moved(cube(), |p| [2.5 + p[0], p[1], p[2]]));
        let mut occluded = 0;
        for (shape, shells) in [
            (soup(14, 24, 1), false),
            (soup(30, 60, 2), false),
            (cube(), false),
            (cube(), true),
            (nested.clone(), false),
            (nested, true),
            (two_sided_quad(), false),
        ] {
            let topology = Topology::new(&shape.0, &shape.1).unwrap();
            for round in 0..1500 {
                let light = match round % 2 {
                    0 => (point(1.0).normalize() * 9.0).extend(1.0),
                    _ => point(1.0).normalize().extend(0.0),
                };
                let seen = Seen {
                    triangles: (topology.triangles.iter())
                        .map(|t| t.map(|v| Vec3::from(shape.0[v as usize]).as_dvec3()))
                        .filter(|t| !shells || Facing::of(*t, light).sign() > 0)
                        .collect(),
                    light,
                };
                let p = point(3.0);
                let counted = behind(&shape, &topology, light, p, point(1.0), shells);
                let expected = seen.occluders(p, 0.0)[0];
                assert_eq!(counted, expected, "{p} under {light}, shells: {shells}");
                occluded += u32::from(expected > 0);
            }
        }
        println!("{occluded} of 10500 points in shadow");
        assert!(occluded > 1000);
    }

    #[test]
    fn crossing_ends_at_the_light() {
        let t = [dvec3(-1.0, 1.0, -1.0), dvec3(1.0, 1.0, -1.0), dvec3(0.0, 1.0, 1.0)];
        let crosses = |p, d, endless, off| crosses(p, d, endless, &t, off);
        let up = DVec3::Y;
        assert_eq!(crosses(DVec3::ZERO, 2.0 * up, false, 0.1), Crossing::Yes);
        assert_eq!(crosses(DVec3::ZERO, 0.5 * up, false, 0.1), Crossing::No);
        assert_eq!(crosses(DVec3::ZERO, 0.5 * up, true, 0.1), Crossing::Yes);
        assert_eq!(crosses(DVec3::ZERO, -up, true, 0.1), Crossing::No);
        // Close to an edge, and where its line continues beyond the triangle.
        assert_eq!(crosses(dvec3(0.1, 0.0, -1.05), 2.0 * up, true, 0.1), Crossing::Unsure);
        assert_eq!(crosses(dvec3(0.1, 0.0, -1.05), 2.0 * up, true, 0.01), Crossing::No);
        assert_eq!(crosses(dvec3(2.0, 0.0, -1.05), up, true, 0.1), Crossing::No);
    }

    #[test]
    fn draws_are_ranges_of_the_list() {
        let found = draws(&[3, 0, 2], &[true, false, false], 2);
        assert_eq!(found, [[18, 1, 0, 0], [0, 2, 18, 0], [12, 2, 18, 0]]);
    }
}
