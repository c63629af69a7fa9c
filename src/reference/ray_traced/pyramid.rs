//! Tests whether one ray decides about a whole area light.
//!
//! Let `P` be the pyramid from a point `p` over a convex light. What `p` sees of the light can change only across the
//! projection of an edge that is a silhouette *as seen from `p`*; at any other edge the surface continues on the other
//! side. So if no silhouette meets the inside of `P`, the light is seen entirely or not at all, and any single ray
//! tells which. Laine, Aila, Assarsson, Lehtinen and Akenine-Moeller, *Soft Shadow Volumes for Ray Tracing*, 2005,
//! build on the same fact.
//!
//! Every doubt counts as a penumbra, which is sampled in full:
//!
//! * an edge with one triangle or more than two,
//! * a side test within rounding of zero,
//! * a masked triangle in `P`,
//! * a triangle that cuts through the light,
//! * a light that the horizon of `p` cuts,
//! * a pyramid too flat or too thin for exact planes,
//! * a pyramid with so many triangles that sampling is cheaper.

use super::trace::RayScene;
use super::triangle::Triangle;
use glam::DVec3;

/// Visibility of the whole light from a point.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Class {
    /// No occluder lies between the point and the light.
    Lit,
    /// The light is seen entirely or not at all.
    Uniform,
    /// The light may be seen in part.
    Unknown,
}

/// Number of triangles above which sampling is cheaper than further tests.
const MAX_TRIANGLES: u32 = 512;

/// Largest error of a side plane for which the box test is safe: the padding of the boxes is 8 times as large, and no
/// corner is further than 4 from the apex.
const MAX_SIDE_TOLERANCE: f64 = 1.0 / (1 << 22) as f64;

pub(super) struct Pyramid {
    apex: DVec3,
    /// Unit normals of the sides, pointing inwards.
    sides: [DVec3; 4],
    /// Rounding error of `side . v`, relative to `|v|`.
    tolerance: f64,
    /// Normal of the horizon: nothing below it is in the pyramid.
    normal: DVec3,
    /// Plane of the light: unit normal away from the apex, and distance. `None` for an infinitely distant light.
    lid: Option<(DVec3, f64)>,
}

impl Pyramid {
    /// Builds the pyramid; `None` if the point cannot be classified. `rim` holds the vectors from the apex to the
    /// light's corners, in order around the light. `lid` is the unit normal of the light's plane.
    pub fn new(apex: DVec3, normal: DVec3, rim: [DVec3; 4], lid: Option<DVec3>) -> Option<Self> {
        if rim.iter().any(|d| !(normal.dot(*d) > 1e-9 * d.length())) {
            return None;
        }
        let middle = rim[0] + rim[1] + rim[2] + rim[3];
        let mut sides = [DVec3::ZERO; 4];
        let mut tolerance: f64 = 0.0;
        for (k, side) in sides.iter_mut().enumerate() {
            let (a, b) = (rim[k], rim[(k + 1) % 4]);
            let cross = a.cross(b);
            tolerance = tolerance.max((-46f64).exp2() * a.length() * b.length() / cross.length());
            let cross = cross.normalize_or_zero();
            *side = if cross.dot(middle) < 0.0 { -cross } else { cross };
            // Seen edge-on, the light is a line and its pyramid has no inside.
            if !(side.dot(middle) > 16.0 * tolerance * middle.length()) {
                return None;
            }
        }
        // Written so that NaN fails too.
        if !(tolerance <= MAX_SIDE_TOLERANCE) {
            return None;
        }
        let lid = match lid {
            None => None,
            Some(n) => {
                let distance = n.dot(0.25 * middle);
                if !(distance.abs() > 1e-6 * middle.length()) {
                    return None;
                }
                Some((n * distance.signum(), distance.abs()))
            }
        };
        Some(Self { apex, sides, tolerance, normal, lid })
    }

    pub fn classify(&self, scene: &RayScene, skip: u32) -> Class {
        let mut class = Class::Lit;
        let mut left = MAX_TRIANGLES;
        scene.bvh.overlapping(
            |center, half| self.excludes_box(center - self.apex, half),
            |range| {
                for slot in range {
                    let triangle = &scene.triangles[slot];
                    if triangle.id == skip {
                        continue;
                    }
                    left = left.saturating_sub(1);
                    class = match self.look_at(scene, slot, triangle) {
                        _ if left == 0 => Class::Unknown,
                        Class::Lit => class,
                        other => other,
                    };
                    if class == Class::Unknown {
                        return false;
                    }
                }
                true
            },
        );
        class
    }

