//! Every pixel's nearest shadow edge, and the intensity of the penumbra by its distance.

use super::edge_seeds::{EdgeConfig, EdgeSeeds};
use super::seed_width::WidthConfig;
use super::shared::{PenumbraPush, scratch};
use crate::gpu::{Buffer, ComputePipeline, Image, ImageDesc, bindings};
use crate::technique::common::bindings::CameraBindings;
use crate::technique::common::surface::SurfaceTest;
use crate::technique::common::tiles::TileList;
use crate::technique::distance_transform::NO_SEED;
use crate::{Bind, Context, Frame, Inputs, Pass, Result};
use ash::vk;
use std::sync::Arc;

/// Seed that counts as the nearest.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Nearest {
    /// The seed nearest in the world, among those on the pixel's surface.
    World,
    /// The seed nearest in the image, as in the paper. Its distance is measured in the world.
    Pixel,
}

/// Sides of the blocks of pixels that the search visits first: `BLOCK` and `QUAD` of `glsl/penumbra/nearest_edge.glsl`.
const BLOCK: u32 = 4;
const QUAD: u32 = 2;
/// Steps between the neighbours that a block asks, in blocks; a pass each.
const STEPS: [i32; 6] = [32, 16, 8, 4, 2, 1];

bindings! {
    /// Images and lists that a search for the nearest edge works on.
    struct SearchBindings { ..camera: CameraBindings, seeds, labels, list, widths }
    struct BlockBindings { ..search: SearchBindings, relaxed_labels }
    struct QuadBindings { ..search: SearchBindings, block_labels, quad_labels }
    struct EdgeBindings {
        ..search: SearchBindings,
        quad_labels,
        hard,
        intensity,
        filter_list,
        distances,
        nearest_labels,
        seed_mask,
        pixel_widths,
        visibility,
    }
}

/// The passes with their images: about 9 bytes a pixel.
pub struct NearestEdge {
    /// Passes over blocks; absent with [`Nearest::Pixel`].
    coarse: Option<Coarse>,
    finish: Arc<ComputePipeline>,
    block_labels: [Image; 2],
    quad_labels: Image,
    intensity: Image,
    tiles: TileList,
    viewed: bool,
    distances: Image,
    labels: Image,
    seed_mask: Image,
    pixel_widths: Image,
    soft: bool,
}

/// Pipelines that work on blocks of pixels.
struct Coarse {
    /// Reads the transform's labels.
    first: Arc<ComputePipeline>,
    others: Arc<ComputePipeline>,
    quads: Arc<ComputePipeline>,
}

/// Intermediate images of a search; only tiles near an edge have values.
pub struct Viewed<'a> {
    /// `R8_UNORM`, 1 at a seed; with [`EdgeConfig::widths`] `R32G32_SFLOAT`, the seeds' widths and cosines, otherwise 0.
    pub seeds: &'a Image,
    /// `R32_UINT`: the pixel of the nearest edge's seed, `x + 65536 y`, or [`NO_SEED`].
    pub labels: &'a Image,
    /// `R32_SFLOAT`: world distance to that edge, infinite beyond reach; with [`EdgeConfig::widths`], a share of that edge's
    /// penumbra width.
    pub distances: &'a Image,
    /// `R32_SFLOAT`: the width of the penumbra that a pixel lies in, world units, 0 beyond reach; only with
    /// [`EdgeConfig::widths`].
    pub widths: Option<&'a Image>,
}

impl NearestEdge {
    /// Allocates for a camera image; `viewed`: keeps the images of [`Viewed`].
    pub fn new(
        context: &Context,
        extent: [u32; 2],
        config: EdgeConfig,
        nearest: Nearest,
        viewed: bool,
    ) -> Result<Self> {
        let world = nearest == Nearest::World;
        let planes = ("PLANES", (config.surfaces == SurfaceTest::Planes).into());
        let [soft, meet, metric, filter] = WidthConfig::constants(config.widths);
        let block = |first: bool| {
            let constants = [planes, ("FIRST", first.into()), soft, meet, metric, filter];
            context.pipeline::<BlockBindings, PenumbraPush>("penumbra/nearest_block.comp", &constants)
        };
        let edge_constants = [
            planes,
            ("WORLD", world.into()),
            ("VIEWED", viewed.into()),
            soft,
            meet,
            metric,
            filter,
            ("LINE_TAPS", config.widths.map_or(0, |w| w.line_taps)),
            ("FILTERED", config.filtered.into()),
        ];
        let is_soft = config.widths.is_some();
        let labels_of_blocks = |side| {
            let extent = if world { extent.map(|n| n.div_ceil(side)) } else { [1, 1] };
            let desc = ImageDesc::storage("nearest edge of a block", vk::Format::R32_UINT, extent);
            Image::new(context.device(), &ImageDesc { usage: desc.usage | vk::ImageUsageFlags::TRANSFER_DST, ..desc })
        };
        let seed_format = if is_soft { vk::Format::R32G32_SFLOAT } else { vk::Format::R8_UNORM };
        let image = |name, format, wanted| scratch(context, name, format, extent, wanted);
        Ok(Self {
            coarse: match nearest {
                Nearest::World => Some(Coarse {
                    first: block(true)?,
                    others: block(false)?,
                    quads: context.pipeline::<QuadBindings, PenumbraPush>(
                        "penumbra/nearest_quad.comp",
                        &[planes, soft, meet, metric, filter],
                    )?,
                }),
                Nearest::Pixel => None,
            },
            finish: context.pipeline::<EdgeBindings, PenumbraPush>("penumbra/nearest_edge.comp", &edge_constants)?,
            block_labels: [labels_of_blocks(BLOCK)?, labels_of_blocks(BLOCK)?],
            quad_labels: labels_of_blocks(QUAD)?,
            intensity: image("penumbra intensity", vk::Format::R32G32_SFLOAT, config.filtered || viewed)?,
            tiles: TileList::new(context.device(), "tiles in a penumbra", extent)?,
            viewed,
            distances: image("distance to the nearest edge", vk::Format::R32_SFLOAT, viewed)?,
            labels: image("nearest edge", vk::Format::R32_UINT, viewed)?,
            seed_mask: image("seeds", seed_format, viewed)?,
            pixel_widths: image("penumbra widths", vk::Format::R32_SFLOAT, is_soft)?,
            soft: is_soft,
        })
    }

