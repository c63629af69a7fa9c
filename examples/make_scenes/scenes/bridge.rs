//! A truss bridge over a river: thin members at all angles throw their shadows on deck, banks and water.

use super::kit::{PI, Rng, Stage, at, rot_y, sin, smoothstep};
use super::mesh_builder::{MeshBuilder, beam, block, cylinder, ground, rod, sharp_box};
use super::texture;
use edgeshade::scene::Scene;
use glam::{DAffine3, DVec3, dvec2, dvec3};

/// Number and length of the panels of a truss, and half the distance of the two trusses.
const PANELS: usize = 10;
const PANEL: f64 = 4.6;
const SIDE: f64 = 3.3;
/// Height of the water; that of the lower chords is 0.
const WATER: f64 = -3.6;
const HERE: DAffine3 = DAffine3::IDENTITY;

pub(super) fn stage() -> Scene {
    let mut stage = Stage::new("bridge");
    let grain = stage.texture(texture::speckle());
    let wood = stage.texture(texture::wood());
    let meadow = stage.textured("meadow", 0x9a9c70, grain);
    let river = stage.paint("water", 0x6f9299);
    let steel = stage.paint("steel", 0x7a3b30);
    let iron = stage.paint("railing", 0x3b4346);
    let planks = stage.textured("planks", 0xb39a78, wood);
    let masonry = stage.textured("masonry", 0xb9b0a0, grain);

    let land = ground(100, 84, -9.0, |u, v| {
        let (x, z) = (150.0 * (u - 0.5), 30.0 - 110.0 * v);
        dvec3(x, height(x, z), z)
    });
    stage.add("land", &land.map_uv(|p, _| dvec2(p.x, p.z) * 0.08), meadow);
    stage.add("river", &sharp_box(100.0, 1.0, 109.0).moved(at(0.0, WATER - 0.5, -25.0)), river);

    let truss = stage.mesh("truss", &truss(), steel);
    for side in [-1.0, 1.0] {
        stage.place(truss, at(0.0, 0.0, side * SIDE));
    }
    stage.add("bracing", &bracing(), steel);
    let long = PANELS as f64 * PANEL;
    let deck = block(long + 14.0, 0.16, 2.0 * SIDE - 0.7, 0.01).moved(at(0.0, 0.48, 0.0));
    stage.add("deck", &deck.map_uv(|p, _| dvec2(p.z * 0.4, p.x * 0.6)), planks);
    stage.add("railing", &railing(), iron);

    let mut stones = MeshBuilder::new();
    for side in [-1.0, 1.0] {
        let end = side * (0.5 * long + 2.2);
        stones.add(&block(5.0, 8.0, 2.0 * SIDE + 1.8, 0.05), at(end, -4.2, 0.0));
        for z in [-SIDE - 0.35, SIDE + 0.35] {
            stones.add(&block(4.4, 1.0, 0.5, 0.04), at(end + side * 0.4, 0.3, z));
            stones.add(&block(0.9, 2.0, 0.9, 0.06), at(end + side * 3.0, 0.4, z));
        }
    }
    stage.add("abutments", &stones.map_uv(|p, n| dvec2(p.x + n.x.abs() * p.z, p.z * n.y.abs() - p.y) * 0.3), masonry);
    let mut rocks = MeshBuilder::new();
    let mut rng = Rng(1867);
    for _ in 0..46 {
        let side = if rng.below(2) == 0 { -1.0 } else { 1.0 };
        let z = rng.range(-26.0, 22.0);
        let x = side * rng.range(11.5, 17.0) + bend(z);
        let size = dvec3(rng.range(0.4, 1.2), rng.range(0.3, 0.8), rng.range(0.4, 1.2));
        let place = at(x, height(x, z) + 0.1, z) * rot_y(rng.range(0.0, PI));
        rocks.add(&block(size.x, size.y, size.z, 0.28 * size.y), place);
    }
    stage.add("rocks", &rocks.map_uv(|p, _| dvec2(p.x, p.z + p.y) * 0.3), masonry);
    stage.add("landing stage", &landing(), planks);

    stage.camera([10.0, 10.5, 33.5], [0.7, -0.8, 2.0], 42.0);
    stage.sun([0.0, 0.0, 0.0], 232.0, 38.0, 0.012, 0xfff1da);
    stage.scene
}

