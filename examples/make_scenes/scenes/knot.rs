//! A woven ball: rings on two spheres with twisted struts between them, merged into one surface.
//!
//! The surface is the zero set of a field of rounded, blended distances to the rods, meshed by surface nets. Three
//! half turns map the ball onto itself, so only a quarter of it is stored and placed four times.

use super::kit::{PI, Stage, TAU, at, circle, rot_x, rot_y, rot_z, rotation, sin};
use super::mesh_builder::{MeshBuilder, cylinder, studio};
use super::texture;
use edgeshade::scene::Scene;
use glam::{DVec2, DVec3, dvec2, dvec3};
use std::collections::BTreeMap;

/// Side of a mesh cell in units of the ball's radius.
const CELL: f64 = 0.015;
/// Largest distance between two rods at which they still merge.
const BLEND: f64 = 0.028;
/// Radius of the ball in metres.
const RADIUS: f64 = 1.35;

pub(super) fn stage() -> Scene {
    let mut stage = Stage::new("knot");
    let grain = stage.texture(texture::speckle());
    let paper = stage.textured("paper", 0xded4c4, grain);
    let clay = stage.paint("clay", 0xc1653f);
    let slate = stage.paint("slate", 0x44585c);

    let backdrop = studio(24.0, 7.0, -5.0, 2.5, 8.0).map_uv(|p, _| dvec2(p.x * 0.2, (p.z - p.y) * 0.2));
    stage.add("studio", &backdrop, paper);
    stage.add("foot", &cylinder(0.42, 0.16, 72, 0.04).moved(at(-0.9, 0.0, -0.6)), slate);

    let quarter = stage.mesh("quarter of the ball", &quarter(), clay);
    let place = at(-0.9, 0.14 + 1.06 * RADIUS, -0.6)
        * rot_y(0.5)
        * rot_x(0.3)
        * glam::DAffine3::from_scale(DVec3::splat(RADIUS));
    for turn in [rot_x(0.0), rot_x(PI), rot_y(PI), rot_z(PI)] {
        stage.place(quarter, place * turn);
    }

    stage.camera([1.2, 3.5, 7.2], [0.3, 0.98, 0.0], 34.0);
    stage.spot([-8.6, 7.4, 2.2], [0.6, 0.6, -0.6], 36.0, 0.1, 0xfff2df);
    stage.scene
}

/// A straight piece of a rod.
struct Piece {
    curve: usize,
    a: DVec3,
    b: DVec3,
    radius: f64,
}

/// Pieces near a point, found by the cube of space that contains it.
struct Field {
    pieces: Vec<Piece>,
    cubes: BTreeMap<[i32; 3], Vec<usize>>,
}

const CUBE: f64 = 0.12;

fn cube_of(p: DVec3) -> [i32; 3] {
    (p / CUBE).floor().to_array().map(|x| x as i32)
}

impl Field {
    fn new(curves: &[(Vec<DVec3>, bool, f64)]) -> Self {
        let mut out = Self { pieces: Vec::new(), cubes: BTreeMap::new() };
        for (curve, (points, closed, radius)) in curves.iter().enumerate() {
            let last = if *closed { points.len() } else { points.len() - 1 };
            for i in 0..last {
                let (a, b) = (points[i], points[(i + 1) % points.len()]);
                let reach = DVec3::splat(radius + 2.0 * BLEND + 2.0 * CELL);
                let (low, high) = (cube_of(a.min(b) - reach), cube_of(a.max(b) + reach));
                for x in low[0]..=high[0] {
                    for y in low[1]..=high[1] {
                        for z in low[2]..=high[2] {
                            out.cubes.entry([x, y, z]).or_default().push(out.pieces.len());
                        }
                    }
                }
                out.pieces.push(Piece { curve, a, b, radius: *radius });
            }
        }
        out
    }

