//! Adjacency of a mesh: the triangles that meet at each edge. Silhouettes and shadow volumes are built from it.
//!
//! It is built once per mesh, on all CPU cores, in time linear in the triangles. Half-edges are grouped by their
//! smaller vertex, and each thread groups its own range of vertices. The result is the same for any number of threads.
//!
//! Vertices are merged if all bits of their positions are equal (-0 counts as +0), because attributes split vertices
//! but not surfaces. Nothing else is repaired. Cracks and T-junctions stay boundaries, which every user of the edges
//! can handle.

mod parallel;
#[cfg(test)]
mod tests;

use crate::{Error, Result};
use bytemuck::{Pod, Zeroable};
use glam::{DVec3, Vec3};
use parallel::{Groups, in_threads, share};
use std::sync::atomic::{AtomicU32, Ordering::Relaxed};

/// Edge of a welded mesh with the triangles that meet at it: 16 bytes, as shaders read it.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Pod, Zeroable)]
#[repr(C)]
pub struct Edge {
    /// End with the smaller index.
    pub v0: u32,
    /// Other end.
    pub v1: u32,
    /// Two face references: a triangle's index, with [`Edge::REVERSED`] set if the triangle runs from `v1` to `v0`.
    /// `[_, BOUNDARY]` means one face. `[offset, NON_MANIFOLD]` means three or more faces, listed in
    /// [`Topology::fans`].
    pub faces: [u32; 2],
}

impl Edge {
    /// Bit of a face reference: the triangle runs from `v1` to `v0`.
    pub const REVERSED: u32 = 1 << 31;
    /// Second face of an edge with one face.
    pub const BOUNDARY: u32 = u32::MAX;
    /// Second face of an edge with more than two faces.
    pub const NON_MANIFOLD: u32 = u32::MAX - 1;
}

/// Numbers of triangles and edges that [`Topology::new`] dropped or noticed.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct CleanUp {
    /// Triangles dropped because a corner is not finite.
    pub non_finite: u32,
    /// Triangles dropped because two corners coincide.
    pub degenerate: u32,
    /// Triangles dropped because the same triangle with the same winding exists.
    pub duplicate: u32,
    /// Edges with one face.
    pub boundary: u32,
    /// Edges with two faces that run through them in the same direction.
    pub inconsistent: u32,
    /// Edges with three or more faces.
    pub fans: u32,
}

/// Mesh as triangles over welded vertices, with its edges.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Topology {
    /// Triangles; each corner is the smallest index of a vertex with the same position. Winding and order are those of
    /// the input, without the triangles that [`CleanUp`] counts as dropped.
    pub triangles: Vec<[u32; 3]>,
    /// Edges, sorted by `(v0, v1)`.
    pub edges: Vec<Edge>,
    /// Faces of the edges with more than two faces: for each edge the number of faces, then that many face references,
    /// ordered by triangle.
    pub fans: Vec<u32>,
    /// Face references across the edges (0, 1), (1, 2) and (2, 0) of each triangle; [`Topology::NONE`] or
    /// [`Topology::FAN`] where there is not exactly one.
    pub neighbours: Vec<[u32; 3]>,
    /// `true` if every edge has exactly two faces, with opposite directions.
    pub closed: bool,
    /// `true` if the mesh is closed and every connected shell encloses a volume with the surface's outer side
    /// outwards. From a light outside it, such a mesh shows a front face before any back face, so front faces alone
    /// define its shadow. A shell that intersects itself may still enclose inverted parts.
    pub outward: bool,
    /// Numbers of triangles and edges dropped or noticed.
    pub notes: CleanUp,
}

/// Number of triangles below which a thread costs more than it saves.
const TRIANGLES_A_THREAD: usize = 16_384;

impl Topology {
    /// Mark in [`Topology::neighbours`]: the edge is a boundary.
    pub const NONE: u32 = u32::MAX;
    /// Mark in [`Topology::neighbours`]: more than two faces share the edge.
    pub const FAN: u32 = u32::MAX - 1;
    /// Largest number of triangles in a mesh. It leaves room for two marks, a direction bit and offsets into fans.
    pub const MOST_TRIANGLES: usize = 1 << 29;

