//! Edge profile. Over each side of a texel whose neighbour differs, the boundary is a height above that side, as a
//! function of the position along the run of such sides. A point closer to a side than that height takes the opposite
//! test.

use super::{Outcome, Quality, Side, Texels, add, fitted_line, scaled};
use glam::DVec2;

/// Smallest length, texels, of a run with big crossings at both ends that counts as the flat end of a box.
const FLAT_RUN: f64 = 6.0;
/// Strength with which the adjacent runs tilt a Z.
const TILT: f64 = 0.33;
/// Weight of the adjacent runs in the bow of a U; its length has the remaining weight.
const BOW_FROM_NEIGHBOURS: f64 = 0.7;
/// Largest length, texels, of a Z run for which lines are fitted.
const LINE_RUN: f64 = 2.0;

/// Unit piece of the boundary between texels with different tests, seen from one of them.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Crack {
    /// Texel on the inside.
    pub texel: [i64; 2],
    /// Side of that texel on which the crack lies.
    pub side: Side,
    /// Test of the inside texel; the texel across has the opposite one.
    pub lit: bool,
}

/// End of a run.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum End {
    /// Not reached within the largest number of steps.
    Unknown,
    /// The next texel and the one across from it both equal the inside: the boundary turns away from the inside.
    Away,
    /// The next texel and the one across from it both equal the outside: the boundary turns towards the inside.
    Toward,
    /// The next texel equals the outside and the one across from it the inside: four texels meet like a chessboard.
    Saddle,
}

impl End {
    /// Returns -1 for away, 1 for toward, 0 otherwise.
    pub fn sign(self) -> f64 {
        match self {
            Self::Away => -1.0,
            Self::Toward => 1.0,
            Self::Unknown | Self::Saddle => 0.0,
        }
    }

    fn opposite(self) -> Self {
        match self {
            Self::Away => Self::Toward,
            Self::Toward => Self::Away,
            same => same,
        }
    }
}

/// Run of cracks along one side, through a texel.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Run {
    /// Number of texels of the run before this one, towards smaller u or v.
    pub before: u32,
    /// Number of texels of the run after this one.
    pub after: u32,
    /// Ends of the run before and after this texel.
    pub ends: [End; 2],
    /// `true` for an end whose crossing boundary is at least 2 texels long.
    pub big: [bool; 2],
}

impl Run {
    /// Returns the length of the run, texels.
    pub fn length(&self) -> f64 {
        f64::from(self.before) + f64::from(self.after) + 1.0
    }

    /// Returns the ends, with a saddle replaced by the opposite of the other end. Two saddles stay.
    pub fn resolved_ends(&self) -> [End; 2] {
        match self.ends {
            [End::Saddle, End::Saddle] => self.ends,
            [End::Saddle, b] => [b.opposite(), b],
            [a, End::Saddle] => [a, a.opposite()],
            ends => ends,
        }
    }
}

/// Adjacent run beyond an end.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct NextDoor {
    /// Length in texels; 0 if there is none because that end is big or unknown, or the boundary turns back.
    pub length: u32,
    /// Turn of its far end, seen from the same side of the boundary.
    pub end: End,
}

impl NextDoor {
    /// No adjacent run.
    pub const NONE: Self = Self { length: 0, end: End::Unknown };
}

/// Steps along `crack` in the direction `step`. Returns the number of texels and the end.
fn walk(texels: &impl Texels, crack: Crack, step: [i64; 2], max_distance: u32) -> (u32, End) {
    let mut at = crack.texel;
    for steps in 0..max_distance {
        at = add(at, step);
        let inside = texels.lit(at) == crack.lit;
        let across = texels.lit(add(at, crack.side.step())) == crack.lit;
        match (inside, across) {
            (true, false) => {}
            (true, true) => return (steps, End::Away),
            (false, false) => return (steps, End::Toward),
            (false, true) => return (steps, End::Saddle),
        }
    }
    (max_distance, End::Unknown)
}

