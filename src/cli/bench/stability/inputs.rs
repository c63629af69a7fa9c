//! Cases that replace an engine's inputs: maps of fewer bits, and values that are no numbers.

use super::cases::{Finding, error, measured, out_of_range, share, under_lamps};
use super::lab::{Lab, Shot, record, scene};
use crate::cli::bench::driver::Result;
use crate::cli::bench::judge::Variant;
use ash::vk;
use edgeshade::gpu::{Image, ImageDesc};
use edgeshade::{Inputs, NormalEncoding};

const REFERENCE: &str = "it is made from the scene, without an engine's inputs";
const MAPLESS: &str = "it reads no shadow map";

/// Uploads values as an image that techniques read.
fn upload(lab: &Lab<'_>, format: vk::Format, size: [u32; 2], array: bool, texels: &[u8]) -> Result<Image> {
    let usage = vk::ImageUsageFlags::SAMPLED;
    let desc = ImageDesc { array, usage, ..ImageDesc::storage("replaced input", format, size) };
    lab.host.upload_image(&desc, texels)
}

/// Visibility by a technique that is made anew.
fn seen(lab: &Lab<'_>, shot: &Shot<'_>, v: &Variant, inputs: &Inputs<'_>) -> Result<Vec<f32>> {
    let mut technique = shot.renderer.prepare(v.choice.info.id, &v.choice.params)?;
    record(lab.host, technique.as_mut(), inputs)
}

pub fn sixteen_bits(lab: &Lab<'_>, variants: &[&Variant]) -> Result<Vec<Finding>> {
    under_lamps(variants, |lamp, name| {
        let stage = lab.stage(scene(lamp));
        let mut shot = lab.shot(&stage)?;
        let truths = shot.truths()?;
        shot.draw()?;
        let map = shot.renderer.shadow_map();
        let texels: Vec<u8> = (lab.host.read_values(map)?.iter())
            .flat_map(|&d| ((f64::from(d) * 65535.0).round() as u16).to_ne_bytes())
            .collect();
        let rounded = upload(lab, vk::Format::D16_UNORM, map.extent(), true, &texels)?;
        let one = |v: &&Variant| {
            if v.choice.is_reference() {
                return Ok(Finding::DoesNotApply(REFERENCE));
            }
            if v.has_no_map {
                return Ok(Finding::DoesNotApply(MAPLESS));
            }
            let inputs = [shot.inputs(), Inputs { shadow_map: rounded.as_ref(), ..shot.inputs() }];
            let [fine, coarse] = [seen(lab, &shot, v, &inputs[0])?, seen(lab, &shot, v, &inputs[1])?]
                .map(|seen| error(&truths, &v.choice, &seen));
            Ok(measured(coarse / fine, 1.1, name))
        };
        variants.iter().map(one).collect()
    })
}

/// Values that are no numbers, in turn.
const BAD: [f32; 3] = [f32::NAN, f32::INFINITY, f32::NEG_INFINITY];
/// Distance between bad depths or texels in the order of rows: coprime to the sizes, so that they lie everywhere.
const APART: usize = 127;

/// Indices of bad pixels or texels.
fn every(apart: usize, count: usize) -> impl Iterator<Item = usize> {
    (apart / 2..count).step_by(apart)
}

/// The values with some pixels of so many `components` that are no numbers.
fn planted(values: &[f32], components: usize, apart: usize) -> Vec<f32> {
    let mut values = values.to_vec();
    for (i, bad) in every(apart, values.len() / components).zip(BAD.into_iter().cycle()) {
        values[components * i..components * (i + 1)].fill(bad);
    }
    values
}

