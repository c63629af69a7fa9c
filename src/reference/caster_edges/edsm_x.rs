//! Mirror of `glsl/caster_edges/edsm_x.comp` and of its rule, `edge_rule.glsl`. It takes the edges that the GPU's own
//! map lists.
//!
//! A crossing has no margin of its own. So each pixel is evaluated at its point and at points around it, as far away
//! as single precision may have moved it. The pixel is in doubt if any of them decides otherwise.

use super::edge_segments::Segment;
use super::edsm::border;
use crate::Result;
use crate::reference::common::map_receiver::{MapReceiver, OpenReceiver, receive};
use crate::reference::common::view::{DEPTH_ULPS, FrameData, Mirror, ROUNDING, Verdict, View};
use crate::technique::caster_edges::edsm::BorderKernel;
use glam::{DVec2, dvec2};

/// Settings of the technique.
#[derive(Clone, Copy, Debug)]
pub struct Settings {
    /// Consults the edges only where the four anchors (the surrounding texels) disagree.
    pub mixed_only: bool,
    /// Tolerance within which an edge lies on the receiver, as a fraction of the depth slope per texel.
    pub edge_bias: f32,
    /// Depth bias at an anchor, as a fraction of the depth slope per texel.
    pub depth_bias: f32,
    /// Distance by which a curved receiver may lie in front of its plane, in texel sizes of depth per texel of
    /// distance.
    pub slack: f32,
    /// Width of soft borders, texels.
    pub border: f32,
    /// Profile of soft borders.
    pub kernel: BorderKernel,
}

/// `SNAPPED` of `edge_rule.glsl`.
const SNAPPED: f64 = 1.0 / 128.0;
/// `BEYOND` of `edge_rule.glsl`.
const BEYOND: f64 = 0.75;
/// `FOLLOWED` of `edge_rule.glsl`.
const FOLLOWED: f64 = 32.0;

/// Distance from a line, texels, within which single precision may find the other side.
const LINE_DOUBT: f64 = 1e-3;
/// `STEEPEST` of `edsm_x.comp`.
const STEEPEST: f64 = 4.0;

/// Edges of every cell as the map lists them: slots and chain.
pub struct EdgeMap<'a> {
    /// All segments, by the indices in `cells`.
    pub segments: &'a [Option<Segment>],
    /// Indices of each cell's segments, row by row.
    pub cells: &'a [Vec<u32>],
}

struct Point {
    texels: DVec2,
    depth: f64,
    plane: DVec2,
    tolerance: f64,
    bias: f64,
    slack: f64,
    steepest: f64,
    /// Distance from an edge's line, texels, above which the point lies on the occluder's side.
    inside_from: f64,
}

impl Point {
    fn plane_depth(&self, at: DVec2) -> f64 {
        self.depth + self.plane.dot(at - self.texels)
    }

    fn reference_depth(&self, at: DVec2) -> f64 {
        self.plane_depth(at) - self.bias - self.slack * at.distance(self.texels)
    }
}

/// Computes the visibility of every pixel.
///
/// # Errors
/// Fails if the images do not fit the constants.
pub fn visibility(data: &FrameData<'_>, map: &EdgeMap<'_>, settings: &Settings) -> Result<Mirror> {
    let view = View::new(data)?;
    Ok(Mirror::collect(view.every_pixel(|p| match receive(&view, p, 0.0, 0.0) {
        MapReceiver::Decided(verdict) => verdict,
        MapReceiver::Open(open) => open.with_doubts(pixel(&view, map, &open, settings)),
    })))
}