    /// Value of the field, negative inside. Points that a half turn maps onto each other have exactly the same value.
    fn at(&self, p: DVec3) -> f64 {
        let p = match (p.x < 0.0, p.y < 0.0) {
            (false, false) => p,
            (true, true) => dvec3(-p.x, -p.y, p.z),
            (true, false) => dvec3(-p.x, p.y, -p.z),
            (false, true) => dvec3(p.x, -p.y, -p.z),
        };
        let far = 2.0 * BLEND;
        let Some(near) = self.cubes.get(&cube_of(p)) else { return far };
        // Distances to the rods, nearest first, because blending depends on the order.
        let mut rods: Vec<f64> = Vec::new();
        let mut curve = usize::MAX;
        for &i in near {
            let piece = &self.pieces[i];
            let along = piece.b - piece.a;
            let t = ((p - piece.a).dot(along) / along.length_squared()).clamp(0.0, 1.0);
            let distance = (p - piece.a - along * t).length() - piece.radius;
            match rods.last_mut() {
                Some(rod) if piece.curve == curve => *rod = rod.min(distance),
                _ => rods.push(distance),
            }
            curve = piece.curve;
        }
        rods.sort_by(f64::total_cmp);
        rods.into_iter().fold(far, blended)
    }

    fn normal(&self, p: DVec3) -> DVec3 {
        let e = 0.25 * CELL;
        let d = |v: DVec3| self.at(p + v * e) - self.at(p - v * e);
        dvec3(d(DVec3::X), d(DVec3::Y), d(DVec3::Z)).normalize()
    }
}

/// Smaller of two distances, rounded where they are nearly equal.
fn blended(a: f64, b: f64) -> f64 {
    let h = (BLEND - (a - b).abs()).max(0.0) / BLEND;
    a.min(b) - 0.25 * h * h * BLEND
}

/// The rods: outer rings that weave over and under each other, inner rings, and struts between the two.
fn curves() -> Vec<(Vec<DVec3>, bool, f64)> {
    let mut out = Vec::new();
    let (corners, middles) = icosahedron();
    // Every ring starts towards the corner nearest to its axis, which preserves the icosahedron's rotations.
    let toward = |axis: DVec3| -> DVec3 {
        let others = corners.iter().filter(|c| c.dot(axis) < 0.9);
        let neighbour = others.fold(-axis, |best, &c| if c.dot(axis) > best.dot(axis) { c } else { best });
        (neighbour - axis * axis.dot(neighbour)).normalize()
    };
    let ring = |axis: DVec3, radius: f64, opening: f64, wave: f64, lobes: f64, n: usize| -> Vec<DVec3> {
        let x = toward(axis);
        let y = axis.cross(x);
        (0..n)
            .map(|i| {
                let angle = TAU * i as f64 / n as f64;
                let (c, s) = circle(angle);
                let (co, so) = circle(opening);
                (axis * co + (x * c + y * s) * so) * (radius + wave * sin(lobes * angle))
            })
            .collect()
    };
    // The number of pieces of a ring is a multiple of the order of its axis.
    for &axis in &corners {
        out.push((ring(axis, 0.97, 0.36, 0.045, 5.0, 40), true, 0.028));
        out.push((ring(axis, 1.0, 0.19, 0.0, 1.0, 30), true, 0.017));
        out.push((ring(axis, 0.56, 0.6, 0.02, 5.0, 40), true, 0.021));
    }
    for &axis in &middles {
        out.push((ring(axis, 0.97, 0.37, 0.045, 6.0, 40), true, 0.028));
    }
    // Struts climb from the inner to the outer sphere while they turn about the ball's middle.
    for &axis in &corners {
        for k in 0..5 {
            let side = rotation(axis, TAU * k as f64 / 5.0) * toward(axis);
            let strut = (0..=14)
                .map(|i| {
                    let t = i as f64 / 14.0;
                    let (c, s) = circle(0.55 - 0.36 * t);
                    let swirl = rotation(axis, 1.1 * t) * side;
                    (axis * c + swirl * s) * (0.56 + 0.44 * t)
                })
                .collect();
            out.push((strut, false, 0.014));
        }
    }
    out
}

/// Corners of an icosahedron and the middles of its edges, on the unit sphere.
fn icosahedron() -> (Vec<DVec3>, Vec<DVec3>) {
    let golden = 0.5 * (1.0 + 5.0f64.sqrt());
    let mut corners = Vec::new();
    for a in [-1.0, 1.0] {
        for b in [-golden, golden] {
            corners.extend([dvec3(0.0, a, b), dvec3(a, b, 0.0), dvec3(b, 0.0, a)]);
        }
    }
    let mut middles = Vec::new();
    for i in 0..corners.len() {
        for j in i + 1..corners.len() {
            if (corners[i] - corners[j]).length() < 2.1 {
                middles.push((corners[i] + corners[j]).normalize());
            }
        }
    }
    (corners.into_iter().map(DVec3::normalize).collect(), middles)
}

