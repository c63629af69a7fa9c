//! Shadow volumes compared with occluders counted one by one, and with ray-traced truth.

use crate::common::{Shot, desc, every_shipped, prepare, renderer, shipped_scene, visibility, with_gpu};
use crate::made::{self, cuboid, moved, perspective, plane, sphere, spot, still_life, sun};
use crate::mirrors::compare;
use crate::noise::visibility_of;
use ash::vk;
use edgeshade::casters::topology::Topology;
use edgeshade::casters::{CasterMesh, Casters, Vertices};
use edgeshade::gpu::ImageDesc;
use edgeshade::host::Host;
use edgeshade::reference::caster_edges::shadow_volumes::{self as mirror, Caster};
use edgeshade::reference::ray_traced::{RayScene, Target, Truth, hard};
use edgeshade::scene::{Camera, Light, Masked, Mesh, Projection, RenderDesc, Renderer, Scene};
use edgeshade::technique::{self, OutputFormat, Params, Setup, Technique, find};
use edgeshade::view::{CameraView, DepthRange, LightKind};
use edgeshade::{Inputs, NormalEncoding};
use glam::{DAffine3, DMat4, DQuat, DVec3, dvec3};
use std::sync::Arc;

const SIZE: [u32; 2] = [160, 90];
type Settings = &'static [(&'static str, &'static str)];

/// Settings that must all give the same counts.
const WAYS: [Settings; 6] = [
    &[],
    &[("path", "geometry")],
    &[("count", "float")],
    &[("path", "geometry"), ("count", "float")],
    &[("cull", "off")],
    &[("path", "geometry"), ("cull", "off")],
];

fn with_counts(size: [u32; 2]) -> RenderDesc {
    RenderDesc { intermediates: true, ..desc(size, 256) }
}

/// Returns visibility and raw counts.
fn counted(host: &Host, r: &mut Renderer<'_>, settings: &[(&str, &str)]) -> (Vec<f32>, Vec<f32>) {
    let mut t = prepare(r, "shadow-volumes", settings);
    r.frame(t.as_mut()).unwrap();
    let image = t.intermediates().into_iter().find(|i| i.0 == "stencil-count").unwrap().1;
    (r.visibility(t.as_ref()).unwrap(), host.read_values(image).unwrap())
}

/// Random numbers in [-1, 1).
pub struct Random(pub u64);

impl Random {
    fn next(&mut self) -> f64 {
        self.0 = self.0.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
        (self.0 >> 11) as f64 / (1u64 << 52) as f64 - 1.0
    }

    pub fn point(&mut self) -> DVec3 {
        dvec3(self.next(), self.next(), self.next())
    }
}

/// Returns triangles between few points, with random winding.
fn soup(points: u32, triangles: u32, seed: u64) -> Mesh {
    let mut random = Random(seed);
    let points: Vec<DVec3> = (0..points).map(|_| random.point()).collect();
    let mut pick = || points[((random.next() + 1.0) * 0.5 * points.len() as f64) as usize];
    made::mesh(&(0..triangles).map(|_| [pick(), pick(), pick()]).collect::<Vec<_>>())
}

/// Returns a box without a lid, standing on the ground.
fn open_box() -> Mesh {
    let mut mesh = cuboid(DVec3::splat(1.0));
    let top = |t: &[u32]| t.iter().all(|&i| mesh.positions[i as usize][1] == 1.0);
    mesh.indices = mesh.indices.chunks_exact(3).filter(|t| !top(t)).flatten().copied().collect();
    mesh
}

