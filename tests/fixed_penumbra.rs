//! Penumbrae of a fixed width against closed forms: lines, circles and cylinders, whose distances are known.

use edgeshade::reference::ray_traced::{
    Cache, FixedPenumbraSettings, Method, Origin, RayScene, SKY, SoftSettings, Truth, cache_key, fixed_penumbra, hard,
    trace,
};
use edgeshade::scene::{Instance, Material, Mesh, Scene};
use edgeshade::view::{CameraView, LightView, look_along, look_at};
use glam::{DAffine3, DMat3, DVec3, dvec3};
use std::f64::consts::TAU;
use std::sync::Mutex;

const SIZE: [u32; 2] = [64, 48];
const FOV: f64 = 0.9;

// ---------------------------------------------------------------- scenes

/// A scene of double-sided triangles; each part is an object of its own.
fn scene(parts: Vec<Vec<[DVec3; 3]>>) -> Scene {
    let mut scene =
        Scene { materials: vec![Material { double_sided: true, ..Material::default() }], ..Scene::default() };
    for (i, triangles) in parts.into_iter().enumerate() {
        let positions: Vec<[f32; 3]> = triangles.iter().flatten().map(|p| p.as_vec3().to_array()).collect();
        let indices = (0..positions.len() as u32).collect();
        let mut mesh = Mesh { positions, indices, ..Mesh::default() };
        mesh.compute_bounds();
        scene.meshes.push(mesh);
        scene.instances.push(Instance { mesh: i, world_from_object: DAffine3::IDENTITY });
    }
    scene
}

fn quad(a: DVec3, b: DVec3, c: DVec3, d: DVec3) -> Vec<[DVec3; 3]> {
    vec![[a, b, c], [a, c, d]]
}

fn floor() -> Vec<[DVec3; 3]> {
    let at = |x, z| dvec3(x, 0.0, z);
    quad(at(-60.0, -60.0), at(-60.0, 60.0), at(60.0, 60.0), at(60.0, -60.0))
}

/// The half-plane `m . p <= 0` at height 1; `m` is a horizontal unit vector.
fn half_plane(m: DVec3) -> Vec<[DVec3; 3]> {
    let (up, along) = (DVec3::Y, m.cross(DVec3::Y) * 50.0);
    quad(up - along, up + along, up + along - 50.0 * m, up - along - 50.0 * m)
}

fn block(low: DVec3, high: DVec3) -> Vec<[DVec3; 3]> {
    let corner = |i: u32| {
        let pick = |k: u32, a: f64, b: f64| if i >> k & 1 == 0 { a } else { b };
        dvec3(pick(0, low.x, high.x), pick(1, low.y, high.y), pick(2, low.z, high.z))
    };
    let faces = [[0, 1, 3, 2], [4, 5, 7, 6], [0, 1, 5, 4], [2, 3, 7, 6], [0, 2, 6, 4], [1, 3, 7, 5]];
    faces.into_iter().flat_map(|f| quad(corner(f[0]), corner(f[1]), corner(f[2]), corner(f[3]))).collect()
}

fn disc(height: f64, sides: u32) -> Vec<[DVec3; 3]> {
    let at = |i: u32| {
        dvec3((TAU * f64::from(i) / f64::from(sides)).cos(), height, (TAU * f64::from(i) / f64::from(sides)).sin())
    };
    (0..sides).map(|i| [dvec3(0.0, height, 0.0), at(i), at((i + 1) % sides)]).collect()
}

/// A cylinder of radius 1 around the y axis, without lids; its edges lie at multiples of a turn divided by `sides`.
fn cylinder(sides: u32) -> Vec<[DVec3; 3]> {
    let at = |i: u32, y: f64| {
        let a = TAU * f64::from(i % sides) / f64::from(sides);
        dvec3(a.cos(), y, a.sin())
    };
    (0..sides).flat_map(|i| quad(at(i, -9.0), at(i + 1, -9.0), at(i + 1, 9.0), at(i, 9.0))).collect()
}

