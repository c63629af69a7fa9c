//! Mirror of `glsl/soft/screen_filter.comp`, for both passes.
//!
//! It finds the footprint in another way than the shader: from where view rays meet the plane, and from where points
//! of the plane are seen.

use crate::reference::common::surface::{Apart, near_plane, same_depth};
use crate::reference::common::view::{Decision, FrameData, Mirror, ROUNDING, Receiver, View};
use crate::technique::common::surface::SurfaceTest;
use crate::technique::soft::screen_filter::{Footprint, Kernel};
use crate::{Error, Result};
use glam::{DVec2, DVec3, dvec2};

/// `GRAZING` of `glsl/lib/footprint.glsl`.
const GRAZING: f64 = 0.05;
/// `GAUSSIAN_REACH` and `LONGEST` of the shader.
const GAUSSIAN_REACH: f64 = 3.0;
const LONGEST: f64 = 4096.0;

/// Settings of the passes.
#[derive(Clone, Copy, Debug)]
pub struct Settings {
    /// Weights of the taps.
    pub kernel: Kernel,
    /// Shape of the filter in the image.
    pub footprint: Footprint,
    /// Largest number of taps per pass; odd.
    pub taps: u32,
    /// Test that decides whether two pixels lie on one surface.
    pub surfaces: SurfaceTest,
    /// Tolerance of that test: pixels off the plane per pixel, or a fraction of the eye depth.
    pub tolerance: f32,
    /// Standard deviation of the Gaussian, in penumbra widths.
    pub sigma: f32,
    /// Weighs taps by a Gaussian of their difference in eye depth; `tolerance` is its standard deviation, a fraction of
    /// the eye depth.
    pub smooth_range: bool,
    /// Makes the first pass bilateral too.
    pub both_bilateral: bool,
}

/// Weight of a tap that counts fully.
const ONE: Range = (1.0, 0.0);

/// Data of a pixel between the passes.
#[derive(Clone, Copy, Debug)]
struct Value {
    value: f64,
    doubt: f64,
    rounding: f64,
}

/// Weight of a tap by its difference in eye depth, and the bound of its error.
type Range = (f64, f64);

/// Tap: its value, its weight with the bound of that weight's error, and whether it counts.
type Tap = (Value, Range, Decision);

