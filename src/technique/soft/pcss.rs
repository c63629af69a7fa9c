//! Percentage-closer soft shadows.

use super::classified::{self, ClassifiedPass, MeasuredFilter, SearchBindings, check_taps};
use crate::gpu::{Buffer, ComputePipeline, Image};
use crate::technique::common::blocker_search::{self, SearchWindow};
use crate::technique::common::pixels::Step;
use crate::technique::common::receiver::{self, ReceiverPush};
use crate::technique::{Info, Kind, Param, Passes, Setup, classes_view};
use crate::{Context, Frame, Inputs, Result};
use std::sync::Arc;

/// The registry entry.
pub const INFO: Info = Info {
    id: "pcss",
    title: "Percentage-closer soft shadows",
    paper: "Fernando 2005",
    summary: "Penumbrae of an area light: their width from the mean distance of what blocks, filtered over that width.",
    params: &[
        blocker_search::SEARCH_TAPS,
        Param::odd("filter_taps", 1, 63, 15, "taps", "taps of the filter along each axis"),
        blocker_search::SEARCH,
        Param::choice("taps", &["nearest", "bilinear"], 1, "a tap of the filter tests one texel, or 2 x 2 weighted"),
        Param::choice(
            "narrow",
            &["taps", "box"],
            1,
            "windows of no more texels than the filter has taps: taps all the same, or the exact mean of the texels",
        ),
        Param { default: 0.25, ..receiver::NORMAL_OFFSET },
        receiver::DEPTH_BIAS,
        classified::SKIP,
    ],
    needs: &[],
    kind: Kind::RealTime(prepare),
};

struct SoftShadows {
    pcss: Pcss,
    push: ReceiverPush,
    /// To be looked at.
    classes_view: Option<Image>,
}

fn prepare(context: &Context, setup: &Setup) -> Result<Box<dyn Passes>> {
    let p = &setup.params;
    let config = PcssConfig {
        search_taps: p.int("search_taps"),
        filter_taps: p.int("filter_taps"),
        window: blocker_search::search_window(p),
        bilinear: p.word("taps") == "bilinear",
        exact_box: p.word("narrow") == "box",
        listed: p.word("skip") == "auto",
    };
    let pcss = Pcss::new(context, setup.extent, setup.map_size, config)?;
    Ok(Box::new(SoftShadows {
        classes_view: classes_view(context, setup, pcss.is_listed())?,
        pcss,
        push: receiver::push(setup),
    }))
}

impl Passes for SoftShadows {
    fn record(&mut self, frame: &mut Frame<'_>, view: &Buffer, inputs: &Inputs<'_>, visibility: &Image) -> Result<()> {
        if let Some(image) = &self.classes_view {
            self.pcss.record_classes(frame, view, inputs, self.push, image)?;
        }
        self.pcss.record(frame, view, inputs, self.push, visibility)
    }

    fn intermediates(&self) -> Vec<(&'static str, &Image)> {
        self.classes_view.iter().map(|image| ("classes", image)).collect()
    }

    fn memory_bytes(&self) -> u64 {
        let viewed = self.classes_view.as_ref().map_or(0, Image::memory_bytes);
        self.pcss.memory_bytes() + viewed
    }
}

/// Settings that are fixed when the pass is made.
#[derive(Clone, Copy, Debug)]
pub struct PcssConfig {
    /// Taps of the blocker search along each axis: odd, 1 to 63.
    pub search_taps: u32,
    /// Taps of the filter along each axis: odd, 1 to 63.
    pub filter_taps: u32,
    /// Window in which blockers are searched.
    pub window: SearchWindow,
    /// The filter's taps test 2 x 2 texels, weighted by their place, instead of one.
    pub bilinear: bool,
    /// Windows of no more texels than the filter has taps are averaged exactly, texel by texel.
    pub exact_box: bool,
    /// Pixels are first classified by the depths under their window; only the others are searched and filtered.
    pub listed: bool,
}

fn pipeline(context: &Context, config: PcssConfig, step: Step) -> Result<Arc<ComputePipeline>> {
    let PcssConfig { search_taps, filter_taps, window, bilinear, exact_box, .. } = config;
    check_taps(search_taps, filter_taps)?;
    let narrow = window == SearchWindow::Blockers;
    let constants = [
        ("SEARCH_TAPS", search_taps),
        ("FILTER_TAPS", filter_taps),
        ("BILINEAR", bilinear.into()),
        ("BOX", exact_box.into()),
        ("STEP", step as u32),
        ("NEAREST_BLOCKER", narrow.into()),
    ];
    context.pipeline::<SearchBindings, ReceiverPush>("soft/pcss.comp", &constants)
}

/// The filter alone, over pixels that another pass lists, as wide as it says; of the search nothing matters.
pub(super) fn measured_filter(context: &Context, config: PcssConfig) -> Result<MeasuredFilter> {
    Ok(MeasuredFilter::new("filter wide penumbrae", pipeline(context, config, Step::Measured)?))
}

/// The pass with its pipelines, and what it skips by.
pub struct Pcss {
    pass: ClassifiedPass,
}

impl Pcss {
    /// Allocates for a camera image and a shadow map.
    ///
    /// # Errors
    /// [`crate::Error::Parameter`] for numbers of taps out of range.
    pub fn new(context: &Context, extent: [u32; 2], map_size: [u32; 2], config: PcssConfig) -> Result<Self> {
        let PcssConfig { window, listed, .. } = config;
        let pipeline = |step| pipeline(context, config, step);
        let sizes = [extent, map_size];
        Ok(Self { pass: ClassifiedPass::new(context, "pcss pixels", sizes, (window, listed), pipeline)? })
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
        push: ReceiverPush,
        output: &Image,
    ) -> Result<()> {
        let names = ["pcss classify", "pcss"];
        self.pass.record(frame, view, inputs, (names, bytemuck::bytes_of(&push)), output)
    }

    /// Writes what the classification says of every pixel into an image of one `f32`: 1 lit, 0 in shadow, 0.5 to be searched
    /// and filtered. To be looked at; made with `TRANSFER_DST`, and only where pixels are classified.
    pub fn record_classes(
        &mut self,
        frame: &mut Frame<'_>,
        view: &Buffer,
        inputs: &Inputs<'_>,
        push: ReceiverPush,
        classes: &Image,
    ) -> Result<()> {
        self.pass.record_classes(frame, view, inputs, ("pcss classes", bytemuck::bytes_of(&push)), classes)
    }
}
