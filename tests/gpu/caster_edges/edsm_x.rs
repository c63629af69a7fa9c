//! Edge ids: their map compared with brute force, and the lookup compared with its mirror.

use crate::common::*;
use edgeshade::casters::Casters;
use edgeshade::gpu::Buffer;
use edgeshade::host::Host;
use edgeshade::reference::caster_edges::edge_map;
use edgeshade::reference::caster_edges::edge_segments::{Segment, StoredSegment};
use edgeshade::reference::caster_edges::edsm_x;
use edgeshade::reference::ray_traced::{RayScene, hard};
use edgeshade::scene::{Renderer, Scene};
use edgeshade::technique::caster_edges::edge_map::{EdgeMap, EdgeMapConfig, Generation, LEAST_REACH};
use edgeshade::technique::caster_edges::edge_segments::EdgeSegments;
use edgeshade::technique::caster_edges::edsm::BorderKernel;
use edgeshade::technique::caster_edges::silhouettes::Silhouettes;
use edgeshade::technique::{Params, find};
use std::sync::Arc;

const SIZE: [u32; 2] = [192, 108];

/// Results of the passes on a scene.
pub struct Edges {
    pub segments: Vec<Option<Segment>>,
    /// Slots of each cell, then its chain.
    pub slots: Vec<Vec<u32>>,
    chains: Vec<Vec<u32>>,
    lost: u32,
}

impl Edges {
    fn all(&self) -> Vec<Vec<u32>> {
        self.slots.iter().zip(&self.chains).map(|(s, c)| s.iter().chain(c).copied().collect()).collect()
    }
}

fn words(host: &Host, buffer: &Buffer) -> Vec<u32> {
    host.read_buffer(buffer).unwrap()
}

/// Runs the passes up to the map.
pub fn edges(host: &Host, r: &Renderer<'_>, casters: &Arc<Casters>, config: EdgeMapConfig) -> Edges {
    let context = host.context();
    let mut silhouettes = Silhouettes::new(context, casters, false).unwrap();
    let projected = EdgeSegments::new(context, &silhouettes).unwrap();
    let size = r.shadow_map().extent();
    let map = EdgeMap::new(context, &silhouettes, size, config).unwrap();
    let inputs = r.inputs();
    run_passes(host, |frame| {
        silhouettes.record(frame, &inputs, None)?;
        projected.record(frame, &inputs, &silhouettes, config.reach)?;
        map.record(frame, &inputs, &silhouettes, &projected)
    });
    let count = words(host, silhouettes.header())[3] as usize;
    let stored: Vec<StoredSegment> = host.read_buffer(projected.segments()).unwrap();
    let segments = stored[..count].iter().map(StoredSegment::segment).collect();
    let keys = words(host, map.keys());
    let slots = keys
        .chunks_exact(2 * config.slots as usize)
        .map(|t| t.chunks_exact(2).filter(|k| k[1] != u32::MAX).map(|k| k[0]).collect())
        .collect();
    let (spill, heads) = (words(host, map.spill()), words(host, map.heads()));
    let chain = |first: u32| {
        let next = |at: &u32| Some(spill[2 + 2 * *at as usize + 1]).filter(|n| *n != u32::MAX);
        std::iter::successors(Some(first).filter(|f| *f != u32::MAX), next)
            .map(|at| spill[2 + 2 * at as usize])
            .collect()
    };
    Edges { segments, slots, chains: heads.chunks_exact(2).map(|h| chain(h[0])).collect(), lost: spill[0] }
}

pub fn config(slots: u32, generation: Generation) -> EdgeMapConfig {
    EdgeMapConfig { slots, spill: 256, kill: true, reach: LEAST_REACH, generation }
}

fn settings(set: &[(&str, &str)]) -> edsm_x::Settings {
    let p = Params::parse(find("edsm-x").unwrap(), set.iter().copied()).unwrap();
    edsm_x::Settings {
        mixed_only: p.word("resolve") == "mixed-only",
        edge_bias: p.float("edge_bias"),
        depth_bias: p.float("depth_bias"),
        slack: p.float("slack"),
        border: p.float("border"),
        kernel: match p.word("kernel") {
            "box" => BorderKernel::Box,
            "smoothstep" => BorderKernel::Smoothstep,
            _ => BorderKernel::Disc,
        },
    }
}

