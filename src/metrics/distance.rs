//! Exact Euclidean distance transform in integers: lower envelope of parabolas after Felzenszwalb and Huttenlocher,
//! "Distance Transforms of Sampled Functions" (2012).

use rayon::prelude::*;

/// Squared distance if there is no feature at all.
pub(crate) const NO_FEATURE: u32 = u32::MAX;

/// Returns the exact squared distance, in cells, from every cell to the nearest one that `is_feature`.
///
/// Cells are in row order. Both sides may have at most 32769 cells, so that a squared distance always fits.
pub(crate) fn squared_distances(is_feature: &[bool], width: usize, height: usize) -> Vec<u32> {
    debug_assert!(is_feature.len() == width * height && width.max(height) <= 32769);
    let mut cells = column_distances(is_feature, width, height);
    if width == 0 {
        return cells;
    }
    cells.par_chunks_mut(width).for_each_init(Envelope::default, |envelope, row| envelope.apply(row));
    cells
}

/// Returns for every cell whether a feature lies at most `radius` cells away.
pub(crate) fn within(is_feature: &[bool], width: usize, height: usize, radius: u32) -> Vec<bool> {
    squared_distances(is_feature, width, height).into_iter().map(|d| d <= radius * radius).collect()
}

/// Returns the distance to the nearest feature of the same column; [`NO_FEATURE`] if the column has none.
fn column_distances(is_feature: &[bool], width: usize, height: usize) -> Vec<u32> {
    let mut cells: Vec<u32> = is_feature.iter().map(|&f| if f { 0 } else { NO_FEATURE }).collect();
    for y in 1..height {
        for i in y * width..(y + 1) * width {
            cells[i] = cells[i].min(cells[i - width].saturating_add(1));
        }
    }
    for y in (1..height).rev() {
        for i in (y - 1) * width..y * width {
            cells[i] = cells[i].min(cells[i + width].saturating_add(1));
        }
    }
    cells
}

/// Lower envelope of the parabolas of one row; reused between rows to save allocations.
#[derive(Default)]
struct Envelope {
    /// Column and height of each parabola that is lowest somewhere, from left to right.
    parabolas: Vec<(i64, i64)>,
    /// First column where each parabola is at least as low as its predecessor.
    from: Vec<i64>,
}

impl Envelope {
    /// Replaces the column distances of a row by squared distances.
    fn apply(&mut self, row: &mut [u32]) {
        self.parabolas.clear();
        self.from.clear();
        for (x, &d) in row.iter().enumerate().filter(|&(_, &d)| d != NO_FEATURE) {
            let (x, h) = (x as i64, i64::from(d) * i64::from(d));
            let mut start = 0;
            while let Some(&(px, ph)) = self.parabolas.last() {
                // First integer column where (c-x)^2 + h <= (c-px)^2 + ph, rounded up.
                let numerator = (h + x * x) - (ph + px * px);
                start = -(-numerator).div_euclid(2 * (x - px));
                let predecessor_start = self.from[self.from.len() - 1];
                if start > predecessor_start {
                    break;
                }
                self.parabolas.pop();
                self.from.pop();
                start = 0;
            }
            // The first parabola starts at column 0.
            self.parabolas.push((x, h));
            self.from.push(if self.parabolas.len() == 1 { 0 } else { start });
        }
        if self.parabolas.is_empty() {
            return; // The row holds NO_FEATURE throughout.
        }
        let mut k = 0;
        for (c, cell) in row.iter_mut().enumerate() {
            let c = c as i64;
            while k + 1 < self.from.len() && self.from[k + 1] <= c {
                k += 1;
            }
            let (x, h) = self.parabolas[k];
            *cell = ((c - x) * (c - x) + h) as u32;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Computes the distances by their definition.
    fn brute(f: &[bool], w: usize, h: usize) -> Vec<u32> {
        let sites: Vec<(i64, i64)> = (0..w * h).filter(|&i| f[i]).map(|i| ((i % w) as i64, (i / w) as i64)).collect();
        (0..w * h)
            .map(|i| {
                let (x, y) = ((i % w) as i64, (i / w) as i64);
                sites.iter().map(|s| ((s.0 - x).pow(2) + (s.1 - y).pow(2)) as u32).min().unwrap_or(NO_FEATURE)
            })
            .collect()
    }

    #[test]
    fn equals_the_definition_on_random_pictures() {
        let mut state = 1u64;
        let mut random = move || {
            state = state.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
            (state >> 33) as u32
        };
        for (w, h) in [(0, 0), (0, 3), (3, 0), (1, 1), (1, 7), (7, 1), (23, 17), (64, 5), (40, 41)] {
            for rarity in [1, 2, 5, 50, 400, u32::MAX] {
                let f: Vec<bool> = (0..w * h).map(|_| random() % rarity == 0).collect();
                assert_eq!(squared_distances(&f, w, h), brute(&f, w, h), "{w}x{h}, one in {rarity}");
            }
        }
    }

    #[test]
    fn the_longest_distance_fits() {
        let (w, h) = (32769, 2);
        let mut f = vec![false; w * h];
        f[0] = true;
        assert_eq!(squared_distances(&f, w, h)[w * h - 1], 32768 * 32768 + 1);
    }
}
