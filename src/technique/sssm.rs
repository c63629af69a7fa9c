//! Shadow silhouette maps.

use super::edge_lookup::{self, Held, KILL};
use super::revectorized::{DEPTH_BIAS, NORMAL_OFFSET, SLACK};
use super::{Info, Kind, Param, Setup, Technique};
use crate::pass::sssm::{PointsBy, SilhouettePoints, lookup};
use crate::{Context, Need, Result};

/// The registry entry.
pub const INFO: Info = Info {
    id: "sssm",
    title: "Shadow silhouette maps",
    paper: "Sen, Cammarano, Hanrahan 2003; Kenzel 2013, section 2.3",
    summary: "The casters' edges through a point in each cell of the shadow map: exact along straight edges, one edge a cell.",
    params: &[
        Param::choice(
            "generation",
            &["compute", "raster"],
            0,
            "edges are walked along by compute shaders, or quads drawn around them: the same map",
        ),
        KILL,
        NORMAL_OFFSET,
        DEPTH_BIAS,
        SLACK,
    ],
    needs: &[Need::Casters],
    kind: Kind::RealTime(prepare),
};

fn prepare(context: &Context, setup: &Setup) -> Result<Box<dyn Technique>> {
    let by = if setup.params.word("generation") == "raster" { PointsBy::Raster } else { PointsBy::Compute };
    let (casters, kill) = (setup.casters(INFO.id)?, setup.params.on("kill"));
    let points = SilhouettePoints::new(context, INFO.id, casters, setup.map_size, by, kill)?;
    edge_lookup::prepare(context, setup, &INFO, Held::Points(points), |picture| lookup(context, picture))
}
