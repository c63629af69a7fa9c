//! Mirror of `glsl/caster_edges/edsm.comp`, `edsm_distance.glsl` and `edsm_border.glsl`: edge distance shadow mapping.

use super::edge_segments::{PLACE_ERROR, Segment};
use super::sssm::displaced;
use crate::Result;
use crate::reference::common::map_receiver::{MapReceiver, receive};
use crate::reference::common::rbsm_receiver::{ReceiverSettings, Tests};
use crate::reference::common::view::{Decision, FrameData, Mirror, View};
use crate::technique::caster_edges::edsm::{BorderKernel, DistanceConfig, Priority};
use glam::{DVec2, dvec2};

/// Values that an edge writes at a point.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct EdgeDistance {
    /// Distance from the edge's line, positive on the occluder's side; in texels, or as printed in edge lengths.
    pub distance: f64,
    /// Priority; the edge with the smallest one is kept.
    pub priority: f64,
    /// Parameter of the closest point on the edge, 0 to 1 from end to end.
    pub along: f64,
}

/// Returns the values of edge `e` at `p`.
pub fn edge_distance(e: &Segment, p: DVec2, config: &DistanceConfig) -> EdgeDistance {
    let half_width = f64::from(config.half_width);
    let (d, away) = (e.along(), p - e.ends[0]);
    let length = d.length();
    let t = away.dot(d) / (length * length);
    let off = e.line_distance(p);
    let distance = if config.printed { (off / length).clamp(-6e4, 6e4) } else { off };
    let beyond = !(0.0..=1.0).contains(&t);
    let from_corner = if t <= 0.0 { away } else { p - e.ends[1] };
    let priority = match config.priority {
        Priority::Segment => {
            let near = if beyond { from_corner.length() } else { off.abs() };
            (near - 1e-4 * off.abs()) / (1.4143 * half_width)
        }
        Priority::Cosine => {
            let corner = if beyond { from_corner.dot(d).abs() / (from_corner.length() * length) } else { 0.0 };
            0.9999 * (off.abs() / half_width).max(corner).min(1.0)
        }
        Priority::Printed => distance.abs() / (1.0 + distance.abs()),
    };
    EdgeDistance { distance, priority, along: t.clamp(0.0, 1.0) }
}

/// An edge whose quad may cover a texel's centre.
#[derive(Clone, Copy, Debug)]
pub struct Candidate {
    what: EdgeDistance,
    /// A texel in the units of the distance.
    texel: f64,
    /// Largest error of the priority.
    slack: f64,
    /// `true` if neither rasterisation nor the hidden-edge test can change whether the edge counts.
    sure: bool,
}

/// Largest displacement of a quad's border, texels. Rasterisation snaps vertices to a grid of 1/256 of a texel; some
/// devices use a coarser one.
const SNAPPING: f64 = 1.0 / 64.0;

/// Returns, for each texel of a map, every edge that the texel may keep.
pub fn candidates(
    edges: &[Segment],
    map_size: [u32; 2],
    shadow_map: &[f32],
    config: &DistanceConfig,
) -> Vec<Vec<Candidate>> {
    let [w, h] = map_size.map(i64::from);
    let r = f64::from(config.half_width);
    let mut texels = vec![vec![]; (w * h) as usize];
    for e in edges {
        let reach = DVec2::splat(1.5 * r + 1.0);
        let (low, high) = (e.ends[0].min(e.ends[1]) - reach, e.ends[0].max(e.ends[1]) + reach);
        let along = e.along().normalize();
        for y in (low.y.floor() as i64).max(0)..(high.y.floor() as i64 + 1).min(h) {
            for x in (low.x.floor() as i64).max(0)..(high.x.floor() as i64 + 1).min(w) {
                let p = dvec2(x as f64, y as f64) + 0.5;
                let place = along.dot(p - e.ends[0]);
                // Distance from the quad's border, texels; positive inside.
                let inside =
                    (r - along.perp_dot(p - e.ends[0]).abs()).min(place + r).min(e.along().length() + r - place);
                if inside < -SNAPPING {
                    continue;
                }
                let what = edge_distance(e, p, config);
                let foot = e.ends[0].lerp(e.ends[1], what.along);
                let hidden = if config.kill {
                    e.is_hidden(shadow_map, map_size, foot, e.depth(what.along))
                } else {
                    Decision::No
                };
                if hidden != Decision::Yes {
                    let sure = inside > SNAPPING && hidden == Decision::No;
                    let texel = if config.printed { 1.0 / e.along().length() } else { 1.0 };
                    // At a corner the cosine changes quickly.
                    let slack = match config.priority {
                        Priority::Segment => PLACE_ERROR,
                        Priority::Cosine => 1e-2,
                        Priority::Printed => PLACE_ERROR * texel / (1.0 + what.distance.abs()),
                    };
                    texels[(y * w + x) as usize].push(Candidate { what, texel, slack, sure });
                }
            }
        }
    }
    texels
}

