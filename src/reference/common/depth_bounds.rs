//! Mirror of `glsl/common/depth_bounds.comp`.

use crate::technique::common::depth_bounds::BLOCKS;
use glam::{DVec2, dvec2};

/// Bounds of the depths in a block: the texel at `t` from the block's centre has a depth between `slope . t + low` and
/// `slope . t + high`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Bounds {
    /// Depth slope per texel.
    pub slope: DVec2,
    /// Smallest remainder, in depth.
    pub low: f64,
    /// Largest remainder, in depth.
    pub high: f64,
}

impl From<[f32; 4]> for Bounds {
    /// Reads the bounds from a texel of the pass's image.
    fn from(v: [f32; 4]) -> Self {
        let [x, y, low, high] = v.map(f64::from);
        Self { slope: dvec2(x, y), low, high }
    }
}

/// Bounds at one block size.
#[derive(Clone, Debug, PartialEq)]
pub struct Level {
    /// Side of a block, texels.
    pub block: usize,
    /// Number of blocks across and down.
    pub size: [usize; 2],
    /// Bounds of the blocks, row by row from the top.
    pub bounds: Vec<Bounds>,
}

impl Level {
    /// Returns the bounds of a block.
    pub fn at(&self, block: [usize; 2]) -> Bounds {
        self.bounds[block[1] * self.size[0] + block[0]]
    }

    /// Returns the number of texels that lie outside their block's bounds by more than `tolerance`. Texels outside the
    /// map count as 1. This is the contract of the pass, checked from the texels alone.
    pub fn violations(&self, shadow_map: &[f32], map_size: [u32; 2], tolerance: f64) -> usize {
        let mut count = 0;
        for y in 0..self.size[1] * self.block {
            for x in 0..self.size[0] * self.block {
                let b = self.at([x / self.block, y / self.block]);
                let half = 0.5 * (self.block as f64 - 1.0);
                let t = dvec2((x % self.block) as f64 - half, (y % self.block) as f64 - half);
                let rest = depth(shadow_map, map_size, [x, y]) - b.slope.dot(t);
                // Written so that NaN counts.
                let holds = rest >= b.low - tolerance && rest <= b.high + tolerance;
                count += usize::from(!holds);
            }
        }
        count
    }
}

fn depth(shadow_map: &[f32], map_size: [u32; 2], texel: [usize; 2]) -> f64 {
    let [w, h] = map_size.map(|n| n as usize);
    if texel[0] < w && texel[1] < h { shadow_map[texel[1] * w + texel[0]].into() } else { 1.0 }
}

/// Returns all levels of a shadow map, smallest blocks first. Each covers the map rounded up to whole blocks of the
/// largest size.
pub fn blocks(shadow_map: &[f32], map_size: [u32; 2]) -> [Level; BLOCKS.len()] {
    let mut parent = first_level(shadow_map, map_size);
    BLOCKS.map(|block| {
        if block as usize > parent.block {
            parent = next_level(&parent);
        }
        parent.clone()
    })
}

/// Returns the level of the smallest blocks.
pub fn first_level(shadow_map: &[f32], map_size: [u32; 2]) -> Level {
    let block = BLOCKS[0] as usize;
    let largest = BLOCKS[BLOCKS.len() - 1] as usize;
    let size = map_size.map(|n| (n as usize).div_ceil(largest) * (largest / block));
    let bounds = (0..size[0] * size[1]).map(|i| {
        let first = [i % size[0] * block, i / size[0] * block];
        let at = |x: usize, y: usize| depth(shadow_map, map_size, [first[0] + x, first[1] + y]);
        let mut slope = None;
        for y in (0..block).step_by(2) {
            for x in (0..block).step_by(2) {
                let (a, b, c, d) = (at(x, y), at(x + 1, y), at(x, y + 1), at(x + 1, y + 1));
                // An empty texel lies on no surface.
                if a.max(b).max(c).max(d) < 1.0 {
                    let s = 0.5 * dvec2(b - a + d - c, c - a + d - b);
                    slope = Some(slope.map_or(s, |other| flatter(other, s)));
                }
            }
        }
        let slope = useful(slope.unwrap_or(DVec2::ZERO));
        let rest = |x: usize, y: usize| at(x, y) - slope.dot(dvec2(x as f64, y as f64) - 0.5 * (block as f64 - 1.0));
        let texels = (0..block * block).map(|k| rest(k % block, k / block));
        let (low, high) = texels.fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), d| (l.min(d), h.max(d)));
        let rounding = rounding(slope, block as f64);
        Bounds { slope, low: low - rounding, high: high + rounding }
    });
    Level { block, size, bounds: bounds.collect() }
}

