//! Map of edge ids: for each cell between four texels of the shadow map the silhouette edges that enter it.
//!
//! Cell (i, j), from (1, 1), has the texels (i - 1, j - 1) to (i, j) at its corners and is centred at (i, j), in texels: there
//! is one fewer along each axis than there are texels. A point asks the edges of the one cell that it lies in; within half a
//! texel of the map's rim it does without.

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
    /// Slots a cell: 1 to 8.
    pub slots: u32,
    /// Edges that a cell may have beyond its slots: 0 or more.
    pub spill: u32,
    /// Leave out edges that lie behind everything that the light sees around a cell.
    pub kill: bool,
    /// Texels, along both axes, before an edge at which a cell learns of it: at least [`LEAST_REACH`].
    pub reach: f32,
    /// Way to write edges.
    pub generation: Generation,
}

/// Reach of a map for points within their cells: edges this close to a texel's centre count as being at it.
pub const LEAST_REACH: f32 = 1.0 / 64.0;

/// Way to write edges into a map; the map is the same.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Generation {
    /// Threads walk along them.
    Compute,
    /// Quads around them are rasterised. Needs [`crate::DeviceFeatures::dynamic_rendering`] and
    /// [`crate::DeviceFeatures::fragment_stores`].
    Raster,
}

enum Writer {
    Walk(Arc<ComputePipeline>),
    Quads(Arc<RasterPipeline>),
}

/// Bytes before the entries of the chains.
const SPILL_HEADER: u64 = 8;
/// Bytes of such an entry.
const SPILLED: u64 = 8;
/// Entries that there is room for, an edge of the casters: few of these are silhouettes,
/// and a short one enters four cells or so.
const SPILLED_EACH: u64 = 4;
/// And at least one for so many cells: a few long edges through a map enter many.
const CELLS_A_SPILLED: u64 = 2;

/// The pass with its map: 8 bytes a slot.
pub struct EdgeMap {
    writer: Writer,
    keys: Buffer,
    /// Slots of the lower half of the map, where all are more than a buffer holds.
    lower_keys: Option<Buffer>,
    spill: Buffer,
    heads: Buffer,
    config: EdgeMapConfig,
    map_size: [u32; 2],
}

impl EdgeMap {
    /// Allocates.
    ///
    /// # Errors
    /// [`Error::Parameter`] for a map too large for two storage buffers of the device; [`Error::NoDevice`] for
    /// [`Generation::Raster`] on a device made without what it needs.
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
                "edge ids of a {w}x{h} map take {} bytes with {} slots a cell; two storage buffers of this device have {most} each: \
                 use a smaller map or fewer slots",
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
                                   (dynamicRendering, fragmentStoresAndAtomics); this device was made without";
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

    /// The map: for each cell, row by row, its slots, nearest to its centre first: segment, then the bits of its squared
    /// distance.
    pub fn keys(&self) -> &Buffer {
        &self.keys
    }

    /// The same for the map's lower half, where [`EdgeMap::is_split`]; otherwise the whole map again.
    pub fn lower_keys(&self) -> &Buffer {
        self.lower_keys.as_ref().unwrap_or(&self.keys)
    }

    /// True if the slots are in two buffers: the upper half of the map's rows, rounded up, in the first.
    pub fn is_split(&self) -> bool {
        self.lower_keys.is_some()
    }

    /// Chains of the edges beyond the slots: a `u32` of how many found no place, one of how many entries were asked for,
    /// then entries: segment, next entry.
    pub fn spill(&self) -> &Buffer {
        &self.spill
    }

    /// First entry of each cell's chain, and the number of entries that were asked for, less one.
    pub fn heads(&self) -> &Buffer {
        &self.heads
    }

    /// Bytes of device memory.
    pub fn memory_bytes(&self) -> u64 {
        self.keys.size() + self.lower_keys.as_ref().map_or(0, Buffer::size) + self.spill.size() + self.heads.size()
    }
}

/// Cells along each axis; room for one where there is none.
fn cells_of(map_size: [u32; 2]) -> [u32; 2] {
    map_size.map(|n| n.saturating_sub(1).max(1))
}

/// A picture of an [`EdgeMap`]: RGBA8, a pixel a cell; the nearest edge of each in a colour of its id, near bright, black
/// where no edge enters the cell.
pub struct EdgeIds {
    pipeline: Arc<ComputePipeline>,
    image: Image,
}

impl EdgeIds {
    /// Allocates.
    pub fn new(context: &Context, map: &EdgeMap) -> Result<Self> {
        let desc = ImageDesc::storage("edge ids, shown", vk::Format::R8G8B8A8_UNORM, cells_of(map.map_size));
        Ok(Self {
            pipeline: context.pipeline::<IdsBindings, EdgeIdsPush>("caster_edges/edge_ids.comp", &[])?,
            image: Image::new(context.device(), &desc)?,
        })
    }

    /// Shows the map as it is.
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
