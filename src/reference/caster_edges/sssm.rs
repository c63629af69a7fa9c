//! Mirror of `glsl/caster_edges/sssm.comp`, `sssm_points.comp`, `sssm_cell.glsl` and `sssm_quadrant.glsl`: shadow silhouette maps.

use super::edge_segments::{PLACE_ERROR, Segment};
use crate::Result;
use crate::reference::common::map_receiver::{MapReceiver, receive};
use crate::reference::common::rbsm_receiver::{ReceiverSettings, Tests};
use crate::reference::common::view::{Decision, FrameData, Mirror, Verdict, View};
use glam::{DVec2, dvec2};

/// Value of a cell without an edge: the cell's middle.
pub const MIDDLE: u32 = 0x8000_8000;
/// Smallest distance of a point from its cell's border, texels.
const MARGIN: f64 = 1.0 / 64.0;

/// Returns the position in the cell, 0 to 1 per axis, that a value with 16 bits per axis encodes.
pub fn unpack(value: u32) -> DVec2 {
    dvec2(f64::from(value & 0xFFFF), f64::from(value >> 16)) / 65535.0
}

/// An edge that a cell may keep.
#[derive(Clone, Copy, Debug)]
pub struct Candidate {
    /// Point that represents the edge, in the cell, 0 to 1 per axis.
    pub point: DVec2,
    /// Smallest and largest key that single precision may compute.
    keys: [u32; 2],
    /// `true` if neither rounding nor the hidden-edge test can change whether the edge counts.
    sure: bool,
}

/// Returns the edge's entry for a cell; `None` if the edge surely misses it.
fn candidate(e: &Segment, cell: [i64; 2], hidden: &dyn Fn(DVec2, f64) -> Decision) -> Option<Candidate> {
    let corner = dvec2(cell[0] as f64, cell[1] as f64) + 0.5;
    let (a, b) = (e.ends[0] - corner, e.ends[1] - corner);
    let along = b - a;
    let (mut t0, mut t1) = (0.0f64, 1.0f64);
    for i in 0..2 {
        if along[i] == 0.0 {
            if !(-PLACE_ERROR..1.0 + PLACE_ERROR).contains(&a[i]) {
                return None;
            }
        } else {
            let (u, v) = (-a[i] / along[i], (1.0 - a[i]) / along[i]);
            (t0, t1) = (t0.max(u.min(v)), t1.min(u.max(v)));
        }
    }
    let way = (t1 - t0) * along.length();
    if way < -PLACE_ERROR {
        return None;
    }
    // Distance of a vertex from the cell's border, positive inside.
    let depth_in = |p: DVec2| p.min_element().min(1.0 - p.max_element());
    let [in_a, in_b] = [0, 1].map(|i| if e.own[i] { depth_in([a, b][i]) } else { -1.0 });
    let doubtful = in_a.abs().min(in_b.abs()) < PLACE_ERROR;
    let t = match (in_a >= 0.0, in_b >= 0.0) {
        (true, true) => 0.5,
        (false, false) => 0.5 * (t0 + t1),
        (true, false) => 0.0,
        (false, true) => 1.0,
    };
    let point = (a + t * along).clamp(DVec2::splat(MARGIN), DVec2::splat(1.0 - MARGIN));
    let is_hidden = hidden(corner + point, e.depth(t));
    if is_hidden == Decision::Yes {
        return None;
    }
    let key = |error: f64| {
        let order = ((1.0 - (way + error) * std::f64::consts::FRAC_1_SQRT_2).clamp(0.0, 1.0) * 2047.0) as u32;
        let depth = ((e.depth(t) - error * 1e-2).clamp(0.0, 1.0) * 4095.0) as u32;
        let is_vertex = in_a.max(in_b) >= -error;
        u32::from(!is_vertex) << 23 | order << 12 | depth
    };
    Some(Candidate {
        point,
        keys: [key(PLACE_ERROR), key(-PLACE_ERROR)],
        sure: way > PLACE_ERROR && !doubtful && is_hidden == Decision::No,
    })
}

