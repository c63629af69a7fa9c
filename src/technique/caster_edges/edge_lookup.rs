//! What the techniques share that look the casters' edges up in a map of the shadow map's size, which is kept while the light
//! stands still.

use super::map_lookup::MapLookup;
use crate::gpu::{Buffer, Image, ImageDesc};
use crate::technique::common::rbsm_receiver::{RbsmPush, push};
use crate::technique::{Param, Passes, Setup};
use crate::{Context, Frame, Inputs, Result};
use ash::vk;

pub(super) const KILL: Param =
    Param::switch("kill", true, "edges that lie behind all that the shadow map holds around them are left out");

/// A map of what a technique holds of the casters' edges.
pub(super) trait HeldMap {
    /// Name of the intermediate that shows it.
    fn name(&self) -> &'static str;

    /// Makes the map, unless that of the frame before still holds.
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

/// Makes a technique over such a map; `lookup` makes the lookup that draws a picture of it, or the visibility.
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
