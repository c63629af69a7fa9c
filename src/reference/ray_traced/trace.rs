//! Scene prepared for ray tracing: triangles in a hierarchy, with primary and shadow rays.

use super::alpha::Mask;
use super::bvh::{BoxRay, Bvh};
use super::edges::Edges;
use super::flatten::{Placement, check, power_of_two_above, world_bounds};
use super::triangle::{Crossing, MASKED, Shear, Triangle, largest_axis};
use crate::scene::Scene;
use crate::{Error, Result};
use glam::DVec3;
use rayon::prelude::*;
use std::sync::OnceLock;

/// Scene prepared for rays.
///
/// Triangles live in *local space*: world space moved to the middle of the scene and divided by a power of two, so
/// that all coordinates are in `[-1, 1]`. Thus the `f32` boxes lose nothing, however large the scene is or far from
/// the origin. Scaling the scene by a power of two changes no bit of the result.
#[derive(Debug)]
pub struct RayScene {
    pub(super) bvh: Bvh,
    /// Triangles in leaf order.
    pub(super) triangles: Vec<Triangle>,
    instances: Vec<Placed>,
    masks: Vec<Option<Mask>>,
    first_triangle: Vec<u32>,
    total: u32,
    center: DVec3,
    scale: f64,
    edges: OnceLock<Edges>,
}

/// Data of an instance that a hit needs.
#[derive(Clone, Copy, Debug)]
struct Placed {
    mesh: usize,
    /// `true` for a mirroring transform, which reverses the winding.
    mirrored: bool,
    double_sided: bool,
}

/// Hit of a primary ray on a surface.
#[derive(Clone, Copy, Debug)]
pub struct Hit {
    /// Id of the triangle: instances in order, triangles of their mesh in order.
    pub triangle: u32,
    /// Weights of the triangle's corners, in the order of the mesh.
    pub barycentrics: [f64; 3],
    /// Distance along the ray, in units of its direction.
    pub t: f64,
    /// Position in world space.
    pub position: DVec3,
    /// Unit geometric normal in world space, on the side that the ray came from.
    pub normal: DVec3,
    /// Position in local space.
    pub(super) local: DVec3,
}

/// End of a shadow ray.
#[derive(Clone, Copy, Debug)]
pub enum Target {
    /// Point in world space; objects beyond it do not occlude.
    Point(DVec3),
    /// Direction without an end.
    Direction(DVec3),
}

/// Triangle id that matches none: nothing is skipped.
pub(super) const NONE: u32 = u32::MAX;

impl RayScene {
    /// Places all instances and builds the hierarchy, in parallel.
    ///
    /// No triangle is dropped: a degenerate or non-finite one keeps its id and is never hit.
    ///
    /// # Errors
    /// Fails if a mesh breaks the rules of [`crate::scene::Mesh`] (an index out of range, arrays of different
    /// lengths), or if the scene has 2^31 or more triangles or instances.
    pub fn build(scene: &Scene) -> Result<Self> {
        check(scene)?;
        let mut first_triangle = Vec::with_capacity(scene.instances.len());
        let mut total = 0u64;
        for instance in &scene.instances {
            first_triangle.push(total as u32);
            total += scene.meshes[instance.mesh].triangles() as u64;
            if total >= u64::from(MASKED) {
                return Err(Error::Usage(format!(
                    "scene {}: more than {} triangles over all instances, the limit of ray tracing; split the scene",
                    scene.name,
                    MASKED - 1
                )));
            }
        }
        let masks: Vec<_> = scene.meshes.iter().map(|m| Mask::new(scene, m)).collect();
        let instances: Vec<_> = scene
            .instances
            .iter()
            .map(|i| Placed {
                mesh: i.mesh,
                mirrored: i.world_from_object.matrix3.determinant() < 0.0,
                double_sided: scene.materials.get(scene.meshes[i.mesh].material).is_some_and(|m| m.double_sided),
            })
            .collect();
        let bounds = world_bounds(scene);
        let center = bounds.center();
        let half = 0.5 * (bounds.max - bounds.min).max_element();
        let scale = if bounds.is_empty() || !(half > 0.0 && half.is_finite()) { 1.0 } else { power_of_two_above(half) };
        let placements: Vec<_> = scene.instances.iter().map(|i| Placement::new(i, center, scale)).collect();
        let mut triangles: Vec<Triangle> = (0..total as u32)
            .into_par_iter()
            .filter_map(|id| {
                let instance = first_triangle.partition_point(|&first| first <= id) - 1;
                let mesh = &scene.meshes[scene.instances[instance].mesh];
                let at = 3 * (id - first_triangle[instance]) as usize;
                let v = std::array::from_fn(|k| {
                    placements[instance].apply(mesh.positions[mesh.indices[at + k] as usize]).to_array()
                });
                let mask = if masks[scene.instances[instance].mesh].is_some() { MASKED } else { 0 };
                let triangle = Triangle { v, id, info: instance as u32 | mask };
                let cross = triangle.cross();
                // Infinite corners make the cross product NaN or infinite.
                (cross.is_finite() && cross != DVec3::ZERO).then_some(triangle)
            })
            .collect();
        let bvh = Bvh::build(&mut triangles);
        Ok(Self {
            bvh,
            triangles,
            instances,
            masks,
            first_triangle,
            total: total as u32,
            center,
            scale,
            edges: OnceLock::new(),
        })
    }

