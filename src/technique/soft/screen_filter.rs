//! The separable cross-bilateral filter over an image of hard shadows, as wide as each pixel's penumbra.

use super::penumbra_width::PenumbraWidth;
use crate::gpu::{Buffer, ComputePipeline, Image, ImageDesc, bindings, shader_struct};
use crate::technique::common::bindings::CameraBindings;
use crate::technique::common::surface::SurfaceTest;
use crate::{Bind, Context, Frame, Inputs, Pass, Result};
use ash::vk;
use std::sync::Arc;

shader_struct! {
    /// Push constants of `glsl/soft/screen_filter.comp`.
    pub(super) struct ScreenFilterPush {
        /// Tolerance of the test for one surface: pixels off the plane per pixel of distance, or a share of the eye depth;
        /// with a smooth range the Gaussian's standard deviation, a share of the eye depth.
        tolerance: f32,
        /// Standard deviation of the Gaussian, penumbra widths.
        sigma: f32,
    }
}

/// End of the Gaussian in standard deviations, as in the shader.
const GAUSSIAN_REACH: f32 = 3.0;

/// Weights of the taps.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Kernel {
    /// Equal weights over the penumbra's width.
    Box,
    /// A Gaussian, cut off at three standard deviations.
    Gaussian,
}

impl Kernel {
    /// Returns its reach in penumbra half-widths, at least one; `sigma` is the Gaussian's standard deviation in widths.
    pub fn reach(self, sigma: f32) -> f32 {
        match self {
            Self::Box => 1.0,
            Self::Gaussian => (2.0 * GAUSSIAN_REACH * sigma).max(1.0),
        }
    }
}

/// Area that the filter covers in the image (`glsl/lib/footprint.glsl`).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Footprint {
    /// The area of a receiver that faces the camera.
    Screen,
    /// A square in the receiver's plane.
    Plane,
    /// The light's square as it falls onto the receiver's plane.
    Light,
}

/// Settings that are fixed when the passes are made.
#[derive(Clone, Copy)]
pub(super) struct ScreenFilterConfig {
    /// Weights of the taps.
    pub kernel: Kernel,
    /// Shape in the image.
    pub footprint: Footprint,
    /// Largest number of taps of a pass.
    pub taps: u32,
    /// Test that tells surfaces apart.
    pub surfaces: SurfaceTest,
    /// Taps weigh by a Gaussian of their difference in eye depth instead of that test.
    pub smooth_range: bool,
    /// Both passes keep to the pixel's surface; otherwise the second alone does.
    pub both_bilateral: bool,
}

bindings! {
    struct FilterBindings { ..camera: CameraBindings, source, widths, target, list }
}

/// The two passes and the image between them: 4 bytes a pixel.
pub(super) struct ScreenFilter {
    passes: [Arc<ComputePipeline>; 2],
    between: Image,
}

impl ScreenFilter {
    /// Allocates for a camera image; `listed`: only the pixels that [`PenumbraWidth`] lists are filtered.
    pub fn new(context: &Context, extent: [u32; 2], config: ScreenFilterConfig, listed: bool) -> Result<Self> {
        let ScreenFilterConfig { kernel, footprint, taps, surfaces, smooth_range, both_bilateral } = config;
        let pass = |second: bool| {
            let constants = [
                ("PLANES", (surfaces == SurfaceTest::Planes).into()),
                ("SECOND", second.into()),
                ("TAPS", taps),
                ("GAUSSIAN", (kernel == Kernel::Gaussian).into()),
                ("FOOTPRINT", footprint as u32),
                ("BILATERAL", (second || both_bilateral).into()),
                ("LISTED", listed.into()),
                ("SMOOTH_RANGE", smooth_range.into()),
            ];
            context.pipeline::<FilterBindings, ScreenFilterPush>("soft/screen_filter.comp", &constants)
        };
        let desc = ImageDesc::storage("shadows filtered along one side", vk::Format::R32_SFLOAT, extent);
        Ok(Self { passes: [pass(false)?, pass(true)?], between: Image::new(context.device(), &desc)? })
    }

    /// Bytes of images.
    pub fn memory_bytes(&self) -> u64 {
        self.between.memory_bytes()
    }

    /// Returns the image between the passes. [`PenumbraWidth::record`] fills the pixels that the first pass does not write.
    pub fn between(&self) -> &Image {
        &self.between
    }

    /// Filters `visibility`, which holds hard shadows, where there is a penumbra.
    pub fn record(
        &self,
        frame: &mut Frame<'_>,
        view: &Buffer,
        inputs: &Inputs<'_>,
        push: ScreenFilterPush,
        (widths, visibility): (&PenumbraWidth, &Image),
    ) -> Result<()> {
        let steps = [
            ("penumbra filter, first side", visibility, &self.between),
            ("penumbra filter, second side", &self.between, visibility),
        ];
        for (pipeline, (name, source, target)) in self.passes.iter().zip(steps) {
            frame.dispatch(&Pass {
                name,
                pipeline,
                bind: &FilterBindings {
                    camera: CameraBindings::new(view, inputs),
                    source: Bind::Image(source),
                    widths: Bind::Image(widths.widths()),
                    target: Bind::Image(target),
                    list: widths.list(),
                },
                push: bytemuck::bytes_of(&push),
                threads: widths.threads(),
            })?;
        }
        Ok(())
    }
}
