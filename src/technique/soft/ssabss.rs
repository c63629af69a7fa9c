//! Screen-space anisotropic blurred soft shadows.

use super::screen_filter::Kernel;
use super::screen_space::{self, Hard};
use crate::technique::common::blocker_search;
use crate::technique::common::receiver::{self, RECEIVER};
use crate::technique::common::surface::EDGE_THRESHOLD;
use crate::technique::{Info, Kind, Param, Passes, Setup};
use crate::{Context, Result};

/// The registry entry.
pub const INFO: Info = Info {
    id: "ssabss",
    title: "Screen-space anisotropic blurred soft shadows",
    paper: "Zheng, Saito 2011",
    summary: "Penumbrae of an area light: hard shadow tests blurred in the image by a Gaussian in the receiver's plane.",
    params: &[
        screen_space::SEARCH_TAPS,
        blocker_search::SEARCH,
        blocker_search::MEAN,
        screen_space::NARROW,
        screen_space::SEARCH_BIAS,
        screen_space::FILTER_TAPS,
        Param::float(
            "sigma",
            0.0,
            1.0,
            0.29,
            "penumbrae",
            "standard deviation of the Gaussian, as a share of the penumbra; 0.29 is that of a box as wide",
        ),
        screen_space::footprint(2),
        screen_space::BILATERAL,
        screen_space::SURFACES,
        EDGE_THRESHOLD,
        Param {
            help: "compare the texels of the blocker search with the receiver's plane, or all with the receiver's own depth as in the paper",
            ..RECEIVER
        },
        receiver::NORMAL_OFFSET,
        Param::float("depth_bias", 0.0, 1.0, 0.0, "light depth", "taken off the receiver's depth in the shadow test"),
        screen_space::SKIP,
    ],
    published: &[
        ("search_taps", "23"),
        ("search", "near"),
        ("mean", "depth"),
        ("narrow", "taps"),
        ("footprint", "plane"),
        ("surfaces", "gaussian"),
        ("receiver", "fixed"),
    ],
    needs: &[],
    kind: Kind::RealTime(prepare),
};

fn prepare(context: &Context, setup: &Setup) -> Result<Box<dyn Passes>> {
    let hard = Hard::test(context, setup)?;
    screen_space::prepare(context, setup, hard, (Kernel::Gaussian, setup.params.float("sigma")))
}
