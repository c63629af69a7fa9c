//! Shadow edges found in an image of hard shadows, and the tiles within their reach.

use super::edge_line::EdgeLine;
use super::seed_width::{SeedWidth, Seeds, WidthConfig};
use super::shared::{PenumbraPush, scratch};
use crate::gpu::{Buffer, BufferDesc, ComputePipeline, Image, MemoryKind, bindings, shader_struct};
use crate::technique::common::bindings::CameraBindings;
use crate::technique::common::rbsm_receiver::RbsmPush;
use crate::technique::common::surface::SurfaceTest;
use crate::technique::common::tiles::{TILE, TileList, indirect_list};
use crate::technique::revectorization::rbsm_pass::RbsmConfig;
use crate::{Bind, Context, Error, Frame, Inputs, Pass, Result, Threads};
use ash::vk;
use std::sync::Arc;

/// Bytes of a seed.
const SEED_BYTES: u64 = 12;

/// Tiles along the side of a block of marks.
const MARKS: u32 = 8;

/// Pairs of coarse steps that only wide penumbrae need.
pub const COARSE_PAIRS: usize = 3;

shader_struct! {
    /// Push constants of `glsl/penumbra/marked_tiles.comp`.
    pub struct MarkedTilesPush {
        tiles: [u32; 2],
    }
}

bindings! {
    /// Hard shadows, and a list: of tiles with an edge, or of pixels at one.
    struct HardBindings { ..camera: CameraBindings, hard, list }
    struct PixelsBindings { ..hard: HardBindings, pixels }
    struct SeedsBindings { ..hard: HardBindings, Seeds, SeedBits, Marks, Coarse }
    struct MarkedTilesBindings { Marks, list, BlockGroups, QuadGroups, Coarse }
}

/// Place of the edge that a seed stands for.
#[derive(Clone, Copy)]
pub enum EdgePoints {
    /// The pixel's own centre, as in the paper.
    Pixels,
    /// Half-way to the neighbours that differ.
    Between,
    /// The point where the hard shadow ends between the pixels, found with the function that makes the shadow.
    Traced(RbsmConfig),
}

/// Settings that are fixed when the passes are made.
#[derive(Clone, Copy)]
pub struct EdgeConfig {
    /// Test that tells surfaces apart.
    pub surfaces: SurfaceTest,
    /// A neighbour on any surface makes a seed, as in the paper: outlines of objects become edges too.
    pub any_surface: bool,
    /// Place of the edges.
    pub points: EdgePoints,
    /// True to list only tiles within reach of a seed; false to list all.
    pub skip: bool,
    /// Settings of penumbrae as wide as the area light makes them; `None` for penumbrae of one width.
    pub widths: Option<WidthConfig>,
    /// A mean filter follows and writes the visibility; otherwise the search overwrites the hard shadows with it.
    pub filtered: bool,
}

/// The passes with their images and lists: about 12 bytes a pixel.
pub struct EdgeSeeds {
    detect: Arc<ComputePipeline>,
    pixels: Arc<ComputePipeline>,
    find: Arc<ComputePipeline>,
    line: Option<EdgeLine>,
    widths: Option<SeedWidth>,
    no_widths: Image,
    list: Arc<ComputePipeline>,
    edges: TileList,
    edge_pixels: Arc<Buffer>,
    seeds: Buffer,
    marks: Buffer,
    tiles: TileList,
    block_groups: Buffer,
    quad_groups: Buffer,
    coarse: Buffer,
}

