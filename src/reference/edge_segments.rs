//! Mirror of `glsl/lib/edge_segment.glsl`: what is asked of a segment in the plane of the shadow map.

use bytemuck::{Pod, Zeroable};
use glam::{DMat2, DVec2, dvec2};

/// `EdgeSegment` as the shaders store it: [`crate::pass::edge_segments::SEGMENT`] bytes.
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub struct StoredSegment {
    /// Ends, texels.
    pub a: [f32; 2],
    /// The other end.
    pub b: [f32; 2],
    /// Depth in the map at `a`.
    pub za: f32,
    /// Depth at `b`.
    pub zb: f32,
    /// 0: nothing of the edge lies in the map.
    pub flags: u32,
    /// Index in the list of silhouettes.
    pub edge: u32,
    /// Third vertex of the triangle beside the edge, if `FACE` is set.
    pub c: [f32; 2],
    /// Depth at `c`.
    pub zc: f32,
}

/// `SEGMENT_FACE` of `glsl/lib/edge_segment.glsl`.
const FACE: u32 = 16;

/// A segment in `f64`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Segment {
    /// Ends, texels; the occluder lies where `cross(b - a, p - a) > 0`.
    pub a: DVec2,
    /// The other end.
    pub b: DVec2,
    /// Depth in the map at the ends.
    pub z: [f64; 2],
    /// Third vertex of the occluder's triangle beside the edge and its depth, if it is before the light.
    pub third: Option<(DVec2, f64)>,
}

impl StoredSegment {
    /// The segment; `None` where nothing of the edge lies in the map.
    pub fn segment(&self) -> Option<Segment> {
        let point = |p: [f32; 2]| dvec2(p[0].into(), p[1].into());
        let found = Segment {
            a: point(self.a),
            b: point(self.b),
            z: [self.za.into(), self.zb.into()],
            third: (self.flags & FACE != 0).then(|| (point(self.c), self.zc.into())),
        };
        (self.flags != 0).then_some(found)
    }
}

impl Segment {
    /// Where on the segment the point closest to `p` lies: 0 at `a`, 1 at `b`.
    pub fn foot(&self, p: DVec2) -> f64 {
        let d = self.b - self.a;
        let all = d.length_squared();
        if all > 0.0 { ((p - self.a).dot(d) / all).clamp(0.0, 1.0) } else { 0.0 }
    }

    /// A point of the segment.
    pub fn at(&self, t: f64) -> DVec2 {
        self.a.lerp(self.b, t)
    }

    /// Distance of a point, texels.
    pub fn distance(&self, p: DVec2) -> f64 {
        p.distance(self.at(self.foot(p)))
    }

    /// Distance from the line, positive on the occluder's side.
    pub fn line_distance(&self, p: DVec2) -> f64 {
        let d = self.b - self.a;
        let length = d.length();
        if length > 0.0 { d.perp_dot(p - self.a) / length } else { 0.0 }
    }

    /// Depth at a place of the segment.
    pub fn depth(&self, t: f64) -> f64 {
        self.z[0] + t * (self.z[1] - self.z[0])
    }

    /// Depth at `p` of the plane of the triangle beside the edge, and whether `p` lies in the triangle, as the light sees it.
    pub fn face(&self, p: DVec2) -> Option<(f64, bool)> {
        let (c, zc) = self.third?;
        let sides = DMat2::from_cols(self.b - self.a, c - self.a);
        let [u, v] = (sides.inverse() * (p - self.a)).to_array();
        let depth = self.z[0] + u * (self.z[1] - self.z[0]) + v * (zc - self.z[0]);
        Some((depth, sides.determinant() > 0.0 && u >= 0.0 && v >= 0.0 && u + v <= 1.0))
    }

    /// Where the walk from `p` to `q` crosses the segment: 0 at `p`, 1 at `q`.
    pub fn crossing(&self, p: DVec2, q: DVec2) -> Option<f64> {
        let (d, walk) = (self.b - self.a, q - p);
        let (from, to) = (d.perp_dot(p - self.a), d.perp_dot(q - self.a));
        let (a, b) = (walk.perp_dot(self.a - p), walk.perp_dot(self.b - p));
        let crosses = (from >= 0.0) != (to >= 0.0) && (a >= 0.0) != (b >= 0.0);
        crosses.then(|| from / (from - to))
    }
}
