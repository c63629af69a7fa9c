//! Visibility functions of revectorization-based shadow mapping in `f64`, over any binary shadow test.
//!
//! Sources: Macedo, Apolinário and Agüero 2017, the optimised visibility functions, listings 1 to 5; Macedo and
//! Apolinário 2018, *Improved anti-aliasing for Euclidean distance transform shadow mapping*, equations 5 to 7;
//! Macedo, Apolinário and Agüero 2019, *Revectorization-Based Soft Shadow Mapping*, equations 2 and 3. The edge
//! profile is our own. All lengths are in texels. The second axis, v, grows downwards. Neighbours are in the order of
//! listing 2: left, right, +v, -v.
//!
//! The sources leave these points open or have them wrong; this module resolves them as follows:
//!
//! * Listing 2 and table 1 of Macedo 2017 disagree: the table swaps top and bottom. The listing counts.
//! * Listing 3 misspells its loop variable, and its `d` must have three components. `checkDiscontinuity` is not
//!   printed. Here a stepped texel shares a discontinuity direction with the start texel if it differs on a side
//!   *across* the traversal on which the start texel differs too. Sides along the traversal cannot be shared. If the
//!   start texel differs from the texel ahead of it, the traversal ends at its first step. The texel behind a stepped
//!   texel belongs to the run and so has the same test. A traversal that reaches the largest distance has not ended and
//!   is negative.
//! * `normalizeFragmentDistanceToSE` is not printed. Macedo 2019 equation 3 has `max(d_l, d_b)` as its second
//!   component; it must be `max(d_t, d_b)`. The traversal, not the sign of the distance, tells whether a run ended at
//!   an edge end, because the distance is 0 on the texel's own border.
//! * Listing 5 prints `nrd.w == 1.0` for the I shape and means `nrd.w == -1.0`. Every returned value is clamped: if
//!   one axis ended at both ends and the other at none, the second position is negative.
//! * Macedo 2018 equation 7 does not cover U, O and I shapes; here they keep the shadow test. Each side of the
//!   boundary measures its `alpha` from the corner where its own run meets the opposite visibility.

mod line;
mod listing;
mod profile;
mod star;
#[cfg(test)]
mod tests;

pub use line::{FITTED_CRACKS, FittedLine, fitted_line};
pub use listing::{
    Discontinuity, discontinuity, distance_to_edge, filtered_visibility, normalized, silhouette_visibility, traverse,
    traverse_all,
};
pub use profile::{Crack, Curve, End, NextDoor, Profile, Run, next_door, profile, profile_curve, profile_height, run};
pub use star::{star_ramp, star_visibility};

use glam::DVec2;

/// Shadow test of any texel, by its integer index.
pub trait Texels {
    /// Returns whether the texel is lit.
    fn lit(&self, texel: [i64; 2]) -> bool;
}

impl<F: Fn([i64; 2]) -> bool> Texels for F {
    fn lit(&self, texel: [i64; 2]) -> bool {
        self(texel)
    }
}

/// Side of a texel.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Side {
    /// Towards smaller u.
    Left,
    /// Towards larger u.
    Right,
    /// Towards larger v, down in the picture.
    PlusV,
    /// Towards smaller v, up in the picture.
    MinusV,
}

impl Side {
    /// All four sides, in the order of listing 2.
    pub const ALL: [Self; 4] = [Self::Left, Self::Right, Self::PlusV, Self::MinusV];

    /// Returns the step to the neighbour on that side.
    pub fn step(self) -> [i64; 2] {
        match self {
            Self::Left => [-1, 0],
            Self::Right => [1, 0],
            Self::PlusV => [0, 1],
            Self::MinusV => [0, -1],
        }
    }

    /// Returns the side with this step.
    fn of(step: [i64; 2]) -> Self {
        match step.map(i64::signum) {
            [-1, _] => Self::Left,
            [1, _] => Self::Right,
            [_, 1] => Self::PlusV,
            _ => Self::MinusV,
        }
    }

    /// Returns whether the side is left or right.
    pub fn is_horizontal(self) -> bool {
        matches!(self, Self::Left | Self::Right)
    }

    /// Returns the unit step along the side, towards larger u or v.
    pub fn along(self) -> [i64; 2] {
        if self.is_horizontal() { [0, 1] } else { [1, 0] }
    }

    /// Returns the distance of a point in a texel from this side, texels.
    pub fn distance(self, fraction: DVec2) -> f64 {
        match self {
            Self::Left => fraction.x,
            Self::Right => 1.0 - fraction.x,
            Self::PlusV => 1.0 - fraction.y,
            Self::MinusV => fraction.y,
        }
    }
}

