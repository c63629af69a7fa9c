//! Decides which results of earlier frames are still valid. No other module does.

use crate::gpu::Recorded;
use crate::view::LightView;
use crate::{Frame, Inputs};
use ash::vk;

/// Inputs that a kept result was made from. The version alone does not suffice, because two lights may have the same
/// version number, and may even share a map.
#[derive(Clone, Copy, PartialEq)]
struct Source {
    version: u64,
    map: vk::Image,
    view: vk::ImageView,
    light: LightView,
}

impl Source {
    fn of(inputs: &Inputs<'_>) -> Option<Self> {
        let map = &inputs.shadow_map;
        inputs.light_version.map(|version| Self { version, map: map.image, view: map.view, light: inputs.light[0] })
    }
}

/// Record of a result that depends on the shadow map, or on the casters as the light sees them. Tells whether the
/// result must be made again.
#[derive(Default)]
pub(crate) struct Kept {
    source: Option<Source>,
    recorded: Recorded,
}

impl Kept {
    /// True if the result was made from the same version of the same light and map, and its recording was not
    /// forgotten.
    pub fn holds(&self, inputs: &Inputs<'_>) -> bool {
        self.recorded.get() != 0 && self.source.is_some() && self.source == Source::of(inputs)
    }

    /// Notes that the result is about to be made from these inputs. The frame forgets this if the recording fails.
    pub fn make(&mut self, frame: &mut Frame<'_>, inputs: &Inputs<'_>) {
        self.source = Source::of(inputs);
        frame.note(&self.recorded, 1);
    }
}
