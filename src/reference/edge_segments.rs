//! Mirror of `glsl/pass/edge_segments.comp` and of `glsl/lib/edge_segment.glsl`: silhouette edges as segments in the plane of the
//! shadow map.

use crate::pass::edge_segments::EdgeSegmentsPush;
use bytemuck::{Pod, Zeroable};
use glam::{DMat4, DVec2, DVec4, dvec2};

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
}

/// A segment in `f64`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Segment {
    /// Ends, texels; the occluder lies where `cross(b - a, p - a) > 0`.
    pub a: DVec2,
    /// The other end.
    pub b: DVec2,
    /// Depth in the map at the ends.
    pub z: [f64; 2],
}

impl StoredSegment {
    /// The segment; `None` where nothing of the edge lies in the map.
    pub fn segment(&self) -> Option<Segment> {
        let point = |p: [f32; 2]| dvec2(p[0].into(), p[1].into());
        let found = Segment { a: point(self.a), b: point(self.b), z: [self.za.into(), self.zb.into()] };
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

    /// Where the walk from `p` to `q` crosses the segment: 0 at `p`, 1 at `q`.
    pub fn crossing(&self, p: DVec2, q: DVec2) -> Option<f64> {
        let (d, walk) = (self.b - self.a, q - p);
        let (from, to) = (d.perp_dot(p - self.a), d.perp_dot(q - self.a));
        let (a, b) = (walk.perp_dot(self.a - p), walk.perp_dot(self.b - p));
        let crosses = (from >= 0.0) != (to >= 0.0) && (a >= 0.0) != (b >= 0.0);
        crosses.then(|| from / (from - to))
    }
}

/// Projects an edge, in object space, by a light's matrix. `None` where nothing of it lies in the map with its margin.
pub fn project(ends: [[f32; 3]; 2], light_clip_from_object: &DMat4, push: &EdgeSegmentsPush) -> Option<Segment> {
    let clip = ends.map(|p| *light_clip_from_object * DVec4::new(p[0].into(), p[1].into(), p[2].into(), 1.0));
    let [a, b] = if push.mirrored > 0.0 { [clip[1], clip[0]] } else { clip };
    let map = dvec2(push.map_size[0].into(), push.map_size[1].into());
    let reach = 1.0 + 2.0 * f64::from(push.margin) / map;
    let planes: [&dyn Fn(DVec4) -> f64; 5] = [
        &|q| q.w - f64::from(push.nearest),
        &|q| reach.x * q.w + q.x,
        &|q| reach.x * q.w - q.x,
        &|q| reach.y * q.w + q.y,
        &|q| reach.y * q.w - q.y,
    ];
    let mut range = [0.0f64, 1.0];
    for plane in planes {
        let (from, to) = (plane(a), plane(b));
        if from < 0.0 {
            range[0] = range[0].max(if to > from { from / (from - to) } else { 2.0 });
        }
        if to < 0.0 {
            range[1] = range[1].min(if from > to { from / (from - to) } else { -1.0 });
        }
    }
    if range[0] > range[1] {
        return None;
    }
    let texel = |t: f64| {
        let q = a.lerp(b, t);
        ((0.5 * dvec2(q.x, q.y) / q.w + 0.5) * map, q.z / q.w)
    };
    let (from, to) = (texel(range[0]), texel(range[1]));
    Some(Segment { a: from.0, b: to.0, z: [from.1, to.1] })
}