/// A tilted camera, so that no line of the scenes is parallel to the picture's sides.
fn camera(eye: DVec3, target: DVec3) -> CameraView {
    let roll = DAffine3::from_axis_angle(DVec3::Z, 0.3);
    CameraView::perspective(look_at(eye, target) * roll, FOV, f64::from(SIZE[0]) / f64::from(SIZE[1]), 0.01)
}

fn sun(towards: DVec3) -> LightView {
    LightView::directional(look_along(20.0 * towards, -towards), [50.0, 50.0], 0.0, 100.0, 0.1)
}

fn spot(from: DVec3, to: DVec3) -> LightView {
    LightView::spot(look_at(from, to), 2.0, 0.1, 50.0, 0.5)
}

fn quiet(_: u64, _: u64) {}

fn traced(scene: &Scene, camera: &CameraView, light: &LightView, penumbra: f64, subsamples: u32) -> Truth {
    let settings = FixedPenumbraSettings { penumbra, subsamples };
    fixed_penumbra(&RayScene::build(scene).unwrap(), camera, light, SIZE, &settings, &quiet).unwrap()
}

// ---------------------------------------------------------------- judging

/// World-space point on the surface that a pixel sees, from its depth.
fn position(truth: &Truth, camera: &CameraView, i: usize) -> DVec3 {
    let (w, h) = (truth.size[0] as usize, truth.size[1] as usize);
    let ndc = [(2 * (i % w) + 1) as f64 / w as f64 - 1.0, (2 * (i / w) + 1) as f64 / h as f64 - 1.0];
    let (_, d) = camera.ray(ndc);
    let forward = camera.world_from_view.transform_vector3(DVec3::NEG_Z);
    camera.position() + d * (f64::from(truth.depth_view[i]) / d.dot(forward))
}

/// Visibility at a signed distance to the boundary, positive where lit.
fn model(distance: f64, penumbra: f64) -> f64 {
    (0.5 + distance / penumbra).clamp(0.0, 1.0)
}

/// Largest error of the visibility against the model, and the number of pixels in the penumbra. `distance` returns
/// `None` for pixels that are not judged.
fn worst(
    truth: &Truth,
    camera: &CameraView,
    distance: impl Fn(DVec3, usize) -> Option<f64>,
    penumbra: f64,
) -> (f64, usize) {
    let (mut worst, mut soft) = (0f64, 0);
    for i in 0..truth.visibility.len() {
        let v = f64::from(truth.visibility[i]);
        if truth.triangle[i] == SKY {
            worst = worst.max((v - 1.0).abs());
            continue;
        }
        let Some(d) = distance(position(truth, camera, i), i) else { continue };
        let expected = model(d, penumbra);
        soft += usize::from(expected > 0.0 && expected < 1.0);
        let error = (v - expected).abs();
        // `max` would ignore a NaN.
        worst = worst.max(if error.is_nan() { f64::INFINITY } else { error });
    }
    (worst, soft)
}

/// True for a point of the floor far from the ends of all sheets; the camera may see more.
fn is_near(p: DVec3) -> bool {
    p.y < 0.5 && p.length() < 20.0
}

/// Signed distance to the shadow edge of a half-plane on the floor.
fn shadow_edge(light: &LightView, m: DVec3) -> impl Fn(DVec3) -> f64 {
    let at = if light.is_directional() {
        let s = light.towards(DVec3::ZERO);
        -m.dot(s) / s.y
    } else {
        let l = light.position();
        -m.dot(l) / (l.y - 1.0)
    };
    move |p| m.dot(p) - at
}

// ---------------------------------------------------------------- closed forms

