//! Fit of a straight line to a piece of the boundary.

use super::{Crack, Side, Texels, add, scaled};
use glam::DVec2;

/// Number of cracks followed to either side of the first: a line is fitted to twice as many plus one.
pub const FITTED_CRACKS: usize = 8;

/// Smallest component of the line's normal across the crack's side for which the height over the side is usable.
const LEAST_ACROSS: f64 = 0.3;

/// Line that separates the inside texels of a piece of the boundary from the outside texels.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FittedLine {
    /// Texel whose centre is the origin of coordinates.
    pub origin: [i64; 2],
    /// Unit normal, pointing from inside to outside.
    pub normal: DVec2,
    /// Dot product of the normal with any point of the line, texels.
    pub offset: f64,
}

impl FittedLine {
    /// Returns the line's height above the side of `crack`, positive into its texel. The height is taken `along`
    /// texels from the texel's centre in the direction `step` along that side. Returns `None` where the line is too
    /// steep.
    pub fn height_over(&self, crack: Crack, along: f64, step: [i64; 2]) -> Option<f64> {
        let side = vector(crack.side.step());
        let center = vector(add(crack.texel, scaled(self.origin, -1)));
        let across = self.normal.dot(side);
        let height = (self.normal.dot(center + 0.5 * side + along * vector(step)) - self.offset) / across;
        (across.abs() > LEAST_ACROSS).then_some(height)
    }
}

/// Returns the next crack in the direction `step` along the boundary, and the direction there. Returns `None` where
/// four texels meet like a chessboard, since the boundary then continues two ways.
fn follow(texels: &impl Texels, crack: Crack, step: [i64; 2]) -> Option<(Crack, [i64; 2])> {
    let normal = crack.side.step();
    let ahead = add(crack.texel, step);
    let across = add(ahead, normal);
    match (texels.lit(ahead) == crack.lit, texels.lit(across) == crack.lit) {
        (true, false) => Some((Crack { texel: ahead, ..crack }, step)),
        (true, true) => Some((Crack { texel: across, side: Side::of(scaled(step, -1)), ..crack }, normal)),
        (false, false) => Some((Crack { side: Side::of(step), ..crack }, scaled(normal, -1))),
        (false, true) => None,
    }
}

/// Fits a line by least squares to the midpoints of `crack` and of [`FITTED_CRACKS`] cracks to either side. The line
/// is then moved to the middle of the gap between the centres of the inside and the outside texels.
///
/// Returns `None` where the boundary cannot be followed that far, or where no such line separates the texels.
pub fn fitted_line(texels: &impl Texels, crack: Crack) -> Option<FittedLine> {
    let origin = crack.texel;
    // Centres of the inside texels, and the steps out of them.
    let mut pieces = Vec::with_capacity(2 * FITTED_CRACKS + 1);
    let mut record = |c: Crack| pieces.push((vector(add(c.texel, scaled(origin, -1))), vector(c.side.step())));
    record(crack);
    for step in [crack.side.along(), scaled(crack.side.along(), -1)] {
        let (mut at, mut step) = (crack, step);
        for _ in 0..FITTED_CRACKS {
            (at, step) = follow(texels, at, step)?;
            record(at);
        }
    }
    let count = pieces.len() as f64;
    let mean = pieces.iter().map(|(p, n)| *p + 0.5 * *n).sum::<DVec2>() / count;
    let (mut xx, mut xy, mut yy) = (0.0, 0.0, 0.0);
    for (p, n) in &pieces {
        let d = *p + 0.5 * *n - mean;
        xx += d.x * d.x;
        xy += d.x * d.y;
        yy += d.y * d.y;
    }
    // Principal axis of the midpoints.
    let angle = 0.5 * (2.0 * xy).atan2(xx - yy);
    let outwards: DVec2 = pieces.iter().map(|(_, n)| *n).sum();
    let mut normal = DVec2::new(-angle.sin(), angle.cos());
    if normal.dot(outwards) < 0.0 {
        normal = -normal;
    }
    let inside = pieces.iter().map(|(p, _)| normal.dot(*p)).fold(f64::NEG_INFINITY, f64::max);
    let outside = pieces.iter().map(|(p, n)| normal.dot(*p + *n)).fold(f64::INFINITY, f64::min);
    (inside < outside).then_some(FittedLine { origin, normal, offset: 0.5 * (inside + outside) })
}

fn vector(v: [i64; 2]) -> DVec2 {
    DVec2::new(v[0] as f64, v[1] as f64)
}
