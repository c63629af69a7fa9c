//! A bowl of stones: rounded, irregular, each resting on others, in a curved receiver.

use super::kit::{PI, Rng, Stage, TAU, circle, rotation, sin};
use super::mesh_builder::{MeshBuilder, floor, lathe_shaped};
use super::texture;
use edgeshade::scene::Scene;
use glam::{DAffine3, DMat3, DVec2, DVec3, dvec2, dvec3};

/// Radius of the bowl's rim and the height of its inside at the middle.
const RIM: f64 = 1.7;
const FLOOR: f64 = 0.14;
/// Columns of a height field that covers the square `|x|, |z| <= REACH`.
const COLUMNS: usize = 160;
const REACH: f64 = 2.6;
const KINDS: usize = 12;

pub(super) fn stage() -> Scene {
    let mut stage = Stage::new("stones");
    let grain = stage.texture(texture::speckle());
    let cloth = stage.textured("table", 0xb7ad9b, grain);
    let glaze = stage.paint("glaze", 0xdcd6c6);
    let shades = [0x8d8a84, 0xb5aa98, 0x6f7479, 0xc4b9a4, 0x9c7f69, 0x7e8577].map(|hex| stage.paint("stone", hex));

    let map = |p: DVec3, _| dvec2(p.x, p.z) * 0.3;
    stage.add("table", &floor(40.0, 32.0, 1, 1).map_uv(map), cloth);
    stage.add("bowl", &bowl(), glaze);

    let mut rng = Rng(365);
    let kinds: [MeshBuilder; KINDS] = std::array::from_fn(|_| stone(&mut rng));
    let meshes: Vec<usize> =
        kinds.iter().enumerate().map(|(i, shape)| stage.mesh("stone", shape, shades[i % shades.len()])).collect();
    let mut pile = Pile::new(|p| {
        let r = p.length();
        if r < RIM {
            inside(r)
        } else if r < RIM + 0.12 {
            2.0
        } else {
            // The lowest point of a stone may lie between two columns.
            0.002
        }
    });
    // Large stones come first, small ones fill the gaps; the last few lie beside the bowl. Each takes the lowest of many
    // places.
    for i in 0..118 {
        let kind = i % KINDS;
        let size = 0.3 - 0.14 * (i as f64 / 104.0).min(1.0) + rng.spread(0.04);
        let around = |rng: &mut Rng| {
            if i < 104 {
                within(rng, RIM - 0.28)
            } else {
                loop {
                    let p = dvec2(rng.range(-2.4, 2.4), rng.range(-0.6, 2.4));
                    if p.length() > RIM + 0.3 {
                        break p;
                    }
                }
            }
        };
        let mut best: Option<(f64, DAffine3)> = None;
        for _ in 0..160 {
            let axis = dvec3(rng.spread(1.0), rng.spread(1.0) + 2.0, rng.spread(1.0));
            let turn = rotation(axis, rng.range(0.0, TAU)) * DMat3::from_diagonal(DVec3::splat(size));
            let p = around(&mut rng);
            let y = pile.rest(&kinds[kind], turn, p);
            if best.is_none_or(|(low, _)| y < low) {
                best = Some((y, DAffine3 { matrix3: turn, translation: dvec3(p.x, y, p.y) }));
            }
        }
        if let Some((_, place)) = best {
            pile.put(&kinds[kind], place);
            stage.place(meshes[kind], place);
        }
    }

    stage.camera([0.9, 3.8, 4.0], [-0.05, 0.36, 0.2], 40.0);
    stage.spot([-7.9, 6.4, -1.6], [0.2, 0.2, 0.0], 42.0, 0.22, 0xfff0dc);
    stage.scene
}

fn within(rng: &mut Rng, radius: f64) -> DVec2 {
    loop {
        let p = dvec2(rng.spread(radius), rng.spread(radius));
        if p.length() < radius {
            return p;
        }
    }
}

/// Height of the bowl's inside at a distance from its axis.
fn inside(r: f64) -> f64 {
    let t = (r / RIM) * (r / RIM);
    FLOOR + 0.78 * t + 0.2 * t * t * t * t
}

/// A wide bowl on a foot, its rim slightly uneven.
fn bowl() -> MeshBuilder {
    let mut profile = vec![(0.0, 0.0), (0.75, 0.0), (0.78, 0.02), (0.74, 0.1)];
    profile.extend((5..=20).map(|i| {
        let r = (RIM + 0.06) * i as f64 / 20.0;
        if i == 20 { (r, inside(RIM) - 0.04) } else { (r, inside(r) - 0.13) }
    }));
    profile.extend((1..6).map(|i| {
        let (c, s) = circle(PI * i as f64 / 6.0);
        (RIM + 0.03 + 0.03 * c, inside(RIM) - 0.01 + 0.05 * s)
    }));
    profile.extend((0..=28).rev().map(|i| {
        let r = RIM * i as f64 / 28.0;
        (r, inside(r))
    }));
    lathe_shaped(&profile, 96, |a, r| r * (1.0 + 0.006 * sin(5.0 * a)))
}

