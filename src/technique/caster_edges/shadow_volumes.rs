//! Shadow volumes.

use super::silhouette_view::SilhouetteView;
use super::volumes::{Counting, Path, Settings, ShadowVolumes};
use crate::gpu::{Buffer, Image, ImageDesc};
use crate::technique::common::receiver::NORMAL_OFFSET;
use crate::technique::{Info, Kind, OutputFormat, Param, Passes, Setup};
use crate::{Context, Frame, Inputs, Need, Result};

/// The registry entry.
pub const INFO: Info = Info {
    id: "shadow-volumes",
    title: "Shadow volumes",
    paper: "Crow 1977; z-fail: Carmack 2000, Everitt, Kilgard 2002; any mesh: Kim, Kim, Turk 2008",
    summary: "Exact hard shadows of any mesh, from its silhouette edges: sharp at every pixel and without a map's bias, at the cost of much fill.",
    params: &[
        Param::choice(
            "robust",
            &["auto", "always"],
            0,
            "count the shells of closed meshes and the triangles of others, or always triangles",
        ),
        Param::choice(
            "count",
            &["stencil", "float"],
            0,
            "count up to 255 volumes in the stencil, or up to 2048 by blending",
        ),
        Param::choice(
            "path",
            &["compute", "geometry"],
            0,
            "make the sides from a list of edges, or by geometry shader",
        ),
        Param::switch("cull", true, "leave out volumes and parts of the image that cannot affect the result"),
        Param::float(
            "cap_bias",
            0.0,
            16.0,
            0.0625,
            "slopes",
            "depth bias of near caps, away from the camera; 0 = none, for a camera depth that is drawn exactly like the caps",
        ),
        Param::choice(
            "masked",
            &["map", "exclude"],
            0,
            "alpha-masked casters, which have no volumes: use the shadow map for them, or leave them out",
        ),
        NORMAL_OFFSET,
    ],
    published: &[],
    needs: &[Need::Casters, Need::DynamicRendering, Need::DepthClamp],
    kind: Kind::RealTime(prepare),
};

struct Volumes {
    volumes: ShadowVolumes,
    count: Option<Image>,
    seen: Option<SilhouetteView>,
}

fn prepare(context: &Context, setup: &Setup) -> Result<Box<dyn Passes>> {
    let casters = setup.casters(INFO.id)?;
    let p = &setup.params;
    let settings = Settings {
        counting: if p.word("count") == "float" { Counting::Blended } else { Counting::Stencil },
        path: if p.word("path") == "geometry" { Path::Geometry } else { Path::Compute },
        robust: p.word("robust") == "always",
        cull: p.on("cull"),
        cap_bias: p.float("cap_bias"),
        masked: p.word("masked") == "map",
        normal_offset: p.float("normal_offset"),
    };
    let count = setup.intermediates.then(|| {
        let desc = ImageDesc::storage("stencil count", OutputFormat::R32.format(), setup.extent);
        Image::new(context.device(), &desc)
    });
    let volumes = ShadowVolumes::new(context, casters, setup.extent, settings, setup.intermediates)?;
    let seen = setup.intermediates.then(|| SilhouetteView::new(context, volumes.silhouettes(), setup.extent));
    Ok(Box::new(Volumes { volumes, count: count.transpose()?, seen: seen.transpose()? }))
}

impl Passes for Volumes {
    fn record(&mut self, frame: &mut Frame<'_>, view: &Buffer, inputs: &Inputs<'_>, visibility: &Image) -> Result<()> {
        self.volumes.record(frame, inputs, INFO.id)?;
        self.volumes.resolve(frame, view, inputs, visibility, self.count.as_ref())?;
        if let Some(seen) = &self.seen {
            seen.record(frame, inputs, self.volumes.silhouettes())?;
        }
        Ok(())
    }

    fn intermediates(&self) -> Vec<(&'static str, &Image)> {
        let count = self.count.iter().map(|c| ("stencil-count", c));
        count.chain(self.seen.iter().map(|s| ("silhouettes", s.image()))).collect()
    }

    fn memory_bytes(&self) -> u64 {
        self.volumes.memory_bytes()
            + self.count.as_ref().map_or(0, Image::memory_bytes)
            + self.seen.as_ref().map_or(0, SilhouetteView::memory_bytes)
    }
}
