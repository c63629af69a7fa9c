//! Mirror of `glsl/common/accumulate.comp`.

/// Returns the fraction of samples in which each pixel is lit. Every sample holds one visibility per pixel.
///
/// All samples must have the length of the first. Without samples the image is empty.
pub fn average(samples: &[Vec<f32>]) -> Vec<f64> {
    let count = samples.len() as f64;
    let pixels = samples.first().map_or(0, Vec::len);
    let lit = |i: usize| samples.iter().filter(|s| s[i] >= 0.5).count() as f64;
    (0..pixels).map(|i| lit(i) / count).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn halves_count_as_lit() {
        let samples = [vec![0.0, 1.0, 0.5], vec![0.49, 1.0, 0.5], vec![1.0, 1.0, 0.0]];
        assert_eq!(average(&samples), [1.0 / 3.0, 1.0, 2.0 / 3.0]);
        assert_eq!(average(&[]), [0.0; 0]);
    }
}
