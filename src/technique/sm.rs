//! Shadow mapping.

use super::{Info, Kind, Param, Setup, Technique, visibility_image};
use crate::gpu::Image;
use crate::pass::sm::{Sm, SmPush};
use crate::pass::view::ViewBuffer;
use crate::{Context, Frame, ImageRef, Inputs, Result};

/// The offset that every technique moves its receivers by.
pub(super) const NORMAL_OFFSET: Param = Param::float(
    "normal_offset",
    0.0,
    16.0,
    1.0,
    "planes",
    "receiver moved along its normal, in multiples of the part of a texel that a plane of its tilt needs",
);

/// The registry entry.
pub const INFO: Info = Info {
    id: "sm",
    title: "Shadow mapping",
    paper: "Williams 1978",
    summary: "One test a pixel: the fastest, with the map's texels as stairs along every edge.",
    params: &[
        NORMAL_OFFSET,
        Param::float("depth_bias", 0.0, 1.0, 0.0, "light depth", "taken off the receiver's depth on top"),
    ],
    needs: &[],
    kind: Kind::RealTime(prepare),
};

struct ShadowMapping {
    view: ViewBuffer,
    test: Sm,
    push: SmPush,
    map_size: [u32; 2],
    visibility: Image,
}

fn prepare(context: &Context, setup: &Setup) -> Result<Box<dyn Technique>> {
    Ok(Box::new(ShadowMapping {
        view: ViewBuffer::new(context.device())?,
        test: Sm::new(context)?,
        push: SmPush {
            normal_offset: setup.params.float("normal_offset"),
            depth_bias: setup.params.float("depth_bias"),
        },
        map_size: setup.map_size,
        visibility: visibility_image(context.device(), "sm visibility", setup)?,
    }))
}

impl Technique for ShadowMapping {
    fn record(&mut self, frame: &mut Frame<'_>, inputs: &Inputs<'_>) -> Result<ImageRef> {
        let visibility = &self.visibility;
        inputs.check(INFO.id, visibility.extent(), self.map_size)?;
        frame.begin_group(INFO.title);
        let view = self.view.update(frame, inputs);
        self.test.record(frame, view, inputs, self.push, visibility)?;
        frame.end_group();
        Ok(visibility.as_ref())
    }

    fn output(&self) -> &Image {
        &self.visibility
    }

    fn memory_bytes(&self) -> u64 {
        self.visibility.memory_bytes()
    }
}
