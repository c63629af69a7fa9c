//! Adjacency of triangles over their edges.

use super::triangle::Triangle;
use rayon::prelude::*;

/// Neighbour across each edge `(k, k + 1)` of every triangle slot.
#[derive(Debug)]
pub(super) struct Edges {
    neighbours: Vec<[u32; 3]>,
}

/// Marks an edge with one triangle, or with more than two.
const BORDER: u32 = u32::MAX;

/// One side of an edge; sorting brings both sides together.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
struct HalfEdge {
    /// Hashes of both end positions, the smaller first.
    key: [u64; 2],
    slot: u32,
    edge: u32,
}

impl Edges {
    /// Finds the neighbours. Corners are the same if all bits of their positions are.
    pub fn build(triangles: &[Triangle]) -> Self {
        let mut half_edges: Vec<HalfEdge> = triangles
            .par_iter()
            .enumerate()
            .flat_map_iter(|(slot, t)| {
                let hashes = t.v.map(|v| hash(&v));
                (0..3).map(move |k| {
                    let (a, b) = (hashes[k], hashes[(k + 1) % 3]);
                    HalfEdge { key: [a.min(b), a.max(b)], slot: slot as u32, edge: k as u32 }
                })
            })
            .collect();
        half_edges.par_sort_unstable();
        let mut neighbours = vec![[BORDER; 3]; triangles.len()];
        for run in half_edges.chunk_by(|a, b| a.key == b.key) {
            let [a, b] = run else { continue };
            // Hashes may collide; the positions decide.
            if same_ends(triangles, a, b) {
                neighbours[a.slot as usize][a.edge as usize] = b.slot << 2 | b.edge;
                neighbours[b.slot as usize][b.edge as usize] = a.slot << 2 | a.edge;
            }
        }
        Self { neighbours }
    }

    /// Returns the corner opposite to edge `k` in the other triangle of that edge: that triangle's slot and the
    /// corner's number in it. Returns `None` for an edge with one triangle or more than two.
    pub fn across(&self, slot: usize, k: usize) -> Option<(usize, usize)> {
        let code = self.neighbours[slot][k];
        (code != BORDER).then(|| ((code >> 2) as usize, ((code & 3) as usize + 2) % 3))
    }

    /// Returns the number of bytes held on the heap.
    pub fn bytes(&self) -> usize {
        self.neighbours.len() * size_of::<[u32; 3]>()
    }
}

fn same_ends(triangles: &[Triangle], a: &HalfEdge, b: &HalfEdge) -> bool {
    let ends = |h: &HalfEdge| {
        let v = &triangles[h.slot as usize].v;
        [v[h.edge as usize], v[(h.edge as usize + 1) % 3]]
    };
    let ([a0, a1], [b0, b1]) = (ends(a), ends(b));
    a0 == b1 && a1 == b0 || a0 == b0 && a1 == b1
}

fn hash(v: &[f64; 3]) -> u64 {
    // Adding 0.0 turns -0 into 0.
    v.iter().fold(0, |h, x| crate::sampling::mix(h ^ (x + 0.0).to_bits()))
}
