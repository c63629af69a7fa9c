//! Creases end penumbrae and curved surfaces do not, at every width; compared with traced penumbrae of a fixed width.
//!
//! Angles are between the normals of two faces: 0 is flat, 90 the edge of a box. By the truth's own rule, a surface
//! continues over an edge of less than 30 degrees.

use super::hard;
use crate::common::{desc, renderer, visibility, with_gpu};
use crate::made::{self, cuboid, mesh, moved, perspective, sphere, sun};
use edgeshade::host::Host;
use edgeshade::reference::ray_traced::{FixedPenumbraSettings, RayScene, SKY, Truth, fixed_penumbra};
use edgeshade::scene::{Mesh, RenderDesc, Scene};
use glam::{DAffine3, DMat3, DVec3, dvec3};

const SIZE: [u32; 2] = [192, 108];
const MAP: u32 = 1024;
/// Penumbra widths. A pixel is about 0.02 wide: they are 10 pixels, 30 pixels, and more than a face.
const WIDTHS: [f64; 3] = [0.2, 0.6, 4.0];
/// Smallest error of a visibility that counts as off.
const OFF: f64 = 0.1;

/// Returns the direction at an angle from +Y towards +X.
fn direction(degrees: f64) -> DVec3 {
    let (sin, cos) = degrees.to_radians().sin_cos();
    dvec3(sin, cos, 0.0)
}

/// Returns two faces that meet in the Z axis, each at half of `angle` from +Y, as a ridge or a valley.
fn roof(angle: f64, is_ridge: bool) -> Mesh {
    let face = |side: f64| {
        let normal = direction(if is_ridge { side } else { -side } * 0.5 * angle);
        let away = dvec3(normal.y, -normal.x, 0.0) * if side > 0.0 { 1.0 } else { -1.0 };
        let corner = |u: f64, z: f64| 2.0 * u * away + dvec3(0.0, 0.0, z);
        let (a, b, c, d) = (corner(0.0, -3.0), corner(0.0, 3.0), corner(1.0, 3.0), corner(1.0, -3.0));
        if side > 0.0 { [[a, b, c], [a, c, d]] } else { [[c, b, a], [d, c, a]] }
    };
    mesh(&[face(1.0), face(-1.0)].concat())
}

/// Returns a distant caster towards `light` that shadows a half-space. The shadow ends at the line along Z through
/// `at`, on the side of `side`.
fn half_plane(light: DVec3, at: DVec3, side: DVec3) -> (Mesh, DAffine3) {
    let across = (side - side.dot(light) * light).normalize();
    let turn = DAffine3::from_mat3(DMat3::from_cols(across, light, across.cross(light)));
    (cuboid(dvec3(10.0, 0.5, 10.0)), moved(at + 30.0 * light + 10.0 * across) * turn)
}

/// Returns a scene seen from above, rotated so that edges along Z are oblique in the image.
fn scene(mut parts: Vec<(Mesh, DAffine3)>, light: DVec3) -> Scene {
    let turn = DAffine3::from_rotation_y(0.3);
    for part in &mut parts {
        part.1 = turn * part.1;
    }
    made::scene(parts, perspective(dvec3(0.0, 2.6, 0.9), DVec3::ZERO, 0.1), sun(turn.transform_vector3(light)))
}

/// Frame with all data for judging it.
struct Run {
    seen: Vec<f32>,
    hard: Vec<f32>,
    truth: Truth,
    /// Normal of every pixel's triangle; NaN in the sky.
    normals: Vec<DVec3>,
}

impl Run {
    /// Renders with a normal image, and with normals from depth.
    fn both(host: &Host, scene: &Scene, penumbra: f64) -> [Self; 2] {
        let traced = RayScene::build(scene).unwrap();
        let mut truth: Option<Truth> = None;
        [true, false].map(|normals| {
            let mut r = renderer(host, scene, RenderDesc { normals, ..desc(SIZE, MAP) });
            let truth = truth.get_or_insert_with(|| {
                let settings = FixedPenumbraSettings { penumbra, subsamples: 2 };
                fixed_penumbra(&traced, r.camera(), r.light(), SIZE, &settings, &|_, _| ()).unwrap()
            });
            let hard = hard(&mut r, "edtsm-star");
            let penumbra = penumbra.to_string();
            let seen = visibility(&mut r, "edtsm-star", &[("penumbra", &penumbra)]);
            Self { seen, hard, normals: normals_of(scene, truth), truth: truth.clone() }
        })
    }

