//! Properties of every technique, for any scene.

use crate::common::{assert_in_range, assert_same_bits, desc, differing, prepare, renderer, shipped_scene, visibility};
use crate::common::{every_nth, every_shipped, frame, is_full_sweep, with_gpu};
use crate::made::{self, moved, perspective, plane, point, spot, still_life, sun};
use edgeshade::host::Host;
use edgeshade::reference::ray_traced::RayScene;
use edgeshade::scene::{Moving, RenderDesc, Renderer, Scene};
use edgeshade::technique::{ALL, Kind};
use edgeshade::view::{LightView, look_at};
use glam::{DAffine3, DMat3, DVec3, dvec3};

const SIZE: [u32; 2] = [160, 90];

/// Every real-time technique in every mode. `every_technique_has_a_mode` notices when one is missing.
const MODES: &[(&str, &[(&str, &str)])] = &[
    ("sm", &[]),
    ("pcf", &[("width", "1"), ("skip", "off")]),
    ("pcf", &[("width", "3"), ("fetch", "loop"), ("skip", "tiles")]),
    ("pcf", &[("width", "15"), ("fetch", "gather"), ("skip", "pixels")]),
    ("vsm", &[]),
    ("vsm", &[("filter", "gaussian"), ("width", "9"), ("fetch", "texels")]),
    ("evsm", &[]),
    ("evsm", &[("bits", "16"), ("warps", "positive"), ("mips", "off")]),
    ("msm", &[]),
    ("msm", &[("bits", "16"), ("reconstruction", "hausdorff"), ("width", "7")]),
    ("rbsm", &[("skip", "off")]),
    ("rbsm-filtered", &[]),
    ("rbsm-branches", &[]),
    ("rbsm-listings", &[("variant", "filtered")]),
    ("rbsm-star", &[("skip", "off")]),
    ("rbsm-profile", &[("quality", "line"), ("skip", "off")]),
    ("rpcf", &[("width", "31"), ("visibility", "star"), ("skip", "off")]),
    ("pcss", &[]),
    ("vssm", &[]),
    ("mssm", &[]),
    ("mssm", &[("window", "31"), ("classify", "off")]),
    ("rbssm", &[]),
    ("rbssm-naive", &[]),
    ("soft-auto", &[]),
    ("ssrbssm", &[]),
    ("ssabss", &[("skip", "off")]),
    ("edtssm", &[]),
    ("edtssm-star", &[]),
    ("edtsm", &[]),
    ("edtsm-star", &[]),
    ("shadow-volumes", &[]),
    ("shadow-volumes", &[("path", "geometry"), ("count", "float"), ("robust", "always")]),
    ("sssm", &[]),
    ("edsm", &[]),
    ("edsm-x", &[]),
    ("edsm-x", &[("border", "1")]),
    ("exact-hard", &[]),
    ("exact-soft", &[]),
    ("exact-soft", &[("shape", "disc"), ("skip", "off"), ("cells", "64")]),
];

/// Modes of which only the range can be checked. The papers' fixed depth gives false shadow on everything that is not
/// parallel to the map, and soft borders from a map of distances have no depth of the edges.
const FIXED: &[(&str, &[(&str, &str)])] = &[
    ("edsm", &[("border", "4")]),
    ("rbsm-filtered", &[("receiver", "fixed"), ("max_distance", "1"), ("skip", "off")]),
    ("rpcf", &[("receiver", "fixed"), ("visibility", "profile"), ("skip", "off")]),
];

#[test]
fn every_technique_has_a_mode() {
    let real_time = ALL.iter().filter(|t| matches!(t.kind, Kind::RealTime(_)));
    let missing: Vec<_> = real_time.filter(|t| MODES.iter().all(|m| m.0 != t.id)).map(|t| t.id).collect();
    assert_eq!(missing, [""; 0], "techniques without a row in MODES");
}

