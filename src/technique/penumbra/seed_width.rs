//! The penumbra width of every shadow-edge seed: a blocker search at these pixels alone.

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
    /// The one whose distance is the smallest share of its penumbra's width: intensities are continuous.
    Weighted,
    /// The one at the smallest distance, as in the paper: seams where widths differ.
    Nearest,
}

/// Measure of the distance to an edge.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Metric {
    /// Along the surface, as in the paper.
    World,
    /// On a plane parallel to the shadow map, taken there along the light's ray, as the width is; longer
    /// along the map's axes than aslant to them, since the light is a square along them.
    Light,
}

/// Settings of penumbrae that are as wide as the area light makes them.
#[derive(Clone, Copy, Debug)]
pub struct WidthConfig {
    /// Taps of the blocker search along each axis: odd, 1 to 63.
    pub search_taps: u32,
    /// Window in which blockers are searched.
    pub window: SearchWindow,
    /// Edge that counts.
    pub meet: Meet,
    /// Measure of its distance.
    pub metric: Metric,
    /// Taps across the penumbra along the line to that edge, for what the hard shadows hold beyond it; 0: nothing, as in the
    /// paper.
    pub line_taps: u32,
}

impl WidthConfig {
    /// Specialization constants of `glsl/penumbra/nearest_edge.glsl`.
    pub(crate) fn constants(config: Option<Self>) -> [Constant; 3] {
        let is = |what: fn(Self) -> bool| config.is_some_and(what).into();
        [
            ("SOFT", is(|_| true)),
            ("MEET_NEAREST", is(|c| c.meet == Meet::Nearest)),
            ("ALONG_LIGHT", is(|c| c.metric == Metric::Light)),
        ]
    }
}

bindings! {
    struct WidthBindings { ..receiver: ReceiverBindings, list, seeds, SeedBits, Marks, widths, hsm }
}

/// The pass with its image: 8 bytes a pixel.
pub struct SeedWidth {
    pipeline: Arc<ComputePipeline>,
    hsm: Option<Hsm>,
    widths: Image,
}

/// What the pass works on: all of [`crate::technique::penumbra::edge_seeds::EdgeSeeds`].
pub(super) struct Seeds<'a> {
    pub pixels: &'a Buffer,
    pub seeds: &'a Image,
    pub bits: &'a Buffer,
    pub marks: &'a Buffer,
}

impl SeedWidth {
    /// Allocates for a camera image and a shadow map.
    ///
    /// # Errors
    /// [`crate::Error::Parameter`] for a number of taps out of range; no memory.
    pub fn new(
        context: &Context,
        extent: [u32; 2],
        map_size: [u32; 2],
        surfaces: SurfaceTest,
        config: WidthConfig,
    ) -> Result<Self> {
        let WidthConfig { search_taps, window, meet, metric, .. } = config;
        let narrow = window == SearchWindow::Blockers;
        let constants = [
            ("PLANES", (surfaces == SurfaceTest::Planes).into()),
            ("SEARCH_TAPS", search_taps),
            ("NEAREST_BLOCKER", narrow.into()),
            ("ALONG_LIGHT", (metric == Metric::Light).into()),
            ("KEEP_CONTACTS", (meet == Meet::Nearest).into()),
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

    /// `R32G32_SFLOAT`, of seeds only: the penumbra's full width in world units, and the cosine between surface and light
    /// that distances may shrink by ([`Metric::Light`]; otherwise 1), at least 0.1.
    pub fn widths(&self) -> &Image {
        &self.widths
    }

    /// Searches at the seeds, takes those without a penumbra out of them ([`Meet::Weighted`]), and marks the tiles in
    /// reach of the others.
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
                seeds: Bind::Image(seeds.seeds),
                SeedBits: Bind::Buffer(seeds.bits),
                Marks: Bind::Buffer(seeds.marks),
                widths: Bind::Image(&self.widths),
                // What the shader does not read, its binding still wants.
                hsm: self.hsm.as_ref().map_or(Bind::Input(&inputs.depth), |h| Bind::Image(h.bounds())),
            },
            push: bytemuck::bytes_of(push),
            threads: Threads::Indirect(seeds.pixels, 0),
        })
    }
}
