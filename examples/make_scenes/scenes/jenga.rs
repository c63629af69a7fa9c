//! A half-played tower of wooden blocks on a round table: contact shadows, narrow gaps, overhangs.

use super::kit::{PI, Rng, Stage, at, rot_x, rot_y, rot_z};
use super::mesh_builder::{block, cylinder, lathe, studio};
use super::texture;
use edgeshade::scene::Scene;
use glam::dvec2;

const LENGTH: f64 = 0.75;
const WIDTH: f64 = 0.25;
const HEIGHT: f64 = 0.15;
const LAYERS: usize = 17;
/// Blocks taken out: layer from below, and index within its three blocks.
const TAKEN: [(usize, usize); 13] =
    [(2, 1), (3, 0), (5, 1), (6, 2), (7, 1), (8, 0), (9, 1), (11, 2), (12, 1), (13, 0), (14, 1), (16, 0), (16, 1)];
/// Blocks pulled half out: layer, block, metres along the block.
const PULLED: [(usize, usize, f64); 5] = [(3, 2, 0.16), (6, 0, -0.22), (9, 2, 0.30), (12, 0, -0.12), (15, 1, 0.26)];

pub(super) fn stage() -> Scene {
    let mut stage = Stage::new("jenga");
    let wood = stage.texture(texture::wood());
    let grain = stage.texture(texture::speckle());
    let table = stage.textured("table", 0xcdc3b2, grain);
    let floor = stage.textured("floor", 0x56706f, grain);
    let shades = [0xe2bf8c, 0xd9ae74, 0xe9cd9f, 0xcc9a5e];
    let blocks: Vec<usize> = shades
        .iter()
        .enumerate()
        .map(|(i, &hex)| {
            let material = stage.textured(&format!("wood {i}"), hex, wood);
            // Each shade of wood uses another part of the texture.
            let k = i as f64;
            let shape = block(LENGTH, HEIGHT, WIDTH, 0.014).map_uv(|p, n| {
                let across = if n.y.abs() > 0.5 { p.z } else { p.y };
                dvec2(p.x * 0.5 + 0.27 * k, across * 0.55 + 0.31 * k)
            });
            stage.mesh("block", &shape, material)
        })
        .collect();
    let accent = stage.paint("red block", 0xb5442f);
    let red = stage.mesh("red block", &block(LENGTH, HEIGHT, WIDTH, 0.014), accent);

    let top =
        lathe(&[(0.0, -0.22), (2.55, -0.22), (2.7, -0.17), (2.76, -0.1), (2.75, -0.03), (2.7, 0.0), (0.0, 0.0)], 128);
    stage.add("table top", &top.map_uv(|p, _| dvec2(p.x * 0.3, p.z * 0.3)), table);
    stage.add("table foot", &cylinder(0.35, 2.2, 48, 0.02).moved(at(0.0, -2.4, 0.0)), table);
    let ground = studio(22.0, 6.0, -4.5, 2.0, 9.0).map_uv(|p, _| dvec2(p.x * 0.2, (p.z - p.y) * 0.2));
    stage.add("studio", &ground.moved(at(0.0, -2.4, 0.0)), floor);

    tower(&mut stage, &blocks, red);
    fallen(&mut stage, &blocks, red);

    stage.camera([1.5, 3.2, 5.9], [0.2, 0.85, 0.0], 34.0);
    stage.spot([-7.0, 5.8, -1.6], [0.2, -0.2, 0.3], 31.0, 0.2, 0xfff1dc);
    stage.scene
}

fn tower(stage: &mut Stage, shades: &[usize], red: usize) {
    let mut rng = Rng(1958);
    // Playing has left the tower a little twisted and leaning.
    let (mut x, mut z, mut twist) = (-0.55, -0.35, 0.5);
    for layer in 0..LAYERS {
        x += rng.spread(0.008) + 0.003;
        z += rng.spread(0.008);
        twist += rng.spread(0.025);
        for slot in 0..3 {
            let (slide, turn) = (rng.spread(0.018), rng.spread(0.02));
            let shade = shades[rng.below(shades.len())];
            if TAKEN.contains(&(layer, slot)) {
                continue;
            }
            let pulled = PULLED.iter().find(|p| (p.0, p.1) == (layer, slot));
            let along = slide + pulled.map_or(0.0, |p| p.2);
            let quarter = if layer % 2 == 0 { 0.0 } else { 0.5 * PI };
            let place = at(x, (layer as f64 + 0.5) * HEIGHT, z)
                * rot_y(twist + quarter)
                * at(along, 0.0, (slot as f64 - 1.0) * (WIDTH + 0.002))
                * rot_y(turn * if pulled.is_some() { 3.0 } else { 0.4 });
            stage.place(if (layer, slot) == (9, 2) { red } else { shade }, place);
        }
    }
}

fn fallen(stage: &mut Stage, shades: &[usize], red: usize) {
    let flat = |x: f64, z: f64, turn: f64| at(x, 0.5 * HEIGHT, z) * rot_y(turn);
    let on_edge = at(0.0, 0.5 * (WIDTH - HEIGHT), 0.0) * rot_x(0.5 * PI);
    let upright = at(0.0, 0.5 * (LENGTH - HEIGHT), 0.0) * rot_z(0.5 * PI);
    let lying = [
        (0, flat(0.75, 1.05, 0.35)),
        (1, flat(1.55, -0.35, -0.9)),
        (2, flat(-1.1, 1.15, 1.2)),
        (3, flat(1.75, 0.75, 0.1)),
        (1, flat(0.25, 1.85, -0.25)),
        (2, flat(1.62, 0.72, 1.35) * at(0.0, HEIGHT, 0.0)),
        (0, flat(-0.35, 1.45, 0.55) * on_edge),
        (3, flat(1.05, -1.35, 0.4) * upright),
        (0, flat(-1.75, 0.1, -0.5)),
    ];
    for (shade, place) in lying {
        stage.place(shades[shade], place);
    }
    // One block leans on another: its lower edge on the table, its underside on the other's upper edge.
    let (base, reach) = (at(0.55, 0.0, 0.3) * rot_y(-0.25), 0.5);
    let tilt = libm::atan2(HEIGHT, reach);
    stage.place(shades[1], base * at(reach + 0.5 * WIDTH, 0.5 * HEIGHT, 0.0) * rot_y(0.5 * PI));
    stage.place(red, base * rot_z(tilt) * at(0.5 * LENGTH, 0.5 * HEIGHT, 0.0));
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_taken_block_leaves_its_layer_standing() {
        for layer in 0..LAYERS - 1 {
            let taken: Vec<usize> = TAKEN.iter().filter(|t| t.0 == layer).map(|t| t.1).collect();
            assert!(taken.len() < 2, "layer {layer} lost {taken:?}");
        }
    }
}
