//! Mirror of `glsl/penumbra/edge_tiles.comp`, `edge_seeds.comp`, `edge_line.comp` and `marked_tiles.comp`: the shadow edges in an
//! image of hard shadows, and the tiles in their reach.

use crate::reference::common::surface::{Apart, CREASE_COSINE, Normal, near_plane, same_depth};
use crate::reference::common::view::{Decision, FrameData, ROUNDING, Receiver, View, octahedral_decode};
use crate::reference::revectorization::rbsm;
use crate::technique::common::surface::SurfaceTest;
use crate::technique::common::tiles::TILE;
use crate::{Error, Result};
use glam::{DVec3, dvec2, dvec3};

/// Largest error of a unit normal stored with 11 bits per octahedral axis. Half a step along both axes moves the
/// vector before normalisation by half a step times the square root of 6, and that vector's length is at least 1 /
/// sqrt(3).
const NORMAL_STEP: f64 = 2.13 / NORMAL_CODES;
const NORMAL_CODES: f64 = 1023.0;

/// Largest error of a line's direction in its plane stored with 10 bits. Half a step moves the vector before
/// normalisation by half a step times the square root of 2, and that vector's length is at least the square root of 1/2.
const DIRECTION_STEP: f64 = 1.0 / DIRECTION_CODES;
const DIRECTION_CODES: f64 = 511.0;

/// Settings of the pass.
#[derive(Clone, Copy, Debug)]
pub struct Settings {
    /// Test that decides whether two pixels lie on one surface.
    pub surfaces: SurfaceTest,
    /// Tolerance of that test: pixels off the plane per pixel of distance, or a fraction of the eye depth.
    pub tolerance: f32,
    /// Counts neighbours on any surface.
    pub any_surface: bool,
    /// Rule that places the edge's points.
    pub points: Points,
}

/// Rule for the point of the shadow edge at a seed.
#[derive(Clone, Copy, Debug)]
pub enum Points {
    /// Centre of the pixel; pixels on both sides of the edge are seeds.
    Pixels,
    /// Midpoint between the pixels.
    Between,
    /// Point between the pixels where the hard shadow ends, with the direction of its edge.
    Traced {
        /// Settings of the hard shadows.
        hard: rbsm::Settings,
        /// Largest number of places on the path from pixel to pixel at which the hard shadow is evaluated.
        steps: u32,
    },
}

impl Points {
    fn at_pixels(self) -> bool {
        matches!(self, Self::Pixels)
    }
}

/// Seed: a pixel next to a shadow edge.
#[derive(Clone, Copy, Debug)]
pub struct Seed {
    /// Pixel coordinates.
    pub pixel: [usize; 2],
    /// Point of the edge in camera view space, world units.
    pub point: DVec3,
    /// Bound on the point's error in single precision, world units.
    pub error: f64,
    /// Largest displacement of the point, in either direction, if a test on the path to it is a tie, world units.
    pub doubt: DVec3,
    /// Unit vector along the edge's line, of either sign; 0 if its direction is not known.
    pub along: DVec3,
    /// Bound on the error of `along`; infinite if the line may have any direction, or none.
    pub along_error: f64,
    /// Unit normal of the surface at the pixel, in camera view space.
    pub normal: DVec3,
    /// Bound on the normal's error from precision and storage.
    pub normal_error: f64,
    /// `false` where a same-surface test lies within the rounding. Then the seed may rightly be missing, or its point
    /// may lie anywhere within `error`.
    pub sure: bool,
}

impl Seed {
    /// Returns the bound on the point's total error, world units.
    pub fn off(&self) -> f64 {
        self.error + self.doubt.length()
    }

    /// Returns the label of the seed's pixel, `x + 65536 y`.
    pub fn label(&self) -> u32 {
        self.pixel[0] as u32 | (self.pixel[1] as u32) << 16
    }
}

/// Returns all seeds, row by row. `hard` is the image of hard shadows: 0 or 1 per pixel.
///
/// # Errors
/// Fails if the images do not fit the constants.
pub fn seeds(data: &FrameData<'_>, hard: &[f32], settings: &Settings) -> Result<Vec<Seed>> {
    let view = View::new(data)?;
    check_hard(&view, hard)?;
    Ok(view.every_pixel(|pixel| seed_at(&view, hard, settings, pixel)).into_iter().flatten().collect())
}

