//! Percentage-closer soft shadows: blocker search, width of the penumbra, filter.

use crate::gpu::{Buffer, Image};
use crate::pass::depth_bounds::DepthBounds;
use crate::pass::hsm::Hsm;
use crate::pass::pixels::{PixelPass, Step};
use crate::pass::soft::{SearchWindow, SoftPush};
use crate::pass::view::ViewConstants;
use crate::{Bind, Context, Error, Frame, Inputs, Result};

/// What of the pass is fixed at its making.
#[derive(Clone, Copy, Debug)]
pub struct PcssConfig {
    /// Taps of the blocker search along each axis: odd, 1 to 63.
    pub search_taps: u32,
    /// Taps of the filter along each axis: odd, 1 to 63.
    pub filter_taps: u32,
    /// Where blockers are searched.
    pub window: SearchWindow,
    /// The filter's taps test 2 x 2 texels, weighted by their place, instead of one.
    pub bilinear: bool,
    /// Windows of no more texels than the filter has taps are averaged exactly, texel by texel.
    pub exact_box: bool,
    /// Pixels are first classified by the depths under their window; only the others are searched and filtered.
    pub listed: bool,
}

/// The pass with its pipelines, and what it skips by.
pub struct Pcss {
    pass: PixelPass,
    hsm: Option<Hsm>,
    bounds: Option<DepthBounds>,
}

impl Pcss {
    /// Allocates for a camera image and a shadow map.
    ///
    /// # Errors
    /// [`Error::Parameter`] for numbers of taps out of range.
    pub fn new(context: &Context, extent: [u32; 2], map_size: [u32; 2], config: PcssConfig) -> Result<Self> {
        let PcssConfig { search_taps, filter_taps, window, bilinear, exact_box, listed } = config;
        for (what, taps) in [("search", search_taps), ("filter", filter_taps)] {
            if taps % 2 == 0 || taps > 63 {
                let problem =
                    format!("{taps} taps along the side of the {what} are not possible: an odd number, 1 to 63");
                return Err(Error::Parameter(problem));
            }
        }
        let narrow = window == SearchWindow::Blockers;
        let pass = PixelPass::new(context, "pcss pixels", extent, listed, |step: Step| {
            let constants = [search_taps, filter_taps, bilinear.into(), exact_box.into(), step as u32, narrow.into()];
            let pipeline = context.pipeline::<SoftPush>("pass/pcss.comp", &constants)?;
            pipeline.check_uniform::<ViewConstants>("view")?;
            Ok(pipeline)
        })?;
        Ok(Self {
            pass,
            hsm: if listed || narrow { Some(Hsm::new(context, map_size)?) } else { None },
            bounds: if listed { Some(DepthBounds::new(context, map_size)?) } else { None },
        })
    }

    /// Bytes of images and lists.
    pub fn memory_bytes(&self) -> u64 {
        let hsm = self.hsm.as_ref().map_or(0, |h| h.bounds().memory_bytes());
        self.pass.memory_bytes() + hsm + self.bounds.as_ref().map_or(0, |b| b.blocks().memory_bytes())
    }

    /// Writes the visibility of every pixel into `output`.
    pub fn record(
        &mut self,
        frame: &mut Frame<'_>,
        view: &Buffer,
        inputs: &Inputs<'_>,
        push: SoftPush,
        output: &Image,
    ) -> Result<()> {
        if let Some(hsm) = &mut self.hsm {
            hsm.record(frame, inputs)?;
        }
        if let Some(bounds) = &mut self.bounds {
            bounds.record(frame, inputs)?;
        }
        // What the shader does not read, its binding still wants.
        let unread = Bind::Input(&inputs.depth);
        let bind = &[
            Bind::Buffer(view),
            Bind::Input(&inputs.depth),
            Bind::Input(inputs.normal_or_depth()),
            Bind::Input(&inputs.shadow_map),
            Bind::Image(output),
            self.pass.list(),
            self.hsm.as_ref().map_or(unread, |h| Bind::Image(h.bounds())),
            self.bounds.as_ref().map_or(unread, |b| Bind::Image(b.blocks())),
        ];
        self.pass.record(frame, ["pcss classify", "pcss"], bind, bytemuck::bytes_of(&push), output)
    }
}
