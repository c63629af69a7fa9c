//! A courtyard: arcade, stairs to a gallery, pergola, gate, furniture and plants along a passage.

use super::kit::{PI, Rng, Stage, TAU, align_y, at, circle, rot_x, rot_y, rot_z, scaled, sin};
use super::mesh_builder::{
    MeshBuilder, block, cylinder, floor, lathe, plate, rod, rounded_box, sphere, surface, torus, tube,
};
use super::plants::{self, standing};
use super::texture::{self, leaf};
use edgeshade::scene::Scene;
use glam::{DAffine3, DVec2, DVec3, dvec2, dvec3};

/// Middle plane of the arcade, width and number of its bays, its end, and the height where the arches spring.
const ARCADE_X: f64 = -3.6;
const BAY: f64 = 3.2;
const BAYS: usize = 8;
const ARCADE_END: f64 = 4.6;
const SPRING: f64 = 2.3;
/// Face of the house on the right, edge and height of the gallery along it, and place of the gate.
const HOUSE_X: f64 = 3.7;
const GALLERY_X: f64 = 2.5;
const GALLERY_Y: f64 = 3.06;
const GATE_Z: f64 = -21.4;

/// Materials by their use.
struct Palette {
    paving: usize,
    plaster: usize,
    house: usize,
    stone: usize,
    wood: usize,
    iron: usize,
    pot: usize,
    shutter: usize,
    tile: usize,
    cloth: usize,
    dark: usize,
    bark: usize,
    leaf: usize,
    fern: usize,
    bloom: usize,
}

pub(super) fn stage() -> Scene {
    let mut stage = Stage::new("courtyard");
    let palette = palette(&mut stage);
    let mut rng = Rng(1810);
    ground(&mut stage, &palette);
    arcade(&mut stage, &palette);
    house(&mut stage, &palette);
    gallery(&mut stage, &palette);
    gate(&mut stage, &palette);
    pergola(&mut stage, &palette, &mut rng);
    fountain(&mut stage, &palette);
    furniture(&mut stage, &palette);
    greenery(&mut stage, &palette, &mut rng);

    stage.camera([0.75, 1.95, 5.9], [-0.12, 1.6, -6.0], 47.0);
    stage.sun([0.0, 1.0, -8.0], 257.0, 45.0, 0.012, 0xffeed2);
    stage.scene
}

fn palette(stage: &mut Stage) -> Palette {
    let grain = stage.texture(texture::speckle());
    let tiles = stage.texture(texture::tiles());
    let wood = stage.texture(texture::wood());
    let atlas = stage.texture(texture::leaves());
    let tile = stage.textured("roof tile", 0xb5714e, grain);
    stage.both_sides(tile);
    Palette {
        paving: stage.textured("paving", 0xcdb08d, tiles),
        plaster: stage.textured("plaster", 0xe3c9a0, grain),
        house: stage.textured("house", 0xd99e78, grain),
        stone: stage.textured("stone", 0xcfc4b0, grain),
        wood: stage.textured("wood", 0x8a6547, wood),
        iron: stage.paint("iron", 0x2f3537),
        pot: stage.textured("terracotta", 0xb9694a, grain),
        shutter: stage.paint("shutter", 0x3f7d86),
        tile,
        cloth: stage.paint("cloth", 0xe9e2d2),
        dark: stage.paint("dark", 0x3a302b),
        bark: stage.textured("bark", 0x75604d, grain),
        leaf: stage.leaves("leaves", 0x74884f, atlas),
        fern: stage.leaves("fern", 0x5d8055, atlas),
        bloom: stage.leaves("bloom", 0xb5476a, atlas),
    }
}

/// Texture coordinates of masonry: metres times 0.4 in the plane of the face.
fn masonry(p: DVec3, n: DVec3) -> DVec2 {
    let q = if n.y.abs() > 0.6 {
        dvec2(p.x, p.z)
    } else if n.x.abs() > n.z.abs() {
        dvec2(p.z, -p.y)
    } else {
        dvec2(p.x, -p.y)
    };
    q * 0.4
}

fn ground(stage: &mut Stage, m: &Palette) {
    let length = ARCADE_END + 2.6 - GATE_Z + 12.0;
    let slab = floor(15.0, length, 1, 1).moved(at(-1.6, 0.0, ARCADE_END + 2.6 - 0.5 * length));
    stage.add("paving", &slab.map_uv(|p, _| dvec2(p.x, p.z) * 0.45), m.paving);
    let mut walls = MeshBuilder::new();
    walls.add(&block(0.4, 1.5, length, 0.04), at(-8.9, 0.75, ARCADE_END + 2.6 - 0.5 * length));
    walls.add(&block(15.0, 5.0, 0.4, 0.04), at(-1.6, 2.5, ARCADE_END + 2.6 - length));
    stage.add("outer walls", &walls.map_uv(masonry), m.plaster);
}

