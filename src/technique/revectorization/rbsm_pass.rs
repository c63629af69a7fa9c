//! Revectorized visibility. The neighbourhood of a pixel's texel decides most pixels; at a discontinuity, the shape of
//! the edge decides.

use crate::gpu::{Buffer, ComputePipeline, Constant, Image};
use crate::technique::common::bindings::PixelBindings;
use crate::technique::common::pixels::{PixelPass, Step};
use crate::technique::common::rbsm_receiver::RbsmPush;
use crate::{Bind, Context, Frame, Inputs, Pass, Result, Threads};
use std::sync::Arc;

/// Function that decides a fragment at an edge.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Revectorization {
    /// Listing 4: a lit fragment is shadowed below the line from the edge's corner to its other end.
    Silhouette,
    /// Eq. 7 before its threshold: listing 5's ramp across L shapes, on both sides; U, O and I shapes keep the test.
    Ramp,
    /// RBSM*, eq. 7: lines that meet from step to step.
    Star,
    /// The edge profile.
    Profile(ProfileQuality),
    /// Listing 5 as printed: a ramp, in which bars of one texel's width vanish.
    Printed,
    /// `Silhouette` or `Printed` with a branch for every scenario, as first published. The image is the same; only the
    /// cost differs.
    Branches(Branches),
}

/// One of the two visibility functions whose scenarios the paper counts (Macedo, Apolinário, Agüero 2017, section 4).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Branches {
    /// 12 scenarios.
    Silhouette,
    /// 31 scenarios.
    Filtered,
}

/// Texels that the edge profile looks at.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ProfileQuality {
    /// The run itself.
    Run,
    /// The adjacent runs as well.
    Neighbours,
    /// Several more runs if a run is short, to fit a line through them.
    Line,
}

impl Revectorization {
    /// Specialization constants that select the function in the shaders.
    pub(crate) fn constants(self) -> [Constant; 2] {
        let (function, quality) = match self {
            Self::Silhouette => (0, 0),
            Self::Ramp => (1, 0),
            Self::Star => (2, 0),
            Self::Profile(quality) => (3, quality as u32),
            Self::Printed => (4, 0),
            Self::Branches(variant) => (variant as u32, 0),
        };
        [("FUNCTION", function), ("QUALITY", quality)]
    }

    fn shader(self) -> &'static str {
        match self {
            Self::Branches(_) => "revectorization/rbsm_branches.comp",
            _ => "revectorization/rbsm.comp",
        }
    }
}

/// Settings that are fixed when the pass is made.
#[derive(Clone, Copy, Debug)]
pub struct RbsmConfig {
    /// Function that decides a fragment at an edge.
    pub revectorization: Revectorization,
    /// Width of the ramp across the edge that [`Revectorization::Profile`] finds, texels, up to 1; 0 for a hard edge.
    pub filter_width: f32,
    /// True to compare all texels with the fragment's own depth, as the listings do, instead of with its plane.
    pub fixed_depth: bool,
    /// `MAXDIST`, texels.
    pub max_distance: u32,
    /// True to list the fragments at an edge for a second dispatch, instead of working on them at once.
    pub listed: bool,
}

fn pipeline(context: &Context, config: RbsmConfig, step: Step) -> Result<Arc<ComputePipeline>> {
    let [function, quality] = config.revectorization.constants();
    let fixed = ("FIXED", config.fixed_depth.into());
    let mut constants = vec![fixed, ("MAX_DISTANCE", config.max_distance), function, ("STEP", step as u32)];
    if !matches!(config.revectorization, Revectorization::Branches(_)) {
        constants.extend([quality, ("FILTER_WIDTH", config.filter_width.to_bits())]);
    }
    context.pipeline::<PixelBindings, RbsmPush>(config.revectorization.shader(), &constants)
}

/// The pass over the pixels of a list that another pass makes.
pub struct RbsmOfList {
    pipeline: Arc<ComputePipeline>,
}

impl RbsmOfList {
    /// Makes the pipeline. [`RbsmConfig::listed`] has no effect.
    pub fn new(context: &Context, config: RbsmConfig) -> Result<Self> {
        Ok(Self { pipeline: pipeline(context, config, Step::Listed)? })
    }

    /// Writes the visibility of the listed pixels into `output`, with the same values as [`Rbsm::record`].
    pub(crate) fn record(
        &self,
        frame: &mut Frame<'_>,
        view: &Buffer,
        inputs: &Inputs<'_>,
        push: RbsmPush,
        (list, threads): (Bind<'_>, Threads<'_>),
        output: &Image,
    ) -> Result<()> {
        frame.dispatch(&Pass {
            name: "revectorize penumbrae",
            pipeline: &self.pipeline,
            bind: &PixelBindings::new(view, inputs, output, list),
            push: bytemuck::bytes_of(&push),
            threads,
        })
    }
}

/// The pass with its pipelines.
pub struct Rbsm {
    pass: PixelPass,
}

impl Rbsm {
    /// Makes the pass for a camera image.
    pub fn new(context: &Context, extent: [u32; 2], config: RbsmConfig) -> Result<Self> {
        Self::sharing(context, extent, config, None)
    }

    /// Makes the pass as [`Self::new`] does, but with a list of pixels that other passes use before and after.
    pub(crate) fn sharing(
        context: &Context,
        extent: [u32; 2],
        config: RbsmConfig,
        list: Option<&Arc<Buffer>>,
    ) -> Result<Self> {
        let pipeline = |step| pipeline(context, config, step);
        Ok(Self { pass: PixelPass::sharing(context, "listed pixels", extent, config.listed, pipeline, list)? })
    }

    /// Bytes of device memory that the pass holds.
    pub fn memory_bytes(&self) -> u64 {
        self.pass.memory_bytes()
    }

    /// Writes the visibility of every pixel into `output`.
    pub fn record(
        &self,
        frame: &mut Frame<'_>,
        view: &Buffer,
        inputs: &Inputs<'_>,
        push: RbsmPush,
        output: &Image,
    ) -> Result<()> {
        let bind = &PixelBindings::new(view, inputs, output, self.pass.list());
        self.pass.record(frame, ["revectorize", "revectorize listed"], bind, bytemuck::bytes_of(&push), output)
    }
}