/// Returns the number of tiles of 8 x 8 pixels that `edge_tiles.comp` lists: those with both lit and shadowed pixels
/// in the tile and the ring of pixels around it. Pixels outside the image count as lit.
pub fn mixed_tiles(size: [usize; 2], hard: &[f32]) -> usize {
    let tile = TILE as usize;
    let count = size.map(|n| n.div_ceil(tile));
    let lit = |x: usize, y: usize| {
        // Coordinates are one more than the pixel's, so that -1 can be represented.
        let inside = (1..=size[0]).contains(&x) && (1..=size[1]).contains(&y);
        !inside || hard[(y - 1) * size[0] + x - 1] > 0.5
    };
    let is_mixed = |t: usize| {
        let (x, y) = (t % count[0] * tile, t / count[0] * tile);
        let mut ring = (y..y + tile + 2).flat_map(|y| (x..x + tile + 2).map(move |x| lit(x, y)));
        let first = ring.next();
        ring.any(|l| Some(l) != first)
    };
    (0..count[0] * count[1]).filter(|&t| is_mixed(t)).count()
}

pub(super) fn check_hard(view: &View<'_>, hard: &[f32]) -> Result<()> {
    let wanted = view.size[0] * view.size[1];
    if hard.len() != wanted {
        let problem = format!("mirror: the hard shadows have {} values, but {wanted} are needed", hard.len());
        return Err(Error::Usage(problem));
    }
    if let Some(v) = hard.iter().find(|v| **v != 0.0 && **v != 1.0) {
        return Err(Error::Usage(format!("mirror: a hard shadow is {v}, but must be 0 or 1")));
    }
    Ok(())
}

fn same_surface(view: &View<'_>, s: &Settings, p: &Receiver, q: &Receiver, pixels: f64) -> Decision {
    let tolerance = f64::from(s.tolerance);
    if s.surfaces == SurfaceTest::Depth {
        let error = p.position_error.z + q.position_error.z;
        return same_depth(p.position.z, q.position.z, error, tolerance);
    }
    let vector = q.position - p.position;
    let error = (p.position_error + q.position_error).length() + ROUNDING * vector.length();
    let apart = Apart { vector, error };
    let widths = [p, q].map(|r| view.pixel_width(r.position, r.position_error));
    let width = if widths[0].0 < widths[1].0 { widths[0] } else { widths[1] };
    // Mirror of `isRidge`.
    let turned = p.normal_error + q.normal_error + ROUNDING;
    let sharp = Decision::positive(CREASE_COSINE - p.normal.dot(q.normal), turned);
    let falls = -(p.normal - q.normal).dot(vector);
    let ridge = sharp.and(Decision::positive(falls, 2.0 * error + turned * vector.length()));
    [p, q]
        .map(|r| near_plane((r.normal, r.normal_error), &apart, pixels, width, tolerance))
        .into_iter()
        .fold(ridge.opposite(), Decision::and)
}

fn seed_at(view: &View<'_>, hard: &[f32], s: &Settings, pixel: [usize; 2]) -> Option<Seed> {
    let own = hard[view.index(pixel)];
    // The points of both sides coincide, so lit pixels alone are enough.
    if own < 0.5 && !s.points.at_pixels() {
        return None;
    }
    let p = view.receiver(pixel)?;
    // Neighbours whose visibility differs: the vector to each, and whether it counts.
    let mut pairs: Vec<(Apart, Decision)> = vec![];
    let mut other_error = DVec3::ZERO;
    for y in pixel[1].saturating_sub(1)..(pixel[1] + 2).min(view.size[1]) {
        for x in pixel[0].saturating_sub(1)..(pixel[0] + 2).min(view.size[0]) {
            let steps = x.abs_diff(pixel[0]) + y.abs_diff(pixel[1]);
            // Between pixels, diagonal neighbours do not count.
            if hard[view.index([x, y])] == own || (steps == 2 && !s.points.at_pixels()) {
                continue;
            }
            let Some(q) = view.receiver([x, y]) else { continue };
            let pixels = (steps as f64).sqrt();
            let counts = if s.any_surface { Decision::Yes } else { same_surface(view, s, &p, &q, pixels) };
            if counts != Decision::No {
                let vector = q.position - p.position;
                other_error = other_error.max(q.position_error);
                pairs.push((Apart { vector, error: q.position_error.length() }, counts));
            }
        }
    }
    if pairs.is_empty() {
        return None;
    }
    let sure = pairs.iter().all(|pair| pair.1 == Decision::Yes);
    let farthest = pairs.iter().map(|pair| pair.0.vector.length()).fold(0.0, f64::max);
    let mut error = p.position_error.length() + ROUNDING * p.position.length();
    let (mut point, mut doubt) = (p.position, DVec3::ZERO);
    let (mut along, mut along_error) = (DVec3::ZERO, 0.0);
    if !s.points.at_pixels() {
        let taken: Vec<_> = pairs.iter().filter(|pair| pair.1.is_yes()).collect();
        let sum: DVec3 = taken.iter().map(|pair| pair.0.vector).sum();
        point += 0.5 / taken.len().max(1) as f64 * sum;
        error += pairs.iter().map(|pair| pair.0.error).fold(0.0, f64::max) + ROUNDING * farthest;
        // Whichever neighbours count, the point lies within half the distance of the farthest one.
        error += if sure { 0.0 } else { farthest };
        if let Points::Traced { hard, steps } = s.points {
            let path = Path { view, p: &p, across: 2.0 * (point - p.position), error: other_error };
            let found = path.trace(&hard, steps);
            point = p.position + found.share * path.across;
            doubt = found.doubt * path.across;
            error += found.error * path.across.length();
            (along, along_error) = (found.along, if sure { found.along_error } else { f64::INFINITY });
        }
    }
    // At the pixel's centre, it only matters whether any neighbour counts.
    let sure = sure || (s.points.at_pixels() && pairs.iter().any(|pair| pair.1 == Decision::Yes));
    error += stored_point_error(view, point, matches!(s.points, Points::Traced { .. }));
    let normal = stored_normal((p.normal, p.normal_error));
    let (along, along_error) = stored_direction((along, along_error), normal);
    Some(Seed { pixel, point, error, doubt, along, along_error, normal: normal.0, normal_error: normal.1, sure })
}

