//! Mirror of `glsl/lib/edge_segment.glsl`, `glsl/caster_edges/edge_segments.comp` and `drawn_edge.glsl`: silhouettes as
//! segments in the plane of the shadow map, and the queries on them.

use crate::reference::common::view::{DEPTH_ULPS, Decision};
use crate::view::LightView;
use bytemuck::{Pod, Zeroable};
use glam::{DAffine3, DMat2, DMat4, DVec2, DVec4, Vec3, dvec2};

/// `EdgeSegment` as the shaders store it: [`crate::technique::caster_edges::edge_segments::SEGMENT`] bytes.
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub struct StoredSegment {
    /// First end, texels.
    pub a: [f32; 2],
    /// Second end, texels.
    pub b: [f32; 2],
    /// Depth in the map at `a`, 0 to 1.
    pub za: f32,
    /// Depth in the map at `b`, 0 to 1.
    pub zb: f32,
    /// Flag bits; 0 if no part of the edge lies in the map.
    pub flags: u32,
    /// Index in the list of silhouettes.
    pub edge: u32,
    /// Third vertex of the triangle beside the edge, texels, if `FACE` is set.
    pub c: [f32; 2],
    /// Depth in the map at `c`, 0 to 1.
    pub zc: f32,
}

/// `SEGMENT_FACE` of `glsl/lib/edge_segment.glsl`.
const FACE: u32 = 16;

/// Segment in `f64`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Segment {
    /// Ends, texels; the occluder lies where `perp_dot(b - a, p - a)` is positive.
    pub ends: [DVec2; 2],
    /// Depths in the map at the ends.
    pub depths: [f64; 2],
    /// `true` for an end that is the edge's own, `false` for one where the edge was cut.
    pub own: [bool; 2],
    /// Third vertex of the occluder's triangle beside the edge, texels, and its depth; `None` if it is not in front of
    /// the light.
    pub third: Option<(DVec2, f64)>,
}

/// `SEGMENT_CUT_A` and `SEGMENT_CUT_B`.
const CUT: [u32; 2] = [4, 8];

impl StoredSegment {
    /// Returns the segment; `None` if no part of the edge lies in the map.
    pub fn segment(&self) -> Option<Segment> {
        let point = |p: [f32; 2]| dvec2(p[0].into(), p[1].into());
        let found = Segment {
            ends: [self.a, self.b].map(point),
            depths: [self.za.into(), self.zb.into()],
            own: CUT.map(|bit| self.flags & bit == 0),
            third: (self.flags & FACE != 0).then(|| (point(self.c), self.zc.into())),
        };
        (self.flags != 0).then_some(found)
    }
}

impl Segment {
    /// Projects an edge from clip coordinates. Cuts it to the part at least `nearest` in front of the light and at
    /// most `margin` texels outside the map.
    pub fn project(ends: [DVec4; 2], map_size: [u32; 2], margin: f64, nearest: f64) -> Option<Self> {
        let extent = DVec2::new(map_size[0].into(), map_size[1].into());
        let reach = 1.0 + 2.0 * margin / extent;
        let borders = |p: DVec4| {
            let (x, y) = (reach.x * p.w, reach.y * p.w);
            [x + p.x, y + p.y, x - p.x, y - p.y, p.w - nearest]
        };
        let (mut from, mut to) = (0.0f64, 1.0f64);
        for (a, b) in borders(ends[0]).into_iter().zip(borders(ends[1])) {
            match (a < 0.0, b < 0.0) {
                (true, true) => return None,
                (true, false) => from = from.max(a / (a - b)),
                (false, true) => to = to.min(a / (a - b)),
                (false, false) => {}
            }
        }
        if from > to {
            return None;
        }
        let cut = [from, to].map(|t| ends[0].lerp(ends[1], t));
        let edge = Self {
            ends: cut.map(|p| (0.5 * DVec2::new(p.x, p.y) / p.w + 0.5) * extent),
            depths: cut.map(|p| p.z / p.w),
            own: [from == 0.0, to == 1.0],
            third: None,
        };
        edge.has_sides().then_some(edge)
    }

