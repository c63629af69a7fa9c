//! Mirror of `glsl/revectorization/rpcf.comp`: the mean of a visibility function over texel offsets, every sample
//! computed separately.

use super::rbsm::Settings;
use super::revectorize;
use crate::Result;
use crate::reference::common::map_receiver::{MapReceiver, receive};
use crate::reference::common::rbsm_receiver::{PLACE_ROUNDING, Tests};
use crate::reference::common::view::{FrameData, Mirror, ROUNDING, Verdict, View};

/// Returns the filtered visibility of every pixel, over `width` x `width` texels; `width` is odd.
///
/// # Errors
/// Fails if the images do not fit the constants.
pub fn visibility(data: &FrameData<'_>, settings: &Settings, width: u32) -> Result<Mirror> {
    let view = View::new(data)?;
    let pixels = view.every_pixel(|p| match receive(&view, p, settings.normal_offset, settings.depth_bias) {
        MapReceiver::Decided(verdict) => verdict,
        MapReceiver::Open(r) => r.with_doubts(average(&Tests::new(&view, &r, &settings.receiver()), settings, width)),
    });
    Ok(Mirror::collect(pixels))
}

fn average(tests: &Tests<'_>, settings: &Settings, width: u32) -> Verdict {
    let half = i64::from(width / 2);
    let mut found: Option<Verdict> = None;
    for base in tests.texels() {
        let fraction = tests.fraction(base);
        let mut sum = Verdict::sure(0.0);
        let offsets = (-half..=half).flat_map(|j| (-half..=half).map(move |i| [i, j]));
        for [i, j] in offsets {
            let texel = [base[0] + i, base[1] + j];
            let (outcome, doubt) = tests.ask(
                base,
                |o: &revectorize::Outcome| o.visibility,
                |lit| revectorize::visibility(&|t| lit(t), texel, fraction, settings.function, settings.max_distance),
            );
            let on_line = outcome.margin <= tests.place_error.length() + PLACE_ROUNDING;
            sum.visibility += outcome.visibility;
            sum.doubt += if on_line { 1.0 } else { doubt };
            let moved = tests.place_error.x + tests.place_error.y + PLACE_ROUNDING;
            sum.rounding += settings.function.slope() * moved;
        }
        let area = f64::from(width * width);
        let mean = Verdict {
            visibility: sum.visibility / area,
            doubt: (sum.doubt / area).min(1.0),
            // Each addition of the sum is rounded.
            rounding: sum.rounding / area + ROUNDING * f64::from(width),
        };
        found = Some(found.map_or(mean, |first| first.or_verdict(mean)));
    }
    // The loop visits at least the exact texel.
    found.unwrap_or(Verdict::sure(1.0))
}