fn pixel(view: &View<'_>, map: &EdgeMap<'_>, open: &OpenReceiver, settings: &Settings) -> Verdict {
    let size = view.map_extent();
    let (uv, plane) = (open.light.uv * size, open.plane.slope / size);
    let slope = plane.abs().element_sum();
    let at = |offset: DVec2, depth_offset: f64, widened: f64, inside_from: f64| Point {
        texels: uv + offset,
        depth: open.light.depth - open.bias + depth_offset,
        plane,
        tolerance: DEPTH_ULPS + f64::from(settings.edge_bias) * slope + widened,
        bias: DEPTH_ULPS + f64::from(settings.depth_bias) * slope,
        slack: f64::from(settings.slack) * open.texel_depth,
        steepest: STEEPEST * open.texel_depth,
        inside_from,
    };
    // The map's edges are rounded to single precision too.
    let off = open.light.uv_error * size + 2.0 * ROUNDING * uv.abs() + 2.0 * f64::from(f32::EPSILON) * size;
    let rounded =
        4.0 * ROUNDING * (slope * f64::from(settings.depth_bias + 1.0) + f64::from(settings.slack) * open.texel_depth);
    let deep = 2.0 * open.light.depth_error + (open.plane.error / size).element_sum() + DEPTH_ULPS * 0.25 + rounded;
    let found = look_up(view, map, &at(DVec2::ZERO, 0.0, 0.0, 0.0), settings);
    let mut verdict = Verdict::sure(found);
    let shifts = (0..9).map(|i| dvec2(f64::from(i % 3 - 1), f64::from(i / 3 - 1)) * off);
    for shift in shifts {
        for (depth, widened) in [(0.0, 0.0), (deep, 0.0), (-deep, 0.0), (0.0, deep), (0.0, -deep)] {
            verdict = differing(verdict, look_up(view, map, &at(shift, depth, widened, 0.0), settings), settings);
        }
    }
    // The ends of an edge that is a thousandth of a texel long are rounded, so its line is known only to this
    // distance.
    for inside_from in [LINE_DOUBT, -LINE_DOUBT] {
        verdict = differing(verdict, look_up(view, map, &at(DVec2::ZERO, 0.0, 0.0, inside_from), settings), settings);
    }
    verdict
}

fn differing(verdict: Verdict, other: f64, settings: &Settings) -> Verdict {
    let gap = (verdict.visibility - other).abs();
    if gap == 0.0 {
        return verdict;
    }
    // A soft border's visibility varies continuously: a small difference is rounding.
    if settings.border > 0.0 && gap < 1e-3 {
        return Verdict { rounding: verdict.rounding.max(gap), ..verdict };
    }
    verdict.or(other)
}

/// Returns whether the shadow of an edge, seen from a point on its inner side, ends there: beyond the nearest point of
/// the edge the map sees the receiver.
fn lit_beyond(view: &View<'_>, e: &Segment, p: &Point) -> bool {
    let place = e.at(e.foot(p.texels));
    let outwards = if p.texels.distance(place) > 1e-3 { place - p.texels } else { -e.along().perp() };
    let t = (place + BEYOND * outwards.normalize()).floor();
    let texel = [t.x as i64, t.y as i64];
    let outside = (0..2).any(|i| !(0..view.map_size[i] as i64).contains(&texel[i]));
    outside || p.reference_depth(t + 0.5).min(1.0) <= view.stored(texel)
}

