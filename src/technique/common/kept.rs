//! Decides which results of earlier frames are still valid. No other module does.

use crate::gpu::{ImageRef, Recorded};
use crate::inputs::NormalEncoding;
use crate::view::{CameraView, LightView};
use crate::{Frame, Inputs};
use ash::vk;

/// Inputs that a kept result was made from.
pub(crate) trait Source: Copy + PartialEq {
    /// The source within the inputs of a frame. `None` if the caller asks for new results in every frame.
    fn of(inputs: &Inputs<'_>) -> Option<Self>;
}

/// The light, its shadow map, and the casters as it sees them. The version alone does not suffice, because two lights
/// may have the same version number, and may even share a map.
#[derive(Clone, Copy, PartialEq)]
pub(crate) struct OfLight {
    version: u64,
    map: vk::Image,
    view: vk::ImageView,
    light: LightView,
}

impl Source for OfLight {
    fn of(inputs: &Inputs<'_>) -> Option<Self> {
        let map = &inputs.shadow_map;
        inputs.light_version.map(|version| Self { version, map: map.image, view: map.view, light: inputs.light[0] })
    }
}

/// Everything that the light and the camera see.
#[derive(Clone, Copy, PartialEq)]
pub(crate) struct OfFrame {
    light: OfLight,
    version: u64,
    camera: CameraView,
    depth: ImageRef,
    normal: Option<(ImageRef, NormalEncoding)>,
}

impl Source for OfFrame {
    fn of(inputs: &Inputs<'_>) -> Option<Self> {
        let Inputs { camera, depth, normal, .. } = *inputs;
        let (light, version) = (OfLight::of(inputs)?, inputs.camera_version?);
        Some(Self { light, version, camera: *camera, depth, normal })
    }
}

/// Record of a result that is kept from frame to frame. Tells whether the result must be made again.
pub(crate) struct Kept<S = OfLight> {
    source: Option<S>,
    recorded: Recorded,
}

impl<S> Default for Kept<S> {
    fn default() -> Self {
        Self { source: None, recorded: Recorded::default() }
    }
}

impl<S: Source> Kept<S> {
    /// True if the result was made from the same source, and its recording was not forgotten.
    pub fn holds(&self, inputs: &Inputs<'_>) -> bool {
        self.recorded.get() != 0 && self.source.is_some() && self.source == S::of(inputs)
    }

    /// Notes that the result is about to be made from these inputs. The frame forgets this if the recording fails.
    pub fn make(&mut self, frame: &mut Frame<'_>, inputs: &Inputs<'_>) {
        self.source = S::of(inputs);
        frame.note(&self.recorded, 1);
    }
}