fn fixed_stays_in_range(renderer: &mut Renderer<'_>, what: &str) {
    for (id, settings) in FIXED {
        assert_in_range(&visibility(renderer, id, settings), &format!("{what}: {id} {settings:?}"));
    }
}

/// Runs every mode, checks the range, and passes visibility to `check` with the mode's description.
fn every_mode(renderer: &mut Renderer<'_>, what: &str, mut check: impl FnMut(&[f32], &str)) {
    for (id, settings) in MODES {
        let values = visibility(renderer, id, settings);
        let what = format!("{what}: {id} {settings:?}");
        assert_in_range(&values, &what);
        check(&values, &what);
    }
}

fn count(values: &[f32], is: impl Fn(f32) -> bool) -> usize {
    values.iter().filter(|v| is(**v)).count()
}

/// Visibility from which a mode's pixel counts as lit. The moments of a window that a tilted receiver fills itself do not
/// tell it from an occluder for certain, so bounds from them shade it.
fn least_lit(what: &str) -> f32 {
    match what {
        w if w.contains(": msm ") || w.contains(": mssm ") => 0.8,
        _ => 1.0,
    }
}

fn all_lit() -> impl FnMut(&[f32], &str) {
    move |values, what| {
        let others = count(values, |v| v < least_lit(what));
        assert_eq!(others, 0, "{what}: {others} of {} pixels are not lit", values.len());
    }
}

/// Returns the hit of each pixel's ray; `None` for the sky.
pub fn hits(
    scene: &Scene,
    renderer: &Renderer<'_>,
    size: [u32; 2],
) -> Vec<Option<edgeshade::reference::ray_traced::Hit>> {
    let rays = RayScene::build(scene).unwrap();
    let ndc = |i: u32, n: u32| (2.0 * f64::from(i) + 1.0) / f64::from(n) - 1.0;
    (0..size[0] * size[1])
        .map(|i| {
            let (origin, direction) = renderer.camera().ray([ndc(i % size[0], size[0]), ndc(i / size[0], size[1])]);
            rays.primary(origin, direction)
        })
        .collect()
}

#[test]
fn shipped_scenes_stay_in_range_with_and_without_normals() {
    with_gpu(|host| {
        for (i, scene) in every_nth(2, every_shipped()).enumerate() {
            for (k, normals) in [true, false].into_iter().enumerate() {
                if !is_full_sweep() && (i + k) % 2 != 0 {
                    continue;
                }
                let mut r = renderer(host, &scene, RenderDesc { normals, ..desc(SIZE, 512) });
                every_mode(&mut r, &scene.name, |values, what| {
                    assert!(count(values, |v| v == 0.0) > 0 && count(values, |v| v == 1.0) > 0, "{what}");
                });
                fixed_stays_in_range(&mut r, &scene.name);
            }
        }
    });
}

#[test]
fn without_casters_everything_is_lit() {
    with_gpu(|host| {
        for light in [sun(dvec3(1.0, 2.0, 0.5)), spot(dvec3(2.0, 9.0, 1.0), DVec3::ZERO, 0.9)] {
            let camera = perspective(dvec3(0.0, 6.0, 12.0), DVec3::ZERO, 0.1);
            let scene = made::scene(vec![(plane(5.0), DAffine3::IDENTITY)], camera, light);
            let mut r = renderer(host, &scene, desc(SIZE, 256));
            every_mode(&mut r, "a ground alone", all_lit());
        }
    });
}

