//! The one place that decides which results of earlier frames still hold.

use crate::gpu::Recorded;
use crate::view::LightView;
use crate::{Frame, Inputs};
use ash::vk;

/// Source of a kept result. Two lights may count their versions alike, and share a map or not.
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

/// Decides whether a result that depends on the shadow map, or on the casters as the light sees them, has to be made again.
#[derive(Default)]
pub(crate) struct Kept {
    source: Option<Source>,
    recorded: Recorded,
}

impl Kept {
    /// True if the result was made from the same light and map in the same version, and is not known to be lost.
    pub fn holds(&self, inputs: &Inputs<'_>) -> bool {
        self.recorded.get() != 0 && self.source.is_some() && self.source == Source::of(inputs)
    }

    /// Notes that the result is about to be made from these inputs. Where the recording fails, the frame forgets it.
    pub fn make(&mut self, frame: &mut Frame<'_>, inputs: &Inputs<'_>) {
        self.source = Source::of(inputs);
        frame.note(&self.recorded, 1);
    }
}
