//! Exponential variance shadow maps.

use super::moment_kind::Kind as MomentKind;
use super::moments::{
    ANISOTROPY, Config, DEPTH_BIAS, DEVIATION, FETCH, FILTER, LookupPush, MIPS, MomentMap, REDUCTION, WIDTH,
    lookup_push,
};
use crate::technique::common::receiver::NORMAL_OFFSET;
use crate::technique::{Info, Kind, Param, Params, Passes, Setup};
use crate::{Context, Result};
use ash::vk;

/// The registry entry.
pub const INFO: Info = Info {
    id: "evsm",
    title: "Exponential variance shadow maps",
    paper: "Lauritzen, McCool 2008",
    summary: "Variance shadow maps of exponentially warped depths: much less light leaking, for twice the memory.",
    params: &[
        FILTER,
        WIDTH,
        MIPS,
        ANISOTROPY,
        Param::choice(
            "warps",
            &["positive", "both"],
            1,
            "two components, or four: the negative warp too, which mends contacts",
        ),
        Param::choice("bits", &["16", "32"], 1, "bits of a component; 16 allow exponents of up to 5.54"),
        Param::float(
            "positive_exponent",
            0.0,
            42.0,
            40.0,
            "",
            "of the positive warp, limited to what the components hold",
        ),
        Param::float("negative_exponent", 0.0, 42.0, 5.0, "", "of the negative warp, limited likewise"),
        Param { default: 0.5, ..NORMAL_OFFSET },
        DEPTH_BIAS,
        Param {
            default: 0.00005,
            help: "least standard deviation of the depths in a window, before the warp",
            ..DEVIATION
        },
        Param { default: 0.1, ..REDUCTION },
        FETCH,
    ],
    published: &[],
    needs: &[],
    kind: Kind::RealTime(prepare),
};

/// Largest exponents whose warps can be squared in 16 and 32 bits, with room for a filter's sums.
const LARGEST: [f32; 2] = [5.54, 42.0];

/// Returns the exponents of the positive and of the negative warp.
pub fn exponents(p: &Params) -> [f32; 2] {
    let largest = LARGEST[usize::from(p.word("bits") == "32")];
    ["positive_exponent", "negative_exponent"].map(|name| p.float(name).min(largest))
}

fn prepare(context: &Context, setup: &Setup) -> Result<Box<dyn Passes>> {
    let p = &setup.params;
    let both = p.word("warps") == "both";
    let config = Config {
        name: INFO.id,
        kind: MomentKind::Warped,
        format: match (p.word("bits"), both) {
            ("16", false) => vk::Format::R16G16_SFLOAT,
            ("16", true) => vk::Format::R16G16B16A16_SFLOAT,
            (_, false) => vk::Format::R32G32_SFLOAT,
            (_, true) => vk::Format::R32G32B32A32_SFLOAT,
        },
        exponents: exponents(p),
        shader: "filtering/evsm.comp",
        constants: &[("BOTH_WARPS", both.into())],
        push: LookupPush { least_deviation: 2.0 * p.float("deviation"), ..lookup_push(p) },
    };
    Ok(Box::new(MomentMap::new(context, setup, &config)?))
}
