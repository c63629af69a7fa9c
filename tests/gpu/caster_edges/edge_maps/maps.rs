//! Maps compared with their mirrors, and the two ways to make one compared with each other.

use super::{FORMS, config, maps};
use crate::common::passes::Random;
use crate::common::{desc, frame, prepare, renderer, shipped_scene, with_gpu};
use crate::made::{self, cuboid, mesh, moved, perspective, plane, sphere, spot, still_life, sun};
use edgeshade::casters::topology::Topology;
use edgeshade::host::Host;
use edgeshade::reference::caster_edges::edge_segments::{Segment, clip_from_object};
use edgeshade::reference::caster_edges::silhouettes::{Facing, facing, silhouettes};
use edgeshade::reference::caster_edges::{edsm, sssm};
use edgeshade::scene::{Light, Moving, RenderDesc, Renderer, Scene};
use edgeshade::technique::{Params, find};
use edgeshade::view::LightKind;
use glam::{DAffine3, DMat3, DVec3, dvec3};

const SIZE: [u32; 2] = [64, 36];

/// Returns a scene of rotated, mirrored and stretched bodies, cards, needles and degenerate triangles.
fn mixed(light: Light) -> Scene {
    let mut random = Random(3);
    let mut corner = || DVec3::ZERO.map(|_| 4.0 * f64::from(random.unit()) - 2.0) + dvec3(0.0, 3.0, 0.0);
    let mut soup: Vec<[DVec3; 3]> = (0..40).map(|_| [corner(), corner(), corner()]).collect();
    let p = dvec3(1.0, 2.0, 0.5);
    soup.push([p, p, dvec3(2.0, 2.0, 0.0)]);
    soup.push([p, p + 1e-7 * DVec3::X, p + DVec3::Y]);
    soup.push([p; 3]);
    let mirrored = DAffine3 {
        matrix3: DMat3::from_rotation_y(0.7) * DMat3::from_diagonal(dvec3(-1.3, 0.8, 1.1)),
        translation: dvec3(-3.0, 1.2, 1.0),
    };
    let parts = vec![
        (plane(8.0), DAffine3::IDENTITY),
        (sphere(8, 14), mirrored),
        (cuboid(dvec3(0.7, 0.5, 0.3)), moved(dvec3(3.0, 1.0, 2.0)) * DAffine3::from_rotation_x(0.4)),
        (mesh(&soup), DAffine3::IDENTITY),
    ];
    made::scene(parts, perspective(dvec3(1.0, 6.0, 9.0), DVec3::ZERO, 0.1), light)
}

fn scenes() -> Vec<(&'static str, Scene)> {
    vec![
        ("still life, sun", still_life(sun(dvec3(-1.0, 2.0, 1.0)))),
        ("still life, spot", still_life(spot(dvec3(2.0, 7.0, 3.0), DVec3::ZERO, 0.9))),
        ("mixed, sun", mixed(sun(dvec3(0.4, 1.0, -0.3)))),
        ("mixed, spot", mixed(spot(dvec3(1.0, 9.0, 2.0), DVec3::ZERO, 0.7))),
        // Among the bodies, so that edges run from in front of the light to behind it.
        ("mixed, spot inside", mixed(spot(dvec3(0.3, 3.2, 0.2), dvec3(1.0, 0.0, 1.0), 0.9))),
    ]
}

fn drawn<'h>(host: &'h Host, scene: &Scene, map: u32) -> Renderer<'h> {
    let mut r = renderer(host, scene, desc(SIZE, map));
    frame(&mut r, "sm", &[]);
    r
}

