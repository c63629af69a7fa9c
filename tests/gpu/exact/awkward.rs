//! Scenes that are hard for lists, compared with rays to the samples of the light.

use super::hard::{transformed, with_far_vertices};
use super::{MAP, SIZE, Stage, over, spot_from, traced};
use crate::caster_edges::shadow_volumes::Random;
use crate::common::{assert_in_range, desc, prepare, shipped_scene, visibility, with_gpu};
use crate::made::{self, cuboid, mesh, moved, perspective, sphere};
use edgeshade::host::Host;
use edgeshade::reference::ray_traced::{RayScene, hard};
use edgeshade::scene::{Mesh, Renderer, Scene};
use edgeshade::view::{LightKind, LightView, look_along};
use glam::{DAffine3, DVec3, dvec3};

fn staged<'h>(host: &'h Host, name: &str, scene: Scene, light: LightView, size: f64) -> Stage<'h> {
    let mut stage = Stage::new(host, name, scene);
    stage.set_light(LightView { kind: LightKind::Spot { size }, ..light });
    stage
}

/// Bars that stand and lie in rows, much thinner than their penumbrae: many edges over each receiver, and layers that
/// only together hide the light.
fn bars() -> Scene {
    let mut parts = vec![];
    for i in -5..=5 {
        for k in -5..=5 {
            parts.push((cuboid(dvec3(0.03, 0.7, 0.03)), moved(0.5 * dvec3(i.into(), 0.0, k.into()) + 0.7 * DVec3::Y)));
        }
        parts.push((cuboid(dvec3(2.6, 0.03, 0.03)), moved(dvec3(0.0, 1.5, 0.5 * f64::from(i) + 0.11))));
    }
    over(parts)
}

/// Triangles a thousandth as wide as they are long, and thinner still.
fn needles() -> Mesh {
    let mut random = Random(11);
    let needle = |i: i32| {
        let (p, d) = (random.point(), random.point());
        [p, p + d, p + 0.5 * d + 0.1f64.powi(1 + i % 5) * 0.1 * random.point()]
    };
    mesh(&(0..600).map(needle).collect::<Vec<_>>())
}

/// Four walls around a lamp, open above and below.
fn shade(half: f64) -> Mesh {
    let mut mesh = cuboid(DVec3::splat(half));
    let lid = |t: &[u32]| {
        [1.0f64, -1.0].iter().any(|s| t.iter().all(|&i| f64::from(mesh.positions[i as usize][1]) == half * s))
    };
    mesh.indices = mesh.indices.chunks_exact(3).filter(|t| !lid(t)).flatten().copied().collect();
    mesh
}

/// A room's wall that rises past the light, and a post before it.
fn beside_the_light() -> (Scene, LightView) {
    let wall = mesh(&[
        [dvec3(-4.0, 0.0, -1.0), dvec3(4.0, 0.0, -1.0), dvec3(4.0, 3.0, -1.0)],
        [dvec3(-4.0, 0.0, -1.0), dvec3(4.0, 3.0, -1.0), dvec3(-4.0, 3.0, -1.0)],
    ]);
    let post = (cuboid(dvec3(0.1, 0.9, 0.1)), moved(dvec3(0.5, 0.9, -0.6)));
    let scene = over(vec![(wall, DAffine3::IDENTITY), post]);
    (scene, LightView::spot(look_along(dvec3(0.1, 2.0, 0.2), DVec3::NEG_Y), 2.9, 0.03, 12.0, 0.0))
}