    /// Returns the number of triangles over all instances, degenerate ones included.
    pub fn triangles(&self) -> u32 {
        self.total
    }

    /// Returns the id of an instance's first triangle; `None` if there is no such instance.
    pub fn first_triangle(&self, instance: usize) -> Option<u32> {
        self.first_triangle.get(instance).copied()
    }

    /// Returns the number of bytes held on the heap.
    pub fn bytes(&self) -> usize {
        self.bvh.bytes()
            + self.triangles.len() * size_of::<Triangle>()
            + self.instances.len() * (size_of::<Placed>() + 4)
            + self.masks.iter().flatten().map(Mask::bytes).sum::<usize>()
            + self.edges.get().map_or(0, Edges::bytes)
    }

    /// Returns the nearest surface that a viewer at `origin` sees along `direction` (any length but 0).
    ///
    /// A single-sided material is invisible from behind, as with back-face culling. The front is the side from which
    /// the corners run counter-clockwise, or clockwise under a mirroring transform. Among surfaces at exactly the same
    /// distance the smallest id wins.
    pub fn primary(&self, origin: DVec3, direction: DVec3) -> Option<Hit> {
        self.primary_local(self.to_local(origin), direction / self.scale, f64::INFINITY)
    }

    /// Performs [`RayScene::primary`] for an origin and a direction in local space, up to `t_max`.
    pub(super) fn primary_local(&self, origin: DVec3, direction: DVec3, t_max: f64) -> Option<Hit> {
        let (enter, leave) = enter_scene(origin, direction)?;
        let t_max = t_max.min(leave) - enter;
        if !(t_max > 0.0) {
            return None;
        }
        let start = origin + enter * direction;
        let found = match largest_axis(direction) {
            0 => self.closest::<0>(start, direction, t_max),
            1 => self.closest::<1>(start, direction, t_max),
            _ => self.closest::<2>(start, direction, t_max),
        };
        let (slot, crossing) = found?;
        let triangle = &self.triangles[slot];
        let [u, v, w] = crossing.barycentrics;
        let local = triangle.corner(0) * u + triangle.corner(1) * v + triangle.corner(2) * w;
        let normal = triangle.cross().normalize();
        Some(Hit {
            triangle: triangle.id,
            barycentrics: crossing.barycentrics,
            t: enter + crossing.t,
            position: self.to_world(local),
            normal: if normal.dot(direction) > 0.0 { -normal } else { normal },
            local,
        })
    }

    /// Returns whether anything lies between `from` and `to`, both ends excluded. Triangle `skip` is ignored.
    ///
    /// Points are in world space. The ray starts exactly at `from`: a caller on a surface moves it off that surface,
    /// as [`hard`](super::hard) does.
    pub fn occluded(&self, from: DVec3, to: Target, skip: Option<u32>) -> bool {
        let origin = self.to_local(from);
        let (direction, t_max) = match to {
            Target::Point(p) => (self.to_local(p) - origin, 1.0),
            Target::Direction(d) => (d, f64::INFINITY),
        };
        self.occluded_local(origin, direction, t_max, skip.unwrap_or(NONE), &mut NONE.clone())
    }

    /// Performs [`RayScene::occluded`] in local space. `last` is the slot of the last occluder, which is tried first,
    /// since neighbouring rays often share their occluder.
    pub(super) fn occluded_local(
        &self,
        origin: DVec3,
        direction: DVec3,
        t_max: f64,
        skip: u32,
        last: &mut u32,
    ) -> bool {
        match largest_axis(direction) {
            0 => self.any::<0>(origin, direction, t_max, skip, last),
            1 => self.any::<1>(origin, direction, t_max, skip, last),
            _ => self.any::<2>(origin, direction, t_max, skip, last),
        }
    }