#[test]
fn a_straight_edge_on_a_floor() {
    for (k, angle) in [0.4f64, 2.1].into_iter().enumerate() {
        let m = dvec3(angle.cos(), 0.0, angle.sin());
        let lights = [sun(dvec3(0.3, 1.0, -0.5).normalize()), spot(dvec3(1.0, 4.0, 0.5), dvec3(0.0, 0.0, 0.2))];
        for light in &lights {
            let distance = shadow_edge(light, m);
            let middle = -distance(DVec3::ZERO) * m;
            // The camera is under the half-plane and low, so the farther floor is foreshortened six times.
            let camera = camera(middle + 2.5 * m + dvec3(0.0, 0.7, 0.0), middle);
            let scene = scene(vec![floor(), half_plane(m)]);
            let penumbra = 0.2;
            let truth = traced(&scene, &camera, light, penumbra, 4);
            let (error, soft) = worst(&truth, &camera, |p, _| is_near(p).then(|| distance(p)), penumbra);
            assert!(error < 2e-6 && soft > 50, "{k}: off by {error}, {soft} in the penumbra");

            // The check detects a penumbra 1 % too wide, a boundary displaced by 0.001, and a wrong pixel.
            let off = |d: &dyn Fn(DVec3) -> f64, p| worst(&truth, &camera, |q, _| is_near(q).then(|| d(q)), p).0;
            assert!(off(&distance, 1.01 * penumbra) > 1e-3 && off(&|p| distance(p) + 1e-3, penumbra) > 1e-3);
            assert!(off(&|p| -distance(p), penumbra) > 0.5);
            let mut planted = truth.clone();
            planted.visibility[(SIZE[1] / 2 * SIZE[0] + SIZE[0] / 2) as usize] = f32::NAN;
            assert!(worst(&planted, &camera, |p, _| is_near(p).then(|| distance(p)), penumbra).0 == f64::INFINITY);
        }
    }
}

#[test]
fn a_disc_under_the_zenith_converges() {
    let scene = scene(vec![floor(), disc(2.0, 1 << 14)]);
    let light = sun(DVec3::Y);
    let camera = camera(dvec3(2.5, 1.4, 0.6), dvec3(0.0, 0.0, 0.1));
    let penumbra = 0.3;
    let distance = |p: DVec3| p.x.hypot(p.z) - 1.0;
    let mut errors = vec![];
    for subsamples in [1, 2, 4, 8] {
        let truth = traced(&scene, &camera, &light, penumbra, subsamples);
        assert_eq!(truth.samples, subsamples * subsamples);
        let (error, soft) = worst(&truth, &camera, |p, _| Some(distance(p)), penumbra);
        assert!(soft > 100, "{soft}");
        // Guaranteed bound: the sagitta of the longest cell, for a curvature of 1.
        let w = SIZE[0] as usize;
        let diagonal = (0..truth.visibility.len() - w - 1)
            .filter(|i| i % w + 1 < w)
            .map(|i| [0, 1, w, w + 1].map(|k| position(&truth, &camera, i + k)))
            .filter(|c| c.iter().all(|&p| distance(p).abs() < penumbra))
            .map(|[a, b, c, d]| a.distance(d).max(b.distance(c)))
            .fold(0.0, f64::max);
        let bound = (diagonal / f64::from(subsamples)).powi(2) / 8.0;
        assert!(error * penumbra <= bound, "{subsamples}: D is off by {}, more than {bound}", error * penumbra);
        errors.push(error);
    }
    assert!(errors.windows(2).all(|e| e[1] < 0.4 * e[0]), "{errors:?}");
}

#[test]
fn a_terminator_softens_a_smooth_body() {
    // Edges between facets lie exactly a quarter turn from the sun.
    let scene = scene(vec![cylinder(360)]);
    let light = sun(DVec3::X);
    let camera = camera(dvec3(1.5, 0.5, 4.0), DVec3::ZERO);
    for penumbra in [0.4, 2.5] {
        let truth = traced(&scene, &camera, &light, penumbra, 4);
        let distance = |p: DVec3| p.x.signum() * p.x.hypot(p.z - 1.0);
        let (error, soft) = worst(&truth, &camera, |p, _| Some(distance(p)), penumbra);
        assert!(error < 2e-5 && soft > 100, "{penumbra}: off by {error}, {soft} in the penumbra");
        // The distance is measured straight, not along the surface; the two differ where the penumbra is wide.
        let along = |p: DVec3| p.x.signum() * p.x.atan2(p.z).abs();
        assert!(penumbra < 1.0 || worst(&truth, &camera, |p, _| Some(along(p)), penumbra).0 > 0.01);
    }
}

