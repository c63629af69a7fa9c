//! Mirror of the passes that find the casters' silhouettes as seen from a light: facing, silhouettes, multiplicities.
//!
//! Facing is one sign per triangle, from the plane equation. Edges read only those signs, so two edges of a triangle
//! never disagree about it. The determinant of Kenzel's thesis (eq. 3.1) has the same sign and serves as an
//! independent oracle. It loses precision for small triangles far away, because all rounding errors of a matrix
//! product enter it.

use crate::casters::topology::{Edge, Topology};
use glam::{DMat3, DMat4, DVec3, DVec4, Vec3};

/// Side of a triangle that a light is on.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Facing {
    /// `n . (L.xyz - L.w v0)` with `n = (v1 - v0) x (v2 - v0)`: positive where the light sees the front.
    pub value: f64,
    /// Sum of the absolute values of the terms in `value`; rounding is relative to this. It is not relative to `|n|`,
    /// because a needle's `n` is itself a difference of large products.
    pub size: f64,
}

impl Facing {
    /// Relative rounding error of `value` in double precision, with a margin.
    pub const BAND_F64: f64 = 1.0 / (1u64 << 50) as f64;
    /// Relative rounding error of `value` in single precision, with a margin.
    pub const BAND_F32: f64 = 1.0 / (1 << 20) as f64;

    /// Computes the facing of a triangle; the light is in the triangle's space. `light.w` is 1 for a position and 0
    /// for a direction towards the light.
    pub fn of(corners: [DVec3; 3], light: DVec4) -> Self {
        let (p, q) = (corners[1] - corners[0], corners[2] - corners[0]);
        let l = light.truncate() - light.w * corners[0];
        let l_size = light.truncate().abs() + light.w * corners[0].abs();
        let (a, b) = (p.abs(), q.abs());
        let n_size = DVec3::new(a.y * b.z + a.z * b.y, a.z * b.x + a.x * b.z, a.x * b.y + a.y * b.x);
        Self { value: p.cross(q).dot(l), size: n_size.dot(l_size) }
    }

    /// Returns whether rounding relative to `band` may have changed the sign.
    pub fn is_doubtful(&self, band: f64) -> bool {
        self.value.abs() <= band * self.size
    }

    /// Returns `1` if the triangle faces the light or is edge-on to it, and `-1` if it faces away. For an edge-on
    /// triangle either sign is right, as long as all its edges read the same one.
    pub fn sign(&self) -> i32 {
        if self.value < 0.0 && !self.is_doubtful(Self::BAND_F64) { -1 } else { 1 }
    }
}

/// Computes [`Facing::of`] every triangle of a mesh, with the light in object space.
pub fn facing(topology: &Topology, positions: &[[f32; 3]], light: DVec4) -> Vec<Facing> {
    let at = |v: u32| Vec3::from(positions[v as usize]).as_dvec3();
    topology.triangles.iter().map(|t| Facing::of(t.map(at), light)).collect()
}

/// Evaluates the thesis's test: the determinant of the corners' `(x, y, w)` in the light's clip space. Its sign is
/// corrected to be positive where the light, given as `light` in the corners' space, sees the front. Up to a factor,
/// the light is the only point that the rows `x, y, w` of its matrix map to 0; the correction is that factor's sign.
pub fn determinant(corners: [DVec3; 3], light_clip_from_object: &DMat4, light: DVec4) -> f64 {
    let m = light_clip_from_object;
    let columns = m.to_cols_array_2d().map(|c| DVec3::new(c[0], c[1], c[3]));
    let without = |k: usize| {
        let rest: [usize; 3] = std::array::from_fn(|i| if i < k { i } else { i + 1 });
        DMat3::from_cols(columns[rest[0]], columns[rest[1]], columns[rest[2]]).determinant()
    };
    let null = DVec4::new(-without(0), without(1), -without(2), without(3));
    let p = corners.map(|v| columns[0] * v.x + columns[1] * v.y + columns[2] * v.z + columns[3]);
    -DMat3::from_cols(p[0], p[1], p[2]).determinant() * null.dot(light).signum()
}