/// Returns the directions before and after.
fn directions(side: Side) -> [[i64; 2]; 2] {
    [scaled(side.along(), -1), side.along()]
}

/// Steps along a side both ways, at most `max_distance` each. It takes two tests per step, and two at a known end.
pub fn run(texels: &impl Texels, crack: Crack, max_distance: u32) -> Run {
    let normal = crack.side.step();
    let found = directions(crack.side).map(|step| {
        let (steps, end) = walk(texels, crack, step, max_distance);
        let last = add(crack.texel, scaled(step, i64::from(steps)));
        let same = |texel| texels.lit(texel) == crack.lit;
        let big = match end {
            // The crossing boundary continues one texel further in.
            End::Toward => {
                let behind = add(last, scaled(normal, -1));
                same(behind) & !same(add(behind, step))
            }
            End::Away => {
                let beyond = add(last, scaled(normal, 2));
                !same(beyond) & same(add(beyond, step))
            }
            End::Unknown | End::Saddle => false,
        };
        (steps, end, big)
    });
    let [(before, a, big_a), (after, b, big_b)] = found;
    Run { before, after, ends: [a, b], big: [big_a, big_b] }
}

/// Returns the crack at which the boundary continues at an end: the texel inside the crossing boundary, and its side.
fn crossing(crack: Crack, last: [i64; 2], step: [i64; 2], end: End) -> Option<Crack> {
    let normal = crack.side.step();
    match end {
        End::Toward => Some(Crack { texel: last, side: Side::of(step), ..crack }),
        End::Away => {
            let texel = add(add(last, step), normal);
            Some(Crack { texel, side: Side::of(scaled(step, -1)), ..crack })
        }
        End::Unknown | End::Saddle => None,
    }
}

/// Returns the runs beyond both ends of `run`, which is the run of `crack`.
pub fn next_door(texels: &impl Texels, crack: Crack, run: &Run, max_distance: u32) -> [NextDoor; 2] {
    let normal = crack.side.step();
    let steps = [run.before, run.after];
    let ends = run.resolved_ends();
    [0, 1].map(|i| {
        let step = directions(crack.side)[i];
        let next = add(crack.texel, scaled(step, i64::from(steps[i]) + 1));
        let first = match ends[i] {
            _ if run.big[i] => return NextDoor::NONE,
            End::Toward => add(next, scaled(normal, -1)),
            End::Away => add(next, normal),
            End::Unknown | End::Saddle => return NextDoor::NONE,
        };
        let same = |texel| texels.lit(texel) == crack.lit;
        if !same(first) || same(add(first, normal)) {
            return NextDoor::NONE;
        }
        let (more, end) = walk(texels, Crack { texel: first, ..crack }, step, max_distance);
        NextDoor { length: more + 1, end }
    })
}

/// Height of the boundary over a run, texels into the inside; negative where the boundary lies in the outside texels.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Curve {
    /// The height is 0: the boundary lies on the cracks.
    Flat,
    /// Falls from `height` at one end to 0 at the distance `reach` from it.
    Fade {
        /// Height at the known end, texels.
        height: f64,
        /// Index of the known end: 0 before, 1 after.
        end: usize,
        /// Distance at which the height is 0, texels: the largest traversal distance.
        reach: f64,
    },
    /// A parabola: `height - depth (1 - w^2)`, with `w` from -1 to 1 over the run.
    Bow {
        /// Height at both ends, texels.
        height: f64,
        /// Difference between the ends and the middle, texels.
        depth: f64,
    },
    /// A straight line.
    Line {
        /// Heights before and after, texels.
        heights: [f64; 2],
    },
}

