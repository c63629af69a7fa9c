//! An open square with people, lamp posts, benches and a fountain, all small in a wide view.

use super::kit::{PI, Rng, Stage, TAU, at, circle, rot_x, rot_y, rot_z, scaled, sin};
use super::mesh_builder::{
    MeshBuilder, beam, cylinder, floor, lathe, lathe_shaped, plate, rod, sharp_box, sphere, torus, tube,
};
use super::texture;
use edgeshade::scene::Scene;
use glam::{DAffine3, DVec3, dvec2, dvec3};

/// Place of the fountain, and the front of the houses behind the square.
const FOUNTAIN: DVec3 = dvec3(-0.5, 0.0, -3.0);
const FRONT_Z: f64 = -19.0;
const HERE: DAffine3 = DAffine3::IDENTITY;

pub(super) fn stage() -> Scene {
    let mut stage = Stage::new("plaza");
    let tiles = stage.texture(texture::tiles());
    let grain = stage.texture(texture::speckle());
    let paving = stage.textured("paving", 0xd3c6b0, tiles);
    let stone = stage.textured("stone", 0xc9bfae, grain);
    let plaster = stage.textured("plaster", 0xd8a67c, grain);
    let ochre = stage.textured("ochre", 0xe0c48e, grain);
    let iron = stage.paint("iron", 0x343b3d);
    let glass = stage.paint("glass", 0xf1ead6);
    let wood = stage.paint("wood", 0x8a5f3c);
    let water = stage.paint("water", 0x7fa3a8);
    let hedge = stage.paint("hedge", 0x58733f);
    let cloth = stage.paint("cloth", 0xe7ddc8);
    let red = stage.paint("red", 0xb2432f);

    stage.add("ground", &floor(110.0, 90.0, 1, 1).map_uv(|p, _| dvec2(p.x, p.z) * 0.25), paving);
    houses(&mut stage, plaster, ochre, stone, iron);
    fountain(&mut stage, stone, water);
    lamps_and_pennants(&mut stage, iron, glass, red);
    let map = |p: DVec3, n: DVec3| dvec2(p.x + 0.5 * n.z, p.z + p.y) * 0.4;

    let bench_wood = stage.mesh("bench slats", &bench_slats(), wood);
    let bench_iron = stage.mesh("bench frame", &bench_frame(), iron);
    // Eight stand around the fountain, with their backs to it.
    let mut benches: Vec<DAffine3> = (0..8)
        .map(|i| at(FOUNTAIN.x, 0.0, FOUNTAIN.z) * rot_y(TAU * (f64::from(i) + 0.5) / 8.0) * at(0.0, 0.0, 7.2))
        .collect();
    benches.extend(
        [(10.6, 8.4, -2.2), (-7.5, 10.8, 2.6), (2.6, 11.6, 3.1)].map(|(x, z, turn)| at(x, 0.0, z) * rot_y(turn)),
    );
    for &place in &benches {
        stage.place(bench_wood, place);
        stage.place(bench_iron, place);
    }

    let pot = stage.mesh("tub", &tub().map_uv(map), stone);
    let tree = stage.mesh("clipped tree", &tree(), hedge);
    for (x, z) in [(-13.0, 3.0), (-13.0, -3.5), (-13.0, -10.0), (12.5, -12.5), (12.5, -6.0), (12.5, 0.5)] {
        stage.place(pot, at(x, 0.0, z));
        stage.place(tree, at(x, 0.0, z));
    }

    let parasol_cloth = stage.mesh("parasol", &parasol(), cloth);
    let parasol_table = stage.mesh("table", &table(), iron);
    for (x, z) in [(5.6, -13.8), (8.6, -15.4), (2.4, -15.2), (-3.5, -15.0)] {
        stage.place(parasol_cloth, at(x, 0.0, z));
        stage.place(parasol_table, at(x, 0.0, z) * rot_y(x));
    }

    let bollard = stage.mesh(
        "bollard",
        &lathe(
            &[
                (0.0, 0.0),
                (0.14, 0.0),
                (0.14, 0.1),
                (0.09, 0.14),
                (0.08, 0.78),
                (0.11, 0.84),
                (0.08, 0.94),
                (0.0, 0.97),
            ],
            12,
        ),
        iron,
    );
    let mut chains = MeshBuilder::new();
    for i in 0..14 {
        let x = -14.0 + 2.2 * i as f64;
        stage.place(bollard, at(x, 0.0, 14.2));
        if i < 13 {
            chains.add(&sagging(dvec3(x + 0.04, 0.8, 14.2), dvec3(x + 2.16, 0.8, 14.2), 0.25, 10, 0.025), HERE);
        }
    }
    stage.add("chains", &chains, iron);

    people(&mut stage, &benches);

    stage.camera([13.5, 12.0, 28.5], [-1.0, -1.0, -3.0], 35.0);
    stage.sun([0.0, 0.0, -2.0], 246.0, 34.0, 0.012, 0xffefd6);
    stage.scene
}