/// Returns the side of the line `v0 -> v1` on which a face lies as seen from the light: `1` or `-1`.
pub fn side(face: u32, sigma: &[i32]) -> i32 {
    sigma[(face & !Edge::REVERSED) as usize] * if face & Edge::REVERSED == 0 { 1 } else { -1 }
}

/// Returns how many more faces lie on one side of `v0 -> v1` than on the other. That many copies of the edge's side
/// close the volumes of all its triangles; negative if they run from `v1` to `v0`. See Kim, Kim and Turk (2008).
pub fn multiplicity(topology: &Topology, edge: &Edge, sigma: &[i32]) -> i32 {
    topology.faces(edge).iter().map(|&f| side(f, sigma)).sum()
}

/// Returns whether the surface ends at the edge as seen from the light: all its faces lie on one side.
pub fn is_outline(topology: &Topology, edge: &Edge, sigma: &[i32]) -> bool {
    let faces = topology.faces(edge);
    faces.iter().all(|&f| side(f, sigma) == side(faces[0], sigma))
}

fn face_beside(topology: &Topology, edge: &Edge, sigma: &[i32]) -> u32 {
    let faces = topology.faces(edge);
    let triangle = |f: &u32| f & !Edge::REVERSED;
    let towards = faces.iter().map(triangle).rfind(|&t| sigma[t as usize] > 0);
    towards.unwrap_or(triangle(&faces[0]))
}

/// Edge that a technique draws or a volume needs.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct SilhouetteEdge {
    /// Ends, ordered so that the occluder lies on the same side of `ends[0] -> ends[1]` for every edge.
    pub ends: [u32; 2],
    /// `|multiplicity|`, halved where only front faces count ([`Topology::closed`]).
    pub weight: u32,
    /// `true` if the edge has only one face.
    pub boundary: bool,
    /// Result of [`is_outline`]; if `false`, only volumes need the edge.
    pub outline: bool,
    /// Triangle beside the edge: the last one that faces the light, if any does.
    pub face: u32,
}

