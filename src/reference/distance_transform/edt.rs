//! Mirror of `glsl/distance_transform/edt_*.comp`: the nearest seed of every pixel, in integers, by brute force.
//!
//! All passes of a transform work towards the one result that [`nearest`] defines, so they share this mirror.

use crate::technique::distance_transform::NO_SEED;
use rayon::prelude::*;

/// Mask of the pixels that are seeds, row by row from the top.
#[derive(Clone, Debug)]
pub struct Mask {
    /// Width and height in pixels, at most 65535 each.
    pub size: [usize; 2],
    /// One value per pixel, `size[0] * size[1]` in all; `true` for a seed.
    pub seeds: Vec<bool>,
}

impl Mask {
    /// Returns whether a pixel is a seed.
    pub fn at(&self, x: usize, y: usize) -> bool {
        self.seeds[y * self.size[0] + x]
    }

    /// Packs the mask into words as the passes take them: see
    /// [`crate::technique::distance_transform::Edt::seed_bits`].
    pub fn seed_bits(&self) -> Vec<u32> {
        let [width, height] = self.size;
        let mut words = vec![0; width * height.div_ceil(32)];
        for (i, _) in self.seeds.iter().enumerate().filter(|s| *s.1) {
            let (x, y) = (i % width, i / width);
            words[x + width * (y / 32)] |= 1 << (y % 32);
        }
        words
    }
}

/// Order of a pixel's seeds: squared distance, then y, then x.
type Rank = (u64, usize, usize);

fn rank(pixel: [usize; 2], seed: [usize; 2]) -> Rank {
    let d = [0, 1].map(|i| pixel[i].abs_diff(seed[i]) as u64);
    (d[0] * d[0] + d[1] * d[1], seed[1], seed[0])
}

fn label(best: Option<Rank>, radius: Option<u32>) -> u32 {
    match best {
        Some((squared, y, x)) if radius.is_none_or(|r| squared <= u64::from(r).pow(2)) => x as u32 | (y as u32) << 16,
        _ => NO_SEED,
    }
}

/// Returns the label `x | y << 16` of every pixel's nearest seed by comparing it with every seed. The label is
/// [`NO_SEED`] where no seed lies within the radius in pixels. Among equally near seeds the smallest y wins, then the
/// smallest x.
pub fn nearest(mask: &Mask, radius: Option<u32>) -> Vec<u32> {
    let [width, height] = mask.size;
    let pixels = |i: usize| [i % width, i / width];
    let seeds: Vec<_> = (0..width * height).filter(|&i| mask.seeds[i]).map(pixels).collect();
    let best = |i| label(seeds.iter().map(|&s| rank(pixels(i), s)).min(), radius);
    (0..width * height).into_par_iter().map(best).collect()
}

/// Computes the same as [`nearest`], faster for large images. It first finds the nearest seed of every column, then
/// searches outwards along each pixel's row until no column can be nearer.
pub fn nearest_fast(mask: &Mask, radius: Option<u32>) -> Vec<u32> {
    let [width, height] = mask.size;
    let columns: Vec<Vec<usize>> =
        (0..width).into_par_iter().map(|x| (0..height).filter(|&y| mask.at(x, y)).collect()).collect();
    let live: Vec<usize> = (0..width).filter(|&x| !columns[x].is_empty()).collect();
    let row = |y: usize| {
        // Nearest seed of each column that has seeds, seen from this row.
        let seeds: Vec<[usize; 2]> = live
            .iter()
            .map(|&x| {
                let below = columns[x].partition_point(|&s| s < y);
                let near = &columns[x][below.saturating_sub(1)..columns[x].len().min(below + 1)];
                [x, near.iter().copied().min_by_key(|&s| (s.abs_diff(y), s)).unwrap_or(0)]
            })
            .collect();
        (0..width)
            .map(|x| {
                let mut best: Option<Rank> = None;
                let right = live.partition_point(|&c| c < x);
                let mut visit = |seed: &[usize; 2]| {
                    let gap = seed[0].abs_diff(x) as u64;
                    // A column as far away as the best seed may still hold a seed just as near.
                    if best.is_some_and(|b| gap * gap > b.0) {
                        return false;
                    }
                    let candidate = rank([x, y], *seed);
                    best = Some(best.map_or(candidate, |b| b.min(candidate)));
                    true
                };
                // Search both sides in turn: one side alone could run far before the other shows a near seed.
                let (mut left, mut right) = (seeds[..right].iter().rev(), seeds[right..].iter());
                let (mut go_left, mut go_right) = (true, true);
                while go_left || go_right {
                    go_left = go_left && left.next().is_some_and(&mut visit);
                    go_right = go_right && right.next().is_some_and(&mut visit);
                }
                label(best, radius)
            })
            .collect::<Vec<_>>()
    };
    (0..height).into_par_iter().flat_map_iter(row).collect()
}

/// Returns the squared distance in pixels from pixel `i` (row by row) to its label's seed; `None` without one.
pub fn squared_distance(width: usize, i: usize, label: u32) -> Option<u64> {
    let seed = [(label & 0xffff) as usize, (label >> 16) as usize];
    (label != NO_SEED).then(|| rank([i % width, i / width], seed).0)
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand_pcg::Pcg32;
    use rand_pcg::rand_core::Rng as _;

    fn mask(size: [usize; 2], seeds: &[[usize; 2]]) -> Mask {
        let mut mask = Mask { size, seeds: vec![false; size[0] * size[1]] };
        seeds.iter().for_each(|s| mask.seeds[s[1] * size[0] + s[0]] = true);
        mask
    }

    #[test]
    fn ties_go_up_then_left() {
        // Four seeds around the middle of 3 x 3 pixels, all at distance 1 from it.
        let cross = mask([3, 3], &[[1, 0], [0, 1], [2, 1], [1, 2]]);
        assert_eq!(nearest(&cross, None)[4], 1);
        let sides = mask([3, 1], &[[0, 0], [2, 0]]);
        assert_eq!(nearest(&sides, None), [0, 0, 2]);
        assert_eq!(nearest(&sides, Some(0)), [0, NO_SEED, 2]);
        assert_eq!(nearest(&mask([2, 2], &[]), None), [NO_SEED; 4]);
        // The radius is inclusive and applies to the distance, not to its components.
        let corner = mask([5, 4], &[[0, 0]]);
        let within = |r| nearest(&corner, Some(r)).iter().filter(|l| **l != NO_SEED).count();
        assert_eq!([0, 1, 2, 3, 4, 5].map(within), [1, 3, 6, 11, 16, 20]);
    }

    #[test]
    fn the_fast_form_equals_the_plain_one() {
        let mut random = Pcg32::new(7, 1);
        for case in 0..400u32 {
            let mut below = |n: u32| (random.next_u32() % n) as usize;
            let size = [1 + below(40), 1 + below(40)];
            let density = [1, 3, 20, 50, 200, 1000][below(6)];
            let seeds = (0..size[0] * size[1]).map(|_| below(1000) < density).collect();
            let mask = Mask { size, seeds };
            let radius = [None, Some(0), Some(1), Some(5), Some(30)][below(5)];
            assert_eq!(nearest(&mask, radius), nearest_fast(&mask, radius), "case {case}: {size:?}, {radius:?}");
        }
    }

    #[test]
    fn bits_are_by_column() {
        let bits = mask([3, 65], &[[0, 0], [1, 31], [1, 32], [2, 64]]).seed_bits();
        assert_eq!(bits, [1, 1 << 31, 0, 0, 1, 0, 0, 0, 1]);
    }
}
