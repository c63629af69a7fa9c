//! Base-colour images: found, measured, then decoded in parallel.

use super::accessor::Data;
use super::document::Document;
use super::fault::{Fault, Loaded, entry, fault};
use super::files::Folder;
use super::limits;
use crate::scene::{Texture, Wrap};
use ::image::{ImageFormat, ImageReader, Limits};
use gltf::json::texture::{MagFilter, Sampler, WrappingMode};
use gltf::json::validation::Checked;
use rayon::prelude::*;
use std::borrow::Cow;
use std::collections::HashMap;
use std::io::Cursor;

/// Image together with its sampling: the source of one texture in memory.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct Use {
    image: usize,
    wrap: [Wrap; 2],
    nearest: bool,
}

/// Finds the image and sampler of `textures[index]`. The inner fault says that the image is of a kind that is not
/// read.
pub fn of_texture(document: &Document, index: usize, user: impl FnOnce() -> String) -> Loaded<Loaded<Use>> {
    let texture = entry(&document.textures, "textures", index, || format!("{}: texture index", user()))?;
    let image = texture.source.value();
    // The crate's mark for a texture that has its image only in an extension.
    if image == u32::MAX as usize {
        let problem =
            "has no image that can be read: only PNG and JPEG are supported; export it without texture compression";
        return Ok(Err(fault(format!("textures[{index}].source"), problem)));
    }
    entry(&document.images, "images", image, || format!("textures[{index}].source"))?;
    let place = |member: &str| format!("textures[{index}].sampler{member}");
    let default = Sampler::default();
    let sampler = match texture.sampler {
        Some(s) => entry(&document.samplers, "samplers", s.value(), || place(""))?,
        None => &default,
    };
    let wrap = |mode: Checked<WrappingMode>, member: &str| match mode {
        Checked::Valid(WrappingMode::Repeat) => Ok(Wrap::Repeat),
        Checked::Valid(WrappingMode::MirroredRepeat) => Ok(Wrap::MirroredRepeat),
        Checked::Valid(WrappingMode::ClampToEdge) => Ok(Wrap::ClampToEdge),
        Checked::Invalid => Err(fault(place(member), "must be 10497, 33071 or 33648")),
    };
    let nearest = match sampler.mag_filter {
        None | Some(Checked::Valid(MagFilter::Linear)) => false,
        Some(Checked::Valid(MagFilter::Nearest)) => true,
        Some(Checked::Invalid) => return Err(fault(place(".magFilter"), "must be 9728 or 9729")),
    };
    let wrap = [wrap(sampler.wrap_s, ".wrapS")?, wrap(sampler.wrap_t, ".wrapT")?];
    Ok(Ok(Use { image, wrap, nearest }))
}

/// Encoded image.
struct Encoded<'a> {
    index: usize,
    bytes: Cow<'a, [u8]>,
    /// Size in bytes when decoded, from its header.
    size: u64,
    /// Number of textures that use it.
    users: usize,
}

