//! Map of edge ids: for each cell between four texels of the shadow map, the silhouette edges that enter it.
//!
//! Cells are numbered from (1, 1). Cell (i, j) has the texels (i - 1, j - 1) to (i, j) at its corners and is centred at
//! (i, j), in texels. There is one cell fewer along each axis than there are texels. A point uses the edges of the cell
//! that it lies in. Points within half a texel of the map's rim lie in no cell and use no edges.

use super::edge_segments::EdgeSegments;
use super::silhouettes::{COUNT, QUADS, Silhouettes, WALKS};
use crate::frame::{Bound, RasterPass};
use crate::gpu::{
    Buffer, BufferDesc, ComputePipeline, Image, ImageDesc, MemoryKind, RasterPipeline, RasterState, bindings,
    shader_struct,
};
use crate::timing::Counted;
use crate::{Bind, Context, Error, Frame, Inputs, Pass, Result, Threads};
use ash::vk;
use std::sync::Arc;

shader_struct! {
    /// Push constants of `glsl/caster_edges/edge_map.comp` and `glsl/caster_edges/edge_map.*`.
    pub struct EdgeMapPush {
        map_size: [i32; 2],
        reach: f32,
    }
}

shader_struct! {
    /// Push constants of `glsl/caster_edges/edge_ids.comp`.
    pub struct EdgeIdsPush {
        map_size: [i32; 2],
        slots: u32,
        reach: f32,
    }
}

bindings! {
    struct MapBindings { shadow_map, Segments, Keys, spill, Heads, LowerKeys }
    struct WalkBindings { ..map: MapBindings, Header }
    struct IdsBindings { Keys, picture }
}

/// Settings that are fixed when the pass is made.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct EdgeMapConfig {
    /// Slots per cell, 1 to 8.
    pub slots: u32,
    /// Largest number of edges of a cell beyond its slots.
    pub spill: u32,
    /// True to leave out edges that lie behind everything that the light sees around a cell.
    pub kill: bool,
    /// Distance from a cell, in texels along both axes, up to which the cell holds edges; at least [`LEAST_REACH`].
    pub reach: f32,
    /// Way to write the edges.
    pub generation: Generation,
}

/// Smallest reach. An edge this close to a texel's centre counts as passing through it.
pub const LEAST_REACH: f32 = 1.0 / 64.0;

/// Way to write edges into a map. Both ways give the same map.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Generation {
    /// Compute threads walk along the edges.
    Compute,
    /// Quads around the edges are rasterised. Needs [`crate::DeviceFeatures::dynamic_rendering`] and
    /// [`crate::DeviceFeatures::fragment_stores`].
    Raster,
}

enum Writer {
    Walk(Arc<ComputePipeline>),
    Quads(Arc<RasterPipeline>),
}

/// Bytes before the entries of the chains.
const SPILL_HEADER: u64 = 8;
/// Bytes of an entry of a chain.
const SPILLED: u64 = 8;
/// Number of entries per edge of the casters. Few of the edges are silhouettes, and a short silhouette enters about
/// four cells.
const SPILLED_EACH: u64 = 4;
/// Largest number of cells per entry. A few long edges may enter many cells, so maps have entries even for few edges.
const CELLS_A_SPILLED: u64 = 2;

/// The pass with its map, which takes 8 bytes per slot.
pub struct EdgeMap {
    writer: Writer,
    keys: Buffer,
    /// Slots of the lower half of the map, if one buffer cannot hold all slots.
    lower_keys: Option<Buffer>,
    spill: Buffer,
    heads: Buffer,
    config: EdgeMapConfig,
    map_size: [u32; 2],
}

