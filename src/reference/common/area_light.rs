//! Mirror of `glsl/lib/area_light.glsl`: similar triangles of an area light, in `f64`.

use crate::technique::common::view::ViewConstants;
use glam::{DVec2, dvec2};

/// An area light as its shadow map's constants describe it: a square parallel to the map, or a sun.
///
/// Distances are linear, in world units: measured along a spot's axis from the light, or from the map's near plane for
/// a sun.
///
/// ```
/// # use edgeshade::reference::common::area_light::AreaLight;
/// // A lamp 0.5 wide, its map 90 degrees wide from 1 to 100 units.
/// let (near, far) = (1.0, 100.0);
/// let lamp = AreaLight::spot(0.5, [1.0, 1.0], near, far);
/// assert!((lamp.distance(0.0) - near).abs() < 1e-12 && (lamp.distance(1.0) - far).abs() < 1e-9);
/// // The blocker stands half-way between lamp and receiver: the penumbra is as wide as the lamp.
/// assert!((lamp.penumbra_width(10.0, 5.0) - 0.5).abs() < 1e-12);
/// // The receiver sees the lamp through 0.25 units at distance 5, where the map is 10 wide.
/// assert!((lamp.filter_half_width(10.0, 5.0).x - 0.5 * 0.25 / 10.0).abs() < 1e-12);
///
/// // The sun is half a degree wide, its map 20 units by 10.
/// let sun = AreaLight::sun(0.5f64.to_radians(), [20.0, 10.0], 50.0);
/// let tangent = 0.25f64.to_radians().tan();
/// assert!((sun.distance(0.5) - 25.0).abs() < 1e-12);
/// assert!((sun.penumbra_width(9.0, 5.0) - 8.0 * tangent).abs() < 1e-12);
/// assert!((sun.filter_half_width(9.0, 5.0).y - 0.4 * tangent).abs() < 1e-12);
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct AreaLight {
    /// Half-width of the filter in uv, without the factor for the distances, along each axis of the map. For a spot it
    /// is `R/(2 T)`, with the light's half-width `R` and the tangent `T` of half the map's field of view. For a sun it
    /// is `tan(theta)/W`, with half-angle `theta` and map width `W`.
    pub uv: DVec2,
    /// `R` for a spot, `tan(theta)` for a sun.
    pub world: f64,
    /// `n f/(f - n)` for a spot with near plane `n` and far plane `f`, 0 for a sun.
    pub depth_scale: f64,
    /// `f/(f - n)` for a spot, `f - n` for a sun.
    pub depth_offset: f64,
}

impl AreaLight {
    /// Returns a spot of full width `size`, world units. `tangents` holds the tangent of half the field of view along
    /// each axis of the map; `near` and `far` are the distances of the map's planes.
    pub fn spot(size: f64, tangents: [f64; 2], near: f64, far: f64) -> Self {
        let world = 0.5 * size;
        Self {
            uv: 0.5 * world / dvec2(tangents[0], tangents[1]),
            world,
            depth_scale: near * far / (far - near),
            depth_offset: far / (far - near),
        }
    }

    /// Returns a sun of full `angle` in radians. `width` holds the map's width along each axis, and `depth` is the
    /// distance between its planes, both in world units.
    pub fn sun(angle: f64, width: [f64; 2], depth: f64) -> Self {
        let world = (0.5 * angle).tan();
        Self { uv: world / dvec2(width[0], width[1]), world, depth_scale: 0.0, depth_offset: depth }
    }

    /// Returns the light of a layer as the GPU has it.
    pub fn of(constants: &ViewConstants, layer: usize) -> Self {
        let [x, y, world, depth_offset] = constants.light_area[layer].map(f64::from);
        Self { uv: dvec2(x, y), world, depth_scale: constants.light_depth_scale[layer].into(), depth_offset }
    }

    /// Returns the distance of a stored depth, world units.
    pub fn distance(&self, depth: f64) -> f64 {
        if self.depth_scale > 0.0 {
            self.depth_scale / (self.depth_offset - depth).max(1e-7)
        } else {
            depth * self.depth_offset
        }
    }

    /// Returns the distance of the map's near plane, world units.
    pub fn near(&self) -> f64 {
        self.depth_scale / self.depth_offset
    }

    /// Returns the half-width, uv, over which a receiver at distance `z` sees the light through points at `z_blocker`;
    /// 0 if these are not nearer. A blocker at or behind `z_blocker` lies within this half-width, so it also bounds
    /// the search.
    pub fn filter_half_width(&self, z: f64, z_blocker: f64) -> DVec2 {
        let between = z - z_blocker;
        if between <= 0.0 {
            return DVec2::ZERO;
        }
        self.uv * between * if self.depth_scale > 0.0 { 1.0 / (z * z_blocker).max(1e-30) } else { 1.0 }
    }

