//! What the techniques of the RBSM family share: parameters, and the recording of the one pass.

use super::rbsm_pass::{Rbsm, RbsmConfig, Revectorization};
use super::rbsm_view::RbsmView;
use crate::gpu::Image;
use crate::technique::common::rbsm_receiver::RbsmPush;
use crate::technique::common::view::ViewBuffer;
use crate::technique::{Info, Param, Setup, Technique, visibility_image};
use crate::{Context, Frame, ImageRef, Inputs, Result};

pub(crate) use crate::technique::common::pixels::SKIP;
pub(crate) use crate::technique::common::rbsm_receiver::{DEPTH_BIAS, NORMAL_OFFSET, SLACK, push};

pub(crate) const RECEIVER: Param = Param::choice(
    "receiver",
    &["plane", "fixed"],
    0,
    "texels are tested on the receiver's plane, or all at the fragment's own depth as in the papers",
);
pub(crate) const MAX_DISTANCE: Param =
    Param::int("max_distance", 1, 64, 16, "texels", "longest edge that is followed (MAXDIST)");

/// What of the pass is fixed at its making, from the parameters.
pub(crate) fn config(setup: &Setup, revectorization: Revectorization, listed: bool) -> RbsmConfig {
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
