//! sRGB encoding, and false colours of errors.

/// Colour of pixels outside the mask, which are not judged.
pub const NOT_JUDGED: [u8; 3] = [58, 60, 66];

/// Stops of the error scale for `|error|` 0, 0.5 and 1, as sRGB. Both arms have about the same lightness at the same
/// error. All common kinds of colour blindness can tell red from blue. The neutral middle is the lightest, so an error
/// of either sign is darker.
const TOO_DARK: [[u8; 3]; 3] = [NO_ERROR, [222, 94, 71], [128, 12, 30]];
const TOO_LIGHT: [[u8; 3]; 3] = [NO_ERROR, [78, 145, 208], [20, 60, 142]];
const NO_ERROR: [u8; 3] = [240, 240, 240];

/// Returns the colour of an error `test - truth` in `[-1, 1]`: red for too dark (negative), blue for too light
/// (positive), light grey for none. Values outside are clamped; NaN gives [`NOT_JUDGED`].
///
/// The scale is linear in Oklab, hence in even perceptual steps, through three stops per arm.
pub fn false_color(error: f32) -> [u8; 3] {
    if error.is_nan() {
        return NOT_JUDGED;
    }
    let stops = if error < 0.0 { TOO_DARK } else { TOO_LIGHT };
    let t = 2.0 * error.abs().min(1.0);
    let k = if t < 1.0 { 0 } else { 1 };
    let (a, b) = (oklab_from_srgb(stops[k]), oklab_from_srgb(stops[k + 1]));
    let f = t - k as f32;
    srgb_from_oklab(std::array::from_fn(|i| a[i] + (b[i] - a[i]) * f))
}

/// Returns the 8-bit sRGB code of a linear value. Values outside `[0, 1]` are clamped; NaN gives 0.
pub fn srgb_from_linear(linear: f32) -> u8 {
    let v = if linear.is_nan() { 0.0 } else { linear.clamp(0.0, 1.0) };
    let encoded = if v <= 0.003_130_8 { 12.92 * v } else { 1.055 * v.powf(1.0 / 2.4) - 0.055 };
    (255.0 * encoded + 0.5) as u8
}

/// Returns the linear value in `[0, 1]` of an 8-bit sRGB code.
pub fn linear_from_srgb(code: u8) -> f32 {
    let v = f32::from(code) / 255.0;
    if v <= 0.040_45 { v / 12.92 } else { ((v + 0.055) / 1.055).powf(2.4) }
}

/// Converts sRGB to Oklab (Ottosson 2020): lightness and two opponent axes.
fn oklab_from_srgb(rgb: [u8; 3]) -> [f32; 3] {
    let [r, g, b] = rgb.map(linear_from_srgb);
    let l = (0.412_221_46 * r + 0.536_332_55 * g + 0.051_445_995 * b).cbrt();
    let m = (0.211_903_5 * r + 0.680_699_5 * g + 0.107_396_96 * b).cbrt();
    let s = (0.088_302_46 * r + 0.281_718_85 * g + 0.629_978_7 * b).cbrt();
    [
        0.210_454_26 * l + 0.793_617_8 * m - 0.004_072_047 * s,
        1.977_998_5 * l - 2.428_592_2 * m + 0.450_593_7 * s,
        0.025_904_037 * l + 0.782_771_77 * m - 0.808_675_77 * s,
    ]
}

fn srgb_from_oklab([lightness, a, b]: [f32; 3]) -> [u8; 3] {
    let l = (lightness + 0.396_337_78 * a + 0.215_803_76 * b).powi(3);
    let m = (lightness - 0.105_561_346 * a - 0.063_854_17 * b).powi(3);
    let s = (lightness - 0.089_484_18 * a - 1.291_485_5 * b).powi(3);
    [
        4.076_741_7 * l - 3.307_711_6 * m + 0.230_969_94 * s,
        -1.268_438 * l + 2.609_757_4 * m - 0.341_319_38 * s,
        -0.004_196_086_3 * l - 0.703_418_6 * m + 1.707_614_7 * s,
    ]
    .map(srgb_from_linear)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn srgb_codes_survive_the_round_trip() {
        for code in 0..=255 {
            assert_eq!(srgb_from_linear(linear_from_srgb(code)), code);
        }
        assert_eq!(srgb_from_linear(0.5), 188);
        assert_eq!([srgb_from_linear(-1.0), srgb_from_linear(2.0), srgb_from_linear(f32::NAN)], [0, 255, 0]);
    }

    #[test]
    fn oklab_has_its_published_values() {
        // sRGB red and white in Oklab.
        for (rgb, lab) in [([255, 0, 0], [0.627_96, 0.224_86, 0.125_85]), ([255; 3], [1.0, 0.0, 0.0])] {
            let found = oklab_from_srgb(rgb);
            (0..3).for_each(|i| assert!((found[i] - lab[i]).abs() < 1e-4, "{found:?}"));
        }
        for rgb in [[1, 2, 3], [200, 10, 90], [255, 255, 0], [13, 200, 255]] {
            assert_eq!(srgb_from_oklab(oklab_from_srgb(rgb)), rgb);
        }
    }

    #[test]
    fn the_error_scale_is_red_below_blue_above_and_evenly_darker() {
        assert_eq!(false_color(0.0), NO_ERROR);
        assert_eq!([false_color(-1.0), false_color(-9.0)], [TOO_DARK[2]; 2]);
        assert_eq!([false_color(1.0), false_color(9.0)], [TOO_LIGHT[2]; 2]);
        assert_eq!(false_color(f32::NAN), NOT_JUDGED);
        let lightness = |e: f32| oklab_from_srgb(false_color(e))[0];
        for i in 1..=50 {
            let e = i as f32 / 50.0;
            let (dark, light) = (false_color(-e), false_color(e));
            assert!(dark[0] > dark[2] && light[2] > light[0], "{e}: {dark:?} {light:?}");
            assert!(lightness(e) < lightness(e - 0.02) && lightness(-e) < lightness(0.02 - e), "{e}");
            assert!((lightness(e) - lightness(-e)).abs() < 0.01, "{e}");
        }
    }
}
