//! Masks: pictures in which only black and white count.

use std::{io::Cursor, path::Path};

use image::{ImageFormat, ImageReader};

use super::file;
use crate::Result;

/// Size limit of a file, bytes: more than a mask of 65535 pixels a side takes.
const LIMIT_BYTES: u64 = 1 << 32;

/// Picture read as a mask.
#[derive(Clone, Debug, PartialEq)]
pub struct PngMask {
    /// Width and height, pixels.
    pub size: [u32; 2],
    /// `true` for a white pixel, row by row from the top.
    pub seeds: Vec<bool>,
    /// Luma of the brightest pixel, 0 to 255; fractional for a 16-bit picture.
    pub brightest: f32,
}

/// Reads a PNG as a mask: pixels with a luma of at least `threshold`, of 255, are white. `largest` is the largest side
/// allowed, in pixels.
///
/// # Errors
/// Fails if the file cannot be read, is not a PNG, or is larger.
pub fn read_png_mask(path: &Path, largest: u32, threshold: u8) -> Result<PngMask> {
    let wrong = |e: image::ImageError| file::wrong(path, "PNG", e.to_string());
    let bytes = file::read(path, LIMIT_BYTES)?;
    let reader = || ImageReader::with_format(Cursor::new(&bytes), ImageFormat::Png);
    // Check the size first: a small file can claim a picture that fills the memory.
    let size: [u32; 2] = reader().into_dimensions().map_err(wrong)?.into();
    if let Some(side) = size.into_iter().find(|&s| s > largest) {
        return Err(file::wrong(
            path,
            "size",
            format!("a side has {side} pixels, but at most {largest} are possible here"),
        ));
    }
    // The 16-bit code of an 8-bit value is 257 times as large.
    let luma = reader().decode().map_err(wrong)?.into_luma16();
    let brightest = luma.pixels().map(|p| p.0[0]).max().unwrap_or(0);
    let least = 257 * u16::from(threshold);
    Ok(PngMask {
        size,
        seeds: luma.pixels().map(|p| p.0[0] >= least).collect(),
        brightest: f32::from(brightest) / 257.0,
    })
}
