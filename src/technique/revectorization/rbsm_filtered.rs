//! Revectorization-based shadow mapping: filtering.

use super::rbsm_pass::Revectorization;
use super::revectorized::{self, DEPTH_BIAS, MAX_DISTANCE, NORMAL_OFFSET, RECEIVER, SKIP, SLACK};
use crate::technique::{Info, Kind};

/// The registry entry.
pub const INFO: Info = Info {
    id: "rbsm-filtered",
    title: "Revectorization-based shadow filtering",
    paper: "Macedo, Apolinário, Agüero 2017, listing 5",
    summary: "A ramp across every step of an edge, on both of its sides: anti-aliased edges about a texel wide.",
    params: &[RECEIVER, MAX_DISTANCE, NORMAL_OFFSET, DEPTH_BIAS, SLACK, SKIP],
    needs: &[],
    kind: Kind::RealTime(|context, setup| revectorized::prepare(context, setup, Revectorization::Filtered)),
};
