//! Euclidean distance transform soft shadow mapping.

use super::euclidean;
use crate::technique::revectorization::rbsm_pass::Revectorization;
use crate::technique::{Info, Kind, Param};

const PARAMS: &[Param] = &euclidean::soft_params(1, 0);

/// The registry entry.
pub const INFO: Info = Info {
    id: "edtssm",
    title: "Euclidean distance transform soft shadow mapping",
    paper: "Macedo, Apolinário 2017 (SIBGRAPI), algorithm 1",
    summary: "Penumbrae of an area light: blockers are searched at the revectorized shadow edges alone, the rest is distances.",
    params: PARAMS,
    published: &[
        ("search", "near"),
        ("mean", "depth"),
        ("meet", "nearest"),
        ("surfaces", "depth"),
        ("seeds", "any"),
        ("nearest", "pixel"),
        ("edge", "pixel"),
        ("receiver", "fixed"),
        ("normal_offset", "1"),
        ("depth_bias", "2"),
        // In the world's unit: 15 pixels of an image of 720 lines, at a field of view of 45 degrees, 6 units away.
        ("filter_width", "0.1"),
        ("filter_unit", "world"),
    ],
    needs: &[],
    kind: Kind::RealTime(|context, setup| euclidean::prepare_soft(context, setup, Revectorization::Silhouette)),
};
