//! No penumbra starts at the edge between a lit and an unlit face, and curved surfaces keep theirs, at every width: with a
//! normal image, against hard shadows and traced penumbrae of a fixed width.
//!
//! Angles are between the normals of two faces: 0 is flat, 90 the edge of a box.

use super::{hard, prepare};
use crate::common::with_gpu;
use crate::made::{self, cuboid, mesh, moved, perspective, sphere, sun};
use edgeshade::host::Host;
use edgeshade::reference::ray_traced::{FixedPenumbraSettings, RayScene, SKY, Truth, fixed_penumbra};
use edgeshade::scene::{Mesh, RenderDesc, Renderer, Scene};
use edgeshade::technique::OutputFormat;
use glam::{DAffine3, DMat3, DVec3, dvec3};

const SIZE: [u32; 2] = [192, 108];
const MAP: u32 = 1024;
/// A pixel is about 0.02 wide: 10 pixels, 30, and more than a face.
const WIDTHS: [f64; 3] = [0.2, 0.6, 4.0];
/// A visibility is off if by more than this.
const OFF: f64 = 0.1;

/// At an angle from +Y towards +X.
fn direction(degrees: f64) -> DVec3 {
    let (sin, cos) = degrees.to_radians().sin_cos();
    dvec3(sin, cos, 0.0)
}

/// Two faces that meet in the Z axis, half of `angle` to either side of +Y; their ridge or their valley.
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

/// Half a space's width of shadow: towards `light`, far off, ending over the line along Z through `at` on the side of `side`.
fn half_plane(light: DVec3, at: DVec3, side: DVec3) -> (Mesh, DAffine3) {
    let across = (side - side.dot(light) * light).normalize();
    let turn = DAffine3::from_mat3(DMat3::from_cols(across, light, across.cross(light)));
    (cuboid(dvec3(10.0, 0.5, 10.0)), moved(at + 30.0 * light + 10.0 * across) * turn)
}

/// The scene as seen from above, so turned that edges along Z are aslant in the image.
fn scene(mut parts: Vec<(Mesh, DAffine3)>, light: DVec3) -> Scene {
    let turn = DAffine3::from_rotation_y(0.3);
    for part in &mut parts {
        part.1 = turn * part.1;
    }
    made::scene(parts, perspective(dvec3(0.0, 2.6, 0.9), DVec3::ZERO, 0.1), sun(turn.transform_vector3(light)))
}

/// A frame with everything it is judged by.
struct Run {
    seen: Vec<f32>,
    hard: Vec<f32>,
    truth: Truth,
}

impl Run {
    /// Renders with a normal image, and traces the truth.
    fn new(host: &Host, scene: &Scene, penumbra: f64) -> Self {
        let desc = RenderDesc { size: SIZE, map_size: MAP, output: OutputFormat::R32, ..RenderDesc::default() };
        let mut r = Renderer::new(host, scene, scene.cameras[0].view(SIZE), &scene.lights[0], desc).unwrap();
        let settings = FixedPenumbraSettings { penumbra, subsamples: 2 };
        let traced = RayScene::build(scene).unwrap();
        let truth = fixed_penumbra(&traced, r.camera(), r.light(), SIZE, &settings, &|_, _| ()).unwrap();
        let hard = hard(host, &mut r, "edtsm-star");
        let penumbra = penumbra.to_string();
        let mut technique = prepare(host, SIZE, MAP, "edtsm-star", &[("penumbra", &penumbra)], false);
        r.frame(technique.as_mut()).unwrap();
        Self { seen: r.visibility(technique.as_ref()).unwrap(), hard, truth }
    }

    /// Pixels of a surface, without those next to the sky.
    fn pixels(&self) -> impl Iterator<Item = usize> {
        let [w, h] = SIZE.map(|n| n as usize);
        let inner = move |i: &usize| (1..w - 1).contains(&(i % w)) && (1..h - 1).contains(&(i / w));
        let around = move |i: usize| (0..9).map(move |k| i + k % 3 + k / 3 * w - w - 1);
        (0..w * h).filter(inner).filter(move |&i| around(i).all(|k| self.truth.triangle[k] != SKY))
    }

    /// Pixels in the true penumbra, and those of them that are off.
    fn off_in_penumbra(&self) -> [usize; 2] {
        let is_off = |i: usize| f64::from((self.seen[i] - self.truth.visibility[i]).abs()) > OFF;
        let partly_lit = self.pixels().filter(|&i| (0.02..0.98).contains(&self.truth.visibility[i]));
        partly_lit.fold([0, 0], |n, i| [n[0] + 1, n[1] + usize::from(is_off(i))])
    }
}

/// One face is lit and the other turns away: everything is as hard as it was.
fn own_shadow(host: &Host, angle: f64, penumbra: f64) {
    let light = direction(90.0 - 0.5 * angle + (0.5 * angle).min(25.0));
    let scene = scene(vec![(roof(angle, true), DAffine3::IDENTITY)], light);
    let run = Run::new(host, &scene, penumbra);
    let what = format!("{angle} degrees, penumbra {penumbra}");
    let off = run.pixels().filter(|&i| (run.seen[i] - run.hard[i]).abs() > 0.01).count();
    let lit = run.pixels().filter(|&i| run.hard[i] == 1.0).count();
    let all = run.pixels().count();
    println!("{what}: {off} of {all} pixels, {lit} lit");
    // The lit face of a steeper ridge is seen edge on.
    assert!((angle > 165.0 || lit > 10) && all - lit > 60, "{what}: seen, {lit} of {all}");
    assert_eq!(off, 0, "{what}: pixels of a penumbra at a crease");
}

const CREASES: [f64; 11] = [35.0, 45.0, 60.0, 75.0, 90.0, 105.0, 120.0, 135.0, 150.0, 165.0, 175.0];

#[test]
fn the_edge_between_a_lit_and_an_unlit_face_stays_hard() {
    with_gpu(|host| {
        for penumbra in WIDTHS {
            CREASES.iter().for_each(|&angle| own_shadow(host, angle, penumbra));
        }
    });
}

/// A closed cylinder of radius 1 along Z.
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
                // Wider than the sphere itself, a penumbra is cut where it bends away from the plane of its edge.
                if name == "sphere" && penumbra > 1.0 {
                    continue;
                }
                let light = direction(20.0);
                let parts = vec![(body.clone(), moved(dvec3(0.0, -0.4, 0.0))), half_plane(light, DVec3::ZERO, side)];
                let scene = scene(parts, light);
                let found = Run::new(host, &scene, penumbra).off_in_penumbra();
                println!("{name}, penumbra {penumbra} along {side}: {found:?}");
                assert!(found[0] > 300 && found[1] * 50 <= found[0], "{name}, {penumbra}, {side}: {found:?}");
            }
        }
    });
}
