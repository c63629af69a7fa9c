//! Mirror of `glsl/revectorization/rbsm.comp`: the functions of [`super::revectorize`] over the tests on a receiver's plane.

use super::map_receiver::{MapReceiver, OpenReceiver, receive, receive_point};
use super::revectorize::{self, Crack, Function, Outcome, Quality, Side};
use super::view::{FrameData, Mirror, ROUNDING, Receiver, Verdict, View, shadow_test};
use crate::Result;
use glam::{DVec2, dvec2};
use std::cell::RefCell;

/// Settings of the pass.
#[derive(Clone, Copy, Debug)]
pub struct Settings {
    /// What becomes of a fragment at an edge.
    pub function: Function,
    /// All texels are compared with the fragment's own depth.
    pub fixed_depth: bool,
    /// `MAXDIST`, texels.
    pub max_distance: u32,
    /// Multiples of what a plane needs.
    pub normal_offset: f32,
    /// Fraction of a texel's slope, along both axes.
    pub depth_bias: f32,
    /// Texels of depth a texel of distance that a curved receiver may lie before its plane.
    pub slack: f32,
}

/// So many tests in doubt are tried out both ways; with more the pixel is.
const MOST_TRIED: usize = 4;

/// Single precision in the last steps, from a place in the texel to a decision: texels.
pub(super) const PLACE_ROUNDING: f64 = 40.0 * ROUNDING;

/// The visibility of every pixel.
///
/// # Errors
/// Images that do not fit the constants.
pub fn visibility(data: &FrameData<'_>, settings: &Settings) -> Result<Mirror> {
    let view = View::new(data)?;
    let pixels = view.every_pixel(|p| {
        let receiver = receive(&view, p, settings.normal_offset, settings.depth_bias);
        verdict(&view, receiver, settings)
    });
    Ok(Mirror::collect(pixels))
}

fn verdict(view: &View<'_>, receiver: MapReceiver, settings: &Settings) -> Verdict {
    match receiver {
        MapReceiver::Decided(verdict) => verdict,
        MapReceiver::Open(r) => r.with_doubts(look_up(&Tests::new(view, &r, settings), settings)),
    }
}

/// The visibility of any point on a surface.
pub(super) fn visibility_at(view: &View<'_>, r: &Receiver, settings: &Settings) -> Verdict {
    verdict(view, receive_point(view, r, settings.normal_offset, settings.depth_bias), settings)
}

/// The tests of a pixel.
#[derive(Clone)]
pub(super) struct Tests<'a> {
    view: &'a View<'a>,
    /// In texels.
    pub place: DVec2,
    pub place_error: DVec2,
    depth: f64,
    depth_error: f64,
    slope: DVec2,
    slope_error: DVec2,
    slack: f64,
    /// True if the map's border goes on beyond the map; otherwise all is lit there.
    map_goes_on: bool,
}

impl<'a> Tests<'a> {
    pub fn new(view: &'a View<'a>, r: &OpenReceiver, settings: &Settings) -> Self {
        let extent = view.map_extent();
        let place = r.light.uv * extent;
        let flat = if settings.fixed_depth { 0.0 } else { 1.0 };
        Self {
            view,
            place,
            place_error: r.light.uv_error * extent + ROUNDING * place.abs(),
            depth: r.light.depth - r.bias,
            depth_error: r.light.depth_error + r.bias_error,
            slope: flat * r.plane.slope / extent,
            slope_error: flat * r.plane.error / extent,
            slack: flat * f64::from(settings.slack) * r.texel_depth,
            map_goes_on: false,
        }
    }

    /// Returns the same tests with or without `MAP_GOES_ON`.
    pub fn with_map_going_on(self, map_goes_on: bool) -> Self {
        Self { map_goes_on, ..self }
    }

    /// The texels that the place may lie in, the exact one first.
    pub fn texels(&self) -> Vec<[i64; 2]> {
        let axis = |i: usize| {
            let mut found = vec![self.place[i].floor() as i64];
            for moved in [self.place[i] - self.place_error[i], self.place[i] + self.place_error[i]] {
                if !found.contains(&(moved.floor() as i64)) {
                    found.push(moved.floor() as i64);
                }
            }
            found
        };
        let columns = axis(0);
        axis(1).into_iter().flat_map(|y| columns.iter().map(move |&x| [x, y])).collect()
    }

    /// The place in a texel that it may lie in.
    pub fn fraction(&self, texel: [i64; 2]) -> DVec2 {
        (self.place - vector(texel)).clamp(DVec2::ZERO, DVec2::splat(1.0 - f64::EPSILON))
    }

    /// The test of a texel, by the plane through the centre of `first`.
    pub fn test(&self, first: [i64; 2], texel: [i64; 2]) -> super::view::Decision {
        let texel = if self.map_goes_on { self.view.nearest_texel(texel) } else { texel };
        let away = vector(texel) - vector(first);
        let from_place = vector(texel) + 0.5 - self.place;
        let steps = away.x.abs() + away.y.abs();
        let reference = self.depth + self.slope.dot(from_place) - self.slack * steps;
        let error = self.depth_error
            + self.slope.abs().dot(self.place_error)
            + self.slope_error.dot(from_place.abs())
            + ROUNDING * (1.0 + 2.0 * self.slope.abs().dot(from_place.abs()) + 4.0 * self.slack * steps);
        shadow_test(reference, error, self.view.stored(texel))
    }