/// Every cell holds the edges that enter it: the nearest to its centre in its slots, in order, and the others in its
/// chain. Both ways of making the map agree.
#[test]
fn the_map_is_that_of_brute_force() {
    with_gpu(|host| {
        for (name, map_size) in [("jenga", 64), ("robot", 128)] {
            let scene = shipped_scene(name);
            let mut r = renderer(host, &scene, desc(SIZE, map_size));
            // This draws the shadow map.
            visibility(&mut r, "sm", &[]);
            let casters = r.casters().unwrap().casters.clone();
            let depth = host.read_values(r.shadow_map()).unwrap();
            let size = [map_size as usize; 2];
            for (slots, kill, reach) in [(1, true, LEAST_REACH), (2, true, 0.8), (4, false, LEAST_REACH)] {
                let made =
                    |generation| edges(host, &r, &casters, EdgeMapConfig { kill, reach, ..config(slots, generation) });
                let (found, quads) = (made(Generation::Compute), made(Generation::Raster));
                assert_eq!((found.lost, quads.lost), (0, 0), "{name}: edges were lost, and chance decides which");
                let other = |i: &usize| {
                    found.slots[*i] != quads.slots[*i] || sorted(&found.chains[*i]) != sorted(&quads.chains[*i])
                };
                let differing: Vec<_> = (0..found.slots.len()).filter(other).collect();
                if let Some(&i) = differing.first() {
                    panic!(
                        "{name}, {slots} slots: {} cells differ between compute and raster, first {i}: {:?} {:?}, {:?} {:?}",
                        differing.len(),
                        found.slots[i],
                        found.chains[i],
                        quads.slots[i],
                        quads.chains[i]
                    );
                }
                let settings = edge_map::Settings { reach: reach.into(), kill };
                let near = edge_map::near(&found.segments, &depth, size, &settings);
                let all = found.all();
                let wrong = |all: &[Vec<u32>], slots: &[Vec<u32>]| {
                    (0..near.len())
                        .filter(|&i| {
                            !edge_map::agrees(&all[i], &near[i], &settings)
                                || !edge_map::is_nearest_first(&slots[i], &near[i], &settings)
                        })
                        .count()
                };
                let held: usize = all.iter().map(Vec::len).sum();
                println!(
                    "{name} {map_size}, {slots} slots, kill {kill}: {} edges, {held} entries, {} lost, {} cells wrong",
                    found.segments.len(),
                    found.lost,
                    wrong(&all, &found.slots)
                );
                assert_eq!(wrong(&all, &found.slots), 0, "{name}, {slots} slots, kill {kill}");
                assert!(held > 500, "{name}");
                // The comparison notices one missing entry, and an order that is not by distance.
                let full = (0..all.len()).find(|&i| all[i].len() > 1 && near[i].len() == all[i].len()).unwrap();
                let mut without = all.clone();
                without[full].clear();
                assert_eq!(wrong(&without, &found.slots), 1, "{name}: a lost entry");
                if slots > 1 {
                    let far = |s: &Vec<u32>| {
                        s.len() > 1 && near_gap(s, &near[found.slots.iter().position(|t| t == s).unwrap()])
                    };
                    let mut turned = found.slots.clone();
                    let at = turned.iter().position(far).unwrap();
                    turned[at].reverse();
                    assert!(wrong(&all, &turned) > 0, "{name}: an order turned round");
                }
            }
        }
    });
}

fn sorted(chain: &[u32]) -> Vec<u32> {
    let mut sorted = chain.to_vec();
    sorted.sort_unstable();
    sorted
}

/// Returns whether the distances of the first and last slot of a texel differ by more than is in doubt.
fn near_gap(slots: &[u32], near: &[edge_map::Near]) -> bool {
    let distance = |s: u32| near.iter().find(|n| n.segment == s).map_or(0.0, |n| n.distance);
    distance(slots[slots.len() - 1]) - distance(slots[0]) > 10.0 * edge_map::DISTANCE_DOUBT
}

