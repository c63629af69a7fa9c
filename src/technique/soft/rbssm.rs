//! Revectorization-based soft shadow mapping.

use super::classified::{Classified, MeasuredFilter, SKIP, SearchBindings};
use crate::gpu::ComputePipeline;
use crate::technique::common::blocker_search::{self, SEARCH, SEARCH_TAPS, SearchWindow};
use crate::technique::common::pixels::Step;
use crate::technique::common::rbsm_receiver::RbsmPush;
use crate::technique::revectorization::revectorized::{DEPTH_BIAS, MAX_DISTANCE, NORMAL_OFFSET};
use crate::technique::{Info, Kind, Param, Params, Passes, Setup};
use crate::{Context, Result};
use std::sync::Arc;

/// The registry entry.
pub const INFO: Info = Info {
    id: "rbssm",
    title: "Revectorization-based soft shadow mapping",
    paper: "Macedo, Apolinário, Agüero 2019, algorithms 2 and 3",
    summary: "Percentage-closer soft shadows whose filter averages revectorized visibility: narrow penumbrae without the map's stairs.",
    params: &[
        SEARCH_TAPS,
        FILTER_TAPS,
        SEARCH,
        VISIBILITY,
        LEAST_WIDTH,
        MAX_DISTANCE,
        NORMAL_OFFSET,
        DEPTH_BIAS,
        Param::choice(
            "reuse",
            &["auto", "off"],
            0,
            "find the ends of an edge once for all taps that lie on it, or for each tap: the same image",
        ),
        SKIP,
    ],
    published: &[("search", "near"), ("visibility", "recovery"), ("least_width", "0")],
    needs: &[],
    kind: Kind::RealTime(|context, setup| {
        let p = &setup.params;
        prepare(context, setup, p.word("reuse") == "auto", p.word("skip") == "auto")
    }),
};

pub(super) const FILTER_TAPS: Param =
    Param::odd("filter_taps", 1, 63, 11, "taps", "taps of the filter along each axis, each a place in the map");
pub(super) const VISIBILITY: Param = Param::choice(
    "visibility",
    &["recovery", "improved"],
    1,
    "what is averaged: silhouette recovery (listing 4) as in the paper, or RBSM*, which does not grow the shadow",
);
pub(super) const LEAST_WIDTH: Param = Param::float(
    "least_width",
    0.0,
    8.0,
    1.0,
    "texels",
    "the filter is never narrower, unless the light is so small that it has no such penumbra at all: size 0 keeps hard edges",
);

/// Makes the technique with or without its two accelerations: `reuse` of runs, and a list of the pixels to work on.
pub(super) fn prepare(context: &Context, setup: &Setup, reuse: bool, listed: bool) -> Result<Box<dyn Passes>> {
    let p = &setup.params;
    let config = RbssmConfig { reuse, ..RbssmConfig::new(p, p.int("filter_taps")) };
    let pipeline = |step| pipeline(context, config, step);
    Ok(Box::new(Classified::new(context, setup, "rbssm", (config.window, listed), push(p), pipeline)?))
}

/// Returns the constants of a frame from the parameters.
pub(super) fn push(p: &Params) -> RbsmPush {
    RbsmPush { normal_offset: p.float("normal_offset"), depth_bias: p.float("depth_bias"), slack: 0.0 }
}

/// Function that is averaged.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum RbssmVisibility {
    /// Listing 4, silhouette recovery.
    Recovery,
    /// RBSM*, eq. 7.
    Improved,
}

/// Settings of the shader.
#[derive(Clone, Copy)]
pub(super) struct RbssmConfig {
    /// Taps of the blocker search along each axis.
    pub search_taps: u32,
    /// Taps of the filter along each axis.
    pub filter_taps: u32,
    /// Window in which blockers are searched.
    pub window: SearchWindow,
    /// Function that is averaged.
    pub visibility: RbssmVisibility,
    /// Smallest width of the filter, texels. The filter is narrower only if the light is too small to cast such a penumbra at
    /// all: a light of size 0 keeps its hard edges.
    pub least_width: f32,
    /// `MAXDIST`, texels.
    pub max_distance: u32,
    /// Runs are found once for all taps that lie on them.
    pub reuse: bool,
}

impl RbssmConfig {
    /// Returns the settings from a technique's parameters, with reuse of runs.
    pub(super) fn new(p: &Params, filter_taps: u32) -> Self {
        Self {
            search_taps: p.int("search_taps"),
            filter_taps,
            window: blocker_search::search_window(p),
            visibility: match p.word("visibility") {
                "recovery" => RbssmVisibility::Recovery,
                _ => RbssmVisibility::Improved,
            },
            least_width: p.float("least_width"),
            max_distance: p.int("max_distance"),
            reuse: true,
        }
    }
}

fn pipeline(context: &Context, config: RbssmConfig, step: Step) -> Result<Arc<ComputePipeline>> {
    let constants = [
        // Declared by `glsl/common/rbsm_receiver.glsl`: texels are tested on the receiver's plane.
        ("FIXED", 0),
        ("MAX_DISTANCE", config.max_distance),
        ("SEARCH_TAPS", config.search_taps),
        ("FILTER_TAPS", config.filter_taps),
        ("STEP", step as u32),
        ("STAR", (config.visibility == RbssmVisibility::Improved).into()),
        ("NEAREST_BLOCKER", (config.window == SearchWindow::Blockers).into()),
        ("LEAST_WIDTH", config.least_width.to_bits()),
        ("REUSE", config.reuse.into()),
    ];
    context.pipeline::<SearchBindings, RbsmPush>("soft/rbssm.comp", &constants)
}

/// Makes the filter alone; the settings of the search have no effect.
pub(super) fn measured_filter(context: &Context, config: RbssmConfig) -> Result<MeasuredFilter> {
    Ok(MeasuredFilter::new("revectorize and filter narrow penumbrae", pipeline(context, config, Step::Measured)?))
}
