//! Lookup of the techniques that store the casters' edges in a map of the shadow map's size.

use crate::gpu::{Bindings, Buffer, ComputePipeline, Constant, Image, bindings};
use crate::technique::common::bindings::ReceiverBindings;
use crate::technique::common::rbsm_receiver::RbsmPush;
use crate::{Bind, Context, Frame, Inputs, Pass, Result, Threads};
use std::sync::Arc;

bindings! {
    struct DistanceBindings { ..receiver: ReceiverBindings, visibility, distances }
    struct PointBindings { ..receiver: ReceiverBindings, visibility, points }
}

/// Contents of the map.
#[derive(Clone, Copy)]
pub(super) enum Held {
    Distances,
    Points,
}

/// The pass. It decides a pixel by the shadow tests around its point and by the map's values there.
pub struct MapLookup {
    held: Held,
    pipeline: Arc<ComputePipeline>,
}

impl MapLookup {
    /// Makes the pipeline. This pass does not use `FIXED` of `glsl/common/rbsm_receiver.glsl`.
    pub(super) fn new(context: &Context, held: Held, constants: &[Constant]) -> Result<Self> {
        let constants = &[&[("FIXED", 0)], constants].concat();
        let pipeline = match held {
            Held::Distances => context.pipeline::<DistanceBindings, RbsmPush>("caster_edges/edsm.comp", constants)?,
            Held::Points => context.pipeline::<PointBindings, RbsmPush>("caster_edges/sssm.comp", constants)?,
        };
        Ok(Self { held, pipeline })
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
        let (receiver, visibility, map) = (ReceiverBindings::new(view, inputs), Bind::Image(output), Bind::Image(map));
        let (name, bind): (_, &dyn Bindings) = match self.held {
            Held::Distances => ("edge distance lookup", &DistanceBindings { receiver, visibility, distances: map }),
            Held::Points => ("silhouette lookup", &PointBindings { receiver, visibility, points: map }),
        };
        frame.dispatch(&Pass {
            name,
            pipeline: &self.pipeline,
            bind,
            push: bytemuck::bytes_of(&push),
            threads: Threads::Count([width, height, 1]),
        })
    }
}
