//! A box that floats above the ground under a spot light, and the expected picture of it, computed from the geometry
//! alone.

use edgeshade::view::{CameraView, DepthRange, LightView, look_at};
use glam::{DMat4, DVec3, dvec3};

pub const BOX: [DVec3; 2] = [dvec3(-0.6, 0.7, -0.5), dvec3(0.7, 1.2, 0.4)];
/// Half width of the ground in world units.
pub const GROUND: f64 = 6.0;
pub const MAP_SIZE: u32 = 512;
const FOV_Y: f64 = 0.9;
const LIGHT_FOV: f64 = 0.9;
/// Distance from a shadow's edge in shadow-map texels within which any visibility of a filtered map is accepted.
const EDGE_TEXELS: f64 = 5.0;

/// One moment of the animation.
pub struct Moment {
    pub camera: CameraView,
    pub light: LightView,
    /// Number that changes whenever the shadow map does.
    pub light_version: u64,
}

/// Returns the moment that one view of a frame shows. The cameras move every frame, the light every third frame.
pub fn moment(frame: u32, view: usize, extent: [u32; 2], depth: DepthRange) -> Moment {
    let aspect = f64::from(extent[0]) / f64::from(extent[1]);
    let turn = 0.3 + 0.13 * f64::from(frame) + 2.5 * view as f64;
    let world_from_view = look_at(dvec3(4.5 * turn.sin(), 2.6, 4.5 * turn.cos()), dvec3(0.0, 0.8, 0.0));
    let camera = match depth {
        DepthRange::Reversed => CameraView::perspective(world_from_view, FOV_Y, aspect, 0.1),
        DepthRange::Standard => {
            // Depth 0 at the near plane and 1 at the far plane, y down.
            let (near, far, f) = (0.1, 50.0, 1.0 / (0.5 * FOV_Y).tan());
            let r = far / (near - far);
            let rows =
                [[f / aspect, 0.0, 0.0, 0.0], [0.0, -f, 0.0, 0.0], [0.0, 0.0, r, near * r], [0.0, 0.0, -1.0, 0.0]];
            CameraView { world_from_view, clip_from_view: DMat4::from_cols_array_2d(&rows).transpose(), depth }
        }
    };
    let light_version = u64::from(frame / 3);
    let swing = 0.8 * light_version as f64;
    let eye = dvec3(2.0 * swing.cos(), 5.0, 1.6 * swing.sin());
    let light = LightView::spot(look_at(eye, DVec3::ZERO), LIGHT_FOV, 1.0, 20.0, 0.0);
    Moment { camera, light, light_version }
}

#[derive(Clone, Copy, PartialEq, Eq, Debug)]
enum Seen {
    Sky,
    Lit,
    Shadow,
    Unsure,
}

/// Part of the line `from + t * along` that lies in the box, which is enlarged by `margin` on all sides.
fn box_span(from: DVec3, along: DVec3, margin: f64) -> Option<(f64, f64)> {
    let (a, b) = ((BOX[0] - margin - from) / along, (BOX[1] + margin - from) / along);
    let (enter, leave) = (a.min(b).max_element(), a.max(b).min_element());
    (enter < leave).then_some((enter, leave))
}

impl Moment {
    /// Returns the expected result at the centre of a pixel, and the surface that the pixel sees: 0 is the sky, 1 the
    /// ground, and 2 to 7 are the box's faces.
    fn seen(&self, pixel: [u32; 2], extent: [u32; 2]) -> (u8, Seen) {
        let [x, y] = [0, 1].map(|i| (2.0 * f64::from(pixel[i]) + 1.0) / f64::from(extent[i]) - 1.0);
        let t = (0.5 * FOV_Y).tan();
        let along = dvec3(x * t * f64::from(extent[0]) / f64::from(extent[1]), -y * t, -1.0);
        let (eye, along) = (self.camera.position(), self.camera.world_from_view.transform_vector3(along));
        let light = self.light.position();
        if let Some((enter, _)) = box_span(eye, along, 0.0) {
            // A face of a convex body is entirely lit if it faces the light.
            let p = eye + enter * along;
            let distance = [BOX[0] - p, p - BOX[1]].map(|d| d.abs().to_array()).concat();
            let face = (0..6).min_by(|&a, &b| distance[a].total_cmp(&distance[b])).unwrap_or(0);
            let facing = (light - p)[face % 3] * if face < 3 { -1.0 } else { 1.0 } / (light - p).length();
            let seen = if facing.abs() < 0.05 {
                Seen::Unsure
            } else if facing > 0.0 {
                Seen::Lit
            } else {
                Seen::Shadow
            };
            return (2 + face as u8, seen);
        }
        let p = eye - eye.y / along.y * along;
        if along.y >= 0.0 || p.x.abs() > GROUND || p.z.abs() > GROUND {
            return (0, Seen::Sky);
        }
        let margin = EDGE_TEXELS * 2.0 * (0.5 * LIGHT_FOV).tan() * (light - p).length() / f64::from(MAP_SIZE);
        let seen = match [margin, -margin].map(|m| box_span(p, light - p, m).is_some()) {
            [false, _] => Seen::Lit,
            [_, true] => Seen::Shadow,
            _ => Seen::Unsure,
        };
        (1, seen)
    }

    /// Compares the engine's RGBA8 picture with the geometry.
    pub fn check(&self, rgba: &[u8], extent: [u32; 2]) -> Verdict {
        let [w, h] = extent;
        let seen: Vec<_> = (0..w * h).map(|i| self.seen([i % w, i / w], extent)).collect();
        let at = |x: u32, y: u32| seen[(y * w + x) as usize];
        let mut verdict = Verdict::default();
        for (y, x) in (0..h).flat_map(|y| (0..w).map(move |x| (y, x))) {
            // The rasteriser and these rays may disagree about a pixel whose centre lies on a silhouette.
            let uniform = (y.max(1) - 1..(y + 2).min(h))
                .all(|j| (x.max(1) - 1..(x + 2).min(w)).all(|i| at(i, j).0 == at(x, y).0));
            let seen = if uniform { at(x, y).1 } else { Seen::Unsure };
            let (count, expected) = match seen {
                Seen::Sky => (&mut verdict.sky, [0, 0, 255, 255]),
                Seen::Lit => (&mut verdict.lit, [255, 0, 0, 255]),
                Seen::Shadow => (&mut verdict.shadow, [51, 0, 0, 255]),
                Seen::Unsure => {
                    verdict.unsure += 1;
                    continue;
                }
            };
            *count += 1;
            let at = 4 * (y * w + x) as usize;
            verdict.wrong += usize::from(rgba[at..at + 4] != expected);
        }
        verdict
    }
}

/// Numbers of pixels by expected result, and the number of wrong ones among those that are judged.
#[derive(Clone, Copy, Debug, Default)]
pub struct Verdict {
    pub sky: usize,
    pub lit: usize,
    pub shadow: usize,
    /// Pixels at a silhouette or near a shadow's edge, which are not judged.
    pub unsure: usize,
    pub wrong: usize,
}