/// The part of the ball with `x > 0` and `y > 0`; of the two bounding planes, the half with `z > 0`.
fn quarter() -> MeshBuilder {
    let field = Field::new(&curves());
    let n = (1.12 / CELL) as i32;
    // Grid nodes lie half a cell off the planes, so that a half turn maps nodes onto nodes.
    let node = |i: [i32; 3]| dvec3(f64::from(i[0]) + 0.5, f64::from(i[1]) + 0.5, f64::from(i[2]) + 0.5) * CELL;
    let (nx, nz) = ((n + 3) as usize, (2 * n + 3) as usize);
    let index = |i: [i32; 3]| ((i[0] + 2) as usize * nx + (i[1] + 2) as usize) * nz + (i[2] + n + 1) as usize;
    let mut values = vec![0.0; nx * nx * nz];
    for x in -2..=n {
        for y in -2..=n {
            for z in -n - 1..=n + 1 {
                values[index([x, y, z])] = field.at(node([x, y, z]));
            }
        }
    }
    let value = |i: [i32; 3]| values[index(i)];

    let mut out = MeshBuilder::new();
    // Vertex of each patch; its key is the lowest node of its cell and its smallest edge.
    let mut vertices: BTreeMap<([i32; 3], usize), u32> = BTreeMap::new();
    let mut vertex = |out: &mut MeshBuilder, cell: [i32; 3], through: usize| -> u32 {
        let corner = |k: usize| std::array::from_fn(|axis| cell[axis] + (k >> axis & 1) as i32);
        let patch = patches(std::array::from_fn(|k| value(corner(k)) < 0.0));
        *vertices.entry((cell, patch[through])).or_insert_with(|| {
            let (mut sum, mut count) = (DVec3::ZERO, 0.0);
            for axis in 0..3 {
                for a in (0..8).filter(|a| a >> axis & 1 == 0) {
                    let b = a | 1 << axis;
                    let (fa, fb) = (value(corner(a)), value(corner(b)));
                    if (fa < 0.0) != (fb < 0.0) && patch[edge(axis, a)] == patch[through] {
                        sum += node(corner(a)).lerp(node(corner(b)), fa / (fa - fb));
                        count += 1.0;
                    }
                }
            }
            // One step along the gradient moves the mean of the crossings onto the surface.
            let p: DVec3 = sum / count;
            let normal = field.normal(p);
            let p = p - normal * field.at(p).clamp(-0.15 * CELL, 0.15 * CELL);
            out.vertex(p, field.normal(p), DVec2::ZERO)
        })
    };
    for x in -1..n {
        for y in -1..n {
            for z in -n..n {
                for axis in 0..3 {
                    let (a, mut b) = ([x, y, z], [x, y, z]);
                    b[axis] += 1;
                    let (inside_a, inside_b) = (value(a) < 0.0, value(b) < 0.0);
                    // Twice the middle of the edge in cells, which decides the quarter that the edge belongs to.
                    let twice: [i32; 3] = std::array::from_fn(|k| a[k] + b[k] + 1);
                    let own = match (twice[0].signum(), twice[1].signum()) {
                        (1, 1) => true,
                        (0, 1) | (1, 0) => twice[2] > 0,
                        _ => false,
                    };
                    if inside_a == inside_b || !own {
                        continue;
                    }
                    let (u, v) = ((axis + 1) % 3, (axis + 2) % 3);
                    let mut around = |du: usize, dv: usize| {
                        let mut cell = a;
                        cell[u] -= du as i32;
                        cell[v] -= dv as i32;
                        vertex(&mut out, cell, edge(axis, du << u | dv << v))
                    };
                    let [p, q, r, s] = [around(1, 1), around(0, 1), around(0, 0), around(1, 0)];
                    let corners = if inside_a { [p, q, r, s] } else { [p, s, r, q] };
                    split_well(&mut out, corners);
                }
            }
        }
    }
    mend_normals(&mut out);
    out
}

