//! Shadow silhouette maps.

use super::edge_lookup::{self, Held, HeldMap, KILL, MapLookup};
use super::kept_segments::{KeptSegments, SegmentBindings};
use super::silhouettes::{QUADS, chunks};
use crate::casters::{CHUNK, Casters};
use crate::frame::{Bound, RasterPass, Target};
use crate::gpu::{
    Buffer, BufferDesc, ComputePipeline, DepthState, Image, ImageDesc, MemoryKind, RasterPipeline, RasterState,
    bindings, shader_struct,
};
use crate::technique::common::rbsm_receiver::{DEPTH_BIAS, NORMAL_OFFSET, SLACK};
use crate::technique::{Info, Kind, Param, Passes, Setup};
use crate::{Bind, Context, Frame, Inputs, Need, Pass, Result};
use ash::vk;
use std::sync::Arc;

/// The registry entry.
pub const INFO: Info = Info {
    id: "sssm",
    title: "Shadow silhouette maps",
    paper: "Sen, Cammarano, Hanrahan 2003; Kenzel 2013, section 2.3",
    summary: "Stores a point of the casters' edges in each cell of the shadow map: exact along straight edges, one edge per cell.",
    params: &[
        Param::choice(
            "generation",
            &["compute", "raster"],
            0,
            "walk along edges in compute shaders, or draw quads around them; the map is the same",
        ),
        KILL,
        NORMAL_OFFSET,
        DEPTH_BIAS,
        SLACK,
    ],
    published: &[],
    needs: &[Need::Casters],
    kind: Kind::RealTime(prepare),
};

fn prepare(context: &Context, setup: &Setup) -> Result<Box<dyn Passes>> {
    let by = if setup.params.word("generation") == "raster" { PointsBy::Raster } else { PointsBy::Compute };
    let (casters, kill) = (setup.casters(INFO.id)?, setup.params.on("kill"));
    let points = SilhouettePoints::new(context, INFO.id, casters, setup.map_size, by, kill)?;
    edge_lookup::prepare(context, setup, Box::new(points), |picture| lookup(context, picture))
}

shader_struct! {
    /// Push constants of the draw of the edges.
    pub struct MapSizePush {
        map_size: [u32; 2],
    }
}

bindings! {
    struct PointsBindings { shadow_map, Header, Segments, Keys, Winners, points }
}

/// Way to make the points. Both ways give the same map.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum PointsBy {
    /// Compute shaders walk along the edges.
    Compute,
    /// A quad is drawn around each edge. Needs [`crate::DeviceFeatures::dynamic_rendering`].
    Raster,
}

enum Maker {
    Compute { steps: [Arc<ComputePipeline>; 3], keys: Buffer, winners: Buffer },
    Raster { pipeline: Arc<RasterPipeline>, keys: Image },
}

/// The map, with the passes that make it.
pub struct SilhouettePoints {
    edges: KeptSegments,
    maker: Maker,
    points: Image,
}

/// Distance around the map up to which edges are kept, in texels.
const MARGIN: f32 = 16.0;
/// Value of a cell without an edge: the cell's middle, `CELL_MIDDLE` of `glsl/caster_edges/sssm_cell.glsl`.
const MIDDLE: u32 = 0x8000_8000;

impl SilhouettePoints {
    /// Makes the passes and the map. The technique's name is for messages. With `kill`, edges that the light does not
    /// see are left out.
    ///
    /// # Errors
    /// Errors are those of [`KeptSegments::new`].
    pub fn new(
        context: &Context,
        technique: &'static str,
        casters: &Arc<Casters>,
        map_size: [u32; 2],
        by: PointsBy,
        kill: bool,
    ) -> Result<Self> {
        let device = context.device();
        let cells = u64::from(map_size[0]) * u64::from(map_size[1]);
        let buffer = |name| {
            let usage = vk::BufferUsageFlags::STORAGE_BUFFER | vk::BufferUsageFlags::TRANSFER_DST;
            Buffer::new(device, &BufferDesc { name, size: 4 * cells, usage, memory: MemoryKind::Gpu })
        };
        let step = |step: u32| {
            let constants = [("STEP", step), ("KILL", kill.into())];
            context.pipeline::<PointsBindings, ()>("caster_edges/sssm_points.comp", &constants)
        };
        let format = vk::Format::R32_UINT;
        let maker = match by {
            PointsBy::Compute => Maker::Compute {
                steps: [step(0)?, step(1)?, step(2)?],
                keys: buffer("silhouette keys")?,
                winners: buffer("silhouette winners")?,
            },
            PointsBy::Raster => Maker::Raster {
                pipeline: context.raster_pipeline::<SegmentBindings, MapSizePush>(&RasterState {
                    name: "silhouette points",
                    vertex: "caster_edges/sssm.vert",
                    fragment: Some("caster_edges/sssm.frag"),
                    colors: &[format],
                    depth: Some(DepthState::new(vk::Format::D32_SFLOAT, vk::CompareOp::LESS)),
                    constants: &[("KILL", kill.into())],
                    ..RasterState::default()
                })?,
                keys: Image::new(device, &ImageDesc::attachment("silhouette keys", vk::Format::D32_SFLOAT, map_size))?,
            },
        };
        let mut desc = ImageDesc::storage("silhouette points", format, map_size);
        if by == PointsBy::Raster {
            desc.usage |= vk::ImageUsageFlags::COLOR_ATTACHMENT;
        }
        Ok(Self {
            edges: KeptSegments::new(context, technique, casters, MARGIN)?,
            maker,
            points: Image::new(device, &desc)?,
        })
    }