/// The technique's image equals its mirror's, except for pixels that rounding may decide.
#[test]
fn it_equals_its_mirror() {
    with_gpu(|host| {
        for (name, map_size) in [("jenga", 128), ("fence", 256), ("ripples", 96)] {
            let scene = shipped_scene(name);
            let mut r = renderer(host, &scene, desc(SIZE, map_size));
            for set in [
                &[][..],
                &[("resolve", "mixed-only")][..],
                &[("border", "1.6"), ("kernel", "smoothstep")][..],
                &[("border", "2"), ("kernel", "disc"), ("kill", "off")][..],
            ] {
                // Give the chains enough room; otherwise chance decides which edges are lost.
                let with_room: Vec<_> = set.iter().copied().chain([("spill", "4096")]).collect();
                let found = visibility(&mut r, "edsm-x", &with_room);
                assert_in_range(&found, name);
                let shot = Shot::of(host, &r, true);
                let casters = r.casters().unwrap().casters.clone();
                let kill = !set.contains(&("kill", "off"));
                let settings = settings(set);
                let reach = (0.5 * settings.border).max(LEAST_REACH);
                let made = edges(
                    host,
                    &r,
                    &casters,
                    EdgeMapConfig { kill, reach, spill: 4096, ..config(2, Generation::Compute) },
                );
                assert_eq!(made.lost, 0, "{name}: edges were lost, and chance decides which");
                let map = edsm_x::EdgeMap { segments: &made.segments, cells: &made.all() };
                let mirror = edsm_x::visibility(&shot.data(), &map, &settings).unwrap();
                let off = |v: &[f32], i: usize| {
                    (f64::from(v[i]) - mirror.visibility[i]).abs() > mirror.doubt[i] + mirror.rounding[i] + 2e-3
                };
                let wrong = |v: &[f32]| (0..v.len()).filter(|&i| off(v, i)).count();
                let doubtful = mirror.doubt.iter().filter(|d| **d > 0.0).count();
                println!("{name} {map_size} {set:?}: {} of {} wrong, {doubtful} in doubt", wrong(&found), found.len());
                for i in (0..found.len()).filter(|&i| off(&found, i)) {
                    println!(
                        "  pixel {i}: {} and {} +- {} + {}",
                        found[i], mirror.visibility[i], mirror.doubt[i], mirror.rounding[i]
                    );
                }
                assert_eq!(wrong(&found), 0, "{name} {set:?}");
                assert!(doubtful * 100 < 2 * found.len(), "{name} {set:?}: {doubtful} pixels are in doubt");
                // Plain shadow mapping gives another image.
                if set.is_empty() {
                    assert!(wrong(&visibility(&mut r, "sm", &[])) > 50, "{name}");
                }
            }
        }
    });
}

/// The image does not depend on whether pixels are listed. Except for doubt at an edge, it does not depend on the
/// position of the map's grid either.
#[test]
fn the_grid_of_the_map_may_be_anywhere() {
    with_gpu(|host| {
        let scene = shipped_scene("jenga");
        let mut r = renderer(host, &scene, desc([320, 180], 256));
        let listed = visibility(&mut r, "edsm-x", &[]);
        assert_same_bits(&listed, &visibility(&mut r, "edsm-x", &[("skip", "off")]), "listed or not");
        let light = *r.light();
        let mut changed = [vec![], vec![]];
        for (which, id) in ["edsm-x", "sm"].into_iter().enumerate() {
            let still = visibility(&mut r, id, &[]);
            for step in 1..16 {
                let mut moved = light;
                // In clip space, the whole image moves by a fraction of a texel, whatever the projection.
                let by = 2.0 * f64::from(step) / 16.0 / 256.0;
                let shift = glam::DMat4::from_translation(glam::dvec3(by, 0.5 * by, 0.0));
                moved.clip_from_view = shift * light.clip_from_view;
                r.set_light(&scene, moved);
                changed[which].push(differing(&still, &visibility(&mut r, id, &[]), 0.5));
            }
            r.set_light(&scene, light);
        }
        println!(
            "pixels of 57600 that change over sixteenths of a texel: edsm-x {:?}, sm {:?}",
            changed[0], changed[1]
        );
        assert!(changed[0].iter().all(|n| *n <= 12), "{:?}", changed[0]);
        assert!(changed[1].iter().all(|n| *n >= 80), "{:?}", changed[1]);
    });
}

