//! An iron fence, a bicycle and overhead wires, whose shadows cross the paving and climb a wall.

use super::kit::{PI, Stage, TAU, at, circle, rot_x, rot_y, rot_z};
use super::mesh_builder::{MeshBuilder, block, cylinder, floor, lathe, rod, sphere, torus, tube, tube_loop};
use super::texture;
use edgeshade::scene::Scene;
use glam::{DAffine3, DVec3, dvec2, dvec3};

const PANEL: f64 = 2.1;
const PLINTH: f64 = 0.32;
/// Places of the fence and of the wall.
const FENCE_X: f64 = -1.6;
const WALL_X: f64 = 1.5;

pub(super) fn stage() -> Scene {
    let mut stage = Stage::new("fence");
    let grain = stage.texture(texture::speckle());
    let tiles = stage.texture(texture::tiles());
    let paving = stage.textured("paving", 0xc9bda9, tiles);
    let plaster = stage.textured("plaster", 0xe2d3b8, grain);
    let stone = stage.textured("stone", 0xb0a797, grain);
    let iron = stage.paint("iron", 0x2d3336);
    let lawn_green = stage.textured("lawn", 0x737b58, grain);
    let red = stage.paint("red enamel", 0xb23a2c);
    let rubber = stage.paint("rubber", 0x2a2a2c);
    let chrome = stage.paint("chrome", 0xb9bdc0);

    let map = |p: DVec3, n: DVec3| {
        let q = if n.x.abs() > 0.5 { dvec2(p.z, -p.y) } else { dvec2(p.x, p.z - p.y) };
        q * 0.42
    };
    let ground = floor(WALL_X - FENCE_X + 0.4, 22.0, 1, 1).moved(at(0.5 * (WALL_X + FENCE_X) + 0.2, 0.0, -4.5));
    stage.add("paving", &ground.map_uv(|p, _| dvec2(p.x, p.z) * 0.42), paving);
    let lawn = floor(12.0, 22.0, 1, 1).moved(at(FENCE_X - 6.0, 0.0, -4.5));
    stage.add("lawn", &lawn.map_uv(map), lawn_green);

    let mut walls = MeshBuilder::new();
    walls.add(&block(0.4, 3.1, 19.0, 0.03), at(WALL_X + 0.2, 1.55, -3.2));
    walls.add(&block(12.0, 3.1, 0.4, 0.03), at(-4.1, 1.55, -12.6));
    stage.add("walls", &walls.map_uv(map), plaster);
    let mut trim = MeshBuilder::new();
    trim.add(&block(0.52, 0.14, 19.0, 0.03), at(WALL_X + 0.2, 3.15, -3.2));
    trim.add(&block(12.0, 0.14, 0.52, 0.03), at(-4.1, 3.15, -12.6));
    trim.add(&block(0.12, 0.42, 19.0, 0.02), at(WALL_X - 0.02, 0.21, -3.2));
    for i in 0..4 {
        let z = 2.4 - 4.2 * i as f64;
        trim.add(&block(0.24, 2.8, 0.5, 0.03), at(WALL_X - 0.02, 1.4, z));
        trim.add(&block(0.34, 0.12, 0.6, 0.03), at(WALL_X - 0.02, 2.84, z));
    }
    trim.add(&block(0.3, PLINTH, 7.0 * PANEL + 0.2, 0.03), at(FENCE_X, 0.5 * PLINTH, 3.5 - 3.5 * PANEL));
    stage.add("stonework", &trim.map_uv(map), stone);

    let panel_mesh = stage.mesh("fence panel", &panel(), iron);
    let post_mesh = stage.mesh("fence post", &post(), iron);
    for i in 0..7 {
        stage.place(panel_mesh, at(FENCE_X, PLINTH, 3.5 - (i as f64 + 0.5) * PANEL) * rot_y(0.5 * PI));
    }
    for i in 0..8 {
        stage.place(post_mesh, at(FENCE_X, PLINTH, 3.5 - i as f64 * PANEL));
    }

    let lean = at(FENCE_X + 0.62, 0.003, 0.55) * rot_y(0.5 * PI + 0.06) * rot_x(-0.13);
    let bicycle = bicycle();
    stage.add("bicycle frame", &bicycle.frame.moved(lean), red);
    stage.add("bicycle tyres", &bicycle.tyres.moved(lean), rubber);
    stage.add("bicycle metal", &bicycle.metal.moved(lean), chrome);

    stage.add("lanterns and wires", &overhead(), iron);

    stage.camera([0.62, 1.75, 5.3], [-0.42, 0.85, -1.2], 42.0);
    stage.sun([0.0, 0.5, -2.0], 248.0, 33.0, 0.012, 0xfff0d6);
    stage.scene
}

