//! Variance shadow maps.

use super::moment_kind::Kind as MomentKind;
use super::moments::{
    ANISOTROPY, Config, DEPTH_BIAS, DEVIATION, FETCH, FILTER, LookupPush, MIPS, MomentMap, REDUCTION, WIDTH, is_table,
    lookup_push,
};
use super::summed_area::scale;
use crate::technique::common::receiver::NORMAL_OFFSET;
use crate::technique::{Info, Kind, Param, Params, Passes, Setup};
use crate::{Context, Result};
use ash::vk;

/// The registry entry.
pub const INFO: Info = Info {
    id: "vsm",
    title: "Variance shadow maps",
    paper: "Donnelly, Lauritzen 2006; Lauritzen 2007 for the summed-area table",
    summary: "Bounds the lit share of w x w texels from two moments: soft edges at one fetch a pixel, with light leaking.",
    params: &[
        FILTER,
        WIDTH,
        MIPS,
        ANISOTROPY,
        Param { default: 0.5, ..NORMAL_OFFSET },
        DEPTH_BIAS,
        DEVIATION,
        Param { default: 0.2, ..REDUCTION },
        FETCH,
    ],
    published: &[],
    needs: &[],
    kind: Kind::RealTime(prepare),
};

/// Returns the least standard deviation of signed depths: the setting, or what rounding leaves of a constant depth.
pub fn least_deviation(p: &Params) -> f32 {
    let rounding = match is_table(MomentKind::Variance, p) {
        // The mean of the squares, and twice that of the depths, by half a step each; the depths' range is 2.
        true => (2.5 / scale(p.int("width"))).max(f32::EPSILON),
        false => f32::EPSILON,
    };
    (2.0 * p.float("deviation")).max(rounding.sqrt())
}

fn prepare(context: &Context, setup: &Setup) -> Result<Box<dyn Passes>> {
    let p = &setup.params;
    let config = Config {
        name: INFO.id,
        kind: MomentKind::Variance,
        format: vk::Format::R32G32_SFLOAT,
        exponents: [0.0; 2],
        shader: "filtering/vsm.comp",
        constants: &[],
        push: LookupPush { least_deviation: least_deviation(p), ..lookup_push(p) },
    };
    Ok(Box::new(MomentMap::new(context, setup, &config)?))
}
