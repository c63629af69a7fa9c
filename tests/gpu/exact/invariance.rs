//! What must not change the picture: the grid, skipping, repetition; and a light without size.

use super::{MAP, SIZE, Stage, stages};
use crate::common::{assert_same_bits, desc, differing, prepare, with_gpu};
use crate::made::{moved, perspective, plane, scene, spot};
use crate::properties::hits;
use edgeshade::host::Host;
use edgeshade::reference::ray_traced::Hit;
use edgeshade::scene::{Renderer, Scene};
use edgeshade::view::{LightKind, LightView};
use glam::{DAffine3, DMat4, DVec3, dvec3};

/// A few of the small scenes, and two shipped ones with penumbrae.
fn some(host: &Host) -> impl Iterator<Item = Stage<'_>> {
    let shipped = ["jenga", "fence"].map(|name| Stage::shipped(host, name));
    stages(host).step_by(5).map(|stage| stage.with_light_size(0.2)).chain(shipped)
}

/// The borders of 960 and 1024 cells lie beside each other by all fifteenths of a cell.
#[test]
fn the_grid_does_not_change_the_picture() {
    with_gpu(|host| {
        for mut stage in some(host) {
            for id in ["exact-hard", "exact-soft"] {
                let first = stage.seen(id, &[("cells", "64")]);
                for cells in ["100", "192", "512", "960", "1024"] {
                    let seen = stage.seen(id, &[("cells", cells)]);
                    assert_same_bits(&first, &seen, &format!("{} {id}, {cells} cells", stage.name));
                }
                assert!(first.contains(&0.0) && first.contains(&1.0), "{} {id}", stage.name);
            }
        }
    });
}

/// A view of the light that is wider or shifted moves the receivers by sixteenths of a cell. It also rounds otherwise, so
/// some pixels differ.
#[test]
fn the_place_in_the_grid_does_not_change_the_picture() {
    with_gpu(|host| {
        for mut stage in some(host) {
            let own = *stage.renderer.light();
            let view = |shift: f64| {
                let sixteenth = 2.0 / 128.0 / 16.0;
                let by = if own.is_directional() { dvec3(shift, -0.5 * shift, 0.0) * sixteenth } else { DVec3::ZERO };
                let narrower = if own.is_directional() { 0.9 } else { 0.9 - 0.01 * shift };
                let wider = DMat4::from_scale(dvec3(narrower, narrower, 1.0)) * own.clip_from_view;
                LightView { clip_from_view: DMat4::from_translation(by) * wider, ..own }
            };
            // Receivers that stay inside, wherever the view is shifted to. Others are lit.
            let ndc = |p: DVec3| {
                let q = own.world_from_view.inverse().transform_point3(p);
                let q = view(0.0).clip_from_view * q.extend(1.0);
                q.truncate() / q.w
            };
            let hits = hits(&stage.scene, &stage.renderer, SIZE);
            let stays = |hit: &Option<Hit>| hit.is_some_and(|h| ndc(h.position).abs().max_element() < 0.98);
            let inside: Vec<usize> = (0..hits.len()).filter(|&i| stays(&hits[i])).collect();
            assert!(inside.len() > 300, "{}", stage.name);
            for id in ["exact-hard", "exact-soft"] {
                let seen = |stage: &mut Stage<'_>, light| {
                    stage.set_light(light);
                    let seen = stage.seen(id, &[("cells", "128")]);
                    inside.iter().map(|&i| seen[i]).collect::<Vec<_>>()
                };
                let first = seen(&mut stage, view(0.0));
                let mut most = 0;
                for shift in [1.0, 3.0, 8.0] {
                    let seen = seen(&mut stage, view(shift));
                    // Two samples.
                    most = most.max(differing(&first, &seen, 2.0 / 256.0));
                    assert!(differing(&first, &seen, 0.0) * 50 < seen.len(), "{} {id}", stage.name);
                }
                println!("{:32} {id}: {most} of {} pixels differ", stage.name, first.len());
                assert!(most * 2000 <= first.len().max(2000), "{} {id}: {most} pixels differ", stage.name);
                // A light that moves by a twentieth of its distance is noticed.
                let by = DAffine3::from_translation(0.05 * own.position().length() * DVec3::X);
                let turned = DAffine3::from_rotation_y(0.05);
                let moved = if own.is_directional() { own.world_from_view * turned } else { by * own.world_from_view };
                let seen = seen(&mut stage, LightView { world_from_view: moved, ..view(0.0) });
                assert!(differing(&first, &seen, 2.0 / 256.0) * 500 > seen.len(), "{} {id}", stage.name);
            }
            stage.set_light(own);
        }
    });
}

