//! Mirror of `glsl/penumbra/mean_filter.comp`, for both axes.

use crate::reference::common::surface::{Apart, is_smooth, one_patch, same_depth};
use crate::reference::common::view::{Decision, FrameData, Mirror, ROUNDING, Receiver, View};
use crate::technique::common::surface::SurfaceTest;
use crate::{Error, Result};

/// Settings of the passes.
#[derive(Clone, Copy, Debug)]
pub struct Settings {
    /// Test that decides whether two pixels lie on one surface.
    pub surfaces: SurfaceTest,
    /// Tolerance of that test: pixels off the plane per pixel of distance, or a fraction of the eye depth.
    pub tolerance: f32,
    /// Width of the filter: world units, or a fraction of the penumbra's width.
    pub filter_width: f32,
    /// Largest number of taps per pass; odd.
    pub taps: u32,
}

/// Data of a pixel between the passes.
#[derive(Clone, Copy, Debug)]
struct Value {
    value: f64,
    doubt: f64,
    rounding: f64,
    /// `true` within reach of a shadow edge, where the pixel is filtered.
    near: bool,
}

/// Largest error of a unit normal stored with 15 bits per octahedral axis (`packNormal` of
/// `glsl/penumbra/seed_format.glsl`); compare `NORMAL_STEP` of the seeds.
const PACKED_STEP: f64 = 4.26 / 32767.0;

/// Tap: its value, and whether it counts.
type Tap = (Value, Decision);

/// Returns the visibility of every pixel from its intensity. Out of an edge's reach, the intensity is the visibility
/// minus 2.
///
/// # Errors
/// Fails if the images do not fit the constants.
pub fn visibility(data: &FrameData<'_>, settings: &Settings, intensity: &[f32]) -> Result<Mirror> {
    let width = f64::from(settings.filter_width);
    filtered(data, settings, intensity, |_| width)
}

/// Returns the visibility where every pixel has a penumbra width of its own, world units. The filter's width is a
/// fraction of it.
///
/// # Errors
/// Fails if the images do not fit the constants.
pub fn visibility_by_widths(
    data: &FrameData<'_>,
    settings: &Settings,
    intensity: &[f32],
    widths: &[f32],
) -> Result<Mirror> {
    if widths.len() != intensity.len() {
        return Err(Error::Usage(format!("mirror: {} widths for {} intensities", widths.len(), intensity.len())));
    }
    let share = f64::from(settings.filter_width);
    filtered(data, settings, intensity, |pixel| share * f64::from(widths[pixel]))
}

fn filtered(
    data: &FrameData<'_>,
    settings: &Settings,
    intensity: &[f32],
    filter_width: impl Fn(usize) -> f64 + Sync,
) -> Result<Mirror> {
    let view = View::new(data)?;
    if intensity.len() != view.size[0] * view.size[1] {
        return Err(Error::Usage(format!("mirror: {} intensities for {:?} pixels", intensity.len(), view.size)));
    }
    let value = |v: &f32| {
        let near = *v >= -0.5;
        Value { value: f64::from(*v) + if near { 0.0 } else { 2.0 }, doubt: 0.0, rounding: 0.0, near }
    };
    let mut values: Vec<Value> = intensity.iter().map(value).collect();
    for axis in 0..2 {
        values = view.every_pixel(|pixel| {
            let i = view.index(pixel);
            let own = values[i];
            match view.receiver(pixel) {
                Some(p) if own.near => mean(&view, (settings, filter_width(i)), axis, pixel, &p, &values),
                _ => own,
            }
        });
    }
    Ok(Mirror {
        visibility: values.iter().map(|v| v.value).collect(),
        doubt: values.iter().map(|v| v.doubt.min(1.0)).collect(),
        rounding: values.iter().map(|v| v.rounding).collect(),
    })
}

