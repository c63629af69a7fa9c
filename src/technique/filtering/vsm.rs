//! Variance shadow maps.

use super::moment_kind::Kind as MomentKind;
use super::moments::{
    ANISOTROPY, Config, DEPTH_BIAS, FETCH, FILTER, LookupPush, MIPS, MomentMap, REDUCTION, WIDTH, is_table, lookup_push,
};
use super::summed_area::scale;
use crate::gpu::{Buffer, Image};
use crate::technique::common::receiver::NORMAL_OFFSET;
use crate::technique::{Info, Kind, Param, Params, Passes, Setup};
use crate::{Context, Frame, Inputs, Result};
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
        Param::float(
            "deviation",
            0.0,
            0.1,
            0.0005,
            "light depths",
            "least standard deviation of the depths in a window; rounding may require more",
        ),
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

struct Vsm {
    map: MomentMap,
}

fn prepare(context: &Context, setup: &Setup) -> Result<Box<dyn Passes>> {
    let p = &setup.params;
    let config = Config {
        kind: MomentKind::Variance,
        format: vk::Format::R32G32_SFLOAT,
        exponents: [0.0; 2],
        shader: "filtering/vsm.comp",
        constants: &[],
        push: LookupPush { least_deviation: least_deviation(p), ..lookup_push(p) },
    };
    Ok(Box::new(Vsm { map: MomentMap::new(context, setup, &config)? }))
}

impl Passes for Vsm {
    fn record(&mut self, frame: &mut Frame<'_>, view: &Buffer, inputs: &Inputs<'_>, visibility: &Image) -> Result<()> {
        self.map.record(frame, view, inputs, "vsm", visibility)
    }

    fn intermediates(&self) -> Vec<(&'static str, &Image)> {
        vec![("moments", self.map.moments())]
    }

    fn memory_bytes(&self) -> u64 {
        self.map.memory_bytes()
    }
}