#[test]
fn awkward_scenes_equal_traced_samples() {
    with_gpu(|host| {
        let lamp = dvec3(0.4, 4.0, 0.7);
        let (wall, beside) = beside_the_light();
        let hung =
            |mesh, at| over(vec![(mesh, moved(at)), (cuboid(dvec3(0.4, 0.3, 0.5)), moved(dvec3(0.0, 0.9, 0.0)))]);
        let stages = [
            // The light is as wide as it is high over the tops of the bars.
            (staged(host, "bars", bars(), spot_from(lamp, 0.5), 2.5), 7),
            (
                staged(host, "many needles", over(vec![(needles(), moved(1.5 * DVec3::Y))]), spot_from(lamp, 0.5), 0.6),
                3,
            ),
            (staged(host, "lamp shade", hung(shade(0.5), lamp), spot_from(lamp, 0.01), 0.4), 1),
            (staged(host, "lamp shade in the near plane", hung(shade(0.5), lamp), spot_from(lamp, 0.4), 0.4), 1),
            (staged(host, "lamp in a ball", hung(sphere(8, 12), lamp), spot_from(lamp, 0.01), 0.5), 1),
            (staged(host, "receivers beside the light", wall, beside, 0.5), 2),
        ];
        let mut failed = vec![];
        for (mut stage, few) in stages {
            let found = traced::check(host, &mut stage, false, few);
            let dark = stage.name == "lamp in a ball";
            assert!(found.partly > 100 || dark, "{}: {found}", stage.name);
            failed.extend(found.fault(&stage.name));
        }
        assert!(failed.is_empty(), "{}", failed.join("\n"));
    });
}

#[test]
fn scale_and_place_do_not_change_soft_shadows() {
    with_gpu(|host| {
        let scenes = [
            ("sun", made::still_life(made::sun(dvec3(0.7, 2.0, 0.4)))),
            ("spot", made::still_life(made::spot(dvec3(2.0, 7.0, 3.0), DVec3::ZERO, 0.9))),
            ("jenga", shipped_scene("jenga")),
        ];
        let mut failed = vec![];
        for (name, scene) in scenes {
            let mut changed: Vec<_> = [(1e-3, DVec3::ZERO), (1e3, DVec3::ZERO), (1.0, dvec3(1e5, -1e5, 1e5))]
                .map(|(f, by)| (format!("{name} times {f}, moved {}", by.x), transformed(&scene, f, by)))
                .into();
            changed.push((format!("{name}, vertices far from their origin"), with_far_vertices(&scene)));
            for (name, scene) in changed {
                let mut stage = Stage::new(host, &name, scene);
                let light = *stage.renderer.light();
                let middle = stage.scene.bounds().center();
                let kind = match light.kind {
                    LightKind::Spot { .. } => LightKind::Spot { size: 0.1 * light.position().distance(middle) },
                    LightKind::Directional { .. } => LightKind::Directional { angle: 0.1 },
                };
                stage.set_light(LightView { kind, ..light });
                let found = traced::check(host, &mut stage, false, 1);
                assert!(found.partly > 30, "{name}: {found}");
                // There, rounding by a spacing of 1/8192 unit moves edges across up to four samples.
                let few = name.contains("far from") && found.largest <= 5.0 / 256.0;
                failed.extend(found.fault(&name).filter(|_| !few));
            }
        }
        assert!(failed.is_empty(), "{}", failed.join("\n"));
    });
}

