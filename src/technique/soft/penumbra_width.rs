//! The width of an area light's penumbra at every pixel, for filters of an image of hard shadows.

use super::classified::Skip;
use crate::gpu::{Buffer, Image, ImageDesc, bindings, shader_struct};
use crate::technique::common::bindings::PixelBindings;
use crate::technique::common::blocker_search::{self, SearchWindow};
use crate::technique::common::depth_bounds::DepthBounds;
use crate::technique::common::hsm::Hsm;
use crate::technique::common::pixels::{PixelPass, Step, clear_list, fits_list, pixel_list};
use crate::{Bind, Context, Frame, Inputs, Result, Threads};
use ash::vk;
use std::sync::Arc;

shader_struct! {
    /// Push constants of `glsl/soft/penumbra_width.comp`.
    pub struct WidthPush {
        /// Multiples of what a plane needs.
        normal_offset: f32,
        /// Slopes of the receiver's plane a texel, summed over both axes.
        depth_bias: f32,
        /// Reach of the filter that follows, penumbra half-widths: 1 or more.
        reach: f32,
    }
}

/// Rounds of loops that the passes over the list take for a pixel, at most: 63 taps of a filter, or steps along four edges of
/// 64 texels.
const LISTED_ROUNDS: u32 = 1000;

/// Settings that are fixed when the pass is made.
#[derive(Clone, Copy, Debug)]
pub struct WidthConfig {
    /// Taps of the blocker search along each axis.
    pub search_taps: u32,
    /// Window in which blockers are searched.
    pub window: SearchWindow,
    /// Windows of no more texels than taps are averaged exactly, texel by texel.
    pub exact_box: bool,
    /// Stored depths are averaged instead of distances.
    pub mean_depth: bool,
    /// All texels are compared with the receiver's own depth instead of its plane.
    pub fixed_depth: bool,
    /// Pixels that are not listed and searched, because depth bounds decide them. An image with too many pixels to list skips
    /// none.
    pub skip: Skip,
}

bindings! {
    struct WidthBindings { ..pixels: PixelBindings, hsm, blocks, shadows, between, open_tiles }
}

/// The pass with its images, 12 bytes a pixel, and the depth bounds that classify pixels.
pub struct PenumbraWidth {
    pass: PixelPass,
    /// List that the search itself makes.
    list: Option<Arc<Buffer>>,
    hsm: Hsm,
    bounds: DepthBounds,
    widths: Image,
}

impl PenumbraWidth {
    /// Allocates for a camera image and a shadow map.
    pub fn new(context: &Context, extent: [u32; 2], map_size: [u32; 2], config: WidthConfig) -> Result<Self> {
        let WidthConfig { search_taps, window, exact_box, mean_depth, fixed_depth, skip } = config;
        let narrow = window == SearchWindow::Blockers;
        let skip = if fits_list(context, extent) { skip } else { Skip::Off };
        let pipeline = |step: Step| {
            let constants = [
                ("TAPS", search_taps),
                ("NEAREST_BLOCKER", narrow.into()),
                ("BOX", exact_box.into()),
                ("FIXED", fixed_depth.into()),
                ("MEAN_DEPTH", mean_depth.into()),
                ("STEP", step as u32),
                step.together(context, blocker_search::rounds(search_taps).max(LISTED_ROUNDS)),
            ];
            context.pipeline::<WidthBindings, WidthPush>("soft/penumbra_width.comp", &constants)
        };
        let name = "penumbra pixels";
        // Other passes read the list in either form.
        let list = match skip {
            Skip::Tiles => Some(Arc::new(pixel_list(context, name, extent)?)),
            _ => None,
        };
        let pass = match &list {
            Some(list) => PixelPass::of_open_tiles(context, name, extent, pipeline, list.clone())?,
            None => skip.pass(context, name, extent, pipeline)?,
        };
        let desc = ImageDesc::storage("penumbra width", vk::Format::R32_SFLOAT, extent);
        let desc = ImageDesc { usage: desc.usage | vk::ImageUsageFlags::TRANSFER_DST, ..desc };
        Ok(Self {
            pass,
            list,
            hsm: Hsm::new(context, map_size)?,
            bounds: DepthBounds::new(context, map_size)?,
            widths: Image::new(context.device(), &desc)?,
        })
    }

