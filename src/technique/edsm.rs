//! Edge distance shadow mapping.

use super::edge_lookup::{self, Held, KILL};
use super::revectorized::{DEPTH_BIAS, NORMAL_OFFSET, SLACK};
use super::{Info, Kind, Param, Params, Setup, Technique};
use crate::pass::edsm::{BorderKernel, DistanceConfig, EdgeDistances, lookup};
use crate::{Context, Need, Result};

/// The registry entry.
pub const INFO: Info = Info {
    id: "edsm",
    title: "Edge distance shadow mapping",
    paper: "Kenzel 2013",
    summary: "Where a shadow map's texels disagree, the distance to the casters' edges decides; soft borders for the asking.",
    params: &[
        Param::choice(
            "priority",
            &["segment", "cosine"],
            0,
            "which of several edges a texel keeps: the nearest, or by the cosine at the corner (two readings of eq. 3.8)",
        ),
        KILL,
        Param::float("border", 0.0, 16.0, 0.0, "texels", "width of the shadow's border; 0 = hard"),
        Param::choice(
            "kernel",
            &["box", "smoothstep", "disc"],
            2,
            "how visibility falls across the border: a ramp, one with soft ends, or as behind an edge under a round light",
        ),
        NORMAL_OFFSET,
        DEPTH_BIAS,
        SLACK,
    ],
    needs: &[Need::Casters, Need::DynamicRendering],
    kind: Kind::RealTime(prepare),
};

/// What a parameter `kernel` says.
pub(super) fn border_kernel(params: &Params) -> BorderKernel {
    match params.word("kernel") {
        "box" => BorderKernel::Box,
        "smoothstep" => BorderKernel::Smoothstep,
        _ => BorderKernel::Disc,
    }
}

fn prepare(context: &Context, setup: &Setup) -> Result<Box<dyn Technique>> {
    let p = &setup.params;
    let (border, kernel) = (p.float("border"), border_kernel(p));
    // Of a cell that the border reaches, all four corners must know the edge: a cell's diagonal beyond it.
    let half_width = 0.5 * border + 1.5;
    let config = DistanceConfig { cosine: p.word("priority") == "cosine", kill: p.on("kill"), half_width };
    let distances = EdgeDistances::new(context, INFO.id, setup.casters(INFO.id)?, setup.map_size, config)?;
    let lookup = |picture| lookup(context, picture, border, kernel);
    edge_lookup::prepare(context, setup, &INFO, Held::Distances(distances), lookup)
}
