//! Moment soft shadow mapping.

use super::window_moments::{CLASSIFY, DEPTH_BIAS, REDUCTION, WINDOW, WindowMoments, WindowPush};
use crate::gpu::{Buffer, Image};
use crate::technique::common::blocker_search::SEARCH;
use crate::technique::common::receiver::NORMAL_OFFSET;
use crate::technique::filtering::moment_kind::Kind as MomentKind;
use crate::technique::filtering::msm::table_bias;
use crate::technique::{Info, Kind, Param, Params, Passes, Setup};
use crate::{Context, Frame, Inputs, Result};

/// The registry entry.
pub const INFO: Info = Info {
    id: "mssm",
    title: "Moment soft shadow mapping",
    paper: "Peters, Münstermann, Wetzstein, Klein 2017",
    summary: "Penumbrae of an area light from four moments in a summed-area table: as many fetches whatever their width, with little light leaking.",
    params: &[
        WINDOW,
        SEARCH,
        CLASSIFY,
        Param { default: 0.25, ..NORMAL_OFFSET },
        DEPTH_BIAS,
        Param::float(
            "moment_bias",
            0.0,
            0.1,
            0.0,
            "share",
            "share of moments that are certainly possible, against rounding; 0 = what the widest window needs",
        ),
        REDUCTION,
    ],
    published: &[],
    needs: &[],
    kind: Kind::RealTime(prepare),
};

/// Returns the share of moments that are certainly possible.
pub fn moment_bias(p: &Params) -> f32 {
    match p.float("moment_bias") {
        0.0 => table_bias(p.int("window")),
        given => given,
    }
}

struct Mssm {
    moments: WindowMoments,
}

fn prepare(context: &Context, setup: &Setup) -> Result<Box<dyn Passes>> {
    let push = WindowPush { moment_bias: moment_bias(&setup.params), ..WindowPush::default() };
    Ok(Box::new(Mssm {
        moments: WindowMoments::new(context, setup, MomentKind::Packed, ("soft/mssm.comp", &[]), push)?,
    }))
}

impl Passes for Mssm {
    fn record(&mut self, frame: &mut Frame<'_>, view: &Buffer, inputs: &Inputs<'_>, visibility: &Image) -> Result<()> {
        self.moments.record(frame, view, inputs, "mssm", visibility)
    }

    fn memory_bytes(&self) -> u64 {
        self.moments.memory_bytes()
    }
}
