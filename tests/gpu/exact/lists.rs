//! Records and lists read back: receivers' depths, triangles, edges, and what each cell must hold.

use super::{SIZE, Stage, stages};
use crate::common::{run_passes, with_gpu};
use ash::vk;
use edgeshade::gpu::{Image, ImageDesc};
use edgeshade::host::Host;
use edgeshade::reference::exact::grid::{self, ordered_float};
use edgeshade::reference::exact::layers::{self, Projected};
use edgeshade::reference::exact::light_seen::{self, GridEdge};
use edgeshade::technique::caster_edges::silhouettes::Silhouettes;
use edgeshade::technique::common::view::ViewBuffer;
use edgeshade::technique::exact::grid::{CellLists, EdgeLists, GridPush, GridReceivers, TriangleLists};
use glam::{DVec2, DVec3, Vec3Swizzles, dvec2};
use std::collections::BTreeSet;

const CELLS: u32 = 128;
const ROOM: u32 = 1 << 20;
/// `CHUNK` of the casters: triangles of an instance begin at a multiple of it.
const CHUNK: usize = 64;

/// A `GridTriangle`: 3 lines, plane, bits of `inner`, range, corners of the square around it.
type Triangle = [f32; 19];
/// A `GridEdge`: both ends, bits of the weight.
type Edge = [f32; 7];

struct Lists {
    starts: Vec<u32>,
    entries: Vec<u32>,
    /// Bounds of the receivers that each entry may matter to.
    bounds: Vec<u32>,
    total: u32,
    longest: u32,
}

impl Lists {
    fn read(host: &Host, lists: &CellLists) -> Self {
        let header: Vec<u32> = host.read_buffer(lists.header()).unwrap();
        assert_eq!(header[13], 0, "pairs are lost");
        let both: Vec<[u32; 2]> = host.read_buffer(lists.entries()).unwrap();
        let (entries, bounds) = both.into_iter().map(|[caster, bounds]| (caster, bounds)).unzip();
        let starts = host.read_buffer(lists.starts()).unwrap();
        Self { starts, entries, bounds, total: header[12], longest: header[22] }
    }

    /// Returns whether a cell's list holds a caster that `is_it` accepts, with bounds that hold the receiver. `change` is
    /// applied to the bounds before.
    fn holds(&self, cell: usize, s: &grid::Seen, change: fn(u32) -> u32, is_it: impl Fn(u32) -> bool) -> bool {
        let range = self.starts[cell] as usize..self.starts[cell + 1] as usize;
        range.into_iter().any(|i| is_it(self.entries[i]) && is_bounded(cell, s, change(self.bounds[i])))
    }

    fn of(&self, cell: usize) -> &[u32] {
        &self.entries[self.starts[cell] as usize..self.starts[cell + 1] as usize]
    }

    /// Checks that the lists lie one after the other, and hold nothing twice.
    fn check(&self, what: &str) {
        let counts: Vec<u32> = self.starts.windows(2).map(|s| s[1] - s[0]).collect();
        assert_eq!(self.starts, grid::starts(&counts), "{what}");
        assert_eq!(self.starts.last(), Some(&self.total), "{what}");
        assert_eq!(counts.iter().max(), Some(&self.longest), "{what}");
        for cell in 0..counts.len() {
            let list = self.of(cell);
            assert_eq!(
                list.iter().collect::<BTreeSet<_>>().len(),
                list.len(),
                "{what}: cell {cell} holds a caster twice"
            );
        }
    }
}

/// Returns whether bounds of an entry hold a receiver, wherever it lies within its error.
fn is_bounded(cell: usize, s: &grid::Seen, bounds: u32) -> bool {
    let corner = dvec2((cell as u32 % CELLS).into(), (cell as u32 / CELLS).into());
    let step = |ndc: DVec2| {
        (((0.5 * ndc + 0.5) * f64::from(CELLS) - corner) * 16.0).floor().clamp(DVec2::ZERO, DVec2::splat(15.0))
    };
    let bits = |shift: u32| f64::from(bounds >> shift & 15);
    let (low, high) = (step(s.ndc - s.ndc_error), step(s.ndc + s.ndc_error));
    let nearest = f64::from(ordered_float(bounds & 0xFFFF_0000));
    low.cmpge(dvec2(bits(0), bits(4))).all()
        && high.cmple(dvec2(bits(8), bits(12))).all()
        && nearest <= s.depth - s.depth_error
}