    /// Builds the adjacency from object-space positions and three indices per triangle.
    ///
    /// # Errors
    /// Fails with [`Error::Usage`] for an index out of range, a number of indices that is not a multiple of three, or
    /// a mesh too large for 32-bit indices.
    pub fn new(positions: &[[f32; 3]], indices: &[u32]) -> Result<Self> {
        let cores = std::thread::available_parallelism().map_or(1, |n| n.get());
        Self::with_threads(positions, indices, cores.min(indices.len() / 3 / TRIANGLES_A_THREAD).clamp(1, 64))
    }

    fn with_threads(positions: &[[f32; 3]], indices: &[u32], threads: usize) -> Result<Self> {
        check(positions, indices)?;
        let mut notes = CleanUp::default();
        let welded = weld(positions, threads);
        let mut triangles = cleaned(positions, indices, &welded, threads, &mut notes);
        drop(welded);
        drop_duplicates(&mut triangles, positions.len(), threads, &mut notes);
        let mut topology = Self { triangles, notes, ..Self::default() };
        topology.find_edges(positions.len(), threads);
        let n = &topology.notes;
        topology.closed = n.boundary == 0 && n.inconsistent == 0 && n.fans == 0;
        topology.outward = topology.closed && topology.encloses_outward(positions);
        Ok(topology)
    }

    /// Returns the faces of an edge, ordered by triangle.
    pub fn faces<'a>(&'a self, edge: &'a Edge) -> &'a [u32] {
        match edge.faces[1] {
            Edge::BOUNDARY => &edge.faces[..1],
            Edge::NON_MANIFOLD => {
                let offset = edge.faces[0] as usize;
                &self.fans[offset + 1..][..self.fans[offset] as usize]
            }
            _ => &edge.faces,
        }
    }

    /// Returns the size in bytes.
    pub fn memory_bytes(&self) -> u64 {
        let sizes = [
            size_of_val(&self.triangles[..]),
            size_of_val(&self.edges[..]),
            size_of_val(&self.fans[..]),
            size_of_val(&self.neighbours[..]),
        ];
        sizes.iter().sum::<usize>() as u64
    }

    fn find_edges(&mut self, vertices: usize, threads: usize) {
        let triangles = &self.triangles;
        let none = || AtomicU32::new(Self::NONE);
        let neighbours: Vec<[AtomicU32; 3]> = triangles.iter().map(|_| [none(), none(), none()]).collect();
        let parts = in_threads(threads, |thread| {
            let half_edges = || {
                triangles.iter().zip(0u32..).flat_map(|(&[a, b, c], t)| {
                    [(a, b), (b, c), (c, a)].map(|(from, to)| match from < to {
                        true => (from, HalfEdge { v1: to, face: t }),
                        false => (to, HalfEdge { v1: from, face: t | Edge::REVERSED }),
                    })
                })
            };
            let groups = Groups::collect(share(thread, vertices, threads), half_edges);
            EdgePart::new(groups, |face: u32, edge: &Edge, across: u32| {
                // Corner at which the triangle enters the edge.
                let from = if face & Edge::REVERSED == 0 { edge.v0 } else { edge.v1 };
                let t = (face & !Edge::REVERSED) as usize;
                if let Some(k) = triangles[t].iter().position(|&v| v == from) {
                    neighbours[t][k].store(across, Relaxed);
                }
            })
        });
        self.edges.reserve_exact(parts.iter().map(|p| p.edges.len()).sum());
        for part in parts {
            let offset = self.fans.len() as u32;
            self.edges.extend(part.edges.into_iter().map(|mut e| {
                if e.faces[1] == Edge::NON_MANIFOLD {
                    e.faces[0] += offset;
                }
                e
            }));
            self.fans.extend(part.fans);
            self.notes.boundary += part.notes.boundary;
            self.notes.inconsistent += part.notes.inconsistent;
            self.notes.fans += part.notes.fans;
        }
        self.neighbours = neighbours.into_iter().map(|n| n.map(AtomicU32::into_inner)).collect();
    }