/// Returns, for each cell of a map, every edge that the cell may keep.
pub fn candidates(edges: &[Segment], map_size: [u32; 2], shadow_map: &[f32], kill: bool) -> Vec<Vec<Candidate>> {
    let [w, h] = map_size.map(i64::from);
    let mut cells = vec![vec![]; (w * h) as usize];
    for e in edges {
        let hidden = |p: DVec2, z: f64| if kill { e.is_hidden(shadow_map, map_size, p, z) } else { Decision::No };
        let low = e.ends[0].min(e.ends[1]) - 0.5 - PLACE_ERROR;
        let high = e.ends[0].max(e.ends[1]) - 0.5 + PLACE_ERROR;
        let slope = e.along();
        for y in (low.y.floor() as i64).max(0)..(high.y.floor() as i64 + 1).min(h) {
            // A flat edge may enter all columns; a steep one enters those that it passes in this row.
            let at = |v: f64| e.ends[0].x - 0.5 + (v + 0.5 - e.ends[0].y) / slope.y * slope.x;
            let (mut from, mut to) = (low.x, high.x);
            if slope.y.abs() > 1e-9 {
                let (p, q) = (at(y as f64 - PLACE_ERROR), at(y as f64 + 1.0 + PLACE_ERROR));
                (from, to) = (from.max(p.min(q) - 1.0), to.min(p.max(q) + 1.0));
            }
            for x in (from.floor() as i64).max(0)..(to.floor() as i64 + 1).min(w) {
                cells[(y * w + x) as usize].extend(candidate(e, [x, y], &hidden));
            }
        }
    }
    cells
}

/// Returns whether a cell may hold `value`.
pub fn explains(candidates: &[Candidate], value: u32) -> bool {
    let best = candidates.iter().filter(|c| c.sure).map(|c| c.keys[1]).min();
    if value == MIDDLE && best.is_none() {
        return true;
    }
    let near = |c: &Candidate| {
        // If the vertex is in doubt, the point may be any other on the same edge.
        let off = (c.point - unpack(value)).abs().max_element();
        !c.sure || off < 2.0 * PLACE_ERROR
    };
    candidates.iter().any(|c| c.keys[0] <= best.unwrap_or(u32::MAX) && near(c))
}

fn cross(a: DVec2, b: DVec2) -> f64 {
    a.perp_dot(b)
}

/// Returns the corner, 0 to 3 as in `shadowTest2x2`, of the quadrant that contains `q`.
fn quadrant(q: DVec2, own: DVec2, neighbours: [DVec2; 4]) -> usize {
    const CORNERS: [usize; 4] = [0, 1, 3, 2];
    let away = q - own;
    let mut hits = vec![];
    let mut likely = (0, -2.0);
    for i in 0..4 {
        let (x, y) = (neighbours[i] - own, neighbours[(i + 1) % 4] - own);
        let turn = cross(x, y);
        let (after, before) = (cross(x, away) >= 0.0, cross(away, y) > 0.0);
        if if turn > 0.0 { after && before } else { after || before } {
            hits.push(i);
        }
        let middle = x.normalize() + y.normalize();
        let towards = if middle == DVec2::ZERO {
            -1.0
        } else {
            middle.normalize().dot(away) * if turn > 0.0 { 1.0 } else { -1.0 }
        };
        if towards > likely.1 {
            likely = (i, towards);
        }
    }
    CORNERS[if let [one] = hits[..] { one } else { likely.0 }]
}

/// Computes the visibility of every pixel from the GPU's own map of points.
///
/// # Errors
/// Fails if the images do not fit the constants.
pub fn visibility(data: &FrameData<'_>, settings: &ReceiverSettings, points: &[u32]) -> Result<Mirror> {
    let view = View::new(data)?;
    let [w, h] = view.map_size.map(|n| n as i64);
    let point = |[x, y]: [i64; 2]| {
        let inside = (0..w).contains(&x) && (0..h).contains(&y);
        if inside { unpack(points[(y * w + x) as usize]) } else { DVec2::splat(0.5) }
    };
    let look_up = |place: DVec2, lit: &dyn Fn([i64; 2]) -> bool| {
        let first = (place - 0.5).floor();
        let (cell, q) = ([first.x as i64, first.y as i64], place - 0.5 - first);
        let tests: [bool; 4] = std::array::from_fn(|i| lit([cell[0] + (i as i64 & 1), cell[1] + (i as i64 >> 1)]));
        let all = tests.iter().all(|t| *t == tests[0]);
        let neighbour = |[x, y]: [i64; 2]| dvec2(x as f64, y as f64) + point([cell[0] + x, cell[1] + y]);
        let corner = if all { 0 } else { quadrant(q, point(cell), [[-1, 0], [0, -1], [1, 0], [0, 1]].map(neighbour)) };
        f64::from(u8::from(tests[corner]))
    };
    Ok(Mirror::collect(view.every_pixel(|p| match receive(&view, p, settings.normal_offset, settings.depth_bias) {
        MapReceiver::Decided(verdict) => verdict,
        MapReceiver::Open(r) => r.with_doubts(displaced(&Tests::new(&view, &r, settings), &look_up)),
    })))
}

/// Visibility of a position in the map, texels, from the shadow tests of its texels.
pub(super) type LookUp<'a> = dyn Fn(DVec2, &dyn Fn([i64; 2]) -> bool) -> f64 + 'a;