/// Points of a half circle about `(0, SPRING)`, from left to right over the top.
fn arch(radius: f64, steps: usize) -> impl Iterator<Item = DVec2> {
    (0..=steps).map(move |i| {
        let (c, s) = circle(PI * (1.0 - i as f64 / steps as f64));
        dvec2(radius * c, SPRING + radius * s)
    })
}

fn arcade(stage: &mut Stage, m: &Palette) {
    let (half, open) = (0.5 * BAY, 1.18);
    // The wall above the arch: along the arch from left to right, then back over the top.
    let mut outline = vec![dvec2(-half, SPRING)];
    outline.extend(arch(open, 28));
    outline.extend([dvec2(half, SPRING), dvec2(half, 4.15), dvec2(-half, 4.15)]);
    let spandrel = stage.mesh("spandrel", &plate(&outline, 0.44, 0.015).map_uv(masonry), m.plaster);
    let mut ring: Vec<DVec2> = arch(open - 0.02, 28).collect();
    ring.extend(arch(open + 0.17, 28).collect::<Vec<_>>().into_iter().rev());
    let ring = stage.mesh("archivolt", &plate(&ring, 0.52, 0.02).map_uv(masonry), m.stone);
    let column = stage.mesh("column", &column().map_uv(|p, n| dvec2(0.3 * (n.x + n.z), -0.4 * p.y)), m.stone);
    for i in 0..BAYS {
        let z = ARCADE_END - (i as f64 + 0.5) * BAY;
        for mesh in [spandrel, ring] {
            stage.place(mesh, at(ARCADE_X, 0.0, z) * rot_y(0.5 * PI));
        }
    }
    for i in 0..=BAYS {
        stage.place(column, at(ARCADE_X, 0.0, ARCADE_END - i as f64 * BAY));
    }
    let length = BAYS as f64 * BAY + 0.5;
    let z = ARCADE_END - 0.5 * BAYS as f64 * BAY;
    let mut cornice = MeshBuilder::new();
    for (width, height, y) in [(0.54, 0.08, 4.17), (0.66, 0.09, 4.25), (0.8, 0.06, 4.32)] {
        cornice.add(&block(width, height, length, 0.015), at(ARCADE_X, y, z));
    }
    cornice.add(&block(0.5, 0.08, length, 0.02), at(ARCADE_X, 3.75, z));
    stage.add("cornice", &cornice.map_uv(masonry), m.stone);
    // Every other arch has a lantern.
    let lantern = stage.mesh("lantern", &lantern(), m.iron);
    for i in (0..BAYS).step_by(2) {
        stage.place(lantern, at(ARCADE_X, SPRING + open, ARCADE_END - (i as f64 + 0.5) * BAY));
    }
}

fn column() -> MeshBuilder {
    let mut profile =
        vec![(0.0, 0.12), (0.22, 0.12), (0.235, 0.15), (0.235, 0.18), (0.21, 0.21), (0.185, 0.22), (0.185, 0.25)];
    // The shaft swells a little below the middle.
    profile.extend((0..=10).map(|i| {
        let t = i as f64 / 10.0;
        (0.172 - 0.03 * t + 0.012 * sin(PI * t), 0.27 + 1.63 * t)
    }));
    profile.extend([
        (0.165, 1.92),
        (0.175, 1.94),
        (0.165, 1.97),
        (0.15, 1.98),
        (0.16, 2.02),
        (0.2, 2.1),
        (0.235, 2.14),
        (0.0, 2.14),
    ]);
    let mut out = lathe(&profile, 36);
    out.add(&block(0.52, 0.13, 0.52, 0.02), at(0.0, 0.065, 0.0));
    out.add(&block(0.52, 0.09, 0.52, 0.02), at(0.0, 2.18, 0.0));
    out.add(&block(0.46, 0.08, 0.56, 0.015), at(0.0, 2.26, 0.0));
    out
}

/// A six-sided lantern on a chain; its origin is where the chain is fixed.
fn lantern() -> MeshBuilder {
    let mut out = MeshBuilder::new();
    let here = DAffine3::IDENTITY;
    for i in 0..7 {
        let turn = if i % 2 == 0 { 0.0 } else { 0.5 * PI };
        out.add(&torus(0.022, 0.005, 12, 6), at(0.0, -0.02 - 0.04 * i as f64, 0.0) * rot_y(turn) * rot_x(0.5 * PI));
    }
    out.add(
        &lathe(&[(0.0, -0.42), (0.13, -0.42), (0.135, -0.4), (0.05, -0.31), (0.02, -0.29), (0.0, -0.28)], 24),
        here,
    );
    out.add(&lathe(&[(0.0, -0.72), (0.03, -0.72), (0.085, -0.68), (0.09, -0.66), (0.0, -0.66)], 24), here);
    for k in 0..6 {
        let (c, s) = circle(TAU * k as f64 / 6.0);
        out.add(&rod(dvec3(0.08 * c, -0.67, 0.08 * s), dvec3(0.12 * c, -0.41, 0.12 * s), 0.007, 6), here);
    }
    out.add(&cylinder(0.03, 0.13, 12, 0.01), at(0.0, -0.66, 0.0));
    out
}