    /// Bytes of images and lists.
    pub fn memory_bytes(&self) -> u64 {
        let images =
            [&self.intensity, &self.distances, &self.labels, &self.seed_mask, &self.pixel_widths, &self.quad_labels];
        images.into_iter().chain(&self.block_labels).map(|i| i.memory_bytes()).sum::<u64>() + self.tiles.buffer().size()
    }

    /// Returns the image of intensities, `R32G32_SFLOAT`, written in the tiles near an edge only. It holds the intensity of
    /// pixels within reach of an edge, the hard visibility less 2 of others, and the normal, packed by `packNormal` of
    /// `glsl/penumbra/seed_format.glsl`.
    pub fn intensity(&self) -> &Image {
        &self.intensity
    }

    /// Returns the image of penumbra widths, `R32_SFLOAT`, world units, written at pixels within reach of an edge; an image of
    /// one pixel without [`EdgeConfig::widths`].
    pub fn pixel_widths(&self) -> &Image {
        &self.pixel_widths
    }

    /// Returns the tiles with any pixel within reach of an edge.
    pub fn tiles(&self) -> &TileList {
        &self.tiles
    }

    /// Returns the intermediate images, if they are kept.
    pub fn viewed(&self) -> Option<Viewed<'_>> {
        let widths = self.soft.then_some(&self.pixel_widths);
        let viewed = Viewed { seeds: &self.seed_mask, labels: &self.labels, distances: &self.distances, widths };
        self.viewed.then_some(viewed)
    }

    /// Finds the nearest edges in the tiles that `seeds` lists. The search starts from `labels`, the nearest seeds in the image
    /// of all pixels or of those within some distance. `hard` holds the hard shadows; without [`EdgeConfig::filtered`], the
    /// visibility overwrites them.
    pub fn record(
        &self,
        frame: &mut Frame<'_>,
        view: &Buffer,
        inputs: &Inputs<'_>,
        push: PenumbraPush,
        (seeds, labels, hard): (&EdgeSeeds, &Image, &Image),
    ) -> Result<()> {
        let search = SearchBindings {
            camera: CameraBindings::new(view, inputs),
            seeds: Bind::Image(seeds.seeds()),
            labels: Bind::Image(labels),
            list: Bind::Buffer(seeds.tiles().buffer()),
            widths: Bind::Image(seeds.widths()),
        };
        let [mut after, mut before] = [&self.block_labels[0], &self.block_labels[1]];
        if let Some(Coarse { first, others, quads }) = &self.coarse {
            // Blocks in tiles that are not listed have no edge in reach.
            let [a, b] = &self.block_labels;
            for (name, image) in
                [("clear block labels", a), ("clear other block labels", b), ("clear quad labels", &self.quad_labels)]
            {
                frame.fill_image(name, image, NO_SEED);
            }
            for (i, &step) in STEPS.iter().enumerate() {
                let (pipeline, from) = if i == 0 { (first, labels) } else { (others, before) };
                frame.dispatch(&Pass {
                    name: &format!("nearest edge of blocks, step {step}"),
                    pipeline,
                    bind: &BlockBindings {
                        search: SearchBindings { labels: Bind::Image(from), ..search },
                        relaxed_labels: Bind::Image(after),
                    },
                    push: bytemuck::bytes_of(&PenumbraPush { step, ..push }),
                    threads: seeds.block_threads(),
                })?;
                (before, after) = (after, before);
            }
            frame.dispatch(&Pass {
                name: "nearest edge of quads",
                pipeline: quads,
                bind: &QuadBindings {
                    search,
                    block_labels: Bind::Image(before),
                    quad_labels: Bind::Image(&self.quad_labels),
                },
                push: bytemuck::bytes_of(&push),
                threads: seeds.quad_threads(),
            })?;
        }
        self.tiles.clear(frame);
        frame.dispatch(&Pass {
            name: "nearest edge",
            pipeline: &self.finish,
            bind: &EdgeBindings {
                search,
                quad_labels: Bind::Image(&self.quad_labels),
                hard: Bind::Image(hard),
                intensity: Bind::Image(&self.intensity),
                filter_list: Bind::Buffer(self.tiles.buffer()),
                distances: Bind::Image(&self.distances),
                nearest_labels: Bind::Image(&self.labels),
                seed_mask: Bind::Image(&self.seed_mask),
                pixel_widths: Bind::Image(&self.pixel_widths),
                visibility: Bind::Image(hard),
            },
            push: bytemuck::bytes_of(&push),
            threads: seeds.tiles().threads(),
        })?;
        seeds.tiles().count(frame);
        Ok(())
    }
}
