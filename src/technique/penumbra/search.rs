//! Parts that the searches for the nearest edge, among points and among lines, share.

use super::edge_seeds::{EdgeConfig, EdgeSeeds};
use super::shared::scratch;
use crate::gpu::{Buffer, Image, ImageDesc, bindings};
use crate::technique::common::bindings::CameraBindings;
use crate::{Bind, Context, Inputs, Result};
use ash::vk;

/// Side of the blocks of pixels that the search visits first: `BLOCK` of `glsl/penumbra/nearest_edge.glsl`.
pub(super) const BLOCK: u32 = 4;

bindings! {
    /// Images and lists that a search for the nearest edge works on.
    pub(super) struct SearchBindings { ..camera: CameraBindings, Seeds, labels, list, widths }
}

impl<'a> SearchBindings<'a> {
    /// Binds the transform's labels and the tiles near an edge.
    pub(super) fn new(view: &'a Buffer, inputs: &'a Inputs<'_>, seeds: &'a EdgeSeeds, labels: &'a Image) -> Self {
        Self {
            camera: CameraBindings::new(view, inputs),
            Seeds: Bind::Buffer(seeds.seeds()),
            labels: Bind::Image(labels),
            list: Bind::Buffer(seeds.tiles().buffer()),
            widths: Bind::Image(seeds.widths()),
        }
    }
}

/// Makes an image of labels, one for each block of pixels of the given side.
pub(super) fn labels_of_blocks(context: &Context, extent: [u32; 2], side: u32) -> Result<Image> {
    let extent = extent.map(|n| n.div_ceil(side));
    let desc = ImageDesc::storage("nearest edge of a block", vk::Format::R32_UINT, extent);
    Image::new(context.device(), &ImageDesc { usage: desc.usage | vk::ImageUsageFlags::TRANSFER_DST, ..desc })
}

/// Images that a search writes; those that are not wanted have one pixel.
pub(super) struct EdgeImages {
    pub intensity: Image,
    pub distances: Image,
    pub labels: Image,
    pub seed_mask: Image,
    pub pixel_widths: Image,
}

impl EdgeImages {
    pub(super) fn new(context: &Context, extent: [u32; 2], config: EdgeConfig, viewed: bool) -> Result<Self> {
        let is_soft = config.widths.is_some();
        let seed_format = if is_soft { vk::Format::R32G32_SFLOAT } else { vk::Format::R8_UNORM };
        let image = |name, format, wanted| scratch(context, name, format, extent, wanted);
        Ok(Self {
            intensity: image("penumbra intensity", vk::Format::R32G32_SFLOAT, config.filtered || viewed)?,
            distances: image("distance to the nearest edge", vk::Format::R32_SFLOAT, viewed)?,
            labels: image("nearest edge", vk::Format::R32_UINT, viewed)?,
            seed_mask: image("seeds", seed_format, viewed)?,
            pixel_widths: image("penumbra widths", vk::Format::R32_SFLOAT, is_soft && (config.filtered || viewed))?,
        })
    }

    pub(super) fn memory_bytes(&self) -> u64 {
        let images = [&self.intensity, &self.distances, &self.labels, &self.seed_mask, &self.pixel_widths];
        images.map(Image::memory_bytes).iter().sum()
    }
}