fn house(stage: &mut Stage, m: &Palette) {
    let length = ARCADE_END + 2.4 - GATE_Z;
    let z = ARCADE_END + 2.4 - 0.5 * length;
    stage.add("house", &block(0.5, 6.1, length, 0.03).moved(at(HOUSE_X + 0.25, 3.05, z)).map_uv(masonry), m.house);
    let mut trim = MeshBuilder::new();
    trim.add(&block(0.1, 0.48, length, 0.02), at(HOUSE_X - 0.02, 0.24, z));
    trim.add(&block(0.2, 0.12, length, 0.03), at(HOUSE_X - 0.02, 5.86, z));
    // Doors below, windows above; shutters stand open.
    let mut panes = MeshBuilder::new();
    let shutters = [2.2, 2.1].map(|height| (height, stage.mesh("shutter", &shutter(height - 0.1), m.shutter)));
    for i in 0..5 {
        let z = -4.6 - 3.7 * i as f64;
        for (y, (height, shutter)) in [1.1, GALLERY_Y + 1.15].into_iter().zip(shutters) {
            let width = 1.1;
            panes.add(&block(0.06, height, width, 0.01), at(HOUSE_X - 0.01, y, z));
            trim.add(&block(0.14, 0.14, width + 0.36, 0.02), at(HOUSE_X, y + 0.5 * height + 0.07, z));
            for s in [-0.5, 0.5] {
                trim.add(&block(0.12, height, 0.14, 0.02), at(HOUSE_X, y, z + s * (width + 0.14)));
                let hinge = at(HOUSE_X - 0.07, y, z + s * (width + 0.1)) * rot_y(if s > 0.0 { -0.45 } else { 0.45 });
                stage.place(shutter, hinge * at(0.0, 0.0, s * 0.56));
            }
        }
    }
    stage.add("house trim", &trim.map_uv(masonry), m.stone);
    stage.add("panes", &panes, m.dark);
    // Eaves of half-round tiles.
    let tile = surface(8, 1, |u, v| {
        let (c, s) = circle(PI * u);
        let r = 0.105 - 0.02 * v;
        dvec3(-0.75 * (1.0 - v), r * s + 0.28 * v, -r * c)
    });
    let tile = stage.mesh("tile", &tile, m.tile);
    let count = (length / 0.22) as usize;
    for i in 0..count {
        stage.place(tile, at(HOUSE_X + 0.28, 6.02, ARCADE_END + 2.3 - 0.22 * i as f64));
    }
    let eaves = plate(&[dvec2(-0.42, 0.0), dvec2(0.5, 0.0), dvec2(0.5, 0.36)], length, 0.01);
    stage.add("eaves", &eaves.moved(at(HOUSE_X + 0.05, 5.97, z)).map_uv(masonry), m.wood);
}

/// A louvred shutter in the yz plane.
fn shutter(height: f64) -> MeshBuilder {
    let (width, bar) = (0.5, 0.06);
    let mut out = MeshBuilder::new();
    for s in [-0.5, 0.5] {
        out.add(&block(0.04, height, bar, 0.008), at(0.0, 0.0, s * (width - bar)));
        out.add(&block(0.04, bar, width - bar, 0.008), at(0.0, s * (height - bar), 0.0));
    }
    let slats = 20;
    for i in 0..slats {
        let y = ((i as f64 + 0.5) / slats as f64 - 0.5) * (height - 2.0 * bar);
        out.add(&block(0.012, 0.09, width - 1.5 * bar, 0.003), at(0.0, y, 0.0) * rot_z(0.6));
    }
    out
}

