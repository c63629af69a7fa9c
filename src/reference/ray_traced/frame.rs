//! Code that hard and soft truth share: primary rays in tiles over all cores.

use super::trace::{Hit, RayScene};
use super::truth::{SKY, Truth};
use crate::view::{CameraView, DepthRange, LightKind, LightView};
use crate::{Error, Result};
use glam::{DMat4, DVec3, dvec3};
use rayon::prelude::*;
use std::sync::atomic::{AtomicU64, Ordering};
use std::time::Instant;

/// Callback with the pixels done and the pixels in total. Any thread may call it, and calls may come out of order.
pub type Progress<'a> = dyn Fn(u64, u64) + Sync + 'a;

/// Side of a tile, pixels. A tile keeps neighbouring rays in one thread, where they share their occluder and the
/// cache.
const TILE: u32 = 16;

/// Largest number of pixels of an image; each takes 17 bytes.
const MAX_PIXELS: u64 = 1 << 28;

/// Surface point to be shaded.
pub(super) struct Point<'a> {
    pub hit: &'a Hit,
    /// Index of the pixel.
    pub pixel: u64,
    /// Start of shadow rays: slightly above the surface, local space.
    pub origin: DVec3,
}

/// Visibility of a point, and the number of shadow rays traced for it.
pub(super) struct Shade {
    pub visibility: f32,
    pub rays: u64,
}

#[derive(Clone, Copy)]
struct Pixel {
    visibility: f32,
    triangle: u32,
    depth_view: f32,
    n_dot_l: f32,
    outside_light: bool,
}

/// Traces an image. Calls `shade` for each point that faces the light; its second argument is the slot of the last
/// occluder in this tile.
pub(super) fn render(
    scene: &RayScene,
    camera: &CameraView,
    light: &LightView,
    size: [u32; 2],
    progress: &Progress,
    shade: impl Fn(&Point, &mut u32) -> Shade + Sync,
) -> Result<(Truth, f64)> {
    let started = Instant::now();
    check(camera, light, size)?;
    let eye = Eye::new(scene, camera, size);
    let lamp = Lamp::new(scene, light);
    let [w, h] = size;
    let total = u64::from(w) * u64::from(h);
    let done = AtomicU64::new(0);
    let tiles = [w.div_ceil(TILE) as usize, h.div_ceil(TILE) as usize];
    let traced: Vec<(Vec<Pixel>, u64)> = (0..tiles[0] * tiles[1])
        .into_par_iter()
        .with_max_len(1)
        .map(|tile| {
            let corner = [(tile % tiles[0]) as u32 * TILE, (tile / tiles[0]) as u32 * TILE];
            let mut pixels = Vec::with_capacity((TILE * TILE) as usize);
            let (mut rays, mut last) = (0, u32::MAX);
            for y in corner[1]..(corner[1] + TILE).min(h) {
                for x in corner[0]..(corner[0] + TILE).min(w) {
                    let (pixel, cost) = trace_pixel(scene, &eye, &lamp, [x, y], &shade, &mut last);
                    pixels.push(pixel);
                    rays += cost;
                }
            }
            let count = pixels.len() as u64;
            progress(done.fetch_add(count, Ordering::Relaxed) + count, total);
            (pixels, rays)
        })
        .collect();

    let n = total as usize;
    let mut truth = Truth {
        size,
        visibility: vec![1.0; n],
        triangle: vec![SKY; n],
        depth_view: vec![f32::INFINITY; n],
        n_dot_l: vec![0.0; n],
        outside_light: vec![false; n],
        samples: 1,
        rays: traced.iter().map(|t| t.1).sum(),
        seconds: 0.0,
    };
    for (tile, (pixels, _)) in traced.iter().enumerate() {
        let corner = [tile % tiles[0] * TILE as usize, tile / tiles[0] * TILE as usize];
        let width = (w as usize - corner[0]).min(TILE as usize);
        for (i, p) in pixels.iter().enumerate() {
            let at = (corner[1] + i / width) * w as usize + corner[0] + i % width;
            truth.visibility[at] = p.visibility;
            truth.triangle[at] = p.triangle;
            truth.depth_view[at] = p.depth_view;
            truth.n_dot_l[at] = p.n_dot_l;
            truth.outside_light[at] = p.outside_light;
        }
    }
    let seconds = started.elapsed().as_secs_f64();
    Ok((truth, seconds))
}

fn trace_pixel(
    scene: &RayScene,
    eye: &Eye,
    lamp: &Lamp,
    pixel: [u32; 2],
    shade: &impl Fn(&Point, &mut u32) -> Shade,
    last: &mut u32,
) -> (Pixel, u64) {
    let sky = Pixel { visibility: 1.0, triangle: SKY, depth_view: f32::INFINITY, n_dot_l: 0.0, outside_light: false };
    let (origin, direction, t_max) = eye.ray_at(pixel.map(f64::from));
    let Some(hit) = scene.primary_local(origin, direction, t_max) else { return (sky, 0) };
    let n_dot_l = hit.normal.dot(lamp.towards(hit.local));
    let mut out = Pixel {
        visibility: 0.0,
        triangle: hit.triangle,
        depth_view: (scene.scale() * (hit.local - eye.position).dot(eye.forward)) as f32,
        n_dot_l: n_dot_l as f32,
        outside_light: lamp.is_outside(hit.local),
    };
    if !(n_dot_l > 0.0) {
        return (out, 0);
    }
    let index = u64::from(pixel[1]) * u64::from(eye.size[0]) + u64::from(pixel[0]);
    let origin = scene.above(&hit);
    let shade = shade(&Point { hit: &hit, pixel: index, origin }, last);
    out.visibility = shade.visibility;
    (out, shade.rays)
}

