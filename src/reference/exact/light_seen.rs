//! Mirror of the part of an area light that a receiver sees: counters of layers at 16 x 16 samples.
//!
//! The edges are those of all triangles, merged where triangles meet, without topology or silhouettes. What an edge
//! weighs depends on the receiver: each face that meets there counts by the side of its plane on which the receiver lies.
//! The sum is then exact for every point of the light, also where a face's plane cuts the light and its points see different
//! silhouettes. Projection, clipping and crossings are computed in camera view space.

use super::grid::{GridReceiver, Place, far_vertices, place};
use super::layers::{self, Layers, Occluders, Triangle, VERTEX};
use crate::Result;
use crate::reference::caster_edges::shadow_volumes::Caster;
use crate::reference::common::view::{FrameData, Mirror, Verdict, View};
use crate::view::{CameraView, LightKind, LightView};
use glam::{DVec2, DVec3, dvec2};
use std::collections::BTreeMap;

/// Rows of samples, and samples of a row.
const ROWS: usize = 16;

/// An edge at which layers may end, in camera view space.
#[derive(Clone, Debug)]
struct Edge {
    a: DVec3,
    b: DVec3,
    /// Faces that meet here: index among the faces, and the layers that end here because of a face turned to the
    /// receiver with its back. In the light's image these lie where `(b - a).perp_dot(p - a)` is positive.
    faces: Vec<(usize, i32)>,
    /// Bound of the ends' error, world units.
    error: f64,
}

/// Plane of a triangle.
struct Face {
    corner: DVec3,
    /// Unit normal; 0 for a triangle without an area.
    normal: DVec3,
    /// Bound of the error of a distance from the plane near the triangle.
    error: f64,
    /// Counter-clockwise seen from the light's centre.
    front: bool,
    /// An edge between two such faces ends half as many layers as faces change.
    shell: bool,
}

/// The light, and what lies between it and the receivers.
struct Scene {
    /// The occluders, all faces of their surfaces, and all edges between them.
    occluders: Occluders,
    faces: Vec<Face>,
    edges: Vec<Edge>,
    /// Unit vectors along the sides of the light, and the direction in which the distance from it grows.
    sides: [DVec3; 2],
    axis: DVec3,
    /// Half of the light's side.
    half: f64,
    disc: bool,
}

/// Bits of an end of an edge, by which edges are merged.
type End = [u64; 3];

/// Merges the sides of the triangles of each instance. `mirrored` says that the light's image is left-handed.
fn edges<'a>(triangles: impl Iterator<Item = &'a Triangle>, mirrored: bool) -> Vec<Edge> {
    let key = |p: DVec3| p.to_array().map(|x| (x + 0.0).to_bits());
    let mut all: BTreeMap<(usize, End, End), Edge> = BTreeMap::new();
    for (face, t) in triangles.enumerate() {
        let [a, b, c] = t.corners;
        for (from, to) in [(a, b), (b, c), (c, a)] {
            let sign = if mirrored { -1 } else { 1 };
            let swapped = key(from) > key(to);
            let (a, b, sign) = if swapped { (to, from, -sign) } else { (from, to, sign) };
            let e = all.entry((t.index[0], key(a), key(b))).or_insert(Edge { a, b, faces: vec![], error: 0.0 });
            e.faces.push((face, sign));
            e.error = e.error.max(t.error);
        }
    }
    all.into_values().filter(|e| e.a != e.b).collect()
}

impl Face {
    fn new(t: &Triangle) -> Self {
        let [a, b, c] = t.corners;
        let normal = (b - a).cross(c - a);
        // The plane of a sliver is known as well as its shorter sides tell.
        let mut lengths = [(b - a).length(), (c - a).length(), (c - b).length()];
        lengths.sort_by(f64::total_cmp);
        let [short, middle, _] = lengths;
        let sliver = if normal == DVec3::ZERO { 0.0 } else { short * middle / normal.length() };
        let error = t.error + VERTEX * sliver * (short + middle);
        Self { corner: a, normal: normal.normalize_or_zero(), error, front: t.front, shell: t.shell }
    }

    /// Returns 1 if the point sees the face from behind, else -1, and whether rounding may change that.
    fn turned(&self, p: DVec3, moved: f64) -> (i32, bool) {
        let above = self.normal.dot(p - self.corner);
        (if above < 0.0 { 1 } else { -1 }, above.abs() < 4.0 * (self.error + moved))
    }
}

/// Samples of the light: 16 bits for each row.
type Bits = [u16; ROWS];