/// A view without a shadow edge leaves no tile and no pixel to the passes that work on lists; one with shadows leaves some.
#[test]
fn lists_are_empty_without_an_edge() {
    with_gpu(|host| {
        // The shadow falls towards the camera, which sees its edge.
        let light = || sun(dvec3(1.0, 1.5, -1.0));
        let camera = || perspective(dvec3(0.0, 4.0, 2.0), DVec3::ZERO, 0.1);
        let ground = || (plane(20.0), DAffine3::IDENTITY);
        let box_on_it = (made::cuboid(DVec3::splat(0.3)), moved(dvec3(0.0, 0.5, 0.0)));
        let cases = [(vec![ground()], false), (vec![ground(), box_on_it], true)];
        for (parts, has_edge) in cases {
            let scene = made::scene(parts, camera(), light());
            // Tiles that leave the image are never decided whole.
            let mut r = renderer(host, &scene, desc([160, 88], 512));
            let mut check = |id: &str, settings: &[(&str, &str)]| {
                let lists: Vec<_> = frame(&mut r, id, settings)
                    .1
                    .passes
                    .into_iter()
                    .filter_map(|p| p.tiles.map(|tiles| (p.name, tiles.active)))
                    .collect();
                assert!(!lists.is_empty(), "{id} {settings:?} counts nothing");
                let found = lists.iter().any(|(_, active)| *active > 0);
                assert_eq!(found, has_edge, "{id} {settings:?}: {lists:?}");
            };
            for id in ["rbsm", "rbsm-filtered", "rbsm-branches", "rbsm-star", "rbsm-profile"] {
                for skip in ["list", "tiles"] {
                    check(id, &[("skip", skip)]);
                }
            }
            check("pcf", &[("width", "15")]);
            check("pcf", &[("skip", "tiles")]);
            for id in ["rpcf", "edtsm", "edtsm-star", "edtssm", "edtssm-star"] {
                check(id, &[]);
            }
        }
    });
}

#[test]
fn every_size_works() {
    with_gpu(|host| {
        let scene = still_life(sun(dvec3(-1.0, 2.0, 1.0)));
        let few = [([1, 1], 64), ([333, 127], 100), ([48, 27], 1), ([48, 27], 65)];
        let more = [([1, 7], 64), ([7, 1], 64), ([4096, 16], 256), ([48, 27], 2), ([48, 27], 63), ([48, 27], 4096)];
        let more = if is_full_sweep() { &more[..] } else { &[] };
        for &(size, map) in few.iter().chain(more) {
            let mut r = renderer(host, &scene, desc(size, map));
            every_mode(&mut r, &format!("{size:?}, map {map}"), |values, _| {
                assert_eq!(values.len(), (size[0] * size[1]) as usize);
            });
            fixed_stays_in_range(&mut r, &format!("{size:?}, map {map}"));
            let off = visibility(&mut r, "pcf", &[("width", "7"), ("skip", "off")]);
            for skip in ["pixels", "tiles"] {
                let on = visibility(&mut r, "pcf", &[("width", "7"), ("skip", skip)]);
                assert_same_bits(&off, &on, &format!("{size:?}, map {map}, skip {skip}"));
            }
        }
    });
}

#[test]
fn impossible_sizes_are_errors() {
    with_gpu(|host| {
        let scene = still_life(sun(DVec3::ONE));
        for bad in [desc([0, 4], 64), desc([4, 0], 64), desc([4, 4], 0), desc([20000, 4], 64), desc([4, 4], 20000)] {
            let camera = scene.cameras[0].view(bad.size);
            let error = Renderer::new(host, &scene, camera, &scene.lights[0], bad).err().unwrap().to_string();
            assert!(error.contains("16384"), "{error}");
        }
    });
}

