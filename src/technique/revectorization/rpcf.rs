//! Percentage-closer filtering of revectorized visibility.

use super::rbsm_pass::check_max_distance;
use super::revectorized::{self, DEPTH_BIAS, MAX_DISTANCE, NORMAL_OFFSET, RECEIVER, SLACK};
use crate::gpu::{Buffer, Image, bindings};
use crate::technique::common::bindings::PixelBindings;
use crate::technique::common::depth_bounds::DepthBounds;
use crate::technique::common::pixels::PixelPass;
use crate::technique::common::rbsm_receiver::RbsmPush;
use crate::technique::{Info, Kind, Param, Passes, Setup, check_odd};
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
            &["filtered", "star", "profile"],
            0,
            "what is averaged: listing 5, RBSM*, or the edge profile of runs",
        ),
        RECEIVER,
        MAX_DISTANCE,
        NORMAL_OFFSET,
        DEPTH_BIAS,
        SLACK,
        Param::choice(
            "skip",
            &["auto", "off", "list", "bounds"],
            0,
            "pixels near an edge are worked on where they are found, or listed (auto) for a dispatch of their own; with \
             bounds, depth bounds of the map's blocks decide pixels before any test, and the rest is listed: the same image",
        ),
    ],
    needs: &[],
    kind: Kind::RealTime(prepare),
};

struct RevectorizedFiltering {
    rpcf: Rpcf,
    push: RbsmPush,
}

fn prepare(context: &Context, setup: &Setup) -> Result<Box<dyn Passes>> {
    let p = &setup.params;
    let config = RpcfConfig {
        width: p.int("width"),
        visibility: match p.word("visibility") {
            "filtered" => RpcfVisibility::Filtered,
            "star" => RpcfVisibility::Star,
            _ => RpcfVisibility::Profile,
        },
        fixed_depth: p.word("receiver") == "fixed",
        max_distance: p.int("max_distance"),
        bounded: p.word("skip") == "bounds",
        listed: p.word("skip") != "off",
    };
    Ok(Box::new(RevectorizedFiltering {
        rpcf: Rpcf::new(context, setup.extent, setup.map_size, config)?,
        push: revectorized::push(setup),
    }))
}

impl Passes for RevectorizedFiltering {
    fn record(&mut self, frame: &mut Frame<'_>, view: &Buffer, inputs: &Inputs<'_>, visibility: &Image) -> Result<()> {
        self.rpcf.record(frame, view, inputs, self.push, visibility)
    }

    fn memory_bytes(&self) -> u64 {
        self.rpcf.memory_bytes()
    }
}

/// Function that is averaged.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum RpcfVisibility {
    /// Listing 5.
    Filtered,
    /// RBSM*, eq. 7.
    Star,
    /// The edge profile of runs.
    Profile,
}

/// Settings that are fixed when the pass is made.
#[derive(Clone, Copy, Debug)]
pub struct RpcfConfig {
    /// Texels along the kernel's side: odd, 1 to 31.
    pub width: u32,
    /// Function that is averaged.
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

bindings! {
    struct RpcfBindings { ..pixels: PixelBindings, blocks }
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
        check_odd("texels along the side of the kernel", width, 31)?;
        let pass = PixelPass::new(context, "rpcf pixels", extent, listed, |step| {
            let constants = [
                ("FIXED", fixed_depth.into()),
                ("MAX_DISTANCE", max_distance),
                ("w", width),
                ("FUNCTION", visibility as u32),
                ("STEP", step as u32),
                ("BOUNDED", bounded.into()),
            ];
            context.pipeline::<RpcfBindings, RbsmPush>("revectorization/rpcf.comp", &constants)
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
        let bind = &RpcfBindings {
            pixels: PixelBindings::new(view, inputs, output, self.pass.list()),
            // Without bounds the shader's binding still wants an image, which it does not read.
            blocks: self.bounds.as_ref().map_or(Bind::Input(&inputs.depth), |b| Bind::Image(b.blocks())),
        };
        self.pass.record(frame, ["rpcf", "rpcf edges"], bind, bytemuck::bytes_of(&push), output)
    }
}
