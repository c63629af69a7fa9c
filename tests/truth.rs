//! Exact visibility against independent answers: brute force with another triangle test, and closed forms.

use edgeshade::reference::ray_traced::{
    Cache, Method, Origin, RayScene, SKY, SoftSettings, Target, Truth, cache_key, hard, soft, trace,
};
use edgeshade::scene::{Instance, Material, Mesh, Scene, Texture, Wrap};
use edgeshade::view::{CameraView, DepthRange, LightKind, LightView, look_along, look_at};
use glam::{DAffine3, DMat3, DVec3, Vec3, dvec3};
use std::f64::consts::PI;

// ---------------------------------------------------------------- scenes

struct Random(u64);

impl Random {
    fn bits(&mut self) -> u64 {
        self.0 = self.0.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
        let x = self.0 ^ (self.0 >> 33);
        x.wrapping_mul(0xff51afd7ed558ccd) >> 11
    }
    fn unit(&mut self) -> f64 {
        self.bits() as f64 / (1u64 << 53) as f64
    }
    fn within(&mut self, a: f64, b: f64) -> f64 {
        a + (b - a) * self.unit()
    }
    fn point(&mut self, half: f64) -> DVec3 {
        dvec3(self.within(-half, half), self.within(-half, half), self.within(-half, half))
    }
}

fn mesh(positions: Vec<[f32; 3]>, indices: Vec<u32>, material: usize) -> Mesh {
    let n = positions.len();
    let mut mesh = Mesh {
        positions,
        indices,
        material,
        normals: vec![[0.0, 1.0, 0.0]; n],
        uvs: vec![[0.0; 2]; n],
        ..Mesh::default()
    };
    mesh.compute_bounds();
    mesh
}

/// A square in the plane y = 0 that faces up, of `n` x `n` quads; uv covers it once.
fn plane(half: f32, n: u32, material: usize) -> Mesh {
    let at = |i: u32| half * (2.0 * i as f32 / n as f32 - 1.0);
    let mut positions = Vec::new();
    let mut uvs = Vec::new();
    let mut indices = Vec::new();
    for j in 0..=n {
        for i in 0..=n {
            positions.push([at(i), 0.0, at(j)]);
            uvs.push([i as f32 / n as f32, j as f32 / n as f32]);
        }
    }
    for j in 0..n {
        for i in 0..n {
            let a = j * (n + 1) + i;
            indices.extend([a, a + n + 1, a + 1, a + 1, a + n + 1, a + n + 2]);
        }
    }
    Mesh { uvs, ..mesh(positions, indices, material) }
}

/// The cube [-1, 1]^3; its front faces point outwards.
fn cube(material: usize) -> Mesh {
    let mut positions = Vec::new();
    let mut indices = Vec::new();
    for axis in 0..3 {
        for sign in [-1.0f32, 1.0] {
            let first = positions.len() as u32;
            for (u, v) in [(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)] {
                let mut p = [0.0; 3];
                p[axis] = sign;
                p[(axis + 1) % 3] = if sign > 0.0 { u } else { -u };
                p[(axis + 2) % 3] = v;
                positions.push(p);
            }
            indices.extend([0, 1, 2, 0, 2, 3].map(|i| first + i));
        }
    }
    mesh(positions, indices, material)
}

/// A closed unit sphere of `n` x `2n` patches with front faces outwards; every corner exists once.
fn sphere(n: u32, material: usize) -> Mesh {
    let mut positions = vec![[0.0, 1.0, 0.0]];
    for i in 1..n {
        for j in 0..2 * n {
            let (th, ph) = (PI * f64::from(i) / f64::from(n), PI * f64::from(j) / f64::from(n));
            positions.push(dvec3(th.sin() * ph.sin(), th.cos(), th.sin() * ph.cos()).as_vec3().to_array());
        }
    }
    positions.push([0.0, -1.0, 0.0]);
    let at = |i: u32, j: u32| match i {
        0 => 0,
        i if i == n => (n - 1) * 2 * n + 1,
        i => 1 + (i - 1) * 2 * n + j % (2 * n),
    };
    let mut indices = Vec::new();
    for i in 0..n {
        for j in 0..2 * n {
            if i + 1 < n {
                indices.extend([at(i, j), at(i + 1, j), at(i + 1, j + 1)]);
            }
            if i > 0 {
                indices.extend([at(i, j), at(i + 1, j + 1), at(i, j + 1)]);
            }
        }
    }
    mesh(positions, indices, material)
}

fn soup(random: &mut Random, n: u32, material: usize) -> Mesh {
    let mut positions = Vec::new();
    for _ in 0..n {
        let center = random.point(1.5);
        for _ in 0..3 {
            positions.push((center + random.point(0.4)).as_vec3().to_array());
        }
    }
    mesh(positions, (0..3 * n).collect(), material)
}

fn scene(meshes: Vec<(Mesh, DAffine3)>, materials: Vec<Material>) -> Scene {
    let mut out = Scene { materials, ..Scene::default() };
    for (i, (mesh, world_from_object)) in meshes.into_iter().enumerate() {
        out.meshes.push(mesh);
        out.instances.push(Instance { mesh: i, world_from_object });
    }
    out
}

fn both_sides() -> Material {
    Material { double_sided: true, ..Material::default() }
}

fn at(x: f64, y: f64, z: f64) -> DAffine3 {
    DAffine3::from_translation(dvec3(x, y, z))
}

fn scaled(s: [f64; 3], t: [f64; 3]) -> DAffine3 {
    DAffine3 { matrix3: DMat3::from_diagonal(s.into()), translation: t.into() }
}

const SIZE: [u32; 2] = [64, 48];

fn camera(eye: DVec3, target: DVec3, scale: f64) -> CameraView {
    CameraView::perspective(look_at(eye, target), 0.9, f64::from(SIZE[0]) / f64::from(SIZE[1]), 0.05 * scale)
}

/// A floor, a tessellated ball, a box and scattered triangles.
fn mixed(seed: u64) -> Scene {
    let mut random = Random(seed);
    let tilt = DAffine3::from_axis_angle(dvec3(1.0, 2.0, 0.5).normalize(), 0.7);
    let flying = soup(&mut random, 40, 0);
    scene(
        vec![
            (plane(4.0, 6, 1), at(0.0, -1.0, 0.0)),
            (sphere(10, 1), at(-1.0, 0.1, 0.3) * DAffine3::from_scale(DVec3::splat(0.8))),
            (cube(1), at(1.2, -0.3, -0.2) * tilt * DAffine3::from_scale(dvec3(0.5, 0.6, 0.4))),
            (flying, scaled([-1.0, 0.8, 1.1], [0.2, 0.7, 0.0])),
        ],
        vec![both_sides(), Material::default()],
    )
}

fn lights(scale: f64, offset: DVec3, width: f64) -> [LightView; 2] {
    let spot = look_at(offset + scale * dvec3(2.0, 5.0, 1.5), offset);
    let sun = look_at(offset + scale * dvec3(-1.5, 4.0, 2.5), offset);
    let half = 5.0 * scale;
    [
        LightView::spot(spot, 1.6, 0.1 * scale, 20.0 * scale, width * scale),
        LightView::directional(sun, [half, half], 0.0, 12.0 * scale, 0.15 * width),
    ]
}

fn quiet(_: u64, _: u64) {}

fn hard_truth(scene: &Scene, camera: &CameraView, light: &LightView) -> Truth {
    hard(&RayScene::build(scene).unwrap(), camera, light, SIZE, &quiet).unwrap()
}