    /// Adds the third vertex of the triangle beside the edge, given in clip coordinates.
    pub fn beside(self, third: DVec4, map_size: [u32; 2], nearest: f64) -> Self {
        let extent = DVec2::new(map_size[0].into(), map_size[1].into());
        let place = |c: DVec4| ((0.5 * DVec2::new(c.x, c.y) / c.w + 0.5) * extent, c.z / c.w);
        Self { third: (third.w > nearest).then(|| place(third)), ..self }
    }

    /// Returns `false` for an edge seen end-on.
    pub fn has_sides(&self) -> bool {
        self.ends[0] != self.ends[1]
    }

    /// Returns the vector from the first end to the second, texels.
    pub fn along(&self) -> DVec2 {
        self.ends[1] - self.ends[0]
    }

    /// Returns the parameter, 0 to 1 from end to end, of the segment's point closest to `p`.
    pub fn foot(&self, p: DVec2) -> f64 {
        let d = self.along();
        let all = d.length_squared();
        if all > 0.0 { ((p - self.ends[0]).dot(d) / all).clamp(0.0, 1.0) } else { 0.0 }
    }

    /// Returns the segment's point at parameter `t`, 0 to 1 from end to end.
    pub fn at(&self, t: f64) -> DVec2 {
        self.ends[0].lerp(self.ends[1], t)
    }

    /// Returns the distance of `p` from the segment, texels.
    pub fn distance(&self, p: DVec2) -> f64 {
        p.distance(self.at(self.foot(p)))
    }

    /// Returns the distance of `p` from the segment's line, texels; positive on the occluder's side.
    pub fn line_distance(&self, p: DVec2) -> f64 {
        let d = self.along();
        let length = d.length();
        if length > 0.0 { d.perp_dot(p - self.ends[0]) / length } else { 0.0 }
    }

    /// Returns the depth at parameter `t`, 0 to 1 from end to end.
    pub fn depth(&self, t: f64) -> f64 {
        self.depths[0] + t * (self.depths[1] - self.depths[0])
    }

    /// Returns the depth at `p` of the plane of the triangle beside the edge, and whether `p` lies in the triangle as
    /// seen from the light.
    pub fn face(&self, p: DVec2) -> Option<(f64, bool)> {
        let (c, zc) = self.third?;
        let sides = DMat2::from_cols(self.along(), c - self.ends[0]);
        let [u, v] = (sides.inverse() * (p - self.ends[0])).to_array();
        let depth = self.depth(u) + v * (zc - self.depths[0]);
        Some((depth, sides.determinant() > 0.0 && u >= 0.0 && v >= 0.0 && u + v <= 1.0))
    }

    /// Returns where the path from `p` to `q` crosses the segment: 0 at `p`, 1 at `q`.
    pub fn crossing(&self, p: DVec2, q: DVec2) -> Option<f64> {
        let (d, walk) = (self.along(), q - p);
        let (from, to) = (d.perp_dot(p - self.ends[0]), d.perp_dot(q - self.ends[0]));
        let [a, b] = self.ends.map(|end| walk.perp_dot(end - p));
        let crosses = (from >= 0.0) != (to >= 0.0) && (a >= 0.0) != (b >= 0.0);
        crosses.then(|| from / (from - to))
    }