/// Bound of the error of a point that is stored as its offset from the pixel, in 2 x 16 bits, and its depth. Where the
/// point is traced, the other end of the path is stored before, twice as far away.
fn stored_point_error(view: &View<'_>, point: DVec3, traced: bool) -> f64 {
    let pixel = view.pixel_width(point, DVec3::ZERO).0;
    let once = 4.0 * ROUNDING * point.length() + 2.0 * pixel / 32767.0;
    if traced { 3.0 * once } else { once }
}

/// Rounds a code to a whole number; `None` if its error may change the result.
fn rounded(code: f64, error: f64) -> Option<f64> {
    let nearest = code.round();
    ((code - nearest).abs() + error < 0.5).then_some(nearest)
}

/// Mirror of `packSeed` and `seedNormal` of `glsl/penumbra/seed_format.glsl`: the normal as a seed holds it, and its error.
fn stored_normal((normal, error): Normal) -> Normal {
    // The encoding of vectors towards the viewer; few normals are others.
    let e = normal.truncate() / normal.abs().element_sum();
    // The sum of a unit vector's components is at least 1.
    let off = NORMAL_CODES * (3.0 * error + 2.0 * ROUNDING);
    match [e.x, e.y].map(|x| rounded(NORMAL_CODES * x, off)) {
        [Some(x), Some(y)] if normal.z > error => (octahedral_decode(dvec2(x, y) / NORMAL_CODES), ROUNDING),
        _ => (normal, error + NORMAL_STEP),
    }
}

/// Mirror of `packSeed` and `unpackSeed`: a line's direction as a seed with this normal holds it, and its error.
fn stored_direction((along, error): (DVec3, f64), (normal, normal_error): Normal) -> (DVec3, f64) {
    if along == DVec3::ZERO || !error.is_finite() {
        return (along, error);
    }
    let inexact = (along, error + DIRECTION_STEP + NORMAL_STEP);
    if normal_error >= NORMAL_STEP {
        return inexact;
    }
    let (t, b) = tangents(normal);
    let d = dvec2(along.dot(t), along.dot(b));
    let sum = d.x.abs() + d.y.abs();
    let code = DIRECTION_CODES * if d.y < 0.0 { -d.x } else { d.x } / sum;
    let Some(code) = rounded(code, DIRECTION_CODES * (2.0 * error + 4.0 * ROUNDING) / sum) else { return inexact };
    let x = code / DIRECTION_CODES;
    let d = dvec2(x, 1.0 - x.abs()).normalize();
    (d.x * t + d.y * b, 4.0 * ROUNDING)
}

/// Mirror of `tangents`.
fn tangents(n: DVec3) -> (DVec3, DVec3) {
    let s = if n.z < 0.0 { -1.0 } else { 1.0 };
    let a = -1.0 / (s + n.z);
    let c = n.x * n.y * a;
    (dvec3(1.0 + s * n.x * n.x * a, s * c, -s * n.x), dvec3(c, s + n.y * n.y * a, -n.y))
}