#[test]
fn a_light_shut_into_a_box_lights_nothing_outside() {
    with_gpu(|host| {
        let light = spot(dvec3(0.0, 4.0, 0.0), DVec3::ZERO, 0.7);
        let lamp = moved(dvec3(0.0, 4.0, 0.0));
        let parts = vec![(plane(6.0), DAffine3::IDENTITY), (made::cuboid(DVec3::splat(0.5)), lamp)];
        let scene = made::scene(parts, perspective(dvec3(0.0, 3.0, 9.0), DVec3::ZERO, 0.1), light);
        let mut r = renderer(host, &scene, desc(SIZE, 512));
        let hits = hits(&scene, &r, SIZE);
        let inside = |p: DVec3| {
            let l = r.light();
            let c = l.clip_from_view * l.world_from_view.inverse().transform_point3(p).extend(1.0);
            // Inside the map by more than 20 texels, which is at least half of the widest kernel, because everything
            // outside the map is lit.
            c.w > 0.0 && c.x.abs().max(c.y.abs()) < (1.0 - 40.0 / 512.0) * c.w
        };
        let on_ground: Vec<bool> =
            hits.iter().map(|h| h.is_some_and(|h| h.triangle < 2 && inside(h.position))).collect();
        assert!(on_ground.iter().filter(|g| **g).count() > 1000);
        every_mode(&mut r, "light in a box", |values, what| {
            let leaks = values.iter().zip(&on_ground).filter(|(v, g)| **g && **v != 0.0).count();
            assert_eq!(leaks, 0, "{what}: light leaks");
        });
    });
}

#[test]
fn a_light_that_looks_away_shadows_only_what_faces_away() {
    with_gpu(|host| {
        // The light is above the scene and looks up, so everything is behind it.
        let light = spot(dvec3(0.0, 6.0, 0.0), dvec3(0.0, 12.0, 0.1), 0.6);
        let scene = still_life(light);
        let mut r = renderer(host, &scene, desc(SIZE, 128));
        let light = dvec3(0.0, 6.0, 0.0);
        let facing: Vec<f64> = hits(&scene, &r, SIZE)
            .iter()
            .map(|h| h.map_or(1.0, |h| h.normal.dot((light - h.position).normalize())))
            .collect();
        every_mode(&mut r, "light looks away", |values, what| {
            // Where bodies turn away from the light there is an edge too, with penumbrae of a fixed width around it.
            let terminator = if what.contains("edtsm") { 0.2 } else { 1e-2 };
            let wrong = values
                .iter()
                .zip(&facing)
                .filter(|(v, f)| f.abs() > terminator && if **f > 0.0 { **v < least_lit(what) } else { **v > 0.0 });
            // Pixels at edges may show the other of two surfaces.
            let wrong = wrong.count();
            assert!(wrong * 500 <= values.len(), "{what}: {wrong} pixels");
        });
    });
}

#[test]
fn nothing_to_see_is_lit() {
    with_gpu(|host| {
        // All pixels are the same.
        let size = [64, 36];
        let mut empty = renderer(host, &Scene::default(), desc(size, 64));
        every_mode(&mut empty, "empty scene", all_lit());
        let mut scene = still_life(sun(DVec3::ONE));
        scene.cameras = vec![perspective(dvec3(0.0, 5.0, 0.0), dvec3(0.0, 50.0, 1.0), 0.1)];
        let mut sky = renderer(host, &scene, desc(size, 64));
        every_mode(&mut sky, "camera at the sky", all_lit());
        // A mesh without triangles, and one whose triangles are points.
        let point = [DVec3::ONE; 3];
        let parts = vec![(made::mesh(&[]), DAffine3::IDENTITY), (made::mesh(&[point]), DAffine3::IDENTITY)];
        let scene = made::scene(parts, perspective(dvec3(0.0, 0.0, 9.0), DVec3::ZERO, 0.1), sun(DVec3::ONE));
        every_mode(&mut renderer(host, &scene, desc(size, 64)), "degenerate", all_lit());
    });
}

