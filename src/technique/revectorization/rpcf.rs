//! Percentage-closer filtering of revectorized visibility.

use super::revectorized::{self, DEPTH_BIAS, MAX_DISTANCE, NORMAL_OFFSET, RECEIVER, SLACK};
use crate::gpu::{Buffer, Image, bindings};
use crate::technique::common::bindings::PixelBindings;
use crate::technique::common::depth_bounds::DepthBounds;
use crate::technique::common::pixels::{ALONE, PixelPass};
use crate::technique::common::rbsm_receiver::RbsmPush;
use crate::technique::{Info, Kind, Param, Passes, Setup};
use crate::{Bind, Context, Frame, Inputs, Result};

/// The registry entry.
pub const INFO: Info = Info {
    id: "rpcf",
    title: "Revectorized percentage-closer filtering",
    paper: "Macedo, Apolinário 2018, section 5",
    summary: "Averages revectorized visibility over w x w texels: a soft edge w texels wide without the map's stairs.",
    params: &[
        Param::odd("width", 1, 31, 7, "texels", "width of the kernel"),
        Param::choice(
            "visibility",
            &["filtered", "star", "profile", "printed"],
            0,
            "function to average: the ramp of rbsm-filtered, RBSM*, the edge profile of runs, or listing 5 as in the paper",
        ),
        RECEIVER,
        MAX_DISTANCE,
        NORMAL_OFFSET,
        DEPTH_BIAS,
        SLACK,
        Param::choice(
            "skip",
            &["auto", "off", "list", "quads"],
            0,
            "list pixels near an edge for a dispatch of their own (list), or work on them at once (off); quads decides tiles by \
             depth bounds of the map's blocks, and shares the work of 2 x 2 pixels, for widths up to 25 and not for visibility=profile, otherwise it is list; auto takes quads on a CPU, \
             list on a GPU; the image is the same",
        ),
    ],
    published: &[("visibility", "printed"), ("receiver", "fixed"), ("normal_offset", "2"), ("depth_bias", "3")],
    needs: &[],
    kind: Kind::RealTime(prepare),
};

bindings! {
    struct RpcfBindings { ..pixels: PixelBindings, blocks, open_tiles }
}

struct RevectorizedFiltering {
    pass: PixelPass,
    /// Depth bounds that decide tiles.
    bounds: Option<DepthBounds>,
    push: RbsmPush,
}

/// Largest kernel whose pixels are worked on by quads: their windows, 5 texels wider, have to fit.
const WIDEST_OF_QUADS: u32 = 25;

fn prepare(context: &Context, setup: &Setup) -> Result<Box<dyn Passes>> {
    let p = &setup.params;
    let function = match p.word("visibility") {
        "filtered" => 0,
        "star" => 1,
        "profile" => 2,
        _ => 3,
    };
    // On a GPU the registers of a quad would leave too few threads at a time.
    let wants_quads = match p.word("skip") {
        "auto" => context.device().is_cpu(),
        word => word == "quads",
    };
    // Profiles are followed for each pixel.
    let by_quads = wants_quads && p.int("width") <= WIDEST_OF_QUADS && p.word("visibility") != "profile";
    let pipeline = |step| {
        let constants = [
            ("FIXED", (p.word("receiver") == "fixed").into()),
            ("MAX_DISTANCE", p.int("max_distance")),
            ("WIDTH", p.int("width")),
            ("FUNCTION", function),
            ("STEP", step as u32),
            ALONE,
            ("QUADS", by_quads.into()),
        ];
        context.pipeline::<RpcfBindings, RbsmPush>("revectorization/rpcf.comp", &constants)
    };
    let pass = match by_quads {
        true => PixelPass::by_tiles(context, "rpcf pixels", setup.extent, true, pipeline)?,
        false => PixelPass::new(context, "rpcf pixels", setup.extent, p.word("skip") != "off", pipeline)?,
    };
    let bounds = if by_quads { Some(DepthBounds::new(context, setup.map_size)?) } else { None };
    Ok(Box::new(RevectorizedFiltering { pass, bounds, push: revectorized::push(setup) }))
}

impl Passes for RevectorizedFiltering {
    fn record(&mut self, frame: &mut Frame<'_>, view: &Buffer, inputs: &Inputs<'_>, visibility: &Image) -> Result<()> {
        if let Some(bounds) = &mut self.bounds {
            bounds.record(frame, inputs)?;
        }
        let bind = &RpcfBindings {
            pixels: PixelBindings::new(view, inputs, visibility, self.pass.list()),
            // Without bounds, the shader's binding still needs an image, which it does not read.
            blocks: self.bounds.as_ref().map_or(Bind::Input(&inputs.depth), |b| Bind::Image(b.blocks())),
            open_tiles: self.pass.tile_list(),
        };
        self.pass.record(frame, ["rpcf", "rpcf listed"], bind, bytemuck::bytes_of(&self.push), visibility)
    }

    fn memory_bytes(&self) -> u64 {
        self.pass.memory_bytes() + self.bounds.as_ref().map_or(0, |b| b.blocks().memory_bytes())
    }
}