/// Returns whether a texel may hold the distance `value`.
pub fn explains(candidates: &[Candidate], value: f32) -> bool {
    let best = candidates.iter().filter(|c| c.sure).map(|c| c.what.priority + c.slack).fold(f64::INFINITY, f64::min);
    if value == 0.0 && best == f64::INFINITY {
        return true;
    }
    let near = |c: &Candidate| {
        // The map has half precision. The line has single precision, and a short edge's line turns with its ends.
        (c.what.distance - f64::from(value)).abs() <= 2e-3 * (c.texel + c.what.distance.abs())
    };
    candidates.iter().any(|c| c.what.priority - c.slack <= best && near(c))
}

/// Returns the visibility across a soft border; `x` is the distance in half widths, positive in shadow.
pub fn border(x: f64, kernel: BorderKernel) -> f64 {
    let x = x.clamp(-1.0, 1.0);
    match kernel {
        BorderKernel::Box => 0.5 - 0.5 * x,
        BorderKernel::Smoothstep => {
            let t = 0.5 + 0.5 * x;
            1.0 - t * t * (3.0 - 2.0 * t)
        }
        BorderKernel::Disc => (x.acos() - x * (1.0 - x * x).sqrt()) / std::f64::consts::PI,
    }
}

/// Returns whether the test just beyond the edge differs from `verdict`, the result of all four tests at `place`.
fn differs_beyond(
    four: [f64; 4],
    q: DVec2,
    d: f64,
    place: DVec2,
    verdict: bool,
    lit: &dyn Fn([i64; 2]) -> bool,
) -> bool {
    let mix = |a: f64, b: f64, t: f64| a * (1.0 - t) + b * t;
    let inwards = dvec2(mix(four[1] - four[0], four[3] - four[2], q.y), mix(four[2] - four[0], four[3] - four[1], q.x));
    if inwards == DVec2::ZERO {
        return false;
    }
    let beyond = place - inwards.normalize() * (d + if d > 0.0 { 0.75 } else { -0.75 });
    lit([beyond.x.floor() as i64, beyond.y.floor() as i64]) != verdict
}

/// Settings of the lookup.
#[derive(Clone, Copy, Debug)]
pub struct Lookup {
    /// Width of soft borders, texels; 0: hard.
    pub border: f64,
    /// Profile of a soft border.
    pub kernel: BorderKernel,
    /// True to weigh the four distances in steps of 1/256.
    pub eight_bits: bool,
}

/// Computes the visibility of every pixel from the GPU's own map of distances.
///
/// # Errors
/// Fails if the images do not fit the constants.
pub fn visibility(
    data: &FrameData<'_>,
    settings: &ReceiverSettings,
    distances: &[f32],
    lookup: Lookup,
) -> Result<Mirror> {
    let view = View::new(data)?;
    let [w, h] = view.map_size.map(|n| n as i64);
    let distance = |[x, y]: [i64; 2]| {
        let inside = (0..w).contains(&x) && (0..h).contains(&y);
        if inside { f64::from(distances[(y * w + x) as usize]) } else { 0.0 }
    };
    let half = 0.5 * lookup.border;
    let look_up = |place: DVec2, lit: &dyn Fn([i64; 2]) -> bool| {
        let first = (place - 0.5).floor();
        let q = place - 0.5 - first;
        let texel = |i: usize| [first.x as i64 + (i as i64 & 1), first.y as i64 + (i as i64 >> 1)];
        let tests: [bool; 4] = std::array::from_fn(|i| lit(texel(i)));
        let mut four: [f64; 4] = std::array::from_fn(|i| distance(texel(i)));
        let all = tests.iter().all(|t| *t == tests[0]);
        let value = |lit: bool| f64::from(u8::from(lit));
        if four == [0.0; 4] {
            return value(tests[usize::from(q.x >= 0.5) + 2 * usize::from(q.y >= 0.5)]);
        }
        if half > 0.0 {
            let sum: f64 = four.iter().sum();
            for (d, lit) in four.iter_mut().zip(tests) {
                if *d == 0.0 {
                    *d = if if all { sum < 0.0 } else { lit } { -half - 1.0 } else { half + 1.0 };
                }
            }
        }
        let mix = |a: f64, b: f64, t: f64| a * (1.0 - t) + b * t;
        let weight = if lookup.eight_bits { (256.0 * q).round() / 256.0 } else { q };
        let d = mix(mix(four[0], four[1], weight.x), mix(four[2], four[3], weight.x), weight.y);
        match (half > 0.0, all) {
            (false, true) => value(tests[0]),
            (false, false) => value(d <= 0.0),
            (true, true) if tests[0] == (d > 0.0) || !differs_beyond(four, q, d, place, tests[0], lit) => {
                value(tests[0])
            }
            (true, _) => border(d / half, lookup.kernel),
        }
    };
    Ok(Mirror::collect(view.every_pixel(|p| match receive(&view, p, settings.normal_offset, settings.depth_bias) {
        MapReceiver::Decided(verdict) => verdict,
        MapReceiver::Open(r) => r.with_doubts(displaced(&Tests::new(&view, &r, settings), &look_up)),
    })))
}