/// Stairs along the house, the gallery they lead to, and the balustrade of both.
fn gallery(stage: &mut Stage, m: &Palette) {
    let (steps, start) = (17, 2.6);
    let (rise, run) = (GALLERY_Y / steps as f64, 0.29);
    let width = HOUSE_X - GALLERY_X;
    let middle = 0.5 * (HOUSE_X + GALLERY_X);
    let mut stone = MeshBuilder::new();
    for i in 0..steps {
        let y = rise * (i as f64 + 1.0);
        let z = start - run * (i as f64 + 0.5);
        stone.add(&block(width + 0.06, 0.06, run + 0.05, 0.012), at(middle - 0.03, y - 0.03, z + 0.01));
        stone.add(&block(width - 0.06, y - 0.05, run, 0.005), at(middle, 0.5 * (y - 0.05), z));
    }
    let begin = start - run * steps as f64;
    let end = GATE_Z + 0.25;
    let (length, z) = (begin - end, 0.5 * (begin + end));
    stone.add(&block(width + 0.1, 0.16, length, 0.02), at(middle - 0.05, GALLERY_Y - 0.08, z));
    stone.add(&block(0.16, 0.14, length, 0.02), at(GALLERY_X + 0.1, GALLERY_Y - 0.2, z));
    let brackets = 6;
    for i in 0..brackets {
        let z = begin - 0.3 - (length - 0.6) * i as f64 / (brackets - 1) as f64;
        stone.add(&block(0.24, GALLERY_Y - 0.36, 0.24, 0.03), at(GALLERY_X + 0.12, 0.5 * (GALLERY_Y - 0.36) + 0.1, z));
        stone.add(&block(0.36, 0.14, 0.36, 0.03), at(GALLERY_X + 0.12, 0.07, z));
        stone.add(&block(0.36, 0.12, 0.5, 0.03), at(GALLERY_X + 0.12, GALLERY_Y - 0.33, z));
    }
    // Handrails and piers.
    let top = 0.86;
    let rail_x = GALLERY_X + 0.06;
    stone.add(&block(0.2, 0.09, length, 0.025), at(rail_x, GALLERY_Y + top, z));
    stone.add(&block(0.16, 0.07, length, 0.015), at(rail_x, GALLERY_Y + 0.035, z));
    let slope = libm::atan2(rise, run);
    let flight = (run * steps as f64).hypot(GALLERY_Y);
    let on_flight = at(rail_x, 0.5 * GALLERY_Y + rise, 0.5 * (start + begin)) * rot_x(slope);
    stone.add(&block(0.18, 0.08, flight, 0.025), at(0.0, top, 0.0) * on_flight);
    for (y, z) in [(0.0, start + 0.05), (GALLERY_Y, begin - 0.05)] {
        stone.add(&block(0.24, 1.08, 0.24, 0.03), at(rail_x, y + 0.54, z));
        stone.add(&block(0.3, 0.07, 0.3, 0.02), at(rail_x, y + 1.1, z));
        stone.add(&sphere(0.13, 28, 16), at(rail_x, y + 1.25, z));
    }
    stage.add("stairs and gallery", &stone.map_uv(masonry), m.stone);

    let baluster = lathe(
        &[
            (0.0, 0.0),
            (0.05, 0.0),
            (0.05, 0.05),
            (0.03, 0.07),
            (0.026, 0.1),
            (0.05, 0.2),
            (0.058, 0.27),
            (0.05, 0.35),
            (0.028, 0.48),
            (0.022, 0.6),
            (0.028, 0.68),
            (0.045, 0.7),
            (0.045, 0.76),
            (0.0, 0.76),
        ],
        14,
    );
    let baluster = stage.mesh("baluster", &baluster.map_uv(|p, n| dvec2(n.x + n.z, -p.y) * 0.3), m.stone);
    for i in 0..steps {
        let y = rise * (i as f64 + 1.0);
        stage.place(
            baluster,
            at(rail_x, y, start - run * (i as f64 + 0.5)) * DAffine3::from_scale(dvec3(1.0, 1.07, 1.0)),
        );
    }
    let count = (length / 0.24) as usize;
    for i in 1..count {
        stage.place(baluster, at(rail_x, GALLERY_Y + 0.065, begin - 0.24 * i as f64));
    }
}

