//! The casters' silhouette edges in the plane of the shadow map, kept while the light stands still. The techniques that
//! store edges in a map of the shadow map's size start from them.

use super::edge_segments::EdgeSegments;
use super::silhouettes::Silhouettes;
use crate::casters::Casters;
use crate::gpu::bindings;
use crate::{Context, Frame, Inputs, Result};
use std::sync::Arc;

bindings! {
    /// Resources of a raster pass over the segments.
    pub(super) struct SegmentBindings { Segments, shadow_map }
}

/// The passes with their lists.
pub struct KeptSegments {
    silhouettes: Silhouettes,
    segments: EdgeSegments,
    margin: f32,
    technique: &'static str,
}

impl KeptSegments {
    /// Makes the passes, with room for every edge of the casters. Edges are clipped at `margin` texels around the map.
    /// The technique's name is for messages.
    ///
    /// # Errors
    /// Errors are those of [`Silhouettes::new`] and [`EdgeSegments::new`].
    pub fn new(context: &Context, technique: &'static str, casters: &Arc<Casters>, margin: f32) -> Result<Self> {
        let silhouettes = Silhouettes::new(context, casters, false)?;
        let segments = EdgeSegments::new(context, &silhouettes)?;
        Ok(Self { silhouettes, segments, margin, technique })
    }

    /// Lists the edges. Returns false if the list of the frame before is still valid; everything made from it is then
    /// valid too.
    ///
    /// # Errors
    /// [`crate::Error::Input`] unless there is a transform for each instance.
    pub fn record(&mut self, frame: &mut Frame<'_>, inputs: &Inputs<'_>) -> Result<bool> {
        self.silhouettes.casters().check_transforms(self.technique, inputs.casters)?;
        if !self.silhouettes.record(frame, inputs, None)? {
            return Ok(false);
        }
        self.segments.record(frame, inputs, &self.silhouettes, self.margin)?;
        Ok(true)
    }

    /// The list of edges, with their number and the arguments of dispatches and draws.
    pub fn silhouettes(&self) -> &Silhouettes {
        &self.silhouettes
    }

    /// The list of segments, one for each edge.
    pub fn segments(&self) -> &EdgeSegments {
        &self.segments
    }

    /// Bytes of device memory.
    pub fn memory_bytes(&self) -> u64 {
        self.silhouettes.memory_bytes() + self.segments.memory_bytes()
    }
}
