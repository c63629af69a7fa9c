//! Shared part of the techniques that filter hard shadows in the image, as wide as an area light's penumbrae: hard shadows,
//! width of the penumbra by a blocker search in the shadow map, separable cross-bilateral filter.

use super::classified::{SKIP_CHOICES, Skip};
use super::penumbra_width::{PenumbraWidth, WidthConfig, WidthPush};
use super::screen_filter::{Footprint, Kernel, ScreenFilter, ScreenFilterConfig, ScreenFilterPush};
use crate::gpu::{Buffer, Image};
use crate::technique::common::blocker_search;
use crate::technique::common::rbsm_receiver::RbsmPush;
use crate::technique::common::receiver::{self, ReceiverPush};
use crate::technique::common::surface::surface_test;
use crate::technique::filtering::sm::Sm;
use crate::technique::revectorization::rbsm_pass::{Rbsm, RbsmOfList, Revectorization};
use crate::technique::revectorization::revectorized;
use crate::technique::{Param, Passes, Setup, visibility_image};
use crate::view::LightKind;
use crate::{Context, Frame, Inputs, Result};

pub(super) const SEARCH_TAPS: Param =
    Param::odd("search_taps", 1, 63, 9, "taps", "taps of the blocker search along each axis; 23 in the papers");
pub(super) const NARROW: Param = Param::choice(
    "narrow",
    &["taps", "box"],
    1,
    "search windows of no more texels than taps: taps all the same, or the exact mean of the texels",
);
pub(super) const SEARCH_BIAS: Param = Param::float(
    "search_bias",
    0.0,
    16.0,
    0.5,
    "texel slopes",
    "taken off the receiver's depth in the blocker search, in slopes of its plane a texel",
);
pub(super) const FILTER_TAPS: Param =
    Param::odd("filter_taps", 1, 63, 23, "taps", "most taps of each of the filter's two passes");
const FOOTPRINTS: &[&str] = &["screen", "plane", "light"];
const FOOTPRINT_HELP: &str = "what the filter covers: as wide as if the receiver faced the camera, a square in the receiver's plane, or the light's square as it falls on that plane";

/// Returns the parameter; `default` is an index.
pub(super) const fn footprint(default: usize) -> Param {
    Param::choice("footprint", FOOTPRINTS, default, FOOTPRINT_HELP)
}

pub(super) const BILATERAL: Param = Param::choice(
    "bilateral",
    &["both", "second"],
    0,
    "passes of the filter that keep to the pixel's own surface; in the paper the second alone",
);
pub(super) const SURFACES: Param = Param::choice(
    "surfaces",
    &["plane", "depth", "gaussian"],
    0,
    "taps count if near the pixel's plane, or if their eye depths are alike, or by a Gaussian of the depths' difference as in the paper's bilateral filter",
);
pub(super) const SKIP: Param = Param::choice(
    "skip",
    SKIP_CHOICES,
    0,
    "work on all pixels (off), or list and work on those that can lie in a penumbra by depth bounds of the map, found from tiles and then 2 x 2 pixels (quads) or \
     in the search itself (tiles); auto takes tiles on a CPU, quads on a GPU; the image is the same",
);

/// Hard shadows to filter: a pass over all pixels, one over listed pixels, and their constants.
pub(super) enum Hard {
    /// Revectorized visibility.
    Revectorized(Box<Rbsm>, RbsmOfList, RbsmPush),
    /// One test a pixel.
    Test(Box<Sm>, Box<Sm>, ReceiverPush),
}

impl Hard {
    /// Makes the passes of revectorized visibility from a technique's parameters.
    pub(super) fn revectorized(context: &Context, setup: &Setup, function: Revectorization) -> Result<Self> {
        let config = revectorized::config(setup, function);
        let all = Box::new(Rbsm::new(context, setup.extent, setup.map_size, config)?);
        Ok(Self::Revectorized(all, RbsmOfList::new(context, config)?, revectorized::push(setup)))
    }

    /// Makes the passes of plain tests from a technique's parameters.
    pub(super) fn test(context: &Context, setup: &Setup) -> Result<Self> {
        Ok(Self::Test(Box::new(Sm::new(context)?), Box::new(Sm::of_list(context)?), receiver::push(setup)))
    }

    /// Records the shadows of every pixel.
    fn record(&mut self, frame: &mut Frame<'_>, view: &Buffer, inputs: &Inputs<'_>, output: &Image) -> Result<()> {
        match self {
            Self::Revectorized(all, _, push) => all.record(frame, view, inputs, *push, output),
            Self::Test(all, _, push) => all.record(frame, view, inputs, *push, output),
        }
    }

