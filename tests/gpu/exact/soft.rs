//! Soft shadows compared with brute force over all edges, and with ray-traced truth.

use super::{SIZE, Stage, stages};
use crate::common::{enlarged, every_shipped, with_gpu};
use crate::made::{self, moved, perspective, plane, spot};
use crate::mirrors::compare;
use edgeshade::host::Host;
use edgeshade::reference::exact::light_seen;
use edgeshade::reference::ray_traced::{RayScene, SoftSettings, soft};
use glam::{DVec3, dvec3};

/// Half of a sample of 256.
const TOLERANCE: f64 = 0.5 / 256.0;

#[test]
fn soft_shadows_equal_brute_force() {
    with_gpu(|host| {
        for (i, mut stage) in stages(host).chain([Stage::shipped(host, "jenga")]).enumerate() {
            for (share, is_disc) in [(0.05, false), (0.3, i % 2 == 0)] {
                // An occluder that cuts a large light.
                if stage.name == "behind the light" && share > 0.1 {
                    continue;
                }
                stage = stage.with_light_size(share);
                let shape = if is_disc { "disc" } else { "square" };
                let seen = stage.seen("exact-soft", &[("shape", shape)]);
                let (shot, casters) = (stage.shot(host), stage.casters());
                let r = &stage.renderer;
                let mirror = |casters| light_seen::visibility(&shot.data(), r.camera(), r.light(), casters, is_disc);
                let expected = mirror(&casters).unwrap();
                let what = format!("{} {share} {shape}", stage.name);
                compare(&seen, &expected, TOLERANCE).check(&what, 0.04);
                let partly = seen.iter().filter(|v| (0.01..0.99).contains(*v)).count();
                // Inside of a box all is dark, and the shadows of needles are thinner than a pixel.
                let shut = ["light in a mesh", "light in an open box", "needles"].contains(&stage.name.as_str());
                assert!(partly > 10 || shut, "{what}: {partly} pixels of penumbrae");
                let other = mirror(&casters[..1]).unwrap();
                let wrong = compare(&seen, &other, TOLERANCE).wrong;
                assert!(wrong > 0, "{what}: no pixel misses the other casters");
            }
        }
    });
}

/// Root of the mean squared difference from ray-traced truth, and the number of pixels off by more than a tenth.
fn off_truth(host: &Host, stage: &Stage<'_>, seen: &[&[f32]]) -> Vec<(f64, usize)> {
    let r = &stage.renderer;
    let rays = RayScene::build(&stage.scene).unwrap();
    let settings = SoftSettings { samples: 256, ..SoftSettings::default() };
    let truth = soft(&rays, r.camera(), r.light(), SIZE, &settings, &|_, _| ()).unwrap();
    let judged = truth.judged(&host.read_image::<u32>(&r.gbuffer().triangle).unwrap());
    let off = |v: &&[f32]| {
        let pixels = (0..v.len()).filter(|&i| judged[i]);
        let all: Vec<f64> = pixels.map(|i| f64::from(v[i] - truth.visibility[i]).abs()).collect();
        let mean = all.iter().map(|x| x * x).sum::<f64>() / all.len() as f64;
        (mean.sqrt(), all.iter().filter(|x| **x > 0.1).count())
    };
    seen.iter().map(off).collect()
}

/// 256 samples stand for the light, in the picture and in the truth.
#[test]
fn soft_shadows_are_close_to_ray_traced_truth() {
    with_gpu(|host| {
        let mut failed = vec![];
        for scene in every_shipped() {
            let mut stage = Stage::new(host, &scene.name.clone(), scene);
            let own = *stage.renderer.light();
            for (factor, most) in [(1.0, 0.0045), (3.0, 0.008)] {
                stage.set_light(enlarged(&own, factor));
                let [seen, hard] = ["exact-soft", "exact-hard"].map(|id| stage.seen(id, &[]));
                let [(off, far), (off_hard, _)] = off_truth(host, &stage, &[&seen, &hard])[..] else { unreachable!() };
                println!(
                    "{:12} x {factor}: RMSE {off:.4}, hard {off_hard:.4}; {far} pixels off by more than .1",
                    stage.name
                );
                if off > most || far > 2 {
                    failed.push(format!("{} x {factor}: RMSE {off:.4}, {far} pixels", stage.name));
                }
                // Hard shadows fail this test.
                assert!(off_hard > most, "{}: {off_hard}", stage.name);
            }
        }
        assert!(failed.is_empty(), "{}", failed.join("\n"));
    });
}

/// The same for the small scenes.
#[test]
fn soft_shadows_of_small_scenes_are_close_to_ray_traced_truth() {
    with_gpu(|host| {
        let mut failed = vec![];
        for stage in stages(host) {
            let mut stage = stage.with_light_size(0.1);
            let seen = stage.seen("exact-soft", &[]);
            let [(off, far)] = off_truth(host, &stage, &[&seen])[..] else { unreachable!() };
            println!("{:32}: RMSE {off:.4}; {far} pixels off by more than .1", stage.name);
            if off > 0.006 || far > 0 {
                failed.push(format!("{}: RMSE {off:.4}, {far} pixels", stage.name));
            }
        }
        assert!(failed.is_empty(), "{}", failed.join("\n"));
    });
}

/// Cards above each other, from below: the rim of the stack has a penumbra, and its counters go up to what they can hold.
#[test]
fn a_stack_of_cards_is_dark() {
    with_gpu(|host| {
        for cards in [40u32, 64, 128] {
            let card = |i: u32| (plane(1.0), moved(dvec3(0.0, 1.0 + 0.002 * f64::from(i), 0.0)));
            let parts = std::iter::once((plane(6.0), moved(DVec3::ZERO))).chain((0..cards).map(card)).collect();
            let camera = perspective(dvec3(-3.0, 0.9, 3.0), dvec3(0.0, 0.0, 0.0), 0.1);
            let lamp = spot(dvec3(0.2, 6.0, 0.1), DVec3::ZERO, 0.8);
            let mut stage = Stage::new(host, &format!("{cards} cards"), made::scene(parts, camera, lamp));
            stage = stage.with_light_size(0.2);
            let seen = stage.seen("exact-soft", &[]);
            let (shot, casters) = (stage.shot(host), stage.casters());
            let r = &stage.renderer;
            let expected = light_seen::visibility(&shot.data(), r.camera(), r.light(), &casters, false).unwrap();
            compare(&seen, &expected, TOLERANCE).check(&stage.name, 0.03);
        }
    });
}