    /// Bytes of images and lists.
    pub fn memory_bytes(&self) -> u64 {
        let images = [&self.widths, self.hsm.bounds(), self.bounds.blocks()];
        self.pass.memory_bytes() + images.iter().map(|i| i.memory_bytes()).sum::<u64>()
    }

    /// Returns the image, `R32_SFLOAT`: full width in world units on a receiver parallel to the map; 0 outside of penumbrae.
    pub fn widths(&self) -> &Image {
        &self.widths
    }

    /// Returns the list of the pixels that can have a width, for binding: `PixelList` of `glsl/common/pixel_steps.glsl`. It is
    /// empty unless pixels are listed.
    pub(crate) fn list(&self) -> Bind<'_> {
        self.pass.list()
    }

    /// Returns the workgroups of that list; without a list, a thread for every pixel.
    pub(crate) fn threads(&self) -> Threads<'_> {
        match &self.list {
            Some(list) => Threads::Indirect(list, 0),
            None => self.pass.threads(self.widths.extent()),
        }
    }

    /// Sets all widths to 0, as for a light without size.
    pub fn clear(&self, frame: &mut Frame<'_>) {
        frame.fill_image("no penumbrae", &self.widths, 0);
    }

    /// Returns true if pixels are listed.
    pub(crate) fn is_listed(&self) -> bool {
        self.list.is_some() || self.pass.is_listed()
    }

    /// Makes the bounds of the map and lists the pixels that can have a width, if pixels are listed. The visibility of the
    /// others is known: it is written into both images. With [`Skip::Tiles`] this finds the widths too.
    pub fn record_classes(
        &mut self,
        frame: &mut Frame<'_>,
        view: &Buffer,
        inputs: &Inputs<'_>,
        push: WidthPush,
        images: (&Image, &Image),
    ) -> Result<()> {
        self.hsm.record(frame, inputs)?;
        self.bounds.record(frame, inputs)?;
        if !self.is_listed() {
            return Ok(());
        }
        let bind = &self.bindings(view, inputs, images);
        let push = bytemuck::bytes_of(&push);
        let Some(list) = &self.list else {
            return self.pass.record_decided(frame, "classify penumbrae", bind, push, &self.widths);
        };
        clear_list(frame, list);
        self.pass.record(frame, ["classify penumbrae", "penumbra width"], bind, push, &self.widths)
    }

    /// Writes the widths of the listed pixels, if they are not known yet; of all, unless pixels are listed. Both images hold hard shadows there. Pixels
    /// that lie in no penumbra after all get their visibility.
    pub fn record(
        &self,
        frame: &mut Frame<'_>,
        view: &Buffer,
        inputs: &Inputs<'_>,
        push: WidthPush,
        images: (&Image, &Image),
    ) -> Result<()> {
        if self.list.is_some() {
            return Ok(());
        }
        let bind = &self.bindings(view, inputs, images);
        let push = bytemuck::bytes_of(&push);
        if self.is_listed() {
            return self.pass.record_listed(frame, "penumbra width", bind, push);
        }
        self.pass.record_decided(frame, "penumbra width", bind, push, &self.widths)
    }

    fn bindings<'a>(
        &'a self,
        view: &'a Buffer,
        inputs: &'a Inputs<'_>,
        (shadows, between): (&'a Image, &'a Image),
    ) -> WidthBindings<'a> {
        WidthBindings {
            pixels: PixelBindings::borderless(view, inputs, &self.widths, self.pass.list()),
            hsm: Bind::Image(self.hsm.bounds()),
            blocks: Bind::Image(self.bounds.blocks()),
            shadows: Bind::Image(shadows),
            between: Bind::Image(between),
            open_tiles: self.pass.tile_list(),
        }
    }
}