    fn any<const Z: usize>(&self, origin: DVec3, direction: DVec3, t_max: f64, skip: u32, last: &mut u32) -> bool {
        let shear = Shear::<Z>::new(origin, direction);
        let stops = |triangle: &Triangle| {
            triangle.id != skip
                && shear
                    .hit(triangle, t_max)
                    .is_some_and(|c| !triangle.is_masked() || !self.is_hole(triangle, c.barycentrics))
        };
        if self.triangles.get(*last as usize).is_some_and(stops) {
            return true;
        }
        // The traversal starts where the ray enters the scene, so that the `f32` origin is small.
        let Some((enter, leave)) = enter_scene(origin, direction) else { return false };
        let boxes = BoxRay::new(origin + enter * direction, direction);
        let end = round_up(t_max.min(leave) - enter);
        self.bvh.any(&boxes, end, |range| {
            for slot in range {
                if stops(&self.triangles[slot]) {
                    *last = slot as u32;
                    return true;
                }
            }
            false
        })
    }

    fn closest<const Z: usize>(&self, origin: DVec3, direction: DVec3, t_max: f64) -> Option<(usize, Crossing)> {
        let shear = Shear::<Z>::new(origin, direction);
        let mut best: Option<(usize, Crossing)> = None;
        let mut end = round_up(t_max);
        self.bvh.closest(&BoxRay::new(origin, direction), &mut end, |range, end| {
            for slot in range {
                let triangle = &self.triangles[slot];
                // Not `< best.t`: among equal distances the smallest id wins, whatever the order of the leaves.
                let Some(crossing) = shear.hit(triangle, t_max) else { continue };
                let nearer = best.is_none_or(|(other, b)| {
                    crossing.t < b.t || crossing.t == b.t && triangle.id < self.triangles[other].id
                });
                if nearer && self.is_visible(triangle, direction, crossing.barycentrics) {
                    best = Some((slot, crossing));
                    *end = round_up(crossing.t);
                }
            }
        });
        best
    }

    /// Returns whether the triangle is neither culled nor has a hole here.
    fn is_visible(&self, triangle: &Triangle, direction: DVec3, barycentrics: [f64; 3]) -> bool {
        let instance = &self.instances[triangle.instance()];
        if !instance.double_sided {
            let outwards = if instance.mirrored { -triangle.cross() } else { triangle.cross() };
            if outwards.dot(direction) >= 0.0 {
                return false;
            }
        }
        !triangle.is_masked() || !self.is_hole(triangle, barycentrics)
    }

    fn is_hole(&self, triangle: &Triangle, barycentrics: [f64; 3]) -> bool {
        let instance = triangle.instance();
        let index = triangle.id - self.first_triangle[instance];
        self.masks[self.instances[instance].mesh].as_ref().is_some_and(|m| m.is_hole(index as usize, barycentrics))
    }

    /// Returns the adjacency of the triangles, built on first use.
    pub(super) fn edges(&self) -> &Edges {
        self.edges.get_or_init(|| Edges::build(&self.triangles))
    }

    pub(super) fn to_local(&self, world: DVec3) -> DVec3 {
        (world - self.center) / self.scale
    }

    pub(super) fn to_world(&self, local: DVec3) -> DVec3 {
        local * self.scale + self.center
    }

    /// Returns the number of world units per local unit.
    pub(super) fn scale(&self) -> f64 {
        self.scale
    }

    /// Returns the start of a shadow ray: slightly above the surface, local space.
    pub(super) fn above(&self, hit: &Hit) -> DVec3 {
        hit.local + hit.normal * self.surface_offset()
    }

    /// Returns the height of a shadow ray's start above its surface, in local space.
    ///
    /// 2^-40 of the scene's size is far above the rounding error of a point on a triangle (2^-51) and far below
    /// anything visible. World coordinates that are large compared with the scene add their own rounding error,
    /// because instances touch only to within it.
    fn surface_offset(&self) -> f64 {
        let rounding = self.center.abs().max_element() / self.scale;
        3.0 * (-40f64).exp2() + rounding * (-50f64).exp2()
    }
}

/// Returns an `f32` that is at least `t`, with a margin for the three roundings of a box's entry distance.
fn round_up(t: f64) -> f32 {
    (t * (1.0 + (-20f64).exp2())) as f32
}

/// Returns the range of `t >= 0` in which a ray may be inside the scene's box; everything for a ray that starts
/// inside.
fn enter_scene(origin: DVec3, direction: DVec3) -> Option<(f64, f64)> {
    const HALF: f64 = 1.0 + 1e-3;
    if origin.abs().max_element() <= HALF {
        return Some((0.0, f64::INFINITY));
    }
    let (mut enter, mut leave) = (0f64, f64::INFINITY);
    for axis in 0..3 {
        let (o, d) = (origin[axis], direction[axis]);
        if d == 0.0 {
            if o.abs() > HALF {
                return None;
            }
            continue;
        }
        let (a, b) = ((-HALF - o) / d, (HALF - o) / d);
        enter = enter.max(a.min(b));
        leave = leave.min(a.max(b));
    }
    (enter <= leave && enter.is_finite()).then_some((enter, leave))
}
