//! Percentage-closer soft shadows: blocker search, width of the penumbra, filter.

use crate::gpu::{Buffer, ComputePipeline, Image};
use crate::pass::classified::{ClassifiedPass, MeasuredFilter};
use crate::pass::pixels::Step;
use crate::pass::soft::{SearchWindow, SoftPush, check_taps};
use crate::pass::view::ViewConstants;
use crate::{Context, Frame, Inputs, Result};
use std::sync::Arc;

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

fn pipeline(context: &Context, config: PcssConfig, step: Step) -> Result<Arc<ComputePipeline>> {
    let PcssConfig { search_taps, filter_taps, window, bilinear, exact_box, .. } = config;
    check_taps(search_taps, filter_taps)?;
    let narrow = window == SearchWindow::Blockers;
    let constants = [search_taps, filter_taps, bilinear.into(), exact_box.into(), step as u32, narrow.into()];
    let pipeline = context.pipeline::<SoftPush>("pass/pcss.comp", &constants)?;
    pipeline.check_uniform::<ViewConstants>("view")?;
    Ok(pipeline)
}

/// The filter alone, over pixels that another pass lists, as wide as it says; of the search nothing matters.
pub(super) fn measured_filter(context: &Context, config: PcssConfig) -> Result<MeasuredFilter> {
    Ok(MeasuredFilter::new("filter wide penumbrae", pipeline(context, config, Step::Measured)?))
}

/// The pass with its pipelines, and what it skips by.
pub struct Pcss {
    pass: ClassifiedPass,
}

impl Pcss {
    /// Allocates for a camera image and a shadow map.
    ///
    /// # Errors
    /// [`crate::Error::Parameter`] for numbers of taps out of range.
    pub fn new(context: &Context, extent: [u32; 2], map_size: [u32; 2], config: PcssConfig) -> Result<Self> {
        let PcssConfig { window, listed, .. } = config;
        let pipeline = |step| pipeline(context, config, step);
        let sizes = [extent, map_size];
        Ok(Self { pass: ClassifiedPass::new(context, "pcss pixels", sizes, (window, listed), pipeline)? })
    }

    /// Bytes of images and lists.
    pub fn memory_bytes(&self) -> u64 {
        self.pass.memory_bytes()
    }

    /// Whether pixels are classified before.
    pub fn is_listed(&self) -> bool {
        self.pass.is_listed()
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
        let names = ["pcss classify", "pcss"];
        self.pass.record(frame, view, inputs, (names, bytemuck::bytes_of(&push)), output)
    }

    /// Writes what the classification says of every pixel into an image of one `f32`: 1 lit, 0 in shadow, 0.5 to be searched
    /// and filtered. To be looked at; made with `TRANSFER_DST`, and only where pixels are classified.
    pub fn record_classes(
        &mut self,
        frame: &mut Frame<'_>,
        view: &Buffer,
        inputs: &Inputs<'_>,
        push: SoftPush,
        classes: &Image,
    ) -> Result<()> {
        self.pass.record_classes(frame, view, inputs, ("pcss classes", bytemuck::bytes_of(&push)), classes)
    }
}
