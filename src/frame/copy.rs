//! Fills and copies on the GPU. Each is a pass of its own.

use super::{Frame, TRANSFER_USE};
use crate::gpu::{Buffer, Image};
use crate::hazard::Use;
use ash::vk::{self, Handle};

/// Layout of an image while a buffer is copied into it. `GENERAL` is allowed as well, but can be slower.
pub(super) const COPY_TARGET: vk::ImageLayout = vk::ImageLayout::TRANSFER_DST_OPTIMAL;

/// Layout of an image that is copied from.
const COPY_SOURCE: vk::ImageLayout = vk::ImageLayout::TRANSFER_SRC_OPTIMAL;

impl Frame<'_> {
    /// Writes a number into every word of a buffer.
    pub(crate) fn fill(&mut self, name: &str, buffer: &Buffer, word: u32) {
        self.hazard(&[(buffer.handle().as_raw(), TRANSFER_USE)]);
        let query = self.begin_pass(name);
        let raw = &self.context.device().raw;
        // SAFETY: `begin`'s contract; the buffer was made with `TRANSFER_DST`.
        unsafe { raw.cmd_fill_buffer(self.cmd, buffer.handle(), 0, vk::WHOLE_SIZE, word) };
        self.end_pass(query);
    }

    /// Writes a number into every pixel of an image with one unsigned component. The image was made with
    /// `TRANSFER_DST`.
    pub(crate) fn fill_image(&mut self, name: &str, image: &Image, value: u32) {
        self.transition([image].into_iter(), TRANSFER_USE.stage);
        let r = image.as_ref();
        self.hazard(&[(r.image.as_raw(), TRANSFER_USE)]);
        let query = self.begin_pass(name);
        let range = vk::ImageSubresourceRange {
            aspect_mask: vk::ImageAspectFlags::COLOR,
            base_mip_level: 0,
            level_count: vk::REMAINING_MIP_LEVELS,
            base_array_layer: 0,
            layer_count: vk::REMAINING_ARRAY_LAYERS,
        };
        let value = vk::ClearColorValue { uint32: [value; 4] };
        let raw = &self.context.device().raw;
        // SAFETY: `begin`'s contract; the image is in the layout that the transition left.
        unsafe { raw.cmd_clear_color_image(self.cmd, r.image, r.layout, &value, &[range]) };
        self.end_pass(query);
    }

    /// Copies rows of pixels from a buffer into an image. `row_pixels` is the number of pixels in a row of the buffer,
    /// at least the image's width. The buffer was made with `TRANSFER_SRC`, and the image with `TRANSFER_DST`.
    pub(crate) fn copy_to_image(&mut self, name: &str, source: &Buffer, row_pixels: u32, target: &Image) {
        let read = Use { stage: TRANSFER_USE.stage, access: vk::AccessFlags2::TRANSFER_READ, writes: false };
        let image = target.as_ref();
        self.transition_for_copy(target, COPY_TARGET);
        self.hazard(&[(source.handle().as_raw(), read), (image.image.as_raw(), TRANSFER_USE)]);
        let query = self.begin_pass(name);
        let region = vk::BufferImageCopy::default()
            .buffer_row_length(row_pixels)
            .image_subresource(vk::ImageSubresourceLayers {
                aspect_mask: vk::ImageAspectFlags::COLOR,
                mip_level: 0,
                base_array_layer: 0,
                layer_count: 1,
            })
            .image_extent(vk::Extent3D { width: image.extent[0], height: image.extent[1], depth: 1 });
        let raw = &self.context.device().raw;
        // SAFETY: `begin`'s contract; the callers size the buffer from the image's extent and the padded row.
        unsafe {
            raw.cmd_copy_buffer_to_image(self.cmd, source.handle(), image.image, COPY_TARGET, &[region]);
        }
        self.end_pass(query);
        self.transition([target].into_iter(), TRANSFER_USE.stage);
    }

    /// Copies an image with one level and one layer into another of the same size and format. The first was made with
    /// `TRANSFER_SRC`, the second with `TRANSFER_DST`.
    pub(crate) fn copy_image(&mut self, name: &str, source: &Image, target: &Image) {
        let read = Use { stage: TRANSFER_USE.stage, access: vk::AccessFlags2::TRANSFER_READ, writes: false };
        let (from, to) = (source.as_ref(), target.as_ref());
        self.transition_for_copy(source, COPY_SOURCE);
        self.transition_for_copy(target, COPY_TARGET);
        self.hazard(&[(from.image.as_raw(), read), (to.image.as_raw(), TRANSFER_USE)]);
        let query = self.begin_pass(name);
        let layers = vk::ImageSubresourceLayers {
            aspect_mask: vk::ImageAspectFlags::COLOR,
            mip_level: 0,
            base_array_layer: 0,
            layer_count: 1,
        };
        let extent = vk::Extent3D { width: to.extent[0], height: to.extent[1], depth: 1 };
        let region = vk::ImageCopy::default().src_subresource(layers).dst_subresource(layers).extent(extent);
        let raw = &self.context.device().raw;
        // SAFETY: `begin`'s contract; the images have these layouts, and the callers make them alike.
        unsafe { raw.cmd_copy_image(self.cmd, from.image, COPY_SOURCE, to.image, COPY_TARGET, &[region]) };
        self.end_pass(query);
        self.transition([source, target].into_iter(), TRANSFER_USE.stage);
    }
}
