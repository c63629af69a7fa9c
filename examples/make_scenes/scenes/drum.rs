//! A still life of curved receivers behind a rack of rods: drum, ball, bowl, saddle, lying cylinder.

use super::kit::{PI, Stage, TAU, at, circle, cos, rot_x, rot_y, rot_z, sin};
use super::mesh_builder::{
    MeshBuilder, block, cylinder, lathe, rod, rounded_box, sphere, studio, surface, torus, tube,
};
use super::texture;
use edgeshade::scene::Scene;
use glam::{DVec3, dvec2, dvec3};

pub(super) fn stage() -> Scene {
    let mut stage = Stage::new("drum");
    let grain = stage.texture(texture::speckle());
    let paper = stage.textured("studio", 0xd9cfc0, grain);
    let cream = stage.paint("cream", 0xe8dfcf);
    let teal = stage.paint("teal", 0x4f8a8b);
    let terracotta = stage.paint("terracotta", 0xc8694a);
    let sand = stage.paint("sand", 0xd8b384);
    let steel = stage.paint("steel", 0x9aa0a3);
    let dark = stage.paint("dark", 0x3c4447);

    stage.add("studio", &studio(26.0, 6.0, -3.4, 1.6, 6.0).map_uv(|p, _| dvec2(p.x * 0.25, (p.z - p.y) * 0.25)), paper);

    let place = at(-0.95, 0.0, -0.75) * rot_y(0.2);
    stage.add("drum shell", &shell().moved(place), terracotta);
    stage.add("drum skin", &cylinder(0.985, 0.03, 96, 0.012).moved(place * at(0.0, 1.3, 0.0)), cream);
    stage.add("drum fittings", &fittings().moved(place), steel);
    // A pair of sticks on the skin.
    let mut sticks = MeshBuilder::new();
    for (turn, x) in [(0.5, -0.1), (0.85, 0.12)] {
        sticks.add(&stick(), place * at(x, 1.352, 0.1) * rot_y(turn));
    }
    stage.add("sticks", &sticks, sand);

    stage.add("ball", &sphere(0.72, 80, 40).moved(at(1.05, 0.72, -0.85)), cream);
    stage.add("small ball", &sphere(0.26, 48, 24).moved(at(0.35, 0.26, 0.62)), terracotta);
    stage.add("bowl", &bowl().moved(at(2.35, 0.505, 0.25) * rot_y(-0.9) * rot_x(0.5)), teal);
    stage.add("saddle", &saddle().moved(at(1.1, 0.0, 1.3) * rot_y(0.35)), sand);
    stage.add(
        "roll",
        &cylinder(0.36, 1.7, 72, 0.04).moved(at(-1.6, 0.36, 0.95) * rot_y(0.42) * rot_z(-0.5 * PI)),
        teal,
    );

    stage.add("rack", &rack(), dark);

    stage.camera([3.0, 3.0, 7.3], [-0.25, 0.8, 0.0], 33.0);
    stage.spot([-9.0, 5.1, 6.6], [0.1, 0.7, -0.6], 33.0, 0.07, 0xfff2e0);
    stage.scene
}

fn shell() -> MeshBuilder {
    lathe(&[(0.0, 0.06), (0.94, 0.06), (0.95, 0.07), (0.95, 1.29), (0.94, 1.3), (0.0, 1.3)], 128)
}

/// Hoops above and below, lugs, and the rods that tension them.
fn fittings() -> MeshBuilder {
    let mut out = MeshBuilder::new();
    let hoop = lathe(
        &[(0.985, 0.0), (1.02, 0.0), (1.035, 0.012), (1.035, 0.088), (1.02, 0.1), (0.985, 0.1), (0.985, 0.0)],
        128,
    );
    out.add(&hoop, at(0.0, 0.0, 0.0));
    out.add(&hoop, at(0.0, 1.26, 0.0));
    let lug = rounded_box(dvec3(0.09, 0.3, 0.08), 0.03, 3);
    let nut = cylinder(0.028, 0.05, 12, 0.006);
    for i in 0..10 {
        let turn = rot_y(TAU * i as f64 / 10.0);
        out.add(&lug, turn * at(0.985, 0.68, 0.0));
        out.add(&rod(DVec3::new(1.055, 0.02, 0.0), DVec3::new(1.055, 1.36, 0.0), 0.014, 12), turn);
        out.add(&nut, turn * at(1.055, 1.345, 0.0));
        out.add(&nut, turn * at(1.055, 0.0, 0.0));
        for y in [0.05, 1.31] {
            out.add(&block(0.05, 0.07, 0.07, 0.012), turn * at(1.047, y, 0.0));
        }
    }
    out
}

