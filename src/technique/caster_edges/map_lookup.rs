//! The lookup of the techniques that hold something of the casters' edges in a map of the shadow map's size.

use crate::gpu::{Buffer, ComputePipeline, Image};
use crate::technique::common::rbsm_receiver::RbsmPush;
use crate::technique::common::view::ViewConstants;
use crate::{Bind, Context, Frame, Inputs, Pass, Result, Threads};
use std::sync::Arc;

/// The pass: a pixel by the shadow tests around its point, and by what the map holds there.
pub struct MapLookup {
    name: &'static str,
    pipeline: Arc<ComputePipeline>,
}

impl MapLookup {
    /// Makes the pipeline of one technique's shader.
    pub(super) fn new(context: &Context, name: &'static str, shader: &'static str, constants: &[u32]) -> Result<Self> {
        let pipeline = context.pipeline::<RbsmPush>(shader, constants)?;
        pipeline.check_uniform::<ViewConstants>("view")?;
        Ok(Self { name, pipeline })
    }

    /// Writes every pixel of `output`.
    pub fn record(
        &self,
        frame: &mut Frame<'_>,
        view: &Buffer,
        inputs: &Inputs<'_>,
        push: RbsmPush,
        map: &Image,
        output: &Image,
    ) -> Result<()> {
        let [width, height] = output.extent();
        frame.dispatch(&Pass {
            name: self.name,
            pipeline: &self.pipeline,
            bind: &[
                Bind::Buffer(view),
                Bind::Input(&inputs.depth),
                Bind::Input(inputs.normal_or_depth()),
                Bind::Input(&inputs.shadow_map),
                Bind::Image(output),
                Bind::Image(map),
            ],
            push: bytemuck::bytes_of(&push),
            threads: Threads::Count([width, height, 1]),
        })
    }
}