/// A row of houses behind the square, one with a tower, and the eaves of another that stands left of the picture.
fn houses(stage: &mut Stage, plaster: usize, ochre: usize, stone: usize, dark: usize) {
    let map = |p: DVec3, n: DVec3| if n.x.abs() > 0.5 { dvec2(p.z, -p.y) } else { dvec2(p.x, p.z - p.y) } * 0.3;
    let mut walls = [MeshBuilder::new(), MeshBuilder::new()];
    let (mut trim, mut panes) = (MeshBuilder::new(), MeshBuilder::new());
    let deep = 8.0;
    let mut left = -30.0;
    for (k, (width, height)) in
        [(9.0, 8.4), (7.0, 10.0), (8.0, 7.6), (10.0, 9.2), (7.5, 8.0), (9.0, 10.4), (9.0, 8.6)].into_iter().enumerate()
    {
        let middle = left + 0.5 * width;
        walls[k % 2].add(&sharp_box(width, height, deep), at(middle, 0.5 * height, FRONT_Z - 0.5 * deep));
        trim.add(&sharp_box(width + 0.2, 0.3, deep + 0.7), at(middle, height + 0.15, FRONT_Z - 0.5 * deep));
        trim.add(&sharp_box(width - 0.04, 0.16, 0.3), at(middle, 3.4, FRONT_Z + 0.1));
        let bays = (width / 1.9) as usize;
        for i in 0..bays {
            let x = left + width * (i as f64 + 0.5) / bays as f64;
            let mut y = 4.2;
            while y + 2.0 < height {
                panes.add(&sharp_box(0.9, 1.6, 0.1), at(x, y + 0.8, FRONT_Z));
                trim.add(&sharp_box(1.2, 0.12, 0.3), at(x, y - 0.06, FRONT_Z + 0.12));
                trim.add(&sharp_box(1.3, 0.14, 0.36), at(x, y + 1.72, FRONT_Z + 0.14));
                y += 2.7;
            }
            panes.add(&sharp_box(1.1, 2.5, 0.1), at(x, 1.25, FRONT_Z));
            if i % 2 == k % 2 {
                // An awning over the door.
                trim.add(&beam(dvec3(x, 2.9, FRONT_Z), dvec3(x, 2.45, FRONT_Z + 1.3), 1.5, 0.06), HERE);
            }
        }
        left += width;
    }
    // The tower with its spire.
    walls[0].add(&sharp_box(3.4, 14.0, 3.4), at(-15.8, 7.0, FRONT_Z + 0.6));
    trim.add(&sharp_box(3.9, 0.3, 3.9), at(-15.8, 10.2, FRONT_Z + 0.6));
    trim.add(&sharp_box(3.9, 0.3, 3.9), at(-15.8, 14.0, FRONT_Z + 0.6));
    panes.add(&lathe(&[(0.0, 0.0), (2.3, 0.0), (0.35, 2.6), (0.0, 6.0)], 8), at(-15.8, 14.15, FRONT_Z + 0.6));
    for (x, z) in [(-22.0, 8.0), (-22.0, -1.5), (-23.0, -11.0)] {
        walls[1].add(&sharp_box(8.0, 7.5, 7.0), at(x, 3.75, z));
        trim.add(&sharp_box(8.6, 0.3, 7.4), at(x, 7.65, z));
        trim.add(&sharp_box(0.9, 1.8, 0.9), at(x + 2.2, 8.6, z - 1.8));
    }
    let [a, b] = walls;
    stage.add("plaster houses", &a.map_uv(map), plaster);
    stage.add("ochre houses", &b.map_uv(map), ochre);
    stage.add("trim", &trim.map_uv(map), stone);
    stage.add("windows and spire", &panes, dark);
}

