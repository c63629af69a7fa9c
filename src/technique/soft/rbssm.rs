//! Revectorization-based soft shadow mapping.

use super::classified::{Classified, MeasuredFilter, SKIP, SearchBindings, Skip};
use crate::gpu::ComputePipeline;
use crate::technique::common::blocker_search::{self, MEAN, SEARCH, SEARCH_TAPS, SearchWindow};
use crate::technique::common::pixels::Step;
use crate::technique::common::rbsm_receiver::RbsmPush;
use crate::technique::common::receiver::{self, RECEIVER};
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
        MEAN,
        VISIBILITY,
        LEAST_WIDTH,
        MAX_DISTANCE,
        RECEIVER,
        NORMAL_OFFSET,
        DEPTH_BIAS,
        Param::choice(
            "reuse",
            &["auto", "off", "printed"],
            0,
            "find the ends of an edge once for all taps that lie on it, or for each tap: the same image; or move them along a row as the paper prints it, which is wrong on some edges",
        ),
        Param {
            help: "decide pixels whose whole search window is lit or in shadow by depth bounds of the map, and work on the others: the values are those of pcss, but auto is quads on every device; the image is the same",
            ..SKIP
        },
    ],
    published: &[
        ("search", "near"),
        ("mean", "depth"),
        ("visibility", "recovery"),
        ("least_width", "0"),
        ("receiver", "fixed"),
        ("normal_offset", "1"),
        ("depth_bias", "2"),
        ("reuse", "printed"),
    ],
    needs: &[],
    kind: Kind::RealTime(|context, setup| {
        let p = &setup.params;
        let reuse = match p.word("reuse") {
            "off" => Reuse::EachTap,
            "printed" => Reuse::AsPrinted,
            _ => Reuse::EachRun,
        };
        // Following edges needs the pixels of a list, which all have work.
        let skip = if p.word("skip") == "auto" { Skip::Quads } else { Skip::of(context, setup) };
        prepare(context, setup, reuse, skip)
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

/// Makes the technique with or without its two accelerations: `reuse` of runs, and pixels to `skip`.
pub(super) fn prepare(context: &Context, setup: &Setup, reuse: Reuse, skip: Skip) -> Result<Box<dyn Passes>> {
    let p = &setup.params;
    let config = RbssmConfig {
        reuse,
        mean_depth: blocker_search::averages_depths(p),
        fixed_depth: receiver::is_fixed(p),
        ..RbssmConfig::new(p, p.int("filter_taps"))
    };
    let pipeline = |step| pipeline(context, config, step);
    Ok(Box::new(Classified::new(context, setup, "rbssm", (config.window, skip), push(p), pipeline)?))
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

/// Way to find the ends of the edges that run through a filter's taps; values of the shader.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Reuse {
    /// Every tap follows its edge.
    EachTap,
    /// Every run is followed once, for all taps on it. The image is the same.
    EachRun,
    /// Ends are moved from tap to tap along a row, as algorithm 3 prints it.
    AsPrinted,
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
    /// Way to find the ends of runs.
    pub reuse: Reuse,
    /// The blocker search averages stored depths instead of distances.
    pub mean_depth: bool,
    /// All texels are compared with the receiver's own depth instead of its plane.
    pub fixed_depth: bool,
}

impl RbssmConfig {
    /// Returns the settings from a technique's parameters, with reuse of runs, mean distances, and the receiver's plane.
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
            reuse: Reuse::EachRun,
            mean_depth: false,
            fixed_depth: false,
        }
    }

    /// Most rounds of loops that the filter of a pixel takes: the texels of a narrow window or the taps of a wide one, and the
    /// steps along the edges that run through each, two texels at a time.
    pub(super) fn filter_rounds(&self) -> u32 {
        (256 + self.filter_taps * self.filter_taps) * (8 + 2 * self.max_distance)
    }
}

fn pipeline(context: &Context, config: RbssmConfig, step: Step) -> Result<Arc<ComputePipeline>> {
    let constants = [
        // Declared by `glsl/common/rbsm_receiver.glsl`.
        ("FIXED", config.fixed_depth.into()),
        ("MEAN_DEPTH", config.mean_depth.into()),
        ("MAX_DISTANCE", config.max_distance),
        ("SEARCH_TAPS", config.search_taps),
        ("FILTER_TAPS", config.filter_taps),
        ("STEP", step as u32),
        step.together(context, blocker_search::rounds(config.search_taps) + config.filter_rounds()),
        ("STAR", (config.visibility == RbssmVisibility::Improved).into()),
        ("NEAREST_BLOCKER", (config.window == SearchWindow::Blockers).into()),
        ("LEAST_WIDTH", config.least_width.to_bits()),
        ("REUSE", config.reuse as u32),
    ];
    context.pipeline::<SearchBindings, RbsmPush>("soft/rbssm.comp", &constants)
}

/// Makes the filter alone; the settings of the search have no effect.
pub(super) fn measured_filter(context: &Context, config: RbssmConfig) -> Result<MeasuredFilter> {
    Ok(MeasuredFilter::new("revectorize and filter narrow penumbrae", pipeline(context, config, Step::Measured)?))
}