struct Found {
    depths: Vec<u32>,
    triangles: (Lists, Vec<Triangle>),
    edges: (Lists, Vec<Edge>),
    silhouettes: usize,
}

fn found(host: &Host, stage: &Stage<'_>) -> Found {
    let (context, r) = (host.context(), &stage.renderer);
    let casters = &r.casters().unwrap().casters;
    let view = ViewBuffer::new(context.device()).unwrap();
    let mut silhouettes = Silhouettes::new(context, casters, true).unwrap();
    let depths = GridReceivers::new(context, SIZE, CELLS, false).unwrap();
    let format = vk::Format::R32_SFLOAT;
    let visibility = Image::new(context.device(), &ImageDesc::storage("visibility", format, SIZE)).unwrap();
    let triangles = TriangleLists::new(context, casters, CELLS, ROOM, true).unwrap();
    let edges = EdgeLists::new(context, casters, CELLS, ROOM).unwrap();
    run_passes(host, |frame| {
        let inputs = r.inputs();
        let push = GridPush::new(&inputs, casters, CELLS, ROOM, 1.0);
        let view = view.update(frame, &inputs);
        silhouettes.record(frame, &inputs, None)?;
        depths.record(frame, view, &inputs, &push, &visibility, None)?;
        triangles.record(frame, &depths, &silhouettes, &push, Some(&edges))?;
        edges.record(frame, &depths, &silhouettes, &push)
    });
    Found {
        depths: host.read_buffer(depths.depths()).unwrap(),
        triangles: (Lists::read(host, triangles.lists()), host.read_buffer(triangles.triangles()).unwrap()),
        edges: (Lists::read(host, edges.lists()), host.read_buffer(edges.edges()).unwrap()),
        silhouettes: host.read_buffer::<u32>(silhouettes.header()).unwrap()[3] as usize,
    }
}

fn every_stage(host: &Host) -> impl Iterator<Item = Stage<'_>> {
    // The lists are those of the renderer's last frame.
    stages(host).map(|stage| stage.with_light_size(0.1)).map(|mut stage| {
        stage.seen("sm", &[]);
        stage
    })
}

/// Returns the number of cells whose depth is not that of the receivers.
fn wrong_depths(depths: &[u32], seen: &[Option<grid::Seen>]) -> usize {
    let cells = (CELLS * CELLS) as usize;
    let (mut least, mut most) = (vec![f64::NEG_INFINITY; cells], vec![f64::NEG_INFINITY; cells]);
    for s in seen.iter().flatten() {
        let at = s.cells(CELLS);
        for &cell in &at {
            most[cell] = most[cell].max(s.depth + s.depth_error);
        }
        if s.sure && at.len() == 1 {
            least[at[0]] = least[at[0]].max(s.depth - s.depth_error);
        }
    }
    // Nothing is known of a cell with a receiver in doubt.
    let unsure: BTreeSet<usize> = seen.iter().flatten().filter(|s| !s.sure).flat_map(|s| s.cells(CELLS)).collect();
    let fits = |i: &usize| match depths[*i] {
        _ if unsure.contains(i) => true,
        0 => least[*i] == f64::NEG_INFINITY,
        bits => (least[*i]..=most[*i]).contains(&f64::from(ordered_float(bits))),
    };
    (0..cells).filter(|i| !fits(i)).count()
}