/// World-space point that a pixel sees, from its depth alone.
fn position(truth: &Truth, camera: &CameraView, i: usize) -> DVec3 {
    let (w, h) = (truth.size[0] as usize, truth.size[1] as usize);
    let ndc = [(2 * (i % w) + 1) as f64 / w as f64 - 1.0, (2 * (i / w) + 1) as f64 / h as f64 - 1.0];
    let (_, d) = camera.ray(ndc);
    let forward = camera.world_from_view.transform_vector3(DVec3::NEG_Z);
    camera.position() + d * (f64::from(truth.depth_view[i]) / d.dot(forward))
}

// ---------------------------------------------------------------- brute force

struct Flat {
    corners: [DVec3; 3],
    outwards: DVec3,
    double_sided: bool,
}

fn flatten(scene: &Scene) -> Vec<Flat> {
    let mut out = Vec::new();
    for instance in &scene.instances {
        let mesh = &scene.meshes[instance.mesh];
        for t in mesh.indices.chunks(3) {
            let corner = |k: usize| {
                instance.world_from_object.transform_point3(Vec3::from(mesh.positions[t[k] as usize]).as_dvec3())
            };
            let corners = [corner(0), corner(1), corner(2)];
            let flip = instance.world_from_object.matrix3.determinant().signum();
            out.push(Flat {
                corners,
                outwards: flip * (corners[1] - corners[0]).cross(corners[2] - corners[0]),
                double_sided: scene.materials[mesh.material].double_sided,
            });
        }
    }
    out
}

/// The Moeller-Trumbore test: `t`, and the smallest barycentric weight, which tells how close the crossing is to an
/// edge.
fn moeller_trumbore(o: DVec3, d: DVec3, t: &Flat) -> Option<(f64, f64)> {
    let (e1, e2) = (t.corners[1] - t.corners[0], t.corners[2] - t.corners[0]);
    let p = d.cross(e2);
    let det = e1.dot(p);
    if det == 0.0 {
        return None;
    }
    let s = (o - t.corners[0]) / det;
    let u = s.dot(p);
    let q = s.cross(e1);
    let v = d.dot(q);
    Some((e2.dot(q), u.min(v).min(1.0 - u - v)))
}

/// Visibility and triangle of a pixel, and true if any decision was a near-tie.
fn brute(flat: &[Flat], camera: &CameraView, light: &LightView, i: usize) -> (f32, u32, bool) {
    const TIE: f64 = 1e-9;
    let (w, h) = (SIZE[0] as usize, SIZE[1] as usize);
    let ndc = [(2 * (i % w) + 1) as f64 / w as f64 - 1.0, (2 * (i / w) + 1) as f64 / h as f64 - 1.0];
    let (o, d) = camera.ray(ndc);
    let forward = camera.world_from_view.transform_vector3(DVec3::NEG_Z);
    let near = camera.clip_from_view.w_axis.z / d.dot(forward);
    let mut tie = false;
    let mut best = (f64::INFINITY, SKY);
    for (id, t) in flat.iter().enumerate() {
        let Some((distance, inside)) = moeller_trumbore(o, d, t) else { continue };
        if distance < near || !t.double_sided && t.outwards.dot(d) >= 0.0 {
            continue;
        }
        tie |= inside.abs() < TIE || inside > 0.0 && (distance - best.0).abs() < TIE;
        if inside >= 0.0 && distance < best.0 {
            best = (distance, id as u32);
        }
    }
    let (distance, id) = best;
    if id == SKY {
        return (1.0, SKY, tie);
    }
    let p = o + distance * d;
    let n = flat[id as usize].outwards.normalize();
    let n = if n.dot(d) > 0.0 { -n } else { n };
    let to_light = match light.kind {
        LightKind::Spot { .. } => light.position() - p,
        LightKind::Directional { .. } => -1e4 * light.direction(),
    };
    let cosine = n.dot(to_light.normalize());
    tie |= cosine.abs() < TIE;
    if cosine <= 0.0 {
        return (0.0, id, tie);
    }
    let mut blocked = false;
    for (other, t) in flat.iter().enumerate() {
        let Some((s, inside)) = moeller_trumbore(p, to_light, t) else { continue };
        if other == id as usize || !(-TIE..1.0 + TIE).contains(&s) {
            continue;
        }
        tie |= inside.abs() < TIE || inside > 0.0 && s < TIE;
        blocked |= inside >= 0.0 && s > 0.0 && s < 1.0;
    }
    (if blocked { 0.0 } else { 1.0 }, id, tie)
}

/// Number of pixels that differ, of near-ties, and of pixels in shadow.
fn compare(truth: &Truth, flat: &[Flat], camera: &CameraView, light: &LightView) -> [usize; 3] {
    let mut counts = [0; 3];
    for i in 0..truth.visibility.len() {
        let (visibility, id, tie) = brute(flat, camera, light, i);
        let differs = visibility != truth.visibility[i] || id != truth.triangle[i];
        counts[0] += usize::from(differs && !tie);
        counts[1] += usize::from(tie);
        counts[2] += usize::from(visibility == 0.0);
    }
    counts
}

#[test]
fn equals_brute_force_with_another_triangle_test() {
    let (mut shadowed, mut ties, mut pixels) = (0, 0, 0);
    for seed in 1..4 {
        let mut scene = mixed(seed);
        // The scattered triangles once more, single-sided and mirrored.
        let mut soup = scene.meshes[3].clone();
        soup.material = 1;
        scene.meshes.push(soup);
        scene.instances.push(Instance { mesh: 4, world_from_object: scaled([1.0, -1.0, 1.0], [0.0, 0.5, 0.3]) });
        let camera = camera(dvec3(0.5, 2.0, 4.5), dvec3(0.0, -0.2, 0.0), 1.0);
        let flat = flatten(&scene);
        for light in lights(1.0, DVec3::ZERO, 0.0) {
            let truth = hard_truth(&scene, &camera, &light);
            let [differ, tie, dark] = compare(&truth, &flat, &camera, &light);
            assert_eq!(differ, 0, "seed {seed}, {:?}", light.kind);
            shadowed += dark;
            ties += tie;
            pixels += truth.visibility.len();
        }
    }
    assert!(ties <= 2, "{ties} near-ties");
    assert!(shadowed > pixels / 20 && shadowed < pixels / 2, "{shadowed} of {pixels} dark: nothing was tested");

    // The comparison notices one missing triangle.
    let scene = mixed(1);
    let camera = camera(dvec3(0.5, 2.0, 4.5), dvec3(0.0, -0.2, 0.0), 1.0);
    let [light, _] = lights(1.0, DVec3::ZERO, 0.0);
    let mut flat = flatten(&scene);
    let truth = hard_truth(&scene, &camera, &light);
    assert_eq!(compare(&truth, &flat, &camera, &light)[0], 0);
    let seen = *truth.triangle.iter().filter(|t| **t != SKY).max().unwrap();
    flat[seen as usize].corners = [DVec3::ZERO; 3];
    assert!(compare(&truth, &flat, &camera, &light)[0] > 0);
}

// ---------------------------------------------------------------- closed forms

