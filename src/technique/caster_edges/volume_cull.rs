//! Finds the rectangle of the image in which a camera can see a shadow volume; it is empty if the camera cannot see the
//! volume. The rectangle is conservative and computed in `f64`.
//!
//! A volume is bounded by the caster's box, swept away from the light: the convex hull of the box's corners and of
//! their images at infinity. In the camera's clip space these are 16 homogeneous points. If all of them lie on one side
//! of a plane through the eye, `x - s w >= 0`, so does the hull, including its parts behind the viewer.

use crate::view::{CameraView, DepthRange, LightView};
use glam::{DAffine3, DMat4, DVec3, DVec4};
use std::ops::Range;

/// Pixels by which a rectangle grows on each side, because rasterisation rounds vertices to fractions of a pixel.
const MARGIN: f64 = 2.0;
/// Fraction of the points' distance from the object's origin by which boxes grow. It covers the rounding of `f32`
/// vertices and matrices.
const ROUNDING: f64 = 1e-5;

/// A rectangle of pixels.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct Rect {
    pub x: Range<u32>,
    pub y: Range<u32>,
}

impl Rect {
    /// The whole image.
    pub fn all([width, height]: [u32; 2]) -> Self {
        Self { x: 0..width, y: 0..height }
    }

    pub fn is_empty(&self) -> bool {
        self.x.is_empty() || self.y.is_empty()
    }

    /// Returns the intersection.
    pub fn cut(&self, other: &Self) -> Self {
        let both = |a: &Range<u32>, b: &Range<u32>| a.start.max(b.start)..a.end.min(b.end);
        Self { x: both(&self.x, &other.x), y: both(&self.y, &other.y) }
    }
}

/// Corners of the box around a sphere, in object space.
fn corners((center, radius): ([f64; 3], f64)) -> [DVec3; 8] {
    let center = DVec3::from(center);
    let half = radius + ROUNDING * (center.length() + radius);
    std::array::from_fn(|i| {
        let sign = |bit: usize| if i >> bit & 1 == 1 { half } else { -half };
        center + DVec3::new(sign(0), sign(1), sign(2))
    })
}

/// True if objects within the sphere (object space) may cast shadows inside the light's frustum. The near plane does
/// not count, because casters in front of it still cast shadows.
pub(crate) fn is_in_light(light: &LightView, world_from_object: &DAffine3, sphere: ([f64; 3], f64)) -> bool {
    let m = light.clip_from_object(world_from_object);
    let points = corners(sphere).map(|c| m * c.extend(1.0));
    let all = |outside: fn(&DVec4) -> bool| points.iter().all(outside);
    !(all(|p| p.x > p.w)
        || all(|p| p.x < -p.w)
        || all(|p| p.y > p.w)
        || all(|p| p.y < -p.w)
        || all(|p| p.z > p.w)
        || all(|p| p.w <= 0.0))
}

/// Points of the box around a sphere, swept away from the light, in clip space. Sphere and light are in object space.
pub(crate) fn swept(clip_from_object: &DMat4, sphere: ([f64; 3], f64), light: DVec4) -> [DVec4; 16] {
    let corners = corners(sphere);
    std::array::from_fn(|i| {
        let corner = corners[i % 8];
        let infinity = light.w * corner - light.truncate();
        *clip_from_object * if i < 8 { corner.extend(1.0) } else { infinity.extend(0.0) }
    })
}

/// Corners of the light's frustum in the camera's clip space.
pub(crate) fn light_range(camera: &CameraView, light: &LightView) -> [DVec4; 8] {
    let m = camera.clip_from_object(&light.world_from_view);
    let view_from_clip = light.clip_from_view.inverse();
    std::array::from_fn(|i| {
        let ndc = |bit: usize, low: f64| if i >> bit & 1 == 1 { 1.0 } else { low };
        let corner = view_from_clip * DVec4::new(ndc(0, -1.0), ndc(1, -1.0), ndc(2, 0.0), 1.0);
        m * (corner / corner.w)
    })
}

