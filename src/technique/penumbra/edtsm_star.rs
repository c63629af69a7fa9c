//! Improved Euclidean distance transform shadow mapping, EDTSM*.

use super::euclidean;
use crate::technique::revectorization::rbsm_pass::Revectorization;
use crate::technique::{Info, Kind};

/// The registry entry.
pub const INFO: Info = Info {
    id: "edtsm-star",
    title: "Improved Euclidean distance transform shadow mapping, EDTSM*",
    paper: "Macedo, Apolinário 2018, algorithm 1",
    summary: "Penumbrae of a fixed width in the world, from each pixel's distance to the edge that RBSM* draws.",
    params: euclidean::PARAMS,
    published: &[
        ("filter_width", "0.1"),
        ("surfaces", "depth"),
        ("seeds", "any"),
        ("nearest", "pixel"),
        ("edge", "pixel"),
        ("receiver", "fixed"),
        ("normal_offset", "0.5"),
        ("depth_bias", "1"),
    ],
    needs: &[],
    kind: Kind::RealTime(|context, setup| euclidean::prepare(context, setup, Revectorization::Star)),
};