    /// What `ask` says of the tests around a texel, and how far tests in doubt may take its visibility from that.
    pub fn ask<T>(
        &self,
        first: [i64; 2],
        visibility: impl Fn(&T) -> f64,
        ask: impl Fn(&dyn Fn([i64; 2]) -> bool) -> T,
    ) -> (T, f64) {
        let doubtful = RefCell::new(vec![]);
        let lit = |flipped: &[[i64; 2]], texel: [i64; 2]| {
            let test = self.test(first, texel);
            if test.is_doubtful() && !doubtful.borrow().contains(&texel) {
                doubtful.borrow_mut().push(texel);
            }
            test.is_yes() != flipped.contains(&texel)
        };
        let outcome = ask(&|t| lit(&[], t));
        let tried = doubtful.borrow().clone();
        if tried.len() > MOST_TRIED {
            return (outcome, 1.0);
        }
        let mut doubt = 0.0f64;
        for subset in 1..1usize << tried.len() {
            let flipped: Vec<_> = (0..tried.len()).filter(|i| subset >> i & 1 == 1).map(|i| tried[i]).collect();
            let other = ask(&|t| lit(&flipped, t));
            doubt = doubt.max((visibility(&other) - visibility(&outcome)).abs());
        }
        // The other way may have come upon more.
        let doubt = if doubtful.borrow().len() > tried.len() { 1.0 } else { doubt };
        (outcome, doubt)
    }
}

/// What `rbsm_view.comp` finds of a pixel; channels left, right, +v, -v.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Intermediates {
    /// Listing 2's packed form.
    pub discontinuity: [f64; 3],
    /// Listing 3's signed steps; 0 where there is no edge.
    pub traversal: [f64; 4],
    /// The edge profile's height over each side that differs, texels.
    pub height: [f64; 4],
    /// False where a test or the place in the map may rightly differ in single precision.
    pub sure: bool,
}

/// The intermediates of every pixel; `quality` is that of the profile.
///
/// # Errors
/// Images that do not fit the constants.
pub fn intermediates(data: &FrameData<'_>, settings: &Settings, quality: Quality) -> Result<Vec<Intermediates>> {
    let view = View::new(data)?;
    Ok(view.every_pixel(|p| match receive(&view, p, settings.normal_offset, settings.depth_bias) {
        MapReceiver::Decided(verdict) => Intermediates {
            discontinuity: [0.0, 0.0, 1.0 - verdict.visibility],
            sure: verdict.doubt == 0.0,
            ..Intermediates::default()
        },
        MapReceiver::Open(r) => {
            let tests = Tests::new(&view, &r, settings);
            let texels = tests.texels();
            let ask = |lit: &dyn Fn([i64; 2]) -> bool| found_at(&tests, texels[0], lit, settings, quality);
            // Any test in doubt makes the pixel so.
            let doubt = RefCell::new(false);
            let found = ask(&|t| {
                let test = tests.test(texels[0], t);
                *doubt.borrow_mut() |= test.is_doubtful();
                test.is_yes()
            });
            let sure = texels.len() == 1 && !*doubt.borrow() && !r.is_doubtful();
            Intermediates { sure, ..found }
        }
    }))
}

fn found_at(
    tests: &Tests<'_>,
    texel: [i64; 2],
    lit: &dyn Fn([i64; 2]) -> bool,
    settings: &Settings,
    quality: Quality,
) -> Intermediates {
    let texels = |t| lit(t);
    let d = revectorize::discontinuity(&texels, texel);
    let mut found = Intermediates { discontinuity: d.packed().to_array(), ..Intermediates::default() };
    if d.mask == 0 {
        return found;
    }
    let fraction = tests.fraction(texel);
    found.traversal = revectorize::traverse_all(&texels, texel, d, settings.max_distance).map(|t| t as f64);
    found.height = Side::ALL.map(|side| {
        if !d.at(side) {
            return 0.0;
        }
        let crack = Crack { texel, side, lit: d.lit };
        let profile = revectorize::profile(&texels, crack, quality, settings.max_distance);
        profile.height(profile.before + if side.is_horizontal() { fraction.y } else { fraction.x })
    });
    found
}

pub(super) fn look_up(tests: &Tests<'_>, settings: &Settings) -> Verdict {
    let mut found: Option<Verdict> = None;
    for texel in tests.texels() {
        let fraction = tests.fraction(texel);
        let ask = |lit: &dyn Fn([i64; 2]) -> bool| {
            revectorize::visibility(&|t| lit(t), texel, fraction, settings.function, settings.max_distance)
        };
        let (outcome, doubt) = tests.ask(texel, |o: &Outcome| o.visibility, ask);
        let place_error = tests.place_error.length() + PLACE_ROUNDING;
        // A ramp changes by at most 1 a texel along each axis.
        let is_ramp = settings.function == Function::Filtered;
        let rounding = if is_ramp { tests.place_error.x + tests.place_error.y + PLACE_ROUNDING } else { 0.0 };
        let verdict = Verdict { visibility: outcome.visibility, doubt, rounding };
        let verdict = if outcome.margin <= place_error { verdict.or(1.0 - outcome.visibility) } else { verdict };
        found = Some(found.map_or(verdict, |first| first.or_verdict(verdict)));
    }
    // There is at least the exact texel.
    found.unwrap_or(Verdict::sure(1.0))
}

fn vector(v: [i64; 2]) -> DVec2 {
    dvec2(v[0] as f64, v[1] as f64)
}