#[test]
fn cells_have_the_greatest_depth_of_their_receivers() {
    with_gpu(|host| {
        for stage in every_stage(host) {
            let found = found(host, &stage);
            let (shot, casters) = (stage.shot(host), stage.casters());
            let seen = grid::receivers(&shot.data(), stage.renderer.light(), &casters).unwrap();
            let (cells, levels) = found.depths.split_at((CELLS * CELLS) as usize);
            let filled = cells.iter().filter(|d| **d != 0).count();
            println!("{:32} {filled} cells with receivers", stage.name);
            assert!(filled > 20, "{}", stage.name);
            assert_eq!(wrong_depths(cells, &seen), 0, "{}", stage.name);
            assert_eq!(levels, grid::levels(cells, CELLS as usize), "{}", stage.name);
            // A receiver nearer to the light by a thousandth is noticed.
            let mut planted = cells.to_vec();
            let sure: BTreeSet<usize> = seen.iter().flatten().filter(|s| s.sure).flat_map(|s| s.cells(CELLS)).collect();
            let unsure: BTreeSet<usize> =
                seen.iter().flatten().filter(|s| !s.sure).flat_map(|s| s.cells(CELLS)).collect();
            let at = *sure.difference(&unsure).find(|&&i| cells[i] != 0).unwrap();
            let depth = ordered_float(cells[at]);
            planted[at] = grid::ordered_bits(depth - 1e-3 * depth.abs());
            assert_eq!(wrong_depths(&planted, &seen), 1, "{}", stage.name);
        }
    });
}

/// Evaluates a line or plane as the shaders do.
fn value(line: &[f32], p: DVec2) -> f64 {
    f64::from(line[0]) * p.x + f64::from(line[1]) * p.y + f64::from(line[2])
}

fn covers(t: &Triangle, p: DVec2) -> bool {
    (0..3).all(|i| (value(&t[3 * i..], p) >= 0.0) == (t[12].to_bits() >> i & 1 == 1))
}

/// Returns what is wrong about a triangle: it must cover its inside, not what lies beyond its sides, and lie at its depth, or
/// behind by the bound of the rounding.
fn fault(t: &Triangle, p: &Projected) -> Option<&'static str> {
    let [a, b, c] = p.corners;
    let area = (b - a).xy().perp_dot((c - a).xy()).abs();
    let longest = [(a, b), (b, c), (c, a)].map(|(a, b)| (b - a).xy().length()).into_iter().fold(0.0, f64::max);
    let size = p.corners.map(|q| 1.0 + q.xy().length()).into_iter().fold(0.0, f64::max);
    // The thickness in the light's image must be more than rounding.
    if area < 1e-4 * longest * size {
        return None;
    }
    for [u, v, w] in [[1.0, 1.0, 1.0], [8.0, 1.0, 1.0], [1.0, 8.0, 1.0], [1.0, 1.0, 8.0]] {
        let inside: DVec3 = (u * a + v * b + w * c) / (u + v + w);
        if !covers(t, inside.xy()) {
            return Some("does not cover its inside");
        }
        let depth = value(&t[9..], inside.xy()).clamp(t[13].into(), t[14].into());
        // Corners of a tall triangle differ in depth, and its plane has the error of all of them.
        let range = p.corners.iter().map(|q| q.z.abs()).fold(0.0, f64::max);
        let behind = (depth - inside.z) / range;
        if !(-2e-6..1e-3).contains(&behind) {
            return Some("lies at another depth");
        }
    }
    for (from, to, other) in [(a, b, c), (b, c, a), (c, a, b)] {
        let middle = 0.5 * (from + to);
        if covers(t, (middle + 0.1 * (middle - other)).xy()) {
            return Some("covers what lies beyond a side");
        }
    }
    None
}

#[test]
fn triangles_cover_their_image_at_their_depth() {
    with_gpu(|host| {
        for stage in every_stage(host) {
            let found = found(host, &stage);
            let casters = stage.casters();
            let expected = layers::projected(stage.renderer.camera(), stage.renderer.light(), &casters);
            let first = first_triangles(&stage);
            // A triangle without a record matters to no cell.
            let listed: BTreeSet<u32> =
                found.triangles.0.entries[..found.triangles.0.total as usize].iter().copied().collect();
            let mut checked = 0;
            for p in &expected {
                let at = first[p.index[0]] + p.index[1];
                if !listed.contains(&(at as u32)) {
                    continue;
                }
                checked += 1;
                let t = &found.triangles.1[at];
                assert_eq!(fault(t, p), None, "{}: triangle {:?} {t:?} {p:?}", stage.name, p.index);
                // A triangle moved by a third of its size is noticed.
                let moved = |q: DVec3| q + (p.corners[1] - p.corners[0]) * 0.4;
                let other = Projected { corners: p.corners.map(moved), ..*p };
                assert!(fault(t, &other).is_some() || fault(t, p).is_none() && is_thin(p), "{}", stage.name);
            }
            println!("{:32} {checked} of {} triangles listed", stage.name, expected.len());
            assert!(checked > 0, "{}", stage.name);
        }
    });
}

