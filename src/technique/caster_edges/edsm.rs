//! Edge distance shadow mapping.

use super::edge_lookup::{self, Held, HeldMap, KILL, MapLookup};
use super::kept_segments::{KeptSegments, SegmentBindings};
use super::silhouettes::QUADS;
use crate::casters::Casters;
use crate::frame::{Bound, RasterPass, Target};
use crate::gpu::{DepthState, Image, ImageDesc, RasterPipeline, RasterState, shader_struct};
use crate::technique::common::rbsm_receiver::{DEPTH_BIAS, NORMAL_OFFSET, SLACK};
use crate::technique::common::receiver::{self, RECEIVER};
use crate::technique::{Info, Kind, Param, Params, Passes, Setup};
use crate::{Bind, Context, Error, Frame, Inputs, Need, Result};
use ash::vk;
use std::sync::Arc;

/// The registry entry.
pub const INFO: Info = Info {
    id: "edsm",
    title: "Edge distance shadow mapping",
    paper: "Kenzel 2013",
    summary: "Where the tests of a shadow map's texels differ, the distance to the casters' edges decides; borders can be soft.",
    params: &[
        Param::choice(
            "distance",
            &["texels", "printed"],
            0,
            "what the map stores: signed distances from the edges' lines, or eq. 3.3 as printed, which divides them by the edges' lengths",
        ),
        Param::choice(
            "priority",
            &["segment", "cosine", "printed"],
            0,
            "edge that a texel keeps out of several: the nearest, or the one that wins by the cosine at the corner (two readings of eq. 3.8), or the one whose line is nearest (eq. 3.8 as printed)",
        ),
        KILL,
        Param::choice(
            "interpolation",
            &["float", "8-bit"],
            0,
            "weights of the four distances around a point: in single precision, or in steps of 1/256 as texture units have them",
        ),
        RECEIVER,
        Param::float("border", 0.0, 16.0, 0.0, "texels", "width of the shadow's border; 0 = hard"),
        Param::choice(
            "kernel",
            &["box", "smoothstep", "disc"],
            2,
            "profile of the visibility across the border: a ramp, a ramp with soft ends, or that of an edge under a round light",
        ),
        NORMAL_OFFSET,
        DEPTH_BIAS,
        SLACK,
    ],
    published: &[
        ("distance", "printed"),
        ("priority", "printed"),
        ("interpolation", "8-bit"),
        ("receiver", "fixed"),
        ("depth_bias", "1.5"),
    ],
    needs: &[Need::Casters, Need::DynamicRendering],
    kind: Kind::RealTime(prepare),
};

/// Returns the value of the parameter `kernel`.
pub(super) fn border_kernel(params: &Params) -> BorderKernel {
    match params.word("kernel") {
        "box" => BorderKernel::Box,
        "smoothstep" => BorderKernel::Smoothstep,
        _ => BorderKernel::Disc,
    }
}

fn prepare(context: &Context, setup: &Setup) -> Result<Box<dyn Passes>> {
    let p = &setup.params;
    let (border, kernel) = (p.float("border"), border_kernel(p));
    let printed = p.word("distance") == "printed";
    if printed && border > 0.0 {
        let problem =
            "edsm: border is a width in texels, which distance=printed does not store: set border=0 or distance=texels";
        return Err(Error::Parameter(problem.into()));
    }
    // All four corners of a cell that the border reaches must know the edge. They lie up to a cell's diagonal beyond
    // the border.
    let half_width = 0.5 * border + 1.5;
    let priority = match p.word("priority") {
        "segment" => Priority::Segment,
        "cosine" => Priority::Cosine,
        _ => Priority::Printed,
    };
    let config = DistanceConfig { printed, priority, kill: p.on("kill"), half_width };
    let settings =
        LookupSettings { border, kernel, eight_bits: p.word("interpolation") == "8-bit", fixed: receiver::is_fixed(p) };
    let distances = EdgeDistances::new(context, INFO.id, setup.casters(INFO.id)?, setup.map_size, config)?;
    let lookup = |picture| lookup(context, picture, settings);
    edge_lookup::prepare(context, setup, Box::new(distances), lookup)
}

shader_struct! {
    /// Push constants of `glsl/caster_edges/edsm.vert` and `.frag`.
    pub struct EdgeQuadPush {
        map_size: [u32; 2],
        half_width: f32,
    }
}

/// How a texel of the map chooses among several edges (eq. 3.8).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Priority {
    /// By the distance from the edge itself.
    Segment,
    /// By the distance from the edge's line; beyond an end also by the cosine at the corner.
    Cosine,
    /// By the stored distance alone. Read literally, the two cases of eq. 3.8 are the same.
    Printed,
}

/// Settings of a map of distances.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct DistanceConfig {
    /// True to store eq. 3.3 as printed: distances in texels, divided by the length of the edge in texels.
    pub printed: bool,
    /// How a texel chooses among several edges.
    pub priority: Priority,
    /// True to leave out edges that the light does not see.
    pub kill: bool,
    /// Largest distance from an edge that the map stores, in texels; above 0.
    pub half_width: f32,
}

