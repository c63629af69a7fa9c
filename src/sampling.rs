//! Stratified sample points on the light.

/// A bijective scramble of 64 bits (the finaliser of SplitMix64).
pub(crate) fn mix(mut x: u64) -> u64 {
    x = x.wrapping_add(0x9E37_79B9_7F4A_7C15);
    x = (x ^ (x >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
    x = (x ^ (x >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
    x ^ (x >> 31)
}

/// Points of the unit square: one in each stratum of a grid, jittered by a hash of pixel and seed.
#[derive(Clone, Copy)]
pub struct Stratified {
    grid: u32,
    base: u64,
}

impl Stratified {
    /// Makes the points of `grid * grid` strata.
    pub fn new(grid: u32, pixel: u64, seed: u64) -> Self {
        Self { grid, base: mix(mix(seed).wrapping_add(pixel)) }
    }

    /// The `i`-th point, `i < grid * grid`; both coordinates in `[0, 1)`.
    pub fn point(&self, i: u32) -> [f64; 2] {
        let h = mix(self.base.wrapping_add(u64::from(i)));
        let unit = |bits: u32| f64::from(bits) * (-32f64).exp2();
        let place = |c: u32, bits: u32| (f64::from(c) + unit(bits)) / f64::from(self.grid);
        [place(i % self.grid, h as u32), place(i / self.grid, (h >> 32) as u32)]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_cell_holds_one_point_and_pixels_differ() {
        let s = Stratified::new(8, 5, 1);
        for i in 0..64 {
            let [x, y] = s.point(i);
            assert_eq!(((8.0 * x) as u32, (8.0 * y) as u32), (i % 8, i / 8));
        }
        assert_ne!(s.point(3), Stratified::new(8, 6, 1).point(3));
        assert_ne!(s.point(3), Stratified::new(8, 5, 2).point(3));
    }
}