/// Returns small scenes with their names; all have a ground.
pub fn cases() -> Vec<(&'static str, Scene)> {
    let over = |parts: Vec<(Mesh, DAffine3)>, camera: Camera, light: Light| {
        let mut all = vec![(plane(8.0), moved(dvec3(0.0, -0.001, 0.0)))];
        all.extend(parts);
        made::scene(all, camera, light)
    };
    let lamp = || spot(dvec3(1.0, 7.0, 1.5), dvec3(0.0, 0.0, 0.2), 0.8);
    let day = || sun(dvec3(0.7, 2.0, 0.4));
    let from = |eye| perspective(eye, dvec3(0.0, 0.5, 0.0), 0.1);
    let usual = || from(dvec3(2.0, 4.0, 7.0));
    let crate_at = |p| vec![(cuboid(dvec3(0.8, 0.5, 0.6)), moved(p))];
    let floating = dvec3(0.0, 2.0, 0.0);
    let turned = DAffine3::from_scale_rotation_translation(
        dvec3(-1.3, 0.7, 1.0),
        DQuat::from_euler(glam::EulerRot::XYZ, 0.4, 0.9, -0.3),
        dvec3(0.3, 1.8, -0.2),
    );
    let parallel = Camera {
        projection: Projection::Orthographic { half_height: 3.0, near: 0.5, far: 20.0 },
        ..from(dvec3(3.0, 5.0, 6.0))
    };
    let inside_light = spot(dvec3(0.0, 3.0, 0.0), DVec3::ZERO, 0.9);
    vec![
        ("cube, spot", over(crate_at(floating), usual(), lamp())),
        ("cube, sun", over(crate_at(floating), usual(), day())),
        ("cube, parallel camera", over(crate_at(floating), parallel.clone(), lamp())),
        ("cube, parallel camera, sun", over(crate_at(floating), parallel, day())),
        ("camera in the volume", over(crate_at(floating), from(dvec3(-0.2, 1.0, -0.3)), day())),
        ("near plane through the volume", {
            let eye = perspective(dvec3(-1.6, 1.2, -0.9), dvec3(0.2, 0.3, 0.0), 1.0);
            over(crate_at(floating), eye, day())
        }),
        (
            "light in a mesh",
            over(vec![(cuboid(DVec3::splat(0.4)), moved(dvec3(0.0, 3.0, 0.0)))], usual(), inside_light.clone()),
        ),
        ("light in an open box", over(vec![(open_box(), moved(dvec3(0.1, 3.2, 0.0)))], usual(), inside_light)),
        // The light lies in the plane of a face, which is then edge-on.
        (
            "light in a face's plane",
            over(crate_at(floating), usual(), spot(dvec3(0.8, 7.0, 0.3), dvec3(0.1, 0.0, 0.0), 0.8)),
        ),
        ("sun along faces", over(crate_at(floating), usual(), sun(dvec3(0.0, 2.0, 0.7)))),
        ("open box", over(vec![(open_box(), moved(dvec3(0.0, 1.6, 0.0)))], usual(), lamp())),
        ("open box, sun", over(vec![(open_box(), moved(dvec3(0.0, 1.6, 0.0)))], usual(), day())),
        ("mirrored box", over(vec![(cuboid(dvec3(0.8, 0.5, 0.6)), turned)], usual(), lamp())),
        ("mirrored open box", over(vec![(open_box(), turned)], usual(), day())),
        ("soup", over(vec![(soup(12, 40, 5), moved(dvec3(0.0, 2.0, 0.0)))], usual(), lamp())),
        ("soup, mirrored, sun", over(vec![(soup(20, 60, 8), turned)], usual(), day())),
        ("sphere on the ground", over(vec![(sphere(12, 20), moved(dvec3(0.0, 1.0, 0.0)))], usual(), lamp())),
        ("still life", still_life(day())),
        ("inside out", {
            let mut mesh = cuboid(DVec3::splat(0.7));
            mesh.indices.chunks_exact_mut(3).for_each(|t| t.swap(0, 1));
            over(vec![(mesh, moved(floating))], usual(), lamp())
        }),
        ("needles", {
            let mut random = Random(3);
            let needles = (0..60)
                .map(|_| {
                    let (p, d) = (random.point(), random.point());
                    [p, p + d, p + 0.5 * d + 1e-5 * random.point()]
                })
                .collect::<Vec<_>>();
            over(vec![(made::mesh(&needles), moved(floating))], usual(), lamp())
        }),
        // Vertices at the height of the light: their images at infinity lie on its plane, and sides run along it.
        ("vertices in the light's plane", {
            let wall = made::mesh(&[[dvec3(-2.0, 0.5, -1.0), dvec3(2.0, 0.5, -1.0), dvec3(0.0, 7.0, -1.0)]]);
            over(vec![(wall, moved(DVec3::ZERO))], usual(), spot(dvec3(0.0, 7.0, 2.0), dvec3(0.0, 1.0, -1.0), 1.0))
        }),
    ]
}