/// Distance of a point from a plane, positive inside.
type Side = fn(&DVec4) -> f64;

/// Pixels in which the hull of the points, given in the camera's clip space, can be seen; empty if it cannot be seen.
pub(crate) fn rectangle(points: &[DVec4], depth: DepthRange, size: [u32; 2]) -> Rect {
    let nothing = Rect { x: 0..0, y: 0..0 };
    // Nothing is seen in front of the near plane or beyond the far plane. A far plane at infinity excludes nothing.
    let (near, far): (Side, Side) = match depth {
        DepthRange::Reversed => (|p| p.w - p.z, |p| p.z),
        DepthRange::Standard => (|p| p.z, |p| p.w - p.z),
    };
    let beyond = |inside: Side| points.iter().all(|p| inside(p) < 0.0);
    if points.iter().any(|p| !p.is_finite()) {
        return Rect::all(size);
    }
    if beyond(near) || beyond(far) {
        return nothing;
    }
    let axis = |i: usize| {
        let along = |sign: f64| points.iter().map(move |p| (sign * p[i], p.w));
        let (low, high) = (bound(along(1.0)), -bound(along(-1.0)));
        let pixel = |s: f64| 0.5 * (s + 1.0) * f64::from(size[i]);
        let (low, high) = (pixel(low) - MARGIN, pixel(high) + MARGIN);
        // The casts saturate, which clips the rectangle to the image.
        low.floor() as u32..(high.ceil() as u32).min(size[i])
    };
    let (x, y) = (axis(0), axis(1));
    if x.is_empty() || y.is_empty() { nothing } else { Rect { x, y } }
}

