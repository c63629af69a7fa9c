//! The visibility functions of revectorization-based shadow mapping in `f64`, over any binary shadow test.
//!
//! Sources: Macedo, Apolinário and Agüero 2017, the optimised visibility functions, listings 1 to 5; Macedo and
//! Apolinário 2018, *Improved anti-aliasing for Euclidean distance transform shadow mapping*, equations 5 to 7; Macedo,
//! Apolinário and Agüero 2019, *Revectorization-Based Soft Shadow Mapping*, equations 2 and 3; the edge profile is our
//! own. All lengths are in texels. The second axis, v, grows downwards; neighbours are in the order of listing 2: left,
//! right, +v, -v.
//!
//! What the sources leave open, or have wrong, and what is done here:
//!
//! * Listing 2 against table 1 of Macedo 2017: the table swaps top and bottom; the listing counts.
//! * Listing 3: its loop variable is misspelt and its `d` must have three components. `checkDiscontinuity` is not
//!   printed: here a stepped texel shares a discontinuity direction with the start texel when one of the sides *across*
//!   the traversal that the start texel has differs there too. The sides along it cannot: the start texel's would have
//!   ended the traversal at its first step. A traversal that reaches the largest distance has not ended: negative.
//! * `normalizeFragmentDistanceToSE` is not printed: Macedo 2019 equation 3 has `max(d_l, d_b)` as its second component,
//!   which must be `max(d_t, d_b)`. Whether a run has ended at an edge end is taken from the traversal and not from the
//!   sign of the distance, which is 0 on the texel's own border.
//! * Listing 5, I shape: `nrd.w == 1.0` is printed where `nrd.w == -1.0` is meant. Every returned value is clamped:
//!   with one axis ended at both ends and the other at none, the second position is negative.
//! * Macedo 2018 equation 7 says nothing of U, O and I shapes: they keep the shadow test here. Each side of the boundary
//!   measures its `alpha` from the corner where its own run meets the opposite visibility.

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
pub use star::star_visibility;

use glam::DVec2;

/// The shadow test of a texel: true where lit. Texels by index, any `i64`.
pub trait Texels {
    /// True where the texel is lit.
    fn lit(&self, texel: [i64; 2]) -> bool;
}

impl<F: Fn([i64; 2]) -> bool> Texels for F {
    fn lit(&self, texel: [i64; 2]) -> bool {
        self(texel)
    }
}

/// A side of a texel.
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
    /// All four, in the order of listing 2.
    pub const ALL: [Self; 4] = [Self::Left, Self::Right, Self::PlusV, Self::MinusV];

    /// The way to the neighbour on that side.
    pub fn step(self) -> [i64; 2] {
        match self {
            Self::Left => [-1, 0],
            Self::Right => [1, 0],
            Self::PlusV => [0, 1],
            Self::MinusV => [0, -1],
        }
    }

    /// The one with this step.
    fn of(step: [i64; 2]) -> Self {
        match step.map(i64::signum) {
            [-1, _] => Self::Left,
            [1, _] => Self::Right,
            [_, 1] => Self::PlusV,
            _ => Self::MinusV,
        }
    }

    /// True for left and right.
    pub fn is_horizontal(self) -> bool {
        matches!(self, Self::Left | Self::Right)
    }

    /// The unit step along the side, towards larger u or v.
    pub fn along(self) -> [i64; 2] {
        if self.is_horizontal() { [0, 1] } else { [1, 0] }
    }

    /// Distance of a point in a texel from this side of it, texels.
    pub fn distance(self, fraction: DVec2) -> f64 {
        match self {
            Self::Left => fraction.x,
            Self::Right => 1.0 - fraction.x,
            Self::PlusV => 1.0 - fraction.y,
            Self::MinusV => fraction.y,
        }
    }
}

/// How much the edge profile looks at.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Quality {
    /// The run along each side.
    Run,
    /// Also the two runs next door.
    Neighbours,
    /// Also a line through the edge around each end of a short run.
    Line,
}

/// A visibility function.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Function {
    /// Silhouette recovery, Macedo 2017 listing 4: lit points only, it grows the shadow.
    Silhouette,
    /// Filtering, Macedo 2017 listing 5: a ramp across the boundary texels.
    Filtered,
    /// Improved visibility, Macedo 2018 equation 7, for L shapes; U, O and I keep the shadow test.
    Star,
    /// The edge profile: the boundary as a height over each run of the texel's sides.
    Profile(Quality),
}

/// What a function says at a point.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Outcome {
    /// 1 lit, 0 in shadow.
    pub visibility: f64,
    /// The point may be moved at least this far, texels, before the visibility jumps, as long as it stays in its texel.
    /// Infinite where it does not jump in the texel; 0 for a point right on the line that it is decided by.
    pub margin: f64,
}

impl Outcome {
    /// A visibility that no place in the texel changes by a jump.
    fn sure(visibility: f64) -> Self {
        Self { visibility, margin: f64::INFINITY }
    }

    fn test(lit: bool) -> Self {
        Self::sure(f64::from(u8::from(lit)))
    }
}

/// A function at a texel: what depends on the texel alone is done, any number of points can be asked for.
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
    Star(Discontinuity, [i64; 4]),
    Profile([Option<Profile>; 4]),
}

/// Reads all that `function` needs around a texel; `max_distance` is the most steps in a direction.
pub fn prepare(texels: &impl Texels, texel: [i64; 2], function: Function, max_distance: u32) -> Prepared {
    if function == Function::Silhouette && !texels.lit(texel) {
        return Prepared { lit: false, rule: Rule::Keep };
    }
    let d = discontinuity(texels, texel);
    if d.mask == 0 {
        return Prepared { lit: d.lit, rule: Rule::Keep };
    }
    let traversal = || traverse_all(texels, texel, d, max_distance);
    let rule =
        match function {
            Function::Silhouette => Rule::Silhouette(d, traversal()),
            Function::Filtered => Rule::Filtered(d, traversal()),
            Function::Star => Rule::Star(d, traversal()),
            Function::Profile(quality) => Rule::Profile(Side::ALL.map(|side| {
                d.at(side).then(|| profile(texels, Crack { texel, side, lit: d.lit }, quality, max_distance))
            })),
        };
    Prepared { lit: d.lit, rule }
}

impl Prepared {
    /// The test of the texel: true where lit.
    pub fn is_lit(&self) -> bool {
        self.lit
    }

    /// True where the function keeps the test in all of the texel because no side of it differs, or because listing 4
    /// leaves shadow alone.
    pub fn keeps_test(&self) -> bool {
        matches!(self.rule, Rule::Keep)
    }

    /// What the function says at `fraction`, `[0, 1)` inside the texel.
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
            Rule::Profile(profiles) => profile::outcome(self.lit, profiles, fraction),
        }
    }
}

/// What `function` says at a point: `fraction`, `[0, 1)`, inside `texel`.
///
/// `max_distance` is the most steps in a direction (`MAXDIST` of listing 3, there 16).
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