/// Result for a receiver: the light it sees, and the share of it that is in doubt.
struct Shares {
    seen: f64,
    doubt: f64,
}

/// An edge on the light, with the error of its ends.
struct OnLight {
    /// Ends, mapped onto the rows.
    q: [DVec2; 2],
    /// World units on the light for a unit at the edge, at both ends.
    scale: [f64; 2],
    /// Ends at which the edge was cut.
    cut: [bool; 2],
}

impl Scene {
    fn new(view: &View<'_>, camera: &CameraView, light: &LightView, casters: &[Caster<'_>], disc: bool) -> Self {
        let occluders = Occluders::new(camera, light, casters);
        let sides = [0, 1].map(|i| view.light_side(i));
        let rotation = camera.world_from_view.matrix3.transpose();
        let axis = rotation * light.direction();
        let half = match light.kind {
            LightKind::Spot { size } => 0.5 * size,
            LightKind::Directional { angle } => (0.5 * angle).tan(),
        };
        Self::of(occluders, sides, axis, half, disc)
    }

    fn of(occluders: Occluders, sides: [DVec3; 2], axis: DVec3, half: f64, disc: bool) -> Self {
        let mirrored = sides[0].cross(sides[1]).dot(-axis) < 0.0;
        let all = || occluders.triangles.iter().chain(&occluders.back_faces);
        let (faces, edges) = (all().map(Face::new).collect(), edges(all(), mirrored));
        Self { occluders, faces, edges, sides, axis, half, disc }
    }

    /// Returns the layers that end at an edge, where `turned` tells how each face is turned.
    fn weight(&self, e: &Edge, turned: impl Fn(usize) -> i32) -> i32 {
        let sum: i32 = e.faces.iter().map(|&(face, sign)| sign * turned(face)).sum();
        if self.faces[e.faces[0].0].shell { sum / 2 } else { sum }
    }

    /// Returns the layers that end at an edge for the light's centre.
    fn centre_weight(&self, e: &Edge) -> i32 {
        self.weight(e, |face| if self.faces[face].front { 1 } else { -1 })
    }

    fn is_sun(&self) -> bool {
        self.occluders.light.w == 0.0
    }

    /// Projects the part of an edge that lies nearer to the light than `p` onto the light. With `above`, the part below the
    /// plane through `p` with this normal is left out.
    fn project(&self, e: &Edge, p: DVec3, above: Option<DVec3>) -> Option<OnLight> {
        let (axis, light) = (self.axis, self.occluders.light.truncate());
        // How much nearer to the light, and the distance from a spot light's plane.
        let own = if self.is_sun() { f64::INFINITY } else { axis.dot(p - light) };
        let near = |v: DVec3| axis.dot(p - v);
        let size = if self.is_sun() { near(e.a).abs().max(near(e.b).abs()) } else { own };
        let margins = |v: DVec3| {
            let above = above.map_or(1.0, |n| n.dot(v - p));
            [near(v) - 1e-7 * size, above, if self.is_sun() { 1.0 } else { own - near(v) - 1e-5 * own }]
        };
        let (mut from, mut to) = (0.0f64, 1.0f64);
        for (a, b) in margins(e.a).into_iter().zip(margins(e.b)) {
            match (a < 0.0, b < 0.0) {
                (true, true) => return None,
                (true, false) => from = from.max(a / (a - b)),
                (false, true) => to = to.min(a / (a - b)),
                (false, false) => {}
            }
        }
        if from >= to {
            return None;
        }
        let point = |t: f64| {
            if t == 0.0 {
                e.a
            } else if t == 1.0 {
                e.b
            } else {
                e.a.lerp(e.b, t)
            }
        };
        let ends = [from, to].map(point);
        let scale = ends.map(|v| if self.is_sun() { 1.0 / near(v) } else { own / near(v) });
        let on = |i: usize| {
            let v = (ends[i] - p) * scale[i] + if self.is_sun() { DVec3::ZERO } else { p - light };
            self.onto_rows(dvec2(v.dot(self.sides[0]), v.dot(self.sides[1])) / self.half)
        };
        Some(OnLight { q: [on(0), on(1)], scale, cut: [from > 0.0, to < 1.0] })
    }

    /// Half-width of a row.
    fn width(&self, y: f64) -> f64 {
        if self.disc { (1.0 - y * y).sqrt() } else { 1.0 }
    }

    /// Maps a place on the light to where rows run along the x axis: they fall by a sixteenth, so that samples of
    /// different columns have different heights. A square's rows are sheared, a disc's rotated.
    fn onto_rows(&self, q: DVec2) -> DVec2 {
        if self.disc { DVec2::from_angle((1.0f64 / 16.0).atan()).rotate(q) } else { dvec2(q.x, q.y + q.x / 16.0) }
    }

    /// Inverse of [`Scene::onto_rows`].
    fn off_rows(&self, q: DVec2) -> DVec2 {
        if self.disc { DVec2::from_angle(-(1.0f64 / 16.0).atan()).rotate(q) } else { dvec2(q.x, q.y - q.x / 16.0) }
    }

    /// Place of a sample among the rows, in units of half the light's side.
    fn sample(&self, row: usize, column: usize) -> DVec2 {
        let y = row_height(row);
        let shift = (row as f64 + 0.5) / 16.0;
        dvec2(self.width(y) * ((column as f64 + shift) / 8.0 - 1.0), y)
    }

    fn shares(&self, g: &GridReceiver, layers: u32) -> Option<Shares> {
        let to_light = self.occluders.to_light(g.receiver.position).normalize();
        let p = g.receiver.position + g.step * to_light;
        let n = g.receiver.normal;
        let moved = 4.0 * g.receiver.position_error.length() + g.step_error + VERTEX * p.length();
        let mut counts = [[layers as i32; ROWS]; ROWS];
        let mut doubtful: Bits = [0; ROWS];
        let turned: Vec<(i32, bool)> = self.faces.iter().map(|f| f.turned(p, moved)).collect();
        for e in &self.edges {
            let weight = self.weight(e, |face| turned[face].0);
            // The sides of a face that is seen edge-on lie on each other.
            let is_sure = e.faces.iter().all(|f| !turned[f.0].1);
            if weight == 0 && is_sure {
                continue;
            }
            let Some(on) = self.project(e, p, None) else { continue };
            let [a, b] = on.q;
            let low = a.min(b);
            let high = a.max(b);
            let least = on.scale[0].min(on.scale[1]);
            let tolerance = |scale: f64, q: DVec2| {
                let off = if is_sure { 3.0 } else { 6.0 } * scale * (e.error + moved) / self.half;
                off + VERTEX * (1.0 + q.abs().max_element())
            };
            let widest = 1.0 + 1.0 / 16.0 + tolerance(least, DVec2::ZERO);
            if low.max_element() > widest || high.min_element() < -widest {
                continue;
            }
            let d = b - a;
            let inside = |q: DVec2| i32::from(d.perp_dot(q - a) > 0.0);
            // The light's centre lies on the edge: the count and the edges may disagree.
            let foot = (-a.dot(d) / d.length_squared()).clamp(0.0, 1.0);
            let at_foot = a.lerp(b, foot);
            if at_foot.length() < tolerance(on.scale[0] + foot * (on.scale[1] - on.scale[0]), at_foot) {
                return None;
            }
            let straddles = (a.x <= 0.0) != (b.x <= 0.0);
            for end in 0..2 {
                let (q, off) = (on.q[end], tolerance(on.scale[end], on.q[end]));
                if on.cut[end] && q.x.abs() < off && q.y.abs() < 1.0 + off {
                    return None;
                }
            }
            for row in 0..ROWS {
                let y = row_height(row);
                let vertical = if straddles { inside(dvec2(0.0, y)) - inside(DVec2::ZERO) } else { 0 };
                let spans = (a.y <= y) != (b.y <= y);
                let at = (y - a.y) / if d.y == 0.0 { 1.0 } else { d.y };
                let x = a.x + at * d.x;
                let right = i32::from(d.y < 0.0);
                // Inside is to the right of the crossing if the edge goes up, to the left otherwise.
                let covered = |sample: f64| if sample > x { right } else { 1 - right };
                let off = tolerance(on.scale[0] + at * (on.scale[1] - on.scale[0]), dvec2(x, y));
                let off = off * (1.0 + (d.x / d.y).abs());
                for (column, count) in counts[row].iter_mut().enumerate() {
                    let sample = self.sample(row, column).x;
                    let horizontal = if spans { covered(sample) - covered(0.0) } else { 0 };
                    *count += weight * (vertical + horizontal);
                    if spans && (sample - x).abs() < off {
                        doubtful[row] |= 1 << column;
                    }
                }
                for end in 0..2 {
                    if on.cut[end]
                        && (on.q[end].y - y).abs() < tolerance(on.scale[end], on.q[end])
                        && on.q[end].x.abs() < 1.0
                    {
                        doubtful[row] = u16::MAX;
                    }
                }
            }
        }
        let (mut shares, mut all) = (Shares { seen: 0.0, doubt: 0.0 }, 0.0);
        for (row, counts) in counts.iter().enumerate() {
            let weight = self.width(row_height(row));
            for (column, &count) in counts.iter().enumerate() {
                let s = self.off_rows(self.sample(row, column)) * self.half;
                let to = self.occluders.to_light(p) + s.x * self.sides[0] + s.y * self.sides[1];
                let (above, size) = (n.dot(to), to.length());
                let horizon = above.abs() < (g.receiver.normal_error + VERTEX) * size;
                all += weight;
                shares.seen += if count == 0 && above > 0.0 { weight } else { 0.0 };
                shares.doubt += if doubtful[row] >> column & 1 == 1 || horizon { weight } else { 0.0 };
            }
        }
        Some(Shares { seen: shares.seen / all, doubt: shares.doubt / all })
    }
}