/// Returns the casters of a scene for the mirror.
pub fn topologies(scene: &Scene) -> Vec<Topology> {
    (scene.instances.iter())
        .map(|i| Topology::new(&scene.meshes[i.mesh].positions, &scene.meshes[i.mesh].indices).unwrap())
        .collect()
}

/// Returns whether the light lies outside a mesh's bounding sphere, in object space.
pub fn is_outside(r: &Renderer<'_>, mesh: &Mesh, world_from_object: &DAffine3) -> bool {
    match r.light().kind {
        LightKind::Directional { .. } => true,
        LightKind::Spot { .. } => {
            let light = world_from_object.inverse().transform_point3(r.light().position());
            light.distance(mesh.bounds.center()) > 1.0001 * mesh.bounds.radius()
        }
    }
}

fn expected(
    host: &Host,
    r: &Renderer<'_>,
    scene: &Scene,
    topologies: &[Topology],
    robust: bool,
) -> Vec<Option<mirror::Count>> {
    let shot = Shot::of(host, r, true);
    let casters: Vec<_> = (scene.instances.iter().zip(topologies))
        .map(|(i, topology)| {
            let mesh = &scene.meshes[i.mesh];
            let outside = is_outside(r, mesh, &i.world_from_object);
            Caster {
                positions: &mesh.positions,
                topology,
                world_from_object: i.world_from_object,
                shells: !robust && topology.outward && outside,
            }
        })
        .collect();
    mirror::counts(&shot.data(), r.camera(), r.light(), &casters).unwrap()
}

/// Returns the number of pixels, of pixels where the mirror is unsure, and the pixels whose count the mirror excludes.
fn disagreement(raw: &[f32], expected: &[Option<mirror::Count>]) -> (usize, usize, Vec<usize>) {
    assert_eq!(raw.len(), expected.len());
    let surfaces = || raw.iter().zip(expected).enumerate().filter_map(|(i, (r, e))| e.map(|e| (i, *r, e)));
    let unsure = surfaces().filter(|(_, _, e)| e.least != e.most).count();
    // -1 wraps to 255.
    let signed = |raw: f32| if raw > 200.0 { raw as i32 - 256 } else { raw as i32 };
    let wrong = surfaces().filter(|(_, r, e)| !(e.least..=e.most).contains(&signed(*r))).map(|s| s.0);
    (surfaces().count(), unsure, wrong.collect())
}

#[test]
fn raw_counts_are_those_of_occluders() {
    with_gpu(|host| {
        let mut failed = vec![];
        for (name, scene) in cases() {
            let topologies = topologies(&scene);
            let mut r = renderer(host, &scene, with_counts(SIZE));
            for (mode, robust) in [("auto", false), ("always", true)] {
                let (_, raw) = counted(host, &mut r, &[("robust", mode), ("cull", "off")]);
                let expected = expected(host, &r, &scene, &topologies, robust);
                let (pixels, unsure, wrong) = disagreement(&raw, &expected);
                let most = raw.iter().fold(0.0f32, |a, &b| a.max(b));
                println!(
                    "{name:32} {mode:7} {pixels} pixels, {unsure} near a boundary, largest {most}, wrong {}",
                    wrong.len()
                );
                if let Some(&i) = wrong.first() {
                    failed.push(format!(
                        "{name} {mode}: {} wrong, pixel {i}: {} not {:?}",
                        wrong.len(),
                        raw[i],
                        expected[i]
                    ));
                }
                assert!(unsure * 8 < pixels, "{name}: {unsure} of {pixels} pixels are not sure");
                assert!(raw.iter().any(|&c| c > 0.0), "{name}: no shadow");
                if name == "cube, spot" {
                    // The box counts as one shell or as two triangles; the ground is open and casts onto nothing.
                    let value = if robust { 2.0 } else { 1.0 };
                    let sure = |i: &usize| expected[*i].is_some_and(|e| e.least == e.most);
                    assert!((0..raw.len()).filter(sure).all(|i| [0.0, value, 1.0].contains(&raw[i])), "{name}");
                }
                // An additional count where the mirror is sure is noticed.
                let mut planted = raw.clone();
                let at = (0..raw.len()).find(|&i| expected[i].is_some_and(|e| e.least == e.most)).unwrap();
                planted[at] += 1.0;
                assert_eq!(disagreement(&planted, &expected).2.len(), wrong.len() + 1);
            }
        }
        assert!(failed.is_empty(), "{}", failed.join("\n"));
    });
}

