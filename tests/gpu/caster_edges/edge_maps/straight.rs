//! A half-plane over a ground at many angles, compared with the closed form: the position of its shadow boundary, and
//! the profile of a soft border.

use super::KERNELS;
use crate::common::{desc, renderer, visibility, with_gpu};
use crate::made::{self, mesh, moved, perspective, plane, sun};
use edgeshade::host::Host;
use edgeshade::reference::caster_edges::edsm::border;
use edgeshade::scene::{Renderer, Scene};
use edgeshade::technique::find;
use edgeshade::view::{CameraView, LightView, look_along, look_at};
use glam::{DAffine3, DVec2, DVec3, dvec2, dvec3};

const SIZE: [u32; 2] = [160, 160];
const MAP: u32 = 256;
/// Half of the map's width, world units; a texel is 1/16.
const HALF: f64 = 8.0;
const TEXEL: f64 = 2.0 * HALF / MAP as f64;
const ANGLES: u32 = 32;

/// Returns a half-plane 3 above the ground whose edge passes through a point near the middle at an angle. The light
/// shines straight down, so the edge's shadow lies below it.
fn scene(angle: f64) -> (Scene, DVec2, DVec2) {
    let along = DVec2::from_angle(angle);
    let across = along.perp();
    let middle = dvec2(0.0137, -0.0291);
    let p = |u: f64, v: f64| {
        let q = middle + u * along + v * across;
        dvec3(q.x, 0.0, q.y)
    };
    let (a, b, c, d) = (p(-20.0, 0.0), p(20.0, 0.0), p(20.0, 20.0), p(-20.0, 20.0));
    let parts = vec![(plane(30.0), DAffine3::IDENTITY), (mesh(&[[a, b, c], [a, c, d]]), moved(dvec3(0.0, 3.0, 0.0)))];
    let camera = perspective(dvec3(0.0, 2.0, 1e-3), DVec3::ZERO, 0.1);
    (made::scene(parts, camera, sun(DVec3::Y)), middle, across)
}

fn light() -> LightView {
    let seen = look_along(dvec3(0.0, 10.0, 0.0), dvec3(0.0, -1.0, 1e-9));
    LightView::directional(seen, [HALF, HALF], 1.0, 12.0, 0.0)
}

/// Returns a renderer, and for each pixel the distance, in texels, of its point inside the shadow.
fn placed(host: &Host, angle: f64) -> (Renderer<'_>, Vec<f64>) {
    let (scene, middle, across) = scene(angle);
    let mut r = renderer(host, &scene, desc(SIZE, MAP));
    r.set_light(&scene, light());
    let camera: CameraView = *r.camera();
    let ndc = |i: u32, n: u32| (2.0 * f64::from(i) + 1.0) / f64::from(n) - 1.0;
    let inside = |i: u32| {
        let (origin, direction) = camera.ray([ndc(i % SIZE[0], SIZE[0]), ndc(i / SIZE[0], SIZE[1])]);
        let p = origin - direction * (origin.y / direction.y);
        (dvec2(p.x, p.z) - middle).dot(across) / TEXEL
    };
    let inside = (0..SIZE[0] * SIZE[1]).map(inside).collect();
    (r, inside)
}

#[test]
fn straight_edges_lie_where_they_are() {
    with_gpu(|host| {
        // The sign of a single line is right whatever its scale.
        let techniques: [(&str, &[(&str, &str)]); 5] = [
            ("sm", &[]),
            ("sssm", &[]),
            ("edsm", &[]),
            ("edsm", &[("priority", "cosine")]),
            ("edsm", find("edsm").unwrap().published),
        ];
        // Wrong pixels among those within a texel of the boundary, and the farthest of them.
        let (mut wrong, mut farthest, mut band) = ([0; 5], [0.0f64; 5], 0);
        for k in 0..ANGLES {
            let (mut r, inside) = placed(host, std::f64::consts::TAU * f64::from(k) / f64::from(ANGLES) + 1e-3);
            band += inside.iter().filter(|d| d.abs() < 1.0).count();
            for (i, (id, settings)) in techniques.iter().enumerate() {
                let seen = visibility(&mut r, id, settings);
                for (v, d) in seen.iter().zip(&inside) {
                    // Rounding moves a pixel by up to a hundredth of a texel; the pixels are half a texel wide.
                    if (*v < 0.5) != (*d > 0.0) && d.abs() > 0.01 {
                        wrong[i] += 1;
                        farthest[i] = farthest[i].max(d.abs());
                    }
                }
            }
        }
        for (i, (id, settings)) in techniques.iter().enumerate() {
            println!(
                "half-planes: {id} {settings:?}: {} of {band} pixels within a texel are wrong, up to {:.3} texels from the edge",
                wrong[i], farthest[i]
            );
        }
        assert!(wrong[0] * 10 > band, "plain shadow mapping has no stairs here: the test says nothing");
        for i in 1..5 {
            // Where an edge passes within rasterisation's grid of a texel's centre, that texel may have the depth of
            // the other side.
            assert!(wrong[i] * 200 <= band, "{}: {} of {band}", techniques[i].0, wrong[i]);
        }
    });
}

#[test]
fn borders_have_their_width_and_shape() {
    with_gpu(|host| {
        for (word, kernel) in KERNELS {
            for width in [1.0, 5.0, 16.0] {
                let text = f64::to_string(&width);
                let (mut worst, mut other) = (0.0f64, 0.0f64);
                for k in 0..8 {
                    let (mut r, inside) = placed(host, 0.4 + std::f64::consts::TAU * f64::from(k) / 8.0);
                    let seen = visibility(&mut r, "edsm", &[("border", &text), ("kernel", word)]);
                    for (v, d) in seen.iter().zip(&inside) {
                        let off = |half: f64| (f64::from(*v) - border(d / half, kernel)).abs();
                        worst = worst.max(off(0.5 * width));
                        other = other.max(off(0.45 * width));
                    }
                }
                println!("border {width} {word}: visibility off by {worst:.4} at most");
                // Distances of up to 9.5 texels have 11 bits.
                let most = 0.02 + 0.01 / width;
                assert!(worst < most && other > most, "{width} {word}: {worst}, of another width {other}");
            }
        }
    });
}

/// The tested region lies in the light's own view.
#[test]
fn the_half_planes_lie_in_the_map() {
    let l = light();
    let p = l.clip_from_view * l.world_from_view.inverse().transform_point3(dvec3(7.9, 0.0, -7.9)).extend(1.0);
    assert!(p.x.abs() < 1.0 && p.y.abs() < 1.0 && (0.0..1.0).contains(&p.z), "{p}");
    assert!(look_at(DVec3::Y, DVec3::ZERO).is_finite());
}