/// Returns the fraction of wrong pixels among those that can be judged.
fn wrong_share(host: &Host, scene: &Scene, map_size: u32, id: &str, set: &[(&str, &str)]) -> f64 {
    let size = [320, 180];
    let mut r = renderer(host, scene, desc(size, map_size));
    let found = visibility(&mut r, id, set);
    let ids = host.read_image::<u32>(&r.gbuffer().triangle).unwrap();
    let rays = RayScene::build(scene).unwrap();
    let truth = hard(&rays, r.camera(), r.light(), size, &|_, _| {}).unwrap();
    let can_be = truth.judged(&ids);
    let judged: Vec<_> = (0..found.len()).filter(|&i| can_be[i]).collect();
    let wrong = judged.iter().filter(|&&i| (found[i] > 0.5) != (truth.visibility[i] > 0.5)).count();
    wrong as f64 / judged.len() as f64
}

/// Compares images with ray-traced truth. With a map of a few hundred texels nearly every pixel is right, because the
/// casters' edges bound the shadows.
#[test]
fn shadows_end_at_the_casters_edges() {
    with_gpu(|host| {
        for (name, limit) in [("jenga", 1e-4), ("robot", 5e-4), ("drum", 5e-4), ("fence", 1.7e-3), ("knot", 1.7e-3)] {
            let scene = shipped_scene(name);
            let [ours, sm] = ["edsm-x", "sm"].map(|id| wrong_share(host, &scene, 512, id, &[]));
            println!("{name}, a map of 512: {:.3} % of the pixels wrong; sm {:.3} %", 100.0 * ours, 100.0 * sm);
            assert!(ours < limit, "{name}: {ours}");
            assert!(sm > 5.0 * ours, "{name}: {sm}");
        }
    });
}

/// Triangle soups, open and mirrored meshes, a light inside one, needles, and vertices in the light's plane, compared
/// with exact volumes.
#[test]
fn awkward_casters_are_cut_where_volumes_cut_them() {
    with_gpu(|host| {
        let mut all = [0.0; 2];
        for (name, scene) in crate::caster_edges::shadow_volumes::cases() {
            let mut r = renderer(host, &scene, desc(SIZE, 256));
            // The number of slots changes nothing.
            let [one, four] = ["1", "4"].map(|slots| visibility(&mut r, "edsm-x", &[("slots", slots)]));
            assert_same_bits(&one, &four, name);
            let ours = wrong_share(host, &scene, 256, "edsm-x", &[]);
            let sm = wrong_share(host, &scene, 256, "sm", &[]);
            println!("{name}: {:.3} % wrong; sm {:.3} %", 100.0 * ours, 100.0 * sm);
            assert!(ours < 3e-3, "{name}: {ours}");
            all[0] += ours;
            all[1] += sm;
        }
        assert!(all[0] * 5.0 < all[1], "{all:?}");
    });
}

/// A million triangles within a texel of the map: edges without room are counted, and nothing else is disturbed.
#[test]
fn a_million_triangles_in_a_texel() {
    with_gpu(|host| {
        use crate::made;
        let tiny = glam::DAffine3::from_scale_rotation_translation(
            glam::DVec3::splat(1e-3),
            glam::DQuat::IDENTITY,
            glam::dvec3(0.0, 2.0, 0.0),
        );
        let parts = vec![
            (made::plane(8.0), made::moved(glam::DVec3::ZERO)),
            (made::sphere(500, 1000), tiny),
            (made::cuboid(glam::DVec3::splat(0.5)), made::moved(glam::dvec3(1.0, 2.0, 0.0))),
        ];
        let camera = made::perspective(glam::dvec3(2.0, 4.0, 7.0), glam::DVec3::ZERO, 0.1);
        let scene = made::scene(parts, camera, made::sun(glam::dvec3(0.3, 2.0, 0.2)));
        let mut without = scene.clone();
        without.instances.remove(1);
        let run = |scene: &Scene| frame(&mut renderer(host, scene, desc(SIZE, 256)), "edsm-x", &[]);
        let ((with, timing), (without, _)) = (run(&scene), run(&without));
        let counts: Vec<_> = timing.passes.iter().flat_map(|p| p.counts.clone()).collect();
        println!("{counts:?}, {} pixels differ", differing(&with, &without, 0.5));
        assert_in_range(&with, "a million");
        let count = |what: &str| counts.iter().find(|c| c.0 == what).unwrap().1;
        assert!(count("edges") > 500 && count("edges_lost") > 0, "{counts:?}");
        assert!(differing(&with, &without, 0.5) <= 20);
    });
}

