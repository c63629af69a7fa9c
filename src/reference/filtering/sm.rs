//! Mirror of `glsl/filtering/sm.comp`.

use crate::Result;
use crate::reference::common::shadow_map_test::test;
use crate::reference::common::view::{FrameData, Mirror, Verdict, View};

/// Returns the hard shadow test of every pixel; the two settings are those of the technique.
///
/// # Errors
/// Fails if the images do not fit the constants.
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