/// Path from a lit pixel to the middle of its neighbours in shadow.
struct Path<'a> {
    view: &'a View<'a>,
    p: &'a Receiver,
    across: DVec3,
    /// Bound of the other end's error.
    error: DVec3,
}

/// Place on a path where the hard shadow ends.
struct Traced {
    /// Share of the path, and bound of its error.
    share: f64,
    error: f64,
    /// Share of the path by which other decisions about tests may move the place to either side.
    doubt: f64,
    along: DVec3,
    along_error: f64,
}

/// Crossing of a path and an edge that the hard shadow has in a texel.
#[derive(Clone, Copy)]
struct Crossing {
    /// Share of the path.
    root: f64,
    error: f64,
    /// Vector along the edge on the pixel's plane, not of unit length.
    along: DVec3,
    /// Bound of its error in single precision, as a share of its length.
    along_error: f64,
}

impl Path<'_> {
    /// Mirror of `workOn` of `glsl/penumbra/edge_line.comp`.
    fn trace(&self, hard: &rbsm::Settings, steps: u32) -> Traced {
        let (mut lit, mut dark, mut doubt) = (0.0, 1.0, 0.0f64);
        for _ in 0..steps {
            let middle = 0.5 * (lit + dark);
            let (visibility, crossing, sure) = self.at(middle, hard);
            if !sure {
                doubt = doubt.max(dark - lit);
            }
            if let Some(c) = crossing {
                if (c.root - lit).min(dark - c.root).abs() <= c.error {
                    doubt = doubt.max(dark - lit);
                }
                if lit < c.root && c.root < dark {
                    let along_error = if doubt > 0.0 { f64::INFINITY } else { c.along_error };
                    return Traced {
                        share: c.root,
                        error: c.error,
                        doubt,
                        along: c.along.normalize_or_zero(),
                        along_error,
                    };
                }
            }
            *if visibility > 0.5 { &mut lit } else { &mut dark } = middle;
        }
        let share = if dark < 1.0 { 0.5 * (lit + dark) } else { 0.5 };
        let along_error = if doubt > 0.0 { f64::INFINITY } else { 0.0 };
        Traced { share, error: 0.0, doubt, along: DVec3::ZERO, along_error }
    }

    /// Returns the hard shadow at a share of the path, its crossing with the edge in the texel there, and whether both
    /// are sure.
    fn at(&self, share: f64, hard: &rbsm::Settings) -> (f64, Option<Crossing>, bool) {
        let position = self.p.position + share * self.across;
        let position_error = self.p.position_error.lerp(self.error, share) + ROUNDING * position.abs();
        let r = Receiver { position, position_error, ..*self.p };
        let found = rbsm::edge_at(self.view, &r, hard);
        let light = self.view.light_point(position, position_error);
        let crossing = |edge: &rbsm::EdgeAt| {
            let [u, v] = self.view.map_gradients(&light);
            let scale = edge.gradient * self.view.map_extent();
            let slope = scale.x * u + scale.y * v;
            let rate = slope.dot(self.across);
            // Two gradients are subtracted in single precision.
            let rounding = 8.0 * ROUNDING * (1.0 + (2.0 * light.uv - 1.0).abs().max_element());
            let slope_error = rounding * (scale.x.abs() * u.length() + scale.y.abs() * v.length()).max(slope.length());
            let rate_error = slope_error * self.across.length();
            let offset = edge.value / rate;
            let error = (edge.error + offset.abs() * rate_error) / (rate.abs() - rate_error).max(0.0) + ROUNDING;
            let along = self.p.normal.cross(slope);
            let turned = (slope_error + self.p.normal_error * slope.length()) / along.length();
            Crossing { root: share - offset, error, along, along_error: 2.0 * turned }
        };
        let crossings: Vec<_> = found.edges.iter().map(|e| e.as_ref().map(crossing)).collect();
        let first = crossings.first().copied().flatten();
        // Neighbouring texels have the same line, unless the edge ends between them.
        let same = |other: &Option<Crossing>| match (first, other) {
            (None, None) => true,
            (Some(a), Some(b)) => {
                let apart = (a.along.normalize_or_zero().cross(b.along.normalize_or_zero())).length();
                (a.root - b.root).abs() <= a.error + b.error && apart <= a.along_error + b.along_error
            }
            _ => false,
        };
        (found.visibility, first, found.sure && crossings.iter().all(same))
    }
}
