//! Percentage-closer soft shadows: blocker search, width of the penumbra, filter.

use crate::gpu::{Buffer, ComputePipeline, Image};
use crate::pass::pixels::{PixelList, PixelPass, Step};
use crate::pass::soft::{MapClasses, SearchWindow, SoftPush, check_taps, measured_bind};
use crate::pass::view::ViewConstants;
use crate::{Bind, Context, Frame, Inputs, Pass, Result};
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

/// The filter alone, over pixels that another pass lists, as wide as it says.
pub(crate) struct PcssFilter {
    pipeline: Arc<ComputePipeline>,
}

impl PcssFilter {
    /// Makes the pipeline; of the search nothing matters.
    pub(crate) fn new(context: &Context, config: PcssConfig) -> Result<Self> {
        Ok(Self { pipeline: pipeline(context, config, Step::Measured)? })
    }

    /// Writes the visibility of the listed pixels into `output`, filtered over their half-widths in texels.
    pub(crate) fn record(
        &self,
        frame: &mut Frame<'_>,
        view: &Buffer,
        inputs: &Inputs<'_>,
        push: SoftPush,
        (list, half_widths): (&PixelList, &Image),
        output: &Image,
    ) -> Result<()> {
        frame.dispatch(&Pass {
            name: "filter wide penumbrae",
            pipeline: &self.pipeline,
            bind: &measured_bind(view, inputs, (list, half_widths), output),
            push: bytemuck::bytes_of(&push),
            threads: list.threads(),
        })?;
        list.count(frame);
        Ok(())
    }
}

/// The pass with its pipelines, and what it skips by.
pub struct Pcss {
    pass: PixelPass,
    classes: MapClasses,
}

impl Pcss {
    /// Allocates for a camera image and a shadow map.
    ///
    /// # Errors
    /// [`crate::Error::Parameter`] for numbers of taps out of range.
    pub fn new(context: &Context, extent: [u32; 2], map_size: [u32; 2], config: PcssConfig) -> Result<Self> {
        let PcssConfig { window, listed, .. } = config;
        let pass = PixelPass::new(context, "pcss pixels", extent, listed, |step| pipeline(context, config, step))?;
        Ok(Self { pass, classes: MapClasses::new(context, map_size, window, listed)? })
    }

    /// Bytes of images and lists.
    pub fn memory_bytes(&self) -> u64 {
        self.pass.memory_bytes() + self.classes.memory_bytes()
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
        self.classes.record(frame, inputs)?;
        let bind = &self.bind(view, inputs, output);
        self.pass.record(frame, ["pcss classify", "pcss"], bind, bytemuck::bytes_of(&push), output)
    }

    /// Whether pixels are classified before.
    pub fn is_listed(&self) -> bool {
        self.pass.is_listed()
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
        self.classes.record(frame, inputs)?;
        frame.fill_image("open classes", classes, 0.5f32.to_bits());
        let bind = &self.bind(view, inputs, classes);
        self.pass.record_decided(frame, "pcss classes", bind, bytemuck::bytes_of(&push), classes)
    }

    fn bind<'a>(&'a self, view: &'a Buffer, inputs: &'a Inputs<'_>, output: &'a Image) -> [Bind<'a>; 9] {
        let [hsm, blocks] = self.classes.bind(inputs);
        [
            Bind::Buffer(view),
            Bind::Input(&inputs.depth),
            Bind::Input(inputs.normal_or_depth()),
            Bind::Input(&inputs.shadow_map),
            Bind::Image(output),
            self.pass.list(),
            hsm,
            blocks,
            Bind::Input(&inputs.depth), // not read
        ]
    }
}