    /// Records the shadows of the pixels that can lie in a penumbra.
    fn record_list(
        &self,
        frame: &mut Frame<'_>,
        view: &Buffer,
        inputs: &Inputs<'_>,
        width: &PenumbraWidth,
        output: &Image,
    ) -> Result<()> {
        let list = (width.list(), width.threads());
        match self {
            Self::Revectorized(_, listed, push) => listed.record(frame, view, inputs, *push, list, output),
            Self::Test(_, listed, push) => listed.record_list(frame, view, inputs, *push, list, output),
        }
    }

    fn memory_bytes(&self) -> u64 {
        match self {
            Self::Revectorized(all, ..) => all.memory_bytes(),
            Self::Test(..) => 0,
        }
    }
}

struct ScreenSpace {
    hard: Hard,
    width: PenumbraWidth,
    filter: ScreenFilter,
    search: WidthPush,
    push: ScreenFilterPush,
    /// Hard shadows, for viewing.
    hard_view: Option<Image>,
}

/// Makes a technique over the given hard shadows; `sigma` is the Gaussian's standard deviation, penumbra widths.
pub(super) fn prepare(
    context: &Context,
    setup: &Setup,
    hard: Hard,
    (kernel, sigma): (Kernel, f32),
) -> Result<Box<dyn Passes>> {
    let p = &setup.params;
    let (surfaces, tolerance) = surface_test(p);
    let width = WidthConfig {
        search_taps: p.int("search_taps"),
        window: blocker_search::search_window(p),
        exact_box: p.word("narrow") == "box",
        mean_depth: blocker_search::averages_depths(p),
        fixed_depth: receiver::is_fixed(p),
        skip: Skip::of(context, setup),
    };
    let filter = ScreenFilterConfig {
        kernel,
        footprint: match p.word("footprint") {
            "screen" => Footprint::Screen,
            "plane" => Footprint::Plane,
            _ => Footprint::Light,
        },
        taps: p.int("filter_taps"),
        surfaces,
        smooth_range: p.word("surfaces") == "gaussian",
        both_bilateral: p.word("bilateral") == "both",
    };
    let width = PenumbraWidth::new(context, setup.extent, setup.map_size, width)?;
    Ok(Box::new(ScreenSpace {
        hard,
        filter: ScreenFilter::new(context, setup.extent, filter, width.is_listed())?,
        width,
        search: WidthPush {
            normal_offset: p.float("normal_offset"),
            depth_bias: p.float("search_bias"),
            reach: kernel.reach(sigma),
        },
        push: ScreenFilterPush { tolerance, sigma },
        hard_view: match setup.intermediates {
            true => Some(visibility_image(context.device(), "hard shadows", setup)?),
            false => None,
        },
    }))
}

impl Passes for ScreenSpace {
    fn record(&mut self, frame: &mut Frame<'_>, view: &Buffer, inputs: &Inputs<'_>, visibility: &Image) -> Result<()> {
        if let Some(image) = &self.hard_view {
            frame.mark_passes(", shown");
            self.hard.record(frame, view, inputs, image)?;
            frame.mark_passes("");
        }
        let has_size = match inputs.light[0].kind {
            LightKind::Spot { size } => size > 0.0,
            LightKind::Directional { angle } => angle > 0.0,
        };
        let listed = has_size && self.width.is_listed();
        if self.hard_view.is_some() && (listed || !has_size) {
            self.width.clear(frame);
        }
        let images = (visibility, self.filter.between());
        if has_size {
            self.width.record_classes(frame, view, inputs, self.search, images)?;
        }
        if listed {
            self.hard.record_list(frame, view, inputs, &self.width, visibility)?;
        } else {
            self.hard.record(frame, view, inputs, visibility)?;
        }
        if has_size {
            self.width.record(frame, view, inputs, self.search, images)?;
            self.filter.record(frame, view, inputs, self.push, (&self.width, visibility))?;
        }
        Ok(())
    }

    fn intermediates(&self) -> Vec<(&'static str, &Image)> {
        let Some(hard) = &self.hard_view else { return vec![] };
        vec![("hard", hard), ("width", self.width.widths())]
    }

    fn memory_bytes(&self) -> u64 {
        let images = self.hard_view.as_ref().map_or(0, Image::memory_bytes);
        images + self.hard.memory_bytes() + self.width.memory_bytes() + self.filter.memory_bytes()
    }
}