#[test]
fn a_half_plane_before_a_square_light_gives_a_linear_ramp() {
    // The floor is at y = 0, the occluder over x < 0 at y = 1, the light at y = 2. A point x of the floor sees the
    // light to the right of -x.
    let cover = scaled([10.0, 1.0, 10.0], [-10.0, 1.0, 0.0]);
    let scene = scene(vec![(plane(10.0, 4, 0), at(0.0, 0.0, 0.0)), (plane(1.0, 3, 0), cover)], vec![both_sides()]);
    let camera = camera(dvec3(0.2, 0.9, 1.5), dvec3(0.0, 0.0, 0.0), 1.0);
    let width = 0.8;
    let spot = LightView::spot(look_at(dvec3(0.0, 2.0, 0.0), DVec3::ZERO), 2.0, 0.1, 10.0, width);
    let rays = RayScene::build(&scene).unwrap();
    let truth = soft(&rays, &camera, &spot, SIZE, &SoftSettings::default(), &quiet).unwrap();
    assert_eq!(truth.samples, 1024);

    let error = |shift: f64| {
        let (mut worst, mut sum, mut inside) = (0f64, 0.0, 0);
        for i in 0..truth.visibility.len() {
            if truth.triangle[i] >= 32 {
                continue;
            }
            let x = position(&truth, &camera, i).x + shift;
            let exact = (0.5 + x / width).clamp(0.0, 1.0);
            let e = f64::from(truth.visibility[i]) - exact;
            if exact == 0.0 || exact == 1.0 {
                // Depth is stored as f32, so a pixel at the border of the penumbra may be on either side.
                assert!(e.abs() < 1e-6 || (x.abs() - 0.5 * width).abs() < 1e-2 || shift != 0.0, "{x}: {e}");
            } else {
                (worst, sum, inside) = (worst.max(e.abs()), sum + e, inside + 1);
            }
        }
        assert!(inside > 300, "{inside} pixels in the penumbra");
        (worst, (sum / f64::from(inside)).abs())
    };
    let (worst, bias) = error(0.0);
    assert!(worst < 0.012 && bias < 5e-4, "{worst}, {bias}");
    // The bound detects a ramp displaced by 1 % of the light's width.
    assert!(error(0.01 * width).1 > 5e-3);
}

#[test]
fn a_sun_behind_a_half_plane_gives_the_ramp_of_its_angle() {
    let cover = scaled([10.0, 1.0, 10.0], [-10.0, 1.0, 0.0]);
    let scene = scene(vec![(plane(10.0, 1, 0), at(0.0, 0.0, 0.0)), (plane(1.0, 1, 0), cover)], vec![both_sides()]);
    let camera = camera(dvec3(0.2, 0.9, 1.5), dvec3(0.0, 0.0, 0.0), 1.0);
    let angle: f64 = 0.5;
    let down = look_along(dvec3(0.0, 5.0, 0.0), DVec3::NEG_Y);
    let sun = LightView::directional(down, [10.0, 10.0], 0.0, 10.0, angle);
    let truth = soft(&RayScene::build(&scene).unwrap(), &camera, &sun, SIZE, &SoftSettings::default(), &quiet).unwrap();
    let mut worst: f64 = 0.0;
    for i in (0..truth.visibility.len()).filter(|&i| truth.triangle[i] < 2) {
        // At height 1 the light spans x - tan .. x + tan.
        let exact = 0.5 + position(&truth, &camera, i).x / (2.0 * (0.5 * angle).tan());
        worst = worst.max((f64::from(truth.visibility[i]) - exact.clamp(0.0, 1.0)).abs());
    }
    assert!(worst < 0.012, "{worst}");
}

#[test]
fn a_rectangle_before_a_square_light_covers_its_exact_area() {
    // The occluder is [-0.2, 0.1] x [-0.15, 0.25] at half height: its projection on the light is mirrored and twice
    // as large.
    let card = scaled([0.15, 1.0, 0.2], [-0.05, 1.0, 0.05]);
    let scene = scene(vec![(plane(3.0, 1, 0), at(0.0, 0.0, 0.0)), (plane(1.0, 2, 0), card)], vec![both_sides()]);
    let camera = camera(dvec3(0.0, 0.8, 1.2), dvec3(0.0, 0.0, 0.0), 1.0);
    let width = 1.0;
    let light = LightView::spot(look_at(dvec3(0.0, 2.0, 0.0), DVec3::ZERO), 2.0, 0.1, 10.0, width);
    let truth =
        soft(&RayScene::build(&scene).unwrap(), &camera, &light, SIZE, &SoftSettings::default(), &quiet).unwrap();
    let covered = |a: f64, b: f64, p: f64| {
        let lo = (2.0 * a - p).max(-0.5 * width);
        let hi = (2.0 * b - p).min(0.5 * width);
        (hi - lo).max(0.0) / width
    };
    let (mut worst, mut sum, mut n) = (0f64, 0.0, 0);
    for i in (0..truth.visibility.len()).filter(|&i| truth.triangle[i] < 2) {
        let p = position(&truth, &camera, i);
        let exact = 1.0 - covered(-0.2, 0.1, p.x) * covered(-0.15, 0.25, p.z);
        let e = f64::from(truth.visibility[i]) - exact;
        (worst, sum, n) = (worst.max(e.abs()), sum + e, n + usize::from(exact < 1.0));
    }
    assert!(n > 500 && worst < 0.02 && (sum / n as f64).abs() < 5e-4, "{n} pixels, worst {worst}, sum {sum}");
}

/// Slab test of the box [-half, half]^3 around `center`, with the margin of the decision.
fn hits_box(o: DVec3, d: DVec3, center: DVec3, half: f64, t_max: f64) -> (bool, f64) {
    let a = (center - half - o) / d;
    let b = (center + half - o) / d;
    let enter = a.min(b).max_element();
    let leave = a.max(b).min_element();
    let clear = (leave - enter).abs().min(leave.abs()).min((enter - t_max).abs());
    (enter < leave && leave > 0.0 && enter < t_max, clear)
}

#[test]
fn a_box_on_the_floor_casts_the_shadow_of_a_box() {
    let half = 0.9;
    let center = dvec3(0.3, half, -0.2);
    let placed = scaled([half; 3], center.to_array());
    let scene = scene(vec![(plane(8.0, 16, 0), at(0.0, 0.0, 0.0)), (cube(0), placed)], vec![Material::default()]);
    let camera = camera(dvec3(0.5, 5.0, -4.5), dvec3(0.0, 0.0, 0.0), 1.0);
    for light in lights(1.0, DVec3::ZERO, 0.0) {
        let truth = hard_truth(&scene, &camera, &light);
        let (mut wrong, mut moved, mut close, mut dark) = (0, 0, 0, 0);
        for i in (0..truth.visibility.len()).filter(|&i| truth.triangle[i] < 512) {
            let p = position(&truth, &camera, i);
            let (d, end) =
                if light.is_directional() { (-light.direction(), f64::INFINITY) } else { (light.position() - p, 1.0) };
            let (blocked, clear) = hits_box(p, d, center, half, end);
            // Depth is stored as f32, so decisions with a small margin do not count.
            close += usize::from(clear < 1e-5);
            wrong += usize::from(clear >= 1e-5 && blocked != (truth.visibility[i] == 0.0));
            dark += usize::from(blocked);
            let (other, _) = hits_box(p, d, center + dvec3(0.02, 0.0, 0.0), half, end);
            moved += usize::from(other != (truth.visibility[i] == 0.0));
        }
        assert_eq!(wrong, 0, "{:?}, {close} close", light.kind);
        assert!(dark > 100 && close < 10 && moved > 0, "{dark} {close} {moved}");
    }
}

// ---------------------------------------------------------------- robustness

fn moved(t: &DAffine3, scale: f64, view: &DAffine3) -> DAffine3 {
    let m = *t * *view;
    DAffine3 { matrix3: m.matrix3 * (1.0 / scale), translation: m.translation }
}