// ---------------------------------------------------------------- surfaces

#[test]
fn neither_outlines_nor_other_faces_are_boundaries() {
    // The sun is at the zenith: the block on the floor shadows nothing visible, and its sides face away.
    let m = DVec3::X;
    let (low, high) = (dvec3(0.1, 0.0, -0.3), dvec3(0.5, 0.05, 0.3));
    let light = sun(DVec3::Y);
    let camera = camera(dvec3(-1.2, 0.6, 0.4), dvec3(0.3, 0.0, 0.0));
    let penumbra = 0.8;
    for with_block in [true, false] {
        let mut parts = vec![floor(), half_plane(m)];
        parts.extend(with_block.then(|| block(low, high)));
        let truth = traced(&scene(parts), &camera, &light, penumbra, 4);
        let mut faces = [0; 3];
        let is_block = |p: DVec3| with_block && (p.cmpge(low - 1e-5) & p.cmple(high + 1e-5)).all() && p.y > 1e-5;
        let expected = |p: DVec3, _| {
            // The boundary is known only as far as it lies in the picture.
            let foot = camera.clip_from_view
                * camera.world_from_view.inverse().transform_point3(dvec3(0.0, 0.0, p.z)).extend(1.0);
            let is_seen = foot.w > 0.0 && foot.x.abs() < foot.w && foot.y.abs() < foot.w;
            match (is_block(p), p.y > 0.05 - 1e-5) {
                (true, true) => Some(f64::INFINITY),
                (true, false) => Some(f64::NEG_INFINITY),
                (false, _) => (is_seen && is_near(p)).then_some(p.x),
            }
        };
        for i in 0..truth.visibility.len() {
            let p = position(&truth, &camera, i);
            faces[if !is_block(p) { 0 } else { 1 + usize::from(p.y > 0.05 - 1e-5) }] += 1;
        }
        assert!(faces[0] > 500 && (!with_block || faces[1] > 20 && faces[2] > 50), "{faces:?}");
        let (error, soft) = worst(&truth, &camera, expected, penumbra);
        assert!(error < 2e-6 && soft > 500, "off by {error}, {soft} in the penumbra");
        // The check detects a floor's penumbra on the block: the floor's distance is wrong exactly if there is a block.
        assert_eq!(worst(&truth, &camera, |p, _| is_near(p).then_some(p.x), penumbra).0 > 0.1, with_block);
    }
}

#[test]
fn a_floor_of_several_objects_is_one_surface() {
    let light = sun(dvec3(0.3, 1.0, -0.5).normalize());
    let m = DVec3::X;
    let distance = shadow_edge(&light, m);
    let at = |x, z| dvec3(x, 0.0, z);
    let tile = |x0, z0, x1, z1| quad(at(x0, z0), at(x0, z1), at(x1, z1), at(x1, z0));
    // A T-shaped joint, one of whose lines is 0.02 beside the edge of the shadow.
    let joint = -distance(DVec3::ZERO) + 0.02;
    let tiles = vec![
        tile(-60.0, -60.0, joint, 60.0),
        tile(joint, -60.0, 60.0, 0.1),
        tile(joint, 0.1, 60.0, 60.0),
        half_plane(m),
    ];
    let camera = camera(dvec3(joint + 2.5, 0.7, 0.0), at(joint, 0.1));
    let truth = traced(&scene(tiles), &camera, &light, 0.2, 4);
    let (error, soft) = worst(&truth, &camera, |p, _| is_near(p).then(|| distance(p)), 0.2);
    // The joint is where `f32` rounds it to.
    assert!(error < 2e-6 && soft > 50, "off by {error}, {soft} in the penumbra");
}

