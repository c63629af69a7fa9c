//! Revectorization-based shadow mapping with a branch for every scenario, for comparison with `rbsm` and
//! `rbsm-filtered`.

use super::rbsm_pass::{Branches, Revectorization};
use super::revectorized::{self, DEPTH_BIAS, MAX_DISTANCE, NORMAL_OFFSET, RECEIVER, SKIP, SLACK};
use crate::technique::{Info, Kind, Param, Passes, Setup};
use crate::{Context, Result};

/// The registry entry.
pub const INFO: Info = Info {
    id: "rbsm-branches",
    title: "Revectorization, a branch for every scenario",
    paper: "the original RBSM, as Macedo, Apolinário, Agüero 2017, section 4, counts it",
    summary: "Gives the images of rbsm and of rbsm-filtered with shapes=printed, bit for bit, by 43 branches; it shows what those two save.",
    params: &[VARIANT, RECEIVER, MAX_DISTANCE, NORMAL_OFFSET, DEPTH_BIAS, SLACK, SKIP],
    published: &[],
    needs: &[],
    kind: Kind::RealTime(prepare),
};

const VARIANT: Param = Param::choice(
    "variant",
    &["silhouette", "filtered"],
    0,
    "12 branches for the image of rbsm, or 31 for that of rbsm-filtered with shapes=printed",
);

fn prepare(context: &Context, setup: &Setup) -> Result<Box<dyn Passes>> {
    let variant = match setup.params.word("variant") {
        "silhouette" => Branches::Silhouette,
        _ => Branches::Filtered,
    };
    revectorized::prepare(context, setup, Revectorization::Branches(variant))
}