/// A rounded stone of about unit radius: a polyhedron of random planes with soft edges.
fn stone(rng: &mut Rng) -> MeshBuilder {
    let stretch = dvec3(rng.range(0.85, 1.25), rng.range(0.62, 0.85), rng.range(0.85, 1.1));
    let planes: Vec<(DVec3, f64)> = (0..16)
        .map(|_| {
            let n = loop {
                let n = dvec3(rng.spread(1.0), rng.spread(1.0), rng.spread(1.0));
                if (0.2..1.0).contains(&n.length()) {
                    break n.normalize();
                }
            };
            (n, rng.range(0.72, 1.0))
        })
        .collect();
    let sharpness = rng.range(5.0, 9.0);
    // The largest of the planes' terms, smoothed; the last term is a sphere that closes what they leave open.
    let point = |d: DVec3| {
        let term = |x: f64| libm::pow(x.max(0.0), sharpness);
        let sum: f64 = planes.iter().map(|&(n, h)| term(d.dot(n) / h)).sum::<f64>() + term(0.9);
        d * libm::pow(sum, -1.0 / sharpness) * stretch
    };
    let (segments, rings) = (20, 11);
    let mut out = MeshBuilder::new();
    let mut add = |p: DVec3| out.vertex(p, DVec3::ZERO, DVec2::ZERO);
    let south = add(point(DVec3::NEG_Y));
    let mut rows = Vec::new();
    for j in 1..rings {
        let (cj, sj) = circle(PI * j as f64 / rings as f64);
        rows.push(
            (0..segments)
                .map(|i| {
                    let (c, s) = circle(TAU * i as f64 / segments as f64);
                    add(point(dvec3(sj * c, -cj, -sj * s)))
                })
                .collect::<Vec<u32>>(),
        );
    }
    let north = add(point(DVec3::Y));
    for i in 0..segments {
        let k = (i + 1) % segments;
        out.triangle(south, rows[0][k], rows[0][i]);
        out.triangle(north, rows[rings - 2][i], rows[rings - 2][k]);
        for w in rows.windows(2) {
            out.quad(w[0][i], w[0][k], w[1][k], w[1][i]);
        }
    }
    for t in out.indices.chunks_exact(3) {
        let [a, b, c] = [t[0], t[1], t[2]].map(|i| out.positions[i as usize]);
        let face = (b - a).cross(c - a);
        for &i in t {
            out.normals[i as usize] += face;
        }
    }
    for n in &mut out.normals {
        *n = n.normalize();
    }
    out
}

/// Heights of what lies in the bowl so far, seen from above.
struct Pile {
    heights: Vec<f64>,
}

impl Pile {
    fn new(height: impl Fn(DVec2) -> f64) -> Self {
        Self { heights: (0..COLUMNS * COLUMNS).map(|i| height(column(i))).collect() }
    }

    /// Height of a stone's origin at which the stone, let down at `p`, first touches something.
    fn rest(&self, shape: &MeshBuilder, turn: DMat3, p: DVec2) -> f64 {
        let place = DAffine3 { matrix3: turn, translation: dvec3(p.x, 0.0, p.y) };
        let mut y = f64::NEG_INFINITY;
        covered(shape, place, false, |i, low| y = y.max(self.heights[i] - low));
        y
    }

    fn put(&mut self, shape: &MeshBuilder, place: DAffine3) {
        covered(shape, place, true, |i, high| self.heights[i] = self.heights[i].max(high));
    }
}

/// Middle of a column.
fn column(i: usize) -> DVec2 {
    let at = |k: usize| REACH * (2.0 * (k as f64 + 0.5) / COLUMNS as f64 - 1.0);
    dvec2(at(i % COLUMNS), at(i / COLUMNS))
}

/// Calls `f` with each column that a stone covers and the height there of the stone's upper or lower side.
fn covered(shape: &MeshBuilder, place: DAffine3, upper: bool, mut f: impl FnMut(usize, f64)) {
    let index = |x: f64| ((x / REACH + 1.0) * 0.5 * COLUMNS as f64 - 0.5).clamp(0.0, COLUMNS as f64 - 1.0);
    for t in shape.indices.chunks_exact(3) {
        let [a, b, c] = [t[0], t[1], t[2]].map(|i| place.transform_point3(shape.positions[i as usize]));
        let area = (b - a).cross(c - a).y;
        if area == 0.0 || (area > 0.0) != upper {
            continue;
        }
        let (low, high) = (a.min(b).min(c), a.max(b).max(c));
        for row in index(low.z).ceil() as usize..=index(high.z).floor() as usize {
            for line in index(low.x).ceil() as usize..=index(high.x).floor() as usize {
                let i = row * COLUMNS + line;
                let q = column(i);
                let p = dvec3(q.x, 0.0, q.y);
                // Shares of the three corners at the column.
                let share = |u: DVec3, v: DVec3| (u - p).cross(v - p).y / area;
                let (s, t, u) = (share(b, c), share(c, a), share(a, b));
                if s >= 0.0 && t >= 0.0 && u >= 0.0 {
                    f(i, s * a.y + t * b.y + u * c.y);
                }
            }
        }
    }
}
