use super::*;
use crate::casters::shapes::{
    Random, Shape, cube, joined, moebius, moved, pages, soup, sphere, tetrahedron, tube, two_sided_quad,
};

fn topology((positions, indices): &Shape) -> Topology {
    let t = Topology::new(positions, indices).unwrap();
    is_sound(&t);
    t
}

/// Checks what holds for every result: the order, each triangle once per edge, and symmetric neighbours.
fn is_sound(t: &Topology) {
    assert!(t.edges.is_sorted_by(|a, b| (a.v0, a.v1) < (b.v0, b.v1)));
    assert_eq!(t.neighbours.len(), t.triangles.len());
    let mut seen = vec![[0; 3]; t.triangles.len()];
    for e in &t.edges {
        assert!(e.v0 < e.v1);
        let faces = t.faces(e);
        assert!(!faces.is_empty());
        for &f in faces {
            let triangle = (f & !Edge::REVERSED) as usize;
            let (from, to) = if f & Edge::REVERSED == 0 { (e.v0, e.v1) } else { (e.v1, e.v0) };
            let corners = t.triangles[triangle];
            let k = (0..3).find(|&k| corners[k] == from && corners[(k + 1) % 3] == to).expect("runs through its edge");
            seen[triangle][k] += 1;
            let across = t.neighbours[triangle][k];
            match faces {
                [_] => assert_eq!(across, Topology::NONE),
                [a, b] => assert_eq!(across, if *a == f { *b } else { *a }),
                _ => assert_eq!(across, Topology::FAN),
            }
        }
    }
    assert!(seen.iter().flatten().all(|&n| n == 1), "a triangle has three edges, each once");
}

/// Sums the multiplicities of the edges at every vertex, outgoing minus incoming. All sums are zero, because a boundary
/// has no boundary. `sigma` holds the facing of each triangle, 1 or -1.
fn vertex_sums(t: &Topology, vertices: usize, sigma: &[i32]) -> Vec<i32> {
    let mut sums = vec![0; vertices];
    for e in &t.edges {
        let m: i32 = (t.faces(e).iter())
            .map(|f| sigma[(f & !Edge::REVERSED) as usize] * if f & Edge::REVERSED == 0 { 1 } else { -1 })
            .sum();
        sums[e.v0 as usize] += m;
        sums[e.v1 as usize] -= m;
    }
    sums
}

fn sigmas(n: usize, seed: u64) -> Vec<i32> {
    let mut random = Random(seed);
    (0..n).map(|_| if random.below(2) == 0 { -1 } else { 1 }).collect()
}

fn every_shape() -> Vec<(&'static str, Shape)> {
    let mirrored = moved(cube(), |p| [3.0 - p[0], p[1], p[2]]);
    vec![
        ("cube", cube()),
        ("tetrahedron", tetrahedron()),
        ("sphere", sphere(2)),
        ("tube", tube(12)),
        ("moebius", moebius(9)),
        ("pages", pages()),
        ("two-sided quad", two_sided_quad()),
        ("cube and its mirror image", joined(cube(), mirrored)),
        ("soup", soup(40, 300, 1)),
    ]
}

#[test]
fn counts_of_known_shapes() {
    for (name, shape) in every_shape() {
        let t = topology(&shape);
        println!("{name}: {} triangles, {} edges, {:?}", t.triangles.len(), t.edges.len(), t.notes);
        let clean = CleanUp::default();
        let expected = match name {
            "cube" => (12, 18, true, clean),
            "tetrahedron" => (4, 6, true, clean),
            "sphere" => (128, 192, true, clean),
            "tube" => (24, 48, false, CleanUp { boundary: 24, ..clean }),
            // The strip meets itself twisted at one edge, so both faces run through this edge in the same direction.
            "moebius" => (18, 36, false, CleanUp { boundary: 18, inconsistent: 1, ..clean }),
            "pages" => (3, 7, false, CleanUp { boundary: 6, fans: 1, ..clean }),
            // The border has both sheets; the diagonal has four triangles.
            "two-sided quad" => (4, 5, false, CleanUp { fans: 1, ..clean }),
            "cube and its mirror image" => (24, 36, true, clean),
            _ => continue,
        };
        assert_eq!((t.triangles.len(), t.edges.len(), t.closed, t.notes), expected, "{name}");
        // The mirror image is inside out.
        assert_eq!(t.outward, t.closed && !name.contains("mirror"), "{name}");
    }
    let inverted = (cube().0, cube().1.chunks(3).flat_map(|t| [t[0], t[2], t[1]]).collect());
    let t = topology(&inverted);
    assert!(t.closed && !t.outward);
}

/// Exporters split a mesh by material into ranges of indices with separate vertices.
#[test]
fn a_cube_in_six_ranges_is_one() {
    let (positions, indices) = cube();
    let (mut p, mut i) = (vec![], vec![]);
    for range in indices.chunks_exact(6).rev() {
        for &v in range {
            i.push(p.len() as u32);
            p.push(positions[v as usize]);
        }
    }
    let t = topology(&(p, i));
    assert_eq!((t.triangles.len(), t.edges.len(), t.closed, t.outward), (12, 18, true, true));
}

