//! The width of fixed-size penumbrae.

use crate::view::LightView;
use glam::{DMat4, dvec4};

/// Texels of a [`DEFAULT_MAP`] that the default penumbra is wide.
const DEFAULT_TEXELS: f64 = 15.0;
/// Side of the shadow map that these texels belong to. The map in use does not matter: another resolution must not change
/// the width.
const DEFAULT_MAP: f64 = 1024.0;

/// Returns the penumbra width, in world units, that a light has unless the user gives one: 15/1024 of the width of the
/// light's view half-way between its near and its far plane.
///
/// The view's width is measured along its x axis: for a parallel light that of its box, for a spot that of its frustum at
/// this distance. The result is not finite, or 0, if the light's projection is not invertible.
///
/// ```
/// # use edgeshade::technique::penumbra::fixed_width::default_penumbra;
/// # use edgeshade::view::LightView;
/// # use glam::DAffine3;
/// let sun = LightView::directional(DAffine3::IDENTITY, [5.12, 2.0], 0.0, 20.0, 0.0);
/// assert!((default_penumbra(&sun) - 0.15).abs() < 1e-12);
/// ```
pub fn default_penumbra(light: &LightView) -> f64 {
    let clip_from_view = &light.clip_from_view;
    let view_from_clip = clip_from_view.inverse();
    let distance = 0.5 * (distance(&view_from_clip, 0.0) + distance(&view_from_clip, 1.0));
    let w = clip_from_view.row(3).dot(dvec4(0.0, 0.0, -distance, 1.0));
    let width = (2.0 * w / clip_from_view.x_axis.x).abs();
    width * DEFAULT_TEXELS / DEFAULT_MAP
}

/// Returns the distance along the view's axis at which the depth has this value.
fn distance(view_from_clip: &DMat4, depth: f64) -> f64 {
    let p = *view_from_clip * dvec4(0.0, 0.0, depth, 1.0);
    -p.z / p.w
}

/// Returns the penumbra width, in world units, that a parameter's value stands for: 0 means [`default_penumbra`].
pub fn penumbra_width(value: f64, light: &LightView) -> f64 {
    if value == 0.0 { default_penumbra(light) } else { value }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::view::look_at;
    use glam::dvec3;

    #[test]
    fn is_15_texels_of_1024_half_way() {
        let place = look_at(dvec3(1e6, -3.0, 2.0), dvec3(1e6 + 1.0, 2.0, 4.0));
        // Half-way is measured between the planes, not between their depth values, which crowd at the far end.
        for (near, far) in [(0.1, 10.0), (4.0, 6.0)] {
            for fov in [0.3f64, 1.6] {
                let expected = 2.0 * (0.5 * fov).tan() * 0.5 * (near + far) * 15.0 / 1024.0;
                let found = default_penumbra(&LightView::spot(place, fov, near, far, 0.2));
                assert!((found / expected - 1.0).abs() < 1e-9, "{near} {far} {fov}: {found}, not {expected}");
            }
        }
        for half in [[3.0, 7.0], [1e-4, 2.0]] {
            let found = default_penumbra(&LightView::directional(place, half, -5.0, 12.0, 0.01));
            assert!((found / (2.0 * half[0] * 15.0 / 1024.0) - 1.0).abs() < 1e-12);
        }
    }

    #[test]
    fn a_value_counts_unless_it_is_0() {
        let sun = LightView::directional(glam::DAffine3::IDENTITY, [512.0, 512.0], 0.0, 1.0, 0.0);
        assert_eq!((penumbra_width(0.25, &sun), penumbra_width(0.0, &sun)), (0.25, 15.0));
    }
}