#[test]
fn scale_and_distance_from_the_origin_change_nothing() {
    let scene = mixed(7);
    let eye = camera(dvec3(0.5, 2.0, 4.5), dvec3(0.0, -0.2, 0.0), 1.0);
    for kind in 0..2 {
        let light = lights(1.0, DVec3::ZERO, 0.5)[kind];
        let before = hard_truth(&scene, &eye, &light);
        for (scale, offset) in [(1e-3, 0.0), (1e3, 0.0), (1.0, 1e5), (1.0, 1e6), (1e-3, 1e3), (3.0, 1e6)] {
            let t = DAffine3 {
                matrix3: DMat3::from_diagonal(DVec3::splat(scale)),
                translation: dvec3(offset, -0.7 * offset, 0.9 * offset),
            };
            let mut other = scene.clone();
            other.transform(&t);
            let mut camera = camera(DVec3::ONE, DVec3::ZERO, scale);
            camera.world_from_view = moved(&t, scale, &eye.world_from_view);
            let mut there = lights(scale, DVec3::ZERO, 0.5)[kind];
            there.world_from_view = moved(&t, scale, &light.world_from_view);
            let after = hard_truth(&other, &camera, &there);
            let differ = (0..before.visibility.len())
                .filter(|&i| {
                    before.visibility[i] != after.visibility[i]
                        || before.triangle[i] != after.triangle[i]
                        || before.outside_light[i] != after.outside_light[i]
                })
                .count();
            assert!(differ <= 1, "scale {scale}, offset {offset}: {differ} pixels differ");
            let depth = (0..before.depth_view.len())
                .filter(|&i| before.triangle[i] != SKY)
                .map(|i| (f64::from(after.depth_view[i]) / scale / f64::from(before.depth_view[i]) - 1.0).abs())
                .fold(0.0, f64::max);
            assert!(depth < 1e-6, "scale {scale}, offset {offset}: depth differs by {depth}");
        }
    }
    // The count detects a light that moved slightly.
    let [light, _] = lights(1.0, DVec3::ZERO, 0.5);
    let mut shifted = light;
    shifted.world_from_view.translation.x += 0.05;
    assert_ne!(hard_truth(&scene, &eye, &light).visibility, hard_truth(&scene, &eye, &shifted).visibility);
}

#[test]
fn nothing_shadows_itself_on_planes_and_convex_bodies() {
    let tilt = DAffine3::from_axis_angle(dvec3(0.3, 1.0, 0.2).normalize(), 0.9)
        * DAffine3::from_axis_angle(dvec3(1.0, 0.0, 0.4).normalize(), 0.2);
    // Tilted once by the transform, and once by the positions, which are then rounded to f32.
    let mut baked = plane(3.0, 40, 0);
    for p in &mut baked.positions {
        *p = tilt.transform_point3(Vec3::from(*p).as_dvec3()).as_vec3().to_array();
    }
    let ball = at(0.0, 0.5, 0.0);
    let cases = [
        (plane(3.0, 40, 0), tilt),
        (baked, DAffine3::IDENTITY),
        (plane(3.0, 1, 0), DAffine3::IDENTITY),
        (sphere(40, 0), ball),
        (sphere(7, 0), ball * scaled([1.0, 0.6, 1.4], [0.0; 3])),
        (cube(0), tilt),
    ];
    for (case, (mesh, place)) in cases.into_iter().enumerate() {
        for scale in [1e-3, 1.0, 1e3] {
            for offset in [0.0, 1e5, 1e6] {
                let origin = dvec3(offset, 0.3 * offset, -offset);
                let world = DAffine3 { matrix3: DMat3::from_diagonal(DVec3::splat(scale)), translation: origin };
                let scene = scene(vec![(mesh.clone(), world * place)], vec![both_sides()]);
                let eye = camera(origin + scale * dvec3(0.5, 2.5, 2.5), origin, scale);
                for light in lights(scale, origin, 0.0) {
                    let truth = hard_truth(&scene, &eye, &light);
                    let facing: Vec<_> = (0..truth.visibility.len()).filter(|&i| truth.n_dot_l[i] > 1e-4).collect();
                    let dark = facing.iter().filter(|&&i| truth.visibility[i] != 1.0).count();
                    assert!(facing.len() > 300, "case {case}: {} pixels", facing.len());
                    assert_eq!(dark, 0, "case {case}, scale {scale}, offset {offset}, {:?}", light.kind);
                    let away = (0..truth.visibility.len()).filter(|&i| truth.n_dot_l[i] < 0.0);
                    assert!(away.into_iter().all(|i| truth.visibility[i] == 0.0));
                }
            }
        }
    }
}

#[test]
fn points_exactly_on_the_edges_of_a_plane_are_lit() {
    // Seen from straight above, every pixel centre lies on a corner of the tessellation, where six coplanar triangles
    // meet and only one of them is skipped.
    for seed in 0..6 {
        let mut random = Random(seed);
        let tilt = DAffine3::from_axis_angle(random.point(1.0).normalize(), random.within(0.1, 3.0));
        let scene = scene(vec![(plane(1.0, 128, 0), tilt)], vec![both_sides()]);
        let above = tilt * look_along(dvec3(0.0, 2.0, 0.0), DVec3::NEG_Y);
        let eye = CameraView::orthographic(above, [1.0, 1.0], 0.1, 10.0);
        let rays = RayScene::build(&scene).unwrap();
        for direction in [dvec3(0.1, -1.0, 0.2), dvec3(-1.0, -0.1, 0.3), dvec3(1.0, -0.03, 1.0)] {
            let down =
                look_along(tilt.transform_point3(-3.0 * direction), tilt.transform_vector3(direction.normalize()));
            for light in
                [LightView::directional(down, [9.0, 9.0], 0.0, 9.0, 0.0), LightView::spot(down, 2.0, 0.1, 20.0, 0.0)]
            {
                let truth = hard(&rays, &eye, &light, [64, 64], &quiet).unwrap();
                assert!(truth.triangle.iter().all(|&t| t != SKY));
                let dark = truth.visibility.iter().filter(|v| **v != 1.0).count();
                assert_eq!(dark, 0, "seed {seed}, {direction}");
            }
        }
    }
}

#[test]
fn no_ray_leaves_a_closed_body_through_its_edges_or_corners() {
    // A ball, and a ball in which every triangle is a mesh of its own, so that they share only positions.
    let whole = sphere(9, 0);
    let parts: Vec<_> = whole.indices.chunks(3).map(|t| mesh(whole.positions.clone(), t.to_vec(), 0)).collect();
    let tilt = DAffine3::from_axis_angle(dvec3(0.3, 1.0, 0.2).normalize(), 0.9);
    for offset in [0.0, 1e6] {
        let place = at(offset, -offset, 0.5 * offset) * tilt * scaled([1.0, 0.7, 1.3], [0.0; 3]);
        for meshes in [vec![whole.clone()], parts.clone()] {
            let placed = meshes.into_iter().map(|m| (m, place)).collect();
            let rays = RayScene::build(&scene(placed, vec![Material::default()])).unwrap();
            let from = place.transform_point3(dvec3(0.1, -0.05, 0.2));
            let corner = |i: u32| place.transform_point3(Vec3::from(whole.positions[i as usize]).as_dvec3());
            for t in whole.indices.chunks(3) {
                for k in 0..3 {
                    let (a, b) = (corner(t[k]), corner(t[(k + 1) % 3]));
                    for s in [0.0, 0.25, 0.5, 0.7] {
                        let d = a.lerp(b, s) - from;
                        assert!(rays.occluded(from, Target::Direction(d), None), "a crack at {s} of an edge");
                        assert!(rays.occluded(from, Target::Point(from + 1.001 * d), None));
                        assert!(!rays.occluded(from, Target::Point(from + 0.999 * d), None));
                    }
                }
            }
        }
    }
}

#[test]
fn a_light_in_a_closed_body_lights_nothing_outside() {
    for body in [sphere(16, 0), cube(0)] {
        let small = at(0.0, 1.0, 0.0) * DAffine3::from_scale(DVec3::splat(0.2));
        let mut scene = scene(vec![(plane(3.0, 8, 0), at(0.0, 0.0, 0.0)), (body, small)], vec![Material::default()]);
        let eye = camera(dvec3(0.0, 2.0, 4.0), dvec3(0.0, 0.3, 0.0), 1.0);
        let light = LightView::spot(look_at(dvec3(0.01, 1.02, 0.03), dvec3(0.01, 0.0, 0.0)), 1.5, 0.01, 10.0, 0.1);
        let rays = RayScene::build(&scene).unwrap();
        for truth in [
            hard(&rays, &eye, &light, SIZE, &quiet).unwrap(),
            soft(&rays, &eye, &light, SIZE, &SoftSettings::default(), &quiet).unwrap(),
        ] {
            let floor = (0..truth.visibility.len()).filter(|&i| truth.triangle[i] < 128);
            assert!(floor.clone().count() > 1000);
            assert!(floor.into_iter().all(|i| truth.visibility[i] == 0.0));
        }
        // Without the body the point is lit.
        scene.instances.truncate(1);
        let truth = hard_truth(&scene, &eye, &light);
        assert!((0..truth.visibility.len()).any(|i| truth.triangle[i] != SKY && truth.visibility[i] == 1.0));
    }
}

