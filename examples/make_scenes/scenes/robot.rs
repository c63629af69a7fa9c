//! A four-legged walker on a deck of panels: joints, pistons, pipes and antennae.

use super::kit::{PI, Stage, TAU, align_y, at, circle, rot_x, rot_y, rot_z};
use super::mesh_builder::{MeshBuilder, block, cylinder, floor, lathe, plate, rod, rounded_box, sphere, torus, tube};
use super::texture;
use edgeshade::scene::Scene;
use glam::{DAffine3, DVec2, DVec3, dvec2, dvec3};

/// Parts of the walker by material.
#[derive(Default)]
struct Walker {
    paint: MeshBuilder,
    accent: MeshBuilder,
    metal: MeshBuilder,
    dark: MeshBuilder,
}

pub(super) fn stage() -> Scene {
    let mut stage = Stage::new("robot");
    let tiles = stage.texture(texture::tiles());
    let deck = stage.textured("deck", 0xb4b5ae, tiles);
    let stripe = stage.textured("stripe", 0xcfa54c, tiles);
    let paint = stage.paint("paint", 0xd9d3c5);
    let accent = stage.paint("accent", 0xd0662f);
    let metal = stage.paint("metal", 0x8f979b);
    let dark = stage.paint("dark", 0x353b40);

    // The deck is flat and below everything else. It casts no shadow, so the light's view need not contain it.
    for (x, width, material) in [(-27.8, 60.0, deck), (3.0, 1.6, stripe), (23.8, 40.0, deck)] {
        let strip = floor(width, 80.0, 1, 1).moved(at(x, 0.0, -24.0));
        stage.add("deck", &strip.map_uv(|p, _| dvec2(p.x - 2.2, p.z) / 6.4), material);
    }

    let mut walker = Walker::default();
    body(&mut walker);
    head(&mut walker);
    // Hip, knee and foot of each leg, mid-stride.
    for (x, z, step, lift) in
        [(0.95, 0.62, 0.32, 0.0), (0.95, -0.62, -0.02, 0.34), (-0.95, 0.62, -0.32, 0.0), (-0.95, -0.62, 0.12, 0.0)]
    {
        leg(&mut walker, dvec3(x, 1.62, z), step, lift);
    }
    let place = at(-0.35, 0.0, -0.2) * rot_y(-0.55);
    for (name, shape, material) in [
        ("walker paint", &walker.paint, paint),
        ("walker accent", &walker.accent, accent),
        ("walker metal", &walker.metal, metal),
        ("walker dark", &walker.dark, dark),
    ] {
        stage.add(name, &shape.moved(place), material);
    }

    stage.camera([2.5, 2.9, 6.7], [0.2, 1.22, 0.0], 36.0);
    stage.sun([0.0, 0.0, 0.0], 252.0, 36.0, 0.025, 0xfff1dd);
    stage.scene
}

/// Corners of a centred rectangle with cut corners.
fn octagon(x: f64, y: f64, cut: f64) -> Vec<DVec2> {
    let (x, y) = (0.5 * x, 0.5 * y);
    vec![
        dvec2(x - cut, -y),
        dvec2(x, -y + cut),
        dvec2(x, y - cut),
        dvec2(x - cut, y),
        dvec2(-x + cut, y),
        dvec2(-x, y - cut),
        dvec2(-x, -y + cut),
        dvec2(-x + cut, -y),
    ]
}

/// A round disc about the z axis.
fn disc(radius: f64, thickness: f64, sides: usize) -> MeshBuilder {
    cylinder(radius, thickness, sides, 0.15 * thickness).moved(rot_x(0.5 * PI) * at(0.0, -0.5 * thickness, 0.0))
}