impl EdgeMap {
    /// Makes the pass and its map.
    ///
    /// # Errors
    /// [`Error::Parameter`] if the map is too large for two storage buffers of the device. [`Error::NoDevice`] for
    /// [`Generation::Raster`] if the device was made without the features that it needs.
    pub fn new(
        context: &Context,
        silhouettes: &Silhouettes,
        map_size: [u32; 2],
        config: EdgeMapConfig,
    ) -> Result<Self> {
        let [columns, all_rows] = cells_of(map_size);
        let cells = u64::from(columns) * u64::from(all_rows);
        let rows = |n: u32| u64::from(columns) * u64::from(n) * u64::from(config.slots) * 8;
        let most = u64::from(context.device().limits.max_storage_buffer_range);
        let half = all_rows.div_ceil(2);
        let split = rows(all_rows) > most;
        let size = if split { rows(half) } else { rows(all_rows) };
        if size > most || cells * 8 > most {
            let [w, h] = map_size;
            let problem = format!(
                "edge ids of a {w}x{h} map take {} bytes with {} slots per cell, but two storage buffers of this device \
                 have {most} each; use a smaller map or fewer slots",
                rows(all_rows),
                config.slots
            );
            return Err(Error::Parameter(problem));
        }
        let usage = vk::BufferUsageFlags::STORAGE_BUFFER
            | vk::BufferUsageFlags::TRANSFER_DST
            | vk::BufferUsageFlags::TRANSFER_SRC;
        let buffer =
            |name, size| Buffer::new(context.device(), &BufferDesc { name, size, usage, memory: MemoryKind::Gpu });
        let constants =
            [("K", config.slots), ("KILL", config.kill.into()), ("SPILL", config.spill), ("SPLIT", split.into())];
        let writer = match config.generation {
            Generation::Compute => {
                Writer::Walk(context.pipeline::<WalkBindings, EdgeMapPush>("caster_edges/edge_map.comp", &constants)?)
            }
            Generation::Raster => {
                let features = context.features();
                if !(features.dynamic_rendering && features.fragment_stores) {
                    let problem = "generation=raster needs raster passes and fragment shaders that write buffers \
                                   (dynamicRendering, fragmentStoresAndAtomics), which this device was made without";
                    return Err(Error::NoDevice(problem.into()));
                }
                Writer::Quads(context.raster_pipeline::<MapBindings, EdgeMapPush>(&RasterState {
                    name: "edge ids",
                    vertex: "caster_edges/edge_map.vert",
                    fragment: Some("caster_edges/edge_map.frag"),
                    constants: &constants,
                    ..RasterState::default()
                })?)
            }
        };
        let edges = u64::from(silhouettes.casters().counts().edges);
        let (chains, entries) = if config.spill > 0 {
            (cells, (SPILLED_EACH * edges).max(cells.div_ceil(CELLS_A_SPILLED)).min((most - SPILL_HEADER) / SPILLED))
        } else {
            (1, 1)
        };
        Ok(Self {
            writer,
            keys: buffer("edge ids", size)?,
            lower_keys: if split { Some(buffer("edge ids, lower half", rows(all_rows - half))?) } else { None },
            spill: buffer("spilled edge ids", SPILL_HEADER + entries * SPILLED)?,
            heads: buffer("spilled edge ids, heads", chains * 8)?,
            config,
            map_size,
        })
    }

    /// Fills the map with the segments.
    pub fn record(
        &self,
        frame: &mut Frame<'_>,
        inputs: &Inputs<'_>,
        silhouettes: &Silhouettes,
        segments: &EdgeSegments,
    ) -> Result<()> {
        frame.fill("edge ids, cleared", &self.keys, u32::MAX);
        if let Some(lower) = &self.lower_keys {
            frame.fill("edge ids, lower half cleared", lower, u32::MAX);
        }
        frame.fill("edge ids, chains cleared", &self.heads, u32::MAX);
        frame.update(&self.spill, &[0; SPILL_HEADER as usize]);
        let push = EdgeMapPush { map_size: self.map_size.map(|n| n as i32), reach: self.config.reach };
        let map = MapBindings {
            shadow_map: Bind::Input(&inputs.shadow_map),
            Segments: Bind::Buffer(segments.segments()),
            Keys: Bind::Buffer(&self.keys),
            spill: Bind::Buffer(&self.spill),
            Heads: Bind::Buffer(&self.heads),
            LowerKeys: Bind::Buffer(self.lower_keys()),
        };
        let header = silhouettes.header();
        match &self.writer {
            Writer::Walk(pipeline) => {
                frame.dispatch(&Pass {
                    name: "edge ids",
                    pipeline,
                    bind: &WalkBindings { map, Header: Bind::Buffer(header) },
                    push: bytemuck::bytes_of(&push),
                    threads: Threads::Indirect(header, WALKS),
                })?;
            }
            Writer::Quads(pipeline) => {
                let pass = RasterPass {
                    name: "edge ids",
                    extent: cells_of(self.map_size),
                    colors: &[],
                    depth: None,
                    bound: &[Bound { pipeline, bind: &map }],
                    indirect: &[header],
                };
                frame.raster(&pass, |draw| {
                    draw.bind(0)?;
                    draw.push(bytemuck::bytes_of(&push))?;
                    draw.indirect(header, QUADS)
                })?;
            }
        }
        frame.count(Counted::Named("edges"), header, COUNT);
        frame.count(Counted::Named("edges_spilled"), &self.spill, 4);
        frame.count(Counted::Named("edges_lost"), &self.spill, 0);
        Ok(())
    }

