//! A grid of cells over the light's view, and for each cell the casters that may matter to the receivers that the camera
//! sees in it.

use crate::casters::Casters;
use crate::frame::Bind;
use crate::gpu::{Buffer, BufferDesc, ComputePipeline, Image, MemoryKind, bindings, shader_struct};
use crate::technique::caster_edges::edge_segments::EdgeSegments;
use crate::technique::caster_edges::silhouettes::{Silhouettes, chunks};
use crate::technique::common::bindings::CameraBindings;
use crate::technique::common::pixels::{ALONE, Step, no_list};
use crate::technique::common::view::light_area;
use crate::timing::Counted;
use crate::{Context, Error, Frame, Inputs, Pass, Result, Threads};
use ash::vk;
use std::sync::Arc;

/// Blocks of the coarsest level have this many cells along each side, and so must the grid have a multiple of it.
pub const COARSEST: u32 = 64;
/// Bytes of a `GridTriangle` of `glsl/exact/grid_triangle.glsl`.
const TRIANGLE: u64 = 76;
/// Bytes of a `GridEdge` of `glsl/exact/grid_edge.glsl`.
const EDGE: u64 = 28;
/// Bytes of a `ListEntry` of `glsl/exact/grid.glsl`.
const ENTRY: u64 = 8;
/// Bytes of a `ListHeader` of `glsl/exact/grid.glsl`.
const HEADER: u64 = 23 * 4;
/// Offset in the header of the number of entries that the lists need.
const TOTAL: u64 = 12 * 4;
/// Offset in the header of the number of pairs that found no room.
const LOST: u64 = 13 * 4;
/// Cells that a workgroup of `glsl/exact/list_starts.comp` works on.
const SCANNED: u32 = 256 * 32;

shader_struct! {
    /// Push constants of `glsl/exact/grid.glsl`.
    pub struct GridPush {
        cells: u32,
        stride: u32,
        chunks: u32,
        pairs: u32,
        entries: u32,
        spot: u32,
        nearest: f32,
        mirrored: f32,
        kappa: [f32; 2],
        normal_offset: f32,
        silhouettes: u32,
        faces: u32,
        far_vertices: f32,
    }
}

bindings! {
    struct ReceiverCellBindings { ..camera: CameraBindings, visibility, list, Depths, Receivers }
    struct LevelBindings { Depths }
    struct TriangleBindings {
        Depths, Header, Pairs, Positions, Triangles, Chunks, Instances, Lights, Facing, GridTriangles, faces, FacePlanes
    }
    struct EdgeBindings {
        Depths, Header, Pairs, Positions, Lights, SilhouetteList, Silhouettes, GridEdges, Triangles, Chunks, Instances,
        Facing, faces
    }
    struct RefineBindings { Depths, Header, Pairs, GridTriangles, GridEdges, Counts, Starts, Entries }
    struct StartBindings { Header, Counts, Sums, Starts }
}

fn buffer(context: &Context, name: &str, size: u64) -> Result<Buffer> {
    let most = u64::from(context.device().limits.max_storage_buffer_range);
    if size > most {
        let problem = format!(
            "the {name} of exact shadows need {size} bytes, but a storage buffer of this device has at most {most}: choose \
             fewer entries, or casters of fewer triangles"
        );
        return Err(Error::Usage(problem));
    }
    let usage = vk::BufferUsageFlags::STORAGE_BUFFER
        | vk::BufferUsageFlags::INDIRECT_BUFFER
        | vk::BufferUsageFlags::TRANSFER_DST
        | vk::BufferUsageFlags::TRANSFER_SRC;
    Buffer::new(context.device(), &BufferDesc { name, size, usage, memory: MemoryKind::Gpu })
}

/// Bytes of a receiver: its place in the light's image, and its depth.
const RECEIVER: u64 = 12;

/// The receivers in the light's grid, and their depths in each cell and in blocks of cells.
pub struct GridReceivers {
    cells: u32,
    place: Arc<ComputePipeline>,
    levels: Arc<ComputePipeline>,
    receivers: Buffer,
    depths: Buffer,
    unlisted: Buffer,
}