    /// Returns the pixels of a surface, without those next to the sky.
    fn pixels(&self) -> impl Iterator<Item = usize> {
        let [w, h] = SIZE.map(|n| n as usize);
        let inner = move |i: &usize| (1..w - 1).contains(&(i % w)) && (1..h - 1).contains(&(i / w));
        let around = move |i: usize| (0..9).map(move |k| i + k % 3 + k / 3 * w - w - 1);
        (0..w * h).filter(inner).filter(move |&i| around(i).all(|k| self.truth.triangle[k] != SKY))
    }

    /// Returns the number of chosen pixels, and how many of them are off.
    fn count(&self, is_one: impl Fn(usize) -> bool, expected: impl Fn(usize) -> f32) -> [usize; 2] {
        let off = |i: usize| f64::from((self.seen[i] - expected(i)).abs()) > OFF;
        self.pixels().filter(|&i| is_one(i)).fold([0, 0], |n, i| [n[0] + 1, n[1] + usize::from(off(i))])
    }

    /// Returns whether a pixel lies in the true penumbra.
    fn in_penumbra(&self, i: usize) -> bool {
        (0.02..0.98).contains(&self.truth.visibility[i])
    }

    /// Returns the number of chosen pixels in the true penumbra, and how many of them are off.
    fn off_in_penumbra(&self, of: impl Fn(usize) -> bool) -> [usize; 2] {
        self.count(|i| self.in_penumbra(i) && of(i), |i| self.truth.visibility[i])
    }
}

/// Returns normals in world space from the scene's triangles.
fn normals_of(scene: &Scene, truth: &Truth) -> Vec<DVec3> {
    let mut all = vec![];
    for instance in &scene.instances {
        let mesh = &scene.meshes[instance.mesh];
        let point = |i: u32| instance.world_from_object.transform_point3(made::point(mesh.positions[i as usize]));
        all.extend(mesh.indices.chunks(3).map(|t| {
            let [a, b, c] = [0, 1, 2].map(|k| point(t[k]));
            (b - a).cross(c - a).normalize()
        }));
    }
    truth.triangle.iter().map(|&t| if t == SKY { DVec3::NAN } else { all[t as usize] }).collect()
}

fn is_crease(angle: f64) -> bool {
    angle > 30.0
}

/// Tests a shadow that ends on one face near the edge and covers the other. In the truth, its penumbra reaches the
/// other face only if the edge is no crease.
fn cast_shadow(host: &Host, angle: f64, is_ridge: bool, penumbra: f64, wrong: &mut Vec<String>) {
    let light = direction(if is_ridge { 0.5 } else { -0.5 } * angle);
    let normal = light;
    let along_face = dvec3(normal.y, -normal.x, 0.0);
    let end = 0.2 * penumbra.min(1.0) * along_face;
    let scene = scene(vec![(roof(angle, is_ridge), DAffine3::IDENTITY), half_plane(light, end, -along_face)], light);
    for (run, from) in Run::both(host, &scene, penumbra).iter().zip(["normals", "depth"]) {
        let what = format!("{angle} degrees, ridge {is_ridge}, penumbra {penumbra}, from {from}");
        let first = scene.instances[0].world_from_object.transform_vector3(normal);
        let is_other = |i: usize| run.normals[i].dot(first) < (0.5 * angle).to_radians().cos();
        let other = run.count(is_other, |i| run.truth.visibility[i]);
        let other_penumbra = run.off_in_penumbra(is_other);
        let own = run.off_in_penumbra(|i| !is_other(i));
        println!("{what}: other face {other:?}, of its penumbra {other_penumbra:?}; own penumbra {own:?}");
        assert!(other[0] > 60, "{what}: seen");
        let mut check = |good: bool, problem: String| {
            if !good {
                wrong.push(format!("{what}: {problem}"));
            }
        };
        // The lit face of a steeper ridge is seen edge-on, and its few pixels cover too little of the penumbra to
        // measure.
        if angle <= 120.0 {
            let share = if angle <= 105.0 { 50 } else { 10 };
            check(own[1] * share <= own[0], format!("on its own face {own:?} are off"));
        }
        if is_crease(angle) {
            assert_eq!(other_penumbra[0], 0, "{what}: the truth ends at a crease");
            check(other[1] == 0, format!("{other:?} over the crease"));
        } else {
            assert!(other_penumbra[0] > 30, "{what}: the truth runs on over {angle} degrees");
            check(other_penumbra[1] * 20 <= other_penumbra[0], format!("cut, {other_penumbra:?}"));
        }
    }
}

