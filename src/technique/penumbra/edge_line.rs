//! Search for the line along which a hard shadow ends between two pixels.

use crate::gpu::{Buffer, ComputePipeline, bindings};
use crate::technique::common::bindings::ReceiverBindings;
use crate::technique::common::rbsm_receiver::RbsmPush;
use crate::technique::revectorization::rbsm_pass::RbsmConfig;
use crate::{Bind, Context, Frame, Inputs, Pass, Result, Threads};
use std::sync::Arc;

/// Largest number of places between a pixel and the next at which the hard shadow is evaluated.
pub const STEPS: u32 = 3;

bindings! {
    struct LineBindings { ..receiver: ReceiverBindings, list, Seeds, SeedBits }
}

/// The pass: it evaluates the function of the hard shadows again, at points between pixels.
pub(super) struct EdgeLine {
    pipeline: Arc<ComputePipeline>,
}

impl EdgeLine {
    /// Makes the pipeline for the function of the hard shadows; [`RbsmConfig::listed`] has no effect.
    pub fn new(context: &Context, hard: RbsmConfig) -> Result<Self> {
        let [function, quality] = hard.revectorization.constants();
        let fixed = ("FIXED", hard.fixed_depth.into());
        let constants = [fixed, ("MAX_DISTANCE", hard.max_distance), function, quality, ("STEPS", STEPS)];
        Ok(Self { pipeline: context.pipeline::<LineBindings, RbsmPush>("penumbra/edge_line.comp", &constants)? })
    }

    /// Moves the seeds' points from half-way between pixels to the edge, and gives them its direction.
    pub(super) fn record(
        &self,
        frame: &mut Frame<'_>,
        view: &Buffer,
        inputs: &Inputs<'_>,
        push: RbsmPush,
        (pixels, seeds, bits): (&Buffer, &Buffer, &Buffer),
    ) -> Result<()> {
        frame.dispatch(&Pass {
            name: "lines of edges",
            pipeline: &self.pipeline,
            bind: &LineBindings {
                receiver: ReceiverBindings::new(view, inputs),
                list: Bind::Buffer(pixels),
                Seeds: Bind::Buffer(seeds),
                SeedBits: Bind::Buffer(bits),
            },
            push: bytemuck::bytes_of(&push),
            threads: Threads::Indirect(pixels, 0),
        })
    }
}