impl GridReceivers {
    /// Makes the passes for an image, and a grid with `cells` along each side, a multiple of [`COARSEST`]. With
    /// `listed`, pixels whose light may reach below their own plane are listed.
    pub fn new(context: &Context, extent: [u32; 2], cells: u32, listed: bool) -> Result<Self> {
        let side = u64::from(cells);
        let words: u64 = [1, 4, 16, 64].iter().map(|block| (side / block) * (side / block)).sum();
        let step = if listed { Step::List } else { Step::AtOnce };
        let pixels = u64::from(extent[0]) * u64::from(extent[1]);
        Ok(Self {
            cells,
            place: context.pipeline::<ReceiverCellBindings, GridPush>(
                "exact/receiver_cells.comp",
                &[("STEP", step as u32), ALONE],
            )?,
            levels: context.pipeline::<LevelBindings, GridPush>("exact/depth_levels.comp", &[])?,
            receivers: buffer(context, "receivers in the grid", RECEIVER * pixels)?,
            depths: buffer(context, "depths of cells", 4 * (words + 1))?,
            unlisted: no_list(context)?,
        })
    }

    /// Places the receivers. Pixels whose visibility needs no caster are written to `visibility`; `list` takes the
    /// pixels that are listed.
    pub fn record(
        &self,
        frame: &mut Frame<'_>,
        view: &Buffer,
        inputs: &Inputs<'_>,
        push: &GridPush,
        visibility: &Image,
        list: Option<Bind<'_>>,
    ) -> Result<()> {
        frame.fill("clear cells", &self.depths, 0);
        let [width, height] = visibility.extent();
        let depths = Bind::Buffer(&self.depths);
        frame.dispatch(&Pass {
            name: "receivers of cells",
            pipeline: &self.place,
            bind: &ReceiverCellBindings {
                camera: CameraBindings::new(view, inputs),
                visibility: Bind::Image(visibility),
                list: list.unwrap_or(Bind::Buffer(&self.unlisted)),
                Depths: depths,
                Receivers: self.receivers(),
            },
            push: bytemuck::bytes_of(push),
            threads: Threads::Count([width, height, 1]),
        })?;
        frame.dispatch(&Pass {
            name: "depths of blocks",
            pipeline: &self.levels,
            bind: &LevelBindings { Depths: depths },
            push: bytemuck::bytes_of(push),
            threads: Threads::Count([self.cells / 4, self.cells / 4, 1]),
        })
    }

    /// The receivers of all pixels, for binding.
    pub(super) fn receivers(&self) -> Bind<'_> {
        Bind::Buffer(&self.receivers)
    }

    /// The greatest depth of receivers in each cell, and in blocks of 4, 16 and 64 cells; see `glsl/exact/grid.glsl`.
    pub fn depths(&self) -> &Buffer {
        &self.depths
    }

    /// Bytes of device memory.
    pub fn memory_bytes(&self) -> u64 {
        self.receivers.size() + self.depths.size()
    }
}

/// Kind of caster that a list holds.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Kind {
    Triangles,
    Edges,
}

/// A list of casters for each cell.
pub struct CellLists {
    kind: Kind,
    cells: u32,
    pairs: u32,
    entries: u32,
    refine: [Arc<ComputePipeline>; 4],
    sums_of_cells: Arc<ComputePipeline>,
    starts_of_cells: Arc<ComputePipeline>,
    header: Buffer,
    pair_buffer: Buffer,
    counts: Buffer,
    sums: Buffer,
    starts: Buffer,
    entry_buffer: Buffer,
}

impl CellLists {
    fn new(context: &Context, kind: Kind, cells: u32, entries: u32) -> Result<Self> {
        let refine = |level: u32, write: bool| {
            let constants = [("CASTERS", kind as u32), ("LEVEL", level), ("WRITE", write.into())];
            context.pipeline::<RefineBindings, GridPush>("exact/refine.comp", &constants)
        };
        let scan = |sums: bool| {
            context.pipeline::<StartBindings, GridPush>("exact/list_starts.comp", &[("SUMS", sums.into())])
        };
        let all = u64::from(cells) * u64::from(cells);
        let pairs = entries;
        Ok(Self {
            kind,
            cells,
            pairs,
            entries,
            refine: [refine(3, false)?, refine(2, false)?, refine(1, false)?, refine(1, true)?],
            sums_of_cells: scan(true)?,
            starts_of_cells: scan(false)?,
            header: buffer(context, "header of lists", HEADER)?,
            pair_buffer: buffer(context, "pairs of casters and blocks", 3 * 8 * u64::from(pairs))?,
            counts: buffer(context, "entries a cell", 4 * all)?,
            sums: buffer(context, "sums of entries", 4 * all.div_ceil(SCANNED.into()))?,
            starts: buffer(context, "starts of lists", 4 * (all + 1))?,
            entry_buffer: buffer(context, "entries of lists", ENTRY * u64::from(entries))?,
        })
    }

