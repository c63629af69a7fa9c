//! Nearest boundary of each point on its own surface.

use glam::DVec3;
use rstar::{AABB, PointDistance, RTree, RTreeObject};

/// Sine of 45 degrees: neither of two points of a curved surface lies farther from the other's tangent plane.
const CURVED_SINE: f64 = std::f64::consts::FRAC_1_SQRT_2;
/// Tolerance for one plane: distance from the plane over length, and sine of the angle between normals.
const FLAT_SINE: f64 = 1e-3;
/// Rounding error of a point, local space.
const ROUNDING: f64 = 1.0 / (1u64 << 36) as f64;

/// Point of a surface, local space.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Place {
    pub position: DVec3,
    /// Unit normal on the camera's side.
    pub normal: DVec3,
    /// Number of the smooth surface.
    pub surface: u32,
}

/// Returns whether two points are on the same surface as defined in the [module](super). Each may lie off its surface
/// by `slack`.
pub(super) fn is_same_surface(a: &Place, b: &Place, slack: f64) -> bool {
    let between = b.position - a.position;
    let height = a.normal.dot(between).abs().max(b.normal.dot(between).abs());
    let length = between.length();
    let within = |sine: f64, slack: f64| height <= sine * length + slack + ROUNDING;
    let is_flat = || a.normal.cross(b.normal).length() <= FLAT_SINE && within(FLAT_SINE, FLAT_SINE * slack);
    a.normal.dot(b.normal) > 0.0 && (a.surface == b.surface && within(CURVED_SINE, slack) || is_flat())
}

/// Piece of the boundary, or a single point of it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Segment {
    from: DVec3,
    to: DVec3,
    normal: DVec3,
    surface: u32,
}

impl Segment {
    pub fn new(a: &Place, b: &Place) -> Self {
        let normal = (a.normal + b.normal).normalize_or_zero();
        Self { from: a.position, to: b.position, normal, surface: a.surface }
    }

    #[cfg(test)]
    pub fn at(&self, t: f64) -> DVec3 {
        self.from.lerp(self.to, t)
    }

    /// Returns the segment's point nearest to `p`.
    fn nearest(&self, p: DVec3) -> Place {
        let along = self.to - self.from;
        let t = (p - self.from).dot(along) / along.length_squared();
        // For a segment of length 0, `t` is NaN and counts as 0.
        let position = self.from + along * if t > 0.0 { t.min(1.0) } else { 0.0 };
        Place { position, normal: self.normal, surface: self.surface }
    }

    /// Returns the segment's distance from a place; `None` if that lies on another surface.
    pub fn distance(&self, place: &Place) -> Option<f64> {
        let nearest = self.nearest(place.position);
        // On a curved surface the chord lies off the surface, by less than this.
        let slack = 0.25 * (self.to - self.from).length();
        is_same_surface(place, &nearest, slack).then(|| (nearest.position - place.position).length())
    }
}

impl RTreeObject for Segment {
    type Envelope = AABB<[f64; 3]>;

    fn envelope(&self) -> Self::Envelope {
        AABB::from_corners(self.from.to_array(), self.to.to_array())
    }
}

impl PointDistance for Segment {
    fn distance_2(&self, point: &[f64; 3]) -> f64 {
        let p = DVec3::from_array(*point);
        (self.nearest(p).position - p).length_squared()
    }
}

/// Spatial index of the whole boundary.
pub(super) struct Nearest(RTree<Segment>);

impl Nearest {
    pub fn new(segments: Vec<Segment>) -> Self {
        Self(RTree::bulk_load(segments))
    }

    /// Returns the distance from a place to the nearest boundary on its surface; `None` beyond `reach`.
    pub fn distance(&self, place: &Place, reach: f64) -> Option<f64> {
        self.0
            .nearest_neighbor_iter_with_distance_2(&place.position.to_array())
            .take_while(|(_, d2)| *d2 <= reach * reach)
            .find_map(|(segment, _)| segment.distance(place))
    }
}
