//! Revectorization-based soft shadow mapping without its accelerations.

use super::classified::Skip;
use super::rbssm::{FILTER_TAPS, LEAST_WIDTH, Reuse, VISIBILITY, prepare};
use crate::technique::common::blocker_search::{MEAN, SEARCH, SEARCH_TAPS};
use crate::technique::common::receiver::RECEIVER;
use crate::technique::revectorization::revectorized::{DEPTH_BIAS, MAX_DISTANCE, NORMAL_OFFSET};
use crate::technique::{Info, Kind};

/// The registry entry.
pub const INFO: Info = Info {
    id: "rbssm-naive",
    title: "Revectorization-based soft shadow mapping, not accelerated",
    paper: "Macedo, Apolinário, Agüero 2019, figures 11 and 12",
    summary: "The image of `rbssm`, every pixel and every tap worked out for itself: to compare the cost with.",
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
    ],
    // Without a classification, a search up to the near plane needs no depth bounds: none are made.
    published: &[
        ("search", "near"),
        ("mean", "depth"),
        ("visibility", "recovery"),
        ("least_width", "0"),
        ("receiver", "fixed"),
        ("normal_offset", "1"),
        ("depth_bias", "2"),
    ],
    needs: &[],
    kind: Kind::RealTime(|context, setup| prepare(context, setup, Reuse::EachTap, Skip::Off)),
};
