//! A small tree, ferns and grass made of cut-out leaves, in front of a garden wall that receives their shadow.

use super::kit::{Rng, Stage, TAU, at, circle, rot_x, rot_y, smoothstep};
use super::mesh_builder::{MeshBuilder, block, floor, lathe_shaped, surface};
use super::plants::{self, standing};
use super::texture::{self, leaf};
use edgeshade::scene::Scene;
use glam::{DAffine3, DVec3, dvec2, dvec3};

pub(super) fn stage() -> Scene {
    let mut stage = Stage::new("foliage");
    let grain = stage.texture(texture::speckle());
    let atlas = stage.texture(texture::leaves());
    let earth = stage.textured("gravel", 0xd3c3a5, grain);
    let plaster = stage.textured("plaster", 0xe6dac5, grain);
    let coping = stage.textured("coping", 0xb08a6c, grain);
    let bark = stage.textured("bark", 0x6f5a48, grain);
    let stone = stage.textured("stone", 0x9b978d, grain);
    let green = stage.leaves("tree leaves", 0x76894f, atlas);
    let young = stage.leaves("young leaves", 0x9aa35c, atlas);
    let grass = stage.leaves("grass", 0x8d9463, atlas);
    let fern = stage.leaves("fern", 0x5f8455, atlas);
    let rust = stage.leaves("red leaves", 0xb9603c, atlas);

    // Ground with a low mound under the tree; farther away it is flat.
    let ground = surface(42, 40, |u, v| {
        let (x, z) = (14.0 * (u - 0.5), 7.0 - 12.0 * v);
        dvec3(x, rise(x, z), z)
    });
    stage.add("ground", &ground.map_uv(|p, _| dvec2(p.x, p.z) * 0.3), earth);
    let wall_uv =
        |p: DVec3, n: DVec3| if n.y.abs() > 0.5 { dvec2(p.x, p.z) * 0.3 } else { dvec2(p.x + p.z, -p.y) * 0.3 };
    let mut wall = MeshBuilder::new();
    wall.add(&block(14.0, 5.2, 0.35, 0.03), at(0.0, 1.6, -2.6));
    stage.add("wall", &wall.map_uv(wall_uv), plaster);
    let mut cap = MeshBuilder::new();
    cap.add(&block(14.0, 0.12, 0.55, 0.03), at(0.0, 4.24, -2.6));
    cap.add(&block(14.0, 0.4, 0.45, 0.03), at(0.0, 0.1, -2.6));
    stage.add("coping", &cap.map_uv(wall_uv), coping);
    stage.add(
        "beyond",
        &floor(14.0, 4.0, 1, 1).moved(at(0.0, -0.05, -4.6)).map_uv(|p, _| dvec2(p.x, p.z) * 0.3),
        earth,
    );

    let mut rng = Rng(2024);
    let foot = dvec3(-0.75, rise(-0.75, -0.3) - 0.05, -0.3);
    let tree = plants::tree(1.12, 0.13, 3, &mut rng);
    stage.add("wood", &tree.wood.moved(at(foot.x, foot.y, foot.z)).map_uv(|p, n| dvec2(2.0 * (n.x + n.z), p.y)), bark);
    let sprays: Vec<usize> = [green, green, young]
        .iter()
        .map(|&m| {
            let shape = plants::spray(leaf::TWIG, 0.4, &mut rng);
            stage.mesh("spray of leaves", &shape, m)
        })
        .collect();
    for place in &tree.sprays {
        let mesh = sprays[rng.below(sprays.len())];
        stage.place(mesh, at(foot.x, foot.y, foot.z) * *place);
    }

    let tufts = [plants::tuft(leaf::GRASS, 0.42, 0.34), plants::tuft(leaf::GRASS, 0.3, 0.5)]
        .map(|t| stage.mesh("grass", &t, grass));
    for _ in 0..620 {
        // Dense around the tree and along the wall, sparse in between.
        let p = if rng.below(5) < 3 {
            let angle = rng.range(0.0, TAU);
            let (c, s) = circle(angle);
            // An uneven outline that thins out.
            let edge = 1.5 + 0.2 * libm::sin(3.0 * angle + 1.0) + 0.14 * libm::sin(7.0 * angle) + rng.spread(0.2);
            let r = edge * rng.range(0.05, 1.0).sqrt();
            dvec3(foot.x + 1.25 * r * c, 0.0, foot.z + r * s)
        } else {
            let back = rng.range(0.0, 1.0);
            dvec3(rng.spread(6.6), 0.0, -2.3 + 0.8 * back * back)
        };
        let size = rng.range(0.55, 1.1);
        stage.place(tufts[rng.below(2)], standing(dvec3(p.x, rise(p.x, p.z) - 0.02, p.z), size, &mut rng));
    }
    let fern_mesh = stage.mesh("fern", &plants::fronds(leaf::FERN, 9, 0.8, 0.42, &mut rng), fern);
    for (x, z, size) in [
        (-3.3, -1.9, 1.1),
        (-2.5, -2.1, 0.8),
        (1.75, -2.0, 0.8),
        (3.3, -1.9, 1.2),
        (4.4, -2.0, 0.9),
        (0.55, -0.9, 0.6),
        (-1.9, 0.45, 0.65),
        (-4.7, -2.0, 1.1),
    ] {
        stage.place(fern_mesh, standing(dvec3(x, rise(x, z) - 0.02, z), size, &mut rng));
    }
    let shrub = stage.mesh("red shrub", &shrub(&mut rng), rust);
    for (x, z, size) in [(2.55, -1.5, 0.9), (2.0, -1.75, 0.65), (-3.85, -1.25, 0.8)] {
        stage.place(shrub, standing(dvec3(x, rise(x, z), z), size, &mut rng));
    }
    let pebble = stage.mesh("stone", &pebble().map_uv(|p, _| dvec2(p.x, p.z)), stone);
    for (x, z, size) in [
        (0.7, 0.55, 0.34),
        (1.05, 0.3, 0.2),
        (-2.2, -0.5, 0.3),
        (2.9, 0.6, 0.16),
        (0.1, 1.1, 0.14),
        (-2.9, 1.3, 0.22),
        (3.9, -1.2, 0.36),
        (3.5, -1.0, 0.18),
    ] {
        let flat = DAffine3::from_scale(dvec3(1.0, 0.7, 1.0) * size);
        stage.place(pebble, at(x, rise(x, z) + 0.12 * size, z) * rot_y(7.0 * x + z) * rot_x(0.1) * flat);
    }

    stage.camera([0.95, 2.0, 6.9], [0.4, 1.5, 0.0], 36.0);
    stage.sun([0.0, 1.0, -1.0], 318.0, 34.0, 0.018, 0xfff1d9);
    stage.scene
}