/// Returns the silhouettes of every instance, projected in `f64`, and whether every facing is certain.
fn expected_edges(scene: &Scene, r: &Renderer<'_>) -> (Vec<Segment>, bool) {
    let light = r.light();
    let (mut found, mut sure) = (vec![], true);
    for instance in &scene.instances {
        let m = &scene.meshes[instance.mesh];
        let topology = Topology::new(&m.positions, &m.indices).unwrap();
        let object_from_world = instance.world_from_object.inverse();
        let seen = match light.kind {
            LightKind::Spot { .. } => object_from_world.transform_point3(light.world_from_view.translation).extend(1.0),
            LightKind::Directional { .. } => object_from_world.transform_vector3(-light.direction()).extend(0.0),
        };
        let facing = facing(&topology, &m.positions, seen);
        sure &= facing.iter().all(|f| !f.is_doubtful(Facing::BAND_F32));
        let orientation = if instance.world_from_object.matrix3.determinant() < 0.0 { -1 } else { 1 };
        let sigma: Vec<i32> = facing.iter().map(|f| orientation * f.sign()).collect();
        for s in silhouettes(&topology, &sigma, false).into_iter().filter(|s| s.outline) {
            let clip = |v: u32| clip_from_object(light, &instance.world_from_object, m.positions[v as usize]);
            let ends = s.ends.map(clip);
            let third = topology.triangles[s.face as usize].into_iter().find(|v| !s.ends.contains(v)).unwrap();
            let p = &light.clip_from_view;
            let nearest = match light.kind {
                LightKind::Spot { .. } => (p.w_axis.z / p.z_axis.z).abs() / 64.0,
                LightKind::Directional { .. } => 0.0,
            };
            // The edges in the list have the occluder on the other side.
            let map_size = r.shadow_map().extent();
            let edge = Segment::project([ends[1], ends[0]], map_size, 16.0, nearest);
            found.extend(edge.map(|e| e.beside(clip(third), map_size, nearest)));
        }
    }
    (found, sure)
}

#[test]
fn edges_are_where_the_casters_have_them() {
    with_gpu(|host| {
        for (name, scene) in scenes() {
            let r = drawn(host, &scene, 128);
            let got = maps(host, &r, true).edges;
            let (expected, sure) = expected_edges(&scene, &r);
            let same_third = |a: &Segment, b: &Segment| match (a.third, b.third) {
                (Some((p, z)), Some((q, y))) => {
                    // A vertex almost beside the light lies far from the map.
                    p.distance(q) < 2e-3 + 1e-4 * p.length() && (z - y).abs() < 1e-4 * (1.0 + z.abs())
                }
                (a, b) => a.is_none() && b.is_none(),
            };
            let same = |a: &Segment, b: &Segment, swapped: bool| {
                if !same_third(a, b) {
                    return false;
                }
                let order = if swapped { [1, 0] } else { [0, 1] };
                (0..2).all(|i| {
                    let j = order[i];
                    // Cut ends are as precise as the line that is cut.
                    let tolerance = if a.own[i] { 2e-3 } else { 0.05 };
                    (a.ends[i] - b.ends[j]).length() < tolerance && (a.depths[i] - b.depths[j]).abs() < 1e-4
                })
            };
            let long: Vec<_> = expected.iter().filter(|e| e.along().length() > 1e-2).collect();
            let missing_of = |got: &[Segment], swapped: bool| {
                long.iter().filter(|e| !got.iter().any(|g| same(e, g, swapped))).count()
            };
            let missing = |swapped: bool| missing_of(&got, swapped);
            let mut elsewhere = got.clone();
            elsewhere.iter_mut().for_each(|e| e.third = e.third.map(|(c, z)| (1.01 * c + 0.01, z)));
            assert!(missing_of(&elsewhere, false) > 20, "{name}: triangles elsewhere go unnoticed");
            println!(
                "{name}: {} edges, {} expected, {} missing, facing sure {sure}",
                got.len(),
                expected.len(),
                missing(false)
            );
            assert!(expected.len() > 20, "{name}");
            // A doubtful facing may change all edges of its triangle.
            let most = if sure { 0 } else { 6 };
            assert!(missing(false) <= most && got.len().abs_diff(expected.len()) <= 3 + most, "{name}");
            // At a crack a mesh has an edge in each direction; all other edges are found only in their own direction.
            let twin = |e: &Segment| long.iter().any(|o| same(e, o, true));
            let single = long.iter().filter(|e| !twin(e)).count();
            assert!(single > 20 && missing(true) >= single, "{name}: {single}, edges turned around go unnoticed");
        }
    });
}