/// A spear at the top of a bar.
fn spear() -> MeshBuilder {
    lathe(
        &[
            (0.0, 0.0),
            (0.018, 0.0),
            (0.021, 0.012),
            (0.012, 0.025),
            (0.012, 0.035),
            (0.03, 0.075),
            (0.026, 0.1),
            (0.0, 0.2),
        ],
        10,
    )
}

/// One panel along x that stands on `y = 0`: bars, rails, rings and scrolls.
fn panel() -> MeshBuilder {
    let mut out = MeshBuilder::new();
    let half = 0.5 * PANEL - 0.04;
    for y in [0.12, 1.32, 1.58] {
        out.add(&block(2.0 * half, 0.035, 0.03, 0.006), at(0.0, y, 0.0));
    }
    let bars = 14;
    let gap = PANEL / bars as f64;
    for i in 0..bars {
        let x = (i as f64 + 0.5) * gap - 0.5 * PANEL;
        let top = if i % 2 == 0 { 1.72 } else { 1.64 };
        out.add(&rod(dvec3(x, 0.0, 0.0), dvec3(x, top, 0.0), 0.0105, 8), at(0.0, 0.0, 0.0));
        out.add(&spear(), at(x, top, 0.0));
    }
    let ring = torus(0.055, 0.008, 18, 6).moved(rot_x(0.5 * PI));
    for i in 0..bars - 1 {
        let x = (i as f64 + 1.0) * gap - 0.5 * PANEL;
        out.add(&ring, at(x, 1.45, 0.0));
    }
    // Pairs of scrolls in every other field above the lower rail.
    let scroll: Vec<DVec3> = (0..=26)
        .map(|i| {
            let t = i as f64 / 26.0;
            let (c, s) = circle(1.9 * TAU * t);
            dvec3(c, s, 0.0) * (0.012 + 0.05 * t)
        })
        .collect();
    let curl = tube(&scroll, |_| 0.006, 6);
    for i in (0..bars - 1).step_by(2) {
        let x = (i as f64 + 1.0) * gap - 0.5 * PANEL;
        out.add(&curl, at(x, 0.28, 0.0));
        out.add(&curl, at(x, 0.42, 0.0) * rot_z(PI));
    }
    out
}

fn post() -> MeshBuilder {
    let mut out = MeshBuilder::new();
    out.add(&block(0.075, 1.85, 0.075, 0.012), at(0.0, 0.925, 0.0));
    out.add(&block(0.11, 0.04, 0.11, 0.012), at(0.0, 1.86, 0.0));
    out.add(&block(0.11, 0.12, 0.11, 0.02), at(0.0, 0.06, 0.0));
    out.add(&lathe(&[(0.0, 0.0), (0.045, 0.0), (0.022, 0.03), (0.022, 0.045)], 20), at(0.0, 1.88, 0.0));
    out.add(&sphere(0.055, 24, 14), at(0.0, 1.97, 0.0));
    out
}

struct Bicycle {
    frame: MeshBuilder,
    tyres: MeshBuilder,
    metal: MeshBuilder,
}