/// Extent of the boundary that the edge profile reads.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Quality {
    /// The run along each side.
    Run,
    /// Also the two adjacent runs.
    Neighbours,
    /// Also a line fitted to the boundary around each end of a short run.
    Line,
}

/// Visibility function.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Function {
    /// Silhouette recovery, Macedo 2017 listing 4. It changes lit points only, so it grows the shadow.
    Silhouette,
    /// Filtering, Macedo 2017 listing 5: a ramp across the boundary texels.
    Filtered,
    /// Macedo 2018 equation 7 before its threshold: the ramp of listing 5 for L shapes; U, O and I keep the shadow test.
    Ramp,
    /// Improved visibility, Macedo 2018 equation 7, for L shapes; U, O and I keep the shadow test.
    Star,
    /// Edge profile: the boundary as a height over each run of the texel's sides.
    Profile(Quality),
    /// A ramp across the edge profile; the number is its width in texels.
    ProfileRamp(Quality, f64),
}

impl Function {
    /// Largest change of the visibility along one axis, per texel, where it does not jump: 0 for hard edges.
    pub fn slope(self) -> f64 {
        match self {
            Self::Silhouette | Self::Star | Self::Profile(_) => 0.0,
            Self::Filtered | Self::Ramp => 1.0,
            // The distance is above / sqrt(1 + slope^2), where `above`, at most 1.5, is the height over the profile. A
            // step along one axis changes it by at most 1 per texel through `above`. The slope changes by at most 8 per
            // texel, which changes the distance by at most (above * 8) * slope / (1 + slope^2)^1.5 < 4.7.
            Self::ProfileRamp(_, width) => 6.0 / width,
        }
    }
}

/// Result of a function at a point.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Outcome {
    /// Visibility: 1 is lit, 0 is in shadow.
    pub visibility: f64,
    /// Lower bound on the distance, texels, by which the point can move within its texel before the visibility jumps.
    /// It is infinite if the visibility does not jump in the texel, and 0 on the line that decides the point.
    pub margin: f64,
}

impl Outcome {
    /// Returns a visibility that does not jump anywhere in the texel.
    fn sure(visibility: f64) -> Self {
        Self { visibility, margin: f64::INFINITY }
    }

    fn test(lit: bool) -> Self {
        Self::sure(f64::from(u8::from(lit)))
    }
}

/// Function prepared for a texel: everything that depends on the texel alone is computed, so that many points are
/// cheap.
#[derive(Clone, Debug)]
pub struct Prepared {
    lit: bool,
    rule: Rule,
}

#[derive(Clone, Debug)]
enum Rule {
    Keep,
    Silhouette(Discontinuity, [i64; 4]),
    Filtered(Discontinuity, [i64; 4]),
    Ramp(Discontinuity, [i64; 4]),
    Star(Discontinuity, [i64; 4]),
    Profile([Option<Profile>; 4]),
    ProfileRamp([Option<Profile>; 4], f64),
}

/// Reads all that `function` needs around a texel; `max_distance` is the largest number of steps per direction.
pub fn prepare(texels: &impl Texels, texel: [i64; 2], function: Function, max_distance: u32) -> Prepared {
    if function == Function::Silhouette && !texels.lit(texel) {
        return Prepared { lit: false, rule: Rule::Keep };
    }
    let d = discontinuity(texels, texel);
    if d.mask == 0 {
        return Prepared { lit: d.lit, rule: Rule::Keep };
    }
    let traversal = || traverse_all(texels, texel, d, max_distance);
    let profiles = |quality| {
        Side::ALL
            .map(|side| d.at(side).then(|| profile(texels, Crack { texel, side, lit: d.lit }, quality, max_distance)))
    };
    let rule = match function {
        Function::Silhouette => Rule::Silhouette(d, traversal()),
        Function::Filtered => Rule::Filtered(d, traversal()),
        Function::Ramp => Rule::Ramp(d, traversal()),
        Function::Star => Rule::Star(d, traversal()),
        Function::Profile(quality) => Rule::Profile(profiles(quality)),
        Function::ProfileRamp(quality, width) => Rule::ProfileRamp(profiles(quality), width),
    };
    Prepared { lit: d.lit, rule }
}

impl Prepared {
    /// Returns the shadow test of the texel: `true` if lit.
    pub fn is_lit(&self) -> bool {
        self.lit
    }

    /// Returns whether the function keeps the test in the whole texel. It does if no side differs, or if listing 4
    /// leaves shadow alone.
    pub fn keeps_test(&self) -> bool {
        matches!(self.rule, Rule::Keep)
    }