/// Returns the curve over a run. `neighbours` come from [`next_door`] (`None` for [`Quality::Run`]). `lines` are the
/// heights of [`fitted_line`] at both ends, where there is such a line.
pub fn profile_curve(
    run: &Run,
    neighbours: Option<[NextDoor; 2]>,
    lines: [Option<f64>; 2],
    max_distance: u32,
) -> Curve {
    let length = run.length();
    let ends = run.resolved_ends();
    let [a, b] = ends.map(End::sign);
    let turns_on = |i: usize| neighbours.map(|n| n[i]).filter(|n| n.length > 0 && n.end == ends[i]);
    match ends {
        [End::Saddle, _] | [_, End::Saddle] | [End::Unknown, End::Unknown] => Curve::Flat,
        [End::Unknown, _] | [_, End::Unknown] => {
            let end = usize::from(ends[0] == End::Unknown);
            if run.big[end] {
                return Curve::Flat;
            }
            Curve::Fade { height: 0.5 * [a, b][end], end, reach: max_distance.into() }
        }
        _ if a == b => {
            if length >= FLAT_RUN && run.big == [true; 2] {
                return Curve::Flat;
            }
            let mut peak = 0.25 - 0.5 / length;
            if let (Some(before), Some(after)) = (turns_on(0), turns_on(1)) {
                let ratio = 1.0 + (f64::from(before.length) + f64::from(after.length)) / length;
                let circle = (1.0 / (ratio * ratio - 1.0) - 0.5).clamp(-0.5, 0.5);
                peak += BOW_FROM_NEIGHBOURS * (circle - peak);
            }
            Curve::Bow { height: 0.5 * a, depth: a * (0.5 + peak) }
        }
        _ => {
            if neighbours.is_some() && length == 1.0 && run.big != [false; 2] {
                return Curve::Flat;
            }
            let heights = [0, 1].map(|i| {
                let base = 0.5 * [a, b][i];
                if let Some(height) = lines[i] {
                    return height.clamp(base - 0.5, base + 0.5);
                }
                let Some(next) = turns_on(i).filter(|n| (f64::from(n.length) - length).abs() <= 1.0) else {
                    return base;
                };
                let next = f64::from(next.length);
                // The next run's slope counts too: outwards if it is shorter. `base` has the sign of the outward
                // direction.
                base + base.signum() * TILT * 2.0 * (length - next) / (length + next)
            });
            Curve::Line { heights }
        }
    }
}

/// Returns [`Profile::height`] of the curve of [`profile_curve`] at `u`, texels from the run's start.
pub fn profile_height(
    run: &Run,
    u: f64,
    max_distance: u32,
    neighbours: Option<[NextDoor; 2]>,
    lines: [Option<f64>; 2],
) -> f64 {
    Profile::new(run, profile_curve(run, neighbours, lines, max_distance)).height(u)
}

/// Boundary over the run of one side of a texel.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Profile {
    /// Length of the run before the texel, texels.
    pub before: f64,
    /// Length of the whole run, texels.
    pub length: f64,
    /// Height over the run.
    pub curve: Curve,
}

impl Profile {
    fn new(run: &Run, curve: Curve) -> Self {
        Self { before: run.before.into(), length: run.length(), curve }
    }

    /// Returns the height at `u`, texels from the run's start, `[0, length]`.
    pub fn height(&self, u: f64) -> f64 {
        match self.curve {
            Curve::Flat => 0.0,
            Curve::Fade { height, end, reach } => {
                let away = if end == 0 { u } else { self.length - u };
                height * (1.0 - away / reach).max(0.0)
            }
            Curve::Bow { height, depth } => {
                let w = 1.0 - 2.0 * u / self.length;
                height - depth * (1.0 - w * w)
            }
            Curve::Line { heights: [a, b] } => a + (b - a) * u / self.length,
        }
    }

    /// Returns the slope of the curve at `u`.
    fn slope(&self, u: f64) -> f64 {
        match self.curve {
            Curve::Flat => 0.0,
            Curve::Fade { height, end, reach } => {
                let (away, sign) = if end == 0 { (u, -1.0) } else { (self.length - u, 1.0) };
                if away < reach { sign * height / reach } else { 0.0 }
            }
            // d/du of -(1 - w^2) is 2 w dw/du, and dw/du is -2 / length.
            Curve::Bow { depth, .. } => -4.0 * depth * (1.0 - 2.0 * u / self.length) / self.length,
            Curve::Line { heights: [a, b] } => (b - a) / self.length,
        }
    }