fn gate(stage: &mut Stage, m: &Palette) {
    let open = 1.35;
    let mut outline = vec![dvec2(-7.0, 0.0), dvec2(-open, 0.0)];
    outline.extend(arch(open, 32));
    outline.extend([dvec2(open, 0.0), dvec2(4.2, 0.0), dvec2(4.2, 5.6), dvec2(-7.0, 5.6)]);
    let wall = plate(&outline, 0.6, 0.02).moved(at(0.0, 0.0, GATE_Z)).map_uv(masonry);
    stage.add("gate wall", &wall, m.plaster);
    let mut ring: Vec<DVec2> = arch(open - 0.03, 32).collect();
    ring.extend(arch(open + 0.26, 32).collect::<Vec<_>>().into_iter().rev());
    let mut stone = plate(&ring, 0.74, 0.03);
    for s in [-1.0, 1.0] {
        stone.add(&block(0.29, SPRING, 0.74, 0.03), at(s * (open + 0.115), 0.5 * SPRING, 0.0));
        stone.add(&block(0.4, 0.12, 0.84, 0.03), at(s * (open + 0.115), SPRING - 0.04, 0.0));
    }
    stone.add(
        &plate(&[dvec2(-0.13, 0.0), dvec2(0.13, 0.0), dvec2(0.2, 0.46), dvec2(-0.2, 0.46)], 0.86, 0.03),
        at(0.0, SPRING + open - 0.06, 0.0),
    );
    stone.add(&block(11.4, 0.14, 0.8, 0.03), at(-1.4, 5.62, 0.0));
    stage.add("gate stone", &stone.moved(at(0.0, 0.0, GATE_Z)).map_uv(masonry), m.stone);
    // An iron gate, half open.
    let mut leaf = MeshBuilder::new();
    let here = DAffine3::IDENTITY;
    for i in 0..9 {
        let x = 0.06 + 0.145 * i as f64;
        let height = 2.2 + 1.05 * (1.0 - (1.0 - x / 1.3) * (1.0 - x / 1.3)).max(0.0).sqrt();
        leaf.add(&rod(dvec3(x, 0.06, 0.0), dvec3(x, height, 0.0), 0.014, 8), here);
        leaf.add(&lathe(&[(0.0, 0.0), (0.026, 0.04), (0.022, 0.06), (0.0, 0.14)], 10), at(x, height, 0.0));
    }
    for y in [0.12, 1.15, 2.1] {
        leaf.add(&block(1.26, 0.05, 0.035, 0.008), at(0.64, y, 0.0));
    }
    let leaf = stage.mesh("gate leaf", &leaf, m.iron);
    stage.place(leaf, at(-open + 0.04, 0.0, GATE_Z + 0.2) * rot_y(-0.9));
    stage.place(leaf, at(open - 0.04, 0.0, GATE_Z + 0.2) * rot_y(PI + 1.2));
}

/// Beams and slats across the passage, with a vine on them.
fn pergola(stage: &mut Stage, m: &Palette, rng: &mut Rng) {
    let (near, far) = (-9.2, -14.6);
    let beam =
        stage.mesh("beam", &block(6.6, 0.18, 0.14, 0.02).map_uv(|p, _| dvec2(p.x * 0.5, 0.5 * (p.y + p.z))), m.wood);
    for i in 0..5 {
        let z = near + (far - near) * i as f64 / 4.0;
        stage.place(beam, at(-0.55, 4.46, z));
    }
    let slat =
        stage.mesh("slat", &block(0.06, 0.09, 6.2, 0.01).map_uv(|p, _| dvec2(p.z * 0.5, 0.5 * (p.y + p.x))), m.wood);
    for i in 0..17 {
        stage.place(slat, at(-3.4 + 0.36 * i as f64, 4.59, 0.5 * (near + far)));
    }
    let mut posts = MeshBuilder::new();
    for z in [near, far] {
        posts.add(&block(0.16, 4.4, 0.16, 0.02), at(2.25, 2.2, z));
        posts.add(&block(0.3, 0.2, 0.3, 0.03), at(2.25, 0.1, z));
    }
    stage.add("pergola posts", &posts.map_uv(|p, _| dvec2(p.y * 0.5, 0.5 * (p.x + p.z))), m.wood);
    let mut stem = MeshBuilder::new();
    for (z, side) in [(near, 1.0), (far, -1.0)] {
        let path: Vec<DVec3> = (0..=60)
            .map(|i| {
                let t = i as f64 / 60.0;
                let (c, s) = circle(5.0 * TAU * t * side);
                dvec3(2.25 + 0.13 * c, 0.03 + 4.47 * t, z + 0.13 * s)
            })
            .collect();
        stem.add(&tube(&path, |t| 0.03 - 0.012 * t, 8), DAffine3::IDENTITY);
    }
    stage.add("vine stems", &stem.map_uv(|p, _| dvec2(p.x, p.y)), m.bark);
    let vine = [leaf::TWIG, leaf::TWIG].map(|cell| stage.mesh("vine", &plants::spray(cell, 0.42, rng), m.leaf));
    for i in 0..110 {
        let x = rng.range(-3.5, 2.4);
        let z = rng.range(far - 0.3, near + 0.3);
        let d = dvec3(rng.spread(1.0), rng.range(-0.35, 0.8), rng.spread(1.0)).normalize();
        let mut place = align_y(d) * scaled(rng.range(0.7, 1.2));
        place.translation = dvec3(x, 4.64, z);
        stage.place(vine[i % 2], place);
    }
}

