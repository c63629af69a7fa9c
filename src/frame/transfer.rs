//! Copies of images and buffers to the CPU, and of images back to the GPU, for the host.

use super::copy::COPY_TARGET;
use super::{Frame, TO_HOST, TRANSFER_USE};
use crate::ImageRef;
use crate::gpu::{Buffer, Image};
use crate::hazard::Use;
use ash::vk::{self, Handle};

fn whole_image(image: &ImageRef) -> vk::BufferImageCopy {
    vk::BufferImageCopy::default()
        .image_subresource(vk::ImageSubresourceLayers {
            aspect_mask: crate::gpu::aspect(image.format),
            mip_level: 0,
            base_array_layer: 0,
            layer_count: 1,
        })
        .image_extent(vk::Extent3D { width: image.extent[0], height: image.extent[1], depth: 1 })
}

impl Frame<'_> {
    /// Copies level 0 of layer 0 of an image into a mapped buffer, with tightly packed rows.
    pub(crate) fn read_back(&mut self, source: &Image, target: &Buffer) {
        let read = Use { stage: TRANSFER_USE.stage, access: vk::AccessFlags2::TRANSFER_READ, writes: false };
        let layout = vk::ImageLayout::TRANSFER_SRC_OPTIMAL;
        self.transition_for_copy(source, layout);
        self.hazard(&[(source.as_ref().image.as_raw(), read), (target.handle().as_raw(), TRANSFER_USE)]);
        let (raw, image) = (&self.context.device().raw, source.as_ref());
        // SAFETY: the target holds the image's rows (the callers size it from the same extent).
        unsafe {
            let regions = [whole_image(&image)];
            raw.cmd_copy_image_to_buffer(self.cmd, image.image, layout, target.handle(), &regions);
        }
        self.transition([source].into_iter(), TRANSFER_USE.stage);
        self.memory_barrier(&TO_HOST);
    }

    /// Copies a buffer into a mapped buffer of the same size.
    pub(crate) fn read_back_buffer(&mut self, source: &Buffer, target: &Buffer) {
        let read = Use { stage: TRANSFER_USE.stage, access: vk::AccessFlags2::TRANSFER_READ, writes: false };
        self.hazard(&[(source.handle().as_raw(), read), (target.handle().as_raw(), TRANSFER_USE)]);
        let region = vk::BufferCopy { src_offset: 0, dst_offset: 0, size: source.size() };
        // SAFETY: `begin`'s contract; the callers size the target like the source.
        unsafe {
            let raw = &self.context.device().raw;
            raw.cmd_copy_buffer(self.cmd, source.handle(), target.handle(), &[region]);
        }
        self.memory_barrier(&TO_HOST);
    }

    /// Copies tightly packed rows into level 0 of layer 0 of an image.
    pub(crate) fn write_image(&mut self, source: &Buffer, target: &Image) {
        let read = Use { stage: TRANSFER_USE.stage, access: vk::AccessFlags2::TRANSFER_READ, writes: false };
        self.transition_for_copy(target, COPY_TARGET);
        self.hazard(&[(source.handle().as_raw(), read), (target.as_ref().image.as_raw(), TRANSFER_USE)]);
        let (raw, image) = (&self.context.device().raw, target.as_ref());
        // SAFETY: the source holds the image's rows (the callers size it from the same extent).
        unsafe {
            let regions = [whole_image(&image)];
            raw.cmd_copy_buffer_to_image(self.cmd, source.handle(), image.image, COPY_TARGET, &regions);
        }
        self.transition([target].into_iter(), TRANSFER_USE.stage);
    }
}
