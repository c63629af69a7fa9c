//! Bounds of the depths in blocks of 8, 16, 32 and 64 shadow-map texels per side. Each block has bounds around a slope
//! of its own.

use super::kept::Kept;
use crate::gpu::{ComputePipeline, Image, ImageDesc, bindings, shader_struct};
use crate::{Bind, Context, Frame, Inputs, Pass, Result, Threads};
use ash::vk;
use std::sync::Arc;

/// Texels per side of a block, for each level.
pub const BLOCKS: [u32; 4] = [8, 16, 32, 64];

shader_struct! {
    /// Push constants of `glsl/common/depth_bounds.comp`.
    pub struct DepthBoundsPush {
        map_size: [i32; 2],
        layer: i32,
    }
}

bindings! {
    struct DepthBoundsBindings { shadow_map, blocks_8, blocks_16, blocks_32, blocks_64 }
}

/// The pass, its image, and a record of the inputs that the image was made from.
pub struct DepthBounds {
    pipeline: Arc<ComputePipeline>,
    blocks: Image,
    kept: Kept,
}

impl DepthBounds {
    /// Makes the pass for a shadow map of the given size.
    pub fn new(context: &Context, map_size: [u32; 2]) -> Result<Self> {
        // The size is rounded up to whole blocks of 64 texels, so that every level covers the whole map.
        let extent = map_size.map(|n| n.div_ceil(64) * 8);
        let desc = ImageDesc {
            mips: BLOCKS.len() as u32,
            ..ImageDesc::storage("shadow-map depth bounds", vk::Format::R32G32B32A32_SFLOAT, extent)
        };
        Ok(Self {
            pipeline: context.pipeline::<DepthBoundsBindings, DepthBoundsPush>("common/depth_bounds.comp", &[])?,
            blocks: Image::new(context.device(), &desc)?,
            kept: Kept::default(),
        })
    }

    /// The image. Level `l` holds the blocks of `BLOCKS[l]` texels per side: the slope in depth per texel along u and
    /// v, then the lower and the upper bound.
    pub fn blocks(&self) -> &Image {
        &self.blocks
    }

    /// Recomputes the blocks if the light has changed since they were made.
    pub fn record(&mut self, frame: &mut Frame<'_>, inputs: &Inputs<'_>) -> Result<()> {
        if self.kept.holds(inputs) {
            return Ok(());
        }
        self.kept.make(frame, inputs);
        let [width, height] = self.blocks.extent();
        frame.dispatch(&Pass {
            name: "depth bounds",
            pipeline: &self.pipeline,
            bind: &DepthBoundsBindings {
                shadow_map: Bind::Input(&inputs.shadow_map),
                blocks_8: Bind::Mip(&self.blocks, 0),
                blocks_16: Bind::Mip(&self.blocks, 1),
                blocks_32: Bind::Mip(&self.blocks, 2),
                blocks_64: Bind::Mip(&self.blocks, 3),
            },
            push: bytemuck::bytes_of(&DepthBoundsPush {
                map_size: inputs.shadow_map.extent.map(|n| n as i32),
                layer: 0,
            }),
            threads: Threads::Count([width, height, 1]),
        })
    }
}
