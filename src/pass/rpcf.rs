//! Percentage-closer filtering of revectorized visibility.

use crate::gpu::{Buffer, Image};
use crate::pass::depth_bounds::DepthBounds;
use crate::pass::pixels::PixelPass;
use crate::pass::rbsm::{RbsmPush, check_max_distance};
use crate::pass::view::ViewConstants;
use crate::{Bind, Context, Error, Frame, Inputs, Result};

/// What is averaged.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum RpcfVisibility {
    /// Listing 5.
    Filtered,
    /// RBSM*, eq. 7.
    Star,
    /// The edge profile of runs.
    Profile,
}

/// What of the pass is fixed at its making.
#[derive(Clone, Copy, Debug)]
pub struct RpcfConfig {
    /// Texels along the kernel's side: odd, 1 to 31.
    pub width: u32,
    /// What is averaged.
    pub visibility: RpcfVisibility,
    /// Compare with the fragment's own depth everywhere, as the listings do, not with its plane.
    pub fixed_depth: bool,
    /// `MAXDIST`, texels: 1 to 64.
    pub max_distance: u32,
    /// Pixels ask the depth bounds of the map's blocks before any texel.
    pub bounded: bool,
    /// Pixels near an edge are listed and worked on by a second dispatch, instead of where they are found.
    pub listed: bool,
}

/// The pass with its pipelines, and what it skips by.
pub struct Rpcf {
    pass: PixelPass,
    bounds: Option<DepthBounds>,
}

impl Rpcf {
    /// Allocates for a camera image and a shadow map.
    pub fn new(context: &Context, extent: [u32; 2], map_size: [u32; 2], config: RpcfConfig) -> Result<Self> {
        let RpcfConfig { width, visibility, fixed_depth, max_distance, bounded, listed } = config;
        check_max_distance(max_distance)?;
        if width % 2 == 0 || width > 31 {
            return Err(Error::Parameter(format!(
                "a kernel of {width} texels is not possible: an odd number, 1 to 31"
            )));
        }
        let pass = PixelPass::new(context, "rpcf pixels", extent, listed, |step| {
            let constants = [fixed_depth.into(), max_distance, width, visibility as u32, step as u32, bounded.into()];
            let pipeline = context.pipeline::<RbsmPush>("pass/rpcf.comp", &constants)?;
            pipeline.check_uniform::<ViewConstants>("view")?;
            Ok(pipeline)
        })?;
        let bounds = if bounded { Some(DepthBounds::new(context, map_size)?) } else { None };
        Ok(Self { pass, bounds })
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
        let bind = &[
            Bind::Buffer(view),
            Bind::Input(&inputs.depth),
            Bind::Input(inputs.normal_or_depth()),
            Bind::Input(&inputs.shadow_map),
            Bind::Image(output),
            self.pass.list(),
            // Without bounds the shader's binding still wants an image, which it does not read.
            self.bounds.as_ref().map_or(Bind::Input(&inputs.depth), |b| Bind::Image(b.blocks())),
        ];
        self.pass.record(frame, ["rpcf", "rpcf edges"], bind, bytemuck::bytes_of(&push), output)
    }
}