/// Returns the level with twice the block size.
pub fn next_level(level: &Level) -> Level {
    let size = level.size.map(|n| n / 2);
    let child_size = level.block as f64;
    let bounds = (0..size[0] * size[1]).map(|i| {
        let at = |side: usize| level.at([2 * (i % size[0]) + side % 2, 2 * (i / size[0]) + side / 2]);
        let slope = flatter(flatter(at(0).slope, at(1).slope), flatter(at(2).slope, at(3).slope));
        let mut parent = Bounds { slope, low: f64::INFINITY, high: f64::NEG_INFINITY };
        for side in 0..4 {
            let child = at(side);
            let offset = (dvec2((side % 2) as f64, (side / 2) as f64) - 0.5) * child_size;
            let turn = (child.slope - slope).abs();
            let spread = (turn.x + turn.y) * 0.5 * (child_size - 1.0) + rounding(turn + slope.abs(), child_size);
            let shift = slope.dot(offset);
            parent.low = parent.low.min(child.low - shift - spread);
            parent.high = parent.high.max(child.high - shift + spread);
        }
        parent
    });
    Level { block: 2 * level.block, size, bounds: bounds.collect() }
}

fn rounding(slope: DVec2, texels: f64) -> f64 {
    let reach = (slope.x.abs() + slope.y.abs()) * texels;
    if reach == 0.0 { 0.0 } else { 3e-7 + 3e-7 * reach }
}

fn useful(slope: DVec2) -> DVec2 {
    let keep = |s: f64| if s.abs() < 1e-7 { 0.0 } else { s };
    dvec2(keep(slope.x), keep(slope.y))
}

fn flatter(a: DVec2, b: DVec2) -> DVec2 {
    let pick = |a: f64, b: f64| if a.abs() < b.abs() { a } else { b };
    dvec2(pick(a.x, b.x), pick(a.y, b.y))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_ramp_has_bounds_as_narrow_as_the_rounding() {
        let size = [100u32, 70];
        let ramp: Vec<f32> = (0..size[0] * size[1]).map(|i| (i % size[0]) as f32 * 0.005).collect();
        for level in blocks(&ramp, size) {
            assert_eq!(level.violations(&ramp, size, 0.0), 0);
            let b = level.at([0, 0]);
            assert!((b.slope.x - 0.005).abs() < 1e-6 && b.slope.y.abs() < 1e-6, "{b:?}");
            assert!(b.high - b.low < 1e-4, "blocks of {}: {b:?}", level.block);
            // The last block lies partly outside the map, where all depths are 1.
            let last = level.at([level.size[0] - 1, level.size[1] - 1]);
            assert!(last.high >= 1.0 - 0.005 * 64.0, "{last:?}");
        }
    }

    #[test]
    fn a_texel_out_of_bounds_is_counted() {
        let size = [64u32, 64];
        let mut map = vec![0.5f32; 64 * 64];
        let levels = blocks(&map, size);
        map[1000] = 0.25;
        for level in &levels {
            assert_eq!(level.violations(&map, size, 1e-6), 1);
        }
    }
}
