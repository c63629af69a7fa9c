//! Search for the point between two pixels where a hard shadow ends.

use crate::gpu::{Buffer, ComputePipeline, Image, bindings};
use crate::technique::common::bindings::ReceiverBindings;
use crate::technique::common::rbsm_receiver::RbsmPush;
use crate::technique::revectorization::rbsm_pass::RbsmConfig;
use crate::{Bind, Context, Frame, Inputs, Pass, Result, Threads};
use std::sync::Arc;

/// Bisections between a pixel and the next: the edge is found to a sixteenth of their distance.
pub const STEPS: u32 = 3;

bindings! {
    struct PlaceBindings { ..receiver: ReceiverBindings, list, seeds, SeedBits }
}

/// The pass: it evaluates the function of the hard shadows again, at points between pixels.
pub(super) struct EdgePlace {
    pipeline: Arc<ComputePipeline>,
}

impl EdgePlace {
    /// Makes the pipeline for the function of the hard shadows; [`RbsmConfig::listed`] has no effect.
    pub fn new(context: &Context, hard: RbsmConfig) -> Result<Self> {
        let [function, quality] = hard.revectorization.constants();
        let fixed = ("FIXED", hard.fixed_depth.into());
        let constants = [fixed, ("MAX_DISTANCE", hard.max_distance), function, quality, ("STEPS", STEPS)];
        Ok(Self { pipeline: context.pipeline::<PlaceBindings, RbsmPush>("penumbra/edge_place.comp", &constants)? })
    }

    /// Moves the seeds' points from half-way between pixels to the edge.
    pub(super) fn record(
        &self,
        frame: &mut Frame<'_>,
        view: &Buffer,
        inputs: &Inputs<'_>,
        push: RbsmPush,
        (pixels, seeds, bits): (&Buffer, &Image, &Buffer),
    ) -> Result<()> {
        frame.dispatch(&Pass {
            name: "places of edges",
            pipeline: &self.pipeline,
            bind: &PlaceBindings {
                receiver: ReceiverBindings::new(view, inputs),
                list: Bind::Buffer(pixels),
                seeds: Bind::Image(seeds),
                SeedBits: Bind::Buffer(bits),
            },
            push: bytemuck::bytes_of(&push),
            threads: Threads::Indirect(pixels, 0),
        })
    }
}