    /// Makes the map, unless the one of the frame before is still valid.
    ///
    /// # Errors
    /// Errors are those of [`KeptSegments::record`].
    pub fn record(&mut self, frame: &mut Frame<'_>, inputs: &Inputs<'_>) -> Result<()> {
        if !self.edges.record(frame, inputs)? {
            return Ok(());
        }
        let [width, height] = self.points.extent();
        let silhouettes = self.edges.silhouettes();
        let (header, segments) = (silhouettes.header(), self.edges.segments().segments());
        match &self.maker {
            Maker::Compute { steps, keys, winners } => {
                frame.fill("clear silhouette keys", keys, u32::MAX);
                frame.fill("clear silhouette winners", winners, u32::MAX);
                let bind = PointsBindings {
                    shadow_map: Bind::Input(&inputs.shadow_map),
                    Header: Bind::Buffer(header),
                    Segments: Bind::Buffer(segments),
                    Keys: Bind::Buffer(keys),
                    Winners: Bind::Buffer(winners),
                    points: Bind::Image(&self.points),
                };
                for (name, pipeline, threads) in [
                    ("silhouette keys", &steps[0], silhouettes.threads()),
                    ("silhouette winners", &steps[1], silhouettes.threads()),
                    ("silhouette points", &steps[2], chunks((width * height).div_ceil(CHUNK))),
                ] {
                    frame.dispatch(&Pass { name, pipeline, bind: &bind, push: &[], threads })?;
                }
                Ok(())
            }
            Maker::Raster { pipeline, keys } => {
                let empty = vk::ClearValue { color: vk::ClearColorValue { uint32: [MIDDLE; 4] } };
                let bind =
                    SegmentBindings { Segments: Bind::Buffer(segments), shadow_map: Bind::Input(&inputs.shadow_map) };
                let pass = RasterPass {
                    name: "silhouette points",
                    extent: self.points.extent(),
                    colors: &[Target { image: &self.points, clear: Some(empty) }],
                    depth: Some(Target::depth(keys, 1.0)),
                    bound: &[Bound { pipeline, bind: &bind }],
                    indirect: &[header],
                };
                frame.raster(&pass, |draw| {
                    draw.bind(0)?;
                    draw.push(bytemuck::bytes_of(&MapSizePush { map_size: [width, height] }))?;
                    draw.indirect(header, QUADS)
                })
            }
        }
    }

    /// The map. It holds the point of each cell that represents the cell's edge, with 16 bits per axis; the middle of
    /// the cell means that there is no edge.
    pub fn points(&self) -> &Image {
        &self.points
    }

    /// The edges that the map is made from.
    pub fn edges(&self) -> &KeptSegments {
        &self.edges
    }

    /// Bytes of device memory.
    pub fn memory_bytes(&self) -> u64 {
        let maker = match &self.maker {
            Maker::Compute { keys, winners, .. } => keys.size() + winners.size(),
            Maker::Raster { keys, .. } => keys.memory_bytes(),
        };
        self.edges.memory_bytes() + self.points.memory_bytes() + maker
    }
}

impl HeldMap for SilhouettePoints {
    fn name(&self) -> &'static str {
        "points"
    }

    fn record(&mut self, frame: &mut Frame<'_>, inputs: &Inputs<'_>) -> Result<()> {
        Self::record(self, frame, inputs)
    }

    fn image(&self) -> &Image {
        self.points()
    }

    fn memory_bytes(&self) -> u64 {
        Self::memory_bytes(self)
    }
}

/// Makes the lookup of the visibility, or with `picture` of a picture of the points over the visibility.
pub(super) fn lookup(context: &Context, picture: bool) -> Result<MapLookup> {
    MapLookup::new(context, Held::Points, false, &[("PICTURE", picture.into())])
}
