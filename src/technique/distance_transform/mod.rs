//! The exact Euclidean distance transform with labels: the nearest seed of every pixel, unbounded or within a radius.
//!
//! | method | what | time | memory besides the output |
//! |---|---|---|---|
//! | `pba` | Parallel Banding Algorithm (Cao, Tang, Mohamed, Tan 2010) in bands of rows, of columns, and of pixels |
//! O(pixels), many threads per row | 8.5 bytes per pixel |
//! | `bounded-tile` | one dispatch that searches a window around every pixel of a tile with seeds in reach, from the
//! inside out; radius up to 64 | O(pixels in reach · distance) | 1 bit per pixel |
//! | `bounded-row` | lower envelopes of segments of rows with seeds in reach (Meijster, Roerdink, Hesselink 2000;
//! Felzenszwalb, Huttenlocher 2012); any radius, or none. On a CPU driver and up to a radius of 64, a search among the
//! columns between those that are nearest to every 16th pixel | O(pixels in reach) | 4.4 bytes per pixel and a few
//! rows |
//!
//! All methods give the same labels, bit for bit. Among several nearest seeds, the one with the smallest y is chosen,
//! then the one with the smallest x. All arithmetic uses integers and is exact up to 65535 pixels per side. Squared
//! distances are `u32` because an `f32` would round them above 2^24, which the diagonal of a 4K image exceeds.

mod columns;
mod pack;
mod pba;
mod row;
mod tile;

pub use pba::Bands;
pub use tile::MAX_RADIUS as MAX_TILE_RADIUS;

use crate::error::unknown;
use crate::gpu::{Buffer, BufferDesc, Image, ImageDesc, MemoryKind, shader_struct};
use crate::{Context, Error, Frame, ImageRef, Result};
use ash::vk;
use std::fmt;
use std::str::FromStr;
use std::sync::Arc;

/// Label and squared distance of a pixel without a seed within the radius.
pub const NO_SEED: u32 = u32::MAX;

/// Largest number of pixels per side. A label holds 16 bits per axis, and the coordinate `0xffff` is reserved for
/// [`NO_SEED`].
pub const MAX_SIDE: u32 = 65535;

/// Radius of an unbounded transform; no two rows are farther apart.
const UNBOUNDED: u32 = MAX_SIDE - 1;

shader_struct! {
    /// Push constants of `glsl/distance_transform/edt_*.comp`; `edt.glsl` describes them.
    pub struct EdtPush {
        size: [u32; 2],
        radius: u32,
        span: u32,
        bands: u32,
        merge: u32,
        squared: u32,
    }
}

/// Method of the transform. All methods give the same result.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum EdtMethod {
    /// Parallel Banding Algorithm.
    Pba,
    /// Windows around the pixels of tiles; the radius is at most [`MAX_TILE_RADIUS`].
    BoundedTile,
    /// Lower envelopes of segments of rows.
    BoundedRow,
    /// `bounded-row` on a CPU driver; otherwise `bounded-tile` up to its largest radius, and `pba` for larger ones.
    Auto,
}

impl EdtMethod {
    /// All methods.
    pub const ALL: [Self; 4] = [Self::Pba, Self::BoundedTile, Self::BoundedRow, Self::Auto];

    /// Returns the method that `Auto` stands for on this device and with this radius.
    fn resolve(self, is_cpu: bool, radius: Option<u32>) -> Self {
        match self {
            Self::Auto if is_cpu => Self::BoundedRow,
            Self::Auto if radius.is_some_and(|r| r <= MAX_TILE_RADIUS) => Self::BoundedTile,
            Self::Auto => Self::Pba,
            chosen => chosen,
        }
    }
}

impl fmt::Display for EdtMethod {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.pad(match self {
            Self::Pba => "pba",
            Self::BoundedTile => "bounded-tile",
            Self::BoundedRow => "bounded-row",
            Self::Auto => "auto",
        })
    }
}

impl FromStr for EdtMethod {
    type Err = Error;

    fn from_str(text: &str) -> Result<Self> {
        Self::ALL.into_iter().find(|m| m.to_string() == text).ok_or_else(|| {
            let names = Self::ALL.map(|m| m.to_string());
            let names: Vec<_> = names.iter().map(String::as_str).collect();
            Error::Parameter(unknown(&format!("there is no EDT method {text:?}"), text, "there are", &names))
        })
    }
}

