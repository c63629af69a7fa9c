//! Every pixel's distance to the nearest line of a shadow edge, and the intensity of the penumbra by it: seeds are short
//! lines along the edge, so that few of them tell the distance.

use super::edge_seeds::{COARSE_PAIRS, EdgeConfig, EdgeSeeds};
use super::search::{BLOCK, EdgeImages, SearchBindings, labels_of_blocks};
use super::seed_width::WidthConfig;
use super::shared::PenumbraPush;
use crate::gpu::{Buffer, ComputePipeline, Image, ImageDesc, bindings};
use crate::technique::Setup;
use crate::technique::common::surface::SurfaceTest;
use crate::technique::common::tiles::indirect_list;
use crate::technique::distance_transform::NO_SEED;
use crate::{Bind, Context, Frame, Inputs, Pass, Result, Threads};
use ash::vk;
use std::sync::Arc;

/// Bytes before the listed blocks: the dispatch arguments and the count.
const HEADER: u64 = 16;

/// Steps between the neighbours that a block asks, in blocks; a pass each. The first reads the transform's labels and the
/// last lists blocks. Those between carry labels farther than the transform does. They run in pairs, so that the labels
/// lie in the same image whether a pair runs or not.
const FIRST_STEP: i32 = 2;
const COARSE_STEPS: [[i32; 2]; COARSE_PAIRS] = [[64, 32], [16, 8], [4, 2]];
const LAST_STEP: i32 = 1;

bindings! {
    struct BlocksBindings { ..search: SearchBindings, relaxed_labels, pixel_labels, BlockList, MixedList }
    struct QuadsBindings {
        ..search: SearchBindings,
        block_labels,
        hard,
        intensity,
        distances,
        nearest_labels,
        seed_mask,
        pixel_widths,
        visibility,
        TurnedList,
    }
}

/// The passes with their labels and lists: about a byte a pixel.
pub struct NearestLine {
    /// Steps over blocks.
    first: Arc<ComputePipeline>,
    middle: Arc<ComputePipeline>,
    last: Arc<ComputePipeline>,
    /// Passes over the quads of plain blocks, over those with edges on several surfaces, and over quads where the normal
    /// turns by more than at a crease on the way to an edge.
    quads: [Arc<ComputePipeline>; 3],
    labels: [Image; 2],
    /// Work of these passes; the last is shared.
    lists: [Buffer; 2],
    turned: Arc<Buffer>,
    /// Copy of the hard shadows for the taps across a penumbra, since the visibility overwrites them.
    hard: Option<Image>,
}

impl NearestLine {
    /// Allocates for a camera image. `turned` is a list with room for every quad.
    pub fn new(context: &Context, setup: &Setup, config: EdgeConfig, turned: &Arc<Buffer>) -> Result<Self> {
        let (extent, viewed) = (setup.extent, setup.intermediates);
        let planes = ("PLANES", (config.surfaces == SurfaceTest::Planes).into());
        let [soft, meet, metric, filter] = WidthConfig::constants(config.widths);
        let block = |first: bool, last: bool| {
            let all = last && (config.filtered || viewed);
            let (first, last, all) = (("FIRST", first.into()), ("LAST", last.into()), ("ALL", all.into()));
            let constants = [planes, first, last, all, soft, meet, metric, filter];
            context.pipeline::<BlocksBindings, PenumbraPush>("penumbra/line_blocks.comp", &constants)
        };
        let quad = |aside: bool, turned: bool| {
            let [aside, turned] = [("ASIDE", aside.into()), ("TURNED", turned.into())];
            let [viewed, filtered] = [("VIEWED", viewed.into()), ("FILTERED", config.filtered.into())];
            let taps = ("LINE_TAPS", config.widths.map_or(0, |w| w.line_taps));
            let constants = [planes, aside, turned, viewed, filtered, taps, soft, meet, metric, filter];
            context.pipeline::<QuadsBindings, PenumbraPush>("penumbra/line_quads.comp", &constants)
        };
        let kept = !config.filtered && config.widths.is_some_and(|w| w.line_taps > 0);
        let copied = ImageDesc::storage("hard shadows of penumbrae", setup.output.format(), extent);
        let copied = ImageDesc { usage: copied.usage | vk::ImageUsageFlags::TRANSFER_DST, ..copied };
        let blocks = extent.iter().map(|n| u64::from(n.div_ceil(BLOCK))).product();
        let list = |name| indirect_list(context.device(), name, HEADER, blocks);
        Ok(Self {
            first: block(true, false)?,
            middle: block(false, false)?,
            last: block(false, true)?,
            quads: [quad(false, false)?, quad(true, false)?, quad(true, true)?],
            labels: [labels_of_blocks(context, extent, BLOCK)?, labels_of_blocks(context, extent, BLOCK)?],
            lists: [list("blocks near an edge")?, list("blocks near edges of several surfaces")?],
            turned: turned.clone(),
            hard: if kept { Some(Image::new(context.device(), &copied)?) } else { None },
        })
    }

