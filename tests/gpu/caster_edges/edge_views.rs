//! Views of edges: silhouettes over the image, compared with the outline of a box projected here, and edge ids,
//! compared with the map.

use crate::caster_edges::edsm_x::{config, edges};
use crate::common::*;
use crate::made::{cuboid, moved, perspective, plane, scene, spot};
use edgeshade::host::Host;
use edgeshade::reference::caster_edges::edge_map::id_color;
use edgeshade::scene::{RenderDesc, Renderer, Scene};
use edgeshade::technique::caster_edges::edge_map::{Generation, LEAST_REACH};
use glam::{DVec2, DVec3, dvec2, dvec3};

const SIZE: [u32; 2] = [320, 180];
const HALF: DVec3 = dvec3(0.8, 0.5, 0.6);
const CENTER: DVec3 = dvec3(0.0, 2.0, 0.0);
const LIGHT: DVec3 = dvec3(1.5, 7.0, 2.0);
const EYE: DVec3 = dvec3(-2.5, 4.0, 6.0);
const GROUND: f64 = 3.0;

const FOLD: [u8; 4] = [255, 204, 0, 255];
const FOLD_HIDDEN: [u8; 4] = [102, 82, 0, 255];
const RIM: [u8; 4] = [0, 204, 255, 255];
const RIM_HIDDEN: [u8; 4] = [0, 82, 102, 255];

fn with_views(size: [u32; 2], map_size: u32) -> RenderDesc {
    RenderDesc { intermediates: true, ..desc(size, map_size) }
}

fn view(host: &Host, r: &mut Renderer<'_>, id: &str, name: &str) -> Vec<[u8; 4]> {
    let mut technique = prepare(r, id, &[]);
    // Two frames: the map stays as long as the light does, and the camera's view is drawn again.
    r.frame(technique.as_mut()).unwrap();
    r.frame(technique.as_mut()).unwrap();
    let image = technique.intermediates().into_iter().find(|i| i.0 == name).unwrap().1;
    host.read_image(image).unwrap()
}

fn box_over_ground() -> Scene {
    let parts = vec![(plane(GROUND), moved(DVec3::ZERO)), (cuboid(HALF), moved(CENTER))];
    scene(parts, perspective(EYE, dvec3(0.0, 1.0, 0.0), 0.1), spot(LIGHT, CENTER, 0.9))
}

/// Segment in the image, pixels.
type Line = [DVec2; 2];

/// Returns the edges of the box between faces towards the light and faces away, those visible to the camera first.
fn outline(light: DVec3, project: impl Fn(DVec3) -> DVec2) -> [Vec<Line>; 2] {
    let mut found = [vec![], vec![]];
    for axis in 0..3 {
        let (u, v) = ((axis + 1) % 3, (axis + 2) % 3);
        for (su, sv) in [(-1.0, -1.0), (-1.0, 1.0), (1.0, -1.0), (1.0, 1.0)] {
            let faces = |p: DVec3| {
                let d = p - CENTER;
                [d[u] * su > HALF[u], d[v] * sv > HALF[v]]
            };
            let (lit, seen) = (faces(light), faces(EYE));
            if lit[0] == lit[1] {
                continue;
            }
            let end = |s: f64| {
                let mut p = DVec3::ZERO;
                (p[axis], p[u], p[v]) = (s, su, sv);
                project(CENTER + p * HALF)
            };
            // An edge of a convex body is visible if one of its faces faces the camera; nothing else is in the way.
            found[usize::from(!(seen[0] || seen[1]))].push([end(-1.0), end(1.0)]);
        }
    }
    found
}

fn distance(p: DVec2, lines: &[Line]) -> f64 {
    let to = |[a, b]: &Line| {
        let t = ((p - *a).dot(*b - *a) / (*b - *a).length_squared()).clamp(0.0, 1.0);
        p.distance(*a + t * (*b - *a))
    };
    lines.iter().map(to).fold(f64::INFINITY, f64::min)
}

/// Counts pixels of a colour farther than one pixel from all lines, and points of the lines that have neither such a
/// pixel nor one of the colours `over` around them.
fn wrong(image: &[[u8; 4]], color: [u8; 4], lines: &[Line], over: &[[u8; 4]]) -> [usize; 2] {
    let [w, h] = SIZE.map(|n| n as i64);
    let at = |x: i64, y: i64| image[(y * w + x) as usize];
    let stray = |&(x, y): &(i64, i64)| at(x, y) == color && distance(dvec2(x as f64, y as f64) + 0.5, lines) > 1.0;
    let strays = (0..h).flat_map(|y| (0..w).map(move |x| (x, y))).filter(stray).count();
    let missing = |p: &DVec2| {
        let (x, y) = (p.x.floor() as i64, p.y.floor() as i64);
        let inside = (1..w - 1).contains(&x) && (1..h - 1).contains(&y);
        let around = || (0..9).map(|i| at(x + i % 3 - 1, y + i / 3 - 1));
        inside && !around().any(|c| c == color || over.contains(&c))
    };
    let points = |[a, b]: &Line| {
        let n = a.distance(*b).ceil() as u32;
        let (a, b) = (*a, *b);
        (0..=n).map(move |i| a + f64::from(i) / f64::from(n) * (b - a))
    };
    [strays, lines.iter().flat_map(points).filter(missing).count()]
}

