//! The edge profile, which assigns a height to every run of an edge, for all shapes.

use super::rbsm_pass::{ProfileQuality, Revectorization};
use super::revectorized::{self, DEPTH_BIAS, MAX_DISTANCE, NORMAL_OFFSET, RECEIVER, SKIP, SLACK};
use crate::technique::{Info, Kind, Param, Passes, Setup};
use crate::{Context, Result};

/// The registry entry.
pub const INFO: Info = Info {
    id: "rbsm-profile",
    title: "Revectorization by edge profiles",
    paper: "this project",
    summary: "Assigns a height to every run of an edge, by the way its ends turn: on average the most accurate hard edge from the same texels.",
    params: &[QUALITY, FILTER, FILTER_WIDTH, RECEIVER, MAX_DISTANCE, NORMAL_OFFSET, DEPTH_BIAS, SLACK, SKIP],
    published: &[],
    needs: &[],
    kind: Kind::RealTime(prepare),
};

pub(super) const QUALITY: Param = Param::choice(
    "quality",
    &["run", "neighbours", "line"],
    0,
    "look at the run alone, at the adjacent runs too, or fit a line through the edge where runs are short",
);

const FILTER: Param =
    Param::choice("filter", &["off", "ramp"], 0, "hard edges, or a ramp across them from the distance to the profile");

const FILTER_WIDTH: Param =
    Param::float("filter_width", 0.0625, 1.0, 0.5, "texels", "width of the ramp, read with filter=ramp");

/// Returns the value of [`QUALITY`].
pub(super) fn quality(setup: &Setup) -> ProfileQuality {
    match setup.params.word("quality") {
        "run" => ProfileQuality::Run,
        "neighbours" => ProfileQuality::Neighbours,
        _ => ProfileQuality::Line,
    }
}

fn prepare(context: &Context, setup: &Setup) -> Result<Box<dyn Passes>> {
    let filter_width = match setup.params.word("filter") {
        "ramp" => setup.params.float("filter_width"),
        _ => 0.0,
    };
    revectorized::prepare_filtered(context, setup, Revectorization::Profile(quality(setup)), filter_width)
}
