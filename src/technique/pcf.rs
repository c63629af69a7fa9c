//! Percentage-closer filtering.

use super::{Info, Kind, Param, Setup, Technique, sm, visibility_image};
use crate::gpu::Image;
use crate::pass::pcf::{Pcf, PcfConfig, PcfPush, PcfSkip};
use crate::pass::view::ViewBuffer;
use crate::{Context, Frame, ImageRef, Inputs, Result};

/// Narrower kernels cost less than asking whether they can be skipped (see `results/`).
const SKIP_FROM_WIDTH: u32 = 31;

/// The registry entry.
pub const INFO: Info = Info {
    id: "pcf",
    title: "Percentage-closer filtering",
    paper: "Reeves, Salesin, Cook 1987",
    summary: "Averages the tests of w x w texels with bilinear weights: a soft edge w texels wide, on the receiver's plane.",
    params: &[
        Param::odd("width", 1, 63, 3, "texels", "width of the kernel"),
        Param { default: 0.25, ..sm::NORMAL_OFFSET },
        Param::float(
            "depth_bias",
            0.0,
            16.0,
            0.5,
            "texel slopes",
            "taken off the receiver's depth on top, in slopes of its plane a texel",
        ),
        Param::choice(
            "fetch",
            &["loop", "gather"],
            1,
            "one texel a fetch, or 2 x 2 texels a gather: the same image up to rounding",
        ),
        Param::choice(
            "skip",
            &["auto", "off", "pixels", "tiles"],
            0,
            "decide uniform neighbourhoods by depth bounds of the map's blocks, in the filter or in a pass that lists tiles: the same image",
        ),
    ],
    needs: &[],
    kind: Kind::RealTime(prepare),
};

struct PercentageCloser {
    view: ViewBuffer,
    pcf: Pcf,
    push: PcfPush,
    map_size: [u32; 2],
    visibility: Image,
}

fn prepare(context: &Context, setup: &Setup) -> Result<Box<dyn Technique>> {
    let p = &setup.params;
    let width = p.int("width");
    let skip = match p.word("skip") {
        "auto" if width >= SKIP_FROM_WIDTH => PcfSkip::Pixels,
        "pixels" => PcfSkip::Pixels,
        "tiles" => PcfSkip::Tiles,
        _ => PcfSkip::Off,
    };
    let config = PcfConfig { width, gather: p.word("fetch") == "gather", skip };
    Ok(Box::new(PercentageCloser {
        view: ViewBuffer::new(context.device())?,
        pcf: Pcf::new(context, setup.extent, setup.map_size, config)?,
        push: PcfPush { normal_offset: p.float("normal_offset"), depth_bias: p.float("depth_bias") },
        map_size: setup.map_size,
        visibility: visibility_image(context.device(), "pcf visibility", setup)?,
    }))
}

impl Technique for PercentageCloser {
    fn record(&mut self, frame: &mut Frame<'_>, inputs: &Inputs<'_>) -> Result<ImageRef> {
        let visibility = &self.visibility;
        inputs.check(INFO.id, visibility.extent(), self.map_size)?;
        frame.begin_group(INFO.title);
        let view = self.view.update(frame, inputs);
        self.pcf.record(frame, view, inputs, self.push, visibility)?;
        frame.end_group();
        Ok(visibility.as_ref())
    }

    fn output(&self) -> &Image {
        &self.visibility
    }

    fn memory_bytes(&self) -> u64 {
        self.visibility.memory_bytes() + self.pcf.memory_bytes()
    }
}
