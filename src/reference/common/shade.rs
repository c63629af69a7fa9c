//! Mirror of `glsl/common/shade.comp`.

use super::view::{FrameData, View};
use crate::scene::ShadePush;
use crate::{Error, Result};
use glam::{DVec3, dvec3};

const ZENITH: DVec3 = dvec3(0.30, 0.46, 0.78);
const HORIZON: DVec3 = dvec3(0.78, 0.82, 0.86);
const GROUND: DVec3 = dvec3(0.36, 0.32, 0.28);

/// Returns the shaded picture: sRGB in `[0, 1]`, to be rounded to 8-bit codes.
///
/// `data.normal` holds the shading normals, `albedo` linear colours and `visibility` the technique's result, one value
/// per pixel.
///
/// # Errors
/// Fails if the images do not fit the constants.
pub fn picture(
    data: &FrameData<'_>,
    push: &ShadePush,
    albedo: &[[f32; 3]],
    visibility: &[f32],
) -> Result<Vec<[f64; 3]>> {
    let view = View::new(data)?;
    if albedo.len() != data.depth.len() || visibility.len() != data.depth.len() {
        return Err(Error::Usage("mirror: albedo or visibility does not have the size of the depth image".into()));
    }
    let width = view.size[0];
    Ok(view.every_pixel(|at| {
        let i = at[1] * width + at[0];
        let albedo = DVec3::from(albedo[i].map(f64::from));
        let color = tone_map(shade(&view, push, at, albedo, visibility[i].into()));
        color.to_array().map(srgb_encode)
    }))
}

fn shade(view: &View<'_>, push: &ShadePush, at: [usize; 2], albedo: DVec3, visibility: f64) -> DVec3 {
    let up = view.up();
    let Some(r) = view.receiver(at) else {
        return sky_color(view.position_at(at, 0.5).0.normalize(), up);
    };
    let (towards, _) = view.towards_light(r.position, DVec3::ZERO);
    let key = r.normal.dot(towards).max(0.0) * key_light(view, push, r.position, towards);
    let sky_ambient = HORIZON.lerp(ZENITH, 0.6);
    let ambient = f64::from(push.ambient) * GROUND.lerp(sky_ambient, 0.5 + 0.5 * r.normal.dot(up));
    let light = DVec3::from(push.light_color.map(f64::from));
    albedo * (light * (key * visibility) + ambient)
}

fn sky_color(direction: DVec3, up: DVec3) -> DVec3 {
    let h = direction.dot(up).clamp(0.0, 1.0);
    HORIZON.lerp(ZENITH, 1.0 - (-4.0 * h).exp())
}

fn key_light(view: &View<'_>, push: &ShadePush, p: DVec3, towards: DVec3) -> f64 {
    let reference = f64::from(push.reference_distance);
    if reference == 0.0 {
        return 1.0;
    }
    let Some(distance) = view.light_distance(p).filter(|d| *d > 0.0) else { return 0.0 };
    let axis = -towards.dot(view.light_axis());
    let falloff = (reference / distance).min(2.0);
    let (outer, inner) = (f64::from(push.cos_outer), f64::from(push.cos_inner));
    let t = ((axis - outer) / (inner - outer)).clamp(0.0, 1.0);
    t * t * (3.0 - 2.0 * t) * falloff * falloff
}

/// `toneMap` of `glsl/lib/tone.glsl`.
fn tone_map(color: DVec3) -> DVec3 {
    const START: f64 = 0.6;
    let peak = color.max_element();
    if peak <= START {
        return color;
    }
    let room = 1.0 - START;
    let mapped = 1.0 - room * room / (peak - START + room);
    let white = 1.0 - 1.0 / (0.15 * (peak - mapped) + 1.0);
    (color * (mapped / peak)).lerp(DVec3::splat(mapped), white)
}

/// Encodes a linear value as sRGB (IEC 61966-2-1).
fn srgb_encode(c: f64) -> f64 {
    let c = c.clamp(0.0, 1.0);
    if c > 0.0031308 { 1.055 * c.powf(1.0 / 2.4) - 0.055 } else { 12.92 * c }
}
