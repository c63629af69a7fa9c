//! Properties that hold for any scene, size and width.

use super::{Run, hard, shadows};
use crate::common::{assert_same_bits, desc, differing, prepare, renderer, shipped_scene, with_gpu};
use crate::made::{self, cuboid, moved, perspective, plane, still_life, sun};
use edgeshade::host::Host;
use edgeshade::technique::distance_transform::NO_SEED;
use glam::{DAffine3, DVec3, dvec3};

const SIZE: [u32; 2] = [160, 90];
const IDS: [&str; 2] = ["edtsm", "edtsm-star"];

fn without_edges(host: &Host) {
    let camera = || perspective(dvec3(0.0, 6.0, 12.0), DVec3::ZERO, 0.1);
    let ground = || (plane(40.0), DAffine3::IDENTITY);
    let plate = (cuboid(dvec3(60.0, 0.5, 60.0)), moved(dvec3(0.0, 20.0, 0.0)));
    for (what, parts, value) in [("lit", vec![ground()], 1.0), ("dark", vec![ground(), plate], 0.0)] {
        let mut r = renderer(host, &made::scene(parts, camera(), sun(DVec3::Y)), desc(SIZE, 256));
        for id in IDS {
            let hard = hard(&mut r, id);
            assert!(hard.iter().filter(|v| **v == value).count() * 2 > hard.len(), "everything {what}");
            assert_same_bits(&hard, &shadows(&mut r, id, &[], what), what);
        }
        let run = Run::new(host, &mut r, "edtsm", &[]);
        if value == 1.0 {
            assert!(run.seeds.is_empty() && run.labels.iter().all(|l| *l == NO_SEED), "{what}");
        }
    }
}

fn sizes(host: &Host) {
    let scene = still_life(sun(dvec3(-1.0, 2.0, 1.0)));
    for (size, map) in [([1, 1], 64), ([1, 7], 64), ([7, 1], 64), ([333, 127], 100), ([48, 27], 1), ([48, 27], 63)] {
        let mut r = renderer(host, &scene, desc(size, map));
        for id in IDS {
            shadows(&mut r, id, &[], &format!("{size:?}, map {map}"));
        }
    }
}

/// Tests cameras close to and inside objects, and penumbrae as wide as the scene or narrower than anything.
fn extremes(host: &Host) {
    let mut scene = still_life(sun(dvec3(-1.0, 2.0, 1.0)));
    let mut r = renderer(host, &scene, desc(SIZE, 256));
    let hard = hard(&mut r, "edtsm");
    for (penumbra, most) in [("1e-6", 0.0), ("1e-3", 0.02)] {
        let seen = shadows(&mut r, "edtsm", &[("penumbra", penumbra)], penumbra);
        let off = differing(&hard, &seen, 0.0);
        assert!(off as f64 <= most * hard.len() as f64, "penumbra {penumbra}: {off} pixels are not hard");
    }
    for penumbra in ["20", "1e9"] {
        for filter in ["0", "0.5", "4"] {
            let params = [("penumbra", penumbra), ("filter_width", filter)];
            let seen = shadows(&mut r, "edtsm", &params, penumbra);
            // Next to so wide a penumbra, everything is half lit where an edge is on the surface.
            let half = seen.iter().filter(|v| (*v - 0.5).abs() < 0.3).count();
            assert!(half * 3 > seen.len(), "penumbra {penumbra}, filter {filter}: {half} pixels are in it");
        }
    }
    for (what, eye, target) in [
        ("in the box", dvec3(-1.5, 1.0, 0.3), dvec3(0.0, 0.8, 0.0)),
        ("in the ball", dvec3(1.6, 1.3, -0.7), dvec3(0.0, 0.0, 0.0)),
        ("on the ground", dvec3(3.0, 0.02, 4.0), dvec3(0.0, 0.3, 0.0)),
        ("at the post", dvec3(0.3, 1.5, 2.06), dvec3(0.3, 1.4, 2.0)),
    ] {
        scene.cameras = vec![perspective(eye, target, 1e-3)];
        let mut r = renderer(host, &scene, desc(SIZE, 256));
        for penumbra in ["0", "2"] {
            shadows(&mut r, "edtsm", &[("penumbra", penumbra)], what);
        }
    }
}

/// Images of a technique that hold data of another frame must not affect the result.
fn no_trace_of_earlier_frames(host: &Host) {
    let scene = shipped_scene("robot");
    let mut r = renderer(host, &scene, desc(SIZE, 512));
    let old = *r.light();
    for id in IDS {
        let mut used = prepare(&r, id, &[]);
        for angle in [0.5, 0.2, 0.9] {
            let mut light = old;
            light.world_from_view = DAffine3::from_rotation_y(angle) * old.world_from_view;
            r.set_light(&scene, light);
            r.frame(used.as_mut()).unwrap();
        }
        r.set_light(&scene, old);
        r.frame(used.as_mut()).unwrap();
        let after = r.visibility(used.as_ref()).unwrap();
        let fresh = shadows(&mut r, id, &[], "fresh");
        assert_same_bits(&fresh, &after, &format!("{id} after other frames"));
    }
}

#[test]
fn penumbrae_hold_at_the_limits() {
    with_gpu(|host| {
        no_trace_of_earlier_frames(host);
        without_edges(host);
        sizes(host);
        extremes(host);
    });
}