#[test]
fn empty_and_degenerate_scenes_are_sky() {
    let eye = camera(dvec3(0.0, 2.0, 4.0), DVec3::ZERO, 1.0);
    let [light, sun] = lights(1.0, DVec3::ZERO, 0.5);
    let nan = mesh(vec![[f32::NAN; 3], [1.0, 0.0, 0.0], [0.0, f32::INFINITY, 0.0]], vec![0, 1, 2], 0);
    let line = mesh(vec![[0.0; 3], [1.0, 0.0, 0.0], [2.0, 0.0, 0.0]], vec![0, 1, 2, 0, 0, 1], 0);
    let point = mesh(vec![[1.0; 3]], vec![0, 0, 0], 0);
    let flat = (plane(1.0, 1, 0), scaled([0.0; 3], [0.0; 3]));
    let identity = DAffine3::IDENTITY;
    for (meshes, triangles) in
        [(vec![], 0), (vec![(nan, identity)], 1), (vec![(line, identity), (point, identity), flat], 5)]
    {
        let rays = RayScene::build(&scene(meshes, vec![both_sides()])).unwrap();
        assert_eq!(rays.triangles(), triangles);
        for light in [light, sun] {
            for method in [Method::Hard, Method::Soft(SoftSettings::default())] {
                let truth = trace(&rays, &eye, &light, SIZE, &method, &quiet).unwrap();
                assert!(truth.triangle.iter().all(|&t| t == SKY));
                assert!(truth.visibility.iter().all(|&v| v == 1.0));
                assert_eq!(truth.rays, 0);
                assert!(truth.valid(0.02).iter().all(|&v| !v));
            }
        }
    }
}

#[test]
fn a_degenerate_triangle_keeps_its_id() {
    let mut floor = plane(3.0, 1, 0);
    floor.indices.splice(0..0, [0, 0, 1]);
    let scene = scene(vec![(cube(0), at(50.0, 0.0, 0.0)), (floor, DAffine3::IDENTITY)], vec![Material::default()]);
    let rays = RayScene::build(&scene).unwrap();
    assert_eq!((rays.first_triangle(1), rays.first_triangle(2)), (Some(12), None));
    let hit = rays.primary(dvec3(-0.5, 1.0, -0.6), DVec3::NEG_Y).unwrap();
    assert_eq!(hit.triangle, 13);
    assert!((hit.t - 1.0).abs() < 1e-12 && (hit.normal - DVec3::Y).length() < 1e-12);
    assert!((hit.position - dvec3(-0.5, 0.0, -0.6)).length() < 1e-12);
    let mut rebuilt = DVec3::ZERO;
    for k in 0..3 {
        let corner = scene.meshes[1].positions[scene.meshes[1].indices[3 + k] as usize];
        rebuilt += hit.barycentrics[k] * Vec3::from(corner).as_dvec3();
    }
    assert!((rebuilt - hit.position).length() < 1e-12);
}

#[test]
fn nonsense_is_refused_with_a_reason() {
    let good = mixed(1);
    let rays = RayScene::build(&good).unwrap();
    let eye = camera(dvec3(0.0, 2.0, 4.0), DVec3::ZERO, 1.0);
    let [light, sun] = lights(1.0, DVec3::ZERO, 0.5);
    let mut bad_eye = eye;
    bad_eye.world_from_view.translation.x = f64::NAN;
    assert!(hard(&rays, &bad_eye, &light, SIZE, &quiet).is_err());
    assert!(hard(&rays, &eye, &light, [0, 4], &quiet).is_err());
    assert!(hard(&rays, &eye, &light, [u32::MAX; 2], &quiet).is_err());
    let mut bad = light;
    bad.kind = LightKind::Spot { size: -1.0 };
    assert!(hard(&rays, &eye, &bad, SIZE, &quiet).is_err());
    bad = sun;
    bad.kind = LightKind::Directional { angle: 4.0 };
    assert!(hard(&rays, &eye, &bad, SIZE, &quiet).is_err());
    for samples in [0, u32::MAX] {
        let settings = SoftSettings { samples, ..SoftSettings::default() };
        assert!(soft(&rays, &eye, &light, SIZE, &settings, &quiet).is_err());
    }
    let mut broken = good.clone();
    broken.meshes[1].indices[5] = 1 << 30;
    assert!(RayScene::build(&broken).unwrap_err().to_string().contains("index 1073741824"));
    let mut broken = good.clone();
    broken.instances[0].mesh = 99;
    assert!(RayScene::build(&broken).is_err());
    let mut broken = good;
    broken.meshes[0].material = 9;
    assert!(RayScene::build(&broken).is_err());
}

#[test]
fn distant_and_tiny_things_are_still_hit() {
    // A ray from a million scene sizes away, and one parallel to an axis.
    let scene = scene(vec![(sphere(12, 0), DAffine3::IDENTITY)], vec![Material::default()]);
    let rays = RayScene::build(&scene).unwrap();
    let far = dvec3(1e6, 2e6, -1e6);
    let hit = rays.primary(far, -far).unwrap();
    assert!(hit.position.length() < 1.0 + 1e-6 && hit.position.length() > 0.9);
    assert!(rays.occluded(far, Target::Point(-far), None));
    assert!(rays.occluded(far, Target::Direction(-far), None));
    assert!(!rays.occluded(far, Target::Direction(far), None));
    assert!(!rays.occluded(far, Target::Point(far * 0.1), None));
    assert!(rays.primary(dvec3(0.0, 0.0, 5.0), DVec3::NEG_Z).is_some());
    assert!(rays.primary(dvec3(0.0, 0.0, 5.0), DVec3::Z).is_none());
    assert!(rays.primary(dvec3(0.0, 0.0, 5.0), DVec3::ZERO).is_none());
    assert!(rays.primary(DVec3::NAN, DVec3::NEG_Z).is_none());
    // A viewer inside a closed single-sided body sees nothing, but a shadow ray is blocked.
    assert!(rays.primary(DVec3::ZERO, DVec3::NEG_Z).is_none());
    assert!(rays.occluded(DVec3::ZERO, Target::Direction(dvec3(0.1, 0.2, 0.9)), None));
}

// ---------------------------------------------------------------- surfaces

#[test]
fn mirrored_single_sided_surfaces_turn_their_front_along() {
    let above = (dvec3(0.1, 2.0, 0.2), DVec3::NEG_Y);
    let below = (dvec3(0.1, -2.0, 0.2), DVec3::Y);
    for (place, front_up) in [
        (DAffine3::IDENTITY, true),
        (scaled([-1.0, 1.0, 1.0], [0.0; 3]), true),
        (scaled([1.0, -1.0, 1.0], [0.0; 3]), false),
        (DAffine3::from_rotation_x(PI), false),
        (scaled([-1.0, 1.0, -1.0], [0.0; 3]), true),
    ] {
        let build = |material| RayScene::build(&scene(vec![(plane(1.0, 2, 0), place)], vec![material])).unwrap();
        let single = build(Material::default());
        assert_eq!(single.primary(above.0, above.1).is_some(), front_up, "{place:?}");
        assert_eq!(single.primary(below.0, below.1).is_some(), !front_up, "{place:?}");
        let double = build(both_sides());
        for (from, along) in [above, below] {
            let hit = double.primary(from, along).unwrap();
            assert!((hit.normal + along).length() < 1e-12, "the normal is on the viewer's side");
            // Casters block light from both sides.
            assert!(single.occluded(from, Target::Direction(along), None));
            assert!(single.occluded(from, Target::Point(from + 4.0 * along), None));
            assert!(!single.occluded(from, Target::Point(from + along), None));
            assert!(!single.occluded(from, Target::Direction(along), Some(hit.triangle)));
        }
    }
}

