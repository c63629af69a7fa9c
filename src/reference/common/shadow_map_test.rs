//! Mirror of `glsl/common/shadow_map_test.glsl`: one hard test of a point.

use super::view::{DEPTH_ULPS, ROUNDING, Receiver, Verdict, View, shadow_test};

pub(crate) fn test(view: &View<'_>, r: &Receiver, normal_offset: f64, depth_bias: f64) -> Verdict {
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
    // Try all texels that the point may have fallen into.
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
