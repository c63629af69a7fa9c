//! Shadow silhouette maps.

use super::revectorized::{DEPTH_BIAS, NORMAL_OFFSET, SLACK, push};
use super::{Info, Kind, Param, Setup, Technique, visibility_image};
use crate::gpu::{Image, ImageDesc};
use crate::pass::rbsm::RbsmPush;
use crate::pass::sssm::{PointsBy, SilhouettePoints, Sssm};
use crate::pass::view::ViewBuffer;
use crate::{Context, Frame, ImageRef, Inputs, Need, Result};
use ash::vk;

/// Leaves out edges that the light does not see.
pub(super) const KILL: Param =
    Param::switch("kill", true, "edges that lie behind all that the shadow map holds around them are left out");

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

struct SilhouetteMaps {
    view: ViewBuffer,
    points: SilhouettePoints,
    lookup: Sssm,
    picture: Option<(Sssm, Image)>,
    push: RbsmPush,
    map_size: [u32; 2],
    visibility: Image,
}

fn prepare(context: &Context, setup: &Setup) -> Result<Box<dyn Technique>> {
    let by = if setup.params.word("generation") == "raster" { PointsBy::Raster } else { PointsBy::Compute };
    let kill = setup.params.on("kill");
    Ok(Box::new(SilhouetteMaps {
        view: ViewBuffer::new(context.device())?,
        points: SilhouettePoints::new(context, INFO.id, setup.casters(INFO.id)?, setup.map_size, by, kill)?,
        lookup: Sssm::new(context, false)?,
        picture: match setup.intermediates {
            true => Some((Sssm::new(context, true)?, picture(context, "points", setup)?)),
            false => None,
        },
        push: push(setup),
        map_size: setup.map_size,
        visibility: visibility_image(context.device(), "sssm visibility", setup)?,
    }))
}

/// An image to look at.
pub(super) fn picture(context: &Context, name: &str, setup: &Setup) -> Result<Image> {
    Image::new(context.device(), &ImageDesc::storage(name, vk::Format::R8G8B8A8_UNORM, setup.extent))
}

impl Technique for SilhouetteMaps {
    fn record(&mut self, frame: &mut Frame<'_>, inputs: &Inputs<'_>) -> Result<ImageRef> {
        let visibility = &self.visibility;
        inputs.check(INFO.id, visibility.extent(), self.map_size)?;
        frame.begin_group(INFO.title);
        self.points.record(frame, inputs)?;
        let view = self.view.update(frame, inputs);
        let points = self.points.points();
        self.lookup.record(frame, view, inputs, self.push, points, visibility)?;
        if let Some((lookup, image)) = &self.picture {
            lookup.record(frame, view, inputs, self.push, points, image)?;
        }
        frame.end_group();
        Ok(visibility.as_ref())
    }

    fn output(&self) -> &Image {
        &self.visibility
    }

    fn intermediates(&self) -> Vec<(&'static str, &Image)> {
        self.picture.iter().map(|(_, image)| ("points", image)).collect()
    }

    fn memory_bytes(&self) -> u64 {
        let picture = self.picture.as_ref().map_or(0, |(_, image)| image.memory_bytes());
        self.visibility.memory_bytes() + self.points.memory_bytes() + picture
    }
}
