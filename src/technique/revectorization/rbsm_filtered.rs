//! Revectorization-based shadow mapping: filtering.

use super::rbsm_pass::Revectorization;
use super::revectorized::{self, DEPTH_BIAS, MAX_DISTANCE, NORMAL_OFFSET, RECEIVER, SKIP, SLACK};
use crate::technique::{Info, Kind, Param, Passes, Setup};
use crate::{Context, Result};

/// The registry entry.
pub const INFO: Info = Info {
    id: "rbsm-filtered",
    title: "Revectorization-based shadow filtering",
    paper: "Macedo, Apolinário, Agüero 2017, listing 5; Macedo, Apolinário 2018, eq. 7",
    summary: "A ramp across every step of an edge, on both of its sides: anti-aliased edges about a texel wide.",
    params: &[SHAPES, RECEIVER, MAX_DISTANCE, NORMAL_OFFSET, DEPTH_BIAS, SLACK, SKIP],
    published: &[("shapes", "printed"), ("receiver", "fixed"), ("depth_bias", "1.5")],
    needs: &[],
    kind: Kind::RealTime(prepare),
};

const SHAPES: Param = Param::choice(
    "shapes",
    &["keep", "printed"],
    0,
    "U, O and I shapes keep the shadow test, or take what listing 5 prints, which makes bars of one texel's width vanish",
);

fn prepare(context: &Context, setup: &Setup) -> Result<Box<dyn Passes>> {
    let function = match setup.params.word("shapes") {
        "keep" => Revectorization::Ramp,
        _ => Revectorization::Printed,
    };
    revectorized::prepare(context, setup, function)
}