fn is_thin(p: &Projected) -> bool {
    let [a, b, c] = p.corners;
    let area = (b - a).xy().perp_dot((c - a).xy()).abs();
    area < 1e-3 * (1.0 + a.length() + b.length() + c.length()) * ((b - a).length() + (c - a).length())
}

/// Index of each instance's first triangle among the records.
fn first_triangles(stage: &Stage<'_>) -> Vec<usize> {
    let mut next = 0;
    let first = |t: &edgeshade::casters::topology::Topology| {
        let first = next;
        next += t.triangles.len().next_multiple_of(CHUNK);
        first
    };
    assert_eq!(stage.renderer.casters().unwrap().casters.counts().instances as usize, stage.topologies.len());
    stage.topologies.iter().map(first).collect()
}

/// Returns the number of pairs of a pixel and a caster that the pixel's cell lacks, of all pairs.
fn missing<T>(
    seen: &[Option<grid::Seen>],
    needed: &[Vec<T>],
    mut holds: impl FnMut(usize, &grid::Seen, &T) -> bool,
) -> [usize; 2] {
    let mut found = [0; 2];
    for (s, needed) in seen.iter().zip(needed) {
        let Some(s) = s.filter(|s| s.sure) else { continue };
        let [cell] = s.cells(CELLS)[..] else { continue };
        for caster in needed {
            found[0] += usize::from(!holds(cell, &s, caster));
            found[1] += 1;
        }
    }
    found
}

#[test]
fn every_cell_holds_the_triangles_over_its_receivers() {
    with_gpu(|host| {
        for stage in every_stage(host) {
            let found = found(host, &stage);
            let lists = &found.triangles.0;
            lists.check(&stage.name);
            let (shot, casters, r) = (stage.shot(host), stage.casters(), &stage.renderer);
            let seen = grid::receivers(&shot.data(), r.light(), &casters).unwrap();
            let needed = layers::covering(&shot.data(), r.camera(), r.light(), &casters).unwrap();
            let first = first_triangles(&stage);
            let index = |t: &[usize; 2]| (first[t[0]] + t[1]) as u32;
            let [lacking, all] = missing(&seen, &needed, |cell, s, t| lists.holds(cell, s, |b| b, |i| i == index(t)));
            println!("{:32} {} entries, {all} layers over pixels, {lacking} not listed", stage.name, lists.total);
            assert_eq!(lacking, 0, "{}", stage.name);
            assert!(all > 50 || stage.name == "needles", "{}", stage.name);
            // The list of the next cell is not enough, nor are bounds that are smaller by a step.
            let [lacking, _] = missing(&seen, &needed, |cell, _, t| {
                lists.of((cell + CELLS as usize) % (CELLS * CELLS) as usize).contains(&index(t))
            });
            assert!(lacking > 0 || all == 0, "{}", stage.name);
            for smaller in SMALLER {
                let [lacking, _] =
                    missing(&seen, &needed, |cell, s, t| lists.holds(cell, s, smaller, |i| i == index(t)));
                assert!(lacking > 0 || all < 50, "{}", stage.name);
            }
        }
    });
}

/// Bounds that are smaller by a step to the right, above, to the left and below.
const SMALLER: [fn(u32) -> u32; 4] = [|b| b + 1, |b| b + 16, |b| b - 256, |b| b - 4096];

/// Returns whether a record is the edge, or a part of it.
fn is_edge(record: &Edge, e: &GridEdge) -> bool {
    let end = |i: usize| DVec3::new(record[i].into(), record[i + 1].into(), record[i + 2].into());
    let off = |p: DVec3, q: DVec3| (p - q).abs().max_element() / (1.0 + q.abs().max_element());
    let weight = record[6].to_bits() as i32;
    weight == e.weight && off(end(0), e.ends[0]) < 3e-5 && off(end(3), e.ends[1]) < 3e-5
}

