//! Mirror of `glsl/common/hsm.comp` and of `hsmBounds` in `hsm.glsl`. It is exact because minimum and maximum do not
//! round.

use super::view::FrameData;
use crate::technique::common::blocker_search::SearchWindow;

/// One level of the hierarchical shadow map.
#[derive(Clone, Debug, PartialEq)]
pub struct Level {
    /// Number of entries across and down.
    pub size: [usize; 2],
    /// Smallest and largest depth of each entry, row by row from the top.
    pub bounds: Vec<[f32; 2]>,
}

/// All levels of a map: entries of 2, 4, 8 ... texels, until one entry covers the map.
#[derive(Clone, Debug, PartialEq)]
pub struct Hsm {
    /// Levels from the finest to the coarsest.
    pub levels: Vec<Level>,
    map_size: [i64; 2],
}

fn merge(a: [f32; 2], b: [f32; 2]) -> [f32; 2] {
    [a[0].min(b[0]), a[1].max(b[1])]
}

impl Hsm {
    /// Builds the pyramid that narrows the windows of a blocker search, if it has such windows.
    pub(crate) fn of_search(data: &FrameData<'_>, window: SearchWindow) -> Option<Self> {
        (window == SearchWindow::Blockers).then(|| Self::new(data.shadow_map, data.constants.map_size))
    }

    /// Builds the pyramid from a map's depths, row by row from the top. Texels outside the map count as 1.
    pub fn new(shadow_map: &[f32], map_size: [u32; 2]) -> Self {
        let (extent, count) = crate::technique::common::hsm::levels(map_size);
        let mut levels: Vec<Level> = vec![];
        for l in 0..count {
            let size = extent.map(|n| (n >> l).max(1) as usize);
            let entry = |i: usize| {
                let parts = [[0, 0], [1, 0], [0, 1], [1, 1]].map(|[dx, dy]| {
                    let at = [2 * (i % size[0]) + dx, 2 * (i / size[0]) + dy];
                    let (side, texel): ([usize; 2], &dyn Fn(usize) -> [f32; 2]) = match levels.last() {
                        None => (map_size.map(|n| n as usize), &|i| [shadow_map[i]; 2]),
                        Some(finer) => (finer.size, &|i| finer.bounds[i]),
                    };
                    if at[0] < side[0] && at[1] < side[1] { texel(at[1] * side[0] + at[0]) } else { [1.0; 2] }
                });
                parts.into_iter().fold([f32::INFINITY, f32::NEG_INFINITY], merge)
            };
            let bounds = (0..size[0] * size[1]).map(entry).collect();
            levels.push(Level { size, bounds });
        }
        Self { levels, map_size: map_size.map(i64::from) }
    }

    /// Mirror of `hsmBounds`: returns the smallest and largest depth of the entries over texels `first` to `last`, both
    /// included. The window must overlap the map.
    pub fn bounds(&self, first: [i64; 2], last: [i64; 2]) -> [f32; 2] {
        let clamped = |t: [i64; 2]| [t[0].clamp(0, self.map_size[0] - 1), t[1].clamp(0, self.map_size[1] - 1)];
        let (a, b) = (clamped(first), clamped(last));
        let mut bounds = if (a, b) == (first, last) { [1.0, 0.0] } else { [1.0, 1.0] };
        let wider = (b[0] - a[0]).max(b[1] - a[1]);
        let touched = |shift: u32| (0..2).any(|i| (b[i] >> shift) - (a[i] >> shift) > 3);
        let shift = wider.checked_ilog2().unwrap_or(0).saturating_sub(1).max(1);
        let shift = if touched(shift) { shift + 1 } else { shift };
        let level = &self.levels[shift as usize - 1];
        for y in a[1] >> shift..=b[1] >> shift {
            for x in a[0] >> shift..=b[0] >> shift {
                bounds = merge(bounds, level.bounds[y as usize * level.size[0] + x as usize]);
            }
        }
        bounds
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand_pcg::Pcg32;
    use rand_pcg::rand_core::{Rng as _, SeedableRng as _};

    fn brute(map: &[f32], size: [u32; 2], first: [i64; 2], last: [i64; 2]) -> [f32; 2] {
        let mut bounds = [f32::INFINITY, f32::NEG_INFINITY];
        for y in first[1]..=last[1] {
            for x in first[0]..=last[0] {
                let inside = x >= 0 && y >= 0 && x < i64::from(size[0]) && y < i64::from(size[1]);
                let d = if inside { map[(y * i64::from(size[0]) + x) as usize] } else { 1.0 };
                bounds = merge(bounds, [d, d]);
            }
        }
        bounds
    }

    /// Counts the windows whose bounds are narrower than their texels', and those whose bounds are looser than the
    /// bounds of the window widened by its own size.
    fn violations(hsm: &Hsm, map: &[f32], size: [u32; 2], random: &mut Pcg32) -> (usize, usize) {
        let (mut narrow, mut loose) = (0, 0);
        for _ in 0..200 {
            let mut side = |i: usize| {
                let n = i64::from(size[i]);
                let wide = 1i64 << (random.next_u32() % (n.ilog2() + 2));
                // The window overlaps the map.
                let first = i64::from(random.next_u32()) % (n + 5) - 5;
                (first, (first + i64::from(random.next_u32()) % wide).max(0))
            };
            let (x, y) = (side(0), side(1));
            let (first, last) = ([x.0, y.0], [x.1, y.1]);
            let found = hsm.bounds(first, last);
            let exact = brute(map, size, first, last);
            narrow += usize::from(found[0] > exact[0] || found[1] < exact[1]);
            let by = (x.1 - x.0).max(y.1 - y.0).max(1);
            let wide = brute(map, size, first.map(|t| t - by), last.map(|t| t + by));
            loose += usize::from(found[0] < wide[0] || found[1] > wide[1]);
        }
        (narrow, loose)
    }

    #[test]
    fn bounds_hold_and_are_tight() {
        let mut random = Pcg32::seed_from_u64(7);
        for size in [[1, 1], [2, 2], [64, 64], [101, 67], [5, 300], [333, 256]] {
            let map: Vec<f32> = (0..size[0] * size[1]).map(|_| random.next_u32() as f32 / 4.3e9).collect();
            let hsm = Hsm::new(&map, size);
            assert_eq!(hsm.levels.last().unwrap().size, [1, 1], "{size:?}");
            assert_eq!(violations(&hsm, &map, size, &mut random), (0, 0), "{size:?}");
            // Both counts can fail: they are large for a map that has changed since.
            let changed: Vec<f32> = map.iter().map(|d| 0.5 * d - 0.1).collect();
            assert!(violations(&hsm, &changed, size, &mut random).0 > 20, "{size:?}");
            let empty = vec![1.0; map.len()];
            assert!(violations(&hsm, &empty, size, &mut random).1 > 20, "{size:?}");
        }
    }
}
