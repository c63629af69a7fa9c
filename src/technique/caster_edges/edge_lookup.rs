//! Common part of the techniques that look up the casters' edges in a map of the shadow map's size. The map is kept
//! while the light stands still.

use super::map_lookup::MapLookup;
use crate::gpu::{Buffer, Image, ImageDesc};
use crate::technique::common::rbsm_receiver::{RbsmPush, push};
use crate::technique::{Param, Passes, Setup};
use crate::{Context, Frame, Inputs, Result};
use ash::vk;

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