fn stick() -> MeshBuilder {
    let radius = 0.022;
    lathe(
        &[
            (0.0, -0.7),
            (0.016, -0.695),
            (radius, -0.68),
            (radius, 0.35),
            (0.011, 0.62),
            (0.012, 0.64),
            (0.02, 0.66),
            (0.022, 0.68),
            (0.018, 0.7),
            (0.009, 0.712),
            (0.0, 0.715),
        ],
        24,
    )
    .moved(rot_z(0.5 * PI))
}

/// A thick hemisphere, open upward, whose lowest point is `0.8` below the plane of the rim.
fn bowl() -> MeshBuilder {
    let (outer, inner) = (0.8, 0.74);
    let arc = |r: f64, i: usize, n: usize| {
        let a = 0.5 * PI * i as f64 / n as f64;
        (if i == 0 { 0.0 } else { r * sin(a) }, -r * cos(a))
    };
    let mut profile: Vec<(f64, f64)> = (0..=24).map(|i| arc(outer, i, 24)).collect();
    // The rim is a half round.
    profile.extend((1..8).map(|i| {
        let (c, s) = circle(PI * i as f64 / 8.0);
        (0.77 + 0.03 * c, 0.03 * s)
    }));
    profile.extend((0..=24).rev().map(|i| arc(inner, i, 24)));
    // The centre of curvature stays at the bowl's own origin, so tilting keeps the bowl on the ground.
    lathe(&profile, 80).moved(at(0.0, 0.295, 0.0))
}

/// A hyperbolic paraboloid with some thickness, on a small foot.
fn saddle() -> MeshBuilder {
    let (half, thickness) = (0.78, 0.035);
    let height = |x: f64, z: f64| 0.5 + 0.52 * (x * x - z * z);
    let top = surface(30, 30, |u, v| {
        let (x, z) = (half * (2.0 * u - 1.0), half * (1.0 - 2.0 * v));
        dvec3(x, height(x, z), z)
    });
    let mut out = MeshBuilder::new();
    out.add(&top, at(0.0, 0.0, 0.0));
    let under = surface(30, 30, |u, v| {
        let (x, z) = (half * (2.0 * u - 1.0), half * (2.0 * v - 1.0));
        dvec3(x, height(x, z) - thickness, z)
    });
    out.add(&under, at(0.0, 0.0, 0.0));
    for side in 0..4 {
        let turn = rot_y(0.5 * PI * side as f64);
        let edge = surface(30, 1, |u, v| {
            let p = turn.transform_point3(dvec3(half * (2.0 * u - 1.0), 0.0, half));
            dvec3(p.x, height(p.x, p.z) - thickness * (1.0 - v), p.z)
        });
        out.add(&edge, at(0.0, 0.0, 0.0));
    }
    out.add(
        &lathe(
            &[
                (0.0, 0.0),
                (0.3, 0.0),
                (0.31, 0.015),
                (0.3, 0.03),
                (0.07, 0.06),
                (0.05, 0.12),
                (0.05, 0.47),
                (0.0, 0.47),
            ],
            48,
        ),
        at(0.0, 0.0, 0.0),
    );
    out
}

/// Upright rods between two rails, and a few bent hoops, on the light's side.
fn rack() -> MeshBuilder {
    let mut out = MeshBuilder::new();
    let (a, b) = (dvec3(-3.3, 0.0, -1.1), dvec3(-2.1, 0.0, 2.9));
    let along = (b - a).normalize();
    let turn = rot_y(libm::atan2(-along.z, along.x));
    let middle = 0.5 * (a + b);
    let length = (b - a).length() + 0.3;
    out.add(&block(length, 0.09, 0.26, 0.025), at(middle.x, 0.045, middle.z) * turn);
    let rods = 13;
    for i in 0..rods {
        let t = i as f64 / (rods - 1) as f64;
        let foot = a + (b - a) * t + DVec3::Y * 0.08;
        let height = 2.25 + 0.25 * cos(2.0 * PI * t);
        out.add(&rod(foot, foot + DVec3::Y * height, 0.026, 16), at(0.0, 0.0, 0.0));
        out.add(&sphere(0.05, 20, 12), at(foot.x, foot.y + height + 0.03, foot.z));
    }
    let wave: Vec<DVec3> = (0..=64)
        .map(|i| {
            let t = i as f64 / 64.0;
            a + (b - a) * t + DVec3::Y * (1.05 + 0.2 * cos(2.0 * PI * t))
        })
        .collect();
    out.add(&tube(&wave, |_| 0.014, 10), at(0.0, 0.0, 0.0));
    let ring = torus(0.2, 0.014, 40, 10).moved(rot_x(0.5 * PI));
    for t in [0.25, 0.5, 0.75] {
        let p = a + (b - a) * t;
        out.add(&ring, at(p.x, 1.65, p.z) * turn);
    }
    out
}
