//! Boundary of hard shadows, as short lines on surfaces.

use super::super::frame::{Eye, Lamp};
use super::super::hard::is_lit;
use super::super::trace::{Hit, NONE, RayScene};
use super::nearest::{Place, Segment, is_same_surface};
use glam::DVec2;
use rayon::prelude::*;
use std::collections::HashMap;
use std::sync::atomic::{AtomicU64, Ordering};

/// Side of a tile, the unit of parallel work, in cells.
const TILE: u64 = 64;

/// Number of bisection steps: the samples on both sides of a change end up 2^-20 of a lattice step apart.
const HALVINGS: u32 = 20;

/// Ratio above which the surface between two points is torn: their distance over the distance at which their camera
/// rays pass each other. No surface seen under more than 0.06 degrees reaches it. With [`HALVINGS`], every step in
/// depth larger than a thousandth of a lattice step does.
const TORN: f64 = 1024.0;

/// Lattice of visibility samples: `subsamples x subsamples` points per pixel, one in its centre, with a margin around
/// the picture.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Lattice {
    subsamples: u32,
    margin: u32,
    /// Number of cells across and down.
    cells: [u64; 2],
}

impl Lattice {
    /// Returns the lattice of a picture of `size` pixels with `margin` pixels around it.
    pub(super) fn new(size: [u32; 2], subsamples: u32, margin: u32) -> Self {
        let cells = size.map(|n| (u64::from(n) - 1 + 2 * u64::from(margin)) * u64::from(subsamples));
        Self { subsamples, margin, cells }
    }

    /// Returns the number of cells, which the progress counts.
    pub(super) fn samples(&self) -> u64 {
        self.cells[0] * self.cells[1]
    }

    /// Returns a sample's position in pixels from the centre of the first pixel. Pixel centres are exact.
    fn place(&self, at: [u64; 2]) -> DVec2 {
        let first = f64::from(self.margin * self.subsamples);
        let step = f64::from(self.subsamples);
        DVec2::from_array(at.map(|i| (i as f64 - first) / step))
    }
}

/// Input of the search for the boundary.
pub(super) struct Boundary<'a> {
    pub scene: &'a RayScene,
    pub eye: &'a Eye,
    pub lamp: &'a Lamp,
    pub lattice: &'a Lattice,
    /// Number of the smooth surface of every triangle id.
    pub surfaces: &'a [u32],
}

/// Point that the camera sees.
struct Sample {
    hit: Hit,
    lit: bool,
}

/// Count of shadow rays, and the last occluder.
struct Work {
    rays: u64,
    last: u32,
}

/// Crossings that a tile has found, by the lattice edge's first end and whether the edge runs down.
type Crossings = HashMap<([u64; 2], bool), Option<Place>>;