#[test]
fn points_are_the_same_by_either_path_and_those_of_the_mirror() {
    with_gpu(|host| {
        for (name, scene) in scenes() {
            for (map, kill) in [(96, true), (130, false)] {
                let what = format!("{name} {map} kill {kill}");
                let r = drawn(host, &scene, map);
                let m = maps(host, &r, kill);
                assert_eq!(m.points, m.drawn_points, "{what}");
                let depth = host.read_values(r.shadow_map()).unwrap();
                let cells = sssm::candidates(&m.edges, [map; 2], &depth, kill);
                let wrong =
                    |points: &[u32]| (0..points.len()).filter(|&i| !sssm::explains(&cells[i], points[i])).count();
                let held = m.points.iter().filter(|p| **p != sssm::MIDDLE).count();
                println!("{what}: {held} cells with a point, {} unexplained", wrong(&m.points));
                assert!(held > 100, "{what}");
                assert_eq!(wrong(&m.points), 0, "{what}");
                // Plant one moved, one lost and one additional point.
                let at = |is: bool| m.points.iter().enumerate().filter(move |(_, p)| (**p != sssm::MIDDLE) == is);
                let mut planted = m.points.clone();
                let changed: Vec<usize> = at(true).map(|p| p.0).step_by(7).take(10).collect();
                changed.iter().for_each(|&i| planted[i] ^= 0x2000);
                let empty = at(false).map(|p| p.0).find(|&i| cells[i].is_empty()).unwrap();
                planted[empty] = 0x1234_5678;
                let noticed = wrong(&planted);
                assert!(noticed > 8, "{what}: {noticed} of 11 planted errors are noticed");
            }
        }
    });
}

#[test]
fn distances_are_those_of_the_mirror() {
    with_gpu(|host| {
        for (name, scene) in scenes() {
            for (map, kill) in [(96, true), (130, false)] {
                let r = drawn(host, &scene, map);
                let m = maps(host, &r, kill);
                let depth = host.read_values(r.shadow_map()).unwrap();
                for (form, got) in FORMS.into_iter().zip(&m.distances) {
                    let what = format!("{name} {map} kill {kill} {form:?}");
                    let config = config(form, kill);
                    let texels = edsm::candidates(&m.distance_edges, [map; 2], &depth, &config);
                    let wrong = |d: &[f32]| (0..d.len()).filter(|&i| !edsm::explains(&texels[i], d[i])).count();
                    let held = got.iter().filter(|d| **d != 0.0).count();
                    println!("{what}: {held} texels with a distance, {} unexplained", wrong(got));
                    assert!(held > 300 && got.iter().any(|d| *d > 0.0) && got.iter().any(|d| *d < 0.0), "{what}");
                    // Very short edges turn with the rounding of their ends.
                    assert!(wrong(got) * 1000 <= held, "{what}: {}", wrong(got));
                    let planted: Vec<f32> = got.iter().map(|d| -d).collect();
                    assert!(wrong(&planted) * 3 > held, "{what}: turned signs go unnoticed");
                    let planted: Vec<f32> = got.iter().map(|d| 1.02 * d).collect();
                    assert!(wrong(&planted) * 3 > held, "{what}: another scale goes unnoticed");
                }
            }
        }
    });
}