/// Settings that are fixed when the transform is made.
#[derive(Clone, Copy, Debug)]
pub struct EdtConfig {
    /// Method.
    pub method: EdtMethod,
    /// Largest distance in pixels, inclusive. Pixels farther from every seed get [`NO_SEED`]. `None` means no limit.
    pub radius: Option<u32>,
    /// True to write an image of squared distances as well.
    pub squared: bool,
    /// Band counts of `pba`; `None` chooses them by the kind of device.
    pub bands: Option<Bands>,
}

impl Default for EdtConfig {
    fn default() -> Self {
        Self { method: EdtMethod::Auto, radius: None, squared: false, bands: None }
    }
}

enum Steps {
    Pba(pba::Pba),
    Tile(tile::Tile),
    Row(row::Row),
}

/// The transform with its pipelines, input and output.
pub struct Edt {
    extent: [u32; 2],
    method: EdtMethod,
    pack: pack::Pack,
    seed_bits: Buffer,
    labels: Image,
    squared: Option<Image>,
    steps: Steps,
}

/// Resources that the methods write, for binding.
struct Output<'a> {
    labels: &'a Image,
    /// Squared distances, or the labels again if nobody asked for squared distances, because the shader's binding still
    /// needs an image.
    squared: &'a Image,
}

impl Edt {
    /// Makes the transform for images of a size in pixels, 1 to [`MAX_SIDE`] per side.
    ///
    /// # Errors
    /// [`Error::Parameter`] for a side of 0 or too many pixels, for a radius beyond what `bounded-tile` can do, for squared
    /// distances that 32 bits do not hold, and for buffers larger than the device can bind.
    pub fn new(context: &Context, extent: [u32; 2], config: EdtConfig) -> Result<Self> {
        Self::sharing(context, extent, config, None)
    }

    /// Makes the transform as [`Self::new`] does, but with a buffer of 4 bytes for each pixel, rows padded to four pixels, that other passes use
    /// before and after. [`Self::memory_bytes`] leaves it out.
    pub(crate) fn sharing(
        context: &Context,
        extent: [u32; 2],
        config: EdtConfig,
        rows: Option<&Arc<Buffer>>,
    ) -> Result<Self> {
        let [width, height] = extent;
        let wrong =
            |problem: String| Err(Error::Parameter(format!("distance transform of {width}x{height}: {problem}")));
        if extent.iter().any(|&n| n == 0 || n > MAX_SIDE) {
            return wrong(format!("a side must have 1 to {MAX_SIDE} pixels"));
        }
        let diagonal_squared = extent.iter().map(|&n| u64::from(n - 1).pow(2)).sum::<u64>();
        let reach_squared = config.radius.map_or(u64::MAX, |r| u64::from(r).pow(2));
        if config.squared && diagonal_squared.min(reach_squared) >= u64::from(NO_SEED) {
            return wrong(
                "squared distances do not fit in 32 bits; give a radius of at most 65535, or do without squared distances".into(),
            );
        }
        let device = context.device();
        let is_cpu = device.is_cpu();
        let method = config.method.resolve(is_cpu, config.radius);
        let push = EdtPush {
            size: extent,
            radius: config.radius.map_or(UNBOUNDED, |r| r.min(UNBOUNDED)),
            squared: config.squared.into(),
            ..EdtPush::default()
        };
        let steps = match method {
            EdtMethod::BoundedTile => Steps::Tile(tile::Tile::new(context, push, config.radius)?),
            EdtMethod::BoundedRow => Steps::Row(row::Row::new(context, push, is_cpu, rows)?),
            EdtMethod::Pba | EdtMethod::Auto => {
                let bands = config.bands.unwrap_or_else(|| Bands::for_device(is_cpu, extent));
                Steps::Pba(pba::Pba::new(context, push, bands)?)
            }
        };
        let image = |name| {
            let desc = ImageDesc::storage(name, vk::Format::R32_UINT, extent);
            Image::new(device, &ImageDesc { usage: desc.usage | vk::ImageUsageFlags::TRANSFER_DST, ..desc })
        };
        Ok(Self {
            extent,
            method,
            pack: pack::Pack::default(),
            seed_bits: storage(context, "edt seed bits", words(extent), 4)?,
            labels: image("edt labels")?,
            squared: if config.squared { Some(image("edt squared distances")?) } else { None },
            steps,
        })
    }

    /// Transforms a mask: a single-channel image as large as the transform, in `R8_UNORM`, `R8_UINT` or a wider format
    /// of the same kind. Every pixel other than 0 is a seed.
    ///
    /// # Errors
    /// [`Error::Input`] for an image of another size or format.
    pub fn record(&mut self, frame: &mut Frame<'_>, mask: &ImageRef) -> Result<()> {
        self.pack.record(frame, mask, self.extent, &self.seed_bits)?;
        self.record_packed(frame)
    }

