//! The average of many hard shadows, which the papers use as ground truth.

use crate::gpu::{ComputePipeline, Image, ImageDesc, bindings, shader_struct};
use crate::{Bind, Context, Frame, ImageRef, Pass, Result, Threads};
use ash::vk;
use std::sync::Arc;

shader_struct! {
    /// Push constants of `glsl/common/accumulate.comp`.
    pub struct AccumulatePush {
        size: [u32; 2],
        index: u32,
        count: u32,
    }
}

bindings! {
    struct AccumulateBindings { sample_visibility, lit_count, visibility }
}

/// The pass with its counter image.
pub struct Accumulate {
    pipeline: Arc<ComputePipeline>,
    lit_count: Image,
}

impl Accumulate {
    /// Makes the pass for a camera image.
    pub fn new(context: &Context, extent: [u32; 2]) -> Result<Self> {
        Ok(Self {
            pipeline: context.pipeline::<AccumulateBindings, AccumulatePush>("common/accumulate.comp", &[])?,
            lit_count: Image::new(context.device(), &ImageDesc::storage("lit count", vk::Format::R32_UINT, extent))?,
        })
    }

    /// Adds the hard shadow of sample `index` out of `count`. The last sample writes the average to `output`.
    pub fn record(
        &self,
        frame: &mut Frame<'_>,
        sample: &ImageRef,
        index: u32,
        count: u32,
        output: &Image,
    ) -> Result<()> {
        let size = output.extent();
        frame.dispatch(&Pass {
            name: "accumulate",
            pipeline: &self.pipeline,
            bind: &AccumulateBindings {
                sample_visibility: Bind::Input(sample),
                lit_count: Bind::Image(&self.lit_count),
                visibility: Bind::Image(output),
            },
            push: bytemuck::bytes_of(&AccumulatePush { size, index, count }),
            threads: Threads::Count([size[0], size[1], 1]),
        })
    }
}
