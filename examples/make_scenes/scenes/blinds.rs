//! A room with slatted blinds: a street lamp shines through many parallel thin slats on table, chairs and shelves.

use super::kit::{PI, Rng, Stage, TAU, at, rot_x, rot_y, rot_z, sin};
use super::mesh_builder::{MeshBuilder, block, cylinder, lathe, plate, rod, rounded_box, sharp_box, sphere, tube};
use super::texture;
use edgeshade::scene::Scene;
use glam::{DAffine3, DVec2, DVec3, dvec2, dvec3};

/// Inner faces of the room: left, right, back and front wall, and ceiling.
const LEFT: f64 = -2.6;
const RIGHT: f64 = 2.6;
const BACK: f64 = -2.4;
const FRONT: f64 = 4.4;
const CEILING: f64 = 2.7;
/// The two windows: where they begin and end along the wall, their sill and their head.
const WINDOWS: [(f64, f64); 2] = [(-2.0, -0.1), (0.15, 2.05)];
const SILL: f64 = 0.75;
const HEAD: f64 = 2.4;
/// Distance, width and slope of the slats; they fall towards the room.
const PITCH: f64 = 0.075;
const SLAT: f64 = 0.07;
const TILT: f64 = 0.06;
const HERE: DAffine3 = DAffine3::IDENTITY;

pub(super) fn stage() -> Scene {
    let mut stage = Stage::new("blinds");
    let grain = stage.texture(texture::speckle());
    let wood = stage.texture(texture::wood());
    let wall = stage.textured("wall", 0xd9cfbd, grain);
    let boards = stage.textured("boards", 0xb88d5f, wood);
    let oak = stage.textured("oak", 0xcfa873, wood);
    let white = stage.paint("white", 0xe9e6de);
    let green = stage.paint("green", 0x4f6b5c);
    let dark = stage.paint("dark", 0x3d3a37);
    let clay = stage.paint("clay", 0xb9654a);

    let plaster = |p: DVec3, n: DVec3| {
        let q = if n.x.abs() > 0.5 { dvec2(p.z, -p.y) } else { dvec2(p.x, p.z - p.y) };
        q * 0.35
    };
    let [walls, piers] = walls();
    stage.add("walls", &walls.map_uv(plaster), wall);
    stage.add("piers", &piers.map_uv(plaster), wall);
    stage.add("floor", &floor().map_uv(|p, _| dvec2(p.z * 0.3 + 0.37 * (p.x / 0.18).floor(), p.x * 0.8)), boards);
    stage.add("window frames", &frames(), white);
    stage.add("blinds", &blinds(), white);
    stage.add("skirting", &skirting(), white);

    let grained = |p: DVec3, n: DVec3| if n.y.abs() > 0.5 { dvec2(p.x, p.z) } else { dvec2(p.y, p.x + p.z) } * 0.5;
    let table_place = at(0.35, 0.0, 0.05) * rot_y(0.12);
    stage.add("table", &table().map_uv(grained).moved(table_place), oak);
    let chair = stage.mesh("chair", &chair(), green);
    for (x, z, turn) in [(-0.45, 0.75, 2.75), (1.25, 0.75, -2.75), (0.5, -0.85, 0.15)] {
        stage.place(chair, at(x, 0.0, z) * rot_y(turn));
    }
    let top = table_place * at(0.0, 0.76, 0.0);
    stage.add("bowl", &bowl().moved(top * at(0.1, 0.0, 0.02)), clay);
    stage.add("fruit", &fruit().moved(top * at(0.1, 0.0, 0.02)), green);
    stage.add("crockery", &crockery().moved(top), white);
    stage.add("shelves", &shelves().map_uv(grained), oak);
    books(&mut stage);
    stage.add("vases", &vases(), clay);
    stage.add("picture frame", &picture(), dark);
    stage.add("picture", &sharp_box(0.03, 0.66, 0.9).moved(at(RIGHT - 0.02, 1.62, -0.2)), white);
    stage.add("floor lamp", &floor_lamp(), dark);
    stage.add("shade", &shade(), white);

    stage.camera([1.5, 1.7, 3.6], [-0.3, 0.82, -0.9], 48.0);
    stage.spot([-9.6, 5.2, 4.2], [-0.8, 0.9, -0.4], 21.0, 0.07, 0xffe6bd);
    stage.scene
}

