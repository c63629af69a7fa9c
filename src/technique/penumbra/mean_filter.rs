//! The separable mean filter over a penumbra. Its width is constant in the world, or a share of the penumbra's.

use super::edge_seeds::{EdgeConfig, EdgeSeeds};
use super::nearest_edge::NearestEdge;
use super::shared::{PenumbraPush, scratch};
use crate::gpu::{Buffer, ComputePipeline, Image, bindings};
use crate::technique::common::bindings::CameraBindings;
use crate::technique::common::surface::SurfaceTest;
use crate::{Bind, Context, Frame, Inputs, Pass, Result};
use ash::vk;
use std::sync::Arc;

bindings! {
    struct FilterBindings { ..camera: CameraBindings, source, target, list, pixel_widths }
}

/// The two passes and the image between them.
pub struct MeanFilter {
    passes: [Arc<ComputePipeline>; 2],
    between: Image,
}

impl MeanFilter {
    /// Allocates for a camera image; `taps` is the number of taps of a pass.
    pub fn new(context: &Context, extent: [u32; 2], config: EdgeConfig, taps: u32) -> Result<Self> {
        let pass = |vertical: bool| {
            let planes = config.surfaces == SurfaceTest::Planes;
            let constants = [
                ("PLANES", planes.into()),
                ("VERTICAL", vertical.into()),
                ("TAPS", taps),
                ("SOFT", config.widths.is_some_and(|w| !w.filter_in_world).into()),
            ];
            context.pipeline::<FilterBindings, PenumbraPush>("penumbra/mean_filter.comp", &constants)
        };
        Ok(Self {
            passes: [pass(false)?, pass(true)?],
            between: scratch(context, "penumbra filtered along x", vk::Format::R32G32_SFLOAT, extent, true)?,
        })
    }

    /// Bytes of images.
    pub fn memory_bytes(&self) -> u64 {
        self.between.memory_bytes()
    }

    /// Filters the pixels within reach of an edge, as `seeds` and `nearest` found them, into `output`, which holds the hard
    /// shadows of all pixels.
    pub fn record(
        &self,
        frame: &mut Frame<'_>,
        view: &Buffer,
        inputs: &Inputs<'_>,
        push: PenumbraPush,
        (seeds, nearest): (&EdgeSeeds, &NearestEdge),
        output: &Image,
    ) -> Result<()> {
        // A tap along y may fall into a tile near an edge but without a penumbra. The pass along x therefore works on all
        // tiles near an edge, and copies such pixels; no tap leaves these tiles.
        let steps = [
            ("mean filter, x", nearest.intensity(), &self.between, seeds.tiles()),
            ("mean filter, y", &self.between, output, nearest.tiles().unwrap_or(seeds.tiles())),
        ];
        for (pipeline, (name, source, target, tiles)) in self.passes.iter().zip(steps) {
            frame.dispatch(&Pass {
                name,
                pipeline,
                bind: &FilterBindings {
                    camera: CameraBindings::new(view, inputs),
                    source: Bind::Image(source),
                    target: Bind::Image(target),
                    list: Bind::Buffer(tiles.buffer()),
                    pixel_widths: Bind::Image(nearest.pixel_widths()),
                },
                push: bytemuck::bytes_of(&push),
                threads: tiles.threads(),
            })?;
            tiles.count(frame);
        }
        Ok(())
    }
}