/// A bicycle that rolls along x on `y = 0`.
fn bicycle() -> Bicycle {
    let (mut frame, mut tyres, mut metal) = (MeshBuilder::new(), MeshBuilder::new(), MeshBuilder::new());
    let here = DAffine3::IDENTITY;
    let r = 0.34;
    let (rear, front) = (dvec3(-0.52, r, 0.0), dvec3(0.54, r, 0.0));
    for hub in [rear, front] {
        let place = at(hub.x, hub.y, hub.z) * rot_x(0.5 * PI);
        tyres.add(&torus(r - 0.018, 0.018, 48, 10), place);
        metal.add(&torus(r - 0.042, 0.01, 48, 6), place);
        metal.add(&cylinder(0.022, 0.1, 14, 0.004), place * at(0.0, -0.05, 0.0));
        for i in 0..28 {
            let (c, s) = circle(TAU * i as f64 / 28.0);
            // Spokes leave the hub sideways, as laced wheels do.
            let (hc, hs) = circle(TAU * (i as f64 + if i % 4 < 2 { 5.0 } else { -5.0 }) / 28.0);
            let side = if i % 2 == 0 { 0.03 } else { -0.03 };
            let foot = hub + dvec3(0.02 * hc, 0.02 * hs, side);
            metal.add(&rod(foot, hub + dvec3(c, s, 0.0) * (r - 0.045), 0.0022, 4), here);
        }
        // Mudguard over the upper half.
        let arc: Vec<DVec3> = (0..=18)
            .map(|i| {
                let (c, s) = circle(0.12 * PI + 0.62 * PI * i as f64 / 18.0);
                hub + dvec3(if hub.x < 0.0 { -c } else { c }, s, 0.0) * (r + 0.03)
            })
            .collect();
        frame.add(&tube(&arc, |_| 0.014, 8), here);
    }
    let crank = dvec3(-0.08, 0.28, 0.0);
    let seat = dvec3(-0.24, 0.78, 0.0);
    let (head_low, head_high) = (dvec3(0.36, 0.66, 0.0), dvec3(0.31, 0.84, 0.0));
    for (a, b, radius) in [
        (crank, seat, 0.016),
        (crank, head_low, 0.018),
        (seat, head_high - dvec3(0.0, 0.03, 0.0), 0.015),
        (head_low - dvec3(-0.01, 0.03, 0.0), head_high + dvec3(-0.01, 0.03, 0.0), 0.02),
    ] {
        frame.add(&rod(a, b, radius, 12), here);
    }
    for side in [-0.05, 0.05] {
        let out = dvec3(0.0, 0.0, side);
        frame.add(&rod(crank + 0.5 * out, rear + out, 0.009, 8), here);
        frame.add(&rod(seat + 0.3 * out, rear + out, 0.008, 8), here);
        let fork = [
            head_low + 0.4 * out,
            head_low + dvec3(0.05, -0.14, 0.0) + out,
            front + dvec3(-0.03, 0.07, 0.0) + out,
            front + out,
        ];
        frame.add(&tube(&fork, |_| 0.01, 8), here);
    }
    // Handlebar, saddle, cranks, chain.
    let stem = head_high + dvec3(-0.03, 0.12, 0.0);
    metal.add(&rod(head_high, stem, 0.012, 10), here);
    let bar: Vec<DVec3> = (0..=20)
        .map(|i| {
            let t = i as f64 / 10.0 - 1.0;
            stem + dvec3(0.06 - 0.2 * t * t, 0.05 * (1.0 - t * t), 0.27 * t)
        })
        .collect();
    metal.add(&tube(&bar, |_| 0.011, 8), here);
    for end in [&bar[0..6], &bar[15..21]] {
        tyres.add(&tube(end, |_| 0.016, 8), here);
    }
    metal.add(&rod(seat, seat + dvec3(-0.03, 0.12, 0.0), 0.011, 10), here);
    let saddle = lathe(
        &[(0.0, -0.16), (0.03, -0.155), (0.045, -0.1), (0.06, 0.02), (0.095, 0.1), (0.08, 0.145), (0.0, 0.16)],
        24,
    );
    let flat = DAffine3::from_scale(dvec3(1.0, 0.45, 1.0));
    tyres.add(&saddle, at(-0.27, 0.925, 0.0) * flat * rot_z(0.5 * PI));
    metal.add(&torus(0.085, 0.006, 32, 6), at(crank.x, crank.y, 0.045) * rot_x(0.5 * PI));
    for (turn, side) in [(0.7, 0.07), (0.7 + PI, -0.07)] {
        let (c, s) = circle(turn);
        let pedal = crank + dvec3(0.17 * c, 0.17 * s, side);
        metal.add(&rod(crank + dvec3(0.0, 0.0, side), pedal, 0.009, 8), here);
        tyres.add(&block(0.1, 0.025, 0.07, 0.006), at(pedal.x, pedal.y, pedal.z + 0.7 * side));
    }
    metal.add(&rod(crank - dvec3(0.0, 0.0, 0.075), crank + dvec3(0.0, 0.0, 0.075), 0.012, 10), here);
    let chain: Vec<DVec3> = (0..40)
        .map(|i| {
            let (c, s) = circle(TAU * i as f64 / 40.0);
            let (center, radius) = if c > 0.0 { (crank, 0.085) } else { (rear, 0.035) };
            dvec3(center.x + radius * c, center.y + radius * s, 0.045)
        })
        .collect();
    metal.add(&tube_loop(&chain, |_| 0.004, 5), here);
    Bicycle { frame, tyres, metal }
}