/// Walls and ceiling, and apart from them the piers beside the windows, which share edges with the wall above and below.
/// Where walls meet they run into each other.
fn walls() -> [MeshBuilder; 2] {
    let (thick, into) = (0.24, 0.1);
    let (wide, deep, middle) = (RIGHT - LEFT, FRONT - BACK, 0.5 * (FRONT + BACK));
    let left = |low: f64, high: f64, from: f64, to: f64| {
        let place = at(LEFT - 0.5 * thick, 0.5 * (low + high), 0.5 * (from + to));
        sharp_box(thick, high - low, to - from).moved(place)
    };
    let mut out = left(-0.2, SILL, BACK - into, FRONT + into);
    out.add(&left(HEAD, CEILING + into, BACK - into, FRONT + into), HERE);
    let high = CEILING + into + 0.2;
    let up = 0.5 * high - 0.2;
    out.add(&sharp_box(thick, high, deep + 2.0 * into), at(RIGHT + 0.5 * thick, up, middle));
    out.add(&sharp_box(wide + 2.0 * into, high, thick), at(0.0, up, BACK - 0.5 * thick));
    out.add(&sharp_box(wide + 2.0 * into, high, thick), at(0.0, up, FRONT + 0.5 * thick));
    let ceiling = sharp_box(wide + 2.0 * thick, 0.2, deep + 2.0 * thick);
    out.add(&ceiling, at(0.0, CEILING + 0.1, middle));
    let mut piers = left(SILL, HEAD, BACK - into, WINDOWS[0].0);
    piers.add(&left(SILL, HEAD, WINDOWS[0].1, WINDOWS[1].0), HERE);
    piers.add(&left(SILL, HEAD, WINDOWS[1].1, FRONT + into), HERE);
    [out, piers]
}

/// Floor boards over a closed ground.
fn floor() -> MeshBuilder {
    let deep = FRONT - BACK;
    let mut out = sharp_box(RIGHT - LEFT, 0.15, deep).moved(at(0.0, -0.085, 0.5 * (FRONT + BACK)));
    let mut x = LEFT + 0.09;
    while x < RIGHT {
        out.add(&block(0.176, 0.02, deep, 0.004), at(x, -0.01, 0.5 * (FRONT + BACK)));
        x += 0.18;
    }
    out
}

fn skirting() -> MeshBuilder {
    let mut out = block(RIGHT - LEFT, 0.1, 0.02, 0.004).moved(at(0.0, 0.05, BACK + 0.01));
    out.add(&block(0.02, 0.1, FRONT - BACK - 0.02, 0.004), at(RIGHT - 0.01, 0.05, 0.5 * (FRONT + BACK)));
    out.add(&block(0.02, 0.1, FRONT - BACK - 0.02, 0.004), at(LEFT + 0.01, 0.05, 0.5 * (FRONT + BACK)));
    out
}

/// Frames with a cross of bars near the outer face of the wall, and sills inside.
fn frames() -> MeshBuilder {
    let mut out = MeshBuilder::new();
    let x = LEFT - 0.17;
    for (from, to) in WINDOWS {
        let (mid, wide, high) = (0.5 * (from + to), to - from, HEAD - SILL);
        for z in [from + 0.03, to - 0.03] {
            out.add(&block(0.06, high, 0.06, 0.006), at(x, 0.5 * (SILL + HEAD), z));
        }
        for y in [SILL + 0.03, HEAD - 0.03] {
            out.add(&block(0.06, 0.06, wide - 0.1, 0.006), at(x, y, mid));
        }
        out.add(&block(0.045, high - 0.12, 0.04, 0.004), at(x, 0.5 * (SILL + HEAD), mid));
        out.add(&block(0.3, 0.035, wide + 0.12, 0.008), at(LEFT + 0.02, SILL - 0.017, mid));
        // Architrave on the face of the wall.
        for z in [from - 0.04, to + 0.04] {
            out.add(&block(0.025, high + 0.08, 0.07, 0.005), at(LEFT + 0.012, 0.5 * (SILL + HEAD) + 0.04, z));
        }
        out.add(&block(0.03, 0.08, wide + 0.2, 0.005), at(LEFT + 0.015, HEAD + 0.08, mid));
    }
    out
}

