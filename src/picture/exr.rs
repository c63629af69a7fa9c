//! OpenEXR files.

use std::{io::Cursor, path::Path};

use ::exr::{
    meta::MetaData,
    prelude::{
        AnyChannel, AnyChannels, Encoding, FlatSamples, Image, Layer, LayerAttributes, ReadChannels, ReadLayers,
        ReadSpecificChannel, Text, Vec2, WritableImage, read,
    },
};

use super::{check_length, file};
use crate::{Error, Result};

/// Channels that [`read_exr`] searches if it is given no name.
const USUAL_NAMES: [&str; 3] = ["R", "V", "Y"];

/// Writes planes of `f32` as the channels of one OpenEXR file, compressed without loss (ZIP).
///
/// # Errors
/// Fails without pixels or channels, for a slice of the wrong length, or for a channel name that is empty, occurs
/// twice or is outside Latin-1. Errors of [`super::write_atomic`] are passed on.
pub fn write_exr(path: &Path, size: [u32; 2], channels: &[(&str, &[f32])]) -> Result<()> {
    if channels.is_empty() || size[0] == 0 || size[1] == 0 {
        return Err(Error::Usage(format!("{}: an OpenEXR file needs pixels and channels", path.display())));
    }
    let mut list = Vec::with_capacity(channels.len());
    for (i, &(name, values)) in channels.iter().enumerate() {
        check_length(&format!("channel {name}"), values.len(), size)?;
        let text = Text::new_or_none(name).filter(|_| !name.is_empty());
        let twice = channels[..i].iter().any(|c| c.0 == name);
        let (Some(text), false) = (text, twice) else {
            return Err(Error::Usage(format!("{}: channel name {name:?} cannot be used", path.display())));
        };
        list.push(AnyChannel::new(text, FlatSamples::F32(values.to_vec())));
    }
    let extent = Vec2(size[0] as usize, size[1] as usize);
    let encoding = Encoding::SMALL_LOSSLESS;
    let layer = Layer::new(extent, LayerAttributes::default(), encoding, AnyChannels::sort(list.into()));
    let mut encoded = Cursor::new(Vec::new());
    Image::from_layer(layer)
        .write()
        .to_buffered(&mut encoded)
        .map_err(|e| file::wrong(path, "OpenEXR", e.to_string()))?;
    file::write_atomic(path, encoded.get_ref())
}

/// Reads one channel of an OpenEXR file as `f32`.
///
/// Without a name it is the first of `R`, `V`, `Y` that exists, or else the only channel. The data window must have
/// the given `size`. Among several layers, the first with that channel counts.
///
/// # Errors
/// Fails if the file cannot be read, is not an OpenEXR file, has another size or no such channel.
pub fn read_exr(path: &Path, size: [u32; 2], channel: Option<&str>) -> Result<Vec<f32>> {
    decode(path, &file::read(path, file::limit_bytes(size))?, size, channel)
}

pub(super) fn decode(path: &Path, bytes: &[u8], size: [u32; 2], channel: Option<&str>) -> Result<Vec<f32>> {
    let wrong = |e: ::exr::error::Error| file::wrong(path, "OpenEXR", e.to_string());
    // Check the header first: a small file can claim a picture that fills the memory.
    let meta = MetaData::read_from_buffered(Cursor::new(bytes), false).map_err(wrong)?;
    let names = |header: &::exr::meta::header::Header| -> Vec<String> {
        header.channels.list.iter().map(|c| c.name.to_string()).collect()
    };
    let all: Vec<Vec<String>> = meta.headers.iter().map(names).collect();
    let wanted: Vec<&str> = match channel {
        Some(name) => vec![name],
        None => USUAL_NAMES.to_vec(),
    };
    let found = wanted
        .iter()
        .find_map(|&w| all.iter().position(|layer| layer.iter().any(|n| n == w)).map(|i| (i, w)))
        .or(match all.as_slice() {
            [only] if only.len() == 1 && channel.is_none() => Some((0, only[0].as_str())),
            _ => None,
        });
    let Some((layer, name)) = found else {
        let problem = format!("no channel {}; there are {}", wanted.join(", "), all.concat().join(", "));
        return Err(file::wrong(path, "channels", problem));
    };
    let header = &meta.headers[layer];
    let extent = header.layer_size;
    let side = |v: usize| u32::try_from(v).unwrap_or(u32::MAX);
    file::check_size(path, [side(extent.0), side(extent.1)], size)?;
    let subsampled = header.channels.list.iter().any(|c| c.sampling != Vec2(1, 1));
    if header.deep || subsampled {
        return Err(file::wrong(
            path,
            "channels",
            "the channel is deep or subsampled; write it flat and in full resolution".to_owned(),
        ));
    }
    let width = extent.0;
    let image = read()
        .no_deep_data()
        .largest_resolution_level()
        .specific_channels()
        .required(name)
        .collect_pixels(
            // A layer of another size may come first; it gets no pixels here.
            move |extent, _| (extent.0, vec![0.0f32; if extent.0 == width { extent.area() } else { 0 }]),
            |(width, values): &mut (usize, Vec<f32>), at, (value,): (f32,)| {
                if let Some(v) = values.get_mut(at.1 * *width + at.0) {
                    *v = value;
                }
            },
        )
        .first_valid_layer()
        .all_attributes()
        .from_buffered(Cursor::new(bytes))
        .map_err(wrong)?;
    let values = image.layer_data.channel_data.pixels.1;
    if values.len() != size[0] as usize * size[1] as usize {
        return Err(file::wrong(path, "layers", format!("no layer of that size has the channel {name}")));
    }
    Ok(values)
}
