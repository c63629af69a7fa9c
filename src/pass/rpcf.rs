//! Percentage-closer filtering of revectorized visibility.

use crate::gpu::{Buffer, ComputePipeline, Image};
use crate::pass::depth_bounds::DepthBounds;
use crate::pass::pixels::PixelList;
use crate::pass::rbsm::RbsmPush;
use crate::pass::view::ViewConstants;
use crate::{Bind, Context, Frame, Inputs, Pass, Result, Threads};
use std::sync::Arc;

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

/// The pass with its pipeline, and what it skips by.
pub struct Rpcf {
    pixels: Arc<ComputePipeline>,
    /// Works on the list.
    edges: Option<Arc<ComputePipeline>>,
    list: PixelList,
    bounds: Option<DepthBounds>,
}

impl Rpcf {
    /// Allocates for a camera image and a shadow map.
    pub fn new(context: &Context, extent: [u32; 2], map_size: [u32; 2], config: RpcfConfig) -> Result<Self> {
        let RpcfConfig { width, visibility, fixed_depth, max_distance, bounded, listed } = config;
        let pipeline = |step| -> Result<_> {
            let constants = [fixed_depth.into(), max_distance, width, visibility as u32, step, bounded.into()];
            let pipeline = context.pipeline::<RbsmPush>("pass/rpcf.comp", &constants)?;
            pipeline.check_uniform::<ViewConstants>("view")?;
            Ok(pipeline)
        };
        let (pixels, edges) = if listed { (pipeline(1)?, Some(pipeline(2)?)) } else { (pipeline(0)?, None) };
        // Where nothing is listed the shader's binding still wants a buffer.
        let list = PixelList::new(context.device(), "rpcf pixels", if listed { extent } else { [0; 2] })?;
        let bounds = if bounded { Some(DepthBounds::new(context, map_size)?) } else { None };
        Ok(Self { pixels, edges, list, bounds })
    }

    /// Bytes of device memory that the pass holds.
    pub fn memory_bytes(&self) -> u64 {
        self.list.buffer().size() + self.bounds.as_ref().map_or(0, |b| b.blocks().memory_bytes())
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
        let [width, height] = output.extent();
        let bind = &[
            Bind::Buffer(view),
            Bind::Input(&inputs.depth),
            Bind::Input(inputs.normal_or_depth()),
            Bind::Input(&inputs.shadow_map),
            Bind::Image(output),
            Bind::Buffer(self.list.buffer()),
            // Without bounds the shader's binding still wants an image, which it does not read.
            self.bounds.as_ref().map_or(Bind::Input(&inputs.depth), |b| Bind::Image(b.blocks())),
        ];
        let push = bytemuck::bytes_of(&push);
        if self.edges.is_some() {
            self.list.clear(frame);
        }
        let threads = Threads::Count([width, height, 1]);
        frame.dispatch(&Pass { name: "rpcf", pipeline: &self.pixels, bind, push, threads })?;
        if let Some(edges) = &self.edges {
            let threads = self.list.threads();
            frame.dispatch(&Pass { name: "rpcf edges", pipeline: edges, bind, push, threads })?;
            self.list.count(frame);
        }
        Ok(())
    }
}