/// The map, with the passes that make it.
pub struct EdgeDistances {
    edges: KeptSegments,
    pipeline: Arc<RasterPipeline>,
    distances: Image,
    priorities: Image,
    half_width: f32,
}

impl EdgeDistances {
    /// Makes the passes and the map. The technique's name is for messages.
    ///
    /// # Errors
    /// Errors are those of [`KeptSegments::new`].
    pub fn new(
        context: &Context,
        technique: &'static str,
        casters: &Arc<Casters>,
        map_size: [u32; 2],
        config: DistanceConfig,
    ) -> Result<Self> {
        let (format, depth) = (vk::Format::R16_SFLOAT, vk::Format::D32_SFLOAT);
        let target = |name, format| Image::new(context.device(), &ImageDesc::attachment(name, format, map_size));
        Ok(Self {
            edges: KeptSegments::new(context, technique, casters, config.half_width + 2.0)?,
            pipeline: context.raster_pipeline::<SegmentBindings, EdgeQuadPush>(&RasterState {
                name: "edge distances",
                vertex: "caster_edges/edsm.vert",
                fragment: Some("caster_edges/edsm.frag"),
                colors: &[format],
                depth: Some(DepthState::new(depth, vk::CompareOp::LESS)),
                constants: &[
                    ("PRINTED", config.printed.into()),
                    ("PRIORITY", config.priority as u32),
                    ("KILL", config.kill.into()),
                ],
                ..RasterState::default()
            })?,
            distances: target("edge distances", format)?,
            priorities: target("edge priorities", depth)?,
            half_width: config.half_width,
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
        let bind = SegmentBindings {
            Segments: Bind::Buffer(self.edges.segments().segments()),
            shadow_map: Bind::Input(&inputs.shadow_map),
        };
        let header = self.edges.silhouettes().header();
        let pass = RasterPass {
            name: "edge distances",
            extent: self.distances.extent(),
            colors: &[Target::color(&self.distances, [0.0; 4])],
            // 1 is larger than any priority, so every fragment of the first quad passes.
            depth: Some(Target::depth(&self.priorities, 1.0)),
            bound: &[Bound { pipeline: &self.pipeline, bind: &bind }],
            indirect: &[header],
        };
        let push = EdgeQuadPush { map_size: self.distances.extent(), half_width: self.half_width };
        frame.raster(&pass, |draw| {
            draw.bind(0)?;
            draw.push(bytemuck::bytes_of(&push))?;
            draw.indirect(header, QUADS)
        })
    }

    /// Signed distance from each texel's centre to the line of the edge that the texel keeps, positive on the occluder's
    /// side; 0 if no edge is near. In texels, or with [`DistanceConfig::printed`] in edge lengths.
    pub fn distances(&self) -> &Image {
        &self.distances
    }

    /// The edges that the map is made from.
    pub fn edges(&self) -> &KeptSegments {
        &self.edges
    }

    /// Bytes of device memory.
    pub fn memory_bytes(&self) -> u64 {
        self.edges.memory_bytes() + self.distances.memory_bytes() + self.priorities.memory_bytes()
    }
}

impl HeldMap for EdgeDistances {
    fn name(&self) -> &'static str {
        "distance"
    }

    fn record(&mut self, frame: &mut Frame<'_>, inputs: &Inputs<'_>) -> Result<()> {
        Self::record(self, frame, inputs)
    }

    fn image(&self) -> &Image {
        self.distances()
    }

    fn memory_bytes(&self) -> u64 {
        Self::memory_bytes(self)
    }
}

/// Treatment of the border of a shadow.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum BorderKernel {
    /// A ramp.
    Box,
    /// A ramp with soft ends.
    Smoothstep,
    /// The share of a disc that lies beyond a straight edge.
    Disc,
}

/// Settings of the lookup.
#[derive(Clone, Copy)]
pub(super) struct LookupSettings {
    /// Width of soft borders, texels; 0 makes them hard.
    pub border: f32,
    pub kernel: BorderKernel,
    /// True to weigh the four distances in steps of 1/256.
    pub eight_bits: bool,
    /// True to compare all texels with the point's own depth.
    pub fixed: bool,
}

/// Makes the lookup of the visibility, or with `picture` of a picture of the distances over the visibility.
pub(super) fn lookup(context: &Context, picture: bool, settings: LookupSettings) -> Result<MapLookup> {
    let constants = [
        ("PICTURE", picture.into()),
        ("BORDER_BITS", (0.5 * settings.border).to_bits()),
        ("KERNEL", settings.kernel as u32),
        ("EIGHT_BITS", settings.eight_bits.into()),
    ];
    MapLookup::new(context, Held::Distances, settings.fixed, &constants)
}