pub fn not_numbers(lab: &Lab<'_>, variants: &[&Variant]) -> Result<Vec<Finding>> {
    under_lamps(variants, |lamp, name| {
        let stage = lab.stage(scene(lamp));
        let mut shot = lab.shot(&stage)?;
        shot.draw()?;
        let gbuffer = shot.renderer.gbuffer();
        let depths = lab.host.read_values(&gbuffer.depth)?;
        let normals = normals(lab, &gbuffer.geometric_normal)?;
        let map = lab.host.read_values(shot.renderer.shadow_map())?;
        let mut with_sky = depths.clone();
        every(APART, depths.len()).for_each(|i| with_sky[i] = 0.0);

        let image = |format, array, values: &[f32]| {
            let size = if array { shot.renderer.shadow_map().extent() } else { lab.size };
            upload(lab, format, size, array, bytemuck::cast_slice(values))
        };
        let (r32, rg32) = (vk::Format::R32_SFLOAT, vk::Format::R32G32_SFLOAT);
        let good = (image(r32, false, &depths)?, image(rg32, false, &normals)?, image(r32, true, &map)?);
        let with_sky = image(r32, false, &with_sky)?;
        let bad_depths = image(r32, false, &planted(&depths, 1, APART))?;
        // Few normals, so that most pixels lie far from them. No filter of the scene's penumbrae reaches as far as a sixth
        // of the image's height.
        let (few, reach) = (depths.len() / BAD.len(), lab.size[1] / 6);
        let bad_normals = image(rg32, false, &planted(&normals, 2, few))?;
        let bad_map = image(r32, true, &planted(&map, 1, APART))?;
        let is_bad = within(lab.size, APART, 0);
        let is_near_bad = within(lab.size, few, reach.into());
        // Share of the pixels whose bits differ, apart from those of a mask.
        let felt = |a: &[f32], b: &[f32], except: &[bool]| {
            let differs = |i: usize| !except[i] && a[i].to_bits() != b[i].to_bits();
            share((0..a.len()).map(differs))
        };
        let one = |v: &&Variant| {
            if v.choice.is_reference() {
                return Ok(Finding::DoesNotApply(REFERENCE));
            }
            let normal = |image: &Image| Some((image.as_ref(), NormalEncoding::OctahedralSigned));
            let (depth, shadow_map) = (good.0.as_ref(), good.2.as_ref());
            let base = Inputs { depth, normal: normal(&good.1), shadow_map, ..shot.inputs() };
            let mut found = vec![];
            for (what, normal) in [("depth", base.normal), ("depth without normals", None)] {
                let picture = |depth: &Image| seen(lab, &shot, v, &Inputs { depth: depth.as_ref(), normal, ..base });
                let [sky, bad] = [picture(&with_sky)?, picture(&bad_depths)?];
                found.push((out_of_range(&bad).max(felt(&sky, &bad, &is_bad)), what));
            }
            let plain = seen(lab, &shot, v, &base)?;
            let bad = seen(lab, &shot, v, &Inputs { normal: normal(&bad_normals), ..base })?;
            found.push((out_of_range(&bad).max(felt(&plain, &bad, &is_near_bad)), "normals"));
            if !v.has_no_map {
                let bad = seen(lab, &shot, v, &Inputs { shadow_map: bad_map.as_ref(), ..base })?;
                found.push((out_of_range(&bad), "map"));
            }
            let worst = found.into_iter().max_by(|a, b| a.0.total_cmp(&b.0));
            let (figure, what) = worst.unwrap_or_default();
            Ok(measured(figure, 0.0, &if figure > 0.0 { format!("{name}, {what}") } else { name.to_owned() }))
        };
        variants.iter().map(one).collect()
    })
}

/// Mask of the pixels within a distance, along both axes, of a bad one.
fn within(size: [u32; 2], apart: usize, distance: i64) -> Vec<bool> {
    let count = (size[0] * size[1]) as usize;
    let place = |i: usize| (i as i64 % i64::from(size[0]), i as i64 / i64::from(size[0]));
    let mut mask = vec![false; count];
    for (x, y) in every(apart, count).map(place) {
        for at in (y - distance).max(0)..=(y + distance).min(i64::from(size[1]) - 1) {
            let row = at * i64::from(size[0]);
            let columns = (x - distance).max(0)..=(x + distance).min(i64::from(size[0]) - 1);
            columns.for_each(|column| mask[(row + column) as usize] = true);
        }
    }
    mask
}

/// The G-buffer's normals as two numbers each.
fn normals(lab: &Lab<'_>, image: &Image) -> Result<Vec<f32>> {
    if image.format() != vk::Format::R16G16_SNORM {
        return Ok(lab.host.read_image::<[f32; 2]>(image)?.concat());
    }
    let pixels = lab.host.read_image::<[i16; 2]>(image)?;
    Ok(pixels.concat().into_iter().map(|v| (f32::from(v) / 32767.0).max(-1.0)).collect())
}
