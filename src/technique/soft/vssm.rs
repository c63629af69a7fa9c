//! Variance soft shadow mapping.

use super::window_moments::{CLASSIFY, DEPTH_BIAS, REDUCTION, WINDOW, WindowMoments, WindowPush};
use crate::technique::common::blocker_search::SEARCH;
use crate::technique::common::receiver::NORMAL_OFFSET;
use crate::technique::filtering::moment_kind::Kind as MomentKind;
use crate::technique::filtering::moments::DEVIATION;
use crate::technique::filtering::summed_area::scale;
use crate::technique::{Info, Kind, Param, Params, Passes, Setup};
use crate::{Context, Result};

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
        DEVIATION,
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

fn prepare(context: &Context, setup: &Setup) -> Result<Box<dyn Passes>> {
    let p = &setup.params;
    let push = WindowPush { least_variance: least_variance(p), ..WindowPush::default() };
    let shader = ("soft/vssm.comp", &[("CELLS", p.int("cells"))][..]);
    Ok(Box::new(WindowMoments::new(context, setup, (INFO.id, MomentKind::Variance), shader, push)?))
}
