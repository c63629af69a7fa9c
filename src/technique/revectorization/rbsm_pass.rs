//! Revectorized visibility: every pixel by its texel's neighbourhood, those at an edge by the edge's shape.

use crate::gpu::{Buffer, ComputePipeline, Constant, Image};
use crate::technique::common::bindings::PixelBindings;
use crate::technique::common::pixels::{PixelPass, Step};
use crate::technique::common::rbsm_receiver::RbsmPush;
use crate::{Bind, Context, Frame, Inputs, Pass, Result, Threads};
use std::sync::Arc;

/// Treatment of a fragment at an edge.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Revectorization {
    /// Listing 4: a lit fragment is shadowed below the line from the edge's corner to its other end.
    Silhouette,
    /// Listing 5: a ramp across the edge, on both sides.
    Filtered,
    /// RBSM*, eq. 7: lines that meet from step to step.
    Star,
    /// The edge profile.
    Profile(ProfileQuality),
    /// `Silhouette` or `Filtered` with a branch for every scenario, as first published: the same image, to be timed
    /// against them.
    Branches(Branches),
}

/// One of the two visibility functions that scenarios are counted for (Macedo, Apolinário, Agüero 2017, section 4).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Branches {
    /// 12 scenarios.
    Silhouette,
    /// 31 scenarios.
    Filtered,
}

/// Reach of the edge profile.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ProfileQuality {
    /// Along the run itself.
    Run,
    /// Along the runs next door too.
    Neighbours,
    /// Along several more where a run is short, through which a line is laid.
    Line,
}

impl Revectorization {
    /// Specialization constants of the shaders that ask one of these functions.
    pub(crate) fn constants(self) -> [Constant; 2] {
        let (function, quality) = match self {
            Self::Silhouette => (0, 0),
            Self::Filtered => (1, 0),
            Self::Star => (2, 0),
            Self::Profile(quality) => (3, quality as u32),
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
    /// Treatment of a fragment at an edge.
    pub revectorization: Revectorization,
    /// Compare with the fragment's own depth everywhere, as the listings do, not with its plane.
    pub fixed_depth: bool,
    /// `MAXDIST`, texels.
    pub max_distance: u32,
    /// Fragments at an edge are listed and worked on by a second dispatch, instead of where they are found.
    pub listed: bool,
}

fn pipeline(context: &Context, config: RbsmConfig, step: Step) -> Result<Arc<ComputePipeline>> {
    let [function, quality] = config.revectorization.constants();
    let fixed = ("FIXED", config.fixed_depth.into());
    let mut constants = vec![fixed, ("MAX_DISTANCE", config.max_distance), function, ("STEP", step as u32)];
    if !matches!(config.revectorization, Revectorization::Branches(_)) {
        constants.push(quality);
    }
    context.pipeline::<PixelBindings, RbsmPush>(config.revectorization.shader(), &constants)
}

/// The pass over the pixels of a list that another pass makes.
pub struct RbsmOfList {
    pipeline: Arc<ComputePipeline>,
}

impl RbsmOfList {
    /// Makes the pipeline; [`RbsmConfig::listed`] does not matter.
    pub fn new(context: &Context, config: RbsmConfig) -> Result<Self> {
        Ok(Self { pipeline: pipeline(context, config, Step::Listed)? })
    }

    /// Writes the visibility of the listed pixels into `output`: the same as [`Rbsm::record`].
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
    /// Allocates for a camera image.
    pub fn new(context: &Context, extent: [u32; 2], config: RbsmConfig) -> Result<Self> {
        let pass =
            PixelPass::new(context, "edge pixels", extent, config.listed, |step| pipeline(context, config, step))?;
        Ok(Self { pass })
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
        self.pass.record(frame, ["revectorize", "revectorize edges"], bind, bytemuck::bytes_of(&push), output)
    }
}
