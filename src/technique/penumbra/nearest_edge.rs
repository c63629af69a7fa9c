//! Every pixel's nearest shadow edge, and the intensity of the penumbra by its distance.

use super::edge_seeds::{EdgeConfig, EdgeSeeds};
use super::nearest_line::NearestLine;
use super::search::{BLOCK, EdgeImages, SearchBindings, labels_of_blocks};
use super::seed_width::WidthConfig;
use super::shared::PenumbraPush;
use crate::gpu::{Buffer, ComputePipeline, Image, bindings};
use crate::technique::Setup;
use crate::technique::common::surface::SurfaceTest;
use crate::technique::common::tiles::TileList;
use crate::technique::distance_transform::NO_SEED;
use crate::{Bind, Context, Frame, Inputs, Pass, Result};
use std::sync::Arc;

/// Seed that counts as the nearest.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Nearest {
    /// The seed nearest in the world, among those on the pixel's surface.
    World,
    /// The same, for seeds that stand for short lines, of which a pixel measures few.
    WorldLine,
    /// The seed nearest in the image, as in the paper. Its distance is measured in the world.
    Pixel,
}

/// Side of a quad: `QUAD` of `glsl/penumbra/nearest_edge.glsl`.
const QUAD: u32 = 2;
/// Steps between the neighbours that a block asks, in blocks; a pass each.
const STEPS: [i32; 6] = [32, 16, 8, 4, 2, 1];

bindings! {
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

/// The passes with their images.
pub struct NearestEdge {
    search: Search,
    images: EdgeImages,
    viewed: bool,
    soft: bool,
}

/// The passes of a search.
enum Search {
    Points(Points),
    Lines(NearestLine),
}

/// The search among points.
struct Points {
    /// Passes over blocks; absent with [`Nearest::Pixel`].
    coarse: Option<Coarse>,
    finish: Arc<ComputePipeline>,
    block_labels: [Image; 2],
    quad_labels: Image,
    tiles: TileList,
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

impl Points {
    fn new(context: &Context, extent: [u32; 2], config: EdgeConfig, world: bool, viewed: bool) -> Result<Self> {
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
        let quads = || {
            context.pipeline::<QuadBindings, PenumbraPush>(
                "penumbra/nearest_quad.comp",
                &[planes, soft, meet, metric, filter],
            )
        };
        let coarse_extent = if world { extent } else { [1, 1] };
        let labels = |side| labels_of_blocks(context, coarse_extent, side);
        Ok(Self {
            coarse: match world {
                true => Some(Coarse { first: block(true)?, others: block(false)?, quads: quads()? }),
                false => None,
            },
            finish: context.pipeline::<EdgeBindings, PenumbraPush>("penumbra/nearest_edge.comp", &edge_constants)?,
            block_labels: [labels(BLOCK)?, labels(BLOCK)?],
            quad_labels: labels(QUAD)?,
            tiles: TileList::new(context.device(), "tiles in a penumbra", extent)?,
        })
    }

    fn memory_bytes(&self) -> u64 {
        let [a, b] = &self.block_labels;
        [a, b, &self.quad_labels].map(Image::memory_bytes).iter().sum::<u64>() + self.tiles.buffer().size()
    }

    fn record(
        &self,
        frame: &mut Frame<'_>,
        view: &Buffer,
        inputs: &Inputs<'_>,
        push: PenumbraPush,
        (seeds, labels, hard, images): (&EdgeSeeds, &Image, &Image, &EdgeImages),
    ) -> Result<()> {
        let search = SearchBindings::new(view, inputs, seeds, labels);
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
                intensity: Bind::Image(&images.intensity),
                filter_list: Bind::Buffer(self.tiles.buffer()),
                distances: Bind::Image(&images.distances),
                nearest_labels: Bind::Image(&images.labels),
                seed_mask: Bind::Image(&images.seed_mask),
                pixel_widths: Bind::Image(&images.pixel_widths),
                visibility: Bind::Image(hard),
            },
            push: bytemuck::bytes_of(&push),
            threads: seeds.tiles().threads(),
        })?;
        seeds.tiles().count(frame);
        Ok(())
    }
}

impl NearestEdge {
    /// Allocates for a camera image, and keeps the images of [`Viewed`] if intermediates are wanted. `pixels` is a list of
    /// pixels that this and earlier passes use in turn.
    pub fn new(
        context: &Context,
        setup: &Setup,
        config: EdgeConfig,
        nearest: Nearest,
        pixels: &Arc<Buffer>,
    ) -> Result<Self> {
        let (extent, viewed) = (setup.extent, setup.intermediates);
        Ok(Self {
            search: match nearest {
                Nearest::WorldLine => Search::Lines(NearestLine::new(context, setup, config, pixels)?),
                _ => Search::Points(Points::new(context, extent, config, nearest == Nearest::World, viewed)?),
            },
            images: EdgeImages::new(context, extent, config, viewed)?,
            viewed,
            soft: config.widths.is_some(),
        })
    }

    /// Bytes of images and lists.
    pub fn memory_bytes(&self) -> u64 {
        let search = match &self.search {
            Search::Points(points) => points.memory_bytes(),
            Search::Lines(lines) => lines.memory_bytes(),
        };
        search + self.images.memory_bytes()
    }

    /// Returns the image of intensities, `R32G32_SFLOAT`, written in the tiles near an edge only. It holds the intensity of
    /// pixels within reach of an edge, the hard visibility less 2 of others, and the normal, packed by `packNormal` of
    /// `glsl/penumbra/seed_format.glsl`.
    pub fn intensity(&self) -> &Image {
        &self.images.intensity
    }

    /// Returns the image of penumbra widths, `R32_SFLOAT`, world units, written at pixels within reach of an edge; an image of
    /// one pixel without [`EdgeConfig::widths`], or if neither the filter nor a viewer needs it.
    pub fn pixel_widths(&self) -> &Image {
        &self.images.pixel_widths
    }

    /// Returns the tiles with any pixel within reach of an edge, or `None` if the search lists none.
    pub fn tiles(&self) -> Option<&TileList> {
        match &self.search {
            Search::Points(points) => Some(&points.tiles),
            Search::Lines(_) => None,
        }
    }

    /// Returns the intermediate images, if they are kept.
    pub fn viewed(&self) -> Option<Viewed<'_>> {
        let EdgeImages { seed_mask, labels, distances, pixel_widths, .. } = &self.images;
        let widths = self.soft.then_some(pixel_widths);
        self.viewed.then_some(Viewed { seeds: seed_mask, labels, distances, widths })
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
        let images = (seeds, labels, hard, &self.images);
        match &self.search {
            Search::Points(points) => points.record(frame, view, inputs, push, images),
            Search::Lines(lines) => lines.record(frame, view, inputs, push, images),
        }
    }
}