// ---------------------------------------------------------------- invariance

/// A floor with a block, a leaning sheet and a cylinder, scaled and moved.
fn mixed(scale: f64, offset: DVec3) -> Scene {
    let lean = DMat3::from_rotation_x(0.4);
    let sheet = quad(dvec3(-0.5, 0.0, 0.0), dvec3(0.5, 0.0, 0.0), dvec3(0.5, 1.0, 0.0), dvec3(-0.5, 1.0, 0.0));
    let sheet = sheet.into_iter().map(|t| t.map(|p| lean * p + dvec3(0.3, 0.1, 0.8))).collect();
    let rod: Vec<_> =
        cylinder(24).into_iter().map(|t| t.map(|p| p * dvec3(0.3, 0.2, 0.3) + dvec3(-1.2, 0.9, 0.2))).collect();
    let mut scene = scene(vec![floor(), block(dvec3(-0.4, 0.0, -0.9), dvec3(0.5, 0.7, -0.1)), sheet, rod]);
    for instance in &mut scene.instances {
        instance.world_from_object =
            DAffine3 { matrix3: DMat3::from_diagonal(DVec3::splat(scale)), translation: offset };
    }
    scene
}

#[test]
fn neither_scale_nor_place_matters() {
    let made = |scale: f64, offset: DVec3| {
        let at = |p: DVec3| offset + scale * p;
        let roll = DAffine3::from_axis_angle(DVec3::Z, 0.3);
        let eye = look_at(at(dvec3(2.2, 1.8, 2.6)), at(dvec3(0.0, 0.3, 0.0))) * roll;
        let camera = CameraView::perspective(eye, FOV, f64::from(SIZE[0]) / f64::from(SIZE[1]), 0.01 * scale);
        let light =
            LightView::spot(look_at(at(dvec3(1.0, 5.0, -1.5)), at(DVec3::ZERO)), 1.5, 0.1 * scale, 20.0 * scale, 0.0);
        traced(&mixed(scale, offset), &camera, &light, 0.3 * scale, 4).visibility
    };
    let plain = made(1.0, DVec3::ZERO);
    let soft = plain.iter().filter(|v| **v > 0.0 && **v < 1.0).count();
    assert!(soft > 300, "{soft}");
    let largest = |other: &[f32]| plain.iter().zip(other).map(|(a, b)| (a - b).abs()).fold(0f32, f32::max);
    for (scale, offset) in
        [(1000.0, DVec3::ZERO), (1e-3, DVec3::ZERO), (0.7, dvec3(1e5, -3e4, 2e5)), (3e3, dvec3(1e7, 0.0, 1e7))]
    {
        let difference = largest(&made(scale, offset));
        assert!(difference < 1e-4, "scale {scale}, at {offset}: differs by {difference}");
    }
    // The comparison detects visibilities that are 1 % too small.
    assert!(largest(&made(1.0, dvec3(0.0, 0.0, 0.0)).iter().map(|v| 0.99 * v).collect::<Vec<_>>()) > 1e-4);
}

// ---------------------------------------------------------------- settings

