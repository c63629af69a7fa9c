//! One hard shadow test a pixel.

use crate::gpu::{Buffer, ComputePipeline, Image, shader_struct};
use crate::pass::view::ViewConstants;
use crate::{Bind, Context, Frame, Inputs, Pass, Result, Threads};
use std::sync::Arc;

shader_struct! {
    /// Push constants of `glsl/pass/sm.comp`.
    pub struct SmPush {
        /// Multiples of what a plane needs.
        normal_offset: f32,
        /// Depth units on top.
        depth_bias: f32,
    }
}

/// The pass with its pipeline.
pub struct Sm {
    pipeline: Arc<ComputePipeline>,
}

impl Sm {
    /// Makes the pipeline.
    pub fn new(context: &Context) -> Result<Self> {
        let pipeline = context.pipeline::<SmPush>("pass/sm.comp", &[])?;
        pipeline.check_uniform::<ViewConstants>("view")?;
        Ok(Self { pipeline })
    }

    /// Writes the visibility of every pixel into `output`.
    pub fn record(
        &self,
        frame: &mut Frame<'_>,
        view: &Buffer,
        inputs: &Inputs<'_>,
        push: SmPush,
        output: &Image,
    ) -> Result<()> {
        let [width, height] = output.extent();
        frame.dispatch(&Pass {
            name: "shadow test",
            pipeline: &self.pipeline,
            bind: &[
                Bind::Buffer(view),
                Bind::Input(&inputs.depth),
                Bind::Input(inputs.normal_or_depth()),
                Bind::Input(&inputs.shadow_map),
                Bind::Image(output),
            ],
            push: bytemuck::bytes_of(&push),
            threads: Threads::Count([width, height, 1]),
        })
    }
}