    fn clear(&self, frame: &mut Frame<'_>) {
        let mut header = [0; HEADER as usize / 4];
        header[..12].copy_from_slice(&[0, 1, 1, 0, 0, 1, 1, 0, 0, 1, 1, 0]);
        frame.update(&self.header, bytemuck::bytes_of(&header));
        let name = if self.kind == Kind::Triangles { "clear triangles" } else { "clear edges" };
        frame.fill(name, &self.counts, 0);
    }

    fn record(&self, frame: &mut Frame<'_>, depths: &GridReceivers, records: &Buffer, push: &GridPush) -> Result<()> {
        let names = match self.kind {
            Kind::Triangles => [
                "triangles of 16 cells",
                "triangles of 4 cells",
                "count triangles",
                "sum triangles",
                "starts of triangles",
                "list triangles",
            ],
            Kind::Edges => {
                ["edges of 16 cells", "edges of 4 cells", "count edges", "sum edges", "starts of edges", "list edges"]
            }
        };
        let b = |buffer| Bind::Buffer(buffer);
        let bind = RefineBindings {
            Depths: b(&depths.depths),
            Header: b(&self.header),
            Pairs: b(&self.pair_buffer),
            GridTriangles: b(records),
            GridEdges: b(records),
            Counts: b(&self.counts),
            Starts: b(&self.starts),
            Entries: b(&self.entry_buffer),
        };
        let refine = |frame: &mut Frame<'_>, name: &str, step: usize, groups: u64| {
            let push = bytemuck::bytes_of(push);
            let threads = Threads::Indirect(&self.header, groups);
            frame.dispatch(&Pass { name, pipeline: &self.refine[step], bind: &bind, push, threads })
        };
        refine(frame, names[0], 0, 0)?;
        refine(frame, names[1], 1, 16)?;
        refine(frame, names[2], 2, 32)?;
        let scan = StartBindings {
            Header: b(&self.header),
            Counts: b(&self.counts),
            Sums: b(&self.sums),
            Starts: b(&self.starts),
        };
        for (name, pipeline) in [(names[3], &self.sums_of_cells), (names[4], &self.starts_of_cells)] {
            let threads = Threads::Count([(self.cells * self.cells).div_ceil(SCANNED) * 256, 1, 1]);
            frame.dispatch(&Pass { name, pipeline, bind: &scan, push: bytemuck::bytes_of(push), threads })?;
        }
        refine(frame, names[5], 3, 32)?;
        let (entries, lost) = match self.kind {
            Kind::Triangles => ("triangle_entries", "triangle_pairs_lost"),
            Kind::Edges => ("edge_entries", "edge_pairs_lost"),
        };
        frame.count(Counted::Named(entries), &self.header, TOTAL);
        frame.count(Counted::Named(lost), &self.header, LOST);
        Ok(())
    }

    /// The header: `ListHeader` of `glsl/exact/grid.glsl`.
    pub fn header(&self) -> &Buffer {
        &self.header
    }

    /// The place of each cell's first entry, and the end of the last cell's.
    pub fn starts(&self) -> &Buffer {
        &self.starts
    }

    /// The entries: `ListEntry` of `glsl/exact/grid.glsl`.
    pub fn entries(&self) -> &Buffer {
        &self.entry_buffer
    }

    /// The header, the starts of the cells' lists, and the entries.
    pub(super) fn bind(&self) -> [Bind<'_>; 3] {
        [&self.header, &self.starts, &self.entry_buffer].map(Bind::Buffer)
    }

    /// Bytes of device memory.
    pub fn memory_bytes(&self) -> u64 {
        let all = [&self.header, &self.pair_buffer, &self.counts, &self.sums, &self.starts, &self.entry_buffer];
        all.iter().map(|b| b.size()).sum()
    }
}

/// Faces whose planes cut an area light: receivers on both sides of such a plane see part of the light.
struct FaceList {
    room: u32,
    list: Buffer,
    planes: Buffer,
}

impl FaceList {
    /// Bytes before the faces: the dispatch arguments and their number.
    const HEADER: u64 = 16;
    /// Rooms that small meshes get for all of their faces.
    const LEAST: u32 = 1 << 16;
    /// Faces whose sides one dispatch can work on.
    const MOST: u32 = 65535 * 64 / 3;