#[test]
fn every_way_counts_the_same() {
    with_gpu(|host| {
        let mut failed = vec![];
        let shipped = every_shipped().map(|s| (s.name.clone(), s));
        for (name, scene) in cases().into_iter().map(|(n, s)| (n.to_string(), s)).chain(shipped) {
            let mut r = renderer(host, &scene, with_counts(SIZE));
            for mode in ["auto", "always"] {
                let mut first = None;
                for way in WAYS {
                    let settings: Vec<_> = way.iter().copied().chain([("robust", mode)]).collect();
                    let (seen, raw) = counted(host, &mut r, &settings);
                    let culled = !way.contains(&("cull", "off"));
                    let blended = way.contains(&("count", "float"));
                    let (visibility, counts, whole) = first.get_or_insert_with(|| (seen.clone(), raw.clone(), None));
                    let what = format!("{name} {settings:?}");
                    let differ = |a: &[f32], b: &[f32]| a.iter().zip(b).filter(|p| p.0 != p.1).count();
                    // Outside the light's rectangle, culled volumes count nothing; the stencil wraps.
                    let wrapped: Vec<f32> =
                        raw.iter().map(|&c| if blended { c.rem_euclid(256.0) } else { c }).collect();
                    let counts = if culled { counts } else { whole.get_or_insert_with(|| raw.clone()) };
                    let off = (differ(visibility, &seen), differ(counts, &wrapped));
                    if off != (0, 0) {
                        println!("{what}: {} pixels differ, {} counts", off.0, off.1);
                    }
                    // llvmpipe transforms the vertices of a geometry shader to the viewport in other code than those
                    // of a vertex shader. They occasionally differ by a step of the rasteriser's grid.
                    let allowed = if way.contains(&("path", "geometry")) { 2 } else { 0 };
                    if off.0 > allowed || off.1 > allowed {
                        failed.push(what);
                    }
                }
            }
        }
        assert!(failed.is_empty(), "{}", failed.join("\n"));
    });
}

/// 300 cards above each other: the stencil wraps to 44, and with 256 cards to zero; blending does not wrap.
#[test]
fn many_volumes_wrap_in_the_stencil_alone() {
    with_gpu(|host| {
        for (cards, stencil) in [(300u32, 44.0), (256, 0.0)] {
            let quads: Vec<_> = (0..cards)
                .flat_map(|i| {
                    let y = 1.0 + 0.01 * f64::from(i);
                    let p = |x: f64, z: f64| dvec3(x, y, z);
                    [[p(-1.0, -1.0), p(-1.0, 1.0), p(1.0, 1.0)], [p(-1.0, -1.0), p(1.0, 1.0), p(1.0, -1.0)]]
                })
                .collect();
            let parts = vec![(plane(6.0), moved(dvec3(0.0, -0.1, 0.0))), (made::mesh(&quads), DAffine3::IDENTITY)];
            let camera = perspective(dvec3(0.0, 1.5, 7.0), dvec3(0.0, 0.0, 0.5), 0.1);
            let scene = made::scene(parts, camera, sun(dvec3(0.05, 1.0, 0.02)));
            let mut r = renderer(host, &scene, with_counts(SIZE));
            let (seen, raw) = counted(host, &mut r, &[]);
            let (exact, floats) = counted(host, &mut r, &[("count", "float")]);
            let deepest: Vec<usize> = (0..floats.len()).filter(|&i| floats[i] == cards as f32).collect();
            assert!(deepest.len() > 100, "{cards}: {} pixels under all cards", deepest.len());
            assert!(floats.iter().all(|&c| c <= cards as f32));
            assert!(deepest.iter().all(|&i| raw[i] == stencil && exact[i] == 0.0));
            let lost = deepest.iter().filter(|&&i| seen[i] == 1.0).count();
            println!("{cards} cards: {} pixels under all, {lost} of them lit by the stencil", deepest.len());
            assert_eq!(lost, if stencil == 0.0 { deepest.len() } else { 0 });
        }
    });
}

