//! Revectorization-based shadow mapping: silhouette recovery.

use super::rbsm_pass::Revectorization;
use super::revectorized::{self, DEPTH_BIAS, MAX_DISTANCE, NORMAL_OFFSET, RECEIVER, SKIP, SLACK};
use crate::technique::{Info, Kind};

/// The registry entry.
pub const INFO: Info = Info {
    id: "rbsm",
    title: "Revectorization-based shadow mapping",
    paper: "Macedo, Apolinário, Agüero 2017, listing 4",
    summary: "Silhouette recovery: straightens the stairs of the shadow map's edges by growing the shadow.",
    params: &[RECEIVER, MAX_DISTANCE, NORMAL_OFFSET, DEPTH_BIAS, SLACK, SKIP],
    published: &[("receiver", "fixed"), ("normal_offset", "1"), ("depth_bias", "2")],
    needs: &[],
    kind: Kind::RealTime(|context, setup| revectorized::prepare(context, setup, Revectorization::Silhouette)),
};
