//! Euclidean distance transform shadow mapping.

use super::euclidean;
use crate::technique::revectorization::rbsm_pass::Revectorization;
use crate::technique::{Info, Kind};

/// The registry entry.
pub const INFO: Info = Info {
    id: "edtsm",
    title: "Euclidean distance transform shadow mapping",
    paper: "Macedo, Apolinário 2018, algorithm 1, over listing 4 of 2017",
    summary: "Penumbrae of a fixed width in the world, from each pixel's distance to the revectorized shadow edge.",
    params: euclidean::PARAMS,
    published: &[
        ("filter_width", "0.1"),
        ("surfaces", "depth"),
        ("seeds", "any"),
        ("nearest", "pixel"),
        ("edge", "pixel"),
        ("receiver", "fixed"),
        ("normal_offset", "1"),
        ("depth_bias", "2"),
    ],
    needs: &[],
    kind: Kind::RealTime(|context, setup| euclidean::prepare(context, setup, Revectorization::Silhouette)),
};