fn mean(
    view: &View<'_>,
    (s, filter_width): (&Settings, f64),
    axis: usize,
    pixel: [usize; 2],
    p: &Receiver,
    values: &[Value],
) -> Value {
    let own = values[view.index(pixel)];
    let (width, width_error) = view.pixel_width(p.position, p.position_error);
    let pixels = filter_width / width;
    let pixels_error = pixels * (width_error / width + ROUNDING);
    let half_taps = |pixels: f64| match pixels > 1.0 {
        // There is one tap per pixel of the filter's width, made odd, and at most `taps`.
        true => (s.taps.min(pixels.ceil().min(64.0) as u32 | 1) / 2) as i64,
        false => 0,
    };
    let half = half_taps(pixels);
    let number_in_doubt = [-pixels_error, pixels_error].iter().any(|e| half_taps(pixels + e) != half);
    let mut taps: Vec<Tap> = vec![(own, Decision::Yes)];
    for i in (-half..=half).filter(|i| *i != 0) {
        let step = 0.5 * i as f64 / half as f64;
        let (place, error) = (step * pixels, step.abs() * pixels_error + ROUNDING * (step * pixels).abs());
        // Half a pixel may be rounded either way.
        let offsets = [place - error, place, place + error].map(|x| (x + 0.5).floor() as i64);
        let is_sure = offsets[0] == offsets[2];
        taps.extend(
            tap(view, s, axis, pixel, p, offsets[1], values).map(|t| if is_sure { t } else { doubtful(t, true) }),
        );
        if !is_sure {
            let other = if offsets[0] == offsets[1] { offsets[2] } else { offsets[0] };
            taps.extend(tap(view, s, axis, pixel, p, other, values).map(|t| doubtful(t, false)));
        }
    }
    let taken: Vec<&Value> = taps.iter().filter(|t| t.1.is_yes()).map(|t| &t.0).collect();
    let count = taken.len() as f64;
    let value = taken.iter().map(|v| v.value).sum::<f64>() / count;
    // Each tap that flips moves the mean towards or away from its value.
    let sure_count = taps.iter().filter(|t| t.1 == Decision::Yes).count() as f64;
    let flips: f64 = taps.iter().filter(|t| t.1.is_doubtful()).map(|t| (t.0.value - value).abs() / sure_count).sum();
    Value {
        value,
        doubt: taken.iter().map(|v| v.doubt).sum::<f64>() / count + flips + if number_in_doubt { 1.0 } else { 0.0 },
        rounding: taken.iter().map(|v| v.rounding).sum::<f64>() / count + ROUNDING * count,
        near: true,
    }
}

fn doubtful((value, taken): Tap, nominal: bool) -> Tap {
    (value, Decision::Doubtful(nominal && taken.is_yes()))
}

/// Returns the tap; `None` outside the image, at the sky, or surely on another surface.
fn tap(
    view: &View<'_>,
    s: &Settings,
    axis: usize,
    pixel: [usize; 2],
    p: &Receiver,
    offset: i64,
    values: &[Value],
) -> Option<Tap> {
    let mut at = pixel;
    at[axis] = usize::try_from(pixel[axis] as i64 + offset).ok().filter(|x| *x < view.size[axis])?;
    let q = view.receiver(at)?;
    let vector = q.position - p.position;
    let tolerance = f64::from(s.tolerance);
    let same = match s.surfaces {
        SurfaceTest::Depth => {
            same_depth(p.position.z, q.position.z, p.position_error.z + q.position_error.z, tolerance)
        }
        SurfaceTest::Planes => {
            let error = (p.position_error + q.position_error).length() + ROUNDING * vector.length();
            let width = view.pixel_width(p.position, p.position_error);
            let (n, m) = ((p.normal, p.normal_error), (q.normal, q.normal_error + PACKED_STEP));
            let pixels = offset.unsigned_abs() as f64;
            is_smooth(n, m).and(one_patch(n, m, &Apart { vector, error }, pixels, width, tolerance))
        }
    };
    (same != Decision::No).then(|| (values[view.index(at)], same))
}
