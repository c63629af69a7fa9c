//! Percentage-closer soft shadows.

use super::classified::{Classified, MeasuredFilter, SKIP, SearchBindings, Skip};
use crate::gpu::ComputePipeline;
use crate::technique::common::blocker_search::{self, MEAN, SEARCH, SEARCH_TAPS, SearchWindow};
use crate::technique::common::pixels::Step;
use crate::technique::common::receiver::{self, DEPTH_BIAS, NORMAL_OFFSET, RECEIVER, ReceiverPush};
use crate::technique::{Info, Kind, Param, Passes, Setup};
use crate::{Context, Result};
use std::sync::Arc;

/// The registry entry.
pub const INFO: Info = Info {
    id: "pcss",
    title: "Percentage-closer soft shadows",
    paper: "Fernando 2005",
    summary: "Penumbrae of an area light: their width from the mean distance of what blocks, filtered over that width.",
    params: &[
        SEARCH_TAPS,
        Param::odd("filter_taps", 1, 63, 15, "taps", "taps of the filter along each axis"),
        SEARCH,
        MEAN,
        Param::choice("taps", &["nearest", "bilinear"], 1, "a tap of the filter tests one texel, or 2 x 2 weighted"),
        Param::choice(
            "narrow",
            &["taps", "box"],
            1,
            "windows of no more texels than the filter has taps: taps all the same, or the exact mean of the texels",
        ),
        RECEIVER,
        Param { default: 0.25, ..NORMAL_OFFSET },
        DEPTH_BIAS,
        SKIP,
    ],
    published: &[
        ("search", "near"),
        ("mean", "depth"),
        ("taps", "nearest"),
        ("narrow", "taps"),
        ("receiver", "fixed"),
        ("normal_offset", "0.1"),
        ("depth_bias", "2"),
    ],
    needs: &[],
    kind: Kind::RealTime(prepare),
};

/// Prepares the technique, also for those that use its image.
pub(in crate::technique) fn prepare(context: &Context, setup: &Setup) -> Result<Box<dyn Passes>> {
    let p = &setup.params;
    let config = PcssConfig {
        search_taps: p.int("search_taps"),
        filter_taps: p.int("filter_taps"),
        window: blocker_search::search_window(p),
        mean_depth: blocker_search::averages_depths(p),
        fixed_depth: receiver::is_fixed(p),
        bilinear: p.word("taps") == "bilinear",
        exact_box: p.word("narrow") == "box",
    };
    let skip = (config.window, Skip::of(context, setup));
    let pipeline = |step| pipeline(context, config, step);
    Ok(Box::new(Classified::new(context, setup, "pcss", skip, receiver::push(setup), pipeline)?))
}

/// Settings of the shader.
#[derive(Clone, Copy)]
pub(super) struct PcssConfig {
    /// Taps of the blocker search along each axis.
    pub search_taps: u32,
    /// Taps of the filter along each axis.
    pub filter_taps: u32,
    /// Window in which blockers are searched.
    pub window: SearchWindow,
    /// The blocker search averages stored depths instead of distances.
    pub mean_depth: bool,
    /// All texels are compared with the receiver's own depth instead of its plane.
    pub fixed_depth: bool,
    /// The filter's taps test 2 x 2 texels, weighted by their place, instead of one.
    pub bilinear: bool,
    /// Windows of no more texels than the filter has taps are averaged exactly, texel by texel.
    pub exact_box: bool,
}

fn pipeline(context: &Context, config: PcssConfig, step: Step) -> Result<Arc<ComputePipeline>> {
    let constants = [
        ("SEARCH_TAPS", config.search_taps),
        ("FILTER_TAPS", config.filter_taps),
        ("BILINEAR", config.bilinear.into()),
        ("BOX", config.exact_box.into()),
        ("STEP", step as u32),
        step.together(context, blocker_search::rounds(config.search_taps) + filter_rounds(config.filter_taps)),
        ("MEAN_DEPTH", config.mean_depth.into()),
        ("FIXED", config.fixed_depth.into()),
        ("NEAREST_BLOCKER", (config.window == SearchWindow::Blockers).into()),
    ];
    context.pipeline::<SearchBindings, ReceiverPush>("soft/pcss.comp", &constants)
}

/// Most rounds of loops that the filter of a pixel takes.
pub(super) fn filter_rounds(taps: u32) -> u32 {
    2 * (taps + 1) * (taps + 1)
}

/// Makes the filter alone; the settings of the search have no effect.
pub(super) fn measured_filter(context: &Context, config: PcssConfig) -> Result<MeasuredFilter> {
    Ok(MeasuredFilter::new("filter wide penumbrae", pipeline(context, config, Step::Measured)?))
}
