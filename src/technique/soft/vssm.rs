//! Variance soft shadow mapping.

use super::window_moments::{CLASSIFY, DEPTH_BIAS, REDUCTION, WINDOW, WindowMoments, WindowPush};
use crate::gpu::{Buffer, Image};
use crate::technique::common::blocker_search::SEARCH;
use crate::technique::common::receiver::NORMAL_OFFSET;
use crate::technique::filtering::moment_kind::Kind as MomentKind;
use crate::technique::filtering::summed_area::scale;
use crate::technique::{Info, Kind, Param, Params, Passes, Setup};
use crate::{Context, Frame, Inputs, Result};

/// The registry entry.
pub const INFO: Info = Info {
    id: "vssm",
    title: "Variance soft shadow mapping",
    paper: "Yang, Dong, Feng, Seidel, Kautz 2010",
    summary: "Penumbrae of an area light from two moments in a summed-area table: as many fetches whatever their width, with light leaking.",
    params: &[
        WINDOW,
        Param::int(
            "cells",
            1,
            8,
            2,
            "cells",
            "parts of a window along each axis, of which those in front of the receiver count",
        ),
        SEARCH,
        CLASSIFY,
        Param { default: 0.25, ..NORMAL_OFFSET },
        DEPTH_BIAS,
        Param::float(
            "deviation",
            0.0,
            0.1,
            0.0005,
            "light depths",
            "least standard deviation of the depths in a window; rounding may require more",
        ),
        REDUCTION,
    ],
    published: &[],
    needs: &[],
    kind: Kind::RealTime(prepare),
};

/// Returns the least variance of signed depths: the setting, or what rounding leaves of a constant depth.
pub fn least_variance(p: &Params) -> f32 {
    let deviation = 2.0 * p.float("deviation");
    (deviation * deviation).max(2.5 / scale(p.int("window"))).max(f32::EPSILON)
}

struct Vssm {
    moments: WindowMoments,
}

fn prepare(context: &Context, setup: &Setup) -> Result<Box<dyn Passes>> {
    let p = &setup.params;
    let push = WindowPush { least_variance: least_variance(p), ..WindowPush::default() };
    let shader = ("soft/vssm.comp", &[("CELLS", p.int("cells"))][..]);
    Ok(Box::new(Vssm { moments: WindowMoments::new(context, setup, MomentKind::Variance, shader, push)? }))
}

impl Passes for Vssm {
    fn record(&mut self, frame: &mut Frame<'_>, view: &Buffer, inputs: &Inputs<'_>, visibility: &Image) -> Result<()> {
        self.moments.record(frame, view, inputs, "vssm", visibility)
    }

    fn memory_bytes(&self) -> u64 {
        self.moments.memory_bytes()
    }
}
