//! Percentage-closer filtering, over all pixels or over those that the min/max blocks leave open.

use crate::gpu::{Buffer, ComputePipeline, Image, shader_struct};
use crate::pass::min_max::MinMax;
use crate::pass::tiles::TileList;
use crate::pass::view::ViewConstants;
use crate::{Bind, Context, Frame, Inputs, Pass, Result, Threads};
use std::sync::Arc;

shader_struct! {
    /// Push constants of `glsl/pass/pcf.comp` and `pcf_classify.comp`.
    pub struct PcfPush {
        /// Multiples of what a plane needs.
        normal_offset: f32,
        /// Fraction of a texel's slope, along both axes.
        depth_bias: f32,
    }
}

/// What of the pass is fixed at its making.
#[derive(Clone, Copy, Debug)]
pub struct PcfConfig {
    /// Texels along the kernel's side: odd, 1 to 63.
    pub width: u32,
    /// Four texels a gather, instead of one a fetch.
    pub gather: bool,
    /// Decide uniform neighbourhoods by the map's min/max blocks and filter only the other tiles.
    pub skip: bool,
}

/// Only with [`PcfConfig::skip`].
struct Skip {
    classify: Arc<ComputePipeline>,
    min_max: MinMax,
}

/// The pass with its pipelines and the tile list.
pub struct Pcf {
    filter: Arc<ComputePipeline>,
    tiles: TileList,
    skip: Option<Skip>,
}

impl Pcf {
    /// Allocates for a camera image and a shadow map.
    pub fn new(context: &Context, extent: [u32; 2], map_size: [u32; 2], config: PcfConfig) -> Result<Self> {
        let PcfConfig { width, gather, skip } = config;
        let filter = context.pipeline::<PcfPush>("pass/pcf.comp", &[width, gather.into(), skip.into()])?;
        filter.check_uniform::<ViewConstants>("view")?;
        let skip = if skip {
            let classify = context.pipeline::<PcfPush>("pass/pcf_classify.comp", &[width])?;
            classify.check_uniform::<ViewConstants>("view")?;
            Some(Skip { classify, min_max: MinMax::new(context, map_size)? })
        } else {
            None
        };
        // Without skipping nothing is listed, but the shader's binding still wants a buffer.
        let listed = if skip.is_some() { extent } else { [0; 2] };
        Ok(Self { filter, tiles: TileList::new(context.device(), "pcf tiles", listed)?, skip })
    }

    /// Bytes of images and lists.
    pub fn memory_bytes(&self) -> u64 {
        self.tiles.buffer().size() + self.skip.as_ref().map_or(0, |s| s.min_max.blocks().memory_bytes())
    }

    /// Writes the visibility of every pixel into `output`.
    pub fn record(
        &mut self,
        frame: &mut Frame<'_>,
        view: &Buffer,
        inputs: &Inputs<'_>,
        push: PcfPush,
        output: &Image,
    ) -> Result<()> {
        let [width, height] = output.extent();
        let all = Threads::Count([width, height, 1]);
        let dispatch = |frame: &mut Frame<'_>, name, pipeline: &ComputePipeline, map, threads| {
            frame.dispatch(&Pass {
                name,
                pipeline,
                bind: &[
                    Bind::Buffer(view),
                    Bind::Input(&inputs.depth),
                    Bind::Input(inputs.normal_or_depth()),
                    map,
                    Bind::Image(output),
                    Bind::Buffer(self.tiles.buffer()),
                ],
                push: bytemuck::bytes_of(&push),
                threads,
            })
        };
        let map = Bind::Input(&inputs.shadow_map);
        let Some(skip) = &mut self.skip else { return dispatch(frame, "pcf", &self.filter, map, all) };
        skip.min_max.record(frame, inputs)?;
        self.tiles.clear(frame);
        dispatch(frame, "pcf classify", &skip.classify, Bind::Image(skip.min_max.blocks()), all)?;
        dispatch(frame, "pcf", &self.filter, map, self.tiles.threads())?;
        self.tiles.count(frame);
        Ok(())
    }
}
