//! The penumbra width of every shadow-edge seed, by a blocker search at these pixels alone.

use super::shared::{PenumbraPush, scratch};
use crate::gpu::{Buffer, ComputePipeline, Constant, Image, bindings};
use crate::technique::common::bindings::ReceiverBindings;
use crate::technique::common::blocker_search::SearchWindow;
use crate::technique::common::hsm::Hsm;
use crate::technique::common::surface::SurfaceTest;
use crate::{Bind, Context, Frame, Inputs, Pass, Result, Threads};
use ash::vk;
use std::sync::Arc;

/// Edge that counts where the penumbrae of several overlap.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Meet {
    /// The edge whose distance is the smallest share of its penumbra's width: intensities are continuous.
    Weighted,
    /// The edge at the smallest distance, as in the paper: intensities jump where widths differ.
    Nearest,
}

/// Measure of the distance to an edge.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Metric {
    /// Distance along the surface, as in the paper.
    World,
    /// Distance on a plane parallel to the shadow map, projected onto it along the light's ray, like the width. The light is a square
    /// along the map's axes, so distances along the axes count as longer than oblique ones.
    Light,
}

/// Settings of penumbrae that are as wide as the area light makes them.
#[derive(Clone, Copy)]
pub(super) struct WidthConfig {
    /// Taps of the blocker search along each axis.
    pub search_taps: u32,
    /// Window in which blockers are searched.
    pub window: SearchWindow,
    /// Edge that counts where penumbrae overlap.
    pub meet: Meet,
    /// Measure of the distance to it.
    pub metric: Metric,
    /// Taps across the penumbra along the line to that edge, which find the hard shadows beyond it; 0: these are ignored, as in
    /// the paper.
    pub line_taps: u32,
    /// Stored depths are averaged instead of distances.
    pub mean_depth: bool,
    /// All texels of the search are compared with the receiver's own depth instead of its plane.
    pub fixed_depth: bool,
    /// The mean filter has one width in the world, instead of a share of each penumbra's.
    pub filter_in_world: bool,
}

impl WidthConfig {
    /// Returns the specialization constants of `glsl/penumbra/nearest_edge.glsl`.
    pub fn constants(config: Option<Self>) -> [Constant; 4] {
        let is = |what: fn(Self) -> bool| config.is_some_and(what).into();
        [
            ("SOFT", is(|_| true)),
            ("MEET_NEAREST", is(|c| c.meet == Meet::Nearest)),
            ("ALONG_LIGHT", is(|c| c.metric == Metric::Light)),
            ("FILTER_IN_WORLD", is(|c| c.filter_in_world)),
        ]
    }
}

bindings! {
    struct WidthBindings { ..receiver: ReceiverBindings, list, Seeds, SeedBits, Marks, widths, hsm, Coarse }
}

/// The pass with its image: 8 bytes a pixel.
pub(super) struct SeedWidth {
    pipeline: Arc<ComputePipeline>,
    hsm: Option<Hsm>,
    widths: Image,
}

/// Lists and images of [`super::edge_seeds::EdgeSeeds`] that the pass works on.
pub(super) struct Seeds<'a> {
    pub pixels: &'a Buffer,
    pub seeds: &'a Buffer,
    pub bits: &'a Buffer,
    pub marks: &'a Buffer,
    pub coarse: &'a Buffer,
}

impl SeedWidth {
    /// Allocates for a camera image and a shadow map.
    pub fn new(
        context: &Context,
        extent: [u32; 2],
        map_size: [u32; 2],
        surfaces: SurfaceTest,
        config: WidthConfig,
    ) -> Result<Self> {
        let WidthConfig { search_taps, window, meet, metric, mean_depth, fixed_depth, filter_in_world, .. } = config;
        let narrow = window == SearchWindow::Blockers;
        let constants = [
            ("PLANES", (surfaces == SurfaceTest::Planes).into()),
            ("SEARCH_TAPS", search_taps),
            ("NEAREST_BLOCKER", narrow.into()),
            ("ALONG_LIGHT", (metric == Metric::Light).into()),
            ("KEEP_CONTACTS", (meet == Meet::Nearest).into()),
            ("FILTER_IN_WORLD", filter_in_world.into()),
            ("FIXED", fixed_depth.into()),
            ("MEAN_DEPTH", mean_depth.into()),
        ];
        Ok(Self {
            pipeline: context.pipeline::<WidthBindings, PenumbraPush>("penumbra/seed_width.comp", &constants)?,
            hsm: if narrow { Some(Hsm::new(context, map_size)?) } else { None },
            widths: scratch(context, "penumbra widths at seeds", vk::Format::R32G32_SFLOAT, extent, true)?,
        })
    }

    /// Bytes of images.
    pub fn memory_bytes(&self) -> u64 {
        self.widths.memory_bytes() + self.hsm.as_ref().map_or(0, |h| h.bounds().memory_bytes())
    }

    /// Returns the image of widths, `R32G32_SFLOAT`, written at seeds only: the penumbra's full width in world units, and the
    /// cosine between surface and light that distances may shrink by ([`Metric::Light`]; otherwise 1), at least 0.1.
    pub fn widths(&self) -> &Image {
        &self.widths
    }

    /// Searches for blockers at the seeds, removes seeds without a penumbra ([`Meet::Weighted`]), and marks the tiles in reach
    /// of the others.
    pub(super) fn record(
        &mut self,
        frame: &mut Frame<'_>,
        view: &Buffer,
        inputs: &Inputs<'_>,
        push: &PenumbraPush,
        seeds: &Seeds<'_>,
    ) -> Result<()> {
        if let Some(hsm) = &mut self.hsm {
            hsm.record(frame, inputs)?;
        }
        frame.dispatch(&Pass {
            name: "penumbra widths",
            pipeline: &self.pipeline,
            bind: &WidthBindings {
                receiver: ReceiverBindings::borderless(view, inputs),
                list: Bind::Buffer(seeds.pixels),
                Seeds: Bind::Buffer(seeds.seeds),
                SeedBits: Bind::Buffer(seeds.bits),
                Marks: Bind::Buffer(seeds.marks),
                widths: Bind::Image(&self.widths),
                // Without a pyramid the shader's binding still needs an image, which it does not read.
                hsm: self.hsm.as_ref().map_or(Bind::Input(&inputs.depth), |h| Bind::Image(h.bounds())),
                Coarse: Bind::Buffer(seeds.coarse),
            },
            push: bytemuck::bytes_of(push),
            threads: Threads::Indirect(seeds.pixels, 0),
        })
    }
}