/// Returns all edges with a nonzero multiplicity, in the topology's order. With `front_only`, weights count the front
/// faces of a closed mesh instead of all triangles.
pub fn silhouettes(topology: &Topology, sigma: &[i32], front_only: bool) -> Vec<SilhouetteEdge> {
    let found = |e: &Edge| {
        let m = multiplicity(topology, e, sigma);
        (m != 0).then(|| SilhouetteEdge {
            ends: if m > 0 { [e.v0, e.v1] } else { [e.v1, e.v0] },
            weight: m.unsigned_abs() / if front_only { 2 } else { 1 },
            boundary: e.faces[1] == Edge::BOUNDARY,
            outline: is_outline(topology, e, sigma),
            face: face_beside(topology, e, sigma),
        })
    };
    topology.edges.iter().filter_map(found).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::casters::shapes::{Random, Shape, cube, moebius, moved, pages, soup, sphere, tube, two_sided_quad};
    use glam::{DAffine3, dvec3};

    fn sigma(t: &Topology, positions: &[[f32; 3]], light: DVec4) -> Vec<i32> {
        facing(t, positions, light).iter().map(Facing::sign).collect()
    }

    fn seen((positions, indices): &Shape, light: DVec4) -> (Topology, Vec<SilhouetteEdge>) {
        let t = Topology::new(positions, indices).unwrap();
        let s = silhouettes(&t, &sigma(&t, positions, light), t.closed);
        (t, s)
    }

    fn random_point(random: &mut Random, size: f64) -> DVec3 {
        size * DVec3::from_array([0; 3].map(|_| random.signed()))
    }

    #[test]
    fn known_shapes() {
        // Seen along a diagonal, a cube is a hexagon; seen along an axis, a square.
        for (light, edges) in [(DVec4::new(5.0, 6.0, 7.0, 1.0), 6), (DVec4::new(0.1, 5.0, 0.2, 1.0), 4)] {
            for light in [light, light.truncate().normalize().extend(0.0)] {
                let (_, s) = seen(&cube(), light);
                let light_w = light.w;
                if light_w == 1.0 || edges == 6 {
                    assert_eq!(s.len(), edges, "{light}");
                }
                assert!(s.iter().all(|e| e.weight == 1 && e.outline && !e.boundary));
            }
        }
        // From above, a sheet shows only its border; each side of the sheet counts once.
        let up = DVec4::new(0.3, 4.0, 0.1, 1.0);
        let (_, s) = seen(&two_sided_quad(), up);
        assert_eq!(s.len(), 4);
        assert!(s.iter().all(|e| e.weight == 2 && e.outline));
        // Pages: the spine has faces on both sides, so it is no outline.
        let (t, s) = seen(&pages(), DVec4::new(0.0, 0.2, 9.0, 1.0));
        let spine = t.edges.iter().find(|e| e.faces[1] == Edge::NON_MANIFOLD).unwrap();
        assert!(s.iter().all(|e| !e.outline || e.ends != [spine.v0, spine.v1] && e.ends != [spine.v1, spine.v0]));
        assert!(s.iter().any(|e| e.weight == 1 && !e.outline), "three faces, two to one side");
        assert_eq!(s.iter().filter(|e| e.boundary).count(), 6);
        // All of a tube's rims are silhouettes, wherever the light is.
        let (_, s) = seen(&tube(16), DVec4::new(9.0, 1.0, 2.0, 1.0));
        assert_eq!(s.iter().filter(|e| e.boundary && e.outline && e.weight == 1).count(), 32);
        assert!(s.iter().any(|e| !e.boundary && e.weight == 2));
    }

    /// The occluder (here the shape's middle) lies on the same side of every edge, seen from the light.
    #[test]
    fn edges_run_around_the_occluder() {
        let mut random = Random(3);
        for shape in [cube(), sphere(1), two_sided_quad()] {
            for _ in 0..50 {
                let light = random_point(&mut random, 1.0).normalize() * 4.0;
                if light.y.abs() < 0.5 {
                    continue;
                }
                let (_, s) = seen(&shape, light.extend(1.0));
                assert!(!s.is_empty());
                for e in &s {
                    let [a, b] = e.ends.map(|v| Vec3::from(shape.0[v as usize]).as_dvec3() - light);
                    // The outward normal of the side a, a_inf, b, b_inf; the shapes surround the origin.
                    assert!(a.cross(b).dot(DVec3::ZERO - light) < 0.0);
                }
            }
        }
    }

    #[test]
    fn winding_does_not_matter_for_outlines() {
        let mut random = Random(5);
        for shape in [cube(), sphere(1), tube(7), moebius(8), soup(30, 60, 2)] {
            let light = random_point(&mut random, 5.0).extend(1.0);
            let shuffled: Vec<u32> = (shape.1.chunks_exact(3))
                .flat_map(|t| if random.below(2) == 0 { [t[0], t[1], t[2]] } else { [t[0], t[2], t[1]] })
                .collect();
            let count = |indices: &[u32]| {
                let t = Topology::new(&shape.0, indices).unwrap();
                let s = silhouettes(&t, &sigma(&t, &shape.0, light), false);
                s.iter().map(|e| (e.ends, e.weight, e.outline)).collect::<Vec<_>>()
            };
            // Reversed duplicates count as two triangles, so only shapes without duplicates can be compared.
            if Topology::new(&shape.0, &shape.1).unwrap().notes.duplicate == 0 {
                assert_eq!(count(&shape.1), count(&shuffled));
            }
        }
    }

    #[test]
    fn a_closed_mesh_has_an_even_number_of_silhouettes_at_every_vertex() {
        let bumpy = moved(sphere(3), |p| p.map(|x| x * (1.0 + 0.4 * (9.0 * p[0]).sin() * (7.0 * p[1]).cos())));
        let mut random = Random(1);
        let mut more_than_two = 0;
        for _ in 0..100 {
            let (_, s) = seen(&bumpy, (4.0 * random_point(&mut random, 1.0)).extend(1.0));
            let mut degree = vec![0u32; bumpy.0.len()];
            s.iter().flat_map(|e| e.ends).for_each(|v| degree[v as usize] += 1);
            assert!(degree.iter().all(|d| d % 2 == 0));
            more_than_two += degree.iter().filter(|&&d| d > 2).count();
        }
        assert!(more_than_two > 0, "a bumpy shape has crossings, or this tests nothing");
    }

    #[test]
    fn plane_and_determinant_agree() {
        let mut random = Random(9);
        let (mut doubtful, mut fronts) = (0, 0);
        let n = 1_000_000;
        for i in 0..n {
            let corners = [0; 3].map(|_| random_point(&mut random, 1.0));
            let look = random_point(&mut random, 1.0).normalize();
            let position = 3.0 * random_point(&mut random, 1.0);
            let side = look.any_orthonormal_vector();
            let rigid = DAffine3::from_mat3_translation(DMat3::from_cols(side, look.cross(side), look), position);
            let flip = if i % 3 == 0 { -1.0 } else { 1.0 };
            let perspective = i % 2 == 0;
            let projection = match perspective {
                true => DMat4::from_cols_array_2d(&[
                    [flip, 0.0, 0.0, 0.0],
                    [0.0, 2.0, 0.0, 0.0],
                    [0.0, 0.0, 0.3, -1.0],
                    [0.0, 0.0, 1.0, 0.0],
                ]),
                false => DMat4::from_cols_array_2d(&[
                    [flip, 0.0, 0.0, 0.0],
                    [0.0, 2.0, 0.0, 0.0],
                    [0.0, 0.0, 0.3, 0.0],
                    [0.0, 0.0, 1.0, 1.0],
                ]),
            };
            let light = if perspective { position.extend(1.0) } else { look.extend(0.0) };
            let plane = Facing::of(corners, light);
            let det = determinant(corners, &(projection * DMat4::from(rigid.inverse())), light);
            if plane.is_doubtful(1e-12) {
                doubtful += 1;
                continue;
            }
            assert_eq!(plane.value > 0.0, det > 0.0, "{corners:?} {light}: {plane:?}, {det}");
            fronts += u32::from(det > 0.0);
        }
        println!("{n} triangles: {fronts} fronts, {doubtful} within the band");
        assert!(doubtful < n / 1000 && (400_000..600_000).contains(&fronts));
    }

    #[test]
    fn edge_on_is_front() {
        let flat = [dvec3(0.0, 0.0, 0.0), dvec3(1.0, 0.0, 0.0), dvec3(0.0, 0.0, 1.0)];
        let f = Facing::of(flat, DVec4::new(5.0, 0.0, 3.0, 1.0));
        assert!(f.is_doubtful(Facing::BAND_F64) && f.sign() == 1);
        assert_eq!(Facing::of(flat, DVec4::new(5.0, 1e-3, 3.0, 1.0)).sign(), -1);
        assert_eq!(Facing::of(flat, DVec4::new(0.0, -1.0, 0.0, 0.0)).sign(), 1);
        // Collinear corners have no side.
        let line = [dvec3(0.1, 0.2, 0.3), dvec3(0.2, 0.4, 0.6), dvec3(0.4, 0.8, 1.2)];
        assert_eq!(Facing::of(line, DVec4::new(5.0, 1.0, 3.0, 1.0)).sign(), 1);
    }
}