/// Camera prepared to make rays in local space.
pub(super) struct Eye {
    size: [u32; 2],
    view_from_clip: DMat4,
    local_from_view: glam::DAffine3,
    position: DVec3,
    forward: DVec3,
    near: f64,
    far: f64,
}

impl Eye {
    pub fn new(scene: &RayScene, camera: &CameraView, size: [u32; 2]) -> Self {
        let (near, far) = if camera.depth == DepthRange::Reversed { (1.0, 0.0) } else { (0.0, 1.0) };
        let local_from_view = glam::DAffine3 {
            matrix3: camera.world_from_view.matrix3 * (1.0 / scene.scale()),
            translation: scene.to_local(camera.position()),
        };
        Self {
            size,
            view_from_clip: camera.clip_from_view.inverse(),
            position: local_from_view.translation,
            forward: camera.world_from_view.transform_vector3(dvec3(0.0, 0.0, -1.0)),
            local_from_view,
            near,
            far,
        }
    }

    /// Returns origin and direction of the ray through a point of the picture, in pixels right and down from the first
    /// pixel's centre, and the `t` of the far plane. The ray starts on the near plane. Local space.
    pub fn ray_at(&self, at: [f64; 2]) -> (DVec3, DVec3, f64) {
        let ndc = |p: f64, n: u32| (2.0 * p + 1.0) / f64::from(n) - 1.0;
        let (x, y) = (ndc(at[0], self.size[0]), ndc(at[1], self.size[1]));
        let near = self.view_from_clip * glam::dvec4(x, y, self.near, 1.0);
        let far = self.view_from_clip * glam::dvec4(x, y, self.far, 1.0);
        let start = near.truncate() / near.w;
        // A far plane at infinity has w = 0, up to rounding of the inverse; its xyz is then the direction.
        let (direction, t_max) = if far.w.abs() <= 1e-12 * far.truncate().length() {
            (far.truncate(), f64::INFINITY)
        } else {
            (far.truncate() / far.w - start, 1.0)
        };
        // The homogeneous direction may have either sign; turn it to point forward.
        let direction = if t_max.is_infinite() && direction.z > 0.0 { -direction } else { direction };
        (self.local_from_view.transform_point3(start), self.local_from_view.transform_vector3(direction), t_max)
    }

    /// Returns a local point in camera view space, world units.
    pub fn to_view(&self, local: DVec3) -> DVec3 {
        self.local_from_view.inverse().transform_point3(local)
    }
}

/// Frustum of the light in local space.
pub(super) struct Lamp {
    /// Position of the light's view, local space.
    pub position: DVec3,
    /// Unit axes of the light's view in the world: right, up, and towards the light.
    pub axes: [DVec3; 3],
    pub directional: bool,
    clip_from_view: DMat4,
    scale: f64,
}

impl Lamp {
    pub fn new(scene: &RayScene, light: &LightView) -> Self {
        let m = &light.world_from_view.matrix3;
        Self {
            position: scene.to_local(light.position()),
            axes: [m.x_axis.normalize_or_zero(), m.y_axis.normalize_or_zero(), m.z_axis.normalize_or_zero()],
            directional: light.is_directional(),
            clip_from_view: light.clip_from_view,
            scale: scene.scale(),
        }
    }

    /// Returns the unit vector from a local point to the centre of the light.
    pub fn towards(&self, local: DVec3) -> DVec3 {
        if self.directional { self.axes[2] } else { (self.position - local).normalize_or_zero() }
    }

    fn is_outside(&self, local: DVec3) -> bool {
        let d = (local - self.position) * self.scale;
        let c = self.clip_from_view * glam::dvec4(self.axes[0].dot(d), self.axes[1].dot(d), self.axes[2].dot(d), 1.0);
        !(c.w > 0.0 && c.x.abs() <= c.w && c.y.abs() <= c.w && c.z >= 0.0 && c.z <= c.w)
    }
}

pub(super) fn check(camera: &CameraView, light: &LightView, size: [u32; 2]) -> Result<()> {
    let pixels = u64::from(size[0]) * u64::from(size[1]);
    if pixels == 0 || pixels > MAX_PIXELS {
        return Err(Error::Usage(format!(
            "an image of {} x {} pixels cannot be traced: it must have 1 to {MAX_PIXELS} pixels",
            size[0], size[1]
        )));
    }
    let finite = |m: &DMat4| m.is_finite() && m.determinant() != 0.0;
    if !camera.world_from_view.is_finite() || !finite(&camera.clip_from_view) {
        return Err(Error::Usage("the camera's matrices are not finite and invertible".into()));
    }
    if !light.world_from_view.is_finite() || !light.clip_from_view.is_finite() {
        return Err(Error::Usage("the light's matrices are not finite".into()));
    }
    match light.kind {
        LightKind::Spot { size } if !(size >= 0.0 && size.is_finite()) => {
            Err(Error::Usage(format!("light size {size}: must be a finite width, 0 for a point")))
        }
        LightKind::Directional { angle } if !(0.0..std::f64::consts::PI).contains(&angle) => {
            Err(Error::Usage(format!("light angle {angle}: must be in [0, pi) radians")))
        }
        _ => Ok(()),
    }
}