/// Corrects normals. Where the field bends within a cell, its gradient may point against a face; there the faces
/// decide.
fn mend_normals(out: &mut MeshBuilder) {
    let mut doubtful = vec![false; out.positions.len()];
    let mut sums = vec![DVec3::ZERO; out.positions.len()];
    for t in out.indices.chunks_exact(3) {
        let [p, q, r] = [t[0], t[1], t[2]].map(|i| out.positions[i as usize]);
        let face = (q - p).cross(r - p);
        for &i in t {
            sums[i as usize] += face;
        }
        if t.iter().map(|&i| out.normals[i as usize]).sum::<DVec3>().dot(face) <= 0.1 * face.length() {
            t.iter().for_each(|&i| doubtful[i as usize] = true);
        }
    }
    for (i, sum) in sums.into_iter().enumerate() {
        if doubtful[i] && sum != DVec3::ZERO {
            out.normals[i] = sum.normalize();
        }
    }
}

/// Index of a cell's edge along `axis` from the corner whose bits (1 = x, 2 = y, 4 = z) are `corner`.
fn edge(axis: usize, corner: usize) -> usize {
    8 * axis + corner
}

/// Groups the crossed edges of a cell into patches of the surface: each gets the smallest edge of its patch.
///
/// Where two rods nearly touch, a cell holds two patches; one common vertex would fold the mesh.
fn patches(inside: [bool; 8]) -> [usize; 24] {
    let mut patch: [usize; 24] = std::array::from_fn(|i| i);
    let mut join = |a: usize, b: usize| {
        let (low, high) = (patch[a].min(patch[b]), patch[a].max(patch[b]));
        patch.iter_mut().filter(|p| **p == high).for_each(|p| *p = low);
    };
    for f in 0..3 {
        let (u, v) = ((f + 1) % 3, (f + 2) % 3);
        for side in 0..2 {
            let corner = |i: usize, j: usize| side << f | i << u | j << v;
            let edges = [edge(u, corner(0, 0)), edge(u, corner(0, 1)), edge(v, corner(0, 0)), edge(v, corner(1, 0))];
            let crossed: Vec<usize> =
                edges.into_iter().filter(|e| inside[e % 8] != inside[(e % 8) | (1 << (e / 8))]).collect();
            if let [a, b] = crossed[..] {
                join(a, b);
            } else if crossed.len() == 4 {
                // Both neighbouring cells see the same four corners, so cutting off the inner ones is consistent.
                for (i, j) in [(0, 0), (0, 1), (1, 0), (1, 1)] {
                    if inside[corner(i, j)] {
                        join(edge(u, corner(0, j)), edge(v, corner(i, 0)));
                    }
                }
            }
        }
    }
    patch
}

/// Adds a quad, split along the diagonal whose two triangles agree better with the surface normals.
fn split_well(out: &mut MeshBuilder, [a, b, c, d]: [u32; 4]) {
    let agreement = |t: [u32; 3]| {
        let [p, q, r] = t.map(|i| out.positions[i as usize]);
        let face = (q - p).cross(r - p).normalize_or_zero();
        t.map(|i| out.normals[i as usize]).into_iter().sum::<DVec3>().dot(face)
    };
    let one = agreement([a, b, c]).min(agreement([a, c, d]));
    let other = agreement([b, c, d]).min(agreement([b, d, a]));
    if one >= other { out.quad(a, b, c, d) } else { out.quad(b, c, d, a) }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn half_turns_map_the_field_onto_itself_and_the_parts_close() {
        let quarter = quarter();
        let mut edges: BTreeMap<_, i32> = BTreeMap::new();
        let mut corners = std::collections::BTreeSet::new();
        let mut triangles = 0i64;
        for turn in [dvec3(1.0, 1.0, 1.0), dvec3(1.0, -1.0, -1.0), dvec3(-1.0, 1.0, -1.0), dvec3(-1.0, -1.0, 1.0)] {
            let key = |i: u32| (quarter.positions[i as usize] * turn * 1e7).round().to_array().map(|x| x as i64);
            for t in quarter.indices.chunks_exact(3) {
                triangles += 1;
                for k in 0..3 {
                    let (a, b) = (key(t[k]), key(t[(k + 1) % 3]));
                    corners.insert(a);
                    *edges.entry((a, b)).or_default() += 1;
                    *edges.entry((b, a)).or_default() -= 1;
                }
            }
        }
        assert_eq!(edges.values().filter(|n| **n != 0).count(), 0, "the four quarters do not close");
        // Euler: corners - edges + faces = 2 (parts - genus).
        let euler = corners.len() as i64 - edges.len() as i64 / 2 + triangles;
        assert!(euler < -200, "only {euler}: the ball should be full of holes");
    }
}
