//! Revectorization-based soft shadow mapping.

use super::classified::{self, ClassifiedPass, MeasuredFilter, SearchBindings, check_taps};
use crate::gpu::{Buffer, ComputePipeline, Image};
use crate::technique::common::blocker_search::{self, SearchWindow};
use crate::technique::common::pixels::Step;
use crate::technique::common::rbsm_receiver::RbsmPush;
use crate::technique::revectorization::rbsm_pass::check_max_distance;
use crate::technique::revectorization::revectorized::{DEPTH_BIAS, MAX_DISTANCE, NORMAL_OFFSET};
use crate::technique::{Info, Kind, Param, Params, Passes, Setup, classes_view};
use crate::{Context, Error, Frame, Inputs, Result};
use std::sync::Arc;

/// The registry entry.
pub const INFO: Info = Info {
    id: "rbssm",
    title: "Revectorization-based soft shadow mapping",
    paper: "Macedo, Apolinário, Agüero 2019, algorithms 2 and 3",
    summary: "Percentage-closer soft shadows whose filter averages revectorized visibility: narrow penumbrae without the map's stairs.",
    params: &[
        blocker_search::SEARCH_TAPS,
        FILTER_TAPS,
        blocker_search::SEARCH,
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
        classified::SKIP,
    ],
    published: &[("search", "near"), ("visibility", "recovery"), ("least_width", "0")],
    needs: &[],
    kind: Kind::RealTime(|context, setup| {
        let p = &setup.params;
        prepare(context, setup, p.word("reuse") == "auto", p.word("skip") == "auto")
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
    rbssm: Rbssm,
    push: RbsmPush,
    /// To be looked at.
    classes_view: Option<Image>,
}

/// Makes the technique with or without its two accelerations.
pub(super) fn prepare(context: &Context, setup: &Setup, reuse: bool, listed: bool) -> Result<Box<dyn Passes>> {
    let p = &setup.params;
    let config = RbssmConfig {
        search_taps: p.int("search_taps"),
        filter_taps: p.int("filter_taps"),
        window: blocker_search::search_window(p),
        visibility: visibility(p),
        least_width: p.float("least_width"),
        max_distance: p.int("max_distance"),
        reuse,
        listed,
    };
    let rbssm = Rbssm::new(context, setup.extent, setup.map_size, config)?;
    Ok(Box::new(SoftShadows {
        classes_view: classes_view(context, setup, rbssm.is_listed())?,
        rbssm,
        push: RbsmPush { normal_offset: p.float("normal_offset"), depth_bias: p.float("depth_bias"), slack: 0.0 },
    }))
}

impl Passes for SoftShadows {
    fn record(&mut self, frame: &mut Frame<'_>, view: &Buffer, inputs: &Inputs<'_>, visibility: &Image) -> Result<()> {
        if let Some(image) = &self.classes_view {
            self.rbssm.record_classes(frame, view, inputs, self.push, image)?;
        }
        self.rbssm.record(frame, view, inputs, self.push, visibility)
    }

    fn intermediates(&self) -> Vec<(&'static str, &Image)> {
        self.classes_view.iter().map(|image| ("classes", image)).collect()
    }

    fn memory_bytes(&self) -> u64 {
        let viewed = self.classes_view.as_ref().map_or(0, Image::memory_bytes);
        self.rbssm.memory_bytes() + viewed
    }
}

/// Function that is averaged.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum RbssmVisibility {
    /// Listing 4, silhouette recovery.
    Recovery,
    /// RBSM*, eq. 7.
    Improved,
}

/// Settings that are fixed when the pass is made.
#[derive(Clone, Copy, Debug)]
pub struct RbssmConfig {
    /// Taps of the blocker search along each axis: odd, 1 to 63.
    pub search_taps: u32,
    /// Taps of the filter along each axis: odd, 1 to 63.
    pub filter_taps: u32,
    /// Window in which blockers are searched.
    pub window: SearchWindow,
    /// Function that is averaged.
    pub visibility: RbssmVisibility,
    /// The filter is never narrower, texels, unless the light is so small that not even what touches it could cast such a
    /// penumbra: so one of size 0 keeps its hard edges.
    pub least_width: f32,
    /// `MAXDIST`, texels: 1 to 64.
    pub max_distance: u32,
    /// Runs are found once for all taps that lie on them.
    pub reuse: bool,
    /// Pixels are first classified by the depths under their window; only the others are searched and filtered.
    pub listed: bool,
}

fn pipeline(context: &Context, config: RbssmConfig, step: Step) -> Result<Arc<ComputePipeline>> {
    let RbssmConfig { search_taps, filter_taps, window, visibility, least_width, max_distance, reuse, .. } = config;
    check_max_distance(max_distance)?;
    check_taps(search_taps, filter_taps)?;
    check_least_width(least_width)?;
    let constants = [
        // Of `glsl/common/rbsm_receiver.glsl`, not for this pass.
        ("FIXED", 0),
        ("MAX_DISTANCE", max_distance),
        ("SEARCH_TAPS", search_taps),
        ("FILTER_TAPS", filter_taps),
        ("STEP", step as u32),
        ("STAR", (visibility == RbssmVisibility::Improved).into()),
        ("NEAREST_BLOCKER", (window == SearchWindow::Blockers).into()),
        ("LEAST_WIDTH", least_width.to_bits()),
        ("REUSE", reuse.into()),
    ];
    context.pipeline::<SearchBindings, RbsmPush>("soft/rbssm.comp", &constants)
}

/// Refuses widths that are no texel's business.
pub(crate) fn check_least_width(least_width: f32) -> Result<()> {
    match least_width {
        0.0..=8.0 => Ok(()),
        w => Err(Error::Parameter(format!("a least width of {w} texels is not possible: 0 to 8"))),
    }
}

/// The filter alone, over pixels that another pass lists, as wide as it says; of the search nothing matters.
pub(super) fn measured_filter(context: &Context, config: RbssmConfig) -> Result<MeasuredFilter> {
    Ok(MeasuredFilter::new("revectorize and filter narrow penumbrae", pipeline(context, config, Step::Measured)?))
}

/// The pass with its pipelines, and what it skips by.
pub struct Rbssm {
    pass: ClassifiedPass,
}

impl Rbssm {
    /// Allocates for a camera image and a shadow map.
    ///
    /// # Errors
    /// [`Error::Parameter`] for numbers of taps, a width or a distance out of range.
    pub fn new(context: &Context, extent: [u32; 2], map_size: [u32; 2], config: RbssmConfig) -> Result<Self> {
        let RbssmConfig { window, listed, .. } = config;
        let pipeline = |step| pipeline(context, config, step);
        let sizes = [extent, map_size];
        Ok(Self { pass: ClassifiedPass::new(context, "rbssm pixels", sizes, (window, listed), pipeline)? })
    }

    /// Bytes of images and lists.
    pub fn memory_bytes(&self) -> u64 {
        self.pass.memory_bytes()
    }

    /// True if pixels are classified first.
    pub fn is_listed(&self) -> bool {
        self.pass.is_listed()
    }

    /// Writes the visibility of every pixel into `output`.
    pub fn record(
        &mut self,
        frame: &mut Frame<'_>,
        view: &Buffer,
        inputs: &Inputs<'_>,
        push: RbsmPush,
        output: &Image,
    ) -> Result<()> {
        let names = ["rbssm classify", "rbssm"];
        self.pass.record(frame, view, inputs, (names, bytemuck::bytes_of(&push)), output)
    }

    /// Writes what the classification says of every pixel into an image of one `f32`: 1 lit, 0 in shadow, 0.5 to be searched
    /// and filtered. To be looked at; made with `TRANSFER_DST`, and only where pixels are classified.
    pub fn record_classes(
        &mut self,
        frame: &mut Frame<'_>,
        view: &Buffer,
        inputs: &Inputs<'_>,
        push: RbsmPush,
        classes: &Image,
    ) -> Result<()> {
        self.pass.record_classes(frame, view, inputs, ("rbssm classes", bytemuck::bytes_of(&push)), classes)
    }
}
