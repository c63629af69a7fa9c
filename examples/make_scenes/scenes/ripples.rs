//! A ground with waves that get narrower to the right, under poles, frames and a net.

use super::kit::{PI, Stage, at, rot_y, sin, smoothstep};
use super::mesh_builder::{MeshBuilder, block, floor, rod, sphere, surface, tube};
use super::texture;
use edgeshade::scene::Scene;
use glam::{DVec3, dvec2, dvec3};

/// Half width of the field, its ends near the viewer and far away, and its underside.
const HALF: f64 = 6.5;
const NEAR: f64 = 3.2;
const FAR: f64 = -3.6;
const BASE: f64 = -0.8;

pub(super) fn stage() -> Scene {
    let mut stage = Stage::new("ripples");
    let grain = stage.texture(texture::speckle());
    let sand = stage.textured("sand", 0xd9bd93, grain);
    let dark = stage.paint("poles", 0x3b4148);
    let red = stage.paint("frames", 0xb8452f);
    let blue = stage.paint("balls", 0x3f6d86);

    let table = stage.textured("table", 0x5b7476, grain);
    // The ground is flat and below everything else. It casts no shadow, so the light's view need not contain it.
    let ground = floor(100.0, 80.0, 1, 1).map_uv(|p, _| dvec2(p.x, p.z) * 0.2);
    stage.add("table", &ground.moved(at(0.0, BASE, -14.0)), table);
    stage.add("field", &field().map_uv(|p, _| dvec2(p.x * 0.25, p.z * 0.25)), sand);
    stage.add("poles", &poles(), dark);
    stage.add("frames", &frames(), red);
    let ball = stage.mesh("ball", &sphere(0.3, 48, 24), blue);
    for (x, z) in [(-4.9, 0.9), (-1.2, 1.6), (2.6, 1.2)] {
        stage.place(ball, at(x, rest(x, z, 0.3), z));
    }

    stage.camera([2.5, 6.2, 11.5], [0.2, -0.15, -0.1], 35.5);
    stage.sun([0.0, 0.0, 0.0], 238.0, 35.0, 0.025, 0xfff0d8);
    stage.scene
}

/// Height of the ground: a chirp with one wave in three metres on the left and five per metre on the right.
fn height(x: f64, z: f64) -> f64 {
    let s = (x + HALF) / (2.0 * HALF);
    // The phase is the integral of the frequency f(s) = f0 (f1 / f0)^s.
    let (f0, f1) = (0.28, 3.6);
    let rate = libm::log(f1 / f0);
    let phase = 2.0 * PI * 2.0 * HALF * f0 * (libm::exp(rate * s) - 1.0) / rate;
    // The waves get lower as they get narrower, so that their steepness grows slowly.
    let amplitude = 0.34 * libm::exp(-0.72 * rate * s);
    let bend = 0.18 * sin(0.5 * z + 0.8) + 0.06 * sin(1.3 * z);
    let sway = phase + bend * 2.0 * PI * 0.5;
    amplitude * (sin(sway) + 0.16 * sin(2.0 * sway)) * smoothstep(-HALF - 0.1, -HALF + 0.6, x)
}

/// Height of the centre of a ball that lies on the ground at `(x, z)`.
fn rest(x: f64, z: f64, radius: f64) -> f64 {
    let reach = |i: i32| {
        let d = radius * f64::from(i) / 40.0;
        height(x + d, z) + (radius * radius - d * d).max(0.0).sqrt()
    };
    (-40..=40).map(reach).fold(f64::NEG_INFINITY, f64::max)
}

/// The field as a slab with sides, its columns as dense as the waves.
fn field() -> MeshBuilder {
    let nx = 520;
    // Columns follow the phase: there are more where the waves are narrow.
    let column = |u: f64| {
        let k = 1.7;
        -HALF + 2.0 * HALF * (1.0 - libm::exp(-k * u)) / (1.0 - libm::exp(-k))
    };
    let point = |u: f64, v: f64| {
        let (x, z) = (column(u), NEAR + (FAR - NEAR) * v);
        dvec3(x, height(x, z), z)
    };
    let mut out = surface(nx, 20, point);
    let skirt = |nu: usize, p: &dyn Fn(f64) -> DVec3| {
        surface(nu, 1, |u, v| {
            let top = p(u);
            dvec3(top.x, BASE + (top.y - BASE) * v, top.z)
        })
    };
    out.add(&skirt(nx, &|u| point(u, 0.0)), at(0.0, 0.0, 0.0));
    out.add(&skirt(nx, &|u| point(1.0 - u, 1.0)), at(0.0, 0.0, 0.0));
    out.add(&skirt(20, &|u| point(1.0, u)), at(0.0, 0.0, 0.0));
    out.add(&skirt(20, &|u| point(0.0, 1.0 - u)), at(0.0, 0.0, 0.0));
    out
}

fn poles() -> MeshBuilder {
    let mut out = MeshBuilder::new();
    let tops: Vec<DVec3> = (0..9)
        .map(|i| {
            let x = -5.8 + 1.45 * i as f64;
            let z = -2.7 + 0.3 * sin(1.7 * i as f64);
            let top = dvec3(x, 1.75 + 0.35 * sin(2.3 * i as f64), z);
            out.add(&rod(dvec3(x, height(x, z) - 0.2, z), top, 0.035, 16), at(0.0, 0.0, 0.0));
            out.add(&sphere(0.06, 20, 12), at(top.x, top.y + 0.03, top.z));
            top
        })
        .collect();
    for pair in tops.windows(2) {
        for drop in [0.12, 0.45] {
            let wire: Vec<DVec3> = (0..=24)
                .map(|k| {
                    let t = k as f64 / 24.0;
                    pair[0] + (pair[1] - pair[0]) * t - DVec3::Y * (drop + 0.5 * t * (1.0 - t))
                })
                .collect();
            out.add(&tube(&wire, |_| 0.009, 8), at(0.0, 0.0, 0.0));
        }
    }
    out
}

/// Square frames in the sand, each in the shadow of another.
fn frames() -> MeshBuilder {
    let mut out = MeshBuilder::new();
    for (x, z, turn, size) in [(-3.3, -0.9, 0.45, 1.6), (0.5, -0.7, -0.25, 1.4), (4.1, -0.9, 0.3, 1.6)] {
        let place = at(x, 0.5 * size - 0.05, z) * rot_y(turn);
        let bar = 0.085;
        for s in [-0.5, 0.5] {
            out.add(&block(bar, size, bar, 0.015), place * at(s * (size - bar), 0.0, 0.0));
            out.add(&block(size - 2.0 * bar, bar, bar, 0.015), place * at(0.0, s * (size - bar), 0.0));
        }
        for i in 1..6 {
            let t = (i as f64 / 6.0 - 0.5) * (size - bar);
            out.add(&rod(dvec3(t, bar - 0.5 * size, 0.0), dvec3(t, 0.5 * size - bar, 0.0), 0.011, 10), place);
        }
    }
    out
}
