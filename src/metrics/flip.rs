//! FLIP: the difference perceived when one flips between two pictures.

use super::{check_length, pixel_count, sum::sum_rows};
use crate::Result;

/// Viewing distance that [`flip`] assumes, in pixels per degree: a screen 0.7 m and 3840 px wide, seen from 0.7 m.
pub const FLIP_PIXELS_PER_DEGREE: f32 = 67.0;

/// Returns mean and map of the FLIP difference (Andersson et al. 2020, LDR) of two sRGB pictures.
///
/// Both pictures have `size[0] * size[1]` pixels, row by row. Mean and map are in `[0, 1]`, 0 where nothing differs.
/// Use the *shaded* pictures, with the same exposure. Without pixels the mean is 0.
///
/// # Errors
/// Fails for a slice of the wrong length, or a side beyond [`super::MAX_SIDE_PX`].
pub fn flip(test_rgb8: &[[u8; 3]], truth_rgb8: &[[u8; 3]], size: [u32; 2]) -> Result<(f64, Vec<f32>)> {
    let pixels = pixel_count(size)?;
    check_length("the picture under test", test_rgb8.len(), pixels, size)?;
    check_length("the true picture", truth_rgb8.len(), pixels, size)?;
    if pixels == 0 {
        return Ok((0.0, Vec::new()));
    }
    let image =
        |rgb: &[[u8; 3]]| nv_flip::FlipImageRgb8::with_data(size[0], size[1], bytemuck::cast_slice::<_, u8>(rgb));
    let map = nv_flip::flip(image(truth_rgb8), image(test_rgb8), FLIP_PIXELS_PER_DEGREE).to_vec();
    let width = size[0] as usize;
    let [sum] =
        sum_rows(size[1] as usize, |y| [map[y * width..(y + 1) * width].iter().map(|&v| f64::from(v)).sum::<f64>()]);
    Ok((sum / pixels as f64, map))
}