/// Height of the ground.
fn rise(x: f64, z: f64) -> f64 {
    let d2 = (x + 0.75) * (x + 0.75) / 6.0 + (z + 0.3) * (z + 0.3) / 3.6;
    let mound = 0.26 * libm::exp(-d2);
    let rough = 0.05 * texture::noise(0.45 * x, 0.45 * z, 64, 3) + 0.02 * texture::noise(1.3 * x, 1.3 * z, 64, 4);
    mound + rough * smoothstep(-2.5, -1.8, z)
}

/// A round bush of single broad leaves.
fn shrub(rng: &mut Rng) -> MeshBuilder {
    let mut out = MeshBuilder::new();
    let leaf = plants::card(leaf::BROAD, 0.1, 0.16, 0.3);
    for _ in 0..190 {
        let (c, s) = circle(rng.range(0.0, TAU));
        let up = rng.range(-0.2, 1.0);
        let side = (1.0 - up * up).max(0.0).sqrt();
        let d = dvec3(side * c, up, side * s);
        let mut place = super::kit::align_y((d + dvec3(rng.spread(0.7), rng.spread(0.5), rng.spread(0.7))).normalize());
        place.translation = dvec3(0.0, 0.34, 0.0) + d * rng.range(0.22, 0.4);
        out.add(&leaf, place * rot_y(rng.range(0.0, TAU)));
    }
    out
}

fn pebble() -> MeshBuilder {
    let profile: Vec<(f64, f64)> = (0..=14)
        .map(|i| {
            let (c, s) = circle(0.5 * TAU * i as f64 / 14.0);
            (if i == 0 || i == 14 { 0.0 } else { s }, -c)
        })
        .collect();
    lathe_shaped(&profile, 28, |a, r| {
        let lobes = 0.1 * libm::sin(2.0 * a + 0.4) + 0.05 * libm::sin(3.0 * a);
        r * (1.0 + lobes)
    })
}
