//! The G-buffer against primary rays in `f64`.

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
            let (mut other_ids, mut worst_depth, mut worst_snap, mut worst_angle) = (0, 0.0f64, 0.0f64, 0.0f64);
            for (i, hit) in hits.iter().enumerate() {
                let id = hit.map_or(SKY, |h| h.triangle);
                if ids[i] != id {
                    other_ids += 1;
                    continue;
                }
                let Some(hit) = hit else { continue };
                let p = camera.world_from_view.inverse().transform_point3(hit.position);
                let clip = camera.clip_from_view * p.extend(1.0);
                let expected = clip.z / clip.w;
                let relative = (f64::from(depth[i]) / expected - 1.0).abs();
                // A rasteriser places corners on a grid of at least 1/16 of a pixel (subPixelPrecisionBits >= 4),
                // in practice 1/256: a depth may be that of a point this far beside the pixel's centre.
                let normal = camera.world_from_view.matrix3.transpose() * hit.normal;
                let tilt = (1.0 - normal.z * normal.z).max(0.0).sqrt();
                let facing = normal.dot(p).abs() / p.length();
                let pixel = 2.0 / (f64::from(SIZE[1]) * camera.clip_from_view.y_axis.y.abs());
                let slope_of_a_pixel = pixel * tilt.max(1e-3) / facing.max(1e-9);
                worst_depth = worst_depth.max(relative);
                worst_snap = worst_snap.max((relative - 1e-6).max(0.0) / slope_of_a_pixel);
                worst_angle = worst_angle.max(decode(normals[i]).cross(hit.normal).length());
                assert!(decode(normals[i]).dot(hit.normal) > 0.0, "{}: pixel {i}: the normal looks away", scene.name);
            }
            println!(
                "g-buffer {:10} other ids {:.2} %, depth off by {worst_depth:.1e} relative or {worst_snap:.4} px, normal by {worst_angle:.1e} rad",
                scene.name,
                100.0 * other_ids as f64 / hits.len() as f64
            );
        }
    });
}