/// Near planes a millionth of the distances.
#[test]
fn far_ranges_hold() {
    with_gpu(|host| {
        // A ground a thousand units away under a hanging plate.
        let camera = perspective(dvec3(0.0, 800.0, 600.0), DVec3::ZERO, 1e-3);
        let parts = || vec![(plane(300.0), DAffine3::IDENTITY), (plane(60.0), moved(dvec3(0.0, 40.0, 0.0)))];
        let scene = made::scene(parts(), camera.clone(), sun(dvec3(0.4, 1.0, 0.2)));
        let mut r = renderer(host, &scene, desc(SIZE, 512));
        every_mode(&mut r, "camera range 1e6", |values, what| {
            let dark = count(values, |v| v < 0.5);
            assert!(dark > 20 && dark < values.len() / 4, "{what}: {dark} dark pixels");
        });

        // The light's own range. The plate hangs where a 1e6 range can still separate it from the ground.
        let eye = dvec3(0.0, 900.0, 0.0);
        let mut parts = parts();
        parts[1] = (plane(0.2), moved(dvec3(0.0, 897.0, 0.0)));
        let scene = made::scene(parts, camera, spot(eye, DVec3::ZERO, 0.4));
        let mut r = renderer(host, &scene, desc(SIZE, 512));
        r.set_light(&scene, LightView::spot(look_at(eye, DVec3::ZERO), 0.8, 1e-3, 1e3, 0.0));
        let hits = hits(&scene, &r, SIZE);
        every_mode(&mut r, "light range 1e6", |values, what| {
            let (mut dark, mut lit) = (0, 0);
            for (v, hit) in values.iter().zip(&hits) {
                let Some(hit) = hit.filter(|h| h.triangle < 2) else { continue };
                // The plate's shadow is a square of half width 60, and a texel is 1.5 wide: the widest kernel reaches
                // 25 units.
                let p = hit.position.abs();
                let (inside, outside) = (p.x.max(p.z) < 35.0, p.x.max(p.z) > 85.0);
                dark += usize::from(inside && *v > 0.0);
                lit += usize::from(outside && *v < least_lit(what));
            }
            assert_eq!((dark, lit), (0, 0), "{what}: lit inside the shadow, dark outside");
        });
    });
}

/// Data that depends only on the shadow map is kept while the light stands still, and equals newly made data.
#[test]
fn a_kept_light_equals_a_new_one() {
    with_gpu(|host| {
        let scene = shipped_scene("jenga");
        let settings = [("width", "7"), ("skip", "tiles")];
        let fresh = visibility(&mut renderer(host, &scene, desc(SIZE, 333)), "pcf", &settings);
        let mut kept = renderer(host, &scene, RenderDesc { moving: Moving::Camera, ..desc(SIZE, 333) });
        let mut technique = prepare(&kept, "pcf", &settings);
        let names = |t: edgeshade::timing::FrameTiming| t.passes.into_iter().map(|p| p.name).collect::<Vec<_>>();
        let first = names(kept.frame(technique.as_mut()).unwrap());
        let second = names(kept.frame(technique.as_mut()).unwrap());
        for pass in ["shadow map", "depth bounds"] {
            assert!(first.iter().any(|n| n == pass) && !second.iter().any(|n| n == pass), "{first:?}, {second:?}");
        }
        assert_same_bits(&fresh, &kept.visibility(technique.as_ref()).unwrap(), "kept");

        // Another light, and back.
        let old = *kept.light();
        let mut turned = old;
        turned.world_from_view = DAffine3::from_rotation_y(0.3) * old.world_from_view;
        kept.set_light(&scene, turned);
        let third = names(kept.frame(technique.as_mut()).unwrap());
        assert!(third.iter().any(|n| n == "depth bounds"), "{third:?}");
        let moved = kept.visibility(technique.as_ref()).unwrap();
        assert!(differing(&fresh, &moved, 0.0) > 100, "the light has not moved");
        let mut anew = renderer(host, &scene, desc(SIZE, 333));
        anew.set_light(&scene, turned);
        assert_same_bits(&visibility(&mut anew, "pcf", &settings), &moved, "moved");
        kept.set_light(&scene, old);
        kept.frame(technique.as_mut()).unwrap();
        assert_same_bits(&fresh, &kept.visibility(technique.as_ref()).unwrap(), "moved back");
    });
}

