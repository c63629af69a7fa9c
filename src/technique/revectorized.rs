//! What the techniques of the RBSM family share: parameters, and the recording of the one pass.

use super::{Info, Param, Setup, Technique, sm, visibility_image};
use crate::gpu::Image;
use crate::pass::rbsm::{Rbsm, RbsmConfig, RbsmPush, Revectorization};
use crate::pass::rbsm_view::RbsmView;
use crate::pass::view::ViewBuffer;
use crate::{Context, Frame, ImageRef, Inputs, Result};

pub(super) const RECEIVER: Param = Param::choice(
    "receiver",
    &["plane", "fixed"],
    0,
    "texels are tested on the receiver's plane, or all at the fragment's own depth as in the papers",
);
pub(super) const MAX_DISTANCE: Param =
    Param::int("max_distance", 1, 64, 16, "texels", "longest edge that is followed (MAXDIST)");
pub(super) const NORMAL_OFFSET: Param = Param { default: 0.1, ..sm::NORMAL_OFFSET };
pub(super) const DEPTH_BIAS: Param = Param::float(
    "depth_bias",
    0.0,
    16.0,
    0.3,
    "texel slopes",
    "taken off the receiver's depth on top, in slopes of its plane a texel",
);
pub(super) const SLACK: Param = Param::float(
    "slack",
    0.0,
    4.0,
    0.2,
    "texels a texel",
    "how far a curved receiver may lie before its plane, a texel of distance",
);
pub(super) const SKIP: Param = Param::choice(
    "skip",
    &["auto", "off", "list"],
    0,
    "pixels at an edge are worked on where they are found, or listed (auto) and worked on by a dispatch of their own: the same image",
);

/// The constants of a frame from the parameters.
pub(super) fn push(setup: &Setup) -> RbsmPush {
    let p = &setup.params;
    RbsmPush { normal_offset: p.float("normal_offset"), depth_bias: p.float("depth_bias"), slack: p.float("slack") }
}

/// What of the pass is fixed at its making, from the parameters.
pub(super) fn config(setup: &Setup, revectorization: Revectorization, listed: bool) -> RbsmConfig {
    let p = &setup.params;
    let fixed_depth = p.word("receiver") == "fixed";
    RbsmConfig { revectorization, fixed_depth, max_distance: p.int("max_distance"), listed }
}

struct Revectorized {
    info: &'static Info,
    view: ViewBuffer,
    rbsm: Rbsm,
    intermediates: Option<RbsmView>,
    push: RbsmPush,
    map_size: [u32; 2],
    visibility: Image,
}

/// Makes a technique that is the one pass.
pub(super) fn prepare(
    context: &Context,
    setup: &Setup,
    info: &'static Info,
    revectorization: Revectorization,
) -> Result<Box<dyn Technique>> {
    let config = config(setup, revectorization, setup.params.word("skip") != "off");
    Ok(Box::new(Revectorized {
        info,
        view: ViewBuffer::new(context.device())?,
        rbsm: Rbsm::new(context, setup.extent, config)?,
        intermediates: match setup.intermediates {
            true => Some(RbsmView::new(context, setup.extent, config)?),
            false => None,
        },
        push: push(setup),
        map_size: setup.map_size,
        visibility: visibility_image(context.device(), "revectorized visibility", setup)?,
    }))
}

impl Technique for Revectorized {
    fn record(&mut self, frame: &mut Frame<'_>, inputs: &Inputs<'_>) -> Result<ImageRef> {
        let visibility = &self.visibility;
        inputs.check(self.info.id, visibility.extent(), self.map_size)?;
        frame.begin_group(self.info.title);
        let view = self.view.update(frame, inputs);
        self.rbsm.record(frame, view, inputs, self.push, visibility)?;
        if let Some(pass) = &self.intermediates {
            pass.record(frame, view, inputs, self.push)?;
        }
        frame.end_group();
        Ok(visibility.as_ref())
    }

    fn output(&self) -> &Image {
        &self.visibility
    }

    fn intermediates(&self) -> Vec<(&'static str, &Image)> {
        self.intermediates.as_ref().map(RbsmView::images).unwrap_or_default()
    }

    fn memory_bytes(&self) -> u64 {
        let intermediates = self.intermediates.as_ref().map_or(0, RbsmView::memory_bytes);
        self.visibility.memory_bytes() + self.rbsm.memory_bytes() + intermediates
    }
}
