//! Width of a texel on the surfaces that the camera sees.

use edgeshade::reference::ray_traced::Truth;
use edgeshade::view::{CameraView, LightView};
use glam::{DVec3, dvec2};

/// Width of a whole shadow map on the surfaces that the camera sees, world units. Divided by the map's side in texels
/// it gives the width of a texel.
///
/// The width at a pixel is the square root of an area: the area that a small part of the map covers on the surface
/// there, divided by that part's share of the map. On slopes this is the geometric mean of the widths along and
/// across the slope. The result is the median over the pixels in the mask; `None` if there are none.
pub fn median_width(truth: &Truth, mask: &[bool], camera: &CameraView, light: &LightView) -> Option<f64> {
    let judged = (0..mask.len()).filter(|&i| mask[i]);
    let mut widths: Vec<f64> = judged.map(|i| width(light, point(truth, camera, i), truth.n_dot_l[i].into())).collect();
    let middle = widths.len() / 2;
    (!widths.is_empty()).then(|| *widths.select_nth_unstable_by(middle, f64::total_cmp).1)
}

/// World-space point that a pixel sees.
fn point(truth: &Truth, camera: &CameraView, i: usize) -> DVec3 {
    let [w, h] = truth.size;
    let pixel = dvec2((i as u32 % w).into(), (i as u32 / w).into());
    let ndc = (2.0 * pixel + 1.0) / dvec2(w.into(), h.into()) - 1.0;
    let (origin, direction) = camera.ray(ndc.into());
    let axis = camera.world_from_view.transform_vector3(DVec3::NEG_Z);
    let start = (origin - camera.position()).dot(axis);
    origin + direction * ((f64::from(truth.depth_view[i]) - start) / direction.dot(axis))
}

/// Width of the whole map at one point of a surface, world units.
fn width(light: &LightView, p: DVec3, n_dot_l: f64) -> f64 {
    let clip = &light.clip_from_view;
    let w = clip.row(3).dot(light.world_from_view.inverse().transform_point3(p).extend(1.0));
    // The area lies in a plane perpendicular to the light's axis. The first factor turns the plane perpendicular to the
    // ray; the division projects the area onto the surface.
    let area = (2.0 * w / clip.x_axis.x) * (2.0 * w / clip.y_axis.y);
    let axis_dot_l = -light.direction().dot(light.towards(p));
    (area * axis_dot_l / n_dot_l).abs().sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;
    use edgeshade::view::look_at;
    use glam::{DVec2, dvec3};

    /// Point where the light's ray through a point of its map, -1 to 1, meets a plane.
    fn cast(light: &LightView, ndc: DVec2, on: DVec3, normal: DVec3) -> DVec3 {
        let inverse = light.clip_from_view.inverse();
        let at = |depth| light.world_from_view.transform_point3(inverse.project_point3(ndc.extend(depth)));
        let (a, b) = (at(0.0), at(1.0));
        a + (b - a) * ((on - a).dot(normal) / (b - a).dot(normal))
    }

    #[test]
    fn is_the_root_of_the_area_that_a_texel_covers() {
        let place = look_at(dvec3(2.0, 9.0, 1.0), dvec3(0.5, 0.0, -0.5));
        let spot = LightView::spot(place, 1.1, 0.5, 20.0, 0.1);
        let sun = LightView::directional(place, [4.0, 3.0], 0.0, 20.0, 0.01);
        for light in [spot, sun] {
            for normal in [DVec3::Y, dvec3(0.9, 0.3, -0.2).normalize()] {
                for ndc in [dvec2(0.0, 0.0), dvec2(0.8, -0.6)] {
                    let p = cast(&light, ndc, DVec3::ZERO, normal);
                    let step = 1e-5;
                    let [x, y] = [DVec2::X, DVec2::Y].map(|d| cast(&light, ndc + step * d, DVec3::ZERO, normal) - p);
                    // The map is 2 x 2 in these coordinates.
                    let expected = x.cross(y).length().sqrt() * 2.0 / step;
                    let found = width(&light, p, normal.dot(light.towards(p)));
                    assert!((found / expected - 1.0).abs() < 1e-4, "{ndc}: {found}, not {expected}");
                }
            }
        }
    }

    #[test]
    fn is_the_median_of_what_the_mask_leaves() {
        let camera = CameraView::perspective(look_at(DVec3::Y, DVec3::ZERO), 1.0, 1.5, 0.1);
        let above = look_at(dvec3(0.0, 5.0, 0.0), DVec3::ZERO);
        let truth = Truth {
            size: [3, 2],
            visibility: vec![1.0; 6],
            triangle: vec![0; 6],
            depth_view: vec![2.0; 6],
            n_dot_l: vec![1.0, 0.25, 0.04, 1.0, 1.0, 0.01],
            outside_light: vec![false; 6],
            samples: 1,
            rays: 6,
            seconds: 0.0,
        };
        let sun = LightView::directional(above, [2.0, 2.0], 0.0, 20.0, 0.0);
        let of = |mask: [bool; 6]| median_width(&truth, &mask, &camera, &sun);
        let close = |a: Option<f64>, b: f64| a.is_some_and(|a| (a / b - 1.0).abs() < 1e-6);
        assert!(close(of([true, true, true, false, false, false]), 8.0));
        assert!(close(of([true; 6]), 8.0));
        assert_eq!(of([false; 6]), None);
        // Every pixel lies where its ray says; all are at the depth of one plane, 6 from the light.
        let p = point(&truth, &camera, 5);
        assert!((p.y + 1.0).abs() < 1e-6 && (p.x.hypot(p.z)) > 0.5, "{p}");
        let spot = LightView::spot(above, 2.0 * 1f64.atan(), 0.5, 20.0, 0.1);
        // On the axis of a spot of 90 degrees a map is twice as wide as its distance.
        assert!((width(&spot, dvec3(0.0, -1.0, 0.0), 1.0) - 12.0).abs() < 1e-9);
    }
}