    /// Returns whether no connected shell of a closed mesh is inside out.
    fn encloses_outward(&self, positions: &[[f32; 3]]) -> bool {
        let at = |v: u32| Vec3::from(positions[v as usize]).as_dvec3();
        let mut seen = vec![false; self.triangles.len()];
        let mut pending = vec![];
        for first in 0..self.triangles.len() {
            if std::mem::replace(&mut seen[first], true) {
                continue;
            }
            let origin: DVec3 = at(self.triangles[first][0]);
            let (mut volume, mut size) = (0.0, 0.0);
            pending.push(first);
            while let Some(t) = pending.pop() {
                let [a, b, c] = self.triangles[t].map(|v| at(v) - origin);
                let part = a.dot(b.cross(c));
                volume += part;
                size += part.abs();
                for across in self.neighbours[t] {
                    let other = (across & !Edge::REVERSED) as usize;
                    if !std::mem::replace(&mut seen[other], true) {
                        pending.push(other);
                    }
                }
            }
            // A flat shell has no inside; its volume is rounding error.
            if volume < -1e-12 * size {
                return false;
            }
        }
        true
    }
}

fn check(positions: &[[f32; 3]], indices: &[u32]) -> Result<()> {
    let wrong = |problem: String| Err(Error::Usage(format!("caster mesh: {problem}")));
    if !indices.len().is_multiple_of(3) {
        return wrong(format!("{} indices, but every triangle has three", indices.len()));
    }
    if indices.len() / 3 > Topology::MOST_TRIANGLES || u32::try_from(positions.len()).is_err() {
        let (triangles, vertices) = (indices.len() / 3, positions.len());
        return wrong(format!("{triangles} triangles of {vertices} vertices; at most 2^29 and 2^32 - 1, split it"));
    }
    match indices.iter().position(|&i| i as usize >= positions.len()) {
        Some(at) => wrong(format!("indices[{at}] is {}, with {} positions", indices[at], positions.len())),
        None => Ok(()),
    }
}

/// Returns for each vertex the smallest index of a vertex at the same position.
fn weld(positions: &[[f32; 3]], threads: usize) -> Vec<u32> {
    const EMPTY: u32 = u32::MAX;
    // Adding 0.0 turns -0 into 0.
    let key = |i: u32| positions[i as usize].map(|x| (x + 0.0).to_bits());
    let first: Vec<AtomicU32> = positions.iter().map(|_| AtomicU32::new(EMPTY)).collect();
    in_threads(threads, |thread| {
        // Each thread welds the vertices whose hash starts with its number, in ascending order.
        let owner = |h: u64| (((h >> 32) * threads as u64) >> 32) as usize;
        let mine: Vec<u32> = (0..positions.len() as u32).filter(|&i| owner(hash(key(i))) == thread).collect();
        let mask = (2 * mine.len()).next_power_of_two() - 1;
        let mut table = vec![EMPTY; mask + 1];
        for i in mine {
            let key_i = key(i);
            let mut slot = hash(key_i) as usize & mask;
            while table[slot] != EMPTY && key(table[slot]) != key_i {
                slot = (slot + 1) & mask;
            }
            if table[slot] == EMPTY {
                table[slot] = i;
            }
            first[i as usize].store(table[slot], Relaxed);
        }
    });
    first.into_iter().map(AtomicU32::into_inner).collect()
}

fn hash(key: [u32; 3]) -> u64 {
    // Finaliser of SplitMix64, over three words.
    key.iter().fold(0, |h, &x| {
        let mut z = (h ^ u64::from(x)).wrapping_add(0x9E37_79B9_7F4A_7C15);
        z = (z ^ z >> 30).wrapping_mul(0xBF58_476D_1CE4_E5B9);
        z = (z ^ z >> 27).wrapping_mul(0x94D0_49BB_1331_11EB);
        z ^ z >> 31
    })
}

