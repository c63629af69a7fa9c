//! The G-buffer compared with primary rays in `f64`.

use crate::common::{desc, every_shipped, normal_texels, prepare, renderer, with_gpu};
use crate::properties::hits;
use edgeshade::reference::ray_traced::SKY;
use glam::{DVec3, dvec3};

const SIZE: [u32; 2] = [320, 180];

fn decode(e: [f32; 3]) -> DVec3 {
    let [x, y] = [f64::from(e[0]), f64::from(e[1])];
    let z = 1.0 - x.abs() - y.abs();
    let fold = |a: f64, b: f64| if z < 0.0 { (1.0 - b.abs()).copysign(a) } else { a };
    dvec3(fold(x, y), fold(y, x), z).normalize()
}

/// Differences between the G-buffer and the rays.
#[derive(Debug, Default)]
struct Seen {
    /// Pixels that show another triangle; these are at edges.
    other_ids: usize,
    /// Pixels whose depth has a relative error above 1e-5, and the largest error.
    depths_off: usize,
    depth: f64,
    /// Largest error beyond 1e-5, as the distance in pixels to the point that has the depth.
    aside_px: f64,
    /// Pixels whose normal is off by more than 1e-3 rad, and the largest angle.
    normals_off: usize,
    angle: f64,
}

impl Seen {
    fn depth(&mut self, relative: f64, change_a_pixel: f64) {
        self.depth = self.depth.max(relative);
        if relative > 1e-5 {
            self.depths_off += 1;
            self.aside_px = self.aside_px.max((relative - 1e-5) / change_a_pixel);
        }
    }

    fn normal(&mut self, angle: f64) {
        self.angle = self.angle.max(angle);
        self.normals_off += usize::from(angle > 1e-3);
    }

    fn check(&self, name: &str, pixels: usize) {
        assert!(self.other_ids * 100 <= pixels, "{name}: {self:?}");
        // Rasterisers snap vertices to a grid of 1/256 of a pixel, some devices to a coarser one. Surfaces seen
        // edge-on, whose depth changes much over a pixel, get the depth of a point this far aside.
        assert!(self.aside_px <= 1.0 / 32.0 && self.depths_off * 100 <= pixels, "{name}: {self:?}");
        // The normal comes from differences of f32 positions over a pixel. Far along a large triangle, these are small
        // compared with the positions.
        assert!(self.angle <= 1e-2 && self.normals_off * 1000 <= pixels, "{name}: {self:?}");
    }
}

#[test]
fn depth_ids_and_normals_are_those_of_the_rays() {
    with_gpu(|host| {
        for scene in every_shipped() {
            let mut r = renderer(host, &scene, desc(SIZE, 64));
            let mut technique = prepare(&r, "sm", &[]);
            r.frame(technique.as_mut()).unwrap();
            let ids = host.read_image::<u32>(&r.gbuffer().triangle).unwrap();
            let depth = host.read_values(&r.gbuffer().depth).unwrap();
            let normals = normal_texels(host, &r.gbuffer().geometric_normal);
            let hits = hits(&scene, &r, SIZE);
            let camera = *r.camera();
            let mut seen = Seen::default();
            for (i, hit) in hits.iter().enumerate() {
                let id = hit.map_or(SKY, |h| h.triangle);
                if ids[i] != id {
                    seen.other_ids += 1;
                    continue;
                }
                let Some(hit) = hit else { continue };
                let p = camera.world_from_view.inverse().transform_point3(hit.position);
                let clip = camera.clip_from_view * p.extend(1.0);
                let relative = (f64::from(depth[i]) / (clip.z / clip.w) - 1.0).abs();
                // Relative change of depth over a pixel of this surface.
                let normal = camera.world_from_view.matrix3.transpose() * hit.normal;
                let tilt = (1.0 - normal.z * normal.z).max(0.0).sqrt();
                let facing = normal.dot(p).abs() / p.length();
                let pixel = 2.0 / (f64::from(SIZE[1]) * camera.clip_from_view.y_axis.y.abs());
                seen.depth(relative, pixel * tilt / facing.max(1e-9));
                let stored = decode(normals[i]);
                seen.normal(stored.cross(hit.normal).length().atan2(stored.dot(hit.normal)));
            }
            println!("g-buffer {:10} {seen:?}", scene.name);
            seen.check(&scene.name, hits.len());
            // The check can fail: use the neighbour's values.
            let mut planted = Seen::default();
            for i in 1..hits.len() {
                let Some(hit) = hits[i] else { continue };
                planted.normal(decode(normals[i - 1]).angle_between(hit.normal));
                planted.other_ids += usize::from(ids[i - 1] != hit.triangle);
            }
            assert!(planted.normals_off > hits.len() / 200 && planted.other_ids > hits.len() / 100, "{planted:?}");
        }
    });
}
