//! Percentage-closer filtering.

use crate::gpu::{Buffer, ComputePipeline, Image, bindings};
use crate::technique::common::bindings::{CameraBindings, PixelBindings};
use crate::technique::common::depth_bounds::DepthBounds;
use crate::technique::common::receiver::{self, ReceiverPush};
use crate::technique::common::tiles::TileList;
use crate::technique::{Info, Kind, Param, Passes, Setup};
use crate::{Bind, Context, Frame, Inputs, Pass, Result, Threads};
use std::sync::Arc;

/// Smallest kernel width for which `auto` skips. It costs less to filter with a narrower kernel than to find out
/// whether it can be skipped (see `results/`).
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
            "decide uniform neighbourhoods by depth bounds of the map's blocks, in the filter or in a pass that lists tiles; the image is the same",
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

/// Way to find pixels whose whole kernel agrees without filtering. The image is the same.
#[derive(PartialEq)]
enum Skip {
    /// Every pixel is filtered.
    Off,
    /// Each pixel tests the depth bounds first.
    Pixels,
    /// A separate pass tests the depth bounds and lists the tiles to filter.
    Tiles,
}

struct PercentageCloser {
    /// Present only with [`Skip::Tiles`].
    classify: Option<Arc<ComputePipeline>>,
    filter: Arc<ComputePipeline>,
    /// Absent with [`Skip::Off`].
    bounds: Option<DepthBounds>,
    tiles: TileList,
    push: ReceiverPush,
}

fn prepare(context: &Context, setup: &Setup) -> Result<Box<dyn Passes>> {
    let p = &setup.params;
    let width = p.int("width");
    let skip = match p.word("skip") {
        "auto" if width >= SKIP_FROM_WIDTH => Skip::Pixels,
        "pixels" => Skip::Pixels,
        "tiles" => Skip::Tiles,
        _ => Skip::Off,
    };
    let kernel =
        [("WIDTH", width), ("NEAREST", (p.word("taps") == "nearest").into()), ("FIXED", receiver::is_fixed(p).into())];
    let listed = skip == Skip::Tiles;
    let classify = match listed {
        true => Some(context.pipeline::<ClassifyBindings, ReceiverPush>("filtering/pcf_classify.comp", &kernel)?),
        false => None,
    };
    let own = [
        ("GATHER", (p.word("fetch") == "gather").into()),
        ("LISTED", listed.into()),
        ("BOUNDED", (skip == Skip::Pixels).into()),
    ];
    Ok(Box::new(PercentageCloser {
        classify,
        filter: context.pipeline::<PcfBindings, ReceiverPush>("filtering/pcf.comp", &[&kernel[..], &own].concat())?,
        bounds: if skip == Skip::Off { None } else { Some(DepthBounds::new(context, setup.map_size)?) },
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
            frame.dispatch(&Pass { name: "pcf classify", pipeline: classify, bind, push, threads })?;
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
