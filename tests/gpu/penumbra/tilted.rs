//! Planes seen at an angle: errors of the distances there.

use super::{Findings, Run, TARGET, check, examine};
use crate::common::{desc, renderer, with_gpu};
use crate::made::{self, cuboid, moved, plane, sphere, sun};
use edgeshade::scene::{Camera, Mesh, Projection, Scene};
use edgeshade::view::look_at;
use glam::{DAffine3, DVec3, dvec3};
use rand_pcg::Pcg32;
use rand_pcg::rand_core::{Rng as _, SeedableRng as _};

const SIZE: [u32; 2] = [640, 360];
const MAP: u32 = 1024;
/// Distance from the camera to the middle of the plane.
const DISTANCE: f64 = 10.0;
/// Penumbra width: 34 pixels in the middle of a plane that faces the camera.
const PENUMBRA: &str = "0.8";

/// Returns the shadows of a dozen bodies, which the camera does not see, on a plane, and optionally objects in front
/// of them. `elevation` is the angle between a view ray and the plane, radians.
fn scene(elevation: f64, with_occluders: bool) -> Scene {
    let mut random = Pcg32::seed_from_u64(5);
    let mut within = |from: f64, to: f64| from + (to - from) * f64::from(random.next_u32()) / f64::from(u32::MAX);
    let light = dvec3(0.25, 1.0, 0.15);
    let mut parts: Vec<(Mesh, DAffine3)> = vec![(plane(14.0), DAffine3::IDENTITY)];
    for i in 0..12 {
        let shadow = dvec3(within(-4.0, 4.0), 0.0, within(-4.0, 4.0));
        let size = within(0.25, 0.8);
        let body = if i % 3 == 0 { sphere(16, 32) } else { cuboid(dvec3(1.0, 0.2, within(0.2, 1.2))) };
        let turned = DAffine3::from_rotation_y(within(0.0, 3.0)) * DAffine3::from_scale(DVec3::splat(size));
        parts.push((body, moved(shadow + 25.0 * light) * turned));
    }
    let eye = DISTANCE * dvec3(0.0, elevation.sin(), elevation.cos());
    for i in 0..10 {
        let (seen, near) = (dvec3(within(-4.0, 4.0), 0.0, within(-3.0, 3.0)), within(0.2, 0.6));
        let body = if i % 2 == 0 { cuboid(dvec3(0.05, 0.4, 0.05)) } else { cuboid(dvec3(0.3, 0.06, 0.2)) };
        if with_occluders {
            parts.push((body, moved(seen.lerp(eye, near)) * DAffine3::from_rotation_z(within(-0.8, 0.8))));
        }
    }
    let projection = Projection::Perspective { fov_y: 0.8, near: 0.1 };
    let camera = Camera { name: "made".into(), world_from_camera: look_at(eye, DVec3::ZERO), projection };
    made::scene(parts, camera, sun(light))
}

/// Angle between view ray and plane in degrees, and the fractions of pixels with too large and with lost distances
/// that hold there; `TARGET` is what they should be.
const TILTS: [(f64, [f64; 2]); 3] = [(60.0, TARGET), (35.0, TARGET), (15.0, [0.002, 0.0012])];

/// Fraction of pixels on an occluder's lit face next to a face turned away from the light. No penumbra starts there,
/// but the search over positions takes the ridge for an edge. At 35 degrees with occluders, all lost pixels are of
/// this kind.
const RIDGES: f64 = 0.0005;

#[test]
fn on_tilted_planes_the_nearest_edge_is_found() {
    with_gpu(|host| {
        let mut missed = vec![];
        let mut by_pixel = Findings::default();
        for (degrees, most) in TILTS {
            for occluders in [false, true] {
                let mut r = renderer(host, &scene(degrees.to_radians(), occluders), desc(SIZE, MAP));
                let with = if occluders { "occluders" } else { "plane alone" };
                let what = |nearest: &str| format!("{degrees} degrees, {with}, {nearest}");
                let world = Run::new(host, &mut r, "edtsm", &[("penumbra", PENUMBRA)]);
                let found = check(&world, &what("world"));
                assert!(found.penumbra > 10_000, "{found:?}");
                let allowed = [0.0, if occluders { RIDGES } else { 0.0 }];
                if (0..2).any(|k| found.shares()[k] > most[k].max(TARGET[k]) + allowed[k]) {
                    missed.push(format!("{}: {found:?}", what("world")));
                }
                let pixel = Run::new(host, &mut r, "edtsm", &[("penumbra", PENUMBRA), ("nearest", "pixel")]);
                let found = examine(&pixel, &pixel.settings, &pixel.seeds, &world.in_world(&world.settings));
                found.print(&what("pixel"));
                assert_eq!(found.wrong(), 0, "{found:?}");
                by_pixel.add(&found);
            }
        }
        // The limits can be exceeded.
        assert!((0..2).all(|k| by_pixel.shares()[k] > TILTS[2].1[k]), "{by_pixel:?}");
        assert!(missed.is_empty(), "more than {TILTS:?}:\n{}", missed.join("\n"));
    });
}