fn card(texture: Texture, cutoff: f32, base_alpha: f32, vertex_alpha: Option<f32>) -> Scene {
    let mut leaf = plane(1.0, 1, 1);
    if let Some(a) = vertex_alpha {
        leaf.colors = vec![[1.0, 1.0, 1.0, a]; leaf.positions.len()];
    }
    let mut out = scene(
        vec![(plane(6.0, 1, 0), at(0.0, 0.0, 0.0)), (leaf, at(0.0, 1.0, 0.0))],
        vec![
            Material::default(),
            Material {
                base_color: [1.0, 1.0, 1.0, base_alpha],
                texture: Some(0),
                alpha_cutoff: Some(cutoff),
                ..both_sides()
            },
        ],
    );
    out.textures.push(texture);
    out
}

fn two_texels(nearest: bool) -> Texture {
    Texture {
        name: "ramp".into(),
        size: [2, 1],
        rgba: vec![[255, 255, 255, 0], [255, 255, 255, 255]],
        wrap: [Wrap::ClampToEdge; 2],
        nearest,
    }
}

#[test]
fn a_leaf_card_casts_the_shadow_of_its_opaque_part() {
    // Cases (nearest, cutoff, factor, vertex alpha), and the u beyond which the card is opaque.
    let cases = [
        (true, 0.5, 1.0, None, 0.5),
        (false, 0.5, 1.0, None, 0.5),
        (false, 0.25, 1.0, None, 0.375),
        (false, 0.25, 1.0, Some(0.5), 0.5),
        (false, 0.25, 0.5, Some(0.5), 0.75),
        (false, 0.75, 0.5, None, 2.0),
        (true, 0.0, 1.0, None, 0.0),
    ];
    for (nearest, cutoff, factor, vertex, from_u) in cases {
        let scene = card(two_texels(nearest), cutoff, factor, vertex);
        let eye = camera(dvec3(0.0, 3.0, 4.0), dvec3(0.0, 0.0, 0.0), 1.0);
        let light = LightView::spot(look_at(dvec3(0.4, 4.0, -0.3), DVec3::ZERO), 1.6, 0.1, 10.0, 0.0);
        let truth = hard_truth(&scene, &eye, &light);
        // The card at height 1 is opaque where x >= 2 u - 1.
        let opaque = |p: DVec3, edge: f64| p.x >= edge && p.x.abs() <= 1.0 && p.z.abs() <= 1.0;
        let (mut wrong, mut dark, mut through) = (0, 0, 0);
        for i in (0..truth.visibility.len()).filter(|&i| truth.triangle[i] != SKY) {
            let p = position(&truth, &eye, i);
            let towards_eye = p.lerp(eye.position(), (1.0 - p.y) / (eye.position().y - p.y));
            if truth.triangle[i] >= 2 {
                // The viewer sees only the opaque part.
                assert!(p.x >= 2.0 * from_u - 1.0 - 1e-4, "{p}");
                continue;
            }
            let edge = 2.0 * from_u - 1.0;
            through += usize::from(opaque(towards_eye, -1.0));
            let q = p.lerp(light.position(), (1.0 - p.y) / (light.position().y - p.y));
            let clear =
                [q.x - edge, q.x.abs() - 1.0, q.z.abs() - 1.0].iter().fold(f64::INFINITY, |m: f64, d| m.min(d.abs()));
            let blocked = opaque(q, edge);
            dark += usize::from(blocked);
            wrong += usize::from(clear > 1e-4 && blocked != (truth.visibility[i] == 0.0));
        }
        assert_eq!(wrong, 0, "from u = {from_u}");
        assert_eq!(dark > 30, from_u < 1.0, "{dark}");
        assert_eq!(through > 30, from_u > 0.0, "{through} pixels seen through the hole");
    }
}

#[test]
fn pixels_outside_the_shadow_map_are_marked_and_still_true() {
    let scene = mixed(3);
    let eye = camera(dvec3(0.5, 2.0, 4.5), dvec3(0.0, -0.2, 0.0), 1.0);
    let [wide, _] = lights(1.0, DVec3::ZERO, 0.0);
    let narrow = LightView::spot(wide.world_from_view, 0.3, 0.1, 20.0, 0.0);
    let far = LightView::spot(wide.world_from_view, 1.6, 0.1, 5.0, 0.0);
    let box_ = LightView::directional(wide.world_from_view, [1.0, 0.4], 0.0, 20.0, 0.0);
    let all = hard_truth(&scene, &eye, &wide);
    for light in [narrow, far, box_] {
        let truth = hard_truth(&scene, &eye, &light);
        if !light.is_directional() {
            assert_eq!(all.visibility, truth.visibility);
        }
        let (mut inside, mut outside) = (0, 0);
        for i in (0..truth.visibility.len()).filter(|&i| truth.triangle[i] != SKY) {
            let p = light.world_from_view.inverse().transform_point3(position(&truth, &eye, i));
            let (x, y) = if light.is_directional() { (p.x, p.y / 0.4) } else { (p.x / -p.z, p.y / -p.z) };
            let (limit, end) = match light {
                l if l == narrow => (0.15f64.tan(), 20.0),
                l if l == far => (0.8f64.tan(), 5.0),
                _ => (1.0, 20.0),
            };
            let out = x.abs().max(y.abs()) > limit || -p.z > end || -p.z < 0.0;
            let clear = (x.abs().max(y.abs()) - limit).abs().min((-p.z - end).abs());
            assert!(out == truth.outside_light[i] || clear < 1e-4);
            assert_eq!(truth.valid(0.02)[i], !truth.outside_light[i] && truth.n_dot_l[i] > 0.02);
            inside += usize::from(!out);
            outside += usize::from(out);
        }
        assert!(inside > 30 && outside > 30, "{inside} {outside}");
    }
}

#[test]
fn both_depth_ranges_see_the_same_and_the_planes_cut() {
    let scene = mixed(6);
    let rays = RayScene::build(&scene).unwrap();
    let [light, _] = lights(1.0, DVec3::ZERO, 0.0);
    let stand = look_at(dvec3(0.5, 2.0, 4.5), dvec3(0.0, -0.2, 0.0));
    let see = |camera: &CameraView| hard(&rays, camera, &light, [40, 40], &quiet).unwrap();
    let reversed = see(&CameraView::perspective(stand, 0.9, 1.0, 0.05));
    let standard = |near: f64, far: f64| CameraView {
        world_from_view: stand,
        clip_from_view: LightView::spot(stand, 0.9, near, far, 0.0).clip_from_view,
        depth: DepthRange::Standard,
    };
    let all = see(&standard(0.05, 100.0));
    assert_eq!((&all.triangle, &all.visibility), (&reversed.triangle, &reversed.visibility));
    let cut = see(&standard(3.5, 5.0));
    let mut gone = [0; 2];
    for i in 0..all.triangle.len() {
        let depth = all.depth_view[i];
        if depth < 3.499 {
            // The near plane cuts the box away; a surface behind it shows, or nothing.
            assert!(cut.depth_view[i] >= 3.499);
            gone[0] += 1;
        } else if depth > 5.001 {
            assert_eq!(cut.triangle[i], SKY);
            gone[1] += usize::from(depth.is_finite());
        } else if depth > 3.501 && depth < 4.999 {
            assert_eq!(cut.triangle[i], all.triangle[i]);
        }
    }
    assert!(gone[0] > 20 && gone[1] > 20, "{gone:?}");
}

