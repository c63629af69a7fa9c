//! Percentage-closer filtering, over all pixels or over those that the depth bounds leave open.

use crate::gpu::{Buffer, ComputePipeline, Image, shader_struct};
use crate::pass::depth_bounds::DepthBounds;
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

/// How pixels whose whole kernel agrees are found without filtering. The image is the same.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum PcfSkip {
    /// Not at all: every pixel is filtered.
    Off,
    /// Each pixel asks the depth bounds first.
    Pixels,
    /// A pass of its own asks the depth bounds and lists the tiles to filter.
    Tiles,
}

/// What of the pass is fixed at its making.
#[derive(Clone, Copy, Debug)]
pub struct PcfConfig {
    /// Texels along the kernel's side: odd, 1 to 63.
    pub width: u32,
    /// Four texels a gather, instead of one a fetch.
    pub gather: bool,
    /// What is not filtered.
    pub skip: PcfSkip,
}

/// The pass with its pipelines, and what it skips by.
pub struct Pcf {
    filter: Arc<ComputePipeline>,
    /// With [`PcfSkip::Tiles`] only.
    classify: Option<Arc<ComputePipeline>>,
    /// Not with [`PcfSkip::Off`].
    bounds: Option<DepthBounds>,
    tiles: TileList,
}

impl Pcf {
    /// Allocates for a camera image and a shadow map.
    pub fn new(context: &Context, extent: [u32; 2], map_size: [u32; 2], config: PcfConfig) -> Result<Self> {
        let PcfConfig { width, gather, skip } = config;
        let (listed, bounded) = (skip == PcfSkip::Tiles, skip == PcfSkip::Pixels);
        let constants = [width, gather.into(), listed.into(), bounded.into()];
        let filter = context.pipeline::<PcfPush>("pass/pcf.comp", &constants)?;
        filter.check_uniform::<ViewConstants>("view")?;
        let classify = match listed {
            true => Some(context.pipeline::<PcfPush>("pass/pcf_classify.comp", &[width])?),
            false => None,
        };
        if let Some(classify) = &classify {
            classify.check_uniform::<ViewConstants>("view")?;
        }
        let bounds = match skip {
            PcfSkip::Off => None,
            _ => Some(DepthBounds::new(context, map_size)?),
        };
        // Where nothing is listed the shader's binding still wants a buffer.
        let tiles = TileList::new(context.device(), "pcf tiles", if listed { extent } else { [0; 2] })?;
        Ok(Self { filter, classify, bounds, tiles })
    }

    /// Bytes of images and lists.
    pub fn memory_bytes(&self) -> u64 {
        self.tiles.buffer().size() + self.bounds.as_ref().map_or(0, |b| b.blocks().memory_bytes())
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
        if let Some(bounds) = &mut self.bounds {
            bounds.record(frame, inputs)?;
        }
        let map = Bind::Input(&inputs.shadow_map);
        // Without bounds the shader's binding still wants an image, which it does not read.
        let blocks = self.bounds.as_ref().map_or(Bind::Input(&inputs.depth), |b| Bind::Image(b.blocks()));
        let (depth, normal) = (Bind::Input(&inputs.depth), Bind::Input(inputs.normal_or_depth()));
        let (view, list) = (Bind::Buffer(view), Bind::Buffer(self.tiles.buffer()));
        let push = bytemuck::bytes_of(&push);
        if let Some(classify) = &self.classify {
            self.tiles.clear(frame);
            let bind = &[view, depth, normal, blocks, Bind::Image(output), list];
            frame.dispatch(&Pass { name: "pcf classify", pipeline: classify, bind, push, threads: all })?;
        }
        let threads = if self.classify.is_some() { self.tiles.threads() } else { all };
        let bind = &[view, depth, normal, map, Bind::Image(output), list, blocks];
        frame.dispatch(&Pass { name: "pcf", pipeline: &self.filter, bind, push, threads })?;
        if self.classify.is_some() {
            self.tiles.count(frame);
        }
        Ok(())
    }
}
