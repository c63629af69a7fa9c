//! Push constants of the passes that make penumbrae, and images that only some configurations use.

use crate::gpu::{Buffer, Image, ImageDesc, shader_struct};
use crate::technique::common::pixels;
use crate::{Context, Result};
use ash::vk;
use std::sync::Arc;

shader_struct! {
    /// Push constants of the passes that make penumbrae (`glsl/penumbra/edge_seeds.glsl`). With
    /// [`EdgeConfig::widths`](super::edge_seeds::EdgeConfig::widths) each seed's own width is the unit of lengths.
    pub(super) struct PenumbraPush {
        /// Full width of the penumbra, world units; 1 where seeds have their own.
        penumbra: f32,
        /// Width of the mean filter, world units; a share of the penumbra's where seeds have their own.
        filter_width: f32,
        /// Tolerance of the test for one surface: pixels off the plane per pixel of distance, or a share of the eye depth.
        tolerance: f32,
        /// Length of a step in the search for the nearest edge, blocks of 4 pixels.
        step: i32,
        /// Factor of the width that a blocker search finds.
        beta: f32,
        /// Normal offset of that search: multiples of what a plane needs.
        normal_offset: f32,
        /// Depth bias of that search: slopes of the receiver's plane a texel, summed over both axes.
        depth_bias: f32,
    }
}

/// Makes a list with room for every pixel of an image. The passes of a frame use it in turn: for the pixels whose hard
/// shadow is listed, for those at an edge, for rows of the distance transform's labels, and for quads near an edge.
pub(super) fn pixel_list(context: &Context, extent: [u32; 2]) -> Result<Arc<Buffer>> {
    // Rows of labels are padded to four pixels.
    let padded = [extent[0].next_multiple_of(4), extent[1]];
    Ok(Arc::new(pixels::pixel_list(context, "pixels and labels in turn", padded)?))
}

/// Makes an image for a shader's binding; it has one pixel if it is not wanted.
pub(super) fn scratch(
    context: &Context,
    name: &str,
    format: vk::Format,
    extent: [u32; 2],
    wanted: bool,
) -> Result<Image> {
    let extent = if wanted { extent } else { [1, 1] };
    Image::new(context.device(), &ImageDesc::storage(name, format, extent))
}
