//! Percentage-closer filtering.

use crate::gpu::{Buffer, ComputePipeline, Image, bindings};
use crate::technique::common::bindings::{CameraBindings, PixelBindings};
use crate::technique::common::depth_bounds::DepthBounds;
use crate::technique::common::receiver::{self, ReceiverPush};
use crate::technique::common::tiles::{TILE, TileList};
use crate::technique::{Info, Kind, Param, Passes, Setup};
use crate::{Bind, Context, Frame, Inputs, Pass, Result, Threads};
use std::sync::Arc;

/// Smallest kernel width for which `auto` decides whole tiles. With a narrower kernel it costs less to filter all pixels where
/// most tiles have an edge or sky.
const TILES_FROM_WIDTH: u32 = 15;

/// The registry entry.
pub const INFO: Info = Info {
    id: "pcf",
    title: "Percentage-closer filtering",
    paper: "Reeves, Salesin, Cook 1987",
    summary: "Averages the tests of w x w texels with bilinear weights: a soft edge w texels wide, on the receiver's plane.",
    params: &[
        Param::odd("width", 1, 63, 3, "texels", "width of the kernel"),
        Param { default: 0.25, ..receiver::NORMAL_OFFSET },
        Param {
            help: "additional bias of the receiver's depth, in multiples of its plane's change of depth per texel; a fixed receiver needs half the width",
            ..receiver::DEPTH_BIAS
        },
        Param::choice(
            "taps",
            &["bilinear", "nearest"],
            0,
            "texels with bilinear weights, or w x w alike as in the paper",
        ),
        receiver::RECEIVER,
        Param::choice(
            "fetch",
            &["loop", "gather"],
            1,
            "read one texel per fetch or 2 x 2 texels per gather, if bilinear; the image is the same up to rounding",
        ),
        Param::choice(
            "skip",
            &["auto", "off", "pixels", "tiles"],
            0,
            "decide uniform neighbourhoods by depth bounds of the map's blocks: each pixel in the filter (pixels), or whole tiles in a \
             pass that lists the others (tiles, and auto from width 15 on); the image is the same",
        ),
    ],
    published: &[("taps", "nearest"), ("receiver", "fixed"), ("normal_offset", "1"), ("depth_bias", "1")],
    needs: &[],
    kind: Kind::RealTime(prepare),
};

bindings! {
    struct ClassifyBindings { ..camera: CameraBindings, blocks, visibility, list }
    struct PcfBindings { ..pixels: PixelBindings, blocks }
}

struct PercentageCloser {
    /// Decides tiles and lists the others, if tiles are decided.
    classify: Option<Arc<ComputePipeline>>,
    filter: Arc<ComputePipeline>,
    /// Absent if every pixel is filtered.
    bounds: Option<DepthBounds>,
    tiles: TileList,
    push: ReceiverPush,
}

fn prepare(context: &Context, setup: &Setup) -> Result<Box<dyn Passes>> {
    let p = &setup.params;
    let width = p.int("width");
    let skip = p.word("skip");
    let (listed, bounded) = (skip == "tiles" || skip == "auto" && width >= TILES_FROM_WIDTH, skip == "pixels");
    let kernel =
        [("WIDTH", width), ("NEAREST", (p.word("taps") == "nearest").into()), ("FIXED", receiver::is_fixed(p).into())];
    let classify = match listed {
        true => Some(context.pipeline::<ClassifyBindings, ReceiverPush>("filtering/pcf_classify.comp", &kernel)?),
        false => None,
    };
    let own =
        [("GATHER", (p.word("fetch") == "gather").into()), ("LISTED", listed.into()), ("BOUNDED", bounded.into())];
    Ok(Box::new(PercentageCloser {
        classify,
        filter: context.pipeline::<PcfBindings, ReceiverPush>("filtering/pcf.comp", &[&kernel[..], &own].concat())?,
        bounds: if listed || bounded { Some(DepthBounds::new(context, setup.map_size)?) } else { None },
        // Without a list, the shader's binding still needs a buffer.
        tiles: TileList::new(context.device(), "pcf tiles", if listed { setup.extent } else { [0; 2] })?,
        push: receiver::push(setup),
    }))
}

impl Passes for PercentageCloser {
    fn record(&mut self, frame: &mut Frame<'_>, view: &Buffer, inputs: &Inputs<'_>, visibility: &Image) -> Result<()> {
        if let Some(bounds) = &mut self.bounds {
            bounds.record(frame, inputs)?;
        }
        let pixels = PixelBindings::new(view, inputs, visibility, Bind::Buffer(self.tiles.buffer()));
        // Without bounds, the shader's binding still needs an image, which it does not read.
        let blocks = self.bounds.as_ref().map_or(Bind::Input(&inputs.depth), |b| Bind::Image(b.blocks()));
        let push = bytemuck::bytes_of(&self.push);
        let [width, height] = visibility.extent();
        let mut threads = Threads::Count([width, height, 1]);
        if let Some(classify) = &self.classify {
            self.tiles.clear(frame);
            let PixelBindings { receiver, visibility, list } = pixels;
            let bind = &ClassifyBindings { camera: receiver.camera, blocks, visibility, list };
            let tiles = Threads::Count([width.div_ceil(TILE), height.div_ceil(TILE), 1]);
            frame.dispatch(&Pass { name: "pcf classify", pipeline: classify, bind, push, threads: tiles })?;
            threads = self.tiles.threads();
        }
        let bind = &PcfBindings { pixels, blocks };
        frame.dispatch(&Pass { name: "pcf", pipeline: &self.filter, bind, push, threads })?;
        if self.classify.is_some() {
            self.tiles.count(frame);
        }
        Ok(())
    }

    fn memory_bytes(&self) -> u64 {
        self.tiles.buffer().size() + self.bounds.as_ref().map_or(0, |b| b.blocks().memory_bytes())
    }
}