/// Scenes whose receivers see no whole edge on the light: they are dark, or all edges reach the light's plane or its near
/// plane.
const NO_WHOLE_EDGE: [&str; 5] = [
    "light in a mesh",
    "light in an open box",
    "vertices in the light's plane",
    "behind the light",
    "before the near plane",
];

/// Edges that the shader does not cut.
fn is_whole(e: &GridEdge) -> bool {
    e.ends.iter().all(|p| p.xy().abs().max_element() < 4.9) && e.ends[0].xy().distance(e.ends[1].xy()) > 1e-4
}

#[test]
fn every_cell_holds_the_edges_that_its_receivers_see_on_the_light() {
    with_gpu(|host| {
        for stage in every_stage(host) {
            // Single precision decides which way faces in the light's plane are turned.
            if ["light in a face's plane", "sun along faces"].contains(&stage.name.as_str()) {
                continue;
            }
            let found = found(host, &stage);
            let (lists, records) = &found.edges;
            lists.check(&stage.name);
            let (shot, casters, r) = (stage.shot(host), stage.casters(), &stage.renderer);
            let all: Vec<_> = light_seen::grid_edges(&shot.data(), r.camera(), r.light(), &casters).unwrap();
            let whole: Vec<_> = all.iter().filter(|e| is_whole(e)).collect();
            let lacking = |weight: i32| {
                let changed = |e: &GridEdge| GridEdge { weight: e.weight + weight, ..*e };
                whole.iter().filter(|e| !records[..found.silhouettes].iter().any(|r| is_edge(r, &changed(e)))).count()
            };
            assert_eq!(lacking(0), 0, "{}: of {} edges", stage.name, whole.len());
            assert_eq!(lacking(1), whole.len(), "{}", stage.name);
            let seen = grid::receivers(&shot.data(), r.light(), &casters).unwrap();
            let mut needed = light_seen::reaching(&shot.data(), r.camera(), r.light(), &casters).unwrap();
            needed.iter_mut().for_each(|edges| edges.retain(is_whole));
            let holds = |cell: usize, s: &grid::Seen, e: &GridEdge| {
                lists.holds(cell, s, |b| b, |i| is_edge(&records[i as usize], e))
            };
            let [without, pairs] = missing(&seen, &needed, holds);
            println!(
                "{:32} {} entries, {} edges, {pairs} on the light of pixels, {without} not listed",
                stage.name,
                lists.total,
                whole.len()
            );
            assert_eq!(without, 0, "{}", stage.name);
            assert!(pairs > 50 || NO_WHOLE_EDGE.contains(&stage.name.as_str()), "{}", stage.name);
            // The list of a cell farther down is not enough.
            let other = |cell: usize, _: &grid::Seen, e: &GridEdge| {
                let list = lists.of((cell + 4 * CELLS as usize) % (CELLS * CELLS) as usize);
                list.iter().any(|&i| is_edge(&records[i as usize], e))
            };
            assert!(missing(&seen, &needed, other)[0] > 0 || pairs == 0, "{}", stage.name);
            // Nor are bounds that are smaller by a step.
            for smaller in SMALLER {
                let held = |cell: usize, s: &grid::Seen, e: &GridEdge| {
                    lists.holds(cell, s, smaller, |i| is_edge(&records[i as usize], e))
                };
                assert!(missing(&seen, &needed, held)[0] > 0 || pairs < 50, "{}", stage.name);
            }
        }
    });
}

#[test]
fn thin_triangles_are_told_from_others() {
    let flat = [dvec2(0.0, 0.0), dvec2(1.0, 0.0), dvec2(0.5, 1e-9)].map(|p| p.extend(-1.0));
    let wide = [dvec2(0.0, 0.0), dvec2(1.0, 0.0), dvec2(0.5, 0.5)].map(|p| p.extend(-1.0));
    assert!(
        is_thin(&Projected { index: [0; 2], corners: flat }) && !is_thin(&Projected { index: [0; 2], corners: wide })
    );
}