    /// The map. It holds the slots of each cell, row by row, and in each cell the edge nearest to its centre first. A
    /// slot holds the segment and the bits of its squared distance.
    pub fn keys(&self) -> &Buffer {
        &self.keys
    }

    /// The slots of the map's lower half if [`EdgeMap::is_split`]; otherwise the whole map again.
    pub fn lower_keys(&self) -> &Buffer {
        self.lower_keys.as_ref().unwrap_or(&self.keys)
    }

    /// True if the slots are in two buffers. The first then holds the upper half of the map's rows, rounded up.
    pub fn is_split(&self) -> bool {
        self.lower_keys.is_some()
    }

    /// Chains of the edges beyond the slots. The buffer begins with the number of edges that found no place and the
    /// number of entries that were requested, both `u32`. Then come the entries: the segment and the next entry.
    pub fn spill(&self) -> &Buffer {
        &self.spill
    }

    /// First entry of each cell's chain, and the number of entries that the cell requested, minus one.
    pub fn heads(&self) -> &Buffer {
        &self.heads
    }

    /// Bytes of device memory.
    pub fn memory_bytes(&self) -> u64 {
        self.keys.size() + self.lower_keys.as_ref().map_or(0, Buffer::size) + self.spill.size() + self.heads.size()
    }
}

/// Number of cells along each axis, at least 1.
fn cells_of(map_size: [u32; 2]) -> [u32; 2] {
    map_size.map(|n| n.saturating_sub(1).max(1))
}

/// A picture of an [`EdgeMap`] in RGBA8, with one pixel per cell. It shows the nearest edge of each cell in a colour of
/// its own, brighter the nearer the edge is. Cells without an edge are black.
pub struct EdgeIds {
    pipeline: Arc<ComputePipeline>,
    image: Image,
}

impl EdgeIds {
    /// Makes the pass and its image.
    pub fn new(context: &Context, map: &EdgeMap) -> Result<Self> {
        let desc = ImageDesc::storage("edge ids, shown", vk::Format::R8G8B8A8_UNORM, cells_of(map.map_size));
        Ok(Self {
            pipeline: context.pipeline::<IdsBindings, EdgeIdsPush>("caster_edges/edge_ids.comp", &[])?,
            image: Image::new(context.device(), &desc)?,
        })
    }

    /// Draws the picture of the map.
    pub fn record(&self, frame: &mut Frame<'_>, map: &EdgeMap) -> Result<()> {
        let [width, height] = self.image.extent();
        let push =
            EdgeIdsPush { map_size: map.map_size.map(|n| n as i32), slots: map.config.slots, reach: map.config.reach };
        frame.dispatch(&Pass {
            name: "edge ids, shown",
            pipeline: &self.pipeline,
            bind: &IdsBindings { Keys: Bind::Buffer(&map.keys), picture: Bind::Image(&self.image) },
            push: bytemuck::bytes_of(&push),
            threads: Threads::Count([width, height, 1]),
        })
    }

    /// The picture.
    pub fn image(&self) -> &Image {
        &self.image
    }
}