/// Returns the textures for `uses`, one each, in that order. An image that cannot be read gives a fault, which the
/// caller may tolerate.
///
/// # Errors
/// Fails if all images together are too large.
pub fn textures(data: &Data<'_>, uses: &[Use], folder: &mut Folder) -> Loaded<Vec<Loaded<Texture>>> {
    let mut images: Vec<Loaded<Encoded<'_>>> = Vec::new();
    let mut slots: HashMap<usize, usize> = HashMap::new();
    let mut bytes_needed = 0;
    for wanted in uses {
        let slot = *slots.entry(wanted.image).or_insert_with(|| {
            let encoded = fetch(data, wanted.image, folder).and_then(|bytes| {
                let size = measure(&bytes, wanted.image)?;
                Ok(Encoded { index: wanted.image, bytes, size, users: 0 })
            });
            images.push(encoded);
            images.len() - 1
        });
        let Ok(image) = &mut images[slot] else { continue };
        image.users += 1;
        bytes_needed += image.size;
        if bytes_needed > limits::TEXTURE_BYTES {
            let problem = "all images together need more than 2 GiB when decoded; make them smaller";
            return Err(fault(format!("images[{}]", wanted.image), problem));
        }
    }
    let decode = |encoded: &Loaded<Encoded<'_>>| decode(data.document, encoded.as_ref().map_err(Fault::clone)?);
    let mut decoded: Vec<Loaded<Texture>> = images.par_iter().map(decode).collect();
    let texture = |wanted: &Use| {
        let slot = slots[&wanted.image];
        let texels = decoded[slot].as_mut().map_err(|f| f.clone())?;
        // The last user takes the texels, so an image with a single sampler is never copied.
        let texture = match &mut images[slot] {
            Ok(image) if image.users > 1 => {
                image.users -= 1;
                texels.clone()
            }
            _ => std::mem::take(texels),
        };
        Ok(Texture { wrap: wanted.wrap, nearest: wanted.nearest, ..texture })
    };
    Ok(uses.iter().map(texture).collect())
}

fn fetch<'a>(data: &'a Data<'_>, index: usize, folder: &mut Folder) -> Loaded<Cow<'a, [u8]>> {
    let image = &data.document.images[index];
    match (&image.uri, image.buffer_view) {
        (_, Some(view)) => Ok(data.view(view.value(), || format!("images[{index}].bufferView"))?.into()),
        (Some(uri), None) => Ok(folder.fetch(uri).map_err(|p| fault(format!("images[{index}].uri"), p))?.into()),
        (None, None) => Err(fault(format!("images[{index}]"), "must have a uri or a bufferView")),
    }
}

fn reader(bytes: &[u8], index: usize) -> Loaded<ImageReader<Cursor<&[u8]>>> {
    let place = || format!("images[{index}]");
    let mut reader =
        ImageReader::new(Cursor::new(bytes)).with_guessed_format().map_err(|e| fault(place(), e.to_string()))?;
    if !matches!(reader.format(), Some(ImageFormat::Png | ImageFormat::Jpeg)) {
        return Err(fault(place(), "is neither PNG nor JPEG, the formats of glTF 2.0; convert it"));
    }
    let mut limits = Limits::default();
    limits.max_image_width = Some(limits::IMAGE_SIDE);
    limits.max_image_height = Some(limits::IMAGE_SIDE);
    limits.max_alloc = Some(limits::IMAGE_BYTES);
    reader.limits(limits);
    Ok(reader)
}

/// Returns the size of the decoded image in bytes, from its header alone.
fn measure(bytes: &[u8], index: usize) -> Loaded<u64> {
    let (width, height) = reader(bytes, index)?.into_dimensions().map_err(|e| undecodable(index, &e))?;
    let side = limits::IMAGE_SIDE;
    let size = 4 * u64::from(width) * u64::from(height);
    if width.max(height) > side || size > limits::IMAGE_BYTES || size == 0 {
        let texels = limits::IMAGE_BYTES / 4;
        let problem = format!("is {width} x {height}, but may have 1 to {side} texels per side and {texels} in all");
        return Err(fault(format!("images[{index}]"), problem));
    }
    Ok(size)
}

fn undecodable(index: usize, error: &::image::ImageError) -> Fault {
    fault(format!("images[{index}]"), format!("cannot be decoded: {error}; export it again as PNG or JPEG"))
}

fn decode(document: &Document, encoded: &Encoded<'_>) -> Loaded<Texture> {
    let index = encoded.index;
    let image = reader(&encoded.bytes, index)?.decode().map_err(|e| undecodable(index, &e))?.into_rgba8();
    Ok(Texture {
        name: document.images[index].name.clone().unwrap_or_else(|| format!("image {index}")),
        size: image.dimensions().into(),
        rgba: image.into_raw().as_chunks().0.to_vec(),
        ..Texture::default()
    })
}
