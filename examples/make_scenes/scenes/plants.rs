//! Cut-out plants that use the leaf atlas, shared by several scenes.

use super::kit::{PI, Rng, TAU, align_y, at, circle, rot_x, rot_y, rot_z, scaled, smoothstep};
use super::mesh_builder::{MeshBuilder, surface, tube};
use glam::{DAffine3, DVec3, dvec2, dvec3};

/// A leaf of the atlas that stands on the origin in the xy plane and bends backward, `width` by `height`.
pub(super) fn card(cell: (f64, f64), width: f64, height: f64, bend: f64) -> MeshBuilder {
    // A margin of one texel keeps the neighbouring cell out.
    let margin = 1.0 / 256.0;
    let mut out = surface(2, 4, |u, v| {
        let sag = bend * height * v * v;
        dvec3(
            (u - 0.5) * width,
            height * v * (1.0 - 0.35 * bend.abs() * v),
            -sag + 0.12 * width * (2.0 * u - 1.0) * (2.0 * u - 1.0),
        )
    });
    for uv in &mut out.uvs {
        *uv = dvec2(cell.0 + margin + uv.x * (0.5 - 2.0 * margin), cell.1 + 0.5 - margin - uv.y * (0.5 - 2.0 * margin));
    }
    out
}

/// Three crossed cards.
pub(super) fn tuft(cell: (f64, f64), width: f64, height: f64) -> MeshBuilder {
    let mut out = MeshBuilder::new();
    for k in 0..3 {
        out.add(&card(cell, width, height, 0.25), rot_y(PI * k as f64 / 3.0 + 0.2));
    }
    out
}

/// A spray of twigs around the end of a branch along `+Y`.
pub(super) fn spray(cell: (f64, f64), size: f64, rng: &mut Rng) -> MeshBuilder {
    let mut out = MeshBuilder::new();
    for k in 0..4 {
        let turn = TAU * k as f64 / 4.0 + rng.spread(0.4);
        let lean = rng.range(0.5, 1.25);
        let height = size * rng.range(0.8, 1.1);
        out.add(&card(cell, 0.8 * height, height, 0.3), rot_y(turn) * rot_x(lean) * rot_y(rng.spread(0.6)));
    }
    out.add(&card(cell, 0.7 * size, size, 0.15), rot_y(rng.range(0.0, TAU)));
    out
}

/// A plant of arching fronds that grow from one point, `height` tall.
pub(super) fn fronds(cell: (f64, f64), count: usize, height: f64, width: f64, rng: &mut Rng) -> MeshBuilder {
    let mut out = MeshBuilder::new();
    for k in 0..count {
        let turn = TAU * k as f64 / count as f64 + rng.spread(0.3);
        let lean = rng.range(0.15, 0.85);
        out.add(&card(cell, width, height * rng.range(0.8, 1.1), 0.55), rot_y(turn) * rot_x(-lean) * scaled(1.0));
    }
    out
}

/// A tree: its wood, and the frames where sprays of leaves grow, whose `+Y` is the twig's direction.
pub(super) struct Tree {
    pub wood: MeshBuilder,
    pub sprays: Vec<DAffine3>,
}

/// Grows a tree with a trunk `height` tall and `levels` forks.
pub(super) fn tree(height: f64, radius: f64, levels: usize, rng: &mut Rng) -> Tree {
    let mut out = Tree { wood: MeshBuilder::new(), sprays: Vec::new() };
    let place = DAffine3::IDENTITY;
    branch(&mut out, place, height, radius, levels, rng);
    out
}

fn branch(tree: &mut Tree, place: DAffine3, length: f64, radius: f64, levels: usize, rng: &mut Rng) {
    let (bend_x, bend_z) = (rng.spread(0.16), rng.spread(0.16));
    let path: Vec<DVec3> = (0..=8)
        .map(|i| {
            let t = i as f64 / 8.0;
            place.transform_point3(dvec3(bend_x * length * t * t, length * t, bend_z * length * t * t))
        })
        .collect();
    let trunk = tree.sprays.is_empty() && tree.wood.indices.is_empty();
    let shape = |t: f64| radius * (1.0 - 0.4 * t) * (1.0 + if trunk { 0.5 * smoothstep(0.25, 0.0, t) } else { 0.0 });
    tree.wood.add(&tube(&path, shape, if levels > 1 { 12 } else { 6 }), DAffine3::IDENTITY);
    let end = path[path.len() - 1];
    let along = (end - path[path.len() - 2]).normalize();
    let spread_out = |p: DVec3, d: DVec3, rng: &mut Rng| {
        let mut m = align_y(d) * rot_y(rng.range(0.0, TAU)) * scaled(rng.range(0.8, 1.2));
        m.translation = p;
        m
    };
    if levels == 0 {
        tree.sprays.push(spread_out(end, along, rng));
        for i in [3, 5] {
            let (c, s) = circle(rng.range(0.0, TAU));
            let d = (along + dvec3(c, 0.3, s) * 0.9).normalize();
            tree.sprays.push(spread_out(path[i], d, rng));
        }
        return;
    }
    let forks = if trunk { 5 } else { 3 };
    let start = rng.range(0.0, TAU);
    for k in 0..forks {
        let turn = start + TAU * k as f64 / forks as f64 + rng.spread(0.35);
        let tilt = rng.range(0.45, 0.8);
        let mut next = align_y(along) * rot_y(turn) * rot_z(-tilt);
        // Some branches leave the parent before its end.
        next.translation = if k == 0 { end } else { path[if k % 2 == 0 { 7 } else { 8 }] };
        let share = rng.range(0.62, 0.78);
        branch(tree, next, length * share, radius * 0.56, levels - 1, rng);
    }
}

/// A frame that stands at `p`, turned at random and scaled.
pub(super) fn standing(p: DVec3, scale: f64, rng: &mut Rng) -> DAffine3 {
    at(p.x, p.y, p.z) * rot_y(rng.range(0.0, TAU)) * rot_x(rng.spread(0.12)) * scaled(scale)
}