fn fountain(stage: &mut Stage, stone: usize, water: usize) {
    let here = at(FOUNTAIN.x, 0.0, FOUNTAIN.z);
    let map = |p: DVec3, n: DVec3| dvec2(p.x + 0.5 * n.x, p.z + p.y + 0.5 * n.z) * 0.4;
    let mut body = MeshBuilder::new();
    body.add(&cylinder(5.2, 0.16, 8, 0.03), here);
    body.add(&cylinder(4.7, 0.32, 8, 0.03), here);
    // Basin.
    body.add(
        &lathe(&[(3.6, 0.3), (4.0, 0.3), (4.05, 0.75), (4.2, 0.8), (4.2, 0.95), (3.55, 0.95), (3.6, 0.3)], 48),
        here,
    );
    // Two bowls on a stem.
    let stem = [
        (0.0, 0.3),
        (0.7, 0.3),
        (0.6, 0.6),
        (0.34, 0.9),
        (0.3, 1.6),
        (0.5, 1.75),
        (1.5, 2.1),
        (1.65, 2.25),
        (1.5, 2.25),
        (0.4, 2.05),
        (0.2, 2.1),
        (0.18, 2.9),
        (0.3, 3.0),
        (0.75, 3.2),
        (0.82, 3.32),
        (0.7, 3.32),
        (0.15, 3.15),
        (0.1, 3.2),
        (0.08, 3.6),
        (0.16, 3.75),
        (0.0, 3.95),
    ];
    body.add(&lathe(&stem, 32), here);
    stage.add("fountain", &body.map_uv(map), stone);
    let mut wet = MeshBuilder::new();
    wet.add(&cylinder(3.62, 0.5, 48, 0.0), here * at(0.0, 0.25, 0.0));
    let jet = |inner: f64, outer: f64, high: f64, low: f64, rise: f64| -> MeshBuilder {
        let path: Vec<DVec3> = (0..=8)
            .map(|i| {
                let t = i as f64 / 8.0;
                dvec3(inner + (outer - inner) * t, high + (low - high) * t + 4.0 * rise * t * (1.0 - t), 0.0)
            })
            .collect();
        tube(&path, |t| 0.02 + 0.02 * t, 6)
    };
    for k in 0..16 {
        let turn = here * rot_y(TAU * k as f64 / 16.0);
        wet.add(&jet(1.55, 2.7, 2.28, 0.7, 0.35), turn);
        if k % 2 == 0 {
            wet.add(&jet(0.75, 1.2, 3.33, 2.1, 0.25), turn);
        }
    }
    stage.add("water", &wet, water);
}

/// A wire, chain or string that hangs between two points.
fn sagging(a: DVec3, b: DVec3, sag: f64, steps: usize, radius: f64) -> MeshBuilder {
    let path: Vec<DVec3> = (0..=steps).map(|i| hanging(a, b, sag, i as f64 / steps as f64)).collect();
    tube(&path, |_| radius, 6)
}

fn hanging(a: DVec3, b: DVec3, sag: f64, t: f64) -> DVec3 {
    a + (b - a) * t - DVec3::Y * (4.0 * sag * t * (1.0 - t))
}

fn lamps_and_pennants(stage: &mut Stage, iron: usize, glass: usize, red: usize) {
    let post = stage.mesh("lamp post", &lamp_post(), iron);
    let lamps = stage.mesh("lamps", &lamps(), glass);
    let feet = [(-9.5, 8.0), (8.0, 6.5), (-9.5, -4.0), (9.0, -3.0), (-9.0, -14.0), (9.6, -13.0), (-1.0, 13.0)];
    for (i, (x, z)) in feet.into_iter().enumerate() {
        let place = at(x, 0.0, z) * rot_y(0.6 * i as f64);
        stage.place(post, place);
        stage.place(lamps, place);
    }
    let (mut strings, mut flags) = (MeshBuilder::new(), MeshBuilder::new());
    let flag = plate(&[dvec2(-0.2, 0.0), dvec2(0.0, -0.5), dvec2(0.2, 0.0)], 0.012, 0.0);
    for (from, to) in [(0, 6), (6, 1), (0, 2), (1, 3)] {
        let [a, b] = [feet[from], feet[to]].map(|(x, z)| dvec3(x, 4.4, z));
        strings.add(&sagging(a, b, 0.7, 24, 0.012), HERE);
        let along = (b - a).normalize();
        let turn = rot_y(libm::atan2(-along.z, along.x));
        let count = ((b - a).length() / 0.8) as usize;
        for i in 1..count {
            let p = hanging(a, b, 0.7, i as f64 / count as f64);
            flags.add(&flag, at(p.x, p.y, p.z) * turn * rot_x(0.5 * sin(5.0 * i as f64)));
        }
    }
    stage.add("strings", &strings, iron);
    stage.add("pennants", &flags, red);
}