impl EdgeSeeds {
    /// Allocates for a camera image and a shadow map, `edge_pixels` being a list with room for every pixel, which other passes
    /// may use before and after, whose size matters only with [`EdgeConfig::widths`].
    ///
    /// # Errors
    /// [`Error::Parameter`] for more pixels than a storage buffer of the device may list.
    pub fn new(
        context: &Context,
        extent: [u32; 2],
        map_size: [u32; 2],
        config: EdgeConfig,
        edge_pixels: &Arc<Buffer>,
    ) -> Result<Self> {
        let device = context.device();
        let EdgeConfig { surfaces, any_surface, points, skip, widths, filtered: _ } = config;
        let planes = ("PLANES", (surfaces == SurfaceTest::Planes).into());
        let at_pixels = ("AT_PIXELS", matches!(points, EdgePoints::Pixels).into());
        let (any_surface, soft) = (("ANY_SURFACE", any_surface.into()), ("SOFT", widths.is_some().into()));
        let pixels = u64::from(extent[0]) * u64::from(extent[1]);
        let most = u64::from(device.limits.max_storage_buffer_range) / SEED_BYTES;
        if pixels > most {
            let [w, h] = extent;
            let problem =
                format!("edges of a {w}x{h} image can't be listed: this device allows {most} pixels; render fewer");
            return Err(Error::Parameter(problem));
        }
        let blocks = extent.map(|n| u64::from(n.div_ceil(TILE * MARKS)));
        let usage = vk::BufferUsageFlags::STORAGE_BUFFER | vk::BufferUsageFlags::TRANSFER_DST;
        let (name, size, memory) = ("tiles near an edge, marked", 8 * blocks[0] * blocks[1], MemoryKind::Gpu);
        let seeds = BufferDesc { name: "shadow-edge seeds", size: SEED_BYTES * pixels, usage, memory };
        Ok(Self {
            detect: context.pipeline::<HardBindings, PenumbraPush>("penumbra/edge_tiles.comp", &[planes])?,
            pixels: context
                .pipeline::<PixelsBindings, PenumbraPush>("penumbra/edge_pixels.comp", &[planes, at_pixels])?,
            find: context.pipeline::<SeedsBindings, PenumbraPush>(
                "penumbra/edge_seeds.comp",
                &[planes, any_surface, at_pixels, soft],
            )?,
            line: match points {
                EdgePoints::Traced(hard) => Some(EdgeLine::new(context, hard)?),
                _ => None,
            },
            widths: match widths {
                Some(widths) => Some(SeedWidth::new(context, extent, map_size, surfaces, widths)?),
                None => None,
            },
            no_widths: scratch(context, "no penumbra widths", vk::Format::R32G32_SFLOAT, extent, false)?,
            list: context.pipeline::<MarkedTilesBindings, MarkedTilesPush>(
                "penumbra/marked_tiles.comp",
                &[("ALL", (!skip).into())],
            )?,
            edges: TileList::new(device, "tiles with an edge", extent)?,
            edge_pixels: edge_pixels.clone(),
            seeds: Buffer::new(device, &seeds)?,
            marks: Buffer::new(device, &BufferDesc { name, size, usage, memory })?,
            tiles: TileList::new(device, "tiles near an edge", extent)?,
            block_groups: indirect_list(device, "groups of blocks near an edge", 12, 0)?,
            quad_groups: indirect_list(device, "groups of quads near an edge", 12, 0)?,
            coarse: indirect_list(device, "groups of blocks near a wide penumbra", 12 * COARSE_PAIRS as u64 + 4, 0)?,
        })
    }

    /// Bytes of images, buffers and lists, without the list of pixels that is shared.
    pub fn memory_bytes(&self) -> u64 {
        let buffers = [self.edges.buffer(), &self.seeds, &self.marks, self.tiles.buffer()];
        let widths = self.widths.as_ref().map_or(0, SeedWidth::memory_bytes);
        buffers.iter().map(|b| b.size()).sum::<u64>() + widths
    }

    /// Returns [`SeedWidth::widths`], or an image of one pixel where all penumbrae have one width.
    pub fn widths(&self) -> &Image {
        self.widths.as_ref().map_or(&self.no_widths, SeedWidth::widths)
    }

    /// Returns the seeds, 12 bytes for each pixel as `glsl/penumbra/seed_format.glsl` describes; those of other pixels are
    /// not written.
    pub fn seeds(&self) -> &Buffer {
        &self.seeds
    }

    /// Returns the tiles within reach of a seed.
    pub fn tiles(&self) -> &TileList {
        &self.tiles
    }

