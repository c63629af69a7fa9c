//! Mirror of `glsl/caster_edges/edge_map.comp`, and of `edge_map.vert` and `edge_map.frag`, which make the same map.
//! It finds all edges of every cell by brute force.

use super::edge_segments::Segment;
use crate::reference::common::view::DEPTH_ULPS;
use glam::{DVec2, dvec2};
use rayon::prelude::*;

/// An edge that a cell may list.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Near {
    /// Index of the segment.
    pub segment: u32,
    /// Distance from the cell's centre, texels.
    pub distance: f64,
    /// Distance in the maximum norm, texels: the edge enters the square around the centre with this half side.
    pub square: f64,
    /// Depth by which the edge lies in front of the farthest texel around the cell. Hidden edges, with less than 0,
    /// are left out.
    pub before: f64,
}

/// Settings of the pass.
#[derive(Clone, Copy, Debug)]
pub struct Settings {
    /// Distance from a cell's border along each axis, texels, up to which the cell lists edges.
    pub reach: f64,
    /// Leaves out edges that lie behind everything around a cell.
    pub kill: bool,
}

/// Margin, texels, within which single precision may decide a distance the other way.
pub const DISTANCE_DOUBT: f64 = 1e-4;
/// Margin in depth within which single precision may decide the other way.
pub const DEPTH_DOUBT: f64 = 2.0 * DEPTH_ULPS;

/// Returns the colour, channels 0 to 1, that `glsl/caster_edges/edge_ids.comp` gives a cell. The cell's nearest edge
/// is `segment` at `distance` texels; `farthest` is the largest distance shown.
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

/// Returns every edge of each cell, nearest to the cell's centre first, with no limit of slots. Cells are listed row
/// by row. Edges in doubt are included. `size` is in texels.
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
    /// Returns whether the cell must list the edge, however single precision decides.
    fn is_sure(&self, settings: &Settings) -> bool {
        self.square < 0.5 + settings.reach - DISTANCE_DOUBT && self.before > DEPTH_DOUBT
    }
}

/// Returns the distance of a segment from a point in the maximum norm. The distance is convex along the segment, and
/// linear except where the segment crosses the point's axes and diagonals.
fn square_distance(s: &Segment, center: DVec2) -> f64 {
    let (a, d) = (s.ends[0] - center, s.along());
    let breaks = [(a.x, d.x), (a.y, d.y), (a.x - a.y, d.x - d.y), (a.x + a.y, d.x + d.y)];
    let crossings = breaks.into_iter().filter(|b| b.1 != 0.0).map(|(from, by)| (-from / by).clamp(0.0, 1.0));
    crossings.chain([0.0, 1.0]).map(|t| (a + t * d).abs().max_element()).fold(f64::INFINITY, f64::min)
}

/// Returns whether a cell may hold exactly these edges: all that surely enter it are present, and none that surely do
/// not.
pub fn agrees(found: &[u32], near: &[Near], settings: &Settings) -> bool {
    near.iter().filter(|n| n.is_sure(settings)).all(|n| found.contains(&n.segment))
        && found.iter().all(|f| near.iter().any(|n| n.segment == *f))
}

/// Returns whether the slots hold the cell's nearest edges in order, as far as the distances differ enough to tell.
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