/// Where a post holds its three lamps.
const LAMPS: [(f64, f64); 3] = [(-0.62, 4.05), (0.62, 4.05), (0.0, 4.5)];

fn lamp_post() -> MeshBuilder {
    let profile = [
        (0.0, 0.0),
        (0.24, 0.0),
        (0.24, 0.12),
        (0.16, 0.2),
        (0.13, 0.8),
        (0.09, 0.9),
        (0.06, 1.1),
        (0.045, 3.9),
        (0.08, 4.0),
        (0.04, 4.1),
        (0.035, 4.5),
        (0.0, 4.52),
    ];
    let mut out = lathe(&profile, 12);
    for side in [-1.0, 1.0] {
        let arm: Vec<DVec3> = (0..=8)
            .map(|i| {
                let t = i as f64 / 8.0;
                dvec3(side * 0.62 * t, 3.6 + 0.45 * sin(0.5 * PI * t), 0.0)
            })
            .collect();
        out.add(&tube(&arm, |_| 0.022, 6), HERE);
        out.add(&torus(0.12, 0.014, 12, 6), at(side * 0.2, 3.95, 0.0) * rot_x(0.5 * PI));
    }
    for (x, y) in LAMPS {
        out.add(&lathe(&[(0.0, 0.0), (0.06, 0.0), (0.13, 0.06), (0.0, 0.07)], 8), at(x, y, 0.0));
        out.add(&lathe(&[(0.0, 0.4), (0.24, 0.4), (0.05, 0.55), (0.0, 0.66)], 8), at(x, y, 0.0));
    }
    out
}

fn lamps() -> MeshBuilder {
    let mut out = MeshBuilder::new();
    for (x, y) in LAMPS {
        out.add(&lathe(&[(0.0, 0.05), (0.11, 0.05), (0.18, 0.41), (0.0, 0.41)], 8), at(x, y, 0.0));
    }
    out
}

/// The wooden parts of a bench that faces `+Z`.
fn bench_slats() -> MeshBuilder {
    let mut out = MeshBuilder::new();
    for i in 0..5 {
        let z = 0.22 - 0.11 * i as f64;
        out.add(&beam(dvec3(-0.9, 0.45, z), dvec3(0.9, 0.45, z), 0.085, 0.04), HERE);
    }
    for i in 0..3 {
        let (y, z) = (0.58 + 0.13 * i as f64, -0.3 - 0.04 * i as f64);
        out.add(&beam(dvec3(-0.9, y, z), dvec3(0.9, y, z), 0.035, 0.09), HERE);
    }
    out
}

fn bench_frame() -> MeshBuilder {
    let mut out = MeshBuilder::new();
    for x in [-0.72, 0.72] {
        let points = [dvec3(x, 0.01, 0.26), dvec3(x, 0.4, 0.22), dvec3(x, 0.41, -0.27), dvec3(x, 0.95, -0.42)];
        out.add(&tube(&points, |_| 0.028, 6), HERE);
        out.add(&rod(dvec3(x, 0.4, -0.24), dvec3(x, 0.01, -0.34), 0.028, 6), HERE);
        out.add(&tube(&[dvec3(x, 0.4, 0.22), dvec3(x, 0.64, 0.24), dvec3(x, 0.66, -0.33)], |_| 0.022, 6), HERE);
    }
    out
}

fn tub() -> MeshBuilder {
    lathe(
        &[(0.0, 0.0), (0.5, 0.0), (0.66, 0.62), (0.74, 0.64), (0.74, 0.74), (0.6, 0.74), (0.58, 0.66), (0.0, 0.66)],
        20,
    )
}

