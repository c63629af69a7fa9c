//! Percentage-closer filtering.

use crate::gpu::{Buffer, ComputePipeline, Image, bindings};
use crate::technique::common::bindings::{CameraBindings, PixelBindings, ReceiverBindings};
use crate::technique::common::depth_bounds::DepthBounds;
use crate::technique::common::receiver::{self, ReceiverPush};
use crate::technique::common::tiles::TileList;
use crate::technique::{Info, Kind, Param, Passes, Setup};
use crate::{Bind, Context, Frame, Inputs, Pass, Result, Threads};
use std::sync::Arc;

/// Narrower kernels cost less than asking whether they can be skipped (see `results/`).
const SKIP_FROM_WIDTH: u32 = 31;

/// The registry entry.
pub const INFO: Info = Info {
    id: "pcf",
    title: "Percentage-closer filtering",
    paper: "Reeves, Salesin, Cook 1987",
    summary: "Averages the tests of w x w texels with bilinear weights: a soft edge w texels wide, on the receiver's plane.",
    params: &[
        Param::odd("width", 1, 63, 3, "texels", "width of the kernel"),
        Param { default: 0.25, ..receiver::NORMAL_OFFSET },
        receiver::DEPTH_BIAS,
        Param::choice(
            "fetch",
            &["loop", "gather"],
            1,
            "one texel a fetch, or 2 x 2 texels a gather: the same image up to rounding",
        ),
        Param::choice(
            "skip",
            &["auto", "off", "pixels", "tiles"],
            0,
            "decide uniform neighbourhoods by depth bounds of the map's blocks, in the filter or in a pass that lists tiles: the same image",
        ),
    ],
    needs: &[],
    kind: Kind::RealTime(prepare),
};

struct PercentageCloser {
    pcf: Pcf,
    push: ReceiverPush,
}

fn prepare(context: &Context, setup: &Setup) -> Result<Box<dyn Passes>> {
    let p = &setup.params;
    let width = p.int("width");
    let skip = match p.word("skip") {
        "auto" if width >= SKIP_FROM_WIDTH => PcfSkip::Pixels,
        "pixels" => PcfSkip::Pixels,
        "tiles" => PcfSkip::Tiles,
        _ => PcfSkip::Off,
    };
    let config = PcfConfig { width, gather: p.word("fetch") == "gather", skip };
    Ok(Box::new(PercentageCloser {
        pcf: Pcf::new(context, setup.extent, setup.map_size, config)?,
        push: receiver::push(setup),
    }))
}

impl Passes for PercentageCloser {
    fn record(&mut self, frame: &mut Frame<'_>, view: &Buffer, inputs: &Inputs<'_>, visibility: &Image) -> Result<()> {
        self.pcf.record(frame, view, inputs, self.push, visibility)
    }

    fn memory_bytes(&self) -> u64 {
        self.pcf.memory_bytes()
    }
}

/// Way to find pixels whose whole kernel agrees without filtering. The image is the same.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum PcfSkip {
    /// Not at all: every pixel is filtered.
    Off,
    /// Each pixel asks the depth bounds first.
    Pixels,
    /// A pass of its own asks the depth bounds and lists the tiles to filter.
    Tiles,
}

/// Settings that are fixed when the pass is made.
#[derive(Clone, Copy, Debug)]
pub struct PcfConfig {
    /// Texels along the kernel's side: odd, 1 to 63.
    pub width: u32,
    /// Four texels a gather, instead of one a fetch.
    pub gather: bool,
    /// Values that are not filtered.
    pub skip: PcfSkip,
}

bindings! {
    struct ClassifyBindings { ..camera: CameraBindings, blocks, visibility, list }
    struct PcfBindings { ..pixels: PixelBindings, blocks }
}

/// The pass with its pipelines, and what it skips by.
pub struct Pcf {
    filter: Arc<ComputePipeline>,
    /// Present only with [`PcfSkip::Tiles`].
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
        let constants =
            [("WIDTH", width), ("GATHER", gather.into()), ("LISTED", listed.into()), ("BOUNDED", bounded.into())];
        let filter = context.pipeline::<PcfBindings, ReceiverPush>("filtering/pcf.comp", &constants)?;
        let classify = match listed {
            true => {
                let constants = [("WIDTH", width)];
                Some(context.pipeline::<ClassifyBindings, ReceiverPush>("filtering/pcf_classify.comp", &constants)?)
            }
            false => None,
        };
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
        push: ReceiverPush,
        output: &Image,
    ) -> Result<()> {
        let [width, height] = output.extent();
        let all = Threads::Count([width, height, 1]);
        if let Some(bounds) = &mut self.bounds {
            bounds.record(frame, inputs)?;
        }
        let receiver = ReceiverBindings::new(view, inputs);
        // Without bounds the shader's binding still wants an image, which it does not read.
        let blocks = self.bounds.as_ref().map_or(Bind::Input(&inputs.depth), |b| Bind::Image(b.blocks()));
        let (visibility, list) = (Bind::Image(output), Bind::Buffer(self.tiles.buffer()));
        let push = bytemuck::bytes_of(&push);
        if let Some(classify) = &self.classify {
            self.tiles.clear(frame);
            let bind = &ClassifyBindings { camera: receiver.camera, blocks, visibility, list };
            frame.dispatch(&Pass { name: "pcf classify", pipeline: classify, bind, push, threads: all })?;
        }
        let threads = if self.classify.is_some() { self.tiles.threads() } else { all };
        let bind = &PcfBindings { pixels: PixelBindings { receiver, visibility, list }, blocks };
        frame.dispatch(&Pass { name: "pcf", pipeline: &self.filter, bind, push, threads })?;
        if self.classify.is_some() {
            self.tiles.count(frame);
        }
        Ok(())
    }
}