/// Tests a lit face next to one turned away from the light: at a crease everything stays hard.
fn own_shadow(host: &Host, angle: f64, penumbra: f64, wrong: &mut Vec<String>) {
    let light = direction(90.0 - 0.5 * angle + (0.5 * angle).min(25.0));
    let scene = scene(vec![(roof(angle, true), DAffine3::IDENTITY)], light);
    for (run, from) in Run::both(host, &scene, penumbra).iter().zip(["normals", "depth"]) {
        let what = format!("{angle} degrees, own shadow, penumbra {penumbra}, from {from}");
        let off = run.pixels().filter(|&i| (run.seen[i] - run.hard[i]).abs() > 0.01).count();
        let lit = run.pixels().filter(|&i| run.hard[i] == 1.0).count();
        let all = run.pixels().count();
        println!("{what}: {off} of {all} pixels, {lit} lit");
        assert!((angle > 165.0 || lit > 10) && all - lit > 60, "{what}: seen, {lit} of {all}");
        // A face two pixels wide has no normal of its own in the depth image.
        let unknown = if from == "depth" && angle >= 165.0 { 2 } else { 0 };
        if off > unknown {
            wrong.push(format!("{what}: a penumbra at a crease, {off} pixels"));
        }
    }
}

const CREASES: [f64; 11] = [35.0, 45.0, 60.0, 75.0, 90.0, 105.0, 120.0, 135.0, 150.0, 165.0, 175.0];

#[test]
fn creases_end_penumbrae() {
    with_gpu(|host| {
        let mut wrong = vec![];
        for penumbra in WIDTHS {
            for angle in [5.0, 10.0, 15.0, 20.0, 25.0].into_iter().chain(CREASES) {
                cast_shadow(host, angle, true, penumbra, &mut wrong);
                // Steeper valleys lie in their own shadow.
                if angle <= 75.0 {
                    cast_shadow(host, angle, false, penumbra, &mut wrong);
                }
                if is_crease(angle) {
                    own_shadow(host, angle, penumbra, &mut wrong);
                }
            }
        }
        assert!(wrong.is_empty(), "{}", wrong.join("\n"));
    });
}

/// Returns a closed cylinder of radius 1 along Z.
fn cylinder(sectors: u32) -> Mesh {
    let at = |i: u32, z: f64| direction(360.0 * f64::from(i) / f64::from(sectors)) + dvec3(0.0, 0.0, z);
    let side = |i: u32| {
        let (a, b, c, d) = (at(i, -3.0), at(i, 3.0), at(i + 1, 3.0), at(i + 1, -3.0));
        [[a, b, c], [a, c, d]]
    };
    mesh(&(0..sectors).flat_map(side).collect::<Vec<_>>())
}

#[test]
fn curved_surfaces_keep_their_penumbrae() {
    with_gpu(|host| {
        let bodies = [("cylinder", cylinder(96)), ("coarse cylinder", cylinder(24)), ("sphere", sphere(48, 96))];
        for (name, body) in bodies {
            for (penumbra, side) in [(0.2, DVec3::X), (0.6, DVec3::X), (1.2, DVec3::X), (0.6, DVec3::Z)] {
                let light = direction(20.0);
                let parts = vec![(body.clone(), moved(dvec3(0.0, -0.4, 0.0))), half_plane(light, DVec3::ZERO, side)];
                let scene = scene(parts, light);
                for (run, from) in Run::both(host, &scene, penumbra).iter().zip(["normals", "depth"]) {
                    let found = run.off_in_penumbra(|_| true);
                    println!("{name}, penumbra {penumbra} along {side}, from {from}: {found:?}");
                    assert!(found[0] > 300, "{found:?}");
                    assert!(found[1] * 50 <= found[0], "{name}, {penumbra}, {side}, {from}: {found:?}");
                }
            }
        }
    });
}