// ---------------------------------------------------------------- soft

#[test]
fn adaptive_and_full_sampling_agree_in_every_bit() {
    let mut saved = Vec::new();
    for seed in 1..5 {
        let mut scene = mixed(seed);
        if seed == 4 {
            // A wall through the light's plane, beside and behind the light, and a masked card.
            let upright = DAffine3::from_rotation_z(0.5 * PI);
            scene.meshes.push(plane(6.0, 1, 0));
            scene.instances.push(Instance { mesh: 4, world_from_object: at(2.5, 0.0, 0.0) * upright });
            scene.meshes.push(plane(0.5, 1, 2));
            scene.instances.push(Instance { mesh: 5, world_from_object: at(0.6, 1.5, 0.6) });
            scene.materials.push(Material { texture: Some(0), alpha_cutoff: Some(0.5), ..both_sides() });
            scene.textures.push(two_texels(false));
        }
        let rays = RayScene::build(&scene).unwrap();
        let eye = camera(dvec3(0.5, 2.0, 4.5), dvec3(0.0, -0.2, 0.0), 1.0);
        for width in [1e-6, 0.05, 0.5, 2.0] {
            for light in lights(1.0, DVec3::ZERO, width) {
                let settings = SoftSettings { samples: 256, adaptive: true, seed };
                let adaptive = soft(&rays, &eye, &light, SIZE, &settings, &quiet).unwrap();
                let all = SoftSettings { adaptive: false, ..settings };
                let full = soft(&rays, &eye, &light, SIZE, &all, &quiet).unwrap();
                assert_eq!(adaptive.visibility, full.visibility, "seed {seed}, width {width}, {:?}", light.kind);
                let partial = full.visibility.iter().filter(|v| **v > 0.0 && **v < 1.0).count();
                assert!(width < 0.1 || partial > 100, "{partial} penumbra pixels: nothing was tested");
                saved.push(1.0 - adaptive.rays as f64 / full.rays as f64);
            }
        }
    }
    println!("rays saved: {saved:.2?}");
    // Sampling everything must not pass this test.
    assert!(saved.iter().sum::<f64>() / saved.len() as f64 > 0.5, "{saved:.2?}");
}

fn rmse(a: &Truth, b: &Truth) -> f64 {
    let sum: f64 = a.visibility.iter().zip(&b.visibility).map(|(x, y)| f64::from(x - y).powi(2)).sum();
    (sum / a.visibility.len() as f64).sqrt()
}

#[test]
fn the_noise_floor_is_low_and_falls_with_the_samples() {
    let rays = RayScene::build(&mixed(2)).unwrap();
    let eye = camera(dvec3(0.5, 2.0, 4.5), dvec3(0.0, -0.2, 0.0), 1.0);
    let [light, _] = lights(1.0, DVec3::ZERO, 1.0);
    let floor = |samples| {
        let run = |seed| {
            let settings = SoftSettings { samples, adaptive: true, seed };
            soft(&rays, &eye, &light, SIZE, &settings, &quiet).unwrap()
        };
        rmse(&run(1), &run(2))
    };
    let (coarse, fine) = (floor(64), floor(1024));
    println!("noise floor: {coarse:.5} with 64, {fine:.5} with 1024 samples");
    assert!(fine > 0.0 && fine < 0.005, "{fine}");
    // Stratified samples are better than the factor 4 of random samples.
    assert!(coarse > 5.0 * fine, "{coarse} {fine}");
}

#[test]
fn a_light_without_size_is_hard_and_a_tiny_one_nearly_so() {
    let rays = RayScene::build(&mixed(2)).unwrap();
    let eye = camera(dvec3(0.5, 2.0, 4.5), dvec3(0.0, -0.2, 0.0), 1.0);
    for (point, tiny) in lights(1.0, DVec3::ZERO, 0.0).into_iter().zip(lights(1.0, DVec3::ZERO, 1e-5)) {
        let settings = SoftSettings { samples: 16, ..SoftSettings::default() };
        let hard = hard(&rays, &eye, &point, SIZE, &quiet).unwrap();
        let soft_point = soft(&rays, &eye, &point, SIZE, &settings, &quiet).unwrap();
        assert_eq!((hard.samples, &hard.visibility), (soft_point.samples, &soft_point.visibility));
        let soft_tiny = soft(&rays, &eye, &tiny, SIZE, &settings, &quiet).unwrap();
        let differ = hard.visibility.iter().zip(&soft_tiny.visibility).filter(|(a, b)| a != b).count();
        assert!(differ <= 2, "{differ}");
    }
}

#[test]
fn the_number_of_threads_changes_nothing() {
    let scene = mixed(5);
    let eye = camera(dvec3(0.5, 2.0, 4.5), dvec3(0.0, -0.2, 0.0), 1.0);
    let [light, _] = lights(1.0, DVec3::ZERO, 0.5);
    let run = |threads| {
        rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap().install(|| {
            let rays = RayScene::build(&scene).unwrap();
            let settings = SoftSettings { samples: 64, ..SoftSettings::default() };
            let mut truth = soft(&rays, &eye, &light, SIZE, &settings, &quiet).unwrap();
            truth.seconds = 0.0;
            truth
        })
    };
    let one = run(1);
    for threads in [2, 5] {
        assert_eq!(one, run(threads));
    }
}

#[test]
fn progress_reaches_the_total() {
    let rays = RayScene::build(&mixed(5)).unwrap();
    let eye = camera(dvec3(0.5, 2.0, 4.5), dvec3(0.0, -0.2, 0.0), 1.0);
    let [light, _] = lights(1.0, DVec3::ZERO, 0.0);
    let most = std::sync::atomic::AtomicU64::new(0);
    let total = 33 * 17;
    hard(&rays, &eye, &light, [33, 17], &|done, of| {
        assert!(of == total && done <= of);
        most.fetch_max(done, std::sync::atomic::Ordering::Relaxed);
    })
    .unwrap();
    assert_eq!(most.into_inner(), total);
}

// ---------------------------------------------------------------- cache

fn traced(scene: &Scene, eye: &CameraView, light: &LightView) -> Truth {
    hard_truth(scene, eye, light)
}

#[test]
fn a_cached_truth_comes_back_bit_for_bit_or_not_at_all() {
    let folder = tempfile::tempdir().unwrap();
    let cache = Cache::open(Some(&folder.path().join("new")));
    let scene = mixed(5);
    let eye = camera(dvec3(0.5, 2.0, 4.5), dvec3(0.0, -0.2, 0.0), 1.0);
    let [light, _] = lights(1.0, DVec3::ZERO, 0.0);
    let key = cache_key(&scene, &eye, &light, SIZE, &Method::Hard);
    assert_eq!(cache.get(&key, SIZE), None);
    let (first, origin) = cache.get_or_trace(&key, SIZE, || Ok(traced(&scene, &eye, &light))).unwrap();
    assert_eq!(origin, Origin::Traced);
    let (second, origin) = cache.get_or_trace(&key, SIZE, || panic!("it is cached")).unwrap();
    assert_eq!((origin, &second), (Origin::Cached, &first));

    let files: Vec<_> = std::fs::read_dir(cache.folder().unwrap()).unwrap().map(|e| e.unwrap().path()).collect();
    assert_eq!(files.len(), 1, "no temporary file stays: {files:?}");
    let good = std::fs::read(&files[0]).unwrap();
    // Another size does not match, nor does a file with another key under this name.
    assert_eq!(cache.get(&key, [SIZE[1], SIZE[0]]), None);
    let other = cache_key(&scene, &eye, &light, [SIZE[1], SIZE[0]], &Method::Hard);
    let renamed = files[0].with_file_name(format!("{}.truth", hex(&other.0)));
    std::fs::copy(&files[0], &renamed).unwrap();
    assert_eq!(cache.get(&other, SIZE), None);
    std::fs::remove_file(renamed).unwrap();

    for step in 0..40 {
        let mut bad = good.clone();
        let place = step * good.len() / 40;
        bad[place] ^= 1 << (step % 8);
        std::fs::write(&files[0], &bad).unwrap();
        assert_eq!(cache.get(&key, SIZE), None, "flipped a bit of byte {place}");
        std::fs::write(&files[0], &good[..place]).unwrap();
        assert_eq!(cache.get(&key, SIZE), None, "cut at {place}");
    }
    std::fs::write(&files[0], [good.as_slice(), &[0]].concat()).unwrap();
    assert_eq!(cache.get(&key, SIZE), None);
    let (_, origin) = cache.get_or_trace(&key, SIZE, || Ok(traced(&scene, &eye, &light))).unwrap();
    assert_eq!(origin, Origin::Traced);
    assert_eq!(cache.get(&key, SIZE).unwrap().visibility, first.visibility);
}

