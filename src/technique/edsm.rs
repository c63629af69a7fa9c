//! Edge distance shadow mapping.

use super::revectorized::{DEPTH_BIAS, NORMAL_OFFSET, SLACK, push};
use super::sssm::{KILL, picture};
use super::{Info, Kind, Param, Setup, Technique, visibility_image};
use crate::gpu::Image;
use crate::pass::edsm::{BorderKernel, DistanceConfig, EdgeDistances, Edsm};
use crate::pass::rbsm::RbsmPush;
use crate::pass::view::ViewBuffer;
use crate::{Context, Frame, ImageRef, Inputs, Need, Result};

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

struct EdgeDistanceMapping {
    view: ViewBuffer,
    distances: EdgeDistances,
    lookup: Edsm,
    picture: Option<(Edsm, Image)>,
    push: RbsmPush,
    map_size: [u32; 2],
    visibility: Image,
}

fn prepare(context: &Context, setup: &Setup) -> Result<Box<dyn Technique>> {
    let p = &setup.params;
    let border = p.float("border");
    let kernel = match p.word("kernel") {
        "box" => BorderKernel::Box,
        "smoothstep" => BorderKernel::Smoothstep,
        _ => BorderKernel::Disc,
    };
    // Of a cell that the border reaches, all four corners must know the edge: a cell's diagonal beyond it.
    let half_width = 0.5 * border + 1.5;
    let config = DistanceConfig { cosine: p.word("priority") == "cosine", kill: p.on("kill"), half_width };
    Ok(Box::new(EdgeDistanceMapping {
        view: ViewBuffer::new(context.device())?,
        distances: EdgeDistances::new(context, INFO.id, setup.casters(INFO.id)?, setup.map_size, config)?,
        lookup: Edsm::new(context, false, border, kernel)?,
        picture: match setup.intermediates {
            true => Some((Edsm::new(context, true, border, kernel)?, picture(context, "distance", setup)?)),
            false => None,
        },
        push: push(setup),
        map_size: setup.map_size,
        visibility: visibility_image(context.device(), "edsm visibility", setup)?,
    }))
}

impl Technique for EdgeDistanceMapping {
    fn record(&mut self, frame: &mut Frame<'_>, inputs: &Inputs<'_>) -> Result<ImageRef> {
        let visibility = &self.visibility;
        inputs.check(INFO.id, visibility.extent(), self.map_size)?;
        frame.begin_group(INFO.title);
        self.distances.record(frame, inputs)?;
        let view = self.view.update(frame, inputs);
        let distances = self.distances.distances();
        self.lookup.record(frame, view, inputs, self.push, distances, visibility)?;
        if let Some((lookup, image)) = &self.picture {
            lookup.record(frame, view, inputs, self.push, distances, image)?;
        }
        frame.end_group();
        Ok(visibility.as_ref())
    }

    fn output(&self) -> &Image {
        &self.visibility
    }

    fn intermediates(&self) -> Vec<(&'static str, &Image)> {
        self.picture.iter().map(|(_, image)| ("distance", image)).collect()
    }

    fn memory_bytes(&self) -> u64 {
        let picture = self.picture.as_ref().map_or(0, |(_, image)| image.memory_bytes());
        self.visibility.memory_bytes() + self.distances.memory_bytes() + picture
    }
}
