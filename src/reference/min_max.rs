//! Mirror of `glsl/pass/min_max.comp`. Minima and maxima are exact, so it works in `f32`.

use crate::pass::min_max::BLOCKS;

/// Block minima and maxima at one block size.
#[derive(Clone, Debug, PartialEq)]
pub struct Level {
    /// Blocks across and down.
    pub size: [u32; 2],
    /// (smallest, largest) depth of every block; what lies outside the map counts as 1.
    pub range: Vec<[f32; 2]>,
}

/// All levels of a shadow map, smallest blocks first; each covers the map rounded up to whole largest blocks.
///
/// `shadow_map` holds `map_size[0] * map_size[1]` depths in `[0, 1]`.
pub fn blocks(shadow_map: &[f32], map_size: [u32; 2]) -> [Level; BLOCKS.len()] {
    let largest = BLOCKS[BLOCKS.len() - 1];
    BLOCKS.map(|block| {
        let size = map_size.map(|n| n.div_ceil(largest) * (largest / block));
        // Straight from the texels at every level: independent of the pass's way of merging.
        let range = (0..size[0] * size[1]).map(|i| {
            let first = [i % size[0] * block, i / size[0] * block];
            let mut range = [1.0f32, 0.0];
            for y in first[1]..first[1] + block {
                for x in first[0]..first[0] + block {
                    let inside = x < map_size[0] && y < map_size[1];
                    let depth = if inside { shadow_map[(y * map_size[0] + x) as usize] } else { 1.0 };
                    range = [range[0].min(depth), range[1].max(depth)];
                }
            }
            range
        });
        Level { size, range: range.collect() }
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn blocks_of_a_ramp_are_its_ends() {
        let size = [100u32, 70];
        let ramp: Vec<f32> = (0..size[0] * size[1]).map(|i| (i % size[0]) as f32 / 100.0).collect();
        let levels = blocks(&ramp, size);
        assert_eq!(levels[0].size, [16, 16]);
        assert_eq!(levels[0].range[0], [0.0, 0.07]);
        assert_eq!(levels[1].range[1], [0.16, 0.31]);
        assert_eq!(levels[3].size, [2, 2]);
        // Partly outside, and wholly.
        assert_eq!(levels[3].range[1], [0.64, 1.0]);
        assert_eq!(levels[0].range[15], [1.0, 1.0]);
    }
}