/// The GPU's facing bits and silhouettes equal the mirror's, except for edge-on triangles.
#[test]
fn silhouettes_equal_their_mirror() {
    use edgeshade::casters::topology::Topology;
    use edgeshade::reference::caster_edges::silhouettes::{Facing, facing, silhouettes};
    use edgeshade::technique::caster_edges::silhouettes::CasterLight;
    with_gpu(|host| {
        let (mut edges_in_all, mut doubtful_in_all) = (0, 0);
        for (name, scene) in crate::caster_edges::shadow_volumes::cases() {
            let mut r = renderer(host, &scene, desc([64, 36], 64));
            visibility(&mut r, "sm", &[]);
            let casters = r.casters().unwrap().clone();
            let context = host.context();
            let mut found = Silhouettes::new(context, &casters.casters, true).unwrap();
            run_passes(host, |frame| found.record(frame, &r.inputs(), None));
            let bits: Vec<u32> = words(host, found.facing());
            let count = words(host, found.header())[3] as usize;
            let list: Vec<[u32; 5]> = host.read_buffer(found.edges()).unwrap();
            let mut expected = vec![];
            let mut chunk = 0usize;
            for (i, instance) in scene.instances.iter().enumerate() {
                let mesh = &scene.meshes[instance.mesh];
                let first_vertex: u32 = scene.meshes[..instance.mesh].iter().map(|m| m.positions.len() as u32).sum();
                let of = |m: &edgeshade::scene::Mesh| Topology::new(&m.positions, &m.indices).unwrap();
                let first_triangle: u32 =
                    scene.meshes[..instance.mesh].iter().map(|m| of(m).triangles.len() as u32).sum();
                let topology = of(mesh);
                let light = CasterLight::light(r.light(), &instance.world_from_object);
                let mirrored = instance.world_from_object.matrix3.determinant() < 0.0;
                let exact = facing(&topology, &mesh.positions, light);
                let sigma: Vec<i32> = (0..exact.len())
                    .map(|t| {
                        let bit = 64 * chunk + t;
                        let on_gpu = if bits[bit / 32] >> (bit % 32) & 1 == 1 { 1 } else { -1 };
                        let sign = if mirrored { -exact[t].sign() } else { exact[t].sign() };
                        let doubtful = exact[t].is_doubtful(Facing::BAND_F32);
                        doubtful_in_all += usize::from(doubtful);
                        assert!(on_gpu == sign || doubtful, "{name}: triangle {t} of instance {i}: {:?}", exact[t]);
                        on_gpu
                    })
                    .collect();
                chunk += exact.len().div_ceil(64);
                let shell = casters.casters.is_shell(i, light);
                expected.extend(silhouettes(&topology, &sigma, shell).into_iter().map(|e| {
                    let flags = e.weight | u32::from(e.boundary) << 16 | u32::from(e.outline) << 17;
                    [e.ends[0] + first_vertex, e.ends[1] + first_vertex, i as u32, flags, first_triangle + e.face]
                }));
            }
            assert_eq!(&list[..count], &expected[..], "{name}");
            edges_in_all += count;
        }
        println!("{edges_in_all} edges of 21 scenes, {doubtful_in_all} triangles edge-on");
        assert!(edges_in_all > 500 && doubtful_in_all < 60);
    });
}

/// A cell ends with the same edges, whatever the order of the threads.
#[test]
fn the_map_is_the_same_every_time() {
    with_gpu(|host| {
        let scene = shipped_scene("fence");
        let mut r = renderer(host, &scene, desc(SIZE, 256));
        visibility(&mut r, "sm", &[]);
        let casters = r.casters().unwrap().casters.clone();
        let made = || edges(host, &r, &casters, EdgeMapConfig { spill: 256, ..config(2, Generation::Compute) });
        let first = made();
        assert_eq!(first.lost, 0);
        for again in 0..4 {
            let other = made();
            let differing =
                |a: &[Vec<u32>], b: &[Vec<u32>]| (0..a.len()).filter(|&i| sorted(&a[i]) != sorted(&b[i])).count();
            let (slots, chains) = (differing(&first.slots, &other.slots), differing(&first.chains, &other.chains));
            assert_eq!((slots, chains, other.lost), (0, 0, 0), "time {again}");
        }
    });
}