    /// Decides whether a point of the edge lies behind every depth that the map (row by row) holds around it. The
    /// decision is doubtful where rounding may change it.
    pub(super) fn is_hidden(&self, shadow_map: &[f32], map_size: [u32; 2], p: DVec2, z: f64) -> Decision {
        let [w, h] = map_size.map(i64::from);
        let around = |middle: DVec2| {
            let (x, y) = (middle.x.floor() as i64, middle.y.floor() as i64);
            let texels = (-1..=1).flat_map(|j| (-1..=1).map(move |i| [x + i, y + j]));
            let inside = |t: &[i64; 2]| (0..w).contains(&t[0]) && (0..h).contains(&t[1]);
            let depth = |t: [i64; 2]| if inside(&t) { f64::from(shadow_map[(t[1] * w + t[0]) as usize]) } else { 1.0 };
            texels.map(depth).fold(0.0, f64::max)
        };
        let slope = (self.depths[1] - self.depths[0]).abs() / self.along().length().max(1.0);
        let margin = |middle| z - around(middle) - 2.0 * DEPTH_ULPS - slope;
        let found = Decision::positive(margin(p), 2e-6 + 1e-3 * slope);
        let other = [[-1.0, 0.0], [1.0, 0.0], [0.0, -1.0], [0.0, 1.0]]
            .map(|d| margin(p + PLACE_ERROR * DVec2::from_array(d)) > 0.0);
        if other.iter().all(|o| *o == found.is_yes()) { found } else { Decision::Doubtful(found.is_yes()) }
    }
}

/// Largest error of a position in the map in single precision, texels.
pub(super) const PLACE_ERROR: f64 = 5e-4;

/// Returns the clip coordinates of a point of an instance, computed in `f64`.
pub fn clip_from_object(light: &LightView, world_from_object: &DAffine3, p: [f32; 3]) -> DVec4 {
    let world = world_from_object.transform_point3(Vec3::from(p).as_dvec3());
    let view = DMat4::from(light.world_from_view.inverse());
    light.clip_from_view * (view * world.extend(1.0))
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::{dvec2, dvec4};

    #[test]
    fn edges_are_cut_before_they_are_projected() {
        let a = dvec4(0.0, 0.5, 0.2, 1.0);
        // From the middle to behind the light: the edge ends at the margin, on the line that the two clip points span.
        let e = Segment::project([a, dvec4(4.0, 0.5, 0.2, -1.0)], [64, 32], 16.0, 1e-3).unwrap();
        assert!(e.own == [true, false] && e.ends[0] == dvec2(32.0, 24.0), "{e:?}");
        assert!((e.ends[1].x - 80.0).abs() < 1e-9 && e.ends[1].y > 24.0, "{e:?}");
        assert_eq!(
            Segment::project([dvec4(0.0, 0.0, 0.0, -1.0), dvec4(1.0, 0.0, 0.0, -2.0)], [64, 32], 16.0, 1e-3),
            None
        );
        assert_eq!(
            Segment::project([dvec4(5.0, 0.0, 0.0, 1.0), dvec4(9.0, 0.0, 0.0, 1.0)], [64, 32], 16.0, 1e-3),
            None
        );
        assert_eq!(Segment::project([a, a], [64, 32], 16.0, 1e-3), None);
        let whole = Segment::project([a, dvec4(-1.0, -1.0, 0.6, 2.0)], [64, 32], 16.0, 1e-3).unwrap();
        assert_eq!((whole.own, whole.ends[1], whole.depth(1.0)), ([true; 2], dvec2(16.0, 8.0), 0.3));
    }

    #[test]
    fn only_what_lies_behind_everything_around_is_hidden() {
        let edge = Segment { ends: [dvec2(0.0, 4.0), dvec2(8.0, 4.0)], depths: [0.5; 2], own: [true; 2], third: None };
        let mut map = vec![0.4f32; 64];
        let at = |map: &[f32]| edge.is_hidden(map, [8, 8], dvec2(3.5, 4.5), 0.5);
        assert_eq!(at(&map), Decision::Yes);
        map[5 * 8 + 4] = 0.6;
        assert_eq!(at(&map), Decision::No);
        assert_eq!(edge.is_hidden(&[0.4; 64], [8, 8], dvec2(0.5, 4.5), 0.5), Decision::No, "beyond the map all is far");
        map[5 * 8 + 4] = 0.4;
        map[5 * 8 + 5] = 0.6;
        assert!(edge.is_hidden(&map, [8, 8], dvec2(4.0001, 4.5), 0.5).is_doubtful());
    }
}