fn fountain(stage: &mut Stage, m: &Palette) {
    let place = at(-0.55, 0.0, -6.3);
    let basin = lathe(
        &[
            (0.0, 0.0),
            (1.2, 0.0),
            (1.22, 0.03),
            (1.22, 0.12),
            (1.1, 0.16),
            (1.06, 0.2),
            (1.08, 0.42),
            (1.16, 0.48),
            (1.18, 0.54),
            (1.14, 0.58),
            (1.02, 0.58),
            (0.98, 0.54),
            (0.96, 0.3),
            (0.0, 0.3),
        ],
        8,
    );
    stage.add("basin", &basin.moved(place).map_uv(masonry), m.stone);
    let stem = lathe(
        &[
            (0.2, 0.3),
            (0.2, 0.36),
            (0.12, 0.42),
            (0.09, 0.5),
            (0.11, 0.7),
            (0.15, 0.8),
            (0.1, 0.92),
            (0.08, 1.02),
            (0.13, 1.06),
            (0.4, 1.14),
            (0.54, 1.24),
            (0.56, 1.28),
            (0.53, 1.29),
            (0.38, 1.19),
            (0.1, 1.12),
            (0.07, 1.18),
            (0.06, 1.34),
            (0.09, 1.42),
            (0.06, 1.5),
            (0.025, 1.54),
            (0.06, 1.6),
            (0.07, 1.66),
            (0.05, 1.72),
            (0.0, 1.76),
        ],
        56,
    );
    stage.add("fountain", &stem.moved(place).map_uv(|p, n| dvec2(n.x + n.z, -p.y) * 0.3), m.stone);
    stage.add("water", &cylinder(0.97, 0.12, 8, 0.0).moved(place * at(0.0, 0.36, 0.0)), m.shutter);
}

fn furniture(stage: &mut Stage, m: &Palette) {
    let (x, z) = (0.95, -0.4);
    let top = lathe(&[(0.0, 0.72), (0.53, 0.72), (0.545, 0.732), (0.545, 0.748), (0.53, 0.76), (0.0, 0.76)], 64);
    stage.add("table top", &top.moved(at(x, 0.0, z)).map_uv(|p, _| dvec2(p.x, p.z) * 0.9), m.wood);
    let mut iron = MeshBuilder::new();
    iron.add(
        &lathe(
            &[
                (0.0, 0.1),
                (0.035, 0.1),
                (0.045, 0.14),
                (0.025, 0.2),
                (0.025, 0.6),
                (0.05, 0.68),
                (0.12, 0.72),
                (0.0, 0.72),
            ],
            24,
        ),
        at(x, 0.0, z),
    );
    for k in 0..3 {
        let (c, s) = circle(TAU * k as f64 / 3.0 + 0.3);
        let foot: Vec<DVec3> = (0..=14)
            .map(|i| {
                let t = i as f64 / 14.0;
                dvec3(x + 0.36 * t * c, 0.2 - 0.18 * t + 0.06 * sin(PI * t), z + 0.36 * t * s)
            })
            .collect();
        iron.add(&tube(&foot, |t| 0.02 - 0.005 * t, 10), DAffine3::IDENTITY);
    }
    stage.add("table foot", &iron, m.iron);
    let chair = chair();
    let seat = stage.mesh("chair seat", &chair.0.map_uv(|p, _| dvec2(p.x, p.z)), m.wood);
    let frame = stage.mesh("chair frame", &chair.1, m.iron);
    for (dx, dz, turn) in [(-0.82, 0.12, 1.45), (0.62, 0.6, -2.4), (0.1, -0.85, 0.1), (-2.35, 1.9, 0.7)] {
        // Its slanted legs end a little below its own ground.
        let place = at(x + dx, 0.0025, z + dz) * rot_y(turn);
        stage.place(seat, place);
        stage.place(frame, place);
    }
    let mut china = MeshBuilder::new();
    let jug = lathe(
        &[
            (0.0, 0.0),
            (0.05, 0.0),
            (0.07, 0.03),
            (0.075, 0.08),
            (0.05, 0.15),
            (0.035, 0.19),
            (0.045, 0.23),
            (0.04, 0.23),
            (0.0, 0.2),
        ],
        32,
    );
    china.add(&jug, at(x + 0.05, 0.76, z - 0.1));
    let cup = lathe(
        &[
            (0.0, 0.0),
            (0.07, 0.006),
            (0.075, 0.012),
            (0.03, 0.012),
            (0.038, 0.03),
            (0.042, 0.07),
            (0.037, 0.07),
            (0.0, 0.04),
        ],
        24,
    );
    for (dx, dz) in [(-0.28, 0.1), (0.25, 0.2), (0.02, -0.36)] {
        china.add(&cup, at(x + dx, 0.76, z + dz));
    }
    stage.add("china", &china, m.cloth);
    // A garland of lamps over the front of the yard.
    let mut garland = MeshBuilder::new();
    let mut bulbs = MeshBuilder::new();
    for (a, b) in [
        (dvec3(ARCADE_X, 4.35, 1.4), dvec3(HOUSE_X, 4.9, -1.0)),
        (dvec3(ARCADE_X, 4.35, -5.0), dvec3(HOUSE_X, 4.9, -2.6)),
    ] {
        let point = |t: f64| a + (b - a) * t - DVec3::Y * (2.4 * t * (1.0 - t));
        let wire: Vec<DVec3> = (0..=40).map(|i| point(i as f64 / 40.0)).collect();
        garland.add(&tube(&wire, |_| 0.008, 6), DAffine3::IDENTITY);
        for i in 1..12 {
            let p = point(i as f64 / 12.0);
            garland.add(&cylinder(0.02, 0.05, 10, 0.005), at(p.x, p.y - 0.05, p.z));
            bulbs.add(&sphere(0.04, 16, 10), at(p.x, p.y - 0.085, p.z));
        }
    }
    stage.add("garland", &garland, m.iron);
    stage.add("bulbs", &bulbs, m.cloth);
}