    fn excludes_box(&self, center: DVec3, half: DVec3) -> bool {
        let highest = |n: DVec3| n.dot(center) + n.abs().dot(half);
        self.sides.iter().any(|&n| highest(n) < 0.0)
            || highest(self.normal) < 0.0
            || self.lid.is_some_and(|(n, distance)| -highest(-n) > distance * (1.0 + 1e-12))
    }

    /// Classifies one triangle: `Lit` if it is not in the pyramid.
    fn look_at(&self, scene: &RayScene, slot: usize, triangle: &Triangle) -> Class {
        let v = [0, 1, 2].map(|k| triangle.corner(k) - self.apex);
        if self.excludes(&v) {
            return Class::Lit;
        }
        if triangle.is_masked() {
            return Class::Unknown;
        }
        if let Some((n, distance)) = self.lid {
            let margin = 1e-12 * distance;
            if v.iter().any(|p| n.dot(*p) > distance - margin) {
                let heights: Vec<f64> = self.clip(&v).iter().map(|p| n.dot(*p)).collect();
                // No part of the triangle lies within the sides, or only a part behind the light.
                if heights.iter().all(|h| *h > distance + margin) {
                    return Class::Lit;
                }
                if heights.iter().any(|h| *h > distance - margin) {
                    return Class::Unknown;
                }
            }
        }
        for k in 0..3 {
            if self.meets(v[k], v[(k + 1) % 3]) && self.is_silhouette(scene, slot, k, &v) {
                return Class::Unknown;
            }
        }
        Class::Uniform
    }

    /// Returns whether all corners lie outside one plane.
    fn excludes(&self, v: &[DVec3; 3]) -> bool {
        self.sides.iter().any(|n| v.iter().all(|p| n.dot(*p) < -self.tolerance * p.length()))
            || v.iter().all(|p| self.normal.dot(*p) < -1e-14)
            || self.lid.is_some_and(|(n, d)| v.iter().all(|p| n.dot(*p) > d * (1.0 + 1e-12)))
    }

    /// Returns the part of a triangle within the sides and above the horizon.
    fn clip(&self, v: &[DVec3; 3]) -> Vec<DVec3> {
        let reach = self.tolerance * v.iter().map(|p| p.length()).fold(0.0, f64::max);
        let mut polygon = v.to_vec();
        let planes = self.sides.iter().map(|n| (*n, reach)).chain([(self.normal, 1e-14)]);
        for (n, margin) in planes {
            let height = |p: &DVec3| n.dot(*p) + margin;
            let mut kept = Vec::with_capacity(polygon.len() + 1);
            for (k, a) in polygon.iter().enumerate() {
                let b = &polygon[(k + 1) % polygon.len()];
                let (ha, hb) = (height(a), height(b));
                if ha >= 0.0 {
                    kept.push(*a);
                }
                if (ha >= 0.0) != (hb >= 0.0) {
                    kept.push(*a + (*b - *a) * (ha / (ha - hb)));
                }
            }
            polygon = kept;
        }
        polygon
    }

    /// Returns whether a segment meets the pyramid.
    fn meets(&self, a: DVec3, b: DVec3) -> bool {
        let margin = self.tolerance * a.length().max(b.length());
        let (mut from, mut to) = (0f64, 1f64);
        let mut cut = |ha: f64, hb: f64| {
            if ha < 0.0 && hb < 0.0 {
                to = -1.0;
            } else if ha < 0.0 {
                from = from.max(ha / (ha - hb) - 1e-12);
            } else if hb < 0.0 {
                to = to.min(ha / (ha - hb) + 1e-12);
            }
        };
        for n in &self.sides {
            cut(n.dot(a) + margin, n.dot(b) + margin);
        }
        cut(self.normal.dot(a) + 1e-14, self.normal.dot(b) + 1e-14);
        if let Some((n, distance)) = self.lid {
            let top = distance * (1.0 + 1e-12);
            cut(top - n.dot(a), top - n.dot(b));
        }
        from <= to
    }

    /// Returns `false` only if the surface provably continues beyond edge `k`, as seen from the apex.
    fn is_silhouette(&self, scene: &RayScene, slot: usize, k: usize, v: &[DVec3; 3]) -> bool {
        let Some((other, corner)) = scene.edges().across(slot, k) else { return true };
        let far = scene.triangles[other].corner(corner) - self.apex;
        let (a, b) = (v[k], v[(k + 1) % 3]);
        let cross = a.cross(b);
        // The corners are exact inputs; this bounds the rounding error of the determinant.
        let rounding = (-48f64).exp2() * a.length() * b.length();
        let side = |p: DVec3| {
            let h = cross.dot(p);
            if h.abs() <= rounding * p.length() { 0 } else { h.signum() as i32 }
        };
        side(v[(k + 2) % 3]) * side(far) != -1
    }
}