/// How far the river lies to the right at `z`.
fn bend(z: f64) -> f64 {
    3.0 * sin(0.045 * z) + if z < -12.0 { 0.012 * (z + 12.0) * (z + 12.0) } else { 0.0 }
}

/// Height of the land: a river bed between banks, level where the bridge ends, hills far away.
fn height(x: f64, z: f64) -> f64 {
    let off = (x - bend(z)).abs();
    let bank = smoothstep(10.0, 22.0, off);
    let rough = 0.16 * sin(0.9 * x + 0.4 * z) * sin(0.8 * z - 0.3 * x) + 0.07 * sin(2.1 * x - 1.3 * z);
    let hills = smoothstep(14.0, 75.0, -z)
        * (4.5 + 2.0 * sin(0.07 * x + 1.0) + 0.8 * sin(0.16 * x))
        * smoothstep(9.0, 45.0, off);
    WATER - 2.4 + (1.9 - WATER) * bank + rough * smoothstep(8.0, 13.0, off) + hills
}

/// Height of the upper chord at a node; 0 at both ends.
fn rise(node: usize) -> f64 {
    let t = 2.0 * node as f64 / PANELS as f64 - 1.0;
    if t.abs() > 0.99 { 0.0 } else { 6.8 - 2.9 * t * t }
}

fn node(i: usize, z: f64) -> DVec3 {
    dvec3((i as f64 - 0.5 * PANELS as f64) * PANEL, 0.0, z)
}

fn top(i: usize, z: f64) -> DVec3 {
    node(i, z) + DVec3::Y * rise(i)
}

/// A built-up member in a plane of equal `z`: two flats `depth` apart, and lacing bars that zigzag between them.
fn laced(out: &mut MeshBuilder, a: DVec3, b: DVec3, depth: f64, width: f64) {
    let along = (b - a).normalize();
    let across = 0.5 * depth * along.cross(DVec3::Z);
    for side in [-1.0, 1.0] {
        out.add(&beam(a + across * side, b + across * side, width, 0.05), HERE);
    }
    let bars = ((b - a).length() / (0.95 * depth)).round().max(2.0) as usize;
    for i in 0..bars {
        let [t, u] = [i, i + 1].map(|k| a + (b - a) * (k as f64 / bars as f64));
        let side = if i % 2 == 0 { across } else { -across };
        out.add(&beam(t + side, u - side, 0.03, 0.055), HERE);
    }
}

/// One truss: a curved upper chord, posts, crossing diagonals, and short struts that halve the panels.
fn truss() -> MeshBuilder {
    let (mut out, z) = (MeshBuilder::new(), 0.0);
    out.add(&beam(node(0, z), node(PANELS, z), 0.34, 0.36), HERE);
    for i in 0..PANELS {
        let (chord, depth) = if i == 0 || i == PANELS - 1 { (0.36, 0.42) } else { (0.3, 0.36) };
        laced(&mut out, top(i, z), top(i + 1, z), depth, chord);
    }
    for i in 1..PANELS {
        laced(&mut out, node(i, z), top(i, z), 0.26, 0.2);
    }
    for i in 1..PANELS - 1 {
        // The main diagonal falls towards the middle; a thin rod crosses it.
        let (a, b, c, d) = if i < PANELS / 2 {
            (top(i, z), node(i + 1, z), node(i, z), top(i + 1, z))
        } else {
            (top(i + 1, z), node(i, z), node(i + 1, z), top(i, z))
        };
        laced(&mut out, a, b, 0.22, 0.16);
        for shift in [-0.06, 0.06] {
            out.add(&rod(c + DVec3::Z * shift, d + DVec3::Z * shift, 0.024, 6), HERE);
        }
        let middle = 0.5 * (a + b);
        let foot = dvec3(middle.x, 0.0, z);
        out.add(&beam(foot, middle, 0.1, 0.1), HERE);
        out.add(&beam(middle, c + (foot - c) * 0.02, 0.07, 0.09), HERE);
    }
    for i in 0..=PANELS {
        out.add(&sharp_box(0.62, 0.6, 0.4), at(node(i, z).x, 0.0, z));
        if i > 0 && i < PANELS {
            out.add(&sharp_box(0.56, 0.5, 0.34), at(node(i, z).x, rise(i), z));
        }
    }
    out
}