/// Returns the scene with its cameras and lights mirrored at the plane x = 0; transforms of views stay rigid.
fn mirrored(scene: &Scene) -> Scene {
    let flip = DAffine3::from_mat3(DMat3::from_diagonal(dvec3(-1.0, 1.0, 1.0)));
    let mut out = scene.clone();
    for i in &mut out.instances {
        i.world_from_object = flip * i.world_from_object;
    }
    for c in &mut out.cameras {
        c.world_from_camera = flip * c.world_from_camera * flip;
    }
    for l in &mut out.lights {
        l.world_from_light = flip * l.world_from_light * flip;
    }
    out
}

#[test]
fn a_mirrored_scene_gives_the_mirror_image() {
    with_gpu(|host| {
        for scene in every_nth(4, every_shipped()) {
            let other = mirrored(&scene);
            let [mut a, mut b] = [&scene, &other].map(|s| renderer(host, s, desc(SIZE, 512)));
            for (id, settings) in MODES {
                let straight = visibility(&mut a, id, settings);
                let turned = visibility(&mut b, id, settings);
                let back: Vec<f32> = turned.chunks(SIZE[0] as usize).flat_map(|r| r.iter().rev().copied()).collect();
                // Pixel and texel centres on an edge fall to the other side. On concave receivers, a wide kernel's
                // plane touches the surface in many texels, where the map's precision decides single taps.
                let off = differing(&straight, &back, 0.05);
                println!("mirrored {:10} {id:4} {off:4} of {} pixels differ", scene.name, straight.len());
                // The search for edges is not exact where many surfaces meet, and its blocks of pixels lie
                // differently.
                let most = if id.starts_with("edtsm") { straight.len() / 80 } else { straight.len() / 200 };
                assert!(off <= most, "{}: {id} {settings:?}: {off} pixels", scene.name);
                assert!(differing(&straight, &turned, 0.5) > straight.len() / 50, "the image is its own mirror image");
            }
        }
    });
}

/// A negative scale turns triangles inside out, which must not be visible.
#[test]
fn a_mirrored_instance_equals_its_explicit_geometry() {
    with_gpu(|host| {
        let t = DAffine3 {
            matrix3: DMat3::from_rotation_y(0.7) * DMat3::from_diagonal(dvec3(-1.3, 0.8, 1.1)),
            translation: dvec3(0.0, 1.2, 0.0),
        };
        let body = made::sphere(12, 20);
        let mut triangles = vec![];
        for c in body.indices.chunks(3) {
            let [a, b, d] = [c[0], c[1], c[2]].map(|i| t.transform_point3(point(body.positions[i as usize])));
            triangles.push([a, d, b]);
        }
        let with = |part, place| {
            let parts = vec![(plane(5.0), DAffine3::IDENTITY), (part, place)];
            let camera = perspective(dvec3(1.0, 4.0, 6.0), dvec3(0.0, 0.6, 0.0), 0.1);
            let mut scene = made::scene(parts, camera, sun(dvec3(1.0, 1.5, 0.4)));
            // Back faces are culled, so a wrong winding would show the inside.
            scene.materials[0].double_sided = false;
            scene
        };
        let scenes = [with(body, t), with(made::mesh(&triangles), DAffine3::IDENTITY)];
        let [mut a, mut b] = [&scenes[0], &scenes[1]].map(|s| renderer(host, s, desc(SIZE, 512)));
        for (id, settings) in MODES {
            let (x, y) = (visibility(&mut a, id, settings), visibility(&mut b, id, settings));
            let off = differing(&x, &y, 0.05);
            println!("mirrored instance {id:4} {off} of {} pixels differ", x.len());
            assert!(off * 1000 <= x.len(), "{id} {settings:?}: {off} pixels");
        }
        let ids = |r: &Renderer<'_>, host: &Host| host.read_image::<u32>(&r.gbuffer().triangle).unwrap();
        let (x, y) = (ids(&a, host), ids(&b, host));
        let off = x.iter().zip(&y).filter(|(a, b)| a != b).count();
        assert!(off * 200 <= x.len(), "{off} triangle ids differ");
        assert!(x.iter().filter(|i| (2..u32::MAX).contains(*i)).count() > 500, "the body is not seen");
    });
}