    /// Returns the steepest slope of the curve.
    fn steepest(&self) -> f64 {
        match self.curve {
            Curve::Flat => 0.0,
            Curve::Fade { height, reach, .. } => height.abs() / reach,
            Curve::Bow { depth, .. } => 4.0 * depth.abs() / self.length,
            Curve::Line { heights: [a, b] } => (b - a).abs() / self.length,
        }
    }
}

/// Returns the profile over the run of `crack`.
pub fn profile(texels: &impl Texels, crack: Crack, quality: Quality, max_distance: u32) -> Profile {
    let run = run(texels, crack, max_distance);
    let neighbours = (quality != Quality::Run).then(|| next_door(texels, crack, &run, max_distance));
    let lines = if quality == Quality::Line { end_lines(texels, crack, &run) } else { [None; 2] };
    Profile::new(&run, profile_curve(&run, neighbours, lines, max_distance))
}

/// Returns the heights of lines fitted to the boundary around the ends of a short Z run.
fn end_lines(texels: &impl Texels, crack: Crack, run: &Run) -> [Option<f64>; 2] {
    let ends = run.resolved_ends();
    let is_z = ends[0].sign() * ends[1].sign() < 0.0;
    let is_corner = run.length() == 1.0 && run.big != [false; 2];
    if !is_z || run.length() > LINE_RUN || is_corner {
        return [None; 2];
    }
    let steps = [run.before, run.after];
    [0, 1].map(|i| {
        let step = directions(crack.side)[i];
        let last = add(crack.texel, scaled(step, i64::from(steps[i])));
        let line = fitted_line(texels, crossing(crack, last, step, run.ends[i])?)?;
        // The crossing boundary lies half a texel beyond the last texel's centre.
        line.height_over(crack, f64::from(steps[i]) + 0.5, step)
    })
}

/// Combines the profiles of a texel's sides at a point.
pub(super) fn outcome(lit: bool, profiles: &[Option<Profile>; 4], fraction: DVec2) -> Outcome {
    // The test flips if any side flips it. So a flipped point stays flipped until the last side lets go of it, and an
    // unflipped point stays unflipped until the first side flips it.
    let (mut within, mut apart): (f64, f64) = (0.0, f64::INFINITY);
    let mut flips = false;
    for (side, profile) in Side::ALL.into_iter().zip(profiles) {
        let Some(profile) = profile else { continue };
        if profile.curve == Curve::Flat {
            continue;
        }
        let u = profile.before + if side.is_horizontal() { fraction.y } else { fraction.x };
        let above = side.distance(fraction) - profile.height(u);
        let margin = above.abs() / profile.steepest().hypot(1.0);
        if above < 0.0 {
            flips = true;
            within = within.max(margin);
        } else {
            apart = apart.min(margin);
        }
    }
    let visibility = f64::from(u8::from(lit != flips));
    Outcome { visibility, margin: if flips { within } else { apart } }
}

/// Returns the visibility with a ramp of `width` texels across the boundary. The ramp takes the distance to the nearest
/// of the curves over the sides, to first order.
pub(super) fn ramp(lit: bool, profiles: &[Option<Profile>; 4], fraction: DVec2, width: f64) -> f64 {
    let distance = |(side, profile): (Side, &Option<Profile>)| {
        let profile = profile.as_ref()?;
        let u = profile.before + if side.is_horizontal() { fraction.y } else { fraction.x };
        Some((side.distance(fraction) - profile.height(u)) / profile.slope(u).hypot(1.0))
    };
    let nearest = Side::ALL.into_iter().zip(profiles).filter_map(distance).fold(f64::INFINITY, f64::min);
    let inside = (0.5 + nearest / width).clamp(0.0, 1.0);
    if lit { inside } else { 1.0 - inside }
}