/// Members between the two trusses: floor beams, stringers, struts with knees, and crossing rods above and below.
fn bracing() -> MeshBuilder {
    let mut out = MeshBuilder::new();
    for i in 0..=PANELS {
        out.add(&beam(node(i, -SIDE), node(i, SIDE), 0.24, 0.5), HERE);
    }
    for z in [-2.2, -0.75, 0.75, 2.2] {
        out.add(&beam(node(0, z) + DVec3::Y * 0.3, node(PANELS, z) + DVec3::Y * 0.3, 0.16, 0.22), HERE);
    }
    for i in 1..PANELS {
        let (a, b) = (top(i, -SIDE), top(i, SIDE));
        let low = DVec3::Y * 0.75;
        out.add(&beam(a, b, 0.14, 0.1), HERE);
        out.add(&beam(a - low, b - low, 0.12, 0.1), HERE);
        for k in 0..8 {
            let [t, u] = [k, k + 1].map(|k| a + (b - a) * (k as f64 / 8.0));
            let (t, u) = if k % 2 == 0 { (t, u - low) } else { (t - low, u) };
            out.add(&beam(t, u, 0.05, 0.05), HERE);
        }
        for side in [-1.0, 1.0] {
            let knee = top(i, side * SIDE) - DVec3::Y * 1.6;
            out.add(&beam(knee, top(i, side * (SIDE - 1.0)) - low, 0.07, 0.07), HERE);
        }
    }
    for i in 0..PANELS {
        for side in [-1.0, 1.0] {
            out.add(&rod(node(i, -SIDE * side), node(i + 1, SIDE * side), 0.03, 6), HERE);
            if i > 0 && i + 1 < PANELS {
                out.add(&beam(top(i, -SIDE * side), top(i + 1, SIDE * side), 0.09, 0.07), HERE);
            }
        }
    }
    out
}

/// Lattice railings along the deck.
fn railing() -> MeshBuilder {
    let mut out = MeshBuilder::new();
    let bays = 2 * PANELS;
    let long = PANELS as f64 * PANEL;
    for z in [0.42 - SIDE, SIDE - 0.42] {
        let point = |i: f64, y: f64| dvec3(long * (i / bays as f64 - 0.5), y, z);
        for (y, size) in [(0.66, 0.04), (1.1, 0.03), (1.6, 0.06)] {
            out.add(&beam(point(0.0, y), point(bays as f64, y), size, size), HERE);
        }
        for i in 0..=bays {
            out.add(&beam(point(i as f64, 0.5), point(i as f64, 1.6), 0.06, 0.06), HERE);
        }
        for i in 0..4 * bays {
            let (a, b) = (0.25 * i as f64, 0.25 * (i + 1) as f64);
            let (low, high) = if i % 2 == 0 { (1.1, 1.6) } else { (1.6, 1.1) };
            out.add(&beam(point(a, low), point(b, high), 0.02, 0.025), HERE);
        }
    }
    out
}

/// A plank walk on piles in the water, in the shadow of the bridge.
fn landing() -> MeshBuilder {
    let mut out = MeshBuilder::new();
    let turn = at(11.3, WATER, 9.3) * rot_y(0.2);
    for i in 0..26 {
        out.add(&sharp_box(0.27, 0.06, 1.5), turn * at(-3.6 + 0.3 * i as f64, 0.75, 0.0));
    }
    for i in 0..5 {
        let x = -3.4 + 1.8 * i as f64;
        for z in [-0.62, 0.62] {
            let height = if i % 2 == 0 { 3.9 } else { 3.0 };
            out.add(&cylinder(0.09, height, 10, 0.01), turn * at(x, -2.2, z));
        }
    }
    out
}