#[test]
fn a_light_without_size_gives_hard_shadows() {
    with_gpu(|host| {
        for mut stage in some(host) {
            let soft = stage.seen("exact-soft", &[]);
            assert!(soft.iter().any(|v| *v > 0.0 && *v < 1.0), "{}: the light has a size", stage.name);
            let mut light = *stage.renderer.light();
            light.kind = match light.kind {
                LightKind::Spot { .. } => LightKind::Spot { size: 0.0 },
                LightKind::Directional { .. } => LightKind::Directional { angle: 0.0 },
            };
            stage.set_light(light);
            let hard = stage.seen("exact-hard", &[]);
            assert_same_bits(&hard, &stage.seen("exact-soft", &[]), &stage.name);
        }
    });
}

#[test]
fn skipping_does_not_change_the_picture() {
    with_gpu(|host| {
        for mut stage in some(host) {
            let off = stage.seen("exact-soft", &[("skip", "off")]);
            assert_same_bits(&off, &stage.seen("exact-soft", &[]), &stage.name);
        }
    });
}

/// Nothing is left of an earlier frame, not even of one under another light.
#[test]
fn frames_repeat() {
    with_gpu(|host| {
        for mut stage in some(host) {
            for id in ["exact-hard", "exact-soft"] {
                let mut technique = prepare(&stage.renderer, id, &[]);
                let own = *stage.renderer.light();
                let by = DAffine3::from_translation(dvec3(0.4, 0.1, -0.3)) * own.world_from_view;
                let other = LightView { world_from_view: by * DAffine3::from_rotation_y(0.15), ..own };
                let frames = [own, own, other, own].map(|light| {
                    stage.set_light(light);
                    stage.renderer.frame(technique.as_mut()).unwrap();
                    stage.renderer.visibility(technique.as_ref()).unwrap()
                });
                assert_same_bits(&frames[0], &frames[1], &stage.name);
                assert!(
                    differing(&frames[0], &frames[2], 0.0) > 20,
                    "{} {id}: the other light is no other",
                    stage.name
                );
                assert_same_bits(&frames[0], &frames[3], &stage.name);
            }
        }
    });
}

/// A camera that sees a spot smaller than a cell, under cards that the light sees all over the map.
#[test]
fn all_receivers_in_one_cell() {
    with_gpu(|host| {
        let card = |i: i32| (plane(0.02), moved(dvec3(0.05 * f64::from(i) - 0.5, 1.0, 0.031 * f64::from(i % 3))));
        let parts = std::iter::once((plane(8.0), moved(DVec3::ZERO))).chain((0..21).map(card)).collect();
        let light = spot(dvec3(0.0, 7.0, 1.5), DVec3::ZERO, 0.8);
        let narrow: Scene = scene(parts, perspective(dvec3(0.02, 0.6, 0.3), dvec3(0.0, 0.0, -0.2), 0.01), light);
        let stage = Stage::new(host, "one cell", narrow).with_light_size(0.02);
        let Stage { renderer, scene, .. } = &stage;
        // The camera's image is an inch wide.
        let mut close = *renderer.camera();
        close.clip_from_view.x_axis *= 12.0;
        close.clip_from_view.y_axis *= 12.0;
        let light = *renderer.light();
        let mut r = Renderer::new(host, scene, close, &scene.lights[0], desc(SIZE, MAP)).unwrap();
        r.set_light(scene, light);
        for id in ["exact-hard", "exact-soft"] {
            let coarse = crate::common::visibility(&mut r, id, &[("cells", "64")]);
            let fine = crate::common::visibility(&mut r, id, &[("cells", "1024")]);
            assert_same_bits(&coarse, &fine, id);
            assert!(coarse.iter().any(|v| *v < 1.0) && coarse.contains(&1.0), "{id}");
        }
    });
}