/// Returns the triangles over welded vertices, without invalid ones.
fn cleaned(
    positions: &[[f32; 3]],
    indices: &[u32],
    welded: &[u32],
    threads: usize,
    notes: &mut CleanUp,
) -> Vec<[u32; 3]> {
    let finite = |v: u32| positions[v as usize].iter().all(|x| x.is_finite());
    let parts = in_threads(threads, |thread| {
        let range = share(thread, indices.len() / 3, threads);
        let given = &indices[3 * range.start..3 * range.end];
        let (mut non_finite, mut degenerate) = (0, 0);
        let mut triangles = Vec::with_capacity(given.len() / 3);
        for corners in given.chunks_exact(3) {
            let [a, b, c] = [0, 1, 2].map(|k| welded[corners[k] as usize]);
            if ![a, b, c].into_iter().all(finite) {
                non_finite += 1;
            } else if a == b || b == c || c == a {
                degenerate += 1;
            } else {
                triangles.push([a, b, c]);
            }
        }
        (triangles, non_finite, degenerate)
    });
    for (_, non_finite, degenerate) in &parts {
        notes.non_finite += non_finite;
        notes.degenerate += degenerate;
    }
    let mut triangles = Vec::with_capacity(parts.iter().map(|p| p.0.len()).sum());
    for (part, ..) in parts {
        triangles.extend(part);
    }
    triangles
}

/// Keeps the first of all triangles with the same corners in the same cyclic order.
fn drop_duplicates(triangles: &mut Vec<[u32; 3]>, vertices: usize, threads: usize, notes: &mut CleanUp) {
    let all = &triangles[..];
    let parts = in_threads(threads, |thread| {
        // Triangles are grouped by their smallest corner; the other two corners follow in order.
        let turned = || {
            all.iter().zip(0u32..).map(|(&[a, b, c], t)| match a.min(b).min(c) {
                least if least == a => (a, [b, c, t]),
                least if least == b => (b, [c, a, t]),
                _ => (c, [a, b, t]),
            })
        };
        let mut groups = Groups::collect(share(thread, vertices, threads), turned);
        let mut duplicates = vec![];
        groups.for_each(|_, group| {
            group.sort_unstable();
            for pair in group.windows(2).filter(|p| p[0][..2] == p[1][..2]) {
                duplicates.push(pair[1][2]);
            }
        });
        duplicates
    });
    let mut duplicates: Vec<u32> = parts.concat();
    if duplicates.is_empty() {
        return;
    }
    duplicates.sort_unstable();
    notes.duplicate = duplicates.len() as u32;
    let mut drop = duplicates.iter().peekable();
    let mut t = 0;
    triangles.retain(|_| {
        let keep = drop.next_if(|&&d| d == t).is_none();
        t += 1;
        keep
    });
}

/// Half-edge: a triangle's direction through an edge, without the edge's smaller end.
#[derive(Clone, Copy, Default)]
struct HalfEdge {
    v1: u32,
    face: u32,
}

/// Edges whose smaller end lies in a range of vertices.
struct EdgePart {
    edges: Vec<Edge>,
    /// Fans of this part; offsets in `edges` refer to this list.
    fans: Vec<u32>,
    notes: CleanUp,
}

impl EdgePart {
    /// Builds the edges; for each face of an edge, calls `meet` with the face across.
    fn new(mut groups: Groups<HalfEdge>, meet: impl Fn(u32, &Edge, u32)) -> Self {
        let mut part = Self { edges: vec![], fans: vec![], notes: CleanUp::default() };
        groups.for_each(|v0, group| {
            // A triangle has an edge only once, so the order is total.
            group.sort_unstable_by_key(|h| (h.v1, h.face & !Edge::REVERSED));
            for run in group.chunk_by(|a, b| a.v1 == b.v1) {
                let edge = |faces| Edge { v0, v1: run[0].v1, faces };
                part.edges.push(match run {
                    [one] => {
                        part.notes.boundary += 1;
                        edge([one.face, Edge::BOUNDARY])
                    }
                    [a, b] => {
                        part.notes.inconsistent += u32::from((a.face ^ b.face) & Edge::REVERSED == 0);
                        let e = edge([a.face, b.face]);
                        meet(a.face, &e, b.face);
                        meet(b.face, &e, a.face);
                        e
                    }
                    fan => {
                        part.notes.fans += 1;
                        let e = edge([part.fans.len() as u32, Edge::NON_MANIFOLD]);
                        part.fans.push(fan.len() as u32);
                        for h in fan {
                            part.fans.push(h.face);
                            meet(h.face, &e, Topology::FAN);
                        }
                        e
                    }
                });
            }
        });
        part
    }
}