/// Lanterns on brackets along the wall, and wires that cross the lane.
fn overhead() -> MeshBuilder {
    let mut out = MeshBuilder::new();
    let here = DAffine3::IDENTITY;
    for z in [0.3, -3.9, -8.1] {
        let root = dvec3(WALL_X - 0.02, 2.35, z);
        let arm: Vec<DVec3> = (0..=20)
            .map(|i| {
                let t = i as f64 / 20.0;
                root + dvec3(-0.5 * t, 0.16 * libm::sin(PI * t), 0.0)
            })
            .collect();
        out.add(&tube(&arm, |_| 0.012, 8), here);
        let curl: Vec<DVec3> = (0..=28)
            .map(|i| {
                let t = i as f64 / 28.0;
                let (c, s) = circle(1.6 * TAU * t);
                root + dvec3(-0.16, 0.0, 0.0) + dvec3(c, s, 0.0) * (0.015 + 0.085 * t)
            })
            .collect();
        out.add(&tube(&curl, |_| 0.008, 6), here);
        let lantern = root + dvec3(-0.5, -0.36, 0.0);
        out.add(
            &lathe(&[(0.0, 0.0), (0.05, 0.0), (0.06, 0.02), (0.05, 0.04), (0.0, 0.04)], 24),
            at(lantern.x, lantern.y, lantern.z),
        );
        out.add(
            &lathe(&[(0.0, 0.26), (0.11, 0.26), (0.115, 0.275), (0.03, 0.34), (0.012, 0.36), (0.0, 0.37)], 24),
            at(lantern.x, lantern.y, lantern.z),
        );
        for k in 0..6 {
            let (c, s) = circle(TAU * k as f64 / 6.0);
            let d = dvec3(c, 0.0, s);
            out.add(&rod(lantern + d * 0.05 + DVec3::Y * 0.03, lantern + d * 0.1 + DVec3::Y * 0.265, 0.006, 6), here);
        }
        out.add(&sphere(0.04, 16, 10), at(lantern.x, lantern.y + 0.13, lantern.z));
    }
    for (z, sag) in [(-1.6, 0.28), (-1.75, 0.34), (-5.6, 0.3), (-5.8, 0.36)] {
        let (a, b) = (dvec3(WALL_X + 0.1, 3.25, z), dvec3(-7.5, 4.3, z - 0.8));
        let wire: Vec<DVec3> = (0..=40)
            .map(|i| {
                let t = i as f64 / 40.0;
                a + (b - a) * t - DVec3::Y * (4.0 * sag * t * (1.0 - t))
            })
            .collect();
        out.add(&tube(&wire, |_| 0.008, 6), here);
    }
    for z in [-2.4, -6.5] {
        out.add(&rod(dvec3(-7.5, 0.0, z), dvec3(-7.5, 4.7, z), 0.07, 16), here);
        out.add(&block(0.09, 0.09, 0.9, 0.01), at(-7.5, 4.35, z));
    }
    out
}
