//! Common part of the techniques that look up the casters' edges in a map of the shadow map's size. The map is kept
//! while the light stands still.

use crate::gpu::{Bindings, Buffer, ComputePipeline, Constant, Image, ImageDesc, bindings};
use crate::technique::common::bindings::ReceiverBindings;
use crate::technique::common::rbsm_receiver::{RbsmPush, push};
use crate::technique::{Param, Passes, Setup};
use crate::{Bind, Context, Frame, Inputs, Pass, Result, Threads};
use ash::vk;
use std::sync::Arc;

pub(super) const KILL: Param =
    Param::switch("kill", true, "leave out edges that lie behind everything that the shadow map holds around them");

/// A technique's map of the casters' edges.
pub(super) trait HeldMap {
    /// Name of the intermediate image that shows the map.
    fn name(&self) -> &'static str;

    /// Makes the map, unless the one of the frame before is still valid.
    fn record(&mut self, frame: &mut Frame<'_>, inputs: &Inputs<'_>) -> Result<()>;

    fn image(&self) -> &Image;

    fn memory_bytes(&self) -> u64;
}

struct EdgeLookup {
    held: Box<dyn HeldMap>,
    lookup: MapLookup,
    picture: Option<(MapLookup, Image)>,
    push: RbsmPush,
}

/// Makes a technique with such a map. `lookup(true)` makes the pass that draws a picture of the map, `lookup(false)`
/// the one that computes the visibility.
pub(super) fn prepare(
    context: &Context,
    setup: &Setup,
    held: Box<dyn HeldMap>,
    lookup: impl Fn(bool) -> Result<MapLookup>,
) -> Result<Box<dyn Passes>> {
    let picture = ImageDesc::storage(held.name(), vk::Format::R8G8B8A8_UNORM, setup.extent);
    Ok(Box::new(EdgeLookup {
        lookup: lookup(false)?,
        picture: match setup.intermediates {
            true => Some((lookup(true)?, Image::new(context.device(), &picture)?)),
            false => None,
        },
        held,
        push: push(setup),
    }))
}

impl Passes for EdgeLookup {
    fn record(&mut self, frame: &mut Frame<'_>, view: &Buffer, inputs: &Inputs<'_>, visibility: &Image) -> Result<()> {
        self.held.record(frame, inputs)?;
        let map = self.held.image();
        self.lookup.record(frame, view, inputs, self.push, map, visibility)?;
        if let Some((lookup, image)) = &self.picture {
            frame.mark_passes(", shown");
            lookup.record(frame, view, inputs, self.push, map, image)?;
            frame.mark_passes("");
        }
        Ok(())
    }

    fn intermediates(&self) -> Vec<(&'static str, &Image)> {
        self.picture.iter().map(|(_, image)| (self.held.name(), image)).collect()
    }

    fn memory_bytes(&self) -> u64 {
        let picture = self.picture.as_ref().map_or(0, |(_, image)| image.memory_bytes());
        self.held.memory_bytes() + picture
    }
}

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

/// The lookup. It decides a pixel by the shadow tests around its point and by the map's values there.
pub(super) struct MapLookup {
    held: Held,
    pipeline: Arc<ComputePipeline>,
}

impl MapLookup {
    /// Makes the pipeline. With `fixed`, all texels are compared with the point's own depth instead of its plane.
    pub(super) fn new(context: &Context, held: Held, fixed: bool, constants: &[Constant]) -> Result<Self> {
        let constants = &[&[("FIXED", fixed.into())], constants].concat();
        let pipeline = match held {
            Held::Distances => context.pipeline::<DistanceBindings, RbsmPush>("caster_edges/edsm.comp", constants)?,
            Held::Points => context.pipeline::<PointBindings, RbsmPush>("caster_edges/sssm.comp", constants)?,
        };
        Ok(Self { held, pipeline })
    }

    /// Writes every pixel of `output`.
    fn record(
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
