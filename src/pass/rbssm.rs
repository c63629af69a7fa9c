//! Revectorization-based soft shadow mapping: blocker search, width of the penumbra, mean of revectorized visibility.

use crate::gpu::{Buffer, ComputePipeline, Image};
use crate::pass::classified::{ClassifiedPass, MeasuredFilter};
use crate::pass::pixels::Step;
use crate::pass::rbsm::{RbsmPush, check_max_distance};
use crate::pass::soft::{SearchWindow, check_taps};
use crate::pass::view::ViewConstants;
use crate::{Context, Error, Frame, Inputs, Result};
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

/// The filter alone, over pixels that another pass lists, as wide as it says; of the search nothing matters.
pub(super) fn measured_filter(context: &Context, config: RbssmConfig) -> Result<MeasuredFilter> {
    Ok(MeasuredFilter::new("revectorize and filter narrow penumbrae", pipeline(context, config, Step::Measured)?))
}

/// The pass with its pipelines, and what it skips by.
pub struct Rbssm {
    pass: ClassifiedPass,
}

impl Rbssm {
    /// Allocates for a camera image and a shadow map.
    ///
    /// # Errors
    /// [`Error::Parameter`] for numbers of taps, a width or a distance out of range.
    pub fn new(context: &Context, extent: [u32; 2], map_size: [u32; 2], config: RbssmConfig) -> Result<Self> {
        let RbssmConfig { window, listed, .. } = config;
        let pipeline = |step| pipeline(context, config, step);
        let sizes = [extent, map_size];
        Ok(Self { pass: ClassifiedPass::new(context, "rbssm pixels", sizes, (window, listed), pipeline)? })
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
        push: RbsmPush,
        output: &Image,
    ) -> Result<()> {
        let names = ["rbssm classify", "rbssm"];
        self.pass.record(frame, view, inputs, (names, bytemuck::bytes_of(&push)), output)
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
        self.pass.record_classes(frame, view, inputs, ("rbssm classes", bytemuck::bytes_of(&push)), classes)
    }
}