fn tree() -> MeshBuilder {
    let mut out = rod(dvec3(0.0, 0.6, 0.0), dvec3(0.0, 2.0, 0.0), 0.07, 8);
    let crown = |radius: f64| {
        let profile: Vec<(f64, f64)> = (0..=12)
            .map(|i| {
                let (c, s) = circle(PI * i as f64 / 12.0);
                (if i == 0 || i == 12 { 0.0 } else { radius * s }, -radius * c)
            })
            .collect();
        lathe_shaped(&profile, 22, move |a, r| r * (1.0 + 0.04 * sin(5.0 * a) + 0.03 * sin(9.0 * a + 1.0)))
    };
    out.add(&crown(0.85), at(0.0, 2.4, 0.0));
    out.add(&crown(0.5), at(0.0, 3.5, 0.0));
    out
}

/// A thin cone with a scalloped rim, closed below.
fn parasol() -> MeshBuilder {
    lathe_shaped(
        &[(0.0, 2.62), (1.5, 2.16), (1.6, 2.0), (1.62, 2.0), (1.53, 2.2), (0.06, 2.72), (0.05, 2.8), (0.0, 2.82)],
        24,
        |a, r| r * (1.0 - 0.05 * sin(4.0 * a) * sin(4.0 * a)),
    )
}

/// A round table with three chairs, and the pole of the parasol.
fn table() -> MeshBuilder {
    let mut out = cylinder(0.022, 2.7, 8, 0.0);
    out.add(&cylinder(0.55, 0.04, 20, 0.01), at(0.0, 0.72, 0.0));
    out.add(&cylinder(0.28, 0.05, 16, 0.01), HERE);
    for k in 0..3 {
        let turn = rot_y(TAU * k as f64 / 3.0) * at(0.0, 0.0, 0.85);
        out.add(&sharp_box(0.42, 0.04, 0.42), turn * at(0.0, 0.45, 0.0));
        for (x, z) in [(-0.18, -0.18), (0.18, -0.18), (-0.18, 0.18), (0.18, 0.18)] {
            let top = if z > 0.0 { 0.9 } else { 0.45 };
            out.add(&rod(dvec3(x, 0.005, z), dvec3(x, top, z * 1.1), 0.014, 5), turn);
        }
        for y in [0.65, 0.76, 0.87] {
            out.add(&rod(dvec3(-0.18, y, 0.196), dvec3(0.18, y, 0.196), 0.012, 5), turn);
        }
    }
    out
}

/// How a figure stands: the stride of its legs, the swing of its arms, both in radians, and what it wears.
struct Pose {
    stride: f64,
    swing: [f64; 2],
    coat: u32,
    legs: u32,
    long: bool,
    hat: bool,
}

fn people(stage: &mut Stage, benches: &[DAffine3]) {
    let skin = stage.paint("skin", 0xc79a7c);
    let poses = [
        Pose { stride: 0.42, swing: [-0.5, 0.5], coat: 0x3f5a7a, legs: 0x2f3138, long: false, hat: false },
        Pose { stride: 0.0, swing: [0.1, 0.1], coat: 0x8c3f3a, legs: 0x45423d, long: false, hat: true },
        Pose { stride: 0.3, swing: [0.35, -0.3], coat: 0x6d7650, legs: 0x57493a, long: true, hat: false },
        Pose { stride: 0.08, swing: [1.9, 0.05], coat: 0xd9cfb8, legs: 0x4c5a68, long: false, hat: false },
        Pose { stride: 0.0, swing: [0.6, 0.6], coat: 0x4a4052, legs: 0x4a4052, long: true, hat: true },
        Pose { stride: 0.5, swing: [-0.7, 0.6], coat: 0xc7893c, legs: 0x34414f, long: false, hat: true },
    ];
    let bodies = poses.map(|pose| {
        let cloth = stage.paint("coat", pose.coat);
        let trousers = stage.paint("trousers", pose.legs);
        [
            stage.mesh("coat", &coat(&pose), cloth),
            stage.mesh("legs", &legs(&pose), trousers),
            stage.mesh("head", &head(&pose), skin),
        ]
    });
    let mut rng = Rng(1748);
    // Groups that talk, walkers, and single people, as (pose, x, z, turn).
    let mut places = vec![
        (1, 3.9, 6.4, 0.6),
        (3, 4.7, 7.0, -1.6),
        (4, 4.2, 7.6, 2.6),
        (0, -4.8, 9.0, 1.2),
        (2, -5.4, 9.5, 1.2),
        (5, 9.5, 2.0, -2.0),
        (1, -6.2, 3.6, 2.0),
        (4, -6.9, 4.4, 0.4),
        (3, 1.4, 3.1, 3.0),
        (0, 6.9, 11.2, -1.0),
        (2, 0.4, 10.0, -1.9),
        (5, -2.1, 7.0, 1.8),
        (4, 6.2, -4.4, -1.0),
        (1, -11.2, 0.5, 1.2),
    ];
    while places.len() < 37 {
        let (x, z) = (rng.range(-12.0, 12.0), rng.range(-16.5, 13.5));
        let clear = |p: &(usize, f64, f64, f64)| dvec2(p.1 - x, p.2 - z).length() > 1.3;
        let from_fountain = dvec2(x - FOUNTAIN.x, z - FOUNTAIN.z).length();
        let beside = |b: &DAffine3| dvec2(b.translation.x - x, b.translation.z - z).length() > 1.5;
        if places.iter().all(clear)
            && benches.iter().all(beside)
            && (from_fountain > 8.2 || (5.4..6.6).contains(&from_fountain))
        {
            places.push((rng.below(6), x, z, rng.range(0.0, TAU)));
        }
    }
    for (pose, x, z, turn) in places {
        let place = at(x, 0.0, z) * rot_y(turn) * scaled(rng.range(0.93, 1.05));
        for part in bodies[pose] {
            stage.place(part, place);
        }
    }
}

