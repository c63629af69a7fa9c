//! PNG files.

use std::{io::Cursor, path::Path};

use image::{
    ExtendedColorType, ImageEncoder as _, ImageFormat, ImageReader,
    codecs::png::{CompressionType, FilterType, PngEncoder},
};

use super::{Picture, check_length, file};
use crate::Result;

/// Writes an sRGB picture with 8 bits per channel.
///
/// # Errors
/// Fails without pixels or if the picture's size and pixels disagree. Errors of [`super::write_atomic`] are passed on.
pub fn write_png(path: &Path, picture: &Picture) -> Result<()> {
    check_length("the picture", picture.rgb.len(), picture.size)?;
    write(path, bytemuck::cast_slice(&picture.rgb), picture.size, ExtendedColorType::Rgb8)
}

/// Writes values in `[0, 1]` as 16-bit grey, **linear**. [`read_png_gray`] returns them to within 1/131070. Values
/// outside are clamped; NaN gives 0.
///
/// # Errors
/// Fails without pixels or for a slice of the wrong length. Errors of [`super::write_atomic`] are passed on.
pub fn write_png_gray(path: &Path, size: [u32; 2], values: &[f32]) -> Result<()> {
    check_length("the picture", values.len(), size)?;
    let codes: Vec<u16> = values.iter().map(|v| (v.clamp(0.0, 1.0) * 65535.0 + 0.5) as u16).collect();
    write(path, bytemuck::cast_slice(&codes), size, ExtendedColorType::L16)
}

/// Encodes values in `[0, 1]` as a PNG of 8-bit grey, **linear**: the nearest of the 256 codes. Values outside are
/// clamped; NaN gives 0.
///
/// # Errors
/// Fails without pixels or for a slice of the wrong length.
pub fn png_gray8(values: &[f32], size: [u32; 2]) -> Result<Vec<u8>> {
    check_length("the picture", values.len(), size)?;
    let codes: Vec<u8> = values.iter().map(|v| (v.clamp(0.0, 1.0) * 255.0 + 0.5) as u8).collect();
    let mut encoded = Vec::new();
    PngEncoder::new_with_quality(&mut encoded, CompressionType::Best, FilterType::Adaptive)
        .write_image(&codes, size[0], size[1], ExtendedColorType::L8)
        .map_err(|e| file::wrong(Path::new("PNG"), "PNG", e.to_string()))?;
    Ok(encoded)
}

fn write(path: &Path, bytes: &[u8], size: [u32; 2], color: ExtendedColorType) -> Result<()> {
    let mut encoded = Vec::new();
    PngEncoder::new(&mut encoded)
        .write_image(bytes, size[0], size[1], color)
        .map_err(|e| file::wrong(path, "PNG", e.to_string()))?;
    file::write_atomic(path, &encoded)
}

/// Reads the red (or grey) channel of a PNG as `code / largest code`, that is as **linear** values: white is 1, black
/// is 0, without sRGB decoding. The picture must have the given `size`.
///
/// # Errors
/// Fails if the file cannot be read, is not a PNG, or has another size.
pub fn read_png_gray(path: &Path, size: [u32; 2]) -> Result<Vec<f32>> {
    decode_gray(path, &file::read(path, file::limit_bytes(size))?, size)
}

pub(super) fn decode_gray(path: &Path, bytes: &[u8], size: [u32; 2]) -> Result<Vec<f32>> {
    let wrong = |e: image::ImageError| file::wrong(path, "PNG", e.to_string());
    let reader = || ImageReader::with_format(Cursor::new(bytes), ImageFormat::Png);
    // Check the size first: a small file can claim a picture that fills the memory.
    file::check_size(path, reader().into_dimensions().map_err(wrong)?.into(), size)?;
    let pixels = reader().decode().map_err(wrong)?.into_rgb32f();
    Ok(pixels.pixels().map(|p| p.0[0]).collect())
}
