//! Parts that the techniques of the RBSM family share: parameters, and the recording of their only pass.

use super::rbsm_pass::{Rbsm, RbsmConfig, Revectorization};
use super::rbsm_view::RbsmView;
use crate::gpu::{Buffer, Image};
use crate::technique::common::rbsm_receiver::RbsmPush;
use crate::technique::{Param, Passes, Setup};
use crate::{Context, Frame, Inputs, Result};

pub(crate) use crate::technique::common::rbsm_receiver::{DEPTH_BIAS, NORMAL_OFFSET, SLACK, push};
pub(crate) use crate::technique::common::receiver::RECEIVER;

/// The shaders' loops and signed distances hold for this range only.
pub(crate) const MAX_DISTANCE: Param =
    Param::int("max_distance", 1, 64, 16, "texels", "longest edge that is followed (MAXDIST)");

pub(super) const SKIP: Param = Param::choice(
    "skip",
    &["auto", "off", "list", "tiles"],
    0,
    "list pixels at an edge for a dispatch of their own (auto, list), or work on them at once (off); tiles is list, but decides \
     whole tiles by depth bounds of the map's blocks first, which costs less where few tiles have an edge; the image is the same",
);

/// Takes the settings that are fixed when the pass is made from the parameters; with neither list nor tiles.
pub(crate) fn config(setup: &Setup, revectorization: Revectorization) -> RbsmConfig {
    let p = &setup.params;
    RbsmConfig {
        revectorization,
        filter_width: 0.0,
        fixed_depth: p.word("receiver") == "fixed",
        max_distance: p.int("max_distance"),
        listed: false,
        by_tiles: false,
    }
}

struct Revectorized {
    rbsm: Rbsm,
    intermediates: Option<RbsmView>,
    push: RbsmPush,
}

/// Makes a technique that consists of this pass.
pub(super) fn prepare(context: &Context, setup: &Setup, revectorization: Revectorization) -> Result<Box<dyn Passes>> {
    prepare_filtered(context, setup, revectorization, 0.0)
}

/// The same with [`RbsmConfig::filter_width`].
pub(super) fn prepare_filtered(
    context: &Context,
    setup: &Setup,
    revectorization: Revectorization,
    filter_width: f32,
) -> Result<Box<dyn Passes>> {
    let skip = setup.params.word("skip");
    let config =
        RbsmConfig { filter_width, listed: skip != "off", by_tiles: skip == "tiles", ..config(setup, revectorization) };
    Ok(Box::new(Revectorized {
        rbsm: Rbsm::new(context, setup.extent, setup.map_size, config)?,
        intermediates: match setup.intermediates {
            true => Some(RbsmView::new(context, setup.extent, config)?),
            false => None,
        },
        push: push(setup),
    }))
}

impl Passes for Revectorized {
    fn record(&mut self, frame: &mut Frame<'_>, view: &Buffer, inputs: &Inputs<'_>, visibility: &Image) -> Result<()> {
        self.rbsm.record(frame, view, inputs, self.push, visibility)?;
        if let Some(pass) = &self.intermediates {
            pass.record(frame, view, inputs, self.push)?;
        }
        Ok(())
    }

    fn intermediates(&self) -> Vec<(&'static str, &Image)> {
        self.intermediates.as_ref().map(RbsmView::images).unwrap_or_default()
    }

    fn memory_bytes(&self) -> u64 {
        let intermediates = self.intermediates.as_ref().map_or(0, RbsmView::memory_bytes);
        self.rbsm.memory_bytes() + intermediates
    }
}