    /// Makes a list with room for every face, or a quarter of those of large meshes.
    fn new(context: &Context, casters: &Casters) -> Result<Self> {
        let triangles = casters.counts().triangles;
        let room = triangles.min(Self::LEAST.max(triangles / 4)).min(Self::MOST);
        Ok(Self {
            room,
            list: buffer(context, "faces that cut the light", Self::HEADER + 4 * u64::from(room.max(1)))?,
            planes: buffer(context, "planes of faces", 16 * u64::from(room.max(1)))?,
        })
    }

    fn clear(&self, frame: &mut Frame<'_>) {
        frame.update(&self.list, bytemuck::bytes_of(&[0_u32, 1, 1, 0]));
    }
}

/// The triangles between receivers and light, in lists by cells.
pub struct TriangleLists {
    project: Arc<ComputePipeline>,
    triangles: Buffer,
    lists: CellLists,
    /// Stands in for a list of faces.
    unlisted: Buffer,
}

impl TriangleLists {
    /// Makes the passes. The lists have room for `entries` entries. With `area`, faces are found whose planes cut an
    /// area light.
    pub fn new(context: &Context, casters: &Casters, cells: u32, entries: u32, area: bool) -> Result<Self> {
        let rooms = u64::from(casters.counts().triangle_chunks) * u64::from(crate::casters::CHUNK);
        Ok(Self {
            project: context
                .pipeline::<TriangleBindings, GridPush>("exact/grid_triangles.comp", &[("FACES", area.into())])?,
            unlisted: no_list(context)?,
            triangles: buffer(context, "triangles in the grid", TRIANGLE * rooms.max(1))?,
            lists: CellLists::new(context, Kind::Triangles, cells, entries)?,
        })
    }

    /// Makes the lists. `edges` takes the faces whose planes cut the light.
    pub fn record(
        &self,
        frame: &mut Frame<'_>,
        depths: &GridReceivers,
        silhouettes: &Silhouettes,
        push: &GridPush,
        edges: Option<&EdgeLists>,
    ) -> Result<()> {
        let c = silhouettes.casters();
        let faces = edges.map(|e| &e.faces);
        let push = GridPush {
            chunks: c.counts().triangle_chunks,
            pairs: self.lists.pairs,
            entries: self.lists.entries,
            faces: faces.map_or(0, |f| f.room),
            ..*push
        };
        self.lists.clear(frame);
        if let Some(faces) = faces {
            faces.clear(frame);
        }
        if push.chunks > 0 {
            frame.dispatch(&Pass {
                name: "project triangles",
                pipeline: &self.project,
                bind: &TriangleBindings {
                    Depths: Bind::Buffer(&depths.depths),
                    Header: Bind::Buffer(&self.lists.header),
                    Pairs: Bind::Buffer(&self.lists.pair_buffer),
                    Positions: c.positions(),
                    Triangles: Bind::Buffer(&c.triangles),
                    Chunks: Bind::Buffer(&c.triangle_chunks),
                    Instances: Bind::Buffer(&c.instances),
                    Lights: Bind::Buffer(silhouettes.lights()),
                    Facing: Bind::Buffer(silhouettes.facing()),
                    GridTriangles: Bind::Buffer(&self.triangles),
                    faces: Bind::Buffer(faces.map_or(&self.unlisted, |f| &f.list)),
                    FacePlanes: Bind::Buffer(faces.map_or(&self.unlisted, |f| &f.planes)),
                },
                push: bytemuck::bytes_of(&push),
                threads: chunks(push.chunks),
            })?;
        }
        self.lists.record(frame, depths, &self.triangles, &push)
    }

    /// The lists.
    pub fn lists(&self) -> &CellLists {
        &self.lists
    }

    /// The triangles that the entries number: `GridTriangle` of `glsl/exact/grid_triangle.glsl`.
    pub fn triangles(&self) -> &Buffer {
        &self.triangles
    }

    /// Bytes of device memory.
    pub fn memory_bytes(&self) -> u64 {
        self.triangles.size() + self.lists.memory_bytes()
    }
}

/// The silhouette edges whose wedges reach receivers, in lists by cells. The sides of faces whose planes cut the light
/// follow them.
pub struct EdgeLists {
    project: [Arc<ComputePipeline>; 2],
    edges: Buffer,
    /// Records of silhouette edges.
    silhouettes: u32,
    faces: FaceList,
    lists: CellLists,
}