/// A blind in each window: bent slats on cords below a head rail. The second one is drawn up a little.
fn blinds() -> MeshBuilder {
    let mut out = MeshBuilder::new();
    let x = LEFT - 0.055;
    for (k, (from, to)) in WINDOWS.into_iter().enumerate() {
        let (mid, wide) = (0.5 * (from + to), to - from - 0.03);
        out.add(&block(0.08, 0.05, wide, 0.006), at(x, HEAD - 0.025, mid));
        let low = if k == 0 { SILL + 0.06 } else { SILL + 0.42 };
        let count = ((HEAD - 0.08 - low) / PITCH) as usize;
        let slat = slat(wide);
        for i in 0..count {
            let y = HEAD - 0.1 - PITCH * i as f64;
            out.add(&slat, at(x, y, mid) * rot_z(-TILT + 0.02 * sin(2.3 * i as f64 + k as f64)));
        }
        let foot = HEAD - 0.1 - PITCH * count as f64;
        out.add(&block(0.06, 0.022, wide, 0.005), at(x, foot, mid));
        for t in [0.12, 0.5, 0.88] {
            let z = from + (to - from) * t;
            for side in [-0.037, 0.037] {
                out.add(&rod(dvec3(x + side, HEAD - 0.05, z), dvec3(x + side, foot, z), 0.0016, 5), HERE);
            }
        }
        // The cord that draws it up, and the wand that turns the slats.
        let z = to - 0.1;
        out.add(&rod(dvec3(x + 0.05, HEAD - 0.04, z), dvec3(x + 0.06, 1.25, z), 0.003, 5), HERE);
        out.add(&lathe(&[(0.0, 0.0), (0.012, 0.0), (0.006, 0.05), (0.0, 0.055)], 8), at(x + 0.06, 1.2, z));
        out.add(&rod(dvec3(x + 0.05, HEAD - 0.04, from + 0.1), dvec3(x + 0.07, 1.4, from + 0.1), 0.005, 6), HERE);
    }
    out
}

/// A thin slat along `z`, slightly bent across.
fn slat(length: f64) -> MeshBuilder {
    let (n, thick) = (4, 0.0022);
    let arch = |i: usize, lift: f64| {
        let t = 2.0 * i as f64 / n as f64 - 1.0;
        dvec2(0.5 * SLAT * t, 0.006 * (1.0 - t * t) + lift)
    };
    let mut outline: Vec<DVec2> = (0..=n).map(|i| arch(i, 0.0)).collect();
    outline.extend((0..=n).rev().map(|i| arch(i, thick)));
    plate(&outline, length, 0.0)
}

fn table() -> MeshBuilder {
    let mut out = rounded_box(dvec3(1.5, 0.035, 0.85), 0.01, 2).moved(at(0.0, 0.7425, 0.0));
    out.add(&block(1.3, 0.09, 0.025, 0.004), at(0.0, 0.68, 0.33));
    out.add(&block(1.3, 0.09, 0.025, 0.004), at(0.0, 0.68, -0.33));
    out.add(&block(0.025, 0.09, 0.63, 0.004), at(0.65, 0.68, 0.0));
    out.add(&block(0.025, 0.09, 0.63, 0.004), at(-0.65, 0.68, 0.0));
    for (x, z) in [(-0.66, -0.34), (0.66, -0.34), (-0.66, 0.34), (0.66, 0.34)] {
        out.add(&lathe(&[(0.0, 0.0), (0.02, 0.0), (0.034, 0.72), (0.0, 0.724)], 14), at(x, 0.0, z));
    }
    out
}

/// A chair with a spindle back that faces `+Z`.
fn chair() -> MeshBuilder {
    let mut out = rounded_box(dvec3(0.43, 0.035, 0.42), 0.014, 2).moved(at(0.0, 0.45, 0.0));
    for x in [-0.17, 0.17] {
        out.add(&tube(&[dvec3(x, 0.44, 0.16), dvec3(x * 1.2, 0.0, 0.2)], |t| 0.019 - 0.005 * t, 10), HERE);
        out.add(&tube(&[dvec3(x, 0.44, -0.16), dvec3(x * 1.2, 0.0, -0.23)], |t| 0.019 - 0.005 * t, 10), HERE);
        out.add(&rod(dvec3(x * 1.1, 0.2, 0.18), dvec3(x * 1.1, 0.2, -0.2), 0.01, 8), HERE);
        out.add(&rod(dvec3(x * 1.08, 0.45, -0.18), dvec3(x * 1.15, 0.92, -0.27), 0.016, 10), HERE);
    }
    out.add(&rod(dvec3(-0.187, 0.2, 0.0), dvec3(0.187, 0.2, 0.0), 0.01, 8), HERE);
    for i in 0..6 {
        let x = (i as f64 - 2.5) * 0.052;
        out.add(&rod(dvec3(x, 0.455, -0.185), dvec3(x * 1.08, 0.9, -0.268), 0.0075, 8), HERE);
    }
    let rail: Vec<DVec3> = (0..=12)
        .map(|i| {
            let t = i as f64 / 6.0 - 1.0;
            dvec3(0.215 * t, 0.91, -0.285 + 0.02 * t * t)
        })
        .collect();
    out.add(&tube(&rail, |_| 0.024, 10), HERE);
    out
}