/// Returns whether the truth changes within a 64th of a pixel: another visible triangle, or another visibility.
pub fn is_on_boundary(rays: &RayScene, r: &Renderer<'_>, truth: &Truth, i: usize) -> bool {
    let [w, h] = truth.size;
    let center = [f64::from(i as u32 % w) + 0.5, f64::from(i as u32 / w) + 0.5];
    let extent = truth.depth_view[i].abs().max(1.0);
    [[1.0, 0.0], [-1.0, 0.0], [0.0, 1.0], [0.0, -1.0]].iter().any(|d| {
        let at = [0, 1].map(|k| center[k] + d[k] / 64.0);
        let ndc = [2.0 * at[0] / f64::from(w) - 1.0, 2.0 * at[1] / f64::from(h) - 1.0];
        let (origin, direction) = r.camera().ray(ndc);
        let Some(hit) = rays.primary(origin, direction) else { return true };
        let to = match r.light().kind {
            LightKind::Spot { .. } => Target::Point(r.light().position()),
            LightKind::Directional { .. } => Target::Direction(-r.light().direction()),
        };
        let from = hit.position + hit.normal * 1e-9 * f64::from(extent);
        let lit = !rays.occluded(from, to, Some(hit.triangle));
        hit.triangle != truth.triangle[i] || lit != (truth.visibility[i] > 0.5)
    })
}

#[test]
fn shipped_scenes_without_masks_equal_the_ray_traced_truth() {
    const SIZE: [u32; 2] = [256, 144];
    with_gpu(|host| {
        let mut failed = vec![];
        for mut scene in every_shipped() {
            // Leave out instances with leaves cut from cards.
            scene.set_masked(Masked::Exclude);
            let mut r = renderer(host, &scene, desc(SIZE, 256));
            let seen = visibility(&mut r, "shadow-volumes", &[]);
            let ids = host.read_image::<u32>(&r.gbuffer().triangle).unwrap();
            let rays = RayScene::build(&scene).unwrap();
            let truth = hard(&rays, r.camera(), r.light(), SIZE, &|_, _| ()).unwrap();
            let judged = truth.judged(&ids);
            let surfaces = ids.iter().filter(|&&id| id != u32::MAX).count();
            let compared: Vec<usize> = (0..seen.len()).filter(|&i| judged[i]).collect();
            let wrong: Vec<usize> =
                compared.iter().copied().filter(|&i| (seen[i] > 0.5) != (truth.visibility[i] > 0.5)).collect();
            let outside: Vec<usize> =
                wrong.iter().copied().filter(|&i| !is_on_boundary(&rays, &r, &truth, i)).collect();
            let dark = compared.iter().filter(|&&i| truth.visibility[i] == 0.0).count();
            println!(
                "{:12} {surfaces} pixels of surfaces, {} compared, {dark} in shadow, {} wrong on a boundary, {} elsewhere",
                scene.name,
                compared.len(),
                wrong.len() - outside.len(),
                outside.len()
            );
            assert!(dark > 200 && compared.len() > 5000, "{}", scene.name);
            if !outside.is_empty() {
                let shown: Vec<_> = outside.iter().take(8).map(|i| (i % 256, i / 256, seen[*i])).collect();
                failed.push(format!("{}: {} wrong pixels, as {shown:?}", scene.name, outside.len()));
            }
        }
        assert!(failed.is_empty(), "{}", failed.join("\n"));
    });
}