impl Boundary<'_> {
    /// Finds the whole boundary; also returns the number of shadow rays. `progress` is told how many of the lattice's
    /// cells are done.
    pub fn trace(&self, progress: &(dyn Fn(u64) + Sync)) -> (Vec<Segment>, u64) {
        let [columns, rows] = self.lattice.cells.map(|n| n.div_ceil(TILE));
        let done = AtomicU64::new(0);
        let tiles: Vec<(Vec<Segment>, u64)> = (0..(columns * rows) as usize)
            .into_par_iter()
            .with_max_len(1)
            .map(|tile| {
                let tile = tile as u64;
                let first = [tile % columns * TILE, tile / columns * TILE];
                let end = [0, 1].map(|k| (first[k] + TILE).min(self.lattice.cells[k]));
                let result = self.tile(first, end);
                let count = (end[0] - first[0]) * (end[1] - first[1]);
                progress(done.fetch_add(count, Ordering::Relaxed) + count);
                result
            })
            .collect();
        let rays = tiles.iter().map(|t| t.1).sum();
        (tiles.into_iter().flat_map(|t| t.0).collect(), rays)
    }

    /// Finds the boundary in the cells from `first` up to, but not including, `end`.
    fn tile(&self, first: [u64; 2], end: [u64; 2]) -> (Vec<Segment>, u64) {
        let mut work = Work { rays: 0, last: NONE };
        let width = (end[0] - first[0] + 1) as usize;
        let mut lit = Vec::with_capacity(width * (end[1] - first[1] + 1) as usize);
        for y in first[1]..=end[1] {
            for x in first[0]..=end[0] {
                lit.push(self.sample(self.lattice.place([x, y]), &mut work).map(|s| s.lit));
            }
        }
        let lit = |[x, y]: [u64; 2]| lit[(y - first[1]) as usize * width + (x - first[0]) as usize];
        let differ = |a, b| matches!((lit(a), lit(b)), (Some(a), Some(b)) if a != b);
        let mut crossings = Crossings::new();
        let mut segments = vec![];
        for (x, y) in (first[1]..end[1]).flat_map(|y| (first[0]..end[0]).map(move |x| (x, y))) {
            let sides = [([x, y], false), ([x, y], true), ([x, y + 1], false), ([x + 1, y], true)];
            let changes = sides.into_iter().filter(|&(at, down)| differ(at, next(at, down)));
            let changes: Vec<_> = changes.collect();
            let found = changes.iter().filter_map(|&(at, down)| {
                *crossings.entry((at, down)).or_insert_with(|| {
                    let ends = [at, next(at, down)].map(|p| self.lattice.place(p));
                    self.crossing(ends, &mut work)
                })
            });
            let found: Vec<Place> = found.collect();
            // With four changes the pairing is ambiguous. With one of two missing, the boundary ends at an outline.
            match found[..] {
                [a, b] if changes.len() == 2 && is_same_surface(&a, &b, 0.0) => segments.push(Segment::new(&a, &b)),
                _ => segments.extend(found.iter().map(|p| Segment::new(p, p))),
            }
        }
        (segments, work.rays)
    }

    /// Finds the change of visibility between two samples that differ; `None` if no single surface carries it.
    fn crossing(&self, [mut from, mut to]: [DVec2; 2], work: &mut Work) -> Option<Place> {
        let mut ends = [self.sample(from, work)?, self.sample(to, work)?];
        for _ in 0..HALVINGS {
            let at = 0.5 * (from + to);
            let middle = self.sample(at, work)?;
            if middle.lit == ends[0].lit {
                (from, ends[0]) = (at, middle);
            } else {
                (to, ends[1]) = (at, middle);
            }
        }
        let [a, b] = &ends;
        // Distance at which the camera ray through one sample passes the other.
        let (origin, direction, _) = self.eye.ray_at(to.to_array());
        let apart = (a.hit.local - origin).cross(direction).length() / direction.length();
        if (b.hit.local - a.hit.local).length() > TORN * apart {
            return None;
        }
        // The two ends are practically one point, so only their normals can separate surfaces.
        let places = [a, b].map(|s| Place { position: a.hit.local, ..self.place(&s.hit) });
        let normal = (a.hit.normal + b.hit.normal).normalize_or_zero();
        let position = 0.5 * (a.hit.local + b.hit.local);
        let is_smooth = a.hit.normal.dot(b.hit.normal) >= super::SMOOTH_COSINE;
        (is_smooth && is_same_surface(&places[0], &places[1], 0.0)).then_some(Place {
            position,
            normal,
            surface: places[0].surface,
        })
    }

    fn place(&self, hit: &Hit) -> Place {
        Place { position: hit.local, normal: hit.normal, surface: self.surfaces[hit.triangle as usize] }
    }

    /// Returns what the camera sees at a position in the picture, pixels from the first pixel's centre; `None` for the
    /// sky.
    fn sample(&self, at: DVec2, work: &mut Work) -> Option<Sample> {
        let (origin, direction, t_max) = self.eye.ray_at(at.to_array());
        let hit = self.scene.primary_local(origin, direction, t_max)?;
        let faces_light = hit.normal.dot(self.lamp.towards(hit.local)) > 0.0;
        work.rays += u64::from(faces_light);
        let lit = faces_light && is_lit(self.scene, self.lamp, &hit, &mut work.last);
        Some(Sample { hit, lit })
    }
}

/// Returns the other end of a lattice edge.
fn next([x, y]: [u64; 2], down: bool) -> [u64; 2] {
    if down { [x, y + 1] } else { [x + 1, y] }
}