/// Where a limb of length `length` ends that hangs from `from` and is swung forward, towards `+Z`.
fn swung(from: DVec3, angle: f64, length: f64) -> DVec3 {
    let (c, s) = circle(angle);
    from + dvec3(0.0, -c, s) * length
}

fn coat(pose: &Pose) -> MeshBuilder {
    let hem =
        if pose.long { [(0.0, 0.48), (0.27, 0.48), (0.22, 0.8)] } else { [(0.0, 0.84), (0.17, 0.85), (0.19, 0.92)] };
    let mut profile = hem.to_vec();
    profile.extend([(0.155, 1.08), (0.205, 1.34), (0.18, 1.43), (0.07, 1.5), (0.0, 1.51)]);
    let mut out = lathe(&profile, 14).moved(DAffine3::from_scale(dvec3(1.0, 1.0, 0.66)));
    for (side, swing) in [(-1.0, pose.swing[0]), (1.0, pose.swing[1])] {
        let shoulder = dvec3(side * 0.2, 1.4, 0.0);
        let elbow = swung(shoulder, swing, 0.3) + DVec3::X * side * 0.05;
        let hand = swung(elbow, swing + 0.35, 0.27);
        out.add(&tube(&[shoulder, elbow, hand], |t| 0.062 - 0.024 * t, 8), HERE);
    }
    out
}

fn legs(pose: &Pose) -> MeshBuilder {
    let mut out = MeshBuilder::new();
    for (side, angle) in [(-1.0, pose.stride), (1.0, -pose.stride)] {
        let hip = dvec3(side * 0.09, 0.9, 0.0);
        // The rear knee is bent; the hip is lowered until the lower foot is on the ground.
        let knee = swung(hip, angle, 0.43);
        let ankle = swung(knee, angle - if angle < 0.0 { 0.3 } else { 0.0 }, 0.41);
        let toe = ankle + dvec3(side * 0.02, -0.02, 0.18);
        out.add(&tube(&[hip, knee, ankle], |t| 0.09 - 0.042 * t, 8), HERE);
        out.add(&tube(&[ankle - DVec3::Z * 0.06, toe], |t| 0.05 - 0.012 * t, 6), HERE);
    }
    let low = out.positions.iter().map(|p| p.y).fold(f64::INFINITY, f64::min);
    out.moved(at(0.0, -low, 0.0))
}

fn head(pose: &Pose) -> MeshBuilder {
    let mut out = sphere(0.11, 12, 8).moved(at(0.0, 1.65, 0.01) * DAffine3::from_scale(dvec3(0.85, 1.15, 1.0)));
    out.add(&rod(dvec3(0.0, 1.48, 0.0), dvec3(0.0, 1.58, 0.0), 0.05, 8), HERE);
    if pose.hat {
        out.add(
            &lathe(&[(0.0, 0.0), (0.2, 0.0), (0.2, 0.015), (0.11, 0.03), (0.1, 0.13), (0.0, 0.14)], 14),
            at(0.0, 1.7, 0.0) * rot_z(0.05),
        );
    }
    out
}
