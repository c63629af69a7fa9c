//! What the passes of an area light's penumbrae share (`glsl/pass/soft_receiver.glsl`, `blockers.glsl`, `hsm.glsl`).

use crate::gpu::shader_struct;
use crate::pass::depth_bounds::DepthBounds;
use crate::pass::hsm::Hsm;
use crate::{Bind, Context, Error, Frame, Inputs, Result};

shader_struct! {
    /// Push constants of the passes that search for blockers.
    pub struct SoftPush {
        /// Multiples of what a plane needs.
        normal_offset: f32,
        /// Fraction of a texel's slope, along both axes.
        depth_bias: f32,
    }
}

/// Where blockers are searched: `searchWindow` of `glsl/pass/hsm.glsl`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum SearchWindow {
    /// In the papers' window, which the light's near plane cuts out of the pyramid between receiver and light.
    Near,
    /// In the part of it where blockers can be, by the smallest depth in it: still every one, under denser taps.
    Blockers,
}

/// What pixels are classified by, and their search windows narrowed: of each only what is needed.
pub(super) struct MapClasses {
    hsm: Option<Hsm>,
    bounds: Option<DepthBounds>,
}

impl MapClasses {
    /// `listed`: pixels are classified at all.
    pub(super) fn new(context: &Context, map_size: [u32; 2], window: SearchWindow, listed: bool) -> Result<Self> {
        let narrow = window == SearchWindow::Blockers;
        Ok(Self {
            hsm: if listed || narrow { Some(Hsm::new(context, map_size)?) } else { None },
            bounds: if listed { Some(DepthBounds::new(context, map_size)?) } else { None },
        })
    }

    pub(super) fn memory_bytes(&self) -> u64 {
        self.hsm.as_ref().map_or(0, |h| h.bounds().memory_bytes())
            + self.bounds.as_ref().map_or(0, |b| b.blocks().memory_bytes())
    }

    /// Makes both anew if the light has changed.
    pub(super) fn record(&mut self, frame: &mut Frame<'_>, inputs: &Inputs<'_>) -> Result<()> {
        if let Some(hsm) = &mut self.hsm {
            hsm.record(frame, inputs)?;
        }
        if let Some(bounds) = &mut self.bounds {
            bounds.record(frame, inputs)?;
        }
        Ok(())
    }

    /// The pyramid and the blocks, for binding; another image stands in for what the shader does not read.
    pub(super) fn bind<'a>(&'a self, inputs: &'a Inputs<'_>) -> [Bind<'a>; 2] {
        let unread = Bind::Input(&inputs.depth);
        [
            self.hsm.as_ref().map_or(unread, |h| Bind::Image(h.bounds())),
            self.bounds.as_ref().map_or(unread, |b| Bind::Image(b.blocks())),
        ]
    }
}

/// Refuses numbers of taps that a kernel can't have.
pub(super) fn check_taps(search_taps: u32, filter_taps: u32) -> Result<()> {
    for (what, taps) in [("search", search_taps), ("filter", filter_taps)] {
        if taps % 2 == 0 || taps > 63 {
            let problem = format!("{taps} taps along the side of the {what} are not possible: an odd number, 1 to 63");
            return Err(Error::Parameter(problem));
        }
    }
    Ok(())
}
