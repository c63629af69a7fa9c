//! Moment shadow mapping with four moments.

use super::moment_kind::Kind as MomentKind;
use super::moments::{
    ANISOTROPY, Config, DEPTH_BIAS, FETCH, FILTER, LookupPush, MIPS, MOMENT_BIAS, MomentMap, REDUCTION, WIDTH,
    is_table, lookup_push,
};
use super::summed_area::scale;
use crate::technique::common::receiver::NORMAL_OFFSET;
use crate::technique::{Info, Kind, Param, Params, Passes, Setup};
use crate::{Context, Error, Result};
use ash::vk;

/// The registry entry.
pub const INFO: Info = Info {
    id: "msm",
    title: "Moment shadow mapping",
    paper: "Peters, Klein 2015; Peters, Münstermann, Wetzstein, Klein 2017",
    summary: "The least shadow that four moments allow over w x w texels: soft edges with little light leaking.",
    params: &[
        FILTER,
        WIDTH,
        MIPS,
        ANISOTROPY,
        Param::choice(
            "bits",
            &["16", "32"],
            1,
            "bits of each moment: integers in the basis that suits them, or floats",
        ),
        Param::choice(
            "reconstruction",
            &["hamburger", "hausdorff"],
            0,
            "over all distributions of depths, or those within the map's range, which leaks less where three layers meet",
        ),
        MOMENT_BIAS,
        Param { default: 0.25, ..NORMAL_OFFSET },
        Param { default: 0.25, ..DEPTH_BIAS },
        Param { default: 0.1, ..REDUCTION },
        FETCH,
    ],
    published: &[],
    needs: &[],
    kind: Kind::RealTime(prepare),
};

/// Returns the share of moments that are certainly possible.
pub fn moment_bias(p: &Params) -> f32 {
    let table = match is_table(MomentKind::Packed, p) {
        true => table_bias(p.int("width")),
        false => 0.0,
    };
    match p.float("moment_bias") {
        0.0 if p.word("bits") == "16" => table.max(6e-5),
        0.0 => table.max(3e-7),
        given => given,
    }
}

/// Returns the share that the moments of a summed-area table with windows of `width` x `width` texels need: it grows
/// with their error.
pub(crate) fn table_bias(width: u32) -> f32 {
    (2e-6 * (scale(31) / scale(width))).clamp(3e-7, 6e-5)
}

fn prepare(context: &Context, setup: &Setup) -> Result<Box<dyn Passes>> {
    let p = &setup.params;
    let bits_16 = p.word("bits") == "16";
    let format = if bits_16 { vk::Format::R16G16B16A16_UNORM } else { vk::Format::R32G32B32A32_SFLOAT };
    let needed = vk::FormatFeatureFlags::SAMPLED_IMAGE | vk::FormatFeatureFlags::STORAGE_IMAGE;
    if !context.device().format_features(format).contains(needed) {
        let problem =
            format!("bits={}: this device does not write and read {format:?} images; take bits=32", p.word("bits"));
        return Err(Error::Parameter(problem));
    }
    let config = Config {
        name: INFO.id,
        kind: if bits_16 { MomentKind::Packed } else { MomentKind::Powers },
        format,
        exponents: [0.0; 2],
        shader: "filtering/msm.comp",
        constants: &[("HAUSDORFF", (p.word("reconstruction") == "hausdorff").into()), ("BITS_16", bits_16.into())],
        push: LookupPush { moment_bias: moment_bias(p), ..lookup_push(p) },
    };
    Ok(Box::new(MomentMap::new(context, setup, &config)?))
}