#[test]
fn welding_takes_the_first_and_both_zeros() {
    let positions =
        vec![[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [-0.0, 0.0, -0.0], [1.0, -0.0, 0.0], [0.0, 0.0, 1.0]];
    let t = topology(&(positions, vec![0, 1, 2, 4, 3, 5]));
    assert_eq!(t.triangles, [[0, 1, 2], [1, 0, 5]]);
    assert_eq!(t.edges[0], Edge { v0: 0, v1: 1, faces: [0, 1 | Edge::REVERSED] });
    // A difference of one bit makes another position.
    let apart = vec![[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [f32::from_bits(1), 0.0, 0.0]];
    assert_eq!(topology(&(apart, vec![0, 1, 2, 1, 3, 2])).notes.boundary, 4);
}

#[test]
fn what_is_dropped_is_counted() {
    let positions = vec![
        [0.0; 3],
        [1.0, 0.0, 0.0],
        [0.0, 1.0, 0.0],
        [f32::NAN, 0.0, 0.0],
        [f32::INFINITY, 0.0, 0.0],
        [2.0, 0.0, 0.0],
    ];
    let indices = [
        [0, 1, 2], // stays
        [1, 2, 0], // the same, turned
        [0, 2, 1], // the other side: stays
        [2, 0, 1], // the first again
        [0, 0, 1], // no triangle
        [0, 1, 3],
        [4, 1, 2], // not finite
        [0, 1, 5], // on a line: stays
    ];
    let t = topology(&(positions, indices.concat()));
    assert_eq!(t.triangles, [[0, 1, 2], [0, 2, 1], [0, 1, 5]]);
    let n = t.notes;
    assert_eq!((n.duplicate, n.degenerate, n.non_finite, n.fans), (2, 1, 2, 1));
}

#[test]
fn multiplicities_cancel_at_every_vertex_for_any_facing() {
    let soups = (0..50).map(|seed| ("soup", soup(5 + seed as u32, 200, seed)));
    for (name, shape) in every_shape().into_iter().chain(soups) {
        let t = topology(&shape);
        for seed in 0..20 {
            let sigma = sigmas(t.triangles.len(), seed);
            assert!(vertex_sums(&t, shape.0.len(), &sigma).iter().all(|&s| s == 0), "{name}");
        }
        // A face reference with the wrong direction is noticed.
        let mut planted = t.clone();
        match planted.edges[0].faces[1] {
            Edge::NON_MANIFOLD => planted.fans[1] ^= Edge::REVERSED,
            _ => planted.edges[0].faces[0] ^= Edge::REVERSED,
        }
        let sigma = sigmas(t.triangles.len(), 1);
        assert!(vertex_sums(&planted, shape.0.len(), &sigma).iter().any(|&s| s != 0), "{name}");
    }
}

#[test]
fn any_number_of_threads_gives_the_same() {
    for (name, (positions, indices)) in every_shape().into_iter().chain([("large soup", soup(3000, 20_000, 7))]) {
        let one = Topology::with_threads(&positions, &indices, 1).unwrap();
        for threads in [2, 3, 7, 64] {
            assert_eq!(one, Topology::with_threads(&positions, &indices, threads).unwrap(), "{name}");
        }
    }
}

#[test]
fn nothing_is_a_mesh_too() {
    let t = topology(&(vec![], vec![]));
    assert!(t.closed && t.edges.is_empty());
    assert_eq!(topology(&(vec![[0.0; 3]], vec![0, 0, 0])).notes.degenerate, 1);
}

#[test]
fn wrong_indices_are_refused() {
    let positions = vec![[0.0; 3]; 3];
    for (indices, says) in [(&[0u32, 1, 2, 0][..], "4 indices"), (&[0, 1, 3], "indices[2] is 3")] {
        let error = Topology::new(&positions, indices).unwrap_err().to_string();
        assert!(error.contains(says), "{error}");
    }
}

/// Builds the adjacency of two spheres of half a million triangles each, with shared and with split vertices, as
/// exporters write them. Prints time and memory.
#[test]
fn a_million_triangles() {
    let (shared, indices) = joined(sphere(8), moved(sphere(8), |p| [p[0] + 3.0, p[1], p[2]]));
    let positions: Vec<[f32; 3]> = indices.iter().map(|&i| shared[i as usize]).collect();
    let split: Vec<u32> = (0..positions.len() as u32).collect();
    for (name, positions, indices) in [("shared", &shared, &indices), ("split", &positions, &split)] {
        for threads in [1, 2, 4] {
            let start = std::time::Instant::now();
            let t = Topology::with_threads(positions, indices, threads).unwrap();
            let ms = 1e3 * start.elapsed().as_secs_f64();
            let (n, e) = (t.triangles.len(), t.edges.len());
            println!("{n} triangles, {name} vertices, {threads} threads: {ms:.0} ms, {} bytes", t.memory_bytes());
            assert_eq!((n, e), (16 << 16, 24 << 16));
            assert!(t.closed && t.outward);
        }
    }
}
