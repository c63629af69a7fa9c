//! Small meshes for tests.

use std::collections::HashMap;

/// Positions, and three indices per triangle.
pub(crate) type Shape = (Vec<[f32; 3]>, Vec<u32>);

/// Returns a cube of half size 1 with 24 vertices, facing outward. Each face's two triangles are consecutive.
pub(crate) fn cube() -> Shape {
    let (mut positions, mut indices) = (vec![], vec![]);
    for axis in 0..3 {
        for sign in [-1.0f32, 1.0] {
            let first = positions.len() as u32;
            for [u, v] in [[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0f32]] {
                let mut p = [0.0; 3];
                p[axis] = sign;
                p[(axis + 1) % 3] = u;
                p[(axis + 2) % 3] = v;
                positions.push(p);
            }
            let quad = if sign > 0.0 { [0, 1, 2, 0, 2, 3] } else { [0, 2, 1, 0, 3, 2] };
            indices.extend(quad.map(|k| first + k));
        }
    }
    (positions, indices)
}

pub(crate) fn tetrahedron() -> Shape {
    let positions = vec![[1.0, 1.0, 1.0], [1.0, -1.0, -1.0], [-1.0, 1.0, -1.0], [-1.0, -1.0, 1.0]];
    (positions, vec![0, 1, 2, 0, 3, 1, 0, 2, 3, 1, 3, 2])
}

/// Returns an octahedron, subdivided `levels` times and projected to the unit sphere: `8 * 4^levels` triangles.
pub(crate) fn sphere(levels: u32) -> Shape {
    let mut positions: Vec<[f32; 3]> =
        vec![[1.0, 0.0, 0.0], [-1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, -1.0, 0.0], [0.0, 0.0, 1.0], [0.0, 0.0, -1.0]];
    let mut indices = vec![0, 2, 4, 2, 1, 4, 1, 3, 4, 3, 0, 4, 2, 0, 5, 1, 2, 5, 3, 1, 5, 0, 3, 5];
    for _ in 0..levels {
        let mut middles = HashMap::new();
        let mut split = vec![];
        for t in indices.chunks_exact(3) {
            let m = [0, 1, 2].map(|k| {
                let (a, b) = (t[k], t[(k + 1) % 3]);
                *middles.entry((a.min(b), a.max(b))).or_insert_with(|| {
                    let [p, q] = [a.min(b), a.max(b)].map(|v: u32| glam::Vec3::from(positions[v as usize]));
                    positions.push((p + q).normalize().to_array());
                    positions.len() as u32 - 1
                })
            });
            split.extend([t[0], m[0], m[2], m[0], t[1], m[1], m[2], m[1], t[2], m[0], m[1], m[2]]);
        }
        indices = split;
    }
    (positions, indices)
}

/// Returns a tube without caps, with `n` sides.
pub(crate) fn tube(n: u32) -> Shape {
    band(n, false)
}

/// Returns a Moebius strip: a band with half a turn, one side and one border.
pub(crate) fn moebius(n: u32) -> Shape {
    band(n, true)
}

fn band(n: u32, twisted: bool) -> Shape {
    let mut positions = vec![];
    for i in 0..n {
        let angle = std::f32::consts::TAU * i as f32 / n as f32;
        let turn = if twisted { 0.5 * angle } else { std::f32::consts::FRAC_PI_2 };
        for side in [-1.0f32, 1.0] {
            let r = 2.0 + side * turn.cos() * 0.5;
            positions.push([r * angle.cos(), r * angle.sin(), side * turn.sin() * 0.5]);
        }
    }
    let mut indices = vec![];
    for i in 0..n {
        let j = (i + 1) % n;
        let flip = u32::from(twisted && j == 0);
        let (a, b, c, d) = (2 * i, 2 * i + 1, 2 * j + flip, 2 * j + 1 - flip);
        indices.extend([a, c, b, b, c, d]);
    }
    (positions, indices)
}

/// Returns three sheets that share one edge.
pub(crate) fn pages() -> Shape {
    let positions = vec![[0.0, 0.0, 0.0], [0.0, 1.0, 0.0], [1.0, 0.0, 0.0], [-1.0, 0.0, 1.0], [-1.0, 0.0, -1.0]];
    (positions, vec![0, 1, 2, 0, 1, 3, 0, 1, 4])
}

/// Returns a quad together with its reverse side.
pub(crate) fn two_sided_quad() -> Shape {
    let positions = vec![[-1.0, 0.0, -1.0], [1.0, 0.0, -1.0], [1.0, 0.0, 1.0], [-1.0, 0.0, 1.0]];
    (positions, vec![0, 1, 2, 0, 2, 3, 0, 2, 1, 0, 3, 2])
}

/// Returns both shapes as one mesh; vertices are shared only where they coincide.
pub(crate) fn joined(a: Shape, b: Shape) -> Shape {
    let (mut positions, mut indices) = a;
    let first = positions.len() as u32;
    positions.extend(b.0);
    indices.extend(b.1.iter().map(|i| first + i));
    (positions, indices)
}

/// Returns the shape with its positions mapped by `f`.
pub(crate) fn moved((positions, indices): Shape, f: impl Fn([f32; 3]) -> [f32; 3]) -> Shape {
    (positions.into_iter().map(f).collect(), indices)
}

/// Random numbers for tests, by SplitMix64.
pub(crate) struct Random(pub u64);

impl Random {
    pub fn next(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9E37_79B9_7F4A_7C15);
        let mut z = self.0;
        z = (z ^ z >> 30).wrapping_mul(0xBF58_476D_1CE4_E5B9);
        z = (z ^ z >> 27).wrapping_mul(0x94D0_49BB_1331_11EB);
        z ^ z >> 31
    }

    /// Returns a number in `0..n`.
    pub fn below(&mut self, n: u32) -> u32 {
        (self.next() % u64::from(n)) as u32
    }

    /// Returns a number in `[-1, 1)`.
    pub fn signed(&mut self) -> f64 {
        (self.next() >> 11) as f64 / (1u64 << 52) as f64 - 1.0
    }
}

/// Returns triangles over few vertices with random winding. Every edge is a fan, a boundary or inconsistently wound.
pub(crate) fn soup(vertices: u32, triangles: u32, seed: u64) -> Shape {
    let mut random = Random(seed);
    let positions = (0..vertices).map(|_| [0; 3].map(|_| random.signed() as f32)).collect();
    let indices = (0..3 * triangles).map(|_| random.below(vertices)).collect();
    (positions, indices)
}
