//! Revectorized visibility. The neighbourhood of a pixel's texel decides most pixels; at a discontinuity, the shape of
//! the edge decides.

use crate::gpu::{Buffer, ComputePipeline, Constant, Image, bindings};
use crate::technique::common::bindings::PixelBindings;
use crate::technique::common::depth_bounds::DepthBounds;
use crate::technique::common::pixels::{ALONE, PixelPass, Step};
use crate::technique::common::rbsm_receiver::RbsmPush;
use crate::technique::common::tiles::TILE;
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
    /// True to decide whole tiles by depth bounds of the map first, and to look for such fragments in the others alone.
    /// Needs [`Self::listed`], and has no effect in images of more than [`MOST_TILES`] tiles.
    pub by_tiles: bool,
}

/// Most tiles that one dispatch works on, four in each workgroup, without a loop: in a loop a CPU driver takes a fifth longer.
const MOST_TILES: u32 = 4 * 65535;

bindings! {
    struct RbsmBindings { ..pixels: PixelBindings, blocks, open_tiles }
}

fn pipeline(context: &Context, config: RbsmConfig, step: Step) -> Result<Arc<ComputePipeline>> {
    let [function, quality] = config.revectorization.constants();
    let fixed = ("FIXED", config.fixed_depth.into());
    let mut constants = vec![
        fixed,
        ("MAX_DISTANCE", config.max_distance),
        function,
        ("STEP", step as u32),
        ALONE,
        ("BY_TILES", config.by_tiles.into()),
    ];
    if !matches!(config.revectorization, Revectorization::Branches(_)) {
        constants.extend([quality, ("FILTER_WIDTH", config.filter_width.to_bits())]);
    }
    context.pipeline::<RbsmBindings, RbsmPush>(config.revectorization.shader(), &constants)
}

/// The pass over the pixels of a list that another pass makes.
pub struct RbsmOfList {
    pipeline: Arc<ComputePipeline>,
}

impl RbsmOfList {
    /// Makes the pipeline. [`RbsmConfig::listed`] and [`RbsmConfig::by_tiles`] have no effect.
    pub fn new(context: &Context, config: RbsmConfig) -> Result<Self> {
        Ok(Self { pipeline: pipeline(context, RbsmConfig { by_tiles: false, ..config }, Step::Listed)? })
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
            // The shader reads neither blocks nor tiles here.
            bind: &RbsmBindings {
                pixels: PixelBindings::new(view, inputs, output, list),
                blocks: Bind::Input(&inputs.depth),
                open_tiles: list,
            },
            push: bytemuck::bytes_of(&push),
            threads,
        })
    }
}

/// The pass with its pipelines.
pub struct Rbsm {
    pass: PixelPass,
    /// Depth bounds that decide tiles, with [`RbsmConfig::by_tiles`].
    bounds: Option<DepthBounds>,
}

impl Rbsm {
    /// Makes the pass for a camera image and a shadow map.
    pub fn new(context: &Context, extent: [u32; 2], map_size: [u32; 2], config: RbsmConfig) -> Result<Self> {
        Self::sharing(context, extent, map_size, config, None)
    }

    /// Makes the pass as [`Self::new`] does, but with a list of pixels that other passes use before and after.
    pub(crate) fn sharing(
        context: &Context,
        extent: [u32; 2],
        map_size: [u32; 2],
        config: RbsmConfig,
        list: Option<&Arc<Buffer>>,
    ) -> Result<Self> {
        let by_tiles = config.by_tiles && extent[0].div_ceil(TILE) * extent[1].div_ceil(TILE) <= MOST_TILES;
        let config = RbsmConfig { by_tiles, ..config };
        let pipeline = |step| pipeline(context, config, step);
        let name = "listed pixels";
        let pass = PixelPass::sharing(context, name, extent, config.listed, pipeline, list)?;
        if !by_tiles || !pass.is_listed() {
            return Ok(Self { pass, bounds: None });
        }
        let bounds = Some(DepthBounds::new(context, map_size)?);
        Ok(Self { pass: pass.with_tiles(context, name, extent, pipeline)?, bounds })
    }

    /// Bytes of device memory that the pass holds.
    pub fn memory_bytes(&self) -> u64 {
        self.pass.memory_bytes() + self.bounds.as_ref().map_or(0, |b| b.blocks().memory_bytes())
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
        if let Some(bounds) = &mut self.bounds {
            bounds.record(frame, inputs)?;
        }
        let bind = &RbsmBindings {
            pixels: PixelBindings::new(view, inputs, output, self.pass.list()),
            // Without bounds, the shader's binding still needs an image, which it does not read.
            blocks: self.bounds.as_ref().map_or(Bind::Input(&inputs.depth), |b| Bind::Image(b.blocks())),
            open_tiles: self.pass.tile_list(),
        };
        self.pass.record(frame, ["revectorize", "revectorize listed"], bind, bytemuck::bytes_of(&push), output)
    }
}