fn bowl() -> MeshBuilder {
    lathe(
        &[
            (0.0, 0.0),
            (0.06, 0.0),
            (0.065, 0.012),
            (0.12, 0.05),
            (0.155, 0.1),
            (0.152, 0.104),
            (0.147, 0.1),
            (0.11, 0.055),
            (0.05, 0.02),
            (0.0, 0.016),
        ],
        48,
    )
}

fn fruit() -> MeshBuilder {
    let mut out = MeshBuilder::new();
    for (x, y, z) in [(-0.05, 0.07, 0.02), (0.05, 0.072, 0.04), (0.01, 0.07, -0.055), (0.005, 0.135, 0.01)] {
        out.add(&sphere(0.046, 20, 12), at(x, y, z));
        out.add(&rod(dvec3(x, y + 0.04, z), dvec3(x + 0.01, y + 0.062, z), 0.003, 5), HERE);
    }
    out
}

/// Two cups on saucers, a jug and a bottle.
fn crockery() -> MeshBuilder {
    let mut out = MeshBuilder::new();
    let saucer = lathe(&[(0.0, 0.0), (0.04, 0.0), (0.075, 0.012), (0.074, 0.015), (0.04, 0.006), (0.0, 0.006)], 32);
    let cup = lathe(
        &[(0.0, 0.006), (0.024, 0.006), (0.036, 0.04), (0.04, 0.075), (0.037, 0.075), (0.032, 0.04), (0.0, 0.012)],
        32,
    );
    let handle: Vec<DVec3> = (0..=10)
        .map(|i| {
            let a = PI * i as f64 / 10.0;
            dvec3(0.034 + 0.024 * sin(a), 0.04 - 0.02 * super::kit::cos(a), 0.0)
        })
        .collect();
    for (x, z, turn) in [(-0.42, 0.18, 0.5), (0.5, 0.2, 2.4)] {
        let place = at(x, 0.0, z) * rot_y(turn);
        out.add(&saucer, place);
        out.add(&cup, place);
        out.add(&tube(&handle, |_| 0.0045, 8), place);
    }
    let jug = [
        (0.0, 0.0),
        (0.05, 0.0),
        (0.065, 0.06),
        (0.06, 0.12),
        (0.036, 0.19),
        (0.042, 0.235),
        (0.038, 0.235),
        (0.03, 0.19),
        (0.05, 0.1),
        (0.0, 0.02),
    ];
    out.add(&lathe(&jug, 36), at(-0.22, 0.0, -0.2));
    out.add(
        &lathe(&[(0.0, 0.0), (0.036, 0.0), (0.037, 0.19), (0.014, 0.25), (0.014, 0.31), (0.0, 0.31)], 24),
        at(0.42, 0.0, -0.22),
    );
    out
}

/// Where the shelves stand: the middle of their foot, their width and depth.
const SHELF: (DVec3, f64, f64) = (dvec3(0.75, 0.0, BACK + 0.18), 2.2, 0.32);
const SHELF_HEIGHTS: [f64; 5] = [0.1, 0.55, 0.95, 1.35, 1.75];

fn shelves() -> MeshBuilder {
    let (foot, wide, deep) = SHELF;
    let mut out = MeshBuilder::new();
    for y in SHELF_HEIGHTS {
        out.add(&block(wide - 0.06, 0.025, deep, 0.003), at(foot.x, y, foot.z));
    }
    for side in [-0.5, 0.0, 0.5] {
        out.add(&block(0.03, 1.85, deep, 0.003), at(foot.x + side * (wide - 0.03), 0.925, foot.z));
    }
    out
}

