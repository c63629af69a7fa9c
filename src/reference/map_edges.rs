//! Mirror of `glsl/pass/edge_segments.comp` and `map_edge.glsl`: silhouette edges in the plane of the shadow map.

use super::view::Decision;
use crate::view::LightView;
use glam::{DAffine3, DMat4, DVec2, DVec4, Vec3};

/// An edge as the map has it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MapEdge {
    /// Ends, texels; the occluder lies where `perp_dot(b - a, p - a)` is positive.
    pub ends: [DVec2; 2],
    /// Depths of the ends.
    pub depths: [f64; 2],
    /// Whether the ends are the edge's own, not where it was cut.
    pub own: [bool; 2],
}

impl MapEdge {
    /// Words of an `EdgeSegment` in a buffer; `None` for one that is not drawn.
    pub fn from_words(words: [u32; 8]) -> Option<Self> {
        let f = |i: usize| f64::from(f32::from_bits(words[i]));
        let ends = [DVec2::new(f(0), f(1)), DVec2::new(f(2), f(3))];
        let cut = |bit: u32| words[6] & bit != 0;
        (cut(1) && ends[0] != ends[1]).then(|| Self { ends, depths: [f(4), f(5)], own: [!cut(4), !cut(8)] })
    }

    /// Of clip coordinates, cut to what lies at least `nearest` before the light and at most `margin` texels beyond the map.
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
        };
        (edge.ends[0] != edge.ends[1]).then_some(edge)
    }

    /// From end to end.
    pub fn along(&self) -> DVec2 {
        self.ends[1] - self.ends[0]
    }

    /// Depth at a share of the way from end to end.
    pub fn depth(&self, t: f64) -> f64 {
        self.depths[0] + t * (self.depths[1] - self.depths[0])
    }

    /// Whether a place of the edge lies behind all that the map, row by row, holds around it; in doubt where rounding may
    /// decide.
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
        let margin = |middle| z - around(middle) - 2.0 * super::view::DEPTH_ULPS - slope;
        let found = Decision::positive(margin(p), 2e-6 + 1e-3 * slope);
        let other = [[-1.0, 0.0], [1.0, 0.0], [0.0, -1.0], [0.0, 1.0]]
            .map(|d| margin(p + PLACE_ERROR * DVec2::from_array(d)) > 0.0);
        if other.iter().all(|o| *o == found.is_yes()) { found } else { Decision::Doubtful(found.is_yes()) }
    }
}

/// How far single precision may move a place in the map, texels.
pub(super) const PLACE_ERROR: f64 = 5e-4;

/// Clip coordinates of a point of an instance, composed in `f64`.
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
        // From the middle to behind the light: up to the margin, on the line that the two clip points span.
        let e = MapEdge::project([a, dvec4(4.0, 0.5, 0.2, -1.0)], [64, 32], 16.0, 1e-3).unwrap();
        assert!(e.own == [true, false] && e.ends[0] == dvec2(32.0, 24.0), "{e:?}");
        assert!((e.ends[1].x - 80.0).abs() < 1e-9 && e.ends[1].y > 24.0, "{e:?}");
        assert_eq!(
            MapEdge::project([dvec4(0.0, 0.0, 0.0, -1.0), dvec4(1.0, 0.0, 0.0, -2.0)], [64, 32], 16.0, 1e-3),
            None
        );
        assert_eq!(
            MapEdge::project([dvec4(5.0, 0.0, 0.0, 1.0), dvec4(9.0, 0.0, 0.0, 1.0)], [64, 32], 16.0, 1e-3),
            None
        );
        assert_eq!(MapEdge::project([a, a], [64, 32], 16.0, 1e-3), None);
        let whole = MapEdge::project([a, dvec4(-1.0, -1.0, 0.6, 2.0)], [64, 32], 16.0, 1e-3).unwrap();
        assert_eq!((whole.own, whole.ends[1], whole.depth(1.0)), ([true; 2], dvec2(16.0, 8.0), 0.3));
    }

    #[test]
    fn only_what_lies_behind_everything_around_is_hidden() {
        let edge = MapEdge { ends: [dvec2(0.0, 4.0), dvec2(8.0, 4.0)], depths: [0.5; 2], own: [true; 2] };
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
