//! Revectorization-based soft shadow mapping.

use super::revectorized::{DEPTH_BIAS, MAX_DISTANCE, NORMAL_OFFSET};
use super::{Info, Kind, Param, Params, Setup, Technique, classes_view, soft, visibility_image};
use crate::gpu::Image;
use crate::pass::rbsm::RbsmPush;
use crate::pass::rbssm::{Rbssm, RbssmConfig, RbssmVisibility};
use crate::pass::view::ViewBuffer;
use crate::{Context, Frame, ImageRef, Inputs, Result};

/// The registry entry.
pub const INFO: Info = Info {
    id: "rbssm",
    title: "Revectorization-based soft shadow mapping",
    paper: "Macedo, Apolinário, Agüero 2019, algorithms 2 and 3",
    summary: "Percentage-closer soft shadows whose filter averages revectorized visibility: narrow penumbrae without the map's stairs.",
    params: &[
        soft::SEARCH_TAPS,
        FILTER_TAPS,
        soft::SEARCH,
        VISIBILITY,
        LEAST_WIDTH,
        MAX_DISTANCE,
        NORMAL_OFFSET,
        DEPTH_BIAS,
        Param::choice(
            "reuse",
            &["auto", "off"],
            0,
            "find the ends of an edge once for all taps that lie on it, or for each tap: the same image",
        ),
        soft::SKIP,
    ],
    needs: &[],
    kind: Kind::RealTime(|context, setup| {
        let p = &setup.params;
        prepare(context, setup, &INFO, p.word("reuse") == "auto", p.word("skip") == "auto")
    }),
};

pub(super) const FILTER_TAPS: Param =
    Param::odd("filter_taps", 1, 63, 11, "taps", "taps of the filter along each axis, each a place in the map");
pub(super) const VISIBILITY: Param = Param::choice(
    "visibility",
    &["recovery", "improved"],
    1,
    "what is averaged: silhouette recovery (listing 4) as in the paper, or RBSM*, which does not grow the shadow",
);
pub(super) const LEAST_WIDTH: Param = Param::float(
    "least_width",
    0.0,
    8.0,
    1.0,
    "texels",
    "the filter is never narrower, unless the light is so small that it has no such penumbra at all: size 0 keeps hard edges",
);

/// What [`VISIBILITY`] says.
pub(super) fn visibility(params: &Params) -> RbssmVisibility {
    match params.word("visibility") {
        "recovery" => RbssmVisibility::Recovery,
        _ => RbssmVisibility::Improved,
    }
}

struct SoftShadows {
    info: &'static Info,
    view: ViewBuffer,
    rbssm: Rbssm,
    push: RbsmPush,
    map_size: [u32; 2],
    visibility: Image,
    /// To be looked at.
    classes_view: Option<Image>,
}

/// Makes the technique with or without its two accelerations.
pub(super) fn prepare(
    context: &Context,
    setup: &Setup,
    info: &'static Info,
    reuse: bool,
    listed: bool,
) -> Result<Box<dyn Technique>> {
    let p = &setup.params;
    let config = RbssmConfig {
        search_taps: p.int("search_taps"),
        filter_taps: p.int("filter_taps"),
        window: soft::search_window(p),
        visibility: visibility(p),
        least_width: p.float("least_width"),
        max_distance: p.int("max_distance"),
        reuse,
        listed,
    };
    let rbssm = Rbssm::new(context, setup.extent, setup.map_size, config)?;
    Ok(Box::new(SoftShadows {
        info,
        view: ViewBuffer::new(context.device())?,
        classes_view: classes_view(context, setup, rbssm.is_listed())?,
        rbssm,
        push: RbsmPush { normal_offset: p.float("normal_offset"), depth_bias: p.float("depth_bias"), slack: 0.0 },
        map_size: setup.map_size,
        visibility: visibility_image(context.device(), "rbssm visibility", setup)?,
    }))
}

impl Technique for SoftShadows {
    fn record(&mut self, frame: &mut Frame<'_>, inputs: &Inputs<'_>) -> Result<ImageRef> {
        let visibility = &self.visibility;
        inputs.check(self.info.id, visibility.extent(), self.map_size)?;
        frame.begin_group(self.info.title);
        let view = self.view.update(frame, inputs);
        if let Some(image) = &self.classes_view {
            self.rbssm.record_classes(frame, view, inputs, self.push, image)?;
        }
        self.rbssm.record(frame, view, inputs, self.push, visibility)?;
        frame.end_group();
        Ok(visibility.as_ref())
    }

    fn output(&self) -> &Image {
        &self.visibility
    }

    fn intermediates(&self) -> Vec<(&'static str, &Image)> {
        self.classes_view.iter().map(|image| ("classes", image)).collect()
    }

    fn memory_bytes(&self) -> u64 {
        let viewed = self.classes_view.as_ref().map_or(0, Image::memory_bytes);
        self.visibility.memory_bytes() + self.rbssm.memory_bytes() + viewed
    }
}