fn body(w: &mut Walker) {
    let here = DAffine3::IDENTITY;
    // Hull: a plate with cut corners as seen from the side, extruded across.
    w.paint.add(&plate(&octagon(2.3, 0.72, 0.2), 0.86, 0.04), at(0.0, 1.75, 0.0));
    w.dark.add(&plate(&octagon(2.0, 0.5, 0.14), 1.0, 0.03), at(0.0, 1.68, 0.0));
    w.accent.add(&rounded_box(dvec3(0.9, 0.1, 0.62), 0.04, 2), at(0.25, 2.13, 0.0));
    w.paint.add(&rounded_box(dvec3(1.5, 0.2, 0.5), 0.06, 2), at(0.0, 1.36, 0.0));
    for side in [-1.0, 1.0] {
        // Side panels with bolts.
        w.paint.add(&plate(&octagon(0.78, 0.4, 0.09), 0.06, 0.012), at(0.0, 1.72, side * 0.52));
        w.accent.add(&plate(&octagon(0.3, 0.12, 0.03), 0.03, 0.008), at(0.0, 1.8, side * 0.56));
        for i in 0..6 {
            let x = -0.3 + 0.12 * i as f64;
            w.metal.add(&disc(0.018, 0.03, 10), at(x, 1.57, side * 0.555));
        }
        // Pipes that run along the hull and bend into it.
        for (k, y) in [1.98, 1.91].into_iter().enumerate() {
            let k = k as f64;
            let z = side * (0.47 + 0.03 * k);
            let path = bent(&[
                dvec3(-1.0 + 0.1 * k, 2.0, side * 0.3),
                dvec3(-1.0 + 0.1 * k, y, z),
                dvec3(0.85 - 0.12 * k, y, z),
                dvec3(0.85 - 0.12 * k, y - 0.32, z),
            ]);
            w.metal.add(&tube(&path, |_| 0.022, 12), here);
        }
    }
    // Tanks, vents and a rack on the back.
    let tank = lathe(
        &[
            (0.0, -0.36),
            (0.08, -0.35),
            (0.14, -0.3),
            (0.16, -0.22),
            (0.16, 0.22),
            (0.14, 0.3),
            (0.08, 0.35),
            (0.0, 0.36),
        ],
        40,
    );
    for z in [-0.19, 0.19] {
        w.accent.add(&tank, at(-0.72, 2.27, z) * rot_z(0.5 * PI));
        for x in [-0.9, -0.54] {
            w.dark.add(&torus(0.16, 0.018, 40, 8), at(x, 2.27, z) * rot_z(0.5 * PI));
        }
    }
    for i in 0..5 {
        w.dark.add(&block(0.03, 0.06, 0.4, 0.01), at(0.0 + 0.11 * i as f64, 2.2, 0.0));
    }
    for z in [-0.36, 0.36] {
        let rail = bent(&[dvec3(-0.3, 2.1, z), dvec3(-0.3, 2.36, z), dvec3(0.72, 2.36, z), dvec3(0.72, 2.1, z)]);
        w.metal.add(&tube(&rail, |_| 0.016, 10), here);
    }
    for x in [-0.2, 0.05, 0.3, 0.55] {
        w.metal.add(&rod(dvec3(x, 2.36, -0.36), dvec3(x, 2.36, 0.36), 0.012, 10), here);
    }
    // Antennae: whips, a mast with a dish.
    for (x, z, height, lean) in [(-1.02, 0.3, 1.25, -0.35), (-1.02, -0.3, 0.95, -0.2)] {
        let whip: Vec<DVec3> = (0..=16)
            .map(|i| {
                let t = i as f64 / 16.0;
                dvec3(x + lean * t * t, 2.0 + height * t, z)
            })
            .collect();
        w.dark.add(&tube(&whip, |t| 0.014 - 0.007 * t, 8), here);
        w.accent.add(&sphere(0.035, 20, 12), at(x + lean, 2.0 + height, z));
        w.metal.add(&cylinder(0.035, 0.14, 16, 0.008), at(x, 1.96, z));
    }
    w.metal.add(&rod(dvec3(0.62, 2.15, -0.2), dvec3(0.62, 2.85, -0.2), 0.018, 12), here);
    let dish = lathe(
        &[
            (0.0, 0.0),
            (0.1, 0.012),
            (0.19, 0.05),
            (0.25, 0.1),
            (0.255, 0.112),
            (0.245, 0.112),
            (0.18, 0.062),
            (0.1, 0.026),
            (0.0, 0.014),
        ],
        48,
    );
    let aim = at(0.62, 2.85, -0.2) * rot_z(-0.8) * rot_x(0.3);
    w.paint.add(&dish, aim);
    w.metal.add(&rod(DVec3::ZERO, DVec3::Y * 0.2, 0.008, 8), aim);
    w.accent.add(&sphere(0.024, 16, 10), aim * at(0.0, 0.2, 0.0));
}

