//! One hard shadow test a pixel.

use crate::gpu::{Buffer, ComputePipeline, Image, shader_struct};
use crate::pass::pixels::{Step, no_list};
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
    /// Without a list the shader's binding still wants a buffer.
    no_list: Buffer,
}

impl Sm {
    /// Makes the pipeline.
    pub fn new(context: &Context) -> Result<Self> {
        Self::with_step(context, Step::AtOnce)
    }

    /// The same for the pixels of a list that another pass makes.
    pub(crate) fn of_list(context: &Context) -> Result<Self> {
        Self::with_step(context, Step::Listed)
    }

    fn with_step(context: &Context, step: Step) -> Result<Self> {
        let pipeline = context.pipeline::<SmPush>("pass/sm.comp", &[0, 0, 0, 0, step as u32])?;
        pipeline.check_uniform::<ViewConstants>("view")?;
        Ok(Self { pipeline, no_list: no_list(context)? })
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
        let all = (Bind::Buffer(&self.no_list), Threads::Count([width, height, 1]));
        self.record_list(frame, view, inputs, push, all, output)
    }

    /// Writes the visibility of the listed pixels.
    pub(crate) fn record_list(
        &self,
        frame: &mut Frame<'_>,
        view: &Buffer,
        inputs: &Inputs<'_>,
        push: SmPush,
        (list, threads): (Bind<'_>, Threads<'_>),
        output: &Image,
    ) -> Result<()> {
        frame.dispatch(&Pass {
            name: "shadow test",
            pipeline: &self.pipeline,
            bind: &[
                Bind::Buffer(view),
                Bind::Input(&inputs.depth),
                Bind::Input(inputs.normal_or_depth()),
                Bind::Input(&inputs.shadow_map),
                Bind::Image(output),
                list,
            ],
            push: bytemuck::bytes_of(&push),
            threads,
        })
    }
}