    /// Returns the full width of the penumbra, world units, on a receiver at `z` parallel to the map; 0 if the blocker
    /// is not nearer.
    pub fn penumbra_width(&self, z: f64, z_blocker: f64) -> f64 {
        let between = (z - z_blocker).max(0.0);
        2.0 * self.world * between * if self.depth_scale > 0.0 { 1.0 / z_blocker.max(1e-30) } else { 1.0 }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::view::LightView;
    use glam::{DAffine3, DVec3, dvec3};

    /// Returns uv and depth of a point in the light's view, from the projection alone.
    fn project(light: &LightView, p: DVec3) -> (DVec2, f64) {
        let q = light.clip_from_view * p.extend(1.0);
        (0.5 * dvec2(q.x, q.y) / q.w + 0.5, q.z / q.w)
    }

    /// Lines from a receiver to the light's rim meet the blocker's plane where the formulas say.
    #[test]
    fn widths_are_those_of_lines_to_the_rim() {
        for (fov, near, far, size) in [(0.4, 0.1, 30.0, 0.3), (1.9, 2.0, 9.0, 1.5)] {
            let light = LightView::spot(DAffine3::IDENTITY, fov, near, far, size);
            let a = AreaLight::spot(size, [(0.5 * fov).tan(); 2], near, far);
            for (z, z_blocker) in [(8.0, 3.0), (8.5, 7.0), (4.0, 2.5)] {
                let receiver = dvec3(0.3, -0.2, -z);
                let (uv, depth) = project(&light, receiver);
                assert!((a.distance(depth) / z - 1.0).abs() < 1e-9);
                let rim = dvec3(0.5 * size, 0.5 * size, 0.0);
                let (seen, _) = project(&light, rim.lerp(receiver, z_blocker / z));
                let expected = (seen - uv).abs();
                assert!((a.filter_half_width(z, z_blocker) - expected).abs().max_element() < 1e-9);
                // Lines from both sides of the rim through one point of the blocker meet the receiver's plane.
                let through = |side: f64| {
                    let from = side * 0.5 * size;
                    from + (0.1 - from) * z / z_blocker
                };
                let penumbra = (through(1.0) - through(-1.0)).abs();
                assert!((a.penumbra_width(z, z_blocker) - penumbra).abs() < 1e-9);
            }
            assert!((a.near() - near).abs() < 1e-9);
        }
        let (angle, half) = (0.2f64, [3.0, 5.0]);
        let light = LightView::directional(DAffine3::IDENTITY, half, 1.0, 21.0, angle);
        let a = AreaLight::sun(angle, [6.0, 10.0], 20.0);
        let (receiver, between) = (dvec3(0.4, 0.7, -15.0), 6.0);
        let (uv, depth) = project(&light, receiver);
        assert!((a.distance(depth) - 14.0).abs() < 1e-12);
        let towards = dvec3((0.5 * angle).tan(), (0.5 * angle).tan(), 1.0);
        let (seen, _) = project(&light, receiver + between * towards);
        assert!((a.filter_half_width(14.0, 8.0) - (seen - uv).abs()).abs().max_element() < 1e-12);
        assert!((a.penumbra_width(14.0, 8.0) - 2.0 * between * towards.x).abs() < 1e-12);
    }

    /// No blocker behind a distance lies outside the half-width at that distance.
    #[test]
    fn the_search_window_holds_every_filter() {
        let a = AreaLight::spot(1.0, [0.5, 0.7], 0.2, 50.0);
        let sun = AreaLight::sun(0.1, [5.0, 7.0], 50.0);
        for light in [a, sun] {
            let z = 20.0;
            for i in 0..40 {
                let nearest = light.near() + 0.5 * f64::from(i);
                let window = light.filter_half_width(z, nearest);
                for k in 0..50 {
                    let width = light.filter_half_width(z, nearest + 0.5 * f64::from(k));
                    assert!(width.cmple(window).all());
                }
            }
            assert_eq!(light.filter_half_width(z, z + 1.0), DVec2::ZERO);
            assert_eq!(light.penumbra_width(z, z + 1.0), 0.0);
        }
        let point = AreaLight::spot(0.0, [0.5, 0.5], 0.2, 50.0);
        assert_eq!((point.filter_half_width(20.0, 0.0), point.penumbra_width(20.0, 0.0)), (DVec2::ZERO, 0.0));
    }
}
