//! Plates that float over a plane tilted against the light, seen so that every pixel covers an equal part of a texel.
//!
//! The plates lie across the light's axis, so the map holds the same silhouettes at every tilt. The camera stands in
//! front of the plane, below the plates. Its projection shows the plane as the light sees it, only turned and
//! cropped: each pixel of the image covers a square of the map, whatever the tilt. Distances in the image are
//! therefore distances in texels.

use super::judge::hard;
use crate::cli::stage::Stage;
use edgeshade::reference::ray_traced::Truth;
use edgeshade::scene::{Instance, Light, LightShape, Material, Mesh, Scene};
use edgeshade::view::{CameraView, DepthRange, LightView, look_along};
use glam::{DAffine3, DMat3, DMat4, DVec2, DVec3, DVec4, dvec2, dvec3};
use std::f64::consts::{SQRT_2, TAU};

/// Side of the shadow map, texels.
pub const MAP: u32 = 256;
/// Angle in radians by which the light's view is turned about its axis, so that the plane's slope runs along neither
/// axis of the map.
const ROLL: f64 = 0.45;
/// Angle in radians by which the image is turned against the map.
const TURN: f64 = 0.3;
/// The image shows the map from `-CROP` to `CROP` along its shorter side, in light NDC.
const CROP: f64 = 0.9;
/// Distance of the spot from the plates, large enough for all its rays to meet the steepest plane. Its frustum is 2
/// wide there, as is the sun's.
const THROW: f64 = 20.0;
/// Height of the camera over the plane, and its distance from the plane's middle sideways.
const EYE: [f64; 2] = [4.0, 1.6];
/// Distance of the near plane as a share of the distance to the plane's middle.
const NEAR: f64 = 0.05;
/// Number of cells of plates along each side, and the width of a cell in light NDC.
const CELLS: (i32, f64) = (3, 0.44);

/// Kind of shadow edge that a plate casts.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Edge {
    /// A triangle with sides of 38 texels.
    Straight,
    /// A disc, 38 texels wide.
    Curved,
    /// A bar of 44 by 2.5 texels.
    Thin,
}

/// All kinds.
const EDGES: [Edge; 3] = [Edge::Straight, Edge::Curved, Edge::Thin];

/// Kind of light.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Lamp {
    Sun,
    Spot,
}

/// The scene, and the known properties of its image.
pub struct Tilted {
    pub stage: Stage,
    /// View of the shadow map, which the scene fixes: a view fitted to the casters would change with the tilt.
    pub light: LightView,
    /// Width of a texel in pixels.
    pub texel_px: f64,
    size: [u32; 2],
}

impl Tilted {
    /// Builds the scene. `tilt` is the angle in radians between the plane's normal and the light's axis, below a
    /// right angle; `size` is the image size in pixels.
    pub fn new(lamp: Lamp, tilt: f64, size: [u32; 2]) -> Self {
        let (sin, cos) = tilt.sin_cos();
        let towards = dvec3(sin, cos, 0.0);
        let axes = DMat3::from_cols(dvec3(cos, -sin, 0.0), DVec3::NEG_Z, towards) * DMat3::from_rotation_z(ROLL);
        // Distance from the plane's middle to the plates' middle that keeps their lowest corner above the camera.
        let float = (EYE[0] + SQRT_2 * sin) / cos + 0.5;
        let throw = if lamp == Lamp::Sun { 1.0 } else { THROW };
        let distance = float + throw;
        let world_from_light = DAffine3 { matrix3: axes, translation: distance * towards };
        let (light, shape) = match lamp {
            Lamp::Sun => {
                let far = distance + SQRT_2 * sin / cos + 0.5;
                let view = LightView::directional(world_from_light, [1.0; 2], 0.5, far, 0.0);
                (view, LightShape::Directional { angle: None })
            }
            Lamp::Spot => {
                let slope = 1.0 / THROW;
                // Distance at which the longest corner ray of the frustum meets the plane.
                let far = 1.01 * distance * cos / (cos - SQRT_2 * slope * sin);
                let view = LightView::spot(world_from_light, 2.0 * slope.atan(), 0.8 * THROW, far, 0.0);
                (view, LightShape::Spot { outer: slope.atan(), size: None })
            }
        };
        let lamp = Light { name: "lamp".into(), world_from_light, shape, color: [1.0; 3] };
        let stage = Stage { scene: scene(&light, throw), camera: camera(&light, size), light: hard(&lamp) };
        let texel_px = f64::from(size[0].min(size[1])) / (CROP * f64::from(MAP));
        Self { stage, light, texel_px, size }
    }