fn head(w: &mut Walker) {
    let neck = bent(&[dvec3(1.1, 1.8, 0.0), dvec3(1.35, 1.85, 0.0), dvec3(1.5, 2.05, 0.0)]);
    w.dark.add(&tube(&neck, |_| 0.11, 24), DAffine3::IDENTITY);
    for i in 0..4 {
        let t = i as f64 / 3.0;
        w.metal.add(
            &torus(0.115, 0.016, 32, 8),
            at(1.18 + 0.22 * t, 1.81 + 0.13 * t * t, 0.0) * rot_z(-0.5 * PI + 0.7 * t),
        );
    }
    let place = at(1.62, 2.12, 0.0) * rot_z(-0.12);
    w.paint.add(&rounded_box(dvec3(0.56, 0.36, 0.5), 0.08, 4), place);
    w.dark.add(&rounded_box(dvec3(0.1, 0.22, 0.42), 0.04, 3), place * at(0.27, 0.0, 0.0));
    for z in [-0.11, 0.11] {
        w.metal.add(&disc(0.075, 0.1, 32), place * at(0.32, 0.01, z) * rot_y(0.5 * PI));
        w.accent.add(&sphere(0.055, 28, 16), place * at(0.36, 0.01, z));
    }
    for z in [-0.28, 0.28] {
        w.metal.add(&disc(0.1, 0.07, 32), place * at(-0.05, 0.0, z));
        w.dark.add(&rod(dvec3(-0.05, 0.05, z), dvec3(-0.22, 0.42, z * 1.2), 0.012, 10), place);
    }
    w.accent.add(&rounded_box(dvec3(0.3, 0.05, 0.3), 0.02, 2), place * at(-0.05, 0.19, 0.0));
}

/// A polyline with its corners rounded.
fn bent(corners: &[DVec3]) -> Vec<DVec3> {
    let mut out = vec![corners[0]];
    for k in 1..corners.len() - 1 {
        let (a, b, c) = (corners[k - 1], corners[k], corners[k + 1]);
        let reach = 0.12f64.min(0.45 * (b - a).length()).min(0.45 * (c - b).length());
        let (p, q) = (b + (a - b).normalize() * reach, b + (c - b).normalize() * reach);
        for i in 0..=6 {
            let t = i as f64 / 6.0;
            out.push(p.lerp(b, t).lerp(b.lerp(q, t), t));
        }
    }
    out.push(corners[corners.len() - 1]);
    out
}

