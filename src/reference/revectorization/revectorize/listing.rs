//! Listings 2 to 5 of Macedo 2017, function by function. The errata are in the head of the parent module.

use super::{Side, Texels, add};
use glam::{DVec2, DVec3, DVec4};

/// Discontinuity of a texel: where its shadow test differs from its neighbours' (Macedo 2017, equations 2 to 4).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Discontinuity {
    /// Mask of the sides whose neighbour differs: bit i is for `Side::ALL[i]`; 1 left, 2 right, 4 +v, 8 -v.
    pub mask: u8,
    /// Shadow test of the texel itself; `true` if lit.
    pub lit: bool,
}

impl Discontinuity {
    /// Returns whether the neighbour on that side differs.
    pub fn at(self, side: Side) -> bool {
        self.mask & (1 << side as u8) != 0
    }

    /// Returns the packed form of listing 2: `(2 left + right) / 4`, `(2 (+v) + (-v)) / 4`, `1 - s`.
    pub fn packed(self) -> DVec3 {
        let bit = |side| f64::from(u8::from(self.at(side)));
        DVec3::new(
            (2.0 * bit(Side::Left) + bit(Side::Right)) / 4.0,
            (2.0 * bit(Side::PlusV) + bit(Side::MinusV)) / 4.0,
            f64::from(u8::from(!self.lit)),
        )
    }

    /// Returns whether both sides of an axis differ, which is 0.75 in the packed form.
    pub(super) fn is_short_u_or_o(self) -> bool {
        self.mask & 0b11 == 0b11 || self.mask & 0b1100 == 0b1100
    }
}

/// Mirrors `computeDiscontinuity`, listing 2, with five tests.
pub fn discontinuity(texels: &impl Texels, texel: [i64; 2]) -> Discontinuity {
    let lit = texels.lit(texel);
    let differs = |side: Side| texels.lit(add(texel, side.step())) != lit;
    let bits = Side::ALL.map(|side| u8::from(differs(side)) << side as u8);
    Discontinuity { mask: bits.iter().sum(), lit }
}

/// Mirrors `traverseShadowSilhouette`, listing 3: steps from a texel with discontinuity `d` towards `towards`.
///
/// Returns the number of the step that ended the traversal, with a sign. It is positive if that texel's test differs
/// from the start texel's (an edge end), and negative if the texel shares no discontinuity direction with the start
/// texel (stepped out). A traversal that has not ended after `max_distance` steps gives `-(max_distance + 1)`.
pub fn traverse(texels: &impl Texels, texel: [i64; 2], d: Discontinuity, towards: Side, max_distance: u32) -> i64 {
    let across = Side::ALL.map(|side| side.is_horizontal() != towards.is_horizontal() && d.at(side));
    let mut at = texel;
    for distance in 1..=i64::from(max_distance) {
        at = add(at, towards.step());
        if texels.lit(at) != d.lit {
            return distance;
        }
        let shares = |(i, side): (usize, Side)| across[i] && texels.lit(add(at, side.step())) != d.lit;
        if !Side::ALL.into_iter().enumerate().any(shares) {
            return -distance;
        }
    }
    -i64::from(max_distance) - 1
}

/// Performs [`traverse`] towards all four sides.
pub fn traverse_all(texels: &impl Texels, texel: [i64; 2], d: Discontinuity, max_distance: u32) -> [i64; 4] {
    Side::ALL.map(|side| traverse(texels, texel, d, side, max_distance))
}

/// Mirrors `computeFragmentDistanceToSE`, Macedo 2019 equation 2: distances from the point to the end of each
/// traversal, texels, with the traversal's sign. `fraction` is the point's position in its texel, `[0, 1)`.
pub fn distance_to_edge(fraction: DVec2, traversal: [i64; 4]) -> DVec4 {
    let distance = |i: usize| {
        let steps = traversal[i];
        let to_end = Side::ALL[i].distance(fraction) + (steps.abs() - 1) as f64;
        if steps > 0 { to_end } else { -to_end }
    };
    DVec4::new(distance(0), distance(1), distance(2), distance(3))
}

/// Mirrors `normalizeFragmentDistanceToSE`, Macedo 2019 equation 3 and Macedo 2017 equation 5.
///
/// `x` and `y` are the normalised positions on the horizontal and the vertical axis. With one edge end they are 0 at
/// that end and 1 at the other; with two, the farther end counts, `[0.5, 1]`; with none they are negative. `z` and `w`
/// are 1 where both traversals of the axis ended at an edge end, 0 for one, -1 for none.
pub fn normalized(distance: DVec4, traversal: [i64; 4]) -> DVec4 {
    let position = |a: f64, b: f64| a.max(b) / (a.abs() + b.abs());
    let ends = |a: i64, b: i64| f64::from(i8::from(a > 0) + i8::from(b > 0) - 1);
    DVec4::new(
        position(distance.x, distance.y),
        position(distance.z, distance.w),
        ends(traversal[0], traversal[1]),
        ends(traversal[2], traversal[3]),
    )
}

/// Mirrors `computeRBSMVisibility`, listing 4, for a point in a texel with a discontinuity. Shadow stays shadow
/// (listing 1).
pub fn silhouette_visibility(d: Discontinuity, nrd: DVec4) -> f64 {
    if !d.lit || d.is_short_u_or_o() || nrd.z == 1.0 || nrd.w == 1.0 {
        return 0.0;
    }
    if nrd.z == -1.0 || nrd.w == -1.0 {
        return 1.0;
    }
    if nrd.y < 1.0 - nrd.x { 0.0 } else { 1.0 }
}

/// Mirrors `computeRBSMVisibility`, listing 5, for a point in a texel with a discontinuity.
pub fn filtered_visibility(d: Discontinuity, nrd: DVec4) -> f64 {
    let other = d.packed().z;
    let sign = 1.0 - 2.0 * other;
    if d.mask == 0b1111 || nrd.z == 1.0 && nrd.w == 1.0 {
        return other;
    }
    let ramp = if nrd.z == 1.0 {
        nrd.y
    } else if nrd.w == 1.0 {
        nrd.x
    } else if nrd.z == -1.0 || nrd.w == -1.0 {
        return 1.0 - other;
    } else {
        nrd.x + nrd.y
    };
    (other + sign * ramp).clamp(0.0, 1.0)
}

/// Returns the distance, texels, of a point in an L shape from the line where its two positions add up to `sum`.
pub(super) fn line_margin(nrd: DVec4, traversal: [i64; 4], sum: f64) -> f64 {
    // Length of a run: `|d_l| + |d_r|`, wherever the point is.
    let length = |a: i64, b: i64| (a.abs() + b.abs() - 1) as f64;
    let slope = DVec2::new(1.0 / length(traversal[0], traversal[1]), 1.0 / length(traversal[2], traversal[3]));
    (nrd.x + nrd.y - sum).abs() / slope.length()
}