#[test]
fn it_is_the_hard_truth_with_other_visibilities() {
    let (scene, light) = (mixed(1.0, DVec3::ZERO), spot(dvec3(1.0, 5.0, -1.5), DVec3::ZERO));
    let camera = camera(dvec3(2.2, 1.8, 2.6), dvec3(0.0, 0.3, 0.0));
    let rays = RayScene::build(&scene).unwrap();
    let steps = Mutex::new(vec![]);
    let settings = FixedPenumbraSettings { penumbra: 0.2, subsamples: 3 };
    let soft = fixed_penumbra(&rays, &camera, &light, SIZE, &settings, &|done, total| {
        steps.lock().unwrap().push((done, total))
    })
    .unwrap();
    let hard = hard(&rays, &camera, &light, SIZE, &quiet).unwrap();
    let hard =
        Truth { visibility: soft.visibility.clone(), samples: 9, rays: soft.rays, seconds: soft.seconds, ..hard };
    assert_eq!(soft, hard);
    let steps = steps.into_inner().unwrap();
    assert!(steps.iter().all(|s| s.0 <= s.1 && s.1 == steps[0].1) && steps.iter().any(|s| s.0 == s.1));

    // A vanishing width leaves the hard shadow, and the light's size has no other influence than the width.
    let hard = trace(&rays, &camera, &light, SIZE, &Method::Hard, &quiet).unwrap();
    assert_eq!(traced(&scene, &camera, &light, 1e-9, 2).visibility, hard.visibility);
    for bad in [0.0, -1.0, f64::NAN, f64::INFINITY] {
        let settings = FixedPenumbraSettings { penumbra: bad, subsamples: 4 };
        let error = fixed_penumbra(&rays, &camera, &light, SIZE, &settings, &quiet).unwrap_err().to_string();
        assert!(error.contains(&bad.to_string()) && error.contains("above 0"), "{error}");
    }
    for bad in [0, 17] {
        let settings = FixedPenumbraSettings { penumbra: 1.0, subsamples: bad };
        let error = fixed_penumbra(&rays, &camera, &light, SIZE, &settings, &quiet).unwrap_err().to_string();
        assert!(error.contains("1 to 16"), "{error}");
    }
    let settings = FixedPenumbraSettings { penumbra: 1.0, subsamples: 1 };
    assert!(fixed_penumbra(&rays, &camera, &light, [0, 4], &settings, &quiet).is_err());
    // An empty scene is not an error, nor is a single pixel.
    let nothing = RayScene::build(&Scene::default()).unwrap();
    assert_eq!(fixed_penumbra(&nothing, &camera, &light, [3, 1], &settings, &quiet).unwrap().visibility, [1.0; 3]);
    fixed_penumbra(&rays, &camera, &light, [1, 1], &settings, &quiet).unwrap();
}

#[test]
fn each_setting_has_a_key_and_a_file_of_its_own() {
    let (scene, light) = (mixed(1.0, DVec3::ZERO), spot(dvec3(1.0, 5.0, -1.5), DVec3::ZERO));
    let camera = camera(dvec3(2.2, 1.8, 2.6), dvec3(0.0, 0.3, 0.0));
    let method = |penumbra, subsamples| Method::FixedPenumbra(FixedPenumbraSettings { penumbra, subsamples });
    let key = |method: &Method| cache_key(&scene, &camera, &light, SIZE, method);
    let soft = |samples| Method::Soft(SoftSettings { samples, ..SoftSettings::default() });
    let keys = [method(0.2, 4), method(0.2, 3), method(0.3, 4), Method::Hard, soft(4), soft(16)].map(|m| key(&m));
    assert!((0..keys.len()).all(|i| keys[..i].iter().all(|other| *other != keys[i])));
    let larger = LightView { kind: spot(DVec3::ONE, DVec3::ZERO).kind, ..light };
    assert_eq!(cache_key(&scene, &camera, &larger, SIZE, &method(0.2, 4)), keys[0]);

    let folder = tempfile::tempdir().unwrap();
    let cache = Cache::open(Some(folder.path()));
    let rays = RayScene::build(&scene).unwrap();
    let get =
        |m: Method| cache.get_or_trace(&key(&m), SIZE, || trace(&rays, &camera, &light, SIZE, &m, &quiet)).unwrap();
    let (first, origin) = get(method(0.2, 2));
    assert_eq!(origin, Origin::Traced);
    assert_eq!(get(method(0.2, 2)), (first.clone(), Origin::Cached));
    let (other, origin) = get(method(0.25, 2));
    assert!(origin == Origin::Traced && other.visibility != first.visibility);
}
