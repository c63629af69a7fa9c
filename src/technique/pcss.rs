//! Percentage-closer soft shadows.

use super::{Info, Kind, Param, Setup, Technique, classes_view, sm, soft, visibility_image};
use crate::gpu::Image;
use crate::pass::pcss::{Pcss, PcssConfig};
use crate::pass::soft::SoftPush;
use crate::pass::view::ViewBuffer;
use crate::{Context, Frame, ImageRef, Inputs, Result};

/// The registry entry.
pub const INFO: Info = Info {
    id: "pcss",
    title: "Percentage-closer soft shadows",
    paper: "Fernando 2005",
    summary: "Penumbrae of an area light: their width from the mean distance of what blocks, filtered over that width.",
    params: &[
        soft::SEARCH_TAPS,
        Param::odd("filter_taps", 1, 63, 15, "taps", "taps of the filter along each axis"),
        soft::SEARCH,
        Param::choice("taps", &["nearest", "bilinear"], 1, "a tap of the filter tests one texel, or 2 x 2 weighted"),
        Param::choice(
            "narrow",
            &["taps", "box"],
            1,
            "windows of no more texels than the filter has taps: taps all the same, or the exact mean of the texels",
        ),
        Param { default: 0.25, ..sm::NORMAL_OFFSET },
        Param::float(
            "depth_bias",
            0.0,
            16.0,
            0.5,
            "texel slopes",
            "taken off the receiver's depth on top, in slopes of its plane a texel",
        ),
        soft::SKIP,
    ],
    needs: &[],
    kind: Kind::RealTime(prepare),
};

struct SoftShadows {
    view: ViewBuffer,
    pcss: Pcss,
    push: SoftPush,
    map_size: [u32; 2],
    visibility: Image,
    /// To be looked at.
    classes_view: Option<Image>,
}

fn prepare(context: &Context, setup: &Setup) -> Result<Box<dyn Technique>> {
    let p = &setup.params;
    let config = PcssConfig {
        search_taps: p.int("search_taps"),
        filter_taps: p.int("filter_taps"),
        window: soft::search_window(p),
        bilinear: p.word("taps") == "bilinear",
        exact_box: p.word("narrow") == "box",
        listed: p.word("skip") == "auto",
    };
    let pcss = Pcss::new(context, setup.extent, setup.map_size, config)?;
    Ok(Box::new(SoftShadows {
        view: ViewBuffer::new(context.device())?,
        classes_view: classes_view(context, setup, pcss.is_listed())?,
        pcss,
        push: SoftPush { normal_offset: p.float("normal_offset"), depth_bias: p.float("depth_bias") },
        map_size: setup.map_size,
        visibility: visibility_image(context.device(), "pcss visibility", setup)?,
    }))
}

impl Technique for SoftShadows {
    fn record(&mut self, frame: &mut Frame<'_>, inputs: &Inputs<'_>) -> Result<ImageRef> {
        let visibility = &self.visibility;
        inputs.check(INFO.id, visibility.extent(), self.map_size)?;
        frame.begin_group(INFO.title);
        let view = self.view.update(frame, inputs);
        if let Some(image) = &self.classes_view {
            self.pcss.record_classes(frame, view, inputs, self.push, image)?;
        }
        self.pcss.record(frame, view, inputs, self.push, visibility)?;
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
        self.visibility.memory_bytes() + self.pcss.memory_bytes() + viewed
    }
}