/// The six outline edges of a box appear where they are projected, bright if visible and dim if hidden. The ground's
/// rim has another colour.
#[test]
fn silhouettes_are_where_the_edges_are_projected() {
    with_gpu(|host| {
        let scene = box_over_ground();
        let mut r = renderer(host, &scene, with_views(SIZE, 256));
        let camera = *r.camera();
        let project = |p: DVec3| {
            let q = camera.clip_from_view * camera.world_from_view.inverse().transform_point3(p).extend(1.0);
            0.5 * (dvec2(q.x, q.y) / q.w + 1.0) * dvec2(SIZE[0].into(), SIZE[1].into())
        };
        let [seen, hidden] = outline(LIGHT, project);
        assert_eq!((seen.len(), hidden.len()), (4, 2));
        let corner = |x: f64, z: f64| project(GROUND * dvec3(x, 0.0, z));
        let square = [corner(-1.0, -1.0), corner(1.0, -1.0), corner(1.0, 1.0), corner(-1.0, 1.0)];
        let rim: Vec<Line> = (0..4).map(|i| [square[i], square[(i + 1) % 4]]).collect();

        let volumes = view(host, &mut r, "shadow-volumes", "silhouettes");
        assert!(volumes == view(host, &mut r, "edsm-x", "silhouettes"), "both techniques have the same edges");
        let count = |c: [u8; 4]| volumes.iter().filter(|p| **p == c).count();
        let known = [[0; 4], FOLD, FOLD_HIDDEN, RIM, RIM_HIDDEN];
        assert!(volumes.iter().all(|p| known.contains(p)), "no other colours");
        println!("pixels: fold {} + {} hidden, rim {}", count(FOLD), count(FOLD_HIDDEN), count(RIM));
        assert!(count(FOLD) > 100 && count(FOLD_HIDDEN) > 40 && count(RIM) > 200);
        assert_eq!(wrong(&volumes, FOLD, &seen, &[]), [0, 0], "folds that are seen");
        assert_eq!(wrong(&volumes, FOLD_HIDDEN, &hidden, &[FOLD]), [0, 0], "folds that are hidden");
        assert_eq!(wrong(&volumes, RIM, &rim, &[FOLD, FOLD_HIDDEN, RIM_HIDDEN]), [0, 0], "the rim of the ground");
        // Where the rim is not visible, the box hides it.
        assert_eq!(wrong(&volumes, RIM_HIDDEN, &rim, &[RIM, FOLD, FOLD_HIDDEN]), [0, 0], "what hides the rim");

        // The comparison notices the edges of another light, displaced edges, and visible edges taken for hidden.
        let other = outline(dvec3(-3.0, 7.0, 2.0), project).concat();
        assert!(wrong(&volumes, FOLD, &other, &[]).iter().sum::<usize>() > 20);
        let elsewhere: Vec<Line> = seen.iter().map(|l| l.map(|p| p + dvec2(2.5, 2.5))).collect();
        assert!(wrong(&volumes, FOLD, &elsewhere, &[]).iter().all(|n| *n > 20));
        assert!(wrong(&volumes, FOLD_HIDDEN, &seen, &[]).iter().all(|n| *n > 20));
    });
}

/// Each cell has the colour of the edge in its first slot, brighter the nearer the edge is.
#[test]
fn edge_ids_are_those_of_the_slots() {
    with_gpu(|host| {
        const MAP: u32 = 128;
        let scene = shipped_scene("jenga");
        let mut r = renderer(host, &scene, with_views([96, 54], MAP));
        let shown = view(host, &mut r, "edsm-x", "edge-ids");
        let casters = r.casters().unwrap().casters.clone();
        // The technique's default settings.
        let map = edges(host, &r, &casters, config(2, Generation::Compute));
        assert_eq!(shown.len(), map.slots.len());
        let farthest = 2f64.sqrt() * (0.5 + f64::from(LEAST_REACH));
        let expected = |i: usize, slot: usize| {
            let Some(&id) = map.slots[i].get(slot) else { return [0.0; 3] };
            let center = dvec2(f64::from(i as u32 % (MAP - 1)), f64::from(i as u32 / (MAP - 1))) + 1.0;
            id_color(id, map.segments[id as usize].as_ref().unwrap().distance(center), farthest)
        };
        let off = |i: usize, slot: usize| {
            let wanted = expected(i, slot);
            shown[i][3] != 255 || (0..3).any(|c| (f64::from(shown[i][c]) - 255.0 * wanted[c]).abs() > 0.6)
        };
        let wrong = |slot| (0..shown.len()).filter(|&i| off(i, slot)).count();
        let black = shown.iter().filter(|c| **c == [0, 0, 0, 255]).count();
        println!("{} cells, {black} black; {} wrong, {} by the second slot", shown.len(), wrong(0), wrong(1));
        assert_eq!(wrong(0), 0);
        assert!(black > 1000 && shown.len() - black > 1000);
        // The second nearest edges have other colours.
        assert!(wrong(1) > 1000);
    });
}