/// Looks up a position. The verdict includes what slightly displaced positions and tests in doubt may change.
pub(super) fn displaced(tests: &Tests<'_>, look_up: &LookUp<'_>) -> Verdict {
    let error = tests.place_error + 1e-6 * (1.0 + 1e-2 * tests.place.abs());
    let mut found: Option<Verdict> = None;
    for [i, j] in [[0, 0], [-1, 0], [1, 0], [0, -1], [0, 1], [-1, -1], [1, -1], [-1, 1], [1, 1]] {
        let place = tests.place + error * dvec2(f64::from(i), f64::from(j));
        let texel = [place.x.floor() as i64, place.y.floor() as i64];
        let (visibility, doubt) = tests.ask(texel, |v: &f64| *v, |lit| look_up(place, lit));
        let verdict = Verdict { doubt, ..Verdict::sure(visibility) };
        found = Some(found.map_or(verdict, |first| first.or_verdict(verdict)));
    }
    // The loop visits at least the position itself.
    found.unwrap_or(Verdict::sure(1.0))
}

#[cfg(test)]
mod tests {
    use super::*;

    const CROSS: [DVec2; 4] = [dvec2(-0.5, 0.5), dvec2(0.5, -0.5), dvec2(1.5, 0.5), dvec2(0.5, 1.5)];

    #[test]
    fn quadrants_hold_one_corner_each() {
        let own = DVec2::splat(0.5);
        for (q, corner) in [((0.2, 0.2), 0), ((0.8, 0.3), 1), ((0.1, 0.9), 2), ((0.7, 0.7), 3)] {
            assert_eq!(quadrant(dvec2(q.0, q.1), own, CROSS), corner, "{q:?}");
        }
        // A quadrant wider than half a turn, around the lower right corner.
        let bent = [dvec2(-0.5, 0.1), dvec2(0.2, -0.5), dvec2(1.2, -0.2 + 0.3), dvec2(0.1, 1.4)];
        assert_eq!(quadrant(dvec2(0.9, 0.9), dvec2(0.2, 0.3), bent), 3);
        // Points out of order, and a position on the point itself, still give an answer.
        let swapped = [dvec2(-0.02, 0.02), dvec2(0.02, -0.02), CROSS[2], CROSS[3]];
        assert!(quadrant(dvec2(0.5, 0.5), dvec2(0.9, 0.9), swapped) < 4);
        assert!(quadrant(own, own, CROSS) < 4);
    }

    #[test]
    fn straight_edges_are_exact() {
        // A line through many cells: every position is on the side that the line says.
        let (n, mut seen) = (16u32, 0);
        for k in 0..32 {
            let (s, c) = (f64::from(k) * std::f64::consts::TAU / 32.0 + 0.013).sin_cos();
            let middle = dvec2(8.03, 7.9);
            let along = 20.0 * dvec2(c, s);
            let edge =
                Segment { ends: [middle - along, middle + along], depths: [0.3; 2], own: [false; 2], third: None };
            let cells = candidates(&[edge], [n, n], &[1.0; 256], true);
            let point = |x: i64, y: i64| cells[(y * 16 + x) as usize].first().map_or(DVec2::splat(0.5), |c| c.point);
            let inside = |p: DVec2| edge.along().perp_dot(p - edge.ends[0]) > 0.0;
            for y in 2..13 {
                for x in 2..13 {
                    for i in 0..64 {
                        let q = dvec2(f64::from(i % 8) + 0.5, f64::from(i / 8) + 0.5) / 8.0;
                        let place = dvec2(x as f64, y as f64) + 0.5 + q;
                        let neighbours = [[-1, 0], [0, -1], [1, 0], [0, 1]]
                            .map(|[i, j]: [i64; 2]| dvec2(i as f64, j as f64) + point(x + i, y + j));
                        let corner = quadrant(q, point(x, y), neighbours);
                        let corner = dvec2((x + corner as i64 % 2) as f64, (y + corner as i64 / 2) as f64) + 0.5;
                        let corners: Vec<bool> =
                            (0..4).map(|i| inside(dvec2((x + i % 2) as f64, (y + i / 2) as f64) + 0.5)).collect();
                        if corners.iter().any(|c| *c != corners[0]) && !cells[(y * 16 + x) as usize].is_empty() {
                            // Within the margin of a cell's border, a point is moved off the edge.
                            let off = edge.along().normalize().perp_dot(place - edge.ends[0]).abs();
                            if off > 0.03 {
                                assert_eq!(inside(place), inside(corner), "{k}: {place}");
                                seen += 1;
                            }
                        }
                    }
                }
            }
        }
        assert!(seen > 10_000, "{seen}");
    }
}
