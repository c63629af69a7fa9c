//! Revectorization-based soft shadow mapping: blocker search, width of the penumbra, mean of revectorized visibility.

use crate::gpu::{Buffer, ComputePipeline, Image};
use crate::pass::pixels::{PixelList, PixelPass, Step};
use crate::pass::rbsm::{RbsmPush, check_max_distance};
use crate::pass::soft::{MapClasses, SearchWindow, check_taps, measured_bind};
use crate::pass::view::ViewConstants;
use crate::{Bind, Context, Error, Frame, Inputs, Pass, Result};
use std::sync::Arc;

/// What is averaged.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum RbssmVisibility {
    /// Listing 4, silhouette recovery.
    Recovery,
    /// RBSM*, eq. 7.
    Improved,
}

/// What of the pass is fixed at its making.
#[derive(Clone, Copy, Debug)]
pub struct RbssmConfig {
    /// Taps of the blocker search along each axis: odd, 1 to 63.
    pub search_taps: u32,
    /// Taps of the filter along each axis: odd, 1 to 63.
    pub filter_taps: u32,
    /// Where blockers are searched.
    pub window: SearchWindow,
    /// What is averaged.
    pub visibility: RbssmVisibility,
    /// The filter is never narrower, texels, unless the light is so small that not even what touches it could cast such a
    /// penumbra: so one of size 0 keeps its hard edges.
    pub least_width: f32,
    /// `MAXDIST`, texels: 1 to 64.
    pub max_distance: u32,
    /// Runs are found once for all taps that lie on them.
    pub reuse: bool,
    /// Pixels are first classified by the depths under their window; only the others are searched and filtered.
    pub listed: bool,
}

fn pipeline(context: &Context, config: RbssmConfig, step: Step) -> Result<Arc<ComputePipeline>> {
    let RbssmConfig { search_taps, filter_taps, window, visibility, least_width, max_distance, reuse, .. } = config;
    check_max_distance(max_distance)?;
    check_taps(search_taps, filter_taps)?;
    check_least_width(least_width)?;
    let constants = [
        // `FIXED` of `glsl/pass/rbsm_receiver.glsl` is not for this pass.
        0,
        max_distance,
        search_taps,
        filter_taps,
        step as u32,
        (visibility == RbssmVisibility::Improved).into(),
        (window == SearchWindow::Blockers).into(),
        least_width.to_bits(),
        reuse.into(),
    ];
    let pipeline = context.pipeline::<RbsmPush>("pass/rbssm.comp", &constants)?;
    pipeline.check_uniform::<ViewConstants>("view")?;
    Ok(pipeline)
}

/// Refuses widths that are no texel's business.
pub(crate) fn check_least_width(least_width: f32) -> Result<()> {
    match least_width {
        0.0..=8.0 => Ok(()),
        w => Err(Error::Parameter(format!("a least width of {w} texels is not possible: 0 to 8"))),
    }
}

/// The filter alone, over pixels that another pass lists, as wide as it says.
pub(crate) struct RbssmFilter {
    pipeline: Arc<ComputePipeline>,
}

impl RbssmFilter {
    /// Makes the pipeline; of the search nothing matters.
    pub(crate) fn new(context: &Context, config: RbssmConfig) -> Result<Self> {
        Ok(Self { pipeline: pipeline(context, config, Step::Measured)? })
    }

    /// Writes the visibility of the listed pixels into `output`, filtered over their half-widths in texels.
    pub(crate) fn record(
        &self,
        frame: &mut Frame<'_>,
        view: &Buffer,
        inputs: &Inputs<'_>,
        push: RbsmPush,
        (list, half_widths): (&PixelList, &Image),
        output: &Image,
    ) -> Result<()> {
        frame.dispatch(&Pass {
            name: "revectorize and filter narrow penumbrae",
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
pub struct Rbssm {
    pass: PixelPass,
    classes: MapClasses,
}

impl Rbssm {
    /// Allocates for a camera image and a shadow map.
    ///
    /// # Errors
    /// [`Error::Parameter`] for numbers of taps, a width or a distance out of range.
    pub fn new(context: &Context, extent: [u32; 2], map_size: [u32; 2], config: RbssmConfig) -> Result<Self> {
        let RbssmConfig { window, listed, .. } = config;
        let pass = PixelPass::new(context, "rbssm pixels", extent, listed, |step| pipeline(context, config, step))?;
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
        push: RbsmPush,
        output: &Image,
    ) -> Result<()> {
        self.classes.record(frame, inputs)?;
        let bind = &self.bind(view, inputs, output);
        self.pass.record(frame, ["rbssm classify", "rbssm"], bind, bytemuck::bytes_of(&push), output)
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
        push: RbsmPush,
        classes: &Image,
    ) -> Result<()> {
        self.classes.record(frame, inputs)?;
        frame.fill_image("open classes", classes, 0.5f32.to_bits());
        let bind = &self.bind(view, inputs, classes);
        self.pass.record_decided(frame, "rbssm classes", bind, bytemuck::bytes_of(&push), classes)
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