    /// Pixels of `mask` that lie in cells with this kind of shadow edge.
    pub fn part(&self, mask: &[bool], edge: Edge) -> Vec<bool> {
        let [w, h] = self.size;
        let pixels = (0..h).flat_map(|y| (0..w).map(move |x| (x, y)));
        let kind = |(x, y): (u32, u32)| {
            let half = half_extents(self.size);
            let ndc = |p: u32, n: u32| (2.0 * f64::from(p) + 1.0) / f64::from(n) - 1.0;
            let image = dvec2(half[0] * ndc(x, w), half[1] * ndc(y, h));
            edge_at(DVec2::from_angle(-TURN).rotate(image))
        };
        mask.iter().zip(pixels).map(|(&m, p)| m && kind(p) == edge).collect()
    }

    /// Converts a distance from texels to whole pixels, rounding up.
    pub fn near_px(&self, texels: f64) -> u32 {
        (texels * self.texel_px).ceil() as u32
    }
}

/// True if the picture shows shadow in cells of every kind.
pub fn is_complete(tilted: &Tilted, truth: &Truth, mask: &[bool]) -> bool {
    EDGES.iter().all(|&edge| {
        let part = tilted.part(mask, edge);
        let dark = part.iter().zip(&truth.visibility).filter(|(m, v)| **m && **v < 0.5).count();
        dark > 0
    })
}

/// Half of each side of the image in light NDC.
fn half_extents(size: [u32; 2]) -> [f64; 2] {
    let shorter = f64::from(size[0].min(size[1]));
    size.map(|n| CROP * f64::from(n) / shorter)
}

/// Camera that shows the plane `y = 0` as the light sees it, turned and cropped.
fn camera(light: &LightView, size: [u32; 2]) -> CameraView {
    let eye = dvec3(0.0, EYE[0], EYE[1]);
    let half = half_extents(size);
    let light_clip = light.clip_from_view * DMat4::from(light.world_from_view.inverse());
    let (sin, cos) = TURN.sin_cos();
    let (x, y, w) = (light_clip.row(0), light_clip.row(1), light_clip.row(3));
    // Adding a multiple of the plane's own equation changes nothing on the plane. This multiple makes the row vanish
    // at the eye; rows that vanish there form a projection from the eye.
    let from_eye = |row: DVec4| row - DVec4::Y * (row.dot(eye.extend(1.0)) / eye.y);
    let rows = [(x * cos - y * sin) / half[0], (x * sin + y * cos) / half[1], w].map(|r| from_eye(r / w.w));
    // The view looks along the direction in which `w` grows by one per unit.
    let forward = rows[2].truncate();
    let scale = forward.length().recip();
    let world_from_view = look_along(eye, forward * scale);
    let axes = world_from_view.matrix3;
    let column = |axis: DVec3, w: f64| {
        let [x, y] = [0, 1].map(|i| scale * rows[i].truncate().dot(axis));
        DVec4::new(x, y, 0.0, w)
    };
    let offset = DVec4::new(0.0, 0.0, scale * NEAR, 0.0);
    let clip_from_view =
        DMat4::from_cols(column(axes.x_axis, 0.0), column(axes.y_axis, 0.0), column(axes.z_axis, -1.0), offset);
    CameraView { world_from_view, clip_from_view, depth: DepthRange::Reversed }
}

