//! Pictures: 8-bit sRGB in memory, PNG and OpenEXR files, false colours, contact sheets.

mod color;
mod exr;
mod file;
mod mask;
mod png;
mod scale;
pub mod sheet;
mod text;

pub use color::{NOT_JUDGED, false_color, linear_from_srgb, srgb_from_linear};
pub use exr::{read_exr, write_exr};
pub use file::{read_visibility, write_atomic};
pub use mask::{PngMask, read_png_mask};
pub use png::{png_gray8, read_png_gray, write_png, write_png_gray};

use crate::{Error, Result};

/// 8-bit sRGB picture, row by row from the top.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Picture {
    /// Width and height in pixels.
    pub size: [u32; 2],
    /// `size[0] * size[1]` pixels.
    pub rgb: Vec<[u8; 3]>,
}

impl Picture {
    /// Returns a picture of one colour.
    pub fn filled(size: [u32; 2], color: [u8; 3]) -> Self {
        Self { size, rgb: vec![color; size[0] as usize * size[1] as usize] }
    }

    /// Returns visibility in `[0, 1]`, taken as linear light, as a grey sRGB picture.
    ///
    /// # Errors
    /// Fails for a slice of the wrong length.
    pub fn from_visibility(values: &[f32], size: [u32; 2]) -> Result<Self> {
        check_length("visibility", values.len(), size)?;
        Ok(Self { size, rgb: values.iter().map(|&v| [srgb_from_linear(v); 3]).collect() })
    }

    /// Returns the error `test - truth` in the colours of [`false_color`]. Pixels outside the mask, and pixels with
    /// NaN, get [`NOT_JUDGED`].
    ///
    /// # Errors
    /// Fails for a slice of the wrong length.
    pub fn from_error(test: &[f32], truth: &[f32], mask: &[bool], size: [u32; 2]) -> Result<Self> {
        check_length("visibility under test", test.len(), size)?;
        check_length("truth", truth.len(), size)?;
        check_length("mask", mask.len(), size)?;
        let color = |i: usize| if mask[i] { false_color(test[i] - truth[i]) } else { NOT_JUDGED };
        Ok(Self { size, rgb: (0..test.len()).map(color).collect() })
    }

    /// Returns the pixel in column `x` and row `y`, which must be inside.
    fn at(&self, x: u32, y: u32) -> [u8; 3] {
        self.rgb[y as usize * self.size[0] as usize + x as usize]
    }

    /// Fills the part of a rectangle that is inside; `rect` is left, top, width, height.
    fn fill(&mut self, rect: [u32; 4], color: [u8; 3]) {
        let right = rect[0].saturating_add(rect[2]).min(self.size[0]);
        let bottom = rect[1].saturating_add(rect[3]).min(self.size[1]);
        for y in rect[1]..bottom {
            let row = y as usize * self.size[0] as usize;
            let from = rect[0].min(right) as usize;
            self.rgb[row + from..row + right as usize].fill(color);
        }
    }

    /// Copies `source` to the position `at`, as far as it is inside.
    fn paste(&mut self, source: &Picture, at: [u32; 2]) {
        for y in 0..source.size[1].min(self.size[1].saturating_sub(at[1])) {
            for x in 0..source.size[0].min(self.size[0].saturating_sub(at[0])) {
                let to = (at[1] + y) as usize * self.size[0] as usize + (at[0] + x) as usize;
                self.rgb[to] = source.at(x, y);
            }
        }
    }
}

/// Rejects a slice that does not hold one value per pixel.
fn check_length(what: &str, length: usize, size: [u32; 2]) -> Result<()> {
    if length as u64 == u64::from(size[0]) * u64::from(size[1]) {
        return Ok(());
    }
    Err(Error::Usage(format!("picture: {what} has {length} values for {}x{} px", size[0], size[1])))
}