/// Seat slats and iron frame of a chair that faces +z.
fn chair() -> (MeshBuilder, MeshBuilder) {
    let (mut seat, mut frame) = (MeshBuilder::new(), MeshBuilder::new());
    let here = DAffine3::IDENTITY;
    for i in 0..6 {
        seat.add(&block(0.4, 0.022, 0.055, 0.006), at(0.0, 0.45, -0.18 + 0.07 * i as f64));
    }
    for i in 0..2 {
        seat.add(
            &block(0.4, 0.06, 0.02, 0.006),
            at(0.0, 0.72 + 0.12 * i as f64, -0.245 - 0.03 * i as f64) * rot_x(-0.2),
        );
    }
    for s in [-1.0, 1.0] {
        let back = [
            dvec3(0.19 * s, 0.0, -0.27),
            dvec3(0.185 * s, 0.25, -0.22),
            dvec3(0.18 * s, 0.45, -0.2),
            dvec3(0.18 * s, 0.68, -0.235),
            dvec3(0.175 * s, 0.9, -0.3),
        ];
        frame.add(&tube(&back, |_| 0.012, 10), here);
        frame.add(&tube(&[dvec3(0.19 * s, 0.0, 0.22), dvec3(0.18 * s, 0.43, 0.18)], |_| 0.012, 10), here);
        frame.add(&rod(dvec3(0.18 * s, 0.43, 0.19), dvec3(0.18 * s, 0.43, -0.21), 0.012, 10), here);
    }
    for (y, z) in [(0.43, 0.18), (0.43, -0.2), (0.2, 0.2)] {
        frame.add(&rod(dvec3(-0.18, y, z), dvec3(0.18, y, z), 0.01, 8), here);
    }
    let hoop: Vec<DVec3> = (0..=16)
        .map(|i| {
            let (c, s) = circle(PI * i as f64 / 16.0);
            dvec3(0.175 * c, 0.9 + 0.08 * s, -0.3 - 0.015 * s)
        })
        .collect();
    frame.add(&tube(&hoop, |_| 0.012, 10), here);
    (seat, frame)
}

