//! Properties that hold for any scene, size and light.

use crate::common::enlarged;
use crate::common::{assert_same_bits, desc, differing, prepare, renderer, shipped_scene, with_gpu};
use crate::made::{cuboid, moved, perspective, plane, scene, spot, still_life, sun};
use crate::penumbra::shadows;
use glam::{DAffine3, DVec3, dvec3};

const SIZE: [u32; 2] = [160, 90];
const IDS: [&str; 2] = ["edtssm", "edtssm-star"];

#[test]
fn soft_shadows_hold_at_the_limits() {
    with_gpu(|host| {
        // Images of a technique that hold data of another frame must not affect the result.
        let robot = shipped_scene("robot");
        let mut r = renderer(host, &robot, desc(SIZE, 512));
        let old = *r.light();
        for id in IDS {
            let mut used = prepare(&r, id, &[]);
            for angle in [0.5, 0.2, 0.9] {
                let mut light = enlarged(&old, 2.0 * angle);
                light.world_from_view = DAffine3::from_rotation_y(angle) * old.world_from_view;
                r.set_light(&robot, light);
                r.frame(used.as_mut()).unwrap();
            }
            r.set_light(&robot, old);
            r.frame(used.as_mut()).unwrap();
            let after = r.visibility(used.as_ref()).unwrap();
            assert_same_bits(&shadows(&mut r, id, &[], "fresh"), &after, &format!("{id} after other frames"));
        }
        // Lights from a point to one larger than the scene, and factors likewise.
        let hard = shadows(&mut r, "edtssm-star", &[("beta", "0")], "beta 0");
        assert!(hard.iter().all(|v| *v == 0.0 || *v == 1.0));
        for (factor, least) in [(0.0, 0), (1e-6, 0), (30.0, 1000)] {
            r.set_light(&robot, enlarged(&old, factor));
            for params in [&[][..], &[("meet", "nearest"), ("metric", "world"), ("search", "near"), ("edge", "pixel")]]
            {
                let seen = shadows(&mut r, "edtssm-star", params, &format!("a light {factor} times as large"));
                let soft = seen.iter().filter(|v| **v > 0.0 && **v < 1.0).count();
                assert!(soft >= least && (least > 0 || differing(&hard, &seen, 0.0) * 500 <= seen.len()), "{soft}");
            }
        }
        r.set_light(&robot, old);
        for beta in ["1e-9", "1e3", "1e9"] {
            shadows(&mut r, "edtssm-star", &[("beta", beta), ("filter_width", "4")], beta);
        }

        let still = still_life(spot(dvec3(2.0, 9.0, 1.0), DVec3::ZERO, 0.9));
        for (size, map) in [([1, 1], 64), ([1, 7], 64), ([7, 1], 64), ([333, 127], 100), ([48, 27], 1), ([48, 27], 63)]
        {
            let mut r = renderer(host, &still, desc(size, map));
            for id in IDS {
                shadows(&mut r, id, &[], &format!("{size:?}, map {map}"));
            }
        }
        // Everything lit, everything dark.
        let camera = || perspective(dvec3(0.0, 6.0, 12.0), DVec3::ZERO, 0.1);
        let ground = || (plane(40.0), DAffine3::IDENTITY);
        let plate = (cuboid(dvec3(60.0, 0.5, 60.0)), moved(dvec3(0.0, 20.0, 0.0)));
        for (what, parts, value) in [("lit", vec![ground()], 1.0), ("dark", vec![ground(), plate], 0.0)] {
            let mut r = renderer(host, &scene(parts, camera(), sun(DVec3::Y)), desc(SIZE, 256));
            let seen = shadows(&mut r, "edtssm", &[], what);
            assert!(seen.iter().filter(|v| **v == value).count() * 2 > seen.len(), "everything {what}");
        }
        // Cameras inside objects.
        let mut still = still;
        for (eye, target) in [
            (dvec3(-1.5, 1.0, 0.3), dvec3(0.0, 0.8, 0.0)),
            (dvec3(3.0, 0.02, 4.0), dvec3(0.0, 0.3, 0.0)),
            (dvec3(0.3, 1.5, 2.06), dvec3(0.3, 1.4, 2.0)),
        ] {
            still.cameras = vec![perspective(eye, target, 1e-3)];
            let mut r = renderer(host, &still, desc(SIZE, 256));
            shadows(&mut r, "edtssm-star", &[], &format!("{eye}"));
        }
    });
}