fn look_up(view: &View<'_>, map: &EdgeMap<'_>, p: &Point, settings: &Settings) -> f64 {
    let size = view.map_size.map(|n| n as i64);
    let first = [(p.texels.x - 0.5).floor() as i64, (p.texels.y - 0.5).floor() as i64];
    let texel = |k: usize| [first[0] + (k & 1) as i64, first[1] + (k >> 1) as i64];
    let center = |k: usize| dvec2(texel(k)[0] as f64 + 0.5, texel(k)[1] as f64 + 0.5);
    let usable: [bool; 4] = std::array::from_fn(|k| (0..2).all(|i| (0..size[i]).contains(&texel(k)[i])));
    let lit: [bool; 4] =
        std::array::from_fn(|k| !usable[k] || p.reference_depth(center(k)).min(1.0) <= view.stored(texel(k)));
    let sure: [bool; 4] = std::array::from_fn(|k| {
        !lit[k] || !usable[k] || (p.plane_depth(center(k)) - p.tolerance).min(1.0) <= view.stored(texel(k))
    });
    // There is no cell within half a texel of the map's rim.
    let is_cell = (0..2).all(|i| (0..size[i] - 1).contains(&first[i]));
    let cell = is_cell.then(|| &map.cells[(first[1] * (size[0] - 1) + first[0]) as usize]);
    let edges: Vec<&Segment> = cell.into_iter().flatten().filter_map(|&s| map.segments[s as usize].as_ref()).collect();
    let unanimous = lit.iter().all(|l| *l == lit[0]);
    if unanimous && (settings.mixed_only || edges.is_empty()) {
        return if lit[0] { 1.0 } else { 0.0 };
    }

    let (mut open, mut likely) = (usable, usable);
    let mut first_crossing = [2.0f64; 4];
    let (mut from_inside, mut under_first, mut settled, mut layers) = ([false; 4], [false; 4], usable, [0i32; 4]);
    let (mut nearest, mut nearest_line, mut under_nearest, mut covered) = (f64::INFINITY, 0.0f64, false, false);
    let mut of_side = [f64::INFINITY; 2];
    for e in edges {
        let foot = e.foot(p.texels);
        let casts = p.plane_depth(e.at(foot)) - e.depth(foot) > p.tolerance;
        let (line, distance) = (e.line_distance(p.texels), e.distance(p.texels));
        let face = e.face(p.texels).map(|(depth, within)| (p.depth - depth, within));
        covered |= face.is_some_and(|(before, within)| within && before > p.tolerance);
        let followed = |before: f64| before > p.tolerance && before < FOLLOWED * p.tolerance;
        let under = line > p.inside_from && face.is_some_and(|(before, _)| followed(before));
        if casts {
            let d2 = distance * distance;
            let farther_line = line.abs() > nearest_line.abs() || line == -nearest_line && line > 0.0;
            if d2 < nearest || d2 == nearest && farther_line {
                nearest = d2;
                nearest_line = line;
                under_nearest = false;
            }
            under_nearest |= d2 == nearest && line == nearest_line && under;
            let side = usize::from(line > p.inside_from);
            if side == 0 || lit_beyond(view, e, p) {
                of_side[side] = of_side[side].min(distance);
            }
        }
        for k in 0..4 {
            if e.distance(center(k)) < SNAPPED {
                open[k] = false;
                settled[k] = false;
            }
            let Some(s) = e.crossing(p.texels, center(k)) else { continue };
            let x = p.texels.lerp(center(k), s);
            let above = p.plane_depth(x) - e.depth(e.foot(x));
            if above < -p.tolerance {
                continue;
            }
            let behind = e.depth(e.foot(x)) - view.stored(texel(k));
            let hidden = !lit[k] && behind > p.steepest * x.distance(center(k)) + p.tolerance;
            if hidden && above <= p.tolerance {
                continue;
            }
            open[k] = false;
            if hidden {
                continue;
            }
            likely[k] = false;
            if above <= p.tolerance {
                continue;
            }
            layers[k] += if line > p.inside_from { 1 } else { -1 };
            if s <= first_crossing[k] {
                let tie = s == first_crossing[k];
                from_inside[k] = line > p.inside_from || tie && from_inside[k];
                under_first[k] = under || tie && under_first[k];
                first_crossing[k] = s;
            }
        }
    }
    let reached = |light: bool| {
        let of: Vec<usize> = (0..4).filter(|&k| open[k] && lit[k] == light).collect();
        of.into_iter().min_by(|&a, &b| center(a).distance(p.texels).total_cmp(&center(b).distance(p.texels)))
    };
    let inside = nearest_line > p.inside_from || from_inside.contains(&true);
    let layered = (0..4).any(|k| settled[k] && lit[k] && sure[k] && layers[k] > 0);
    let leading_under = under_first.iter().chain([&under_nearest]).filter(|u| **u).count();
    let is_lit = match (reached(true), reached(false)) {
        _ if covered => false,
        (None, Some(_)) => false,
        (Some(_), None) if (0..4).any(|k| open[k] && lit[k] && sure[k]) => {
            leading_under <= (0..4).filter(|&k| open[k] && lit[k]).count()
        }
        (Some(_), None) => !inside && !layered,
        (None, None) => !(inside || layered || (0..4).any(|k| likely[k] && !lit[k])),
        (Some(light), Some(dark)) => {
            let t = texel(dark);
            let sides = [if dark & 1 == 0 { -1i64 } else { 1 }, if dark >> 1 == 0 { -1 } else { 1 }];
            let z = view.stored(t);
            let slope = dvec2(
                (view.stored([t[0] + sides[0], t[1]]) - z) * sides[0] as f64,
                (view.stored([t[0], t[1] + sides[1]]) - z) * sides[1] as f64,
            );
            let continued = |at: DVec2| z + slope.dot(at - center(dark));
            if continued(center(light)) >= p.reference_depth(center(light)) {
                continued(p.texels) >= p.depth - p.tolerance
            } else {
                center(light).distance(p.texels) < center(dark).distance(p.texels)
            }
        }
    };
    if settings.border > 0.0 {
        let distance = of_side[usize::from(!is_lit)];
        let signed = if is_lit { -distance } else { distance };
        return border(2.0 * signed / f64::from(settings.border), settings.kernel);
    }
    if is_lit { 1.0 } else { 0.0 }
}