    /// Bytes of images and lists, without the list that is shared.
    pub fn memory_bytes(&self) -> u64 {
        let images = self.labels.iter().chain(&self.hard).map(Image::memory_bytes);
        images.chain(self.lists.iter().map(Buffer::size)).sum()
    }

    /// Finds the nearest lines in the tiles that `seeds` lists.
    pub fn record(
        &self,
        frame: &mut Frame<'_>,
        view: &Buffer,
        inputs: &Inputs<'_>,
        push: PenumbraPush,
        (seeds, labels, hard, images): (&EdgeSeeds, &Image, &Image, &EdgeImages),
    ) -> Result<()> {
        let search = SearchBindings::new(view, inputs, seeds, labels);
        let [mut after, mut before] = [&self.labels[0], &self.labels[1]];
        // Blocks in tiles that are not listed have no edge in reach.
        let [a, b] = &self.labels;
        for (name, image) in [("clear block labels", a), ("clear other block labels", b)] {
            frame.fill_image(name, image, NO_SEED);
        }
        for list in self.lists.iter().chain([&*self.turned]) {
            frame.update(list, bytemuck::bytes_of(&[0u32, 1, 1, 0]));
        }
        let pairs = COARSE_STEPS.iter().zip(seeds.coarse_threads());
        let coarse = pairs.flat_map(|(pair, threads)| pair.map(|step| (&self.middle, step, threads)));
        let first = (&self.first, FIRST_STEP, seeds.block_threads());
        let last = (&self.last, LAST_STEP, seeds.block_threads());
        for (i, (pipeline, step, threads)) in [first].into_iter().chain(coarse).chain([last]).enumerate() {
            frame.dispatch(&Pass {
                name: &format!("nearest line of blocks {}, step {step}", i + 1),
                pipeline,
                bind: &BlocksBindings {
                    search: SearchBindings { labels: Bind::Image(if i == 0 { labels } else { before }), ..search },
                    relaxed_labels: Bind::Image(after),
                    pixel_labels: Bind::Image(labels),
                    BlockList: Bind::Buffer(&self.lists[0]),
                    MixedList: Bind::Buffer(&self.lists[1]),
                },
                push: bytemuck::bytes_of(&PenumbraPush { step, ..push }),
                threads,
            })?;
            (before, after) = (after, before);
        }
        seeds.tiles().count(frame);
        if let Some(kept) = &self.hard {
            frame.copy_image("copy hard shadows", hard, kept);
        }
        for (name, pipeline, list) in [
            ("nearest line", &self.quads[0], &self.lists[0]),
            ("nearest line, several surfaces", &self.quads[1], &self.lists[1]),
            ("nearest line, round bends", &self.quads[2], &self.turned),
        ] {
            frame.dispatch(&Pass {
                name,
                pipeline,
                bind: &QuadsBindings {
                    search: SearchBindings { list: Bind::Buffer(list), ..search },
                    block_labels: Bind::Image(before),
                    hard: Bind::Image(self.hard.as_ref().unwrap_or(hard)),
                    intensity: Bind::Image(&images.intensity),
                    distances: Bind::Image(&images.distances),
                    nearest_labels: Bind::Image(&images.labels),
                    seed_mask: Bind::Image(&images.seed_mask),
                    pixel_widths: Bind::Image(&images.pixel_widths),
                    visibility: Bind::Image(hard),
                    TurnedList: Bind::Buffer(&self.turned),
                },
                push: bytemuck::bytes_of(&push),
                threads: Threads::Indirect(list, 0),
            })?;
        }
        Ok(())
    }
}