    /// Returns a thread for every block of 4 x 4 pixels of these tiles, in groups of 64.
    pub fn block_threads(&self) -> Threads<'_> {
        Threads::Indirect(&self.block_groups, 0)
    }

    /// Returns the same threads for each of three pairs of coarse steps of a search if a penumbra reaches
    /// farther than the distance transform's labels and the finer pairs do, and otherwise none. The coarsest pair comes
    /// first.
    pub fn coarse_threads(&self) -> [Threads<'_>; COARSE_PAIRS] {
        [0, 1, 2].map(|pair| Threads::Indirect(&self.coarse, 12 * pair))
    }

    /// Returns a thread for every quad of 2 x 2 pixels of these tiles, in groups of 64.
    pub fn quad_threads(&self) -> Threads<'_> {
        Threads::Indirect(&self.quad_groups, 0)
    }

    /// Finds the seeds in `hard`, an image of visibility 0 and 1, sets their bits in `seed_bits` (see
    /// [`crate::technique::distance_transform::Edt::seed_bits`]) and lists the tiles in their reach. `hard_push` holds the
    /// constants that `hard` was made with.
    pub fn record(
        &mut self,
        frame: &mut Frame<'_>,
        view_buffer: &Buffer,
        inputs: &Inputs<'_>,
        (push, hard_push): (PenumbraPush, RbsmPush),
        (hard, seed_bits): (&Image, &Buffer),
    ) -> Result<()> {
        let tiles = hard.extent().map(|n| n.div_ceil(TILE));
        let threads = Threads::Count([tiles[0], tiles[1], 1]);
        let (camera, hard) = (CameraBindings::new(view_buffer, inputs), Bind::Image(hard));
        let at_tiles = HardBindings { camera, hard, list: Bind::Buffer(self.edges.buffer()) };
        let at_pixels = HardBindings { list: Bind::Buffer(&self.edge_pixels), ..at_tiles };
        let marks = Bind::Buffer(&self.marks);
        let widths_push = push;
        let push = bytemuck::bytes_of(&push);
        self.edges.clear(frame);
        frame.dispatch(&Pass { name: "tiles with an edge", pipeline: &self.detect, bind: &at_tiles, push, threads })?;
        frame.update(&self.edge_pixels, bytemuck::bytes_of(&[0u32, 1, 1, 0]));
        frame.dispatch(&Pass {
            name: "pixels at an edge",
            pipeline: &self.pixels,
            bind: &PixelsBindings { hard: at_tiles, pixels: Bind::Buffer(&self.edge_pixels) },
            push,
            threads: self.edges.threads(),
        })?;
        self.edges.count(frame);
        frame.fill("clear marks", &self.marks, 0);
        frame.fill("clear seeds", seed_bits, 0);
        frame.update(&self.coarse, bytemuck::bytes_of(&[0u32, 1, 1, 0, 1, 1, 0, 1, 1, 0]));
        frame.dispatch(&Pass {
            name: "shadow-edge seeds",
            pipeline: &self.find,
            bind: &SeedsBindings {
                hard: at_pixels,
                Seeds: Bind::Buffer(&self.seeds),
                SeedBits: Bind::Buffer(seed_bits),
                Marks: marks,
                Coarse: Bind::Buffer(&self.coarse),
            },
            push,
            threads: Threads::Indirect(&self.edge_pixels, 0),
        })?;
        if let Some(line) = &self.line {
            line.record(frame, view_buffer, inputs, hard_push, (&self.edge_pixels, &self.seeds, seed_bits))?;
        }
        if let Some(widths) = &mut self.widths {
            let (pixels, seeds, marks, coarse) = (&self.edge_pixels, &self.seeds, &self.marks, &self.coarse);
            widths.record(
                frame,
                view_buffer,
                inputs,
                &widths_push,
                &Seeds { pixels, seeds, bits: seed_bits, marks, coarse },
            )?;
        }
        self.tiles.clear(frame);
        for groups in [&self.block_groups, &self.quad_groups] {
            frame.update(groups, bytemuck::bytes_of(&[0u32, 1, 1]));
        }
        frame.dispatch(&Pass {
            name: "tiles near an edge",
            pipeline: &self.list,
            bind: &MarkedTilesBindings {
                Marks: marks,
                list: Bind::Buffer(self.tiles.buffer()),
                BlockGroups: Bind::Buffer(&self.block_groups),
                QuadGroups: Bind::Buffer(&self.quad_groups),
                Coarse: Bind::Buffer(&self.coarse),
            },
            push: bytemuck::bytes_of(&MarkedTilesPush { tiles }),
            threads,
        })
    }
}