/// The largest `s` in `[-1, 1000]` with `x - s w >= 0` for all `(x, w)`; `-1`, the border of the image, if there is none.
fn bound(points: impl Iterator<Item = (f64, f64)>) -> f64 {
    let (mut least, mut most) = (f64::NEG_INFINITY, f64::INFINITY);
    for (x, w) in points {
        match w {
            w if w > 0.0 => most = most.min(x / w),
            w if w < 0.0 => least = least.max(x / w),
            _ if x < 0.0 => return -1.0,
            _ => {}
        }
    }
    // Any bound beyond the far border serves equally, because the hull lies outside the image.
    let most = most.min(1e3);
    if most >= least { most.max(-1.0) } else { -1.0 }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::casters::shapes::Random;
    use crate::technique::caster_edges::silhouettes::CasterLight;
    use crate::view::look_at;
    use glam::dvec3;

    const SIZE: [u32; 2] = [320, 200];

    fn point(random: &mut Random, size: f64) -> DVec3 {
        size * DVec3::from_array([0; 3].map(|_| random.signed()))
    }

    fn cameras(eye: DVec3, target: DVec3) -> [CameraView; 3] {
        let reversed = CameraView::perspective(look_at(eye, target), 0.9, 1.6, 0.1);
        let parallel = CameraView::orthographic(look_at(eye, target), [3.2, 2.0], 0.1, 30.0);
        // The matrix maps z to w - z.
        let flip = DMat4::from_cols_array_2d(&[
            [1.0, 0.0, 0.0, 0.0],
            [0.0, 1.0, 0.0, 0.0],
            [0.0, 0.0, -1.0, 0.0],
            [0.0, 0.0, 1.0, 1.0],
        ]);
        let standard =
            CameraView { clip_from_view: flip * parallel.clip_from_view, depth: DepthRange::Standard, ..parallel };
        [reversed, parallel, standard]
    }

    /// Every point of a volume that a camera sees lies in the volume's rectangle, and not every rectangle is the whole
    /// image.
    #[test]
    fn what_is_seen_is_in_the_rectangle() {
        let mut random = Random(1);
        let (mut seen, mut culled, mut smaller, mut area) = (0, 0, 0, 0.0);
        for round in 0..3000 {
            let eye = point(&mut random, 6.0);
            let target = point(&mut random, 2.0);
            let camera = cameras(eye, target)[round % 3];
            let sphere = (point(&mut random, 1.0).to_array(), 0.02 + 0.3 * random.signed().abs());
            let object = DAffine3::from_scale_rotation_translation(
                dvec3(1.0, -2.0, 0.5),
                glam::DQuat::from_rotation_y(random.signed()),
                point(&mut random, 2.0),
            );
            let light = match round % 2 {
                0 => LightView::spot(look_at(point(&mut random, 5.0), target), 1.0, 0.1, 50.0, 0.0),
                _ => LightView::directional(look_at(point(&mut random, 5.0), target), [5.0; 2], 0.0, 50.0, 0.0),
            };
            let m = camera.clip_from_object(&object);
            let l = CasterLight::light(&light, &object);
            let rect = rectangle(&swept(&m, sphere, l), camera.depth, SIZE);
            culled += u32::from(rect.is_empty());
            smaller += u32::from(!rect.is_empty() && rect != Rect::all(SIZE));
            area += rect.x.len() as f64 * rect.y.len() as f64 / 64000.0;
            for _ in 0..200 {
                let p = DVec3::from(sphere.0) + sphere.1 * point(&mut random, 1.0).normalize();
                // The point lies at any distance beyond the caster.
                let t = (random.signed().abs() * 20.0).exp() - 1.0;
                let q = m * (p.extend(1.0) + t * (l.w * p - l.truncate()).extend(0.0));
                let inside = q.w > 0.0 && q.z >= 0.0 && q.z <= q.w && q.x.abs() <= q.w && q.y.abs() <= q.w;
                if !inside {
                    continue;
                }
                seen += 1;
                let pixel = [0, 1].map(|i| 0.5 * (q[i] / q.w + 1.0) * f64::from(SIZE[i]));
                let within = |r: &Range<u32>, v: f64| (f64::from(r.start)..=f64::from(r.end)).contains(&v);
                assert!(within(&rect.x, pixel[0]) && within(&rect.y, pixel[1]), "{round}: {pixel:?} not in {rect:?}");
            }
        }
        println!("{seen} points seen; {culled} volumes culled, {smaller} cut, mean area {:.3}", area / 3000.0);
        assert!(seen > 10_000 && culled > 300 && smaller > 500 && area < 2000.0);
    }

    /// Casters outside the light's frustum are recognised, and those inside are kept.
    #[test]
    fn casters_outside_the_light_are_found() {
        let light = LightView::spot(look_at(dvec3(0.0, 5.0, 0.0), DVec3::ZERO), 0.5, 1.0, 10.0, 0.0);
        let at = |p: DVec3| is_in_light(&light, &DAffine3::from_translation(p), ([0.0; 3], 0.2));
        assert!(at(DVec3::ZERO) && at(dvec3(0.0, 4.9, 0.0)) && at(dvec3(1.2, 0.0, 0.0)));
        assert!(!at(dvec3(2.0, 0.0, 0.0)) && !at(dvec3(0.0, 6.0, 0.0)) && !at(dvec3(0.0, -6.0, 0.0)));
    }

    #[test]
    fn the_lights_range_is_where_it_lights() {
        let eye = dvec3(0.0, 3.0, 20.0);
        for camera in &cameras(eye, DVec3::ZERO)[..1] {
            let light = LightView::spot(look_at(dvec3(0.0, 5.0, 0.0), DVec3::ZERO), 0.5, 1.0, 6.0, 0.0);
            let rect = rectangle(&light_range(camera, &light), camera.depth, SIZE);
            assert!(!rect.is_empty() && rect.x.len() < 100 && rect.y.len() < 150, "{rect:?}");
            // This light's range lies behind the camera.
            let light = LightView::spot(look_at(dvec3(0.0, 5.0, 40.0), dvec3(0.0, 0.0, 40.0)), 0.5, 1.0, 6.0, 0.0);
            assert!(rectangle(&light_range(camera, &light), camera.depth, SIZE).is_empty());
        }
    }
}