/// Rows of books of uneven height, some leaning, with gaps.
fn books(stage: &mut Stage) {
    let (foot, wide, deep) = SHELF;
    let hexes = [0x8a3b35, 0x35506b, 0xc9b486, 0x4a5d45, 0x7c5b82, 0xb77d3e];
    let mut shapes = hexes.map(|_| MeshBuilder::new());
    let mut rng = Rng(1605);
    for y in &SHELF_HEIGHTS[..4] {
        for half in [-1.0, 1.0] {
            let middle = foot.x + half * 0.25 * (wide - 0.03);
            let end = middle + 0.24 * wide - 0.03;
            let mut x = middle - 0.24 * wide + 0.03 + if half > 0.0 { 0.0 } else { rng.range(0.0, 0.25) };
            let stop = end - rng.range(0.1, 0.45);
            while x < stop {
                let (thick, high, broad) = (rng.range(0.018, 0.05), rng.range(0.19, 0.3), rng.range(0.15, 0.22));
                let z = foot.z + 0.5 * deep - 0.02 - 0.5 * broad - rng.range(0.0, 0.03);
                let shape = block(thick, high, broad, 0.002);
                shapes[rng.below(hexes.len())].add(&shape, at(x + 0.5 * thick, y + 0.0125 + 0.5 * high, z));
                x += thick + 0.001;
            }
            // The last book leans on the row.
            let (tilt, high) = (0.22, 0.24);
            let base = x + high * sin(tilt) + 0.03;
            let place = at(base, y + 0.0125, foot.z + 0.03) * rot_z(tilt) * at(-0.015, 0.5 * high, 0.0);
            shapes[rng.below(hexes.len())].add(&block(0.03, high, 0.17, 0.002), place);
        }
    }
    for (shape, hex) in shapes.iter().zip(hexes) {
        let cover = stage.paint("book", hex);
        stage.add("books", shape, cover);
    }
}

/// Things on top of the shelves.
fn vases() -> MeshBuilder {
    let tall = [
        (0.0, 0.0),
        (0.06, 0.0),
        (0.1, 0.12),
        (0.09, 0.22),
        (0.04, 0.3),
        (0.055, 0.34),
        (0.05, 0.34),
        (0.033, 0.3),
        (0.0, 0.1),
    ];
    let mut out = lathe(&tall, 36).moved(at(0.1, 1.762, SHELF.0.z));
    out.add(&sphere(0.12, 32, 20), at(1.2, 1.88, SHELF.0.z));
    // Dry twigs in the vase.
    let mut rng = Rng(7);
    for _ in 0..7 {
        let root = dvec3(0.1, 1.95, SHELF.0.z);
        let tip = dvec3(rng.spread(0.26), rng.range(0.4, 0.6), rng.range(-0.12, 0.16));
        let bow = DVec3::Y * 0.06;
        let path: Vec<DVec3> = (0..=6)
            .map(|i| {
                let t = i as f64 / 6.0;
                root + tip * t + bow * (4.0 * t * (1.0 - t))
            })
            .collect();
        out.add(&tube(&path, |t| 0.005 - 0.0025 * t, 5), HERE);
    }
    out
}

fn picture() -> MeshBuilder {
    let mut out = MeshBuilder::new();
    for side in [-1.0, 1.0] {
        out.add(&block(0.045, 0.05, 1.04, 0.006), at(RIGHT - 0.022, 1.62 + side * 0.36, -0.2));
        out.add(&block(0.045, 0.69, 0.05, 0.006), at(RIGHT - 0.022, 1.62, -0.2 + side * 0.495));
    }
    out
}

fn floor_lamp() -> MeshBuilder {
    let foot = at(-1.45, 0.0, -1.85);
    let mut out = cylinder(0.15, 0.03, 32, 0.008).moved(foot);
    out.add(&rod(dvec3(0.0, 0.02, 0.0), dvec3(0.0, 1.62, 0.0), 0.011, 10), foot);
    for k in 0..3 {
        let turn = foot * rot_y(TAU * k as f64 / 3.0);
        out.add(&rod(dvec3(0.0, 1.6, 0.0), dvec3(0.13, 1.66, 0.0), 0.004, 6), turn);
    }
    out.add(&sphere(0.04, 16, 10), foot * at(0.0, 1.52, 0.0) * rot_x(0.1));
    out
}

/// The open cone of a lamp's shade, with thickness.
fn shade() -> MeshBuilder {
    lathe(&[(0.22, 1.4), (0.223, 1.4), (0.133, 1.7), (0.13, 1.7), (0.22, 1.4)], 40).moved(at(-1.45, 0.0, -1.85))
}