#[cfg(test)]
mod tests {
    use super::*;

    const MAP: DistanceConfig =
        DistanceConfig { printed: false, priority: Priority::Segment, kill: true, half_width: 1.5 };

    #[test]
    fn distances_are_in_texels_and_signed() {
        let e = Segment { ends: [dvec2(2.0, 2.0), dvec2(5.0, 6.0)], depths: [0.1; 2], own: [true; 2], third: None };
        // A 3-4-5 triangle: the point lies one texel to the right of the edge's direction (y down).
        let p = dvec2(2.0, 2.0) + 0.5 * dvec2(3.0, 4.0) + dvec2(-0.8, 0.6);
        let r = edge_distance(&e, p, &MAP);
        assert!((r.distance - 1.0).abs() < 1e-12 && (r.along - 0.5).abs() < 1e-12, "{r:?}");
        assert!(edge_distance(&e, p + dvec2(1.6, -1.2), &MAP).distance < 0.0);
        // The edge is 5 texels long. As printed, its distance is that share of its length.
        let printed = DistanceConfig { printed: true, priority: Priority::Printed, ..MAP };
        let r = edge_distance(&e, p, &printed);
        assert!((r.distance - 0.2).abs() < 1e-12 && (r.priority - 0.2 / 1.2).abs() < 1e-12, "{r:?}");
    }

    /// Beyond a shared end, two edges are equally near. The edge whose line is farther away is right: a point outside
    /// a sharp corner is outside that edge.
    #[test]
    fn ties_at_corners_are_decided() {
        let tip = dvec2(10.0, 10.0);
        // The occluder is the thin wedge between the two edges, on the right of each.
        let upper = Segment { ends: [dvec2(0.0, 9.0), tip], depths: [0.1; 2], own: [true; 2], third: None };
        let lower = Segment { ends: [tip, dvec2(0.0, 11.0)], depths: [0.1; 2], own: [true; 2], third: None };
        for p in [dvec2(10.8, 10.3), dvec2(10.5, 9.6), dvec2(10.9, 10.01)] {
            let found = [&upper, &lower].map(|e| edge_distance(e, p, &MAP));
            let nearest = if found[0].priority < found[1].priority { found[0] } else { found[1] };
            assert!(nearest.distance < 0.0, "{p}: {found:?}");
            assert!(
                found.iter().any(|f| f.distance > 0.0) || p.y > 10.0 && p.x > 10.8,
                "{p} does not test a tie: {found:?}"
            );
        }
    }

    #[test]
    fn borders_are_symmetric_and_fall() {
        for kernel in [BorderKernel::Box, BorderKernel::Smoothstep, BorderKernel::Disc] {
            assert_eq!((border(-2.0, kernel), border(2.0, kernel)), (1.0, 0.0));
            let steps: Vec<f64> = (-10..=10).map(|i| border(f64::from(i) / 10.0, kernel)).collect();
            assert!(steps.windows(2).all(|w| w[0] > w[1]), "{steps:?}");
            assert!((0..=10).all(|i| (steps[i] + steps[20 - i] - 1.0).abs() < 1e-12), "{steps:?}");
        }
    }
}