#[test]
fn visibility_equals_its_mirror() {
    with_gpu(|host| {
        for name in ["jenga", "foliage"] {
            let scene = shipped_scene(name);
            for (normals, masked) in [(true, "map"), (true, "exclude"), (false, "map")] {
                let mut r = renderer(host, &scene, RenderDesc { normals, ..with_counts([256, 144]) });
                let (seen, raw) = counted(host, &mut r, &[("masked", masked)]);
                let asks = name == "foliage" && masked == "map";
                let offset = crate::mirrors::default_of("shadow-volumes", "normal_offset");
                let shot = Shot::of(host, &r, normals);
                let expected = mirror::visibility(&shot.data(), &raw, asks.then_some(offset)).unwrap();
                let most_ties = if normals { 0.003 } else { 0.02 };
                compare(&seen, &expected, 0.5).check(&format!("{name} {masked}, normals {normals}"), most_ties);
                // Where the map's test is used, it removes light.
                let alone = mirror::visibility(&shot.data(), &raw, None).unwrap();
                let wrong = compare(&seen, &alone, 0.5).wrong;
                assert_eq!(wrong > 0, asks, "{name} {masked}: {wrong}");
                // Other counts give another image.
                let planted: Vec<f32> = raw.iter().map(|&c| if c == 0.0 { 1.0 } else { 0.0 }).collect();
                let other = mirror::visibility(&shot.data(), &planted, None).unwrap();
                assert!(compare(&seen, &other, 0.5).wrong > 1000, "{name} {masked}");
            }
        }
    });
}

/// Prepares a technique for a scene's casters, each mesh an instance, with a copy of their positions.
fn prepare_alone(host: &Host, scene: &Scene, size: [u32; 2], settings: &[(&str, &str)]) -> Box<dyn Technique> {
    let meshes: Vec<_> = (scene.meshes.iter())
        .map(|m| CasterMesh { name: &m.name, positions: &m.positions, indices: &m.indices, first_vertex: 0 })
        .collect();
    let instances: Vec<_> = scene.instances.iter().map(|i| i.mesh).collect();
    let casters = Casters::new(host.context(), Vertices::Copy, &meshes, &instances, false).unwrap();
    let setup = Setup {
        extent: size,
        map_size: [256; 2],
        output: OutputFormat::R32,
        params: Params::parse(find("shadow-volumes").unwrap(), settings.iter().copied()).unwrap(),
        intermediates: false,
        casters: Some(Arc::new(casters)),
    };
    technique::prepare("shadow-volumes", host.context(), &setup).unwrap()
}