    /// Evaluates the function at `fraction`, `[0, 1)`, inside the texel.
    pub fn at(&self, fraction: DVec2) -> Outcome {
        let positions = |traversal| normalized(distance_to_edge(fraction, traversal), traversal);
        match &self.rule {
            Rule::Keep => Outcome::test(self.lit),
            &Rule::Silhouette(d, traversal) => {
                let nrd = positions(traversal);
                let visibility = silhouette_visibility(d, nrd);
                let is_l = !d.is_short_u_or_o() && nrd.z == 0.0 && nrd.w == 0.0;
                let margin = if is_l { listing::line_margin(nrd, traversal, 1.0) } else { f64::INFINITY };
                Outcome { visibility, margin }
            }
            &Rule::Filtered(d, traversal) => Outcome::sure(filtered_visibility(d, positions(traversal))),
            &Rule::Star(d, traversal) => {
                let nrd = positions(traversal);
                let is_l = nrd.z == 0.0 && nrd.w == 0.0;
                let margin = if is_l { listing::line_margin(nrd, traversal, 0.5) } else { f64::INFINITY };
                Outcome { visibility: star_visibility(d, nrd), margin }
            }
            &Rule::Ramp(d, traversal) => Outcome::sure(star_ramp(d, positions(traversal))),
            Rule::Profile(profiles) => profile::outcome(self.lit, profiles, fraction),
            Rule::ProfileRamp(profiles, width) => Outcome::sure(profile::ramp(self.lit, profiles, fraction, *width)),
        }
    }
}

/// Edge that [`Function::Silhouette`] or [`Function::Star`] draws in a texel, for a point in it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TexelEdge {
    /// Value of a linear function at the point: 0 at the edge, positive where the visibility is that of the texel's test.
    pub value: f64,
    /// Its gradient, per texel.
    pub gradient: DVec2,
    /// Distance, texels, by which a point must move at least for another side to be the nearest; infinite for a line.
    pub margin: f64,
}

impl Prepared {
    /// Mirrors `edgeInTexel` of `glsl/penumbra/edge_line.comp`: the line of an L shape; for shapes that keep the test, the
    /// nearest side of the texel that differs.
    pub fn edge(&self, fraction: DVec2) -> Option<TexelEdge> {
        let (d, traversal, sum) = match self.rule {
            Rule::Silhouette(d, traversal) => (d, traversal, 1.0),
            Rule::Star(d, traversal) => (d, traversal, 0.5),
            _ => return None,
        };
        let distance = distance_to_edge(fraction, traversal);
        let nrd = normalized(distance, traversal);
        if nrd.z == 0.0 && nrd.w == 0.0 {
            let length = |i: usize| (traversal[i].abs() + traversal[i + 1].abs() - 1) as f64;
            let towards = |i: usize| if traversal[i] > 0 { 1.0 } else { -1.0 };
            let gradient = DVec2::new(towards(0) / length(0), -towards(2) / length(2));
            return Some(TexelEdge { value: nrd.x + nrd.y - sum, gradient, margin: f64::INFINITY });
        }
        let closes = d.is_short_u_or_o() || nrd.z == 1.0 || nrd.w == 1.0;
        if matches!(self.rule, Rule::Silhouette(..)) && closes {
            return None;
        }
        let mut differing: Vec<_> = Side::ALL.into_iter().filter(|&side| d.at(side)).collect();
        differing.sort_by(|a, b| a.distance(fraction).total_cmp(&b.distance(fraction)));
        let &nearest = differing.first()?;
        let value = nearest.distance(fraction);
        let margin = differing.get(1).map_or(f64::INFINITY, |second| 0.5 * (second.distance(fraction) - value));
        let [x, y] = nearest.step();
        Some(TexelEdge { value, gradient: -DVec2::new(x as f64, y as f64), margin })
    }
}

/// Evaluates `function` at a point: `fraction`, `[0, 1)`, inside `texel`.
///
/// `max_distance` is the largest number of steps per direction (`MAXDIST` of listing 3, 16 there).
pub fn visibility(
    texels: &impl Texels,
    texel: [i64; 2],
    fraction: DVec2,
    function: Function,
    max_distance: u32,
) -> Outcome {
    prepare(texels, texel, function, max_distance).at(fraction)
}

fn add(a: [i64; 2], b: [i64; 2]) -> [i64; 2] {
    [a[0].wrapping_add(b[0]), a[1].wrapping_add(b[1])]
}

fn scaled(step: [i64; 2], by: i64) -> [i64; 2] {
    step.map(|s| s.wrapping_mul(by))
}
