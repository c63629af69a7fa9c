//! Screen-space revectorization-based soft shadow mapping.

use super::screen_filter::Kernel;
use super::screen_space::{self, Hard};
use crate::technique::common::blocker_search;
use crate::technique::common::surface::EDGE_THRESHOLD;
use crate::technique::revectorization::rbsm_pass::{ProfileQuality, Revectorization};
use crate::technique::revectorization::revectorized::{DEPTH_BIAS, MAX_DISTANCE, NORMAL_OFFSET, RECEIVER, SLACK};
use crate::technique::{Info, Kind, Param, Passes, Setup};
use crate::{Context, Result};

/// The registry entry.
pub const INFO: Info = Info {
    id: "ssrbssm",
    title: "Screen-space revectorization-based soft shadow mapping",
    paper: "Macedo, Apolinário, Agüero 2019, section 5",
    summary: "Penumbrae of an area light: revectorized hard shadows blurred in the image, as wide as what blocks makes them.",
    params: &[
        Param::choice(
            "visibility",
            &["filtered", "star", "profile", "printed"],
            1,
            "hard shadows that are blurred: those of rbsm-filtered, RBSM*, edge profiles, or listing 5 as in the paper",
        ),
        screen_space::SEARCH_TAPS,
        blocker_search::SEARCH,
        blocker_search::MEAN,
        screen_space::NARROW,
        screen_space::SEARCH_BIAS,
        screen_space::FILTER_TAPS,
        screen_space::footprint(2),
        screen_space::BILATERAL,
        screen_space::SURFACES,
        EDGE_THRESHOLD,
        RECEIVER,
        MAX_DISTANCE,
        NORMAL_OFFSET,
        DEPTH_BIAS,
        SLACK,
        screen_space::SKIP,
    ],
    published: &[
        ("visibility", "printed"),
        ("search_taps", "23"),
        ("search", "near"),
        ("mean", "depth"),
        ("narrow", "taps"),
        ("footprint", "screen"),
        ("bilateral", "second"),
        ("surfaces", "gaussian"),
        ("receiver", "fixed"),
        ("depth_bias", "1.5"),
    ],
    needs: &[],
    kind: Kind::RealTime(prepare),
};

fn prepare(context: &Context, setup: &Setup) -> Result<Box<dyn Passes>> {
    let revectorization = match setup.params.word("visibility") {
        "star" => Revectorization::Star,
        "profile" => Revectorization::Profile(ProfileQuality::Line),
        "printed" => Revectorization::Printed,
        _ => Revectorization::Ramp,
    };
    let hard = Hard::revectorized(context, setup, revectorization)?;
    screen_space::prepare(context, setup, hard, (Kernel::Box, 0.0))
}