fn row_height(row: usize) -> f64 {
    (2.0 * row as f64 + 1.0) / ROWS as f64 - 1.0
}

/// Samples of a light: places in [-1, 1], in units of half its side, and their weights, which sum up to 1.
pub fn samples(disc: bool) -> Vec<(DVec2, f64)> {
    let scene = Scene::of(Occluders::sun(vec![]), [DVec3::X, DVec3::Y], DVec3::NEG_Z, 1.0, disc);
    let weights: Vec<f64> = (0..ROWS).map(|row| scene.width(row_height(row))).collect();
    let all = weights.iter().sum::<f64>() * ROWS as f64;
    let place = |i: usize| (scene.off_rows(scene.sample(i / ROWS, i % ROWS)), weights[i / ROWS] / all);
    (0..ROWS * ROWS).map(place).collect()
}

/// Mirror of `exact_soft.comp` for scenes without masked casters. With `disc`, the light is a disc.
///
/// # Errors
/// Fails if the images do not fit the constants.
pub fn visibility(
    data: &FrameData<'_>,
    camera: &CameraView,
    light: &LightView,
    casters: &[Caster<'_>],
    disc: bool,
) -> Result<Mirror> {
    let view = View::new(data)?;
    let scene = Scene::new(&view, camera, light, casters, disc);
    let far = far_vertices(casters);
    let doubtful = Verdict { visibility: 0.5, doubt: 1.0, rounding: 0.0 };
    Ok(Mirror::collect(view.every_pixel(|pixel| match place(&view, far, pixel) {
        Place::Decided(verdict) => verdict,
        Place::Open(g) => {
            let Layers { least, most } = scene.occluders.layers(&g);
            g.with_doubts(match scene.shares(&g, least) {
                Some(s) if least == most => Verdict { visibility: s.seen, doubt: 0.0, rounding: s.doubt },
                _ => doubtful,
            })
        }
    })))
}

/// An edge in the light's image.
#[derive(Clone, Copy, Debug)]
pub struct GridEdge {
    /// Ends: places in the light's image, and depth (-1/w of a spot light, the map's depth of a sun). The layers lie where
    /// the cross product of `ends[1] - ends[0]` and the vector from `ends[0]` is positive.
    pub ends: [DVec3; 2],
    /// Layers that end here.
    pub weight: i32,
}

/// Returns place and depth of a point of camera view space in the light's grid; `None` if it does not lie beyond the near
/// plane.
fn grid_point(camera: &CameraView, light: &LightView, p: DVec3) -> Option<DVec3> {
    let to_light = light.world_from_view.matrix3.transpose();
    let offset = camera.world_from_view.translation - light.world_from_view.translation;
    let v = to_light * (camera.world_from_view.matrix3 * p + offset);
    layers::grid_point(light, light.clip_from_view * v.extend(1.0))
}

/// Returns an edge that the light's centre sees as a silhouette, in the light's image; `None` for other edges, and those
/// that do not lie entirely beyond the light's near plane.
fn centre_silhouette(scene: &Scene, camera: &CameraView, light: &LightView, e: &Edge) -> Option<GridEdge> {
    let weight = scene.centre_weight(e);
    let [a, b] = if weight < 0 { [e.b, e.a] } else { [e.a, e.b] };
    let [a, b] = [a, b].map(|p| grid_point(camera, light, p));
    (weight != 0).then_some(GridEdge { ends: [a?, b?], weight: weight.abs() })
}

/// Returns the silhouettes of the light's centre that lie entirely beyond the light's near plane.
///
/// # Errors
/// Fails if the images do not fit the constants.
pub fn grid_edges(
    data: &FrameData<'_>,
    camera: &CameraView,
    light: &LightView,
    casters: &[Caster<'_>],
) -> Result<Vec<GridEdge>> {
    let view = View::new(data)?;
    let scene = Scene::new(&view, camera, light, casters, false);
    Ok(scene.edges.iter().filter_map(|e| centre_silhouette(&scene, camera, light, e)).collect())
}

/// Returns for every pixel the silhouettes of the light's centre of which the receiver sees a part on the light, in their
/// entirety: those that pass well within the light, before the receiver and above its plane.
///
/// # Errors
/// Fails if the images do not fit the constants.
pub fn reaching(
    data: &FrameData<'_>,
    camera: &CameraView,
    light: &LightView,
    casters: &[Caster<'_>],
) -> Result<Vec<Vec<GridEdge>>> {
    let view = View::new(data)?;
    let scene = Scene::new(&view, camera, light, casters, false);
    let far = far_vertices(casters);
    Ok(view.every_pixel(|pixel| {
        let Place::Open(g) = place(&view, far, pixel) else { return vec![] };
        let (p, n) = (g.receiver.position, g.receiver.normal);
        let is_seen = |e: &&Edge| {
            let Some(on) = scene.project(e, p, Some(n)) else { return false };
            let [a, b] = on.q;
            // Some point of the segment lies well within the light.
            (0..=64).any(|i| a.lerp(b, f64::from(i) / 64.0).abs().max_element() < 0.9)
        };
        let silhouette = |e: &Edge| centre_silhouette(&scene, camera, light, e);
        scene.edges.iter().filter(is_seen).filter_map(silhouette).collect()
    }))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn triangle(corners: [DVec3; 3]) -> Triangle {
        Triangle { corners, error: 0.0, front: true, shell: false, index: [0, 0] }
    }

    /// A square of two triangles 1 above a receiver at the origin, under a sun of half-width 1.
    fn under(corners: [[f64; 2]; 4], disc: bool) -> f64 {
        let at = |i: usize| DVec3::new(corners[i][0], corners[i][1], 1.0);
        let triangles = vec![triangle([at(0), at(1), at(2)]), triangle([at(0), at(2), at(3)])];
        let inside =
            |p: [f64; 2]| corners[0][0] < p[0] && p[0] < corners[1][0] && corners[0][1] < p[1] && p[1] < corners[2][1];
        let scene = Scene::of(Occluders::sun(triangles), [DVec3::X, DVec3::Y], DVec3::NEG_Z, 1.0, disc);
        let silhouettes = scene.edges.iter().filter(|e| scene.centre_weight(e) != 0).count();
        assert_eq!(silhouettes, 4, "the common side of two triangles is no silhouette");
        let g = GridReceiver::at_origin(DVec3::Z);
        scene.shares(&g, inside([0.0; 2]).into()).unwrap().seen
    }

    #[test]
    fn squares_over_a_receiver_hide_their_share_of_the_light() {
        let wide = 9.0;
        for x in [-0.9, -0.51, -0.13, 0.013, 0.27, 0.77] {
            // A half-plane to the right of x: every row is right within half a column.
            let seen = under([[x, -wide], [wide, -wide], [wide, wide], [x, wide]], false);
            let expected = 0.5 * (x + 1.0);
            assert!((seen - expected).abs() <= 1.0 / 256.0, "{x}: {seen}, expected {expected}");
            let disc = under([[x, -wide], [wide, -wide], [wide, wide], [x, wide]], true);
            let expected = 1.0 - (f64::acos(x) - x * (1.0 - x * x).sqrt()) / std::f64::consts::PI;
            assert!((disc - expected).abs() <= 2.0 / 256.0, "{x}: {disc}, expected {expected}");
            // A square in the light, over and beside its centre.
            let seen = under([[x, -0.5], [x + 0.3, -0.5], [x + 0.3, 0.5], [x, 0.5]], false);
            let expected = 1.0 - 0.25 * 1.0 * ((x + 0.3f64).min(1.0) - x);
            // The discrepancy of the samples is below five.
            assert!((seen - expected).abs() <= 5.0 / 256.0, "{x}: {seen}, expected {expected}");
        }
        assert_eq!(under([[-wide, -wide], [wide, -wide], [wide, wide], [-wide, wide]], false), 0.0);
        assert_eq!(under([[3.0, -wide], [wide, -wide], [wide, wide], [3.0, wide]], false), 1.0);
    }
}