/// Cell (column, row) at a point in light NDC; a point outside gets the nearest cell.
fn cell_at(place: DVec2) -> [i32; 2] {
    let (count, width) = CELLS;
    let index = |v: f64| ((v / width + 0.5 * f64::from(count)).floor() as i32).clamp(0, count - 1);
    [index(place.x), index(place.y)]
}

fn edge_at(place: DVec2) -> Edge {
    let [i, j] = cell_at(place);
    EDGES[((i + j) % 3) as usize]
}

/// Outline of a cell's plate, counter-clockwise, in light NDC.
fn outline(cell: [i32; 2]) -> Vec<DVec2> {
    let (count, width) = CELLS;
    let middle = cell.map(|i| width * (f64::from(i) - 0.5 * f64::from(count - 1)));
    let middle = dvec2(middle[0], middle[1]);
    let turn = DVec2::from_angle(0.4 + 0.77 * f64::from(cell[1] * count + cell[0]));
    let texel = 2.0 / f64::from(MAP);
    let ring = |n: u32, radius: f64| -> Vec<DVec2> {
        (0..n).map(|i| radius * DVec2::from_angle(TAU * f64::from(i) / f64::from(n))).collect()
    };
    let points = match edge_at(middle) {
        Edge::Straight => ring(3, 22.0 * texel),
        Edge::Curved => ring(192, 19.0 * texel),
        Edge::Thin => {
            let half = dvec2(22.0, 1.25) * texel;
            [(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)].map(|(x, y)| half * dvec2(x, y)).to_vec()
        }
    };
    points.into_iter().map(|p| middle + turn.rotate(p)).collect()
}

/// The plane, and the plates at the distance `throw` from the light.
fn scene(light: &LightView, throw: f64) -> Scene {
    // The light's y axis points up, that of its NDC down.
    let mut plates = Mesh { name: "plates".into(), ..Mesh::default() };
    for cell in (0..CELLS.0).flat_map(|j| (0..CELLS.0).map(move |i| [i, j])) {
        fan(&mut plates, outline(cell).into_iter().map(|p| dvec3(p.x, -p.y, 0.0)), DVec3::Z);
    }
    let farthest = light.world_from_view.translation.length() + reach(light);
    let mut plane = Mesh { name: "plane".into(), ..Mesh::default() };
    let corners = [(-1.0, -1.0), (-1.0, 1.0), (1.0, 1.0), (1.0, -1.0)];
    fan(&mut plane, corners.into_iter().map(|(x, z)| farthest * dvec3(x, 0.0, z)), DVec3::Y);
    for mesh in [&mut plates, &mut plane] {
        mesh.compute_bounds();
    }
    let at_plates = light.world_from_view * DAffine3::from_translation(dvec3(0.0, 0.0, -throw));
    Scene {
        name: "tilted plane".into(),
        meshes: vec![plates, plane],
        materials: vec![Material { double_sided: true, ..Material::default() }],
        instances: vec![
            Instance { mesh: 0, world_from_object: at_plates },
            Instance { mesh: 1, world_from_object: DAffine3::IDENTITY },
        ],
        ..Scene::default()
    }
}

/// Distance to the farthest corner of the light's frustum.
fn reach(light: &LightView) -> f64 {
    let view_from_clip = light.clip_from_view.inverse();
    let corner = view_from_clip * DVec4::ONE;
    (corner.truncate() / corner.w).length()
}

/// Adds a convex polygon with the given normal.
fn fan(mesh: &mut Mesh, outline: impl Iterator<Item = DVec3>, normal: DVec3) {
    let first = mesh.positions.len() as u32;
    mesh.positions.extend(outline.map(|p| p.as_vec3().to_array()));
    let end = mesh.positions.len() as u32;
    mesh.normals.resize(end as usize, normal.as_vec3().to_array());
    mesh.uvs.resize(end as usize, [0.0; 2]);
    mesh.indices.extend((first + 1..end - 1).flat_map(|i| [first, i, i + 1]));
}