    /// Transforms a mask in a storage buffer, with one byte per pixel and rows padded to a multiple of 4 bytes. Every
    /// byte other than 0 is a seed. On a CPU driver this is several times faster than an image.
    ///
    /// # Errors
    /// [`Error::Input`] for a buffer that is too small.
    pub fn record_bytes(&mut self, frame: &mut Frame<'_>, mask: &Buffer) -> Result<()> {
        self.pack.record_bytes(frame, mask, self.extent, &self.seed_bits)?;
        self.record_packed(frame)
    }

    /// Transforms the seeds in [`Edt::seed_bits`], which an earlier pass of the frame has written.
    pub fn record_packed(&self, frame: &mut Frame<'_>) -> Result<()> {
        let output = Output { labels: &self.labels, squared: self.squared.as_ref().unwrap_or(&self.labels) };
        match &self.steps {
            Steps::Pba(pba) => pba.record(frame, &self.seed_bits, &output),
            Steps::Tile(tile) => tile.record(frame, &self.seed_bits, &output),
            Steps::Row(row) => row.record(frame, &self.seed_bits, &output),
        }
    }

    /// The seeds as a vertical bit mask, with one `u32` per column and block of 32 rows. Pixel (x, y) is bit `y % 32`
    /// of word `x + width * (y / 32)`. Bits of rows beyond the image are 0.
    pub fn seed_bits(&self) -> &Buffer {
        &self.seed_bits
    }

    /// Labels in `R32_UINT`: `x | y << 16` of the nearest seed, or [`NO_SEED`] if there is none within the radius.
    pub fn labels(&self) -> &Image {
        &self.labels
    }

    /// Squared distances in pixels in `R32_UINT`, if asked for; [`NO_SEED`] if there is no seed within the radius.
    pub fn squared(&self) -> Option<&Image> {
        self.squared.as_ref()
    }

    /// The method in use; never `Auto`, but the method that it selected.
    pub fn method(&self) -> EdtMethod {
        self.method
    }

    /// Bytes of device memory, including the output.
    pub fn memory_bytes(&self) -> u64 {
        let steps = match &self.steps {
            Steps::Pba(pba) => pba.memory_bytes(),
            Steps::Tile(tile) => tile.memory_bytes(),
            Steps::Row(row) => row.memory_bytes(),
        };
        let squared = self.squared.as_ref().map_or(0, Image::memory_bytes);
        self.seed_bits.size() + self.labels.memory_bytes() + squared + steps
    }
}

/// Number of words of the seed bits.
fn words(extent: [u32; 2]) -> u64 {
    u64::from(extent[0]) * u64::from(extent[1].div_ceil(32))
}

/// Makes a storage buffer on the GPU with entries of `bytes_each` bytes.
fn storage(context: &Context, name: &str, entries: u64, bytes_each: u64) -> Result<Buffer> {
    let (size, most) = (entries * bytes_each, u64::from(context.device().limits.max_storage_buffer_range));
    if size > most {
        return Err(Error::Parameter(format!(
            "{name}: {size} bytes are needed, but this device binds at most {most}; use a smaller image or another method"
        )));
    }
    let usage =
        vk::BufferUsageFlags::STORAGE_BUFFER | vk::BufferUsageFlags::TRANSFER_DST | vk::BufferUsageFlags::TRANSFER_SRC;
    Buffer::new(context.device(), &BufferDesc { name, size, usage, memory: MemoryKind::Gpu })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn methods_have_their_names() {
        for method in EdtMethod::ALL {
            assert_eq!(method.to_string().parse::<EdtMethod>().unwrap(), method);
        }
        let error = "jump-flooding".parse::<EdtMethod>().unwrap_err().to_string();
        assert!(error.contains("jump-flooding") && error.contains("bounded-row"), "{error}");
    }

    #[test]
    fn auto_goes_by_device_and_radius() {
        let gpu = |radius| EdtMethod::Auto.resolve(false, radius);
        assert_eq!(EdtMethod::Auto.resolve(true, Some(8)), EdtMethod::BoundedRow);
        assert_eq!((gpu(Some(64)), gpu(Some(65)), gpu(None)), (EdtMethod::BoundedTile, EdtMethod::Pba, EdtMethod::Pba));
        assert_eq!(EdtMethod::Pba.resolve(true, Some(8)), EdtMethod::Pba);
    }
}
