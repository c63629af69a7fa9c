//! Mirror of `glsl/caster_edges/edge_map.comp` (and of `edge_map.vert` and `edge_map.frag`, which make the same map): by brute
//! force, all edges of every cell.

use super::edge_segments::Segment;
use crate::reference::common::view::DEPTH_ULPS;
use glam::{DVec2, dvec2};
use rayon::prelude::*;

/// What a cell may know of an edge.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Near {
    /// Index of the segment.
    pub segment: u32,
    /// Distance from the cell's centre, texels.
    pub distance: f64,
    /// The same in the maximum norm: an edge enters the square whose half side this is.
    pub square: f64,
    /// How far the edge lies before the farthest depth around the cell: hidden edges, with less than 0, are left out.
    pub before: f64,
}

/// The settings of the pass.
#[derive(Clone, Copy, Debug)]
pub struct Settings {
    /// Texels, along both axes, before an edge at which a cell learns of it.
    pub reach: f64,
    /// Leave out edges that lie behind everything around a cell.
    pub kill: bool,
}

/// Distance within which, and depth within which, single precision may decide the other way.
pub const DISTANCE_DOUBT: f64 = 1e-4;
/// See [`DISTANCE_DOUBT`].
pub const DEPTH_DOUBT: f64 = 2.0 * DEPTH_ULPS;

/// The colour, channels 0 to 1, of a cell whose nearest edge is `segment` at `distance` texels, of `farthest` at most, in
/// `glsl/caster_edges/edge_ids.comp`.
pub fn id_color(segment: u32, distance: f64, farthest: f64) -> [f64; 3] {
    let mut h = segment;
    for (shift, factor) in [(16, 0x7FEB_352Du32), (15, 0x846C_A68B)] {
        h = (h ^ (h >> shift)).wrapping_mul(factor);
    }
    h ^= h >> 16;
    let [r, g, b, _] = h.to_le_bytes().map(|c| 85.0 + f64::from(c));
    let brightness = 1.0 - 0.7 * (distance / farthest).min(1.0);
    [r, g, b].map(|c| brightness * c / r.max(g).max(b))
}

/// Every edge of each cell, nearest to its centre first, row by row, whether or not it has a slot; with those in doubt. `size`
/// in texels.
pub fn near(segments: &[Option<Segment>], map: &[f32], size: [usize; 2], settings: &Settings) -> Vec<Vec<Near>> {
    let [width, height] = size;
    let farthest = |x: usize, y: usize| {
        let mut z = 0.0f64;
        for j in -2i64..=1 {
            for i in -2i64..=1 {
                let (u, v) = (x as i64 + i, y as i64 + j);
                let inside = (0..width as i64).contains(&u) && (0..height as i64).contains(&v);
                z = z.max(if inside { f64::from(map[v as usize * width + u as usize]) } else { 1.0 });
            }
        }
        z
    };
    (0..(width - 1) * (height - 1))
        .into_par_iter()
        .map(|i| {
            let (x, y) = (1 + i % (width - 1), 1 + i / (width - 1));
            let center = dvec2(x as f64, y as f64);
            let deepest = farthest(x, y) + 2.0 * DEPTH_ULPS;
            let mut found: Vec<_> = (0u32..)
                .zip(segments)
                .filter_map(|(segment, s)| {
                    let s = s.as_ref()?;
                    let (distance, square) = (s.distance(center), square_distance(s, center));
                    let before = if settings.kill { deepest - s.depth(s.foot(center)) } else { f64::INFINITY };
                    let kept = square <= 0.5 + settings.reach + DISTANCE_DOUBT && before >= -DEPTH_DOUBT;
                    kept.then_some(Near { segment, distance, square, before })
                })
                .collect();
            found.sort_by(|a, b| a.distance.total_cmp(&b.distance));
            found
        })
        .collect()
}

impl Near {
    /// The cell has the edge, however single precision decides.
    fn is_sure(&self, settings: &Settings) -> bool {
        self.square < 0.5 + settings.reach - DISTANCE_DOUBT && self.before > DEPTH_DOUBT
    }
}

/// Distance of a segment from a point in the maximum norm: it is convex along the segment, and linear but where the point's
/// axes and diagonals are crossed.
fn square_distance(s: &Segment, center: DVec2) -> f64 {
    let (a, d) = (s.ends[0] - center, s.along());
    let breaks = [(a.x, d.x), (a.y, d.y), (a.x - a.y, d.x - d.y), (a.x + a.y, d.x + d.y)];
    let crossings = breaks.into_iter().filter(|b| b.1 != 0.0).map(|(from, by)| (-from / by).clamp(0.0, 1.0));
    crossings.chain([0.0, 1.0]).map(|t| (a + t * d).abs().max_element()).fold(f64::INFINITY, f64::min)
}

/// Whether a cell may hold exactly these edges: every edge that surely enters it is there, none that surely is not.
pub fn agrees(found: &[u32], near: &[Near], settings: &Settings) -> bool {
    near.iter().filter(|n| n.is_sure(settings)).all(|n| found.contains(&n.segment))
        && found.iter().all(|f| near.iter().any(|n| n.segment == *f))
}

/// Whether the slots hold the nearest of them, in order, where distances differ enough to tell.
pub fn is_nearest_first(slots: &[u32], near: &[Near], settings: &Settings) -> bool {
    let distance = |s: &u32| near.iter().find(|n| n.segment == *s).map(|n| n.distance);
    let known: Option<Vec<_>> = slots.iter().map(distance).collect();
    let Some(known) = known else { return false };
    let farthest = known.last().copied().unwrap_or(f64::INFINITY);
    known.windows(2).all(|w| w[0] <= w[1] + DISTANCE_DOUBT)
        && near
            .iter()
            .filter(|n| n.is_sure(settings) && n.distance < farthest - DISTANCE_DOUBT)
            .all(|n| slots.contains(&n.segment))
}