/// Returns the visibility of every pixel from the hard shadows and the penumbra widths, world units.
///
/// # Errors
/// Fails if the images do not fit the constants.
pub fn visibility(data: &FrameData<'_>, settings: &Settings, hard: &[f32], widths: &[f32]) -> Result<Mirror> {
    let view = View::new(data)?;
    for (what, found) in [("hard shadows", hard.len()), ("widths", widths.len())] {
        if found != view.size[0] * view.size[1] {
            return Err(Error::Usage(format!("mirror: {found} {what} for {:?} pixels", view.size)));
        }
    }
    let mut values: Vec<Value> = hard.iter().map(|&v| Value { value: v.into(), doubt: 0.0, rounding: 0.0 }).collect();
    for second in [false, true] {
        values = view.every_pixel(|pixel| {
            let (own, width) = (values[view.index(pixel)], f64::from(widths[view.index(pixel)]));
            match view.receiver(pixel) {
                Some(p) if width > 0.0 => Pass { view: &view, s: settings, second }.mean(pixel, &p, width, &values),
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

struct Pass<'a> {
    view: &'a View<'a>,
    s: &'a Settings,
    second: bool,
}

impl Pass<'_> {
    /// Returns the vector from the middle to the end of the filter on a receiver, pixels.
    fn reach(&self, pixel: [usize; 2], p: &Receiver, half_width: f64) -> DVec2 {
        let center = dvec2(pixel[0] as f64, pixel[1] as f64);
        // Image steps on a plane with normal `n`, from nearby rays.
        let steps = |n: DVec3| {
            let step = |d: DVec2| {
                let seen = |by: f64| self.view.meet(center + by * d, p.position, n);
                (seen(1e-3) - seen(-1e-3)) / 2e-3
            };
            [step(DVec2::X), step(DVec2::Y)]
        };
        let [x, y] = steps(DVec3::Z);
        let n = p.normal;
        // Image displacement of a point that moves by `d`, to first order.
        let pixels_of = |d: DVec3| {
            let small = 1e-3 * x.length() / d.length().max(1e-300);
            (self.view.pixel_of(p.position + small * d) - self.view.pixel_of(p.position - small * d)) / (2.0 * small)
        };
        let reach = match self.s.footprint {
            Footprint::Screen if self.second => dvec2(0.0, half_width / y.length()),
            Footprint::Screen => dvec2(half_width / x.length(), 0.0),
            Footprint::Plane => {
                let ray = self.view.ray(p.position);
                let [x, y] = match n.dot(ray) < -GRAZING {
                    true => steps(n),
                    // View rays no longer meet the plane usefully.
                    false => [x, y].map(|d| d + ray * (n.dot(d) / GRAZING)),
                };
                in_plane(x, y, half_width, self.second)
            }
            Footprint::Light => {
                let towards = self.view.towards_light(p.position, DVec3::ZERO).0;
                let axis = self.view.light_side(usize::from(self.second));
                let facing = n.dot(towards).max(GRAZING);
                pixels_of(half_width * (axis - towards * (n.dot(axis) / facing)))
            }
        };
        match self.s.kernel {
            Kernel::Box => reach,
            Kernel::Gaussian => reach * 2.0 * f64::from(self.s.sigma) * GAUSSIAN_REACH,
        }
    }

    /// Returns `reach` with the bound of its error, from how it changes with its inputs.
    fn bounded_reach(&self, pixel: [usize; 2], p: &Receiver, half_width: f64) -> (DVec2, f64) {
        let reach = self.reach(pixel, p, half_width);
        let mut error = 0.0;
        for axis in DVec3::AXES {
            let moved = axis * p.position_error.max_element();
            let turned = (p.normal + axis * (p.normal_error + 2.0 * ROUNDING)).normalize();
            for other in [Receiver { position: p.position + moved, ..*p }, Receiver { normal: turned, ..*p }] {
                error += (self.reach(pixel, &other, half_width) - reach).length();
            }
        }
        (reach, 2.0 * error + 8.0 * ROUNDING * reach.length())
    }

    fn mean(&self, pixel: [usize; 2], p: &Receiver, width: f64, values: &[Value]) -> Value {
        let own = values[self.view.index(pixel)];
        let (reach, reach_error) = self.bounded_reach(pixel, p, 0.5 * width);
        let length = reach.abs().max_element();
        let m = length.min(LONGEST);
        if !m.is_finite() || reach_error > 0.1 * length {
            return Value { doubt: 1.0, ..own };
        }
        if m <= 0.5 {
            return own;
        }
        let most = f64::from(self.s.taps);
        let relative = reach_error / length + ROUNDING;
        let between = (2.0 * m / most).max(1.0);
        let half_taps = m / between;
        let number = |half_taps: f64| ((half_taps - 0.5).ceil() as i64).min(i64::from(self.s.taps / 2));
        let taps = number(half_taps);
        let gaussian = self.s.kernel == Kernel::Gaussian;
        let weight = |i: i64| match gaussian {
            true => (-0.5 * (GAUSSIAN_REACH * i as f64 / half_taps).powi(2)).exp(),
            false => (half_taps + 0.5 - i.abs() as f64).clamp(0.0, 1.0),
        };
        let mut found: Vec<Tap> = vec![(own, (weight(0), 0.0), Decision::Yes)];
        for i in (-taps..=taps).filter(|i| *i != 0) {
            let place = reach / length * (between * i as f64);
            let error = place.abs().max_element() * relative + reach_error / length + 2.0 * ROUNDING;
            let rounded = |x: f64| (x + 0.5).floor() as i64;
            let nominal = [rounded(place.x), rounded(place.y)];
            let mut offsets = vec![];
            // A position that is exactly an integer stays one.
            for x in if reach.x == 0.0 { 0..=0 } else { rounded(place.x - error)..=rounded(place.x + error) } {
                for y in if reach.y == 0.0 { 0..=0 } else { rounded(place.y - error)..=rounded(place.y + error) } {
                    offsets.push([x, y]);
                }
            }
            for &offset in &offsets {
                let Some((value, range, same)) = self.tap(pixel, p, offset, values) else { continue };
                let is_nominal = offset == nominal;
                let taken = if offsets.len() == 1 { same } else { Decision::Doubtful(is_nominal && same.is_yes()) };
                found.push((value, (weight(i) * range.0, weight(i) * range.1), taken));
            }
        }
        let taken = || found.iter().filter(|t| t.2.is_yes());
        let weights: f64 = taken().map(|t| t.1.0).sum();
        let mean = |of: &dyn Fn(&Value) -> f64| taken().map(|t| t.1.0 * of(&t.0)).sum::<f64>() / weights;
        let value = mean(&|v| v.value);
        // Each tap that flips moves the mean towards or away from its value.
        let sure: f64 = found.iter().filter(|t| t.2 == Decision::Yes).map(|t| t.1.0).sum();
        let flips: f64 =
            found.iter().filter(|t| t.2.is_doubtful()).map(|t| t.1.0 * (t.0.value - value).abs() / sure).sum();
        let ranges: f64 = taken().map(|t| t.1.1 * (t.0.value - value).abs() / weights).sum();
        // A Gaussian has one more tap at each end where the number of taps is in doubt.
        let ends = if gaussian && number(half_taps * (1.0 + relative)) != number(half_taps * (1.0 - relative)) {
            2.0 * weight(taps) / sure
        } else {
            0.0
        };
        let uniform = taken().all(|t| t.0.value == value && t.0.rounding == 0.0);
        // Change of the weights: those at the ends of a box, or all of a Gaussian's by up to nine times as much.
        let weighing = if gaussian { 2.0 * (1.0 + GAUSSIAN_REACH * GAUSSIAN_REACH) } else { 2.0 * half_taps / weights };
        Value {
            value,
            doubt: mean(&|v| v.doubt) + flips + ends,
            rounding: mean(&|v| v.rounding)
                + ranges
                + if uniform { ROUNDING } else { weighing * relative + ROUNDING * (2 * taps + 1) as f64 },
        }
    }

    /// Returns the tap; `None` outside the image, at the sky, or surely on another surface.
    fn tap(&self, pixel: [usize; 2], p: &Receiver, offset: [i64; 2], values: &[Value]) -> Option<Tap> {
        let view = self.view;
        let place =
            |axis: usize| usize::try_from(pixel[axis] as i64 + offset[axis]).ok().filter(|x| *x < view.size[axis]);
        let at = [place(0)?, place(1)?];
        let q = view.is_surface(at).then(|| view.position_at(at, view.depth_at(at)))?;
        let value = values[view.index(at)];
        if offset == [0, 0] {
            return Some((value, ONE, Decision::Yes));
        }
        // A pixel outside a spot light's cone has no information about its shadows.
        let reached = match view.light_distance(q.0) {
            Some(_) => view.light_point(q.0, q.1).within_sides,
            None => Decision::Yes,
        };
        if reached == Decision::No {
            return None;
        }
        if !(self.second || self.s.both_bilateral) {
            return Some((value, ONE, reached));
        }
        let vector = q.0 - p.position;
        let tolerance = f64::from(self.s.tolerance);
        if self.s.smooth_range {
            let sigma = tolerance * p.position.z.abs();
            let sigmas = vector.z / sigma;
            let error = (p.position_error.z + q.1.z + ROUNDING * vector.z.abs()) / sigma
                + sigmas.abs() * (p.position_error.z / p.position.z.abs() + ROUNDING);
            let weight = (-0.5 * sigmas * sigmas).exp();
            return Some((value, (weight, weight * (sigmas.abs() * error + 0.5 * error * error + ROUNDING)), reached));
        }
        let same = match self.s.surfaces {
            SurfaceTest::Depth => same_depth(p.position.z, q.0.z, p.position_error.z + q.1.z, tolerance),
            SurfaceTest::Planes => {
                let error = (p.position_error + q.1).length() + view.clip_plane_error(at, p);
                let width = view.pixel_width(p.position, p.position_error);
                let pixels = dvec2(offset[0] as f64, offset[1] as f64).length();
                near_plane((p.normal, p.normal_error), &Apart { vector, error }, pixels, width, tolerance)
            }
        };
        (same != Decision::No).then_some((value, ONE, same.and(reached)))
    }
}

/// Returns half a side, in pixels, of a square in a plane: along the image's rows, or perpendicular to that side. `x`
/// and `y` are the steps on the plane for one pixel right and one pixel down.
fn in_plane(x: DVec3, y: DVec3, half_width: f64, second: bool) -> DVec2 {
    if !second {
        return dvec2(half_width / x.length(), 0.0);
    }
    // half_width w = a x + b y, with w a unit vector perpendicular to x.
    let unit = x.normalize();
    let along = unit.dot(y);
    let b = half_width / (y - unit * along).length();
    dvec2(-b * along / x.length(), b)
}