fn hex(bytes: &[u8]) -> String {
    bytes.iter().map(|b| format!("{b:02x}")).collect()
}

#[test]
fn a_cache_that_cannot_be_written_does_not_stop_the_work() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("a file");
    std::fs::write(&file, "in the way").unwrap();
    let scene = mixed(5);
    let eye = camera(dvec3(0.5, 2.0, 4.5), dvec3(0.0, -0.2, 0.0), 1.0);
    let [light, _] = lights(1.0, DVec3::ZERO, 0.0);
    let key = cache_key(&scene, &eye, &light, SIZE, &Method::Hard);
    let cache = Cache::open(Some(&file));
    let (_, origin) = cache.get_or_trace(&key, SIZE, || Ok(traced(&scene, &eye, &light))).unwrap();
    assert!(matches!(origin, Origin::TracedNotStored(_)));
    let (_, origin) = Cache::disabled().get_or_trace(&key, SIZE, || Ok(traced(&scene, &eye, &light))).unwrap();
    assert_eq!(origin, Origin::Traced);
}

#[test]
fn the_cache_stays_within_its_bound_and_forgets_the_oldest() {
    let folder = tempfile::tempdir().unwrap();
    let scene = mixed(5);
    let eye = camera(dvec3(0.5, 2.0, 4.5), dvec3(0.0, -0.2, 0.0), 1.0);
    let [light, _] = lights(1.0, DVec3::ZERO, 0.0);
    let truth = traced(&scene, &eye, &light);
    let key = |seed| {
        let settings = SoftSettings { seed, ..SoftSettings::default() };
        cache_key(&scene, &eye, &light, SIZE, &Method::Soft(settings))
    };
    let stranger = folder.path().join("notes.txt");
    std::fs::write(&stranger, vec![0; 1 << 20]).unwrap();
    let cache = Cache::open(Some(folder.path()));
    cache.put(&key(0), &truth).unwrap();
    let file = |seed| folder.path().join(format!("{}.truth", hex(&key(seed).0)));
    let one = file(0).metadata().unwrap().len();
    let cache = cache.with_max_bytes(3 * one + one / 2);
    let age = |seed, seconds| {
        let then = std::time::SystemTime::now() - std::time::Duration::from_secs(seconds);
        std::fs::File::options().append(true).open(file(seed)).unwrap().set_modified(then).unwrap();
    };
    cache.put(&key(1), &truth).unwrap();
    cache.put(&key(2), &truth).unwrap();
    age(0, 300);
    age(1, 200);
    age(2, 100);
    // Using an entry makes it the youngest.
    assert!(cache.get(&key(0), SIZE).is_some());
    cache.put(&key(3), &truth).unwrap();
    assert_eq!([0, 1, 2, 3].map(|s| file(s).exists()), [true, false, true, true]);
    assert!(stranger.exists(), "only our own files go");
}

#[test]
fn the_key_changes_with_all_that_matters_and_nothing_else() {
    let base = card(two_texels(false), 0.5, 1.0, Some(0.9));
    let eye = camera(dvec3(0.5, 2.0, 4.5), dvec3(0.0, -0.2, 0.0), 1.0);
    let [light, sun] = lights(1.0, DVec3::ZERO, 0.5);
    let soft = SoftSettings::default();
    let method = Method::Soft(soft);
    let reference = cache_key(&base, &eye, &light, SIZE, &method);
    let mut keys = vec![reference];
    let mut changed = |scene: &Scene, eye: &CameraView, light: &LightView, size, method: &Method| {
        keys.push(cache_key(scene, eye, light, size, method));
    };
    let mut with = |change: &dyn Fn(&mut Scene)| {
        let mut scene = base.clone();
        change(&mut scene);
        changed(&scene, &eye, &light, SIZE, &method);
    };
    with(&|s| s.materials[1].base_color[3] = 0.99);
    with(&|s| s.materials[1].alpha_cutoff = Some(0.51));
    with(&|s| s.materials[1].alpha_cutoff = None);
    with(&|s| s.materials[0].double_sided = true);
    with(&|s| s.textures[0].rgba[0][3] = 1);
    with(&|s| s.textures[0].nearest = true);
    with(&|s| s.textures[0].wrap[1] = Wrap::Repeat);
    with(&|s| s.textures[0].size = [1, 2]);
    with(&|s| s.materials[1].texture = None);
    with(&|s| s.meshes[0].positions[0][1] += 1e-6);
    with(&|s| s.meshes[1].uvs[0][0] += 1e-6);
    with(&|s| s.meshes[1].colors[0][3] = 0.8);
    with(&|s| s.meshes[0].indices.swap(0, 1));
    with(&|s| s.instances[0].world_from_object.translation.x = 1e-12);
    with(&|s| s.instances.swap(0, 1));
    let mut eye2 = eye;
    eye2.world_from_view.translation.y += 1e-9;
    changed(&base, &eye2, &light, SIZE, &method);
    eye2 = eye;
    eye2.clip_from_view.x_axis.x *= 1.001;
    changed(&base, &eye2, &light, SIZE, &method);
    let mut light2 = light;
    light2.world_from_view.translation.y += 1e-9;
    changed(&base, &eye, &light2, SIZE, &method);
    light2 = light;
    light2.kind = LightKind::Spot { size: 0.6 };
    changed(&base, &eye, &light2, SIZE, &method);
    light2.kind = LightKind::Directional { angle: 0.6 };
    changed(&base, &eye, &light2, SIZE, &method);
    changed(&base, &eye, &sun, SIZE, &method);
    changed(&base, &eye, &light, [SIZE[0], SIZE[1] + 1], &method);
    changed(&base, &eye, &light, SIZE, &Method::Hard);
    changed(&base, &eye, &light, SIZE, &Method::Soft(SoftSettings { samples: 1000, ..soft }));
    changed(&base, &eye, &light, SIZE, &Method::Soft(SoftSettings { seed: 1, ..soft }));
    changed(&base, &eye, &light, SIZE, &Method::Soft(SoftSettings { adaptive: false, ..soft }));
    for (i, a) in keys.iter().enumerate() {
        assert!(keys[..i].iter().all(|b| a != b), "key {i} equals an earlier one");
    }

    let mut same = base.clone();
    same.name = "another".into();
    same.meshes[0].name = "another".into();
    same.materials[0].base_color = [0.1, 0.2, 0.3, 0.4];
    same.materials[1].base_color[0] = 0.5;
    same.textures[0].rgba[0][2] = 7;
    same.meshes[0].uvs[0] = [9.0; 2];
    same.meshes[1].colors[0][1] = 0.3;
    assert_eq!(cache_key(&same, &eye, &light, SIZE, &method), reference);
}
