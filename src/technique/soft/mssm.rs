//! Moment soft shadow mapping.

use super::window_moments::{CLASSIFY, DEPTH_BIAS, REDUCTION, WINDOW, WindowMoments, WindowPush};
use crate::technique::common::blocker_search::SEARCH;
use crate::technique::common::receiver::NORMAL_OFFSET;
use crate::technique::filtering::moment_kind::Kind as MomentKind;
use crate::technique::filtering::moments::MOMENT_BIAS;
use crate::technique::filtering::msm::table_bias;
use crate::technique::{Info, Kind, Param, Params, Passes, Setup};
use crate::{Context, Result};

/// The registry entry.
pub const INFO: Info = Info {
    id: "mssm",
    title: "Moment soft shadow mapping",
    paper: "Peters, Münstermann, Wetzstein, Klein 2017",
    summary: "Penumbrae of an area light from four moments in a summed-area table: as many fetches whatever their width, with little light leaking.",
    params: &[WINDOW, SEARCH, CLASSIFY, Param { default: 0.25, ..NORMAL_OFFSET }, DEPTH_BIAS, MOMENT_BIAS, REDUCTION],
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

fn prepare(context: &Context, setup: &Setup) -> Result<Box<dyn Passes>> {
    let push = WindowPush { moment_bias: moment_bias(&setup.params), ..WindowPush::default() };
    let shader = ("soft/mssm.comp", &[][..]);
    Ok(Box::new(WindowMoments::new(context, setup, (INFO.id, MomentKind::Packed), shader, push)?))
}
