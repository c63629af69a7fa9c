//! The separable cross-bilateral filter over an image of hard shadows, as wide as each pixel's penumbra.

use super::penumbra_width::PenumbraWidth;
use crate::gpu::{Buffer, ComputePipeline, Image, ImageDesc, bindings, shader_struct};
use crate::technique::check_odd;
use crate::technique::common::bindings::CameraBindings;
use crate::technique::common::surface::SurfaceTest;
use crate::{Bind, Context, Frame, Inputs, Pass, Result};
use ash::vk;
use std::sync::Arc;

shader_struct! {
    /// Push constants of `glsl/soft/screen_filter.comp`.
    pub struct ScreenFilterPush {
        /// Tolerance of the test for one surface: pixels off the plane per pixel of distance, or a share of the eye depth.
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
    /// All alike, over the penumbra's width.
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
#[derive(Clone, Copy, Debug)]
pub struct ScreenFilterConfig {
    /// Weights of the taps.
    pub kernel: Kernel,
    /// Shape in the image.
    pub footprint: Footprint,
    /// Taps a pass at most: odd, 1 to 63.
    pub taps: u32,
    /// Test that tells surfaces apart.
    pub surfaces: SurfaceTest,
    /// The first pass keeps to the pixel's surface too, not the second alone.
    pub both_bilateral: bool,
}

bindings! {
    struct FilterBindings { ..camera: CameraBindings, source, widths, target, list }
}

/// The two passes and the image between them: 4 bytes a pixel.
pub struct ScreenFilter {
    passes: [Arc<ComputePipeline>; 2],
    between: Image,
}

impl ScreenFilter {
    /// Allocates for a camera image; `listed`: only pixels that [`PenumbraWidth`] has listed are filtered.
    ///
    /// # Errors
    /// [`crate::Error::Parameter`] for a number of taps out of range.
    pub fn new(context: &Context, extent: [u32; 2], config: ScreenFilterConfig, listed: bool) -> Result<Self> {
        let ScreenFilterConfig { kernel, footprint, taps, surfaces, both_bilateral } = config;
        check_odd("taps of the filter", taps, 63)?;
        let pass = |second: bool| {
            let constants = [
                ("PLANES", (surfaces == SurfaceTest::Planes).into()),
                ("SECOND", second.into()),
                ("TAPS", taps),
                ("GAUSSIAN", (kernel == Kernel::Gaussian).into()),
                ("FOOTPRINT", footprint as u32),
                ("BILATERAL", (second || both_bilateral).into()),
                ("LISTED", listed.into()),
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

    /// What the first pass writes; [`PenumbraWidth::record`] fills it where that does not work.
    pub fn between(&self) -> &Image {
        &self.between
    }

    /// Filters `visibility`, the hard shadows, where there is a penumbra.
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
