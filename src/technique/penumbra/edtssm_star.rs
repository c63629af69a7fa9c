//! Improved Euclidean distance transform soft shadow mapping.

use super::euclidean;
use crate::technique::revectorization::rbsm_pass::Revectorization;
use crate::technique::{Info, Kind, Param};

const PARAMS: &[Param] = &euclidean::soft_params(0, 16);

/// The registry entry.
pub const INFO: Info = Info {
    id: "edtssm-star",
    title: "Improved Euclidean distance transform soft shadow mapping",
    paper: "this project, after Macedo, Apolinário 2017 (SIBGRAPI)",
    summary: "The same over the edges that RBSM* draws, with distances taken along the light as the penumbrae's widths are.",
    params: PARAMS,
    published: &[],
    needs: &[],
    kind: Kind::RealTime(|context, setup| euclidean::prepare_soft(context, setup, Revectorization::Star)),
};
