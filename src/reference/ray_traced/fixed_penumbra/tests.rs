use super::nearest::{Nearest, Place, Segment, is_same_surface};
use super::*;
use crate::scene::{fit, light_view, load_bytes, shipped};
use glam::dvec3;

const SIZE: [u32; 2] = [80, 45];

/// Boundary of a shipped scene, and the place of every pixel.
fn boundary_of(name: &str) -> (Vec<Segment>, Vec<Place>) {
    let shipped = shipped::find(name).unwrap();
    let scene = load_bytes(shipped.name, shipped.bytes).unwrap();
    let camera = scene.cameras.first().cloned().unwrap_or_else(|| fit::camera(&scene, SIZE)).view(SIZE);
    let light = light_view(&scene, &scene.lights.first().cloned().unwrap_or_else(|| fit::light(&scene)));
    let rays = RayScene::build(&scene).unwrap();
    let (eye, lamp) = (Eye::new(&rays, &camera, SIZE), Lamp::new(&rays, &light));
    let lattice = Lattice::new(SIZE, 2, 3);
    let surfaces = rays.smooth_surfaces(SMOOTH_COSINE);
    let boundary = Boundary { scene: &rays, eye: &eye, lamp: &lamp, lattice: &lattice, surfaces: &surfaces };
    let (segments, _) = boundary.trace(&|_| {});
    let pixels = (0..SIZE[0] * SIZE[1]).filter_map(|i| {
        let (origin, direction, t_max) = eye.ray_at([f64::from(i % SIZE[0]), f64::from(i / SIZE[0])]);
        let hit = rays.primary_local(origin, direction, t_max)?;
        Some(Place { position: hit.local, normal: hit.normal, surface: surfaces[hit.triangle as usize] })
    });
    (segments, pixels.collect())
}

/// Returns the distance to the nearest segment within `reach`, from all segments. Also checks the distance of each
/// segment at a thousand of its points.
fn by_brute_force(segments: &[Segment], place: &Place, reach: f64) -> Option<f64> {
    let distances = segments.iter().filter_map(|s| {
        let d = s.distance(place)?;
        let points = (0..=1000).map(|i| s.at(f64::from(i) / 1000.0).distance(place.position));
        let sampled = points.fold(f64::INFINITY, f64::min);
        assert!(d <= sampled + 1e-12 && d >= sampled - 1e-3 * s.at(0.0).distance(s.at(1.0)) - 1e-12);
        Some(d)
    });
    distances.min_by(f64::total_cmp).filter(|d| *d <= reach)
}

#[test]
fn the_index_finds_what_brute_force_finds() {
    for name in ["drum", "jenga"] {
        let (mut segments, places) = boundary_of(name);
        assert!(segments.len() > 300 && places.len() > 1000, "{name}: {} {}", segments.len(), places.len());
        let nearest = Nearest::new(segments.clone());
        let mut found = [0, 0];
        for place in places.iter().step_by(37) {
            for reach in [0.02, 0.2] {
                let brute = by_brute_force(&segments, place, reach);
                assert_eq!(nearest.distance(place, reach), brute, "{name}");
                found[usize::from(brute.is_some())] += 1;
            }
        }
        assert!(found[0] > 10 && found[1] > 10, "{name}: {found:?}");
        // Without half of the segments the answers differ.
        segments.truncate(segments.len() / 2);
        let fewer = Nearest::new(segments);
        assert!(places.iter().step_by(37).any(|p| fewer.distance(p, 0.2) != nearest.distance(p, 0.2)));
    }
}

#[test]
fn one_surface_is_a_plane_or_a_smooth_mesh() {
    let place = |x: f64, y: f64, normal: DVec3, surface| Place { position: dvec3(x, y, 0.0), normal, surface };
    let flat = place(0.0, 0.0, DVec3::Y, 0);
    for scale in [1e-4, 1e-2, 1.0] {
        let same = |x, y, turn: f64, surface| {
            let normal = dvec3(turn.to_radians().sin(), turn.to_radians().cos(), 0.0);
            let other = place(scale * x, scale * y, normal, surface);
            let answer = is_same_surface(&flat, &other, 0.0);
            assert_eq!(answer, is_same_surface(&other, &flat, 0.0));
            answer
        };
        // In the plane it is the same surface, whatever the mesh; a step up or another tilt makes it another.
        assert!(same(1.0, 0.0, 0.0, 1) && !same(1.0, 0.01, 0.0, 1) && !same(1.0, 0.0, 1.0, 1));
        // A quarter of a circle that bends down is one surface if it is one mesh.
        let arc = |turn: f64, surface| {
            let (sin, cos) = turn.to_radians().sin_cos();
            same(sin, cos - 1.0, turn, surface)
        };
        assert!(arc(30.0, 0) && arc(89.0, 0) && !arc(91.0, 0) && !arc(30.0, 1));
        // The back of a leaf and a point above it are on other surfaces.
        assert!(!same(0.1, 0.0, 180.0, 0) && !same(0.1, 1.0, 0.0, 0));
    }
}

#[test]
fn the_intensity_is_that_of_the_paper() {
    for (hard, distance, expected) in
        [(1.0, 0.0, 0.5), (0.0, 0.0, 0.5), (1.0, 0.1, 0.75), (0.0, 0.1, 0.25), (1.0, 0.2, 1.0), (0.0, 0.3, 0.0)]
    {
        assert!((intensity(hard, distance, 0.4) - expected).abs() < 1e-15, "{hard} {distance}");
    }
}
