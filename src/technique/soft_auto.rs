//! A hybrid of soft shadows.

use super::rbssm::{self, LEAST_WIDTH, VISIBILITY};
use super::revectorized::{DEPTH_BIAS, MAX_DISTANCE, NORMAL_OFFSET};
use super::{Info, Kind, Param, Setup, Technique, soft, visibility_image};
use crate::gpu::Image;
use crate::pass::soft::SoftPush;
use crate::pass::soft_auto::{SoftAuto, SoftAutoConfig};
use crate::pass::view::ViewBuffer;
use crate::{Context, Frame, ImageRef, Inputs, Result};

/// The registry entry.
pub const INFO: Info = Info {
    id: "soft-auto",
    title: "Hybrid of soft shadows",
    paper: "this project; named as future work by Macedo, Apolinário, Agüero 2019",
    summary: "One blocker search, then what each penumbra is worth: hard edges, revectorized visibility under every tap, or percentage-closer filtering.",
    params: &[
        soft::SEARCH_TAPS,
        Param::odd(
            "filter_taps",
            1,
            63,
            15,
            "taps",
            "taps of the filter of wide penumbrae along each axis, 2 x 2 texels each",
        ),
        Param::odd(
            "kernel_taps",
            1,
            63,
            11,
            "taps",
            "taps of the filter of narrow ones along each axis, each a place in the map",
        ),
        soft::SEARCH,
        Param::float(
            "hard_pixels",
            0.0,
            64.0,
            0.5,
            "pixels",
            "penumbrae that are narrower on the screen are hard edges; 0 = none",
        ),
        Param::float(
            "kernel_texels",
            0.0,
            1e6,
            2.0,
            "texels",
            "penumbrae that are narrower in the map average revectorized visibility, wider ones plain tests; 0 = all of these",
        ),
        Param::float(
            "thin_distance",
            0.0,
            1e6,
            16.0,
            "texels",
            "bars and gaps one texel wide that far from the receiver or farther: plain tests however narrow the penumbra",
        ),
        VISIBILITY,
        LEAST_WIDTH,
        MAX_DISTANCE,
        NORMAL_OFFSET,
        DEPTH_BIAS,
        Param::choice(
            "skip",
            &["auto", "off"],
            0,
            "decide pixels whose window is lit or in shadow by depth bounds of the map, before the search and after it: the same image",
        ),
    ],
    needs: &[],
    kind: Kind::RealTime(prepare),
};

struct Hybrid {
    view: ViewBuffer,
    passes: SoftAuto,
    push: SoftPush,
    map_size: [u32; 2],
    visibility: Image,
}

fn prepare(context: &Context, setup: &Setup) -> Result<Box<dyn Technique>> {
    let p = &setup.params;
    let config = SoftAutoConfig {
        search_taps: p.int("search_taps"),
        filter_taps: p.int("filter_taps"),
        kernel_taps: p.int("kernel_taps"),
        window: soft::search_window(p),
        visibility: rbssm::visibility(p),
        least_width: p.float("least_width"),
        max_distance: p.int("max_distance"),
        hard_pixels: p.float("hard_pixels"),
        kernel_texels: p.float("kernel_texels"),
        thin_distance: p.float("thin_distance"),
        classify: p.word("skip") == "auto",
    };
    Ok(Box::new(Hybrid {
        view: ViewBuffer::new(context.device())?,
        passes: SoftAuto::new(context, setup.extent, setup.map_size, config)?,
        push: SoftPush { normal_offset: p.float("normal_offset"), depth_bias: p.float("depth_bias") },
        map_size: setup.map_size,
        visibility: visibility_image(context.device(), "soft-auto visibility", setup)?,
    }))
}

impl Technique for Hybrid {
    fn record(&mut self, frame: &mut Frame<'_>, inputs: &Inputs<'_>) -> Result<ImageRef> {
        let visibility = &self.visibility;
        inputs.check(INFO.id, visibility.extent(), self.map_size)?;
        frame.begin_group(INFO.title);
        let view = self.view.update(frame, inputs);
        self.passes.record(frame, view, inputs, self.push, visibility)?;
        frame.end_group();
        Ok(visibility.as_ref())
    }

    fn output(&self) -> &Image {
        &self.visibility
    }

    fn memory_bytes(&self) -> u64 {
        self.visibility.memory_bytes() + self.passes.memory_bytes()
    }
}
