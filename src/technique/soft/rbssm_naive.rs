//! Revectorization-based soft shadow mapping without its accelerations.

use super::rbssm::{FILTER_TAPS, LEAST_WIDTH, VISIBILITY, prepare};
use crate::technique::common::blocker_search::{SEARCH, SEARCH_TAPS};
use crate::technique::revectorization::revectorized::{DEPTH_BIAS, MAX_DISTANCE, NORMAL_OFFSET};
use crate::technique::{Info, Kind};

/// The registry entry.
pub const INFO: Info = Info {
    id: "rbssm-naive",
    title: "Revectorization-based soft shadow mapping, not accelerated",
    paper: "Macedo, Apolinário, Agüero 2019, figures 11 and 12",
    summary: "The image of `rbssm`, every pixel and every tap worked out for itself: to compare the cost with.",
    params: &[SEARCH_TAPS, FILTER_TAPS, SEARCH, VISIBILITY, LEAST_WIDTH, MAX_DISTANCE, NORMAL_OFFSET, DEPTH_BIAS],
    published: &[("search", "near"), ("visibility", "recovery"), ("least_width", "0")],
    needs: &[],
    kind: Kind::RealTime(|context, setup| prepare(context, setup, false, false)),
};
