//! Mirror of `glsl/filtering/table_columns.comp`, `table_rows.comp`, `table_means.comp`, `table_unit.glsl` and
//! `summed_area.glsl`.

use super::moments::{Kept, moments_of};
use crate::technique::filtering::moment_kind::Kind;
use glam::{DVec2, dvec2};

/// Returns the integers that a table sums, texel by texel, rounded as `f32`. The moments are exact where the depth is.
///
/// # Panics
/// For kinds that no table holds.
pub fn quantised(depth: f32, kind: Kind, range: f32, scale: f32) -> [u32; 4] {
    unit(moments_of(depth, kind.into(), range), kind).map(|v| (v as f32 * scale + 0.5) as u32)
}

/// Returns the moments as numbers from 0 to 1.
fn unit(m: [f64; 4], kind: Kind) -> [f64; 4] {
    match kind {
        Kind::Variance => [0.5 * m[0] + 0.5, m[1], 0.0, 0.0],
        Kind::Packed => m,
        Kind::Warped | Kind::Powers => panic!("no table of {kind:?}"),
    }
}

/// Returns the table of such integers, row by row from the top: sums modulo 2^32.
pub fn table(texels: &[[u32; 4]], [width, height]: [u32; 2]) -> Vec<[u32; 4]> {
    let (width, height) = (width as usize, height as usize);
    let mut table = vec![[0u32; 4]; width * height];
    for y in 0..height {
        let mut row = [0u32; 4];
        for x in 0..width {
            let i = y * width + x;
            for c in 0..4 {
                row[c] = row[c].wrapping_add(texels[i][c]);
                let above = if y == 0 { 0 } else { table[i - width][c] };
                table[i][c] = above.wrapping_add(row[c]);
            }
        }
    }
    table
}

/// Returns the mean over the texels `first` to `end`, without `end`, as a share of `scale`; `table` is of
/// [`table`] or of the GPU. Texels outside the map count as `outside`.
pub fn mean(
    table: &[[u32; 4]],
    [width, height]: [u32; 2],
    first: [i64; 2],
    end: [i64; 2],
    (scale, outside): (f32, [f64; 4]),
) -> [f64; 4] {
    let size = [i64::from(width), i64::from(height)];
    let up_to = |x: i64, y: i64| {
        let (x, y) = (x.clamp(0, size[0]), y.clamp(0, size[1]));
        if x == 0 || y == 0 { [0; 4] } else { table[((y - 1) * size[0] + x - 1) as usize] }
    };
    let corners = [up_to(end[0], end[1]), up_to(first[0], end[1]), up_to(end[0], first[1]), up_to(first[0], first[1])];
    let inside: i64 = (0..2).map(|i| end[i].clamp(0, size[i]) - first[i].clamp(0, size[i])).product();
    let area: i64 = (0..2).map(|i| end[i] - first[i]).product();
    std::array::from_fn(|c| {
        let sum = corners[0][c].wrapping_sub(corners[1][c]).wrapping_sub(corners[2][c]).wrapping_add(corners[3][c]);
        (f64::from(sum) / f64::from(scale) + (area - inside) as f64 * outside[c]) / area as f64
    })
}

/// Sums that do not wrap around, for windows that cover parts of texels.
pub struct Sums {
    size: [usize; 2],
    /// Sums over the texels left of and above each corner of texels, row by row, in `f64`: exact below 2^53.
    corners: Vec<[f64; 4]>,
}

impl Sums {
    /// Takes a table of [`table`] or of the GPU.
    pub fn of(table: &[[u32; 4]], size: [u32; 2]) -> Self {
        let [width, height] = size.map(|n| n as usize);
        let mut corners = vec![[0.0; 4]; (width + 1) * (height + 1)];
        let entry = |x: usize, y: usize| if x == 0 || y == 0 { [0; 4] } else { table[(y - 1) * width + x - 1] };
        for y in 1..=height {
            for x in 1..=width {
                let (own, left, above, both) = (entry(x, y), entry(x - 1, y), entry(x, y - 1), entry(x - 1, y - 1));
                let at = |x: usize, y: usize| y * (width + 1) + x;
                corners[at(x, y)] = std::array::from_fn(|c| {
                    let texel = own[c].wrapping_sub(left[c]).wrapping_sub(above[c]).wrapping_add(both[c]);
                    f64::from(texel) + corners[at(x - 1, y)][c] + corners[at(x, y - 1)][c]
                        - corners[at(x - 1, y - 1)][c]
                });
            }
        }
        Self { size: [width, height], corners }
    }

    /// Returns the integral over everything left of and above a place in the map.
    fn up_to(&self, place: DVec2) -> [f64; 4] {
        let last = dvec2(self.size[0] as f64, self.size[1] as f64);
        let first = place.floor().clamp(DVec2::ZERO, last - 1.0);
        let f = place - first;
        let corner =
            |dx: usize, dy: usize| self.corners[(first.y as usize + dy) * (self.size[0] + 1) + first.x as usize + dx];
        let (a, b, c, d) = (corner(0, 0), corner(1, 0), corner(0, 1), corner(1, 1));
        std::array::from_fn(|i| {
            (1.0 - f.y) * ((1.0 - f.x) * a[i] + f.x * b[i]) + f.y * ((1.0 - f.x) * c[i] + f.x * d[i])
        })
    }

    /// Returns the mean over a window in the map, as a share of `scale`. Texels at its rim count by the area that it
    /// covers.
    pub fn mean(&self, low: DVec2, high: DVec2, scale: f32) -> [f64; 4] {
        let (a, b) = (self.up_to(high), self.up_to(dvec2(low.x, high.y)));
        let (c, d) = (self.up_to(dvec2(high.x, low.y)), self.up_to(low));
        let area = (high - low).element_product();
        std::array::from_fn(|i| (a[i] - b[i] - c[i] + d[i]) / (area * f64::from(scale)))
    }
}

/// Returns the moments outside the map, as numbers from 0 to 1.
pub fn outside(kind: Kind, range: f32) -> [f64; 4] {
    unit(moments_of(1.0, kind.into(), range), kind)
}

impl From<Kind> for Kept {
    fn from(kind: Kind) -> Self {
        match kind {
            Kind::Variance => Self::Variance,
            Kind::Packed => Self::Packed,
            Kind::Powers => Self::Powers,
            Kind::Warped => Self::Warped([0.0; 2]),
        }
    }
}