/// Tests depth buffers of engines whose vertex shader rounds differently from the caps', or whose depth is standard.
/// Near caps then lie in front of or behind the surfaces that they belong to, unless the bias moves them away.
#[test]
fn depth_that_was_drawn_otherwise_is_served_by_the_cap_bias() {
    const SIZE: [u32; 2] = [256, 144];
    const BIASES: [&str; 7] = ["0", "0.0009765625", "0.00390625", "0.015625", "0.0625", "0.25", "1"];
    // z' = w - z.
    let flip = DMat4::from_cols_array_2d(&[
        [1.0, 0.0, 0.0, 0.0],
        [0.0, 1.0, 0.0, 0.0],
        [0.0, 0.0, -1.0, 0.0],
        [0.0, 0.0, 1.0, 1.0],
    ]);
    with_gpu(|host| {
        let mut failed = vec![];
        let day = sun(dvec3(0.7, 2.0, 0.4));
        let lamp = spot(dvec3(1.0, 7.0, 1.5), dvec3(0.0, 0.0, 0.2), 0.8);
        let scenes = [
            ("sun", still_life(day)),
            ("spot", still_life(lamp)),
            ("jenga", shipped_scene("jenga")),
            ("drum", shipped_scene("drum")),
        ];
        for (name, scene) in scenes {
            let mut r = renderer(host, &scene, desc(SIZE, 256));
            let own = visibility(&mut r, "shadow-volumes", &[]);
            let g = r.gbuffer();
            let depth = host.read_values(&g.depth).unwrap();
            let upload = |values: &[f32]| {
                let usage = vk::ImageUsageFlags::SAMPLED;
                let desc = ImageDesc { usage, ..ImageDesc::storage("depth", vk::Format::R32_SFLOAT, SIZE) };
                host.upload_image(&desc, bytemuck::cast_slice(values)).unwrap()
            };
            // A projection times a number is the same projection, rounded differently.
            let scaled = CameraView { clip_from_view: r.camera().clip_from_view * 1.37, ..*r.camera() };
            let standard = CameraView {
                clip_from_view: flip * r.camera().clip_from_view,
                depth: DepthRange::Standard,
                ..*r.camera()
            };
            let turned: Vec<f32> = depth.iter().map(|&z| 1.0 - z).collect();
            let transforms: Vec<_> = scene.instances.iter().map(|i| i.world_from_object).collect();
            for (kind, camera, depth) in [
                ("the same", *r.camera(), upload(&depth)),
                ("scaled matrices", scaled, upload(&depth)),
                ("standard depth", standard, upload(&turned)),
            ] {
                let mut line = format!("{name:8} {kind:16} pixels that get darker, lighter:");
                for bias in BIASES {
                    let mut t = prepare_alone(host, &scene, SIZE, &[("cap_bias", bias)]);
                    let inputs = Inputs {
                        camera: &camera,
                        depth: depth.as_ref(),
                        normal: Some((g.geometric_normal.as_ref(), NormalEncoding::OctahedralSigned)),
                        shadow_map: r.shadow_map().as_ref(),
                        light: std::slice::from_ref(r.light()),
                        light_version: None,
                        camera_version: None,
                        casters: &transforms,
                    };
                    let seen = visibility_of(host, t.as_mut(), &inputs);
                    let darker = (0..seen.len()).filter(|&i| seen[i] < own[i]).count();
                    let lighter = (0..seen.len()).filter(|&i| seen[i] > own[i]).count();
                    line += &format!(" {bias}: {darker}, {lighter};");
                    let same = bias != "0" || kind == "the same";
                    if same && darker + lighter > 5 || !same && kind == "scaled matrices" && darker < 100 {
                        failed.push(format!("{name} {kind} {bias}: {darker} darker, {lighter} lighter"));
                    }
                }
                println!("{line}");
            }
        }
        assert!(failed.is_empty(), "{}", failed.join("\n"));
    });
}

/// A million triangles that together are smaller than a pixel.
#[test]
fn a_million_triangles_in_a_pixel() {
    with_gpu(|host| {
        let tiny = DAffine3::from_scale_rotation_translation(DVec3::splat(1e-3), DQuat::IDENTITY, dvec3(0.0, 2.0, 0.0));
        let parts = vec![
            (plane(8.0), moved(DVec3::ZERO)),
            (sphere(500, 1000), tiny),
            (cuboid(DVec3::splat(0.5)), moved(dvec3(1.0, 2.0, 0.0))),
        ];
        let scene = made::scene(parts, perspective(dvec3(2.0, 4.0, 7.0), DVec3::ZERO, 0.1), sun(dvec3(0.3, 2.0, 0.2)));
        let mut without = scene.clone();
        without.instances.remove(1);
        let run = |scene: &Scene| {
            let mut r = renderer(host, scene, with_counts(SIZE));
            counted(host, &mut r, &[]).1
        };
        let (with, without) = (run(&scene), run(&without));
        let other = with.iter().zip(&without).filter(|p| p.0 != p.1).count();
        println!("{other} pixels differ with a million triangles within one");
        assert!(other <= 4, "{other}");
    });
}