fn greenery(stage: &mut Stage, m: &Palette, rng: &mut Rng) {
    let pot = lathe(
        &[
            (0.0, 0.0),
            (0.2, 0.0),
            (0.21, 0.02),
            (0.29, 0.36),
            (0.31, 0.37),
            (0.33, 0.39),
            (0.33, 0.45),
            (0.31, 0.46),
            (0.28, 0.46),
            (0.26, 0.4),
            (0.0, 0.39),
        ],
        40,
    );
    let pot = stage.mesh("pot", &pot.map_uv(|p, n| dvec2(n.x + n.z, -p.y) * 0.3), m.pot);
    let jar = lathe(
        &[
            (0.0, 0.0),
            (0.16, 0.0),
            (0.2, 0.05),
            (0.32, 0.35),
            (0.36, 0.55),
            (0.34, 0.75),
            (0.22, 0.92),
            (0.19, 0.98),
            (0.24, 1.04),
            (0.2, 1.05),
            (0.14, 0.98),
            (0.0, 0.96),
        ],
        48,
    );
    let jar = stage.mesh("jar", &jar.map_uv(|p, n| dvec2(n.x + n.z, -p.y) * 0.3), m.pot);
    let soil = stage.mesh("soil", &cylinder(0.265, 0.02, 28, 0.0), m.dark);
    let fern = stage.mesh("fern", &plants::fronds(leaf::FERN, 11, 0.75, 0.4, rng), m.fern);
    let broad = stage.mesh("broad plant", &plants::fronds(leaf::BROAD, 12, 0.7, 0.26, rng), m.leaf);
    let bush = stage.mesh("bush", &bush(170, 0.32, rng), m.leaf);
    let flowers = stage.mesh("flowers", &bush_of(leaf::BROAD, 70, 0.36, 0.08, rng), m.bloom);
    // Pots at the feet of the columns, the stairs and the gate.
    let pots = [
        (-2.75, 1.25, 1.0, 0),
        (-2.95, -1.9, 0.9, 1),
        (-2.85, -5.2, 1.1, 2),
        (-2.9, -8.2, 0.9, 0),
        (-2.9, -11.4, 1.0, 1),
        (-2.85, -14.7, 1.0, 2),
        (2.05, -1.9, 1.0, 2),
        (1.95, -5.9, 1.1, 0),
        (2.1, -7.0, 0.8, 1),
        (1.9, -15.9, 1.1, 2),
        (-1.9, -20.4, 1.2, 1),
        (1.9, -20.4, 1.2, 1),
        (2.0, 2.05, 0.85, 1),
        (-2.35, 2.1, 0.7, 2),
    ];
    for (x, z, size, kind) in pots {
        let place = at(x, 0.0, z) * scaled(size);
        stage.place(pot, place);
        stage.place(soil, place * at(0.0, 0.385, 0.0));
        let plant = standing(dvec3(x, 0.4 * size, z), size, rng);
        match kind {
            0 => stage.place(fern, plant),
            1 => stage.place(broad, plant),
            _ => {
                stage.place(bush, plant);
                stage.place(flowers, plant);
            }
        }
    }
    for (x, z, size) in [(-2.95, -3.4, 1.0), (2.1, -11.0, 1.1), (-2.3, -1.3, 0.7)] {
        stage.place(jar, at(x, 0.0, z) * scaled(size));
    }
    // A small tree in a box.
    let tree = plants::tree(0.85, 0.075, 2, rng);
    let foot = dvec3(-2.0, 0.5, -9.9);
    stage.add(
        "tree box",
        &rounded_box(dvec3(0.9, 0.56, 0.9), 0.04, 2).moved(at(foot.x, 0.28, foot.z)).map_uv(masonry),
        m.pot,
    );
    let lift = at(foot.x, foot.y, foot.z) * scaled(1.25);
    stage.add("tree", &tree.wood.moved(lift).map_uv(|p, n| dvec2(n.x + n.z, p.y)), m.bark);
    let spray = stage.mesh("tree leaves", &plants::spray(leaf::TWIG, 0.36, rng), m.leaf);
    for place in &tree.sprays {
        stage.place(spray, lift * *place);
    }
    // Bougainvillea that hangs over the gallery and climbs the gate.
    let creeper = stage.mesh("creeper", &plants::spray(leaf::TWIG, 0.34, rng), m.leaf);
    let bract = stage.mesh("bracts", &plants::spray(leaf::TWIG, 0.26, rng), m.bloom);
    for i in 0..150 {
        let (p, out) = if i < 90 {
            let z = rng.range(-7.4, -3.0);
            let drop = rng.range(0.0, 1.0) * rng.range(0.2, 1.0) * 1.3;
            (dvec3(GALLERY_X - 0.05, GALLERY_Y + 0.85 - drop, z), dvec3(-1.0, rng.range(-0.6, 0.5), rng.spread(0.6)))
        } else {
            let x = rng.range(-3.4, -1.5);
            let y = rng.range(1.0, 5.6);
            (dvec3(x, y, GATE_Z + 0.32), dvec3(rng.spread(0.6), rng.range(-0.5, 0.6), 1.0))
        };
        let mut place = align_y(out.normalize()) * rot_y(rng.range(0.0, TAU)) * scaled(rng.range(0.7, 1.2));
        place.translation = p;
        stage.place(if rng.below(3) == 0 { bract } else { creeper }, place);
    }
}

fn bush(count: usize, radius: f64, rng: &mut Rng) -> MeshBuilder {
    bush_of(leaf::BROAD, count, radius, 0.12, rng)
}

/// Leaves on a ball that rests a little above the origin.
fn bush_of(cell: (f64, f64), count: usize, radius: f64, size: f64, rng: &mut Rng) -> MeshBuilder {
    let mut out = MeshBuilder::new();
    let leaf = plants::card(cell, 0.7 * size, size, 0.3);
    for _ in 0..count {
        let (c, s) = circle(rng.range(0.0, TAU));
        let up = rng.range(-0.5, 1.0);
        let side = (1.0 - up * up).max(0.0).sqrt();
        let d = dvec3(side * c, up, side * s);
        let lean = dvec3(rng.spread(0.7), rng.spread(0.5), rng.spread(0.7));
        let mut place = align_y((d + lean).normalize());
        place.translation = dvec3(0.0, 0.85 * radius, 0.0) + d * radius * rng.range(0.65, 1.0);
        out.add(&leaf, place * rot_y(rng.range(0.0, TAU)));
    }
    out
}