impl EdgeLists {
    /// Makes the passes. The lists have room for `entries` entries.
    pub fn new(context: &Context, casters: &Casters, cells: u32, entries: u32) -> Result<Self> {
        let project = |faces: bool| {
            context.pipeline::<EdgeBindings, GridPush>("exact/grid_edges.comp", &[("FACES", faces.into())])
        };
        let silhouettes = casters.counts().edges;
        let faces = FaceList::new(context, casters)?;
        let records = u64::from(silhouettes) + 3 * u64::from(faces.room);
        Ok(Self {
            project: [project(false)?, project(true)?],
            edges: buffer(context, "edges in the grid", EDGE * records.max(1))?,
            silhouettes,
            faces,
            lists: CellLists::new(context, Kind::Edges, cells, entries)?,
        })
    }

    /// Makes the lists. [`TriangleLists::record`] must have found the faces.
    pub fn record(
        &self,
        frame: &mut Frame<'_>,
        depths: &GridReceivers,
        silhouettes: &Silhouettes,
        push: &GridPush,
    ) -> Result<()> {
        let c = silhouettes.casters();
        let push = GridPush {
            pairs: self.lists.pairs,
            entries: self.lists.entries,
            silhouettes: self.silhouettes,
            faces: self.faces.room,
            ..*push
        };
        self.lists.clear(frame);
        // A point light sees every edge at a single place.
        if push.kappa[0] > 0.0 {
            let bind = EdgeBindings {
                Depths: Bind::Buffer(&depths.depths),
                Header: Bind::Buffer(&self.lists.header),
                Pairs: Bind::Buffer(&self.lists.pair_buffer),
                Positions: c.positions(),
                Lights: Bind::Buffer(silhouettes.lights()),
                SilhouetteList: Bind::Buffer(silhouettes.header()),
                Silhouettes: Bind::Buffer(silhouettes.edges()),
                GridEdges: Bind::Buffer(&self.edges),
                Triangles: Bind::Buffer(&c.triangles),
                Chunks: Bind::Buffer(&c.triangle_chunks),
                Instances: Bind::Buffer(&c.instances),
                Facing: Bind::Buffer(silhouettes.facing()),
                faces: Bind::Buffer(&self.faces.list),
            };
            let steps = [
                ("project edges", silhouettes.threads()),
                ("project sides of faces", Threads::Indirect(&self.faces.list, 0)),
            ];
            for ((name, threads), pipeline) in steps.into_iter().zip(&self.project) {
                frame.dispatch(&Pass { name, pipeline, bind: &bind, push: bytemuck::bytes_of(&push), threads })?;
            }
        }
        frame.count(Counted::Named("cut_faces"), &self.faces.list, 12);
        self.lists.record(frame, depths, &self.edges, &push)
    }

    /// The lists.
    pub fn lists(&self) -> &CellLists {
        &self.lists
    }

    /// The edges that the entries number: `GridEdge` of `glsl/exact/grid_edge.glsl`.
    pub fn edges(&self) -> &Buffer {
        &self.edges
    }

    /// The planes of the faces that cut the light.
    pub(super) fn planes(&self) -> Bind<'_> {
        Bind::Buffer(&self.faces.planes)
    }

    /// Push constants with the number of records of silhouette edges.
    pub(super) fn push(&self, push: GridPush) -> GridPush {
        GridPush { silhouettes: self.silhouettes, ..push }
    }

    /// Bytes of device memory.
    pub fn memory_bytes(&self) -> u64 {
        self.edges.size() + self.faces.list.size() + self.faces.planes.size() + self.lists.memory_bytes()
    }
}

impl GridPush {
    /// Push constants for a light's grid with `cells` along each side.
    ///
    /// The lists have room for `entries` entries. `normal_offset` is that of tests in the shadow map.
    pub fn new(inputs: &Inputs<'_>, casters: &Casters, cells: u32, entries: u32, normal_offset: f32) -> Self {
        let light = &inputs.light[0];
        let segments = EdgeSegments::push(light, [cells; 2], 0.0, casters.stride());
        let [u, v, _, offset] = light_area(light);
        let depth = if light.is_directional() { offset } else { 1.0 };
        Self {
            cells,
            stride: casters.stride(),
            chunks: 0,
            pairs: entries,
            entries,
            spot: (!light.is_directional()).into(),
            nearest: segments.nearest,
            mirrored: segments.mirrored,
            kappa: [2.0 * u * depth, 2.0 * v * depth],
            normal_offset,
            silhouettes: 0,
            faces: 0,
            far_vertices: casters.far_vertices(inputs.casters) as f32,
        }
    }
}