#[cfg(test)]
mod tests {
    use super::*;
    use edgeshade::reference::ray_traced::{MIN_N_DOT_L, RayScene, hard};

    /// True if a point in light NDC lies under a plate.
    fn is_under(place: DVec2) -> bool {
        let outline = outline(cell_at(place));
        (0..outline.len()).all(|i| {
            let (a, b) = (outline[i], outline[(i + 1) % outline.len()]);
            (b - a).perp_dot(place - a) >= 0.0
        })
    }

    #[test]
    fn the_traced_image_is_the_light_s_own_view_at_every_tilt() {
        let size = [150, 120];
        let half = half_extents(size);
        for lamp in [Lamp::Sun, Lamp::Spot] {
            for degrees in [0.0f64, 45.0, 85.0] {
                let tilted = Tilted::new(lamp, degrees.to_radians(), size);
                let Stage { scene, camera, .. } = &tilted.stage;
                let rays = RayScene::build(scene).unwrap();
                let truth = hard(&rays, camera, &tilted.light, size, &|_, _| {}).unwrap();
                let valid = truth.valid(MIN_N_DOT_L);
                assert!(is_complete(&tilted, &truth, &valid), "{lamp:?} {degrees}");
                let plane = rays.first_triangle(1).unwrap();
                let (mut counted, mut dark) = (0, 0);
                for (i, &counts) in valid.iter().enumerate() {
                    let (x, y) = (i as u32 % size[0], i as u32 / size[0]);
                    let ndc = |p: u32, n: u32| (2.0 * f64::from(p) + 1.0) / f64::from(n) - 1.0;
                    let image = dvec2(half[0] * ndc(x, size[0]), half[1] * ndc(y, size[1]));
                    let place = DVec2::from_angle(-TURN).rotate(image);
                    let inside = place.abs().max_element() < 1.0;
                    assert_eq!(counts, inside, "{lamp:?} {degrees}: {x} {y}");
                    if inside {
                        assert!(truth.triangle[i] >= plane, "{lamp:?} {degrees}: a plate at {x} {y}");
                        assert_eq!(truth.visibility[i] < 0.5, is_under(place), "{lamp:?} {degrees}: {x} {y}");
                        counted += 1;
                        dark += u32::from(truth.visibility[i] < 0.5);
                    }
                    // The light's matrix must agree about the point that the ray meets.
                    let (origin, direction) = camera.ray([ndc(x, size[0]), ndc(y, size[1])]);
                    let hit = origin - direction * (origin.y / direction.y);
                    let seen = tilted.light.clip_from_view
                        * (tilted.light.world_from_view.inverse().transform_point3(hit)).extend(1.0);
                    let seen = dvec2(seen.x, seen.y) / seen.w;
                    assert!(seen.distance(place) < 1e-9, "{lamp:?} {degrees}: {seen} is not {place}");
                }
                assert!(counted > 15_000 && dark > 1000, "{counted} {dark}");
            }
        }
    }

    #[test]
    fn a_texel_is_as_wide_as_it_says_and_the_kinds_share_the_image() {
        let size = [300, 200];
        let tilted = Tilted::new(Lamp::Sun, 0.5, size);
        // Two texels to the right in light NDC, converted back to pixels.
        let step = 2.0 * 2.0 / f64::from(MAP) / (2.0 * half_extents(size)[0]) * f64::from(size[0]);
        assert!((step - 2.0 * tilted.texel_px).abs() < 1e-12);
        assert_eq!(tilted.near_px(2.0), (2.0 * tilted.texel_px).ceil() as u32);
        let mask = vec![true; 60_000];
        let counts = EDGES.map(|e| tilted.part(&mask, e).iter().filter(|&&m| m).count());
        assert_eq!(counts.iter().sum::<usize>(), 60_000);
        assert!(counts.iter().all(|&n| n > 12_000), "{counts:?}");
    }
}