/// Lights on receivers and at vertices, without size and far too large, and casters whose numbers are not finite.
#[test]
fn every_value_is_a_number_from_0_to_1() {
    with_gpu(|host| {
        let nan = |at: usize, value: f32| {
            let mut mesh = cuboid(dvec3(0.6, 0.5, 0.4));
            mesh.positions[at] = [value, 0.0, 1.0];
            mesh
        };
        let flat = mesh(&[
            [DVec3::ZERO, DVec3::X, DVec3::X],
            [DVec3::Y, DVec3::Y, DVec3::Y],
            [DVec3::ZERO, DVec3::X, 2.0 * DVec3::X],
        ]);
        let casters = || {
            let block = cuboid(dvec3(0.6, 0.5, 0.4));
            let all = [block, nan(0, f32::NAN), nan(5, f32::INFINITY), nan(7, 3e38), flat.clone()];
            all.map(|m| (m, moved(dvec3(0.0, 0.5, 0.0)))).to_vec()
        };
        // In the air, at a corner of the box, on its side, on the ground, and below it.
        let places = [
            dvec3(0.4, 5.0, 0.7),
            dvec3(0.6, 1.0, 0.4),
            dvec3(0.6, 0.4, 0.1),
            dvec3(1.0, -0.001, 0.5),
            dvec3(0.3, -1.0, 0.1),
        ];
        let camera = perspective(dvec3(2.0, 4.0, 7.0), dvec3(0.0, 0.5, 0.0), 0.1);
        let scene = over(vec![(cuboid(dvec3(0.6, 0.5, 0.4)), moved(dvec3(0.0, 0.5, 0.0)))]);
        for (i, place) in places.into_iter().enumerate() {
            let scene = if i < 2 { over(casters()) } else { scene.clone() };
            let mut r = Renderer::new(host, &scene, camera.view(SIZE), &scene.lights[0], desc(SIZE, MAP)).unwrap();
            for near in [1e-6, 0.5] {
                for size in [0.0, 1e-30, 1e-3, 3.0, 1e4, 1e30] {
                    let light = LightView {
                        kind: LightKind::Spot { size },
                        ..LightView::spot(look_along(place, dvec3(-0.1, -1.0, 0.05).normalize()), 1.2, near, 20.0, 0.0)
                    };
                    r.set_light(&scene, light);
                    for id in ["exact-hard", "exact-soft"] {
                        assert_in_range(
                            &visibility(&mut r, id, &[]),
                            &format!("{id}, light of {size} at {place}, near plane {near}"),
                        );
                    }
                }
            }
        }
        // The check fails for what is no number.
        assert!(std::panic::catch_unwind(|| assert_in_range(&[0.0, f32::NAN], "")).is_err());
    });
}

/// A ball of a million triangles. Prints time and memory.
#[test]
fn a_million_triangles() {
    with_gpu(|host| {
        let ball = (sphere(708, 708), moved(dvec3(0.0, 1.1, 0.0)));
        let mut stage =
            staged(host, "a million triangles", over(vec![ball]), spot_from(dvec3(0.4, 4.0, 0.7), 0.5), 0.3);
        let triangles: usize = stage.topologies.iter().map(|t| t.triangles.len()).sum();
        let map = stage.seen("sm", &[]);
        let rays = RayScene::build(&stage.scene).unwrap();
        let truth = hard(&rays, stage.renderer.camera(), stage.renderer.light(), SIZE, &|_, _| ()).unwrap();
        let judged = truth.judged(&host.read_image::<u32>(&stage.renderer.gbuffer().triangle).unwrap());
        // The plain test of the map is wrong in some pixels, so the comparison can fail.
        assert!((0..map.len()).filter(|&i| judged[i] && map[i] != truth.visibility[i]).count() > 1);
        for id in ["exact-hard", "exact-soft"] {
            for (cells, entries) in [("512", "1048576"), ("1024", "4194304"), ("64", "1048576")] {
                let mut technique = prepare(&stage.renderer, id, &[("cells", cells), ("entries", entries)]);
                let timing = stage.renderer.frame(technique.as_mut()).unwrap();
                let seen = stage.renderer.visibility(technique.as_ref()).unwrap();
                assert_in_range(&seen, id);
                let counts: Vec<_> = timing.passes.iter().flat_map(|p| &p.counts).collect();
                let wrong = (0..seen.len())
                    .filter(|&i| judged[i] && id == "exact-hard" && seen[i] != truth.visibility[i])
                    .count();
                assert!(wrong <= 1, "{id}, {cells} cells: {wrong} wrong pixels");
                let of_map = (0..seen.len()).filter(|&i| seen[i] == map[i]).count();
                println!(
                    "{id}, {triangles} triangles, {cells} cells, room for {entries}: {:.0} ms, {} MiB, {wrong} wrong pixels, {of_map} as in the map, {counts:?}",
                    timing.total_gpu_ms,
                    technique.memory_bytes() >> 20
                );
            }
        }
        let found = traced::check(host, &mut stage, false, 3);
        assert!(found.fault("").is_none(), "{found}");
    });
}
