//! The casters' silhouette edges in the shadow map's plane, kept while the light stands still: what the techniques draw
//! that hold something for each edge in a map of the shadow map's size.

use super::edge_segments::EdgeSegments;
use super::silhouettes::Silhouettes;
use crate::casters::Casters;
use crate::gpu::Buffer;
use crate::{Context, Frame, Inputs, Result, Threads};
use std::sync::Arc;

/// Where the arguments to draw a quad an edge stand in `SilhouetteHeader`.
pub(crate) const QUADS: u64 = 9 * 4;

/// The passes with their lists.
pub struct MapEdges {
    silhouettes: Silhouettes,
    segments: EdgeSegments,
    margin: f32,
    technique: &'static str,
}

impl MapEdges {
    /// Allocates room for every edge of the casters. Of each edge what lies up to `margin` texels around the map is kept.
    ///
    /// # Errors
    /// As of [`Silhouettes::new`].
    pub fn new(context: &Context, technique: &'static str, casters: &Arc<Casters>, margin: f32) -> Result<Self> {
        let silhouettes = Silhouettes::new(context, casters, false)?;
        let segments = EdgeSegments::new(context, &silhouettes)?;
        Ok(Self { silhouettes, segments, margin, technique })
    }

    /// Lists the edges. False if those of the frame before still hold, and with them all that was made of them.
    ///
    /// # Errors
    /// [`crate::Error::Input`] unless there is a transform for each instance.
    pub fn record(&mut self, frame: &mut Frame<'_>, inputs: &Inputs<'_>) -> Result<bool> {
        inputs.check_casters(self.technique, self.silhouettes.casters())?;
        if !self.silhouettes.record(frame, inputs, None)? {
            return Ok(false);
        }
        self.segments.record(frame, inputs, &self.silhouettes, self.margin)?;
        Ok(true)
    }

    /// A thread an edge, 64 a workgroup.
    pub(crate) fn threads(&self) -> Threads<'_> {
        Threads::Indirect(self.silhouettes.header(), 0)
    }

    /// The list: `EdgeSegment` of `glsl/lib/edge_segment.glsl`.
    pub fn segments(&self) -> &Buffer {
        self.segments.segments()
    }

    /// Their number and the arguments of dispatches and draws: `SilhouetteHeader` of `glsl/pass/silhouettes.glsl`.
    pub fn header(&self) -> &Buffer {
        self.silhouettes.header()
    }

    /// Bytes of device memory.
    pub fn memory_bytes(&self) -> u64 {
        self.silhouettes.memory_bytes() + self.segments.memory_bytes()
    }
}
