//! Mirror of `glsl/filtering/sm.comp` and `glsl/common/shadow_map_test.glsl`.

use super::view::{DEPTH_ULPS, FrameData, Mirror, ROUNDING, Verdict, View, shadow_test};
use crate::Result;

/// The hard test of every pixel; the two settings are the technique's own.
///
/// # Errors
/// Images that do not fit the constants.
pub fn visibility(data: &FrameData<'_>, normal_offset: f32, depth_bias: f32) -> Result<Mirror> {
    let view = View::new(data)?;
    Ok(Mirror::collect(view.every_pixel(|p| pixel(&view, p, normal_offset.into(), depth_bias.into()))))
}

fn pixel(view: &View<'_>, at: [usize; 2], normal_offset: f64, depth_bias: f64) -> Verdict {
    let Some(r) = view.receiver(at) else { return Verdict::sure(1.0) };
    let facing = view.faces_light(&r);
    let verdict = test(view, &r, normal_offset, depth_bias);
    match facing.is_yes() {
        true if facing.is_doubtful() => verdict.or(0.0),
        true => verdict,
        false if facing.is_doubtful() => Verdict::sure(0.0).or(verdict.visibility + verdict.doubt),
        false => Verdict::sure(0.0),
    }
}

pub(super) fn test(view: &View<'_>, r: &super::view::Receiver, normal_offset: f64, depth_bias: f64) -> Verdict {
    let first = view.light_point(r.position, r.position_error);
    if !first.inside.is_yes() {
        return if first.inside.is_doubtful() { Verdict::sure(1.0).or(0.0) } else { Verdict::sure(1.0) };
    }
    let (p, error) = view.offset(r, &first, normal_offset);
    let l = view.light_point(p, error);
    if !l.inside.is_yes() {
        return if l.inside.is_doubtful() { Verdict::sure(1.0).or(0.0) } else { Verdict::sure(1.0) };
    }
    let x = l.uv * view.map_extent();
    let x_error = l.uv_error * view.map_extent() + ROUNDING * x;
    let texel = |v: f64, axis: usize| (v.floor() as i64).clamp(0, view.map_size[axis] as i64 - 1);
    let reference = l.depth - depth_bias - DEPTH_ULPS;
    let reference_error = l.depth_error + ROUNDING * depth_bias;
    let lit = |t| shadow_test(reference, reference_error, view.stored(t));
    let exact = lit([texel(x.x, 0), texel(x.y, 1)]);
    let mut verdict = Verdict::sure(if exact.is_yes() { 1.0 } else { 0.0 });
    // All texels that the point may have fallen into.
    for j in [texel(x.y - x_error.y, 1), texel(x.y + x_error.y, 1)] {
        for i in [texel(x.x - x_error.x, 0), texel(x.x + x_error.x, 0)] {
            let other = lit([i, j]);
            if other.is_doubtful() || other.is_yes() != exact.is_yes() {
                verdict = verdict.or(1.0 - verdict.visibility);
            }
        }
    }
    if first.inside.is_doubtful() || l.inside.is_doubtful() { verdict.or(1.0) } else { verdict }
}
