//! Masks: pictures of which only black or white counts.

use std::{io::Cursor, path::Path};

use image::{ImageFormat, ImageReader};

use super::file;
use crate::Result;

/// Largest file that is read: more than a mask of 65535 pixels a side takes.
const LIMIT_BYTES: u64 = 1 << 32;

/// Reads a PNG as a mask: its size, and row by row from the top which pixels are white, of luma 128 or more of 255.
/// `largest` is the most pixels that a side may have.
///
/// # Errors
/// The file cannot be read, is no PNG, or is larger.
pub fn read_png_mask(path: &Path, largest: u32) -> Result<([u32; 2], Vec<bool>)> {
    let wrong = |e: image::ImageError| file::wrong(path, "PNG", e.to_string());
    let bytes = file::read(path, LIMIT_BYTES)?;
    let reader = || ImageReader::with_format(Cursor::new(&bytes), ImageFormat::Png);
    // The size comes first: a small file can claim a picture that fills the memory.
    let size: [u32; 2] = reader().into_dimensions().map_err(wrong)?.into();
    if let Some(side) = size.into_iter().find(|&s| s > largest) {
        return Err(file::wrong(path, "size", format!("{side} pixels a side, at most {largest} are possible here")));
    }
    let luma = reader().decode().map_err(wrong)?.into_luma8();
    Ok((size, luma.pixels().map(|p| p.0[0] >= 128).collect()))
}