#[test]
fn shipped_scenes_have_the_same_points_by_either_path() {
    with_gpu(|host| {
        for name in ["fence", "jenga", "drum", "robot"] {
            let scene = shipped_scene(name);
            let r = drawn(host, &scene, 333);
            let m = maps(host, &r, true);
            let held = m.points.iter().filter(|p| **p != sssm::MIDDLE).count();
            let off = m.points.iter().zip(&m.drawn_points).filter(|(a, b)| a != b).count();
            println!("{name}: {} edges in {held} cells, {off} cells differ", m.edges.len());
            assert_eq!(off, 0, "{name}");
        }
    });
}

#[test]
fn a_kept_light_keeps_the_maps() {
    with_gpu(|host| {
        let scene = still_life(sun(dvec3(-1.0, 2.0, 1.0)));
        for (id, settings, pass) in [
            ("sssm", &[("generation", "compute")][..], "silhouette keys"),
            ("sssm", &[("generation", "raster")], "silhouette points"),
            ("edsm", &[], "edge distances"),
        ] {
            let fresh = frame(&mut renderer(host, &scene, desc(SIZE, 128)), id, settings).0;
            let mut kept = renderer(host, &scene, RenderDesc { moving: Moving::Camera, ..desc(SIZE, 128) });
            let mut technique = prepare(&kept, id, settings);
            for first in [true, false] {
                let names: Vec<_> =
                    kept.frame(technique.as_mut()).unwrap().passes.into_iter().map(|p| p.name).collect();
                assert_eq!(names.iter().any(|n| n == pass), first, "{id} {settings:?}: {names:?}");
                assert_eq!(kept.visibility(technique.as_ref()).unwrap(), fresh, "{id} {settings:?}");
            }
        }
    });
}

#[test]
fn without_casters_preparing_is_an_error() {
    with_gpu(|host| {
        let scene = still_life(sun(DVec3::ONE));
        let r = renderer(host, &scene, RenderDesc { adjacency: false, ..desc(SIZE, 64) });
        for id in ["sssm", "edsm"] {
            let params = Params::new(find(id).unwrap());
            let error = r.prepare(id, &params).err().unwrap().to_string();
            assert!(error.contains(id) && error.contains("casters"), "{error}");
        }
    });
}

/// More triangles in a texel than any map can resolve, and needles as long as the scene. Both paths give the same maps
/// without NaN.
#[test]
fn crowds_and_needles_are_borne() {
    with_gpu(|host| {
        let mut random = Random(11);
        let mut unit = || f64::from(random.unit()) - 0.5;
        let crowd: Vec<[DVec3; 3]> =
            (0..20_000).map(|_| [0; 3].map(|_| dvec3(0.0, 2.0, 0.0) + 0.02 * dvec3(unit(), unit(), unit()))).collect();
        let needles: Vec<[DVec3; 3]> = (0..500)
            .map(|_| {
                let (a, b) =
                    (dvec3(14.0 * unit(), 1.0 + unit(), 14.0 * unit()), dvec3(14.0 * unit(), 1.0, 14.0 * unit()));
                [a, b, b + 1e-6 * DVec3::X]
            })
            .collect();
        let parts = vec![
            (plane(8.0), DAffine3::IDENTITY),
            (mesh(&crowd), DAffine3::IDENTITY),
            (mesh(&needles), DAffine3::IDENTITY),
        ];
        for light in [sun(dvec3(0.1, 1.0, 0.2)), spot(dvec3(0.0, 6.0, 0.1), DVec3::ZERO, 0.9)] {
            let scene = made::scene(parts.clone(), perspective(dvec3(1.0, 6.0, 9.0), DVec3::ZERO, 0.1), light);
            let r = drawn(host, &scene, 64);
            let m = maps(host, &r, true);
            assert_eq!(m.points, m.drawn_points);
            for ((printed, _), distances) in FORMS.into_iter().zip(&m.distances) {
                // Distances in lengths of edges that have almost none are cut off.
                let most = if printed { 6e4 } else { 2.2 };
                assert!(distances.iter().all(|d| d.abs() <= most), "{printed}");
            }
        }
    });
}
