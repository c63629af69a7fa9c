//! Mirror of `glsl/common/rbsm_receiver.glsl`: the tests of the texels around a receiver, on its plane.

use super::map_receiver::OpenReceiver;
use super::view::{Decision, ROUNDING, View, shadow_test};
use glam::{DVec2, dvec2};
use std::cell::RefCell;

/// Settings that place a receiver and test the texels around it.
#[derive(Clone, Copy, Debug)]
pub struct ReceiverSettings {
    /// Compares all texels with the fragment's own depth.
    pub fixed_depth: bool,
    /// Normal offset, in multiples of what a plane needs.
    pub normal_offset: f32,
    /// Depth bias, as a fraction of the depth slope per texel, summed over both axes.
    pub depth_bias: f32,
    /// Distance by which a curved receiver may lie in front of its plane, in texel sizes of depth per texel of
    /// distance.
    pub slack: f32,
}

/// Largest number of doubtful tests that are tried both ways; with more, the pixel is in doubt.
const MOST_TRIED: usize = 4;

/// Single-precision error of the last steps from a position in the texel to a decision, texels.
pub(crate) const PLACE_ROUNDING: f64 = 40.0 * ROUNDING;

/// Shadow tests of a pixel.
#[derive(Clone)]
pub(crate) struct Tests<'a> {
    view: &'a View<'a>,
    /// Position in the map, texels.
    pub place: DVec2,
    pub place_error: DVec2,
    depth: f64,
    depth_error: f64,
    slope: DVec2,
    slope_error: DVec2,
    slack: f64,
    /// `true` if the map's border texels repeat outside the map; otherwise everything is lit there.
    map_goes_on: bool,
}

impl<'a> Tests<'a> {
    pub fn new(view: &'a View<'a>, r: &OpenReceiver, settings: &ReceiverSettings) -> Self {
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

    /// Returns the texels that the position may lie in, the exact one first.
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

    /// Returns the position in a texel that it may lie in, 0 to 1 per axis.
    pub fn fraction(&self, texel: [i64; 2]) -> DVec2 {
        (self.place - vector(texel)).clamp(DVec2::ZERO, DVec2::splat(1.0 - f64::EPSILON))
    }

    /// Tests a texel against the receiver's plane, with steps counted from the texel `first`.
    pub fn test(&self, first: [i64; 2], texel: [i64; 2]) -> Decision {
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

    /// Returns what `ask` computes from the tests around a texel, and how far doubtful tests may change its
    /// visibility.
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
        // With the doubtful tests flipped, `ask` may have met further ones, which were not tried.
        let doubt = if doubtful.borrow().len() > tried.len() { 1.0 } else { doubt };
        (outcome, doubt)
    }
}

fn vector(v: [i64; 2]) -> DVec2 {
    dvec2(v[0] as f64, v[1] as f64)
}