fn leg(w: &mut Walker, hip: DVec3, step: f64, lift: f64) {
    let side = hip.z.signum();
    let outward = dvec3(0.0, 0.0, side);
    let shoulder = hip + outward * 0.14;
    let foot = dvec3(hip.x + step, 0.07 + lift, hip.z + side * 0.32);
    // The knee bends outward and away from the middle.
    let (upper, lower) = (0.86, 0.98);
    let span = foot - shoulder;
    let d = span.length().min(upper + lower - 0.01);
    let along = (upper * upper - lower * lower + d * d) / (2.0 * d);
    let out = (upper * upper - along * along).max(0.0).sqrt();
    let axis = span.normalize();
    let want = dvec3(hip.x.signum() * 0.85, 0.25, side * 0.35);
    let bend = (want - axis * axis.dot(want)).normalize();
    let knee = shoulder + axis * along + bend * out;

    // Hip: a drum across the hull, with a ring of bolts.
    w.metal.add(&disc(0.24, 0.26, 48), at(hip.x, hip.y, hip.z - side * 0.02));
    w.paint.add(&disc(0.19, 0.08, 40), at(hip.x, hip.y, hip.z + side * 0.15));
    for i in 0..8 {
        let (c, s) = circle(TAU * i as f64 / 8.0);
        w.dark.add(&disc(0.02, 0.04, 10), at(hip.x + 0.145 * c, hip.y + 0.145 * s, hip.z + side * 0.19));
    }
    // Thigh: two cheeks with a box between.
    let thigh = frame(shoulder, knee, outward);
    let length = (knee - shoulder).length();
    let cheek = plate(
        &[
            dvec2(-0.13, -0.1),
            dvec2(0.13, -0.1),
            dvec2(0.16, 0.1),
            dvec2(0.1, length),
            dvec2(0.05, length + 0.1),
            dvec2(-0.05, length + 0.1),
            dvec2(-0.1, length),
            dvec2(-0.16, 0.1),
        ],
        0.05,
        0.012,
    );
    for z in [-0.085, 0.085] {
        w.paint.add(&cheek, thigh * at(0.0, 0.0, z));
    }
    w.dark.add(&rounded_box(dvec3(0.16, length * 0.8, 0.12), 0.03, 2), thigh * at(0.0, 0.5 * length, 0.0));
    w.accent.add(&plate(&octagon(0.1, 0.36, 0.03), 0.03, 0.008), thigh * at(0.0, 0.5 * length, 0.115));
    // Knee.
    w.metal.add(&disc(0.115, 0.26, 40), at(knee.x, knee.y, knee.z));
    w.accent.add(&disc(0.07, 0.3, 32), at(knee.x, knee.y, knee.z));
    // Shin: a tapering strut with a piston beside it.
    let shin = frame(knee, foot, outward);
    let length = (foot - knee).length();
    let strut = lathe(
        &[
            (0.0, 0.0),
            (0.085, 0.0),
            (0.09, 0.03),
            (0.09, 0.3),
            (0.06, 0.42),
            (0.05, length - 0.14),
            (0.065, length - 0.12),
            (0.065, length - 0.02),
            (0.0, length - 0.02),
        ],
        32,
    );
    w.paint.add(&strut, shin);
    let behind = -hip.x.signum() * 0.12;
    w.dark.add(&cylinder(0.04, 0.34, 20, 0.01), shin * at(behind, 0.08, 0.0));
    w.metal.add(&rod(dvec3(behind, 0.4, 0.0), dvec3(behind * 0.5, length - 0.12, 0.0), 0.02, 14), shin);
    for y in [0.1, 0.24] {
        w.accent.add(&torus(0.092, 0.012, 36, 8), shin * at(0.0, y, 0.0));
    }
    // Hose from thigh to shin.
    let hose = bent(&[
        thigh.transform_point3(dvec3(0.0, 0.45, 0.13)),
        knee + outward * 0.24 + bend * 0.06,
        shin.transform_point3(dvec3(0.0, 0.36, 0.07)),
    ]);
    w.dark.add(&tube(&hose, |_| 0.016, 10), DAffine3::IDENTITY);
    // Foot: ankle ball and a round pad, level.
    w.metal.add(&sphere(0.09, 32, 18), at(foot.x, foot.y + 0.05, foot.z));
    let pad = lathe(
        &[(0.0, 0.0), (0.2, 0.0), (0.215, 0.012), (0.215, 0.04), (0.2, 0.055), (0.12, 0.075), (0.08, 0.1), (0.0, 0.1)],
        40,
    );
    let tilt = if lift > 0.0 { rot_z(-0.25) } else { rot_z(0.0) };
    w.dark.add(&pad, at(foot.x, foot.y - 0.07, foot.z) * tilt);
}

/// A frame at `a` whose y axis points to `b` and whose z axis stays near `outward`.
fn frame(a: DVec3, b: DVec3, outward: DVec3) -> DAffine3 {
    let y = (b - a).normalize();
    let x = y.cross(outward).normalize();
    let mut out = align_y(y);
    out.matrix3 = glam::DMat3::from_cols(x, y, x.cross(y));
    out.translation = a;
    out
}
