//! Penumbrae of area lights compared with closed forms: the widths at straight edges, by similar triangles.
//!
//! The scene has half-planes at several heights over a plane, each by itself, under a spot and a sun straight above
//! and under an oblique sun; and a wall that stands on the plane. The lights' squares are aligned with the edges, so
//! visibility across an edge is a ramp of width `W`: `size (z_r - z_b) / z_b` under a spot, `2 tan(angle / 2) (z_r -
//! z_b)` under a sun. Here `z_r` and `z_b` are distances along the light's axis from the light to receiver and
//! blocker. The camera looks straight down from below the half-plane: steps from pixel to pixel are equal on the
//! plane, and every row of the image has the same values.
//!
//! The width of a measured profile is `6 * integral of v (1 - v)`, the width of the ramp with this integral. It needs
//! no threshold, does not depend on the edge's position, and averages the stairs of few taps.
//!
//! A technique is an entry of [`SUBJECTS`].

use crate::common::{desc, differing, is_full_sweep, prepare, with_gpu};
use crate::made::{self, mesh, perspective, plane};
use edgeshade::host::Host;
use edgeshade::reference::ray_traced::{RayScene, SoftSettings, soft};
use edgeshade::scene::{Mesh, Renderer, Scene};
use edgeshade::technique::Technique;
use edgeshade::view::{CameraView, LightKind, LightView, look_along, look_at};
use glam::{DAffine3, DVec3, dvec3};

/// Technique to judge.
struct Subject {
    /// Id in the registry.
    id: &'static str,
    hard: Hard,
    limits: Limits,
}

/// Technique that gives the image under a light without size.
struct Hard {
    id: &'static str,
    settings: &'static [(&'static str, &'static str)],
    /// Largest difference of a pixel that counts as equal.
    tolerance: f32,
}

/// Returns a hard technique whose image must be equal, bit for bit.
const fn hard(id: &'static str, settings: &'static [(&'static str, &'static str)]) -> Hard {
    Hard { id, settings, tolerance: 0.0 }
}

/// Largest errors of a technique.
struct Limits {
    /// Error of the width, as a fraction of the closed form's.
    width: f64,
    /// Difference of visibility from a ramp of the right width at the found position: root mean square within a width
    /// of its middle.
    shape: f64,
    /// Displacement of the edge, texels. Up to half a texel is due to the map, because edges lie on no texel's border.
    shift: f64,
    /// Largest fall of visibility where it should rise, from pixel to pixel.
    fall: f64,
    /// Width at the line of contact, which should be 0, texels.
    contact: f64,
}

const SUBJECTS: &[Subject] = &[
    Subject {
        id: TRUTH,
        hard: hard(TRUTH, &[]),
        // It falls by noise: 16 of the 256 rays of a pixel are not decided by their cells.
        limits: Limits { width: 0.004, shape: 0.01, shift: 0.1, fall: 0.03, contact: 0.2 },
    },
    Subject {
        id: "pcss",
        // The narrowest filter is a bilinear test.
        hard: Hard { id: "pcf", settings: &[("width", "1")], tolerance: 1e-4 },
        // Taps at the centres of the window's cells miss the lit rim of a penumbra (see pcss.comp).
        limits: Limits { width: 0.02, shape: 0.02, shift: 1.0, fall: 0.001, contact: 0.15 },
    },
    Subject {
        id: "rbssm",
        hard: hard("rbsm-star", &[("slack", "0")]),
        // Taps miss the lit rim as in pcss, and 11 of them turn a ramp into stairs.
        limits: Limits { width: 0.03, shape: 0.025, shift: 1.0, fall: 0.001, contact: 0.15 },
    },
    Subject {
        id: "ssrbssm",
        hard: hard("rbsm-star", &[]),
        // At the wall, pixels are 1.8 texels wide, and no penumbra in the image is narrower than a pixel.
        limits: Limits { width: 0.04, shape: 0.02, shift: 0.7, fall: 0.001, contact: 0.7 },
    },
    Subject {
        id: "ssabss",
        hard: hard("sm", &[]),
        // A Gaussian is not a box: with the same deviation, cut off at 3 deviations, its step measures 2.9 % narrower.
        limits: Limits { width: 0.055, shape: 0.04, shift: 0.7, fall: 0.001, contact: 0.35 },
    },
    Subject {
        id: "edtssm",
        hard: hard("rbsm", &[]),
        // The mean filter over a tenth of the ramp rounds its ends.
        limits: Limits { width: 0.03, shape: 0.008, shift: 0.7, fall: 0.001, contact: 0.25 },
    },
    Subject {
        id: "edtssm-star",
        hard: hard("rbsm-star", &[]),
        limits: Limits { width: 0.03, shape: 0.008, shift: 0.7, fall: 0.001, contact: 0.25 },
    },
];

/// Id of the CPU ray tracer, which is not a technique of the renderer.
const TRUTH: &str = "ray-traced";
/// Number of rays per pixel.
const SAMPLES: u32 = 256;
/// Limits that planted errors must exceed.
const WIDE: Limits = Limits { width: 0.05, shape: 0.05, shift: 2.0, fall: 0.02, contact: 1.0 };

const SIZE: [u32; 2] = [192, 128];
const MAP: u32 = 1024;
/// Half the width of every light's map on the plane, world units.
const HALF: f64 = 4.0;
const TEXEL: f64 = 2.0 * HALF / MAP as f64;
/// Height of the spot, and of the suns' views.
const ABOVE: f64 = 10.0;
/// Heights of the half-planes over the plane.
const HEIGHTS: [f64; 3] = [2.5, 5.0, 7.5];
/// Position where the half-planes end, which is on no texel's border.
const EDGE: f64 = 0.0317;
/// Distance between the middles of the half-planes: none casts where another's shadow is measured.
const APART: f64 = 60.0;
/// Position of the wall, and height and distance of the spot in front of it.
const WALL: f64 = -APART;
const BEFORE: f64 = 6.0;
/// Sizes of the spot, world units.
const SPOTS: [f64; 2] = [0.2, 0.6];
/// Width of the penumbra to cast from each height under the vertical sun, texels. Two are equal, so that a kernel of
/// that width is right there and nowhere else.
const SUNS: [f64; 3] = [31.0, 31.0, 93.0];
/// Width of that kernel.
const FITTING: &str = "31";
/// Elevation and angle of the oblique sun, radians.
const ASLANT: [f64; 2] = [0.9, 0.08];

/// Light over one of the half-planes or in front of the wall, and a camera there.
struct Case {
    name: String,
    light: LightView,
    camera: CameraView,
    expected: Expected,
}

#[derive(Clone, Copy, Debug, PartialEq)]
enum Expected {
    /// One width, and the x of the edge's shadow.
    Parallel { width: f64, at: f64 },
    /// Width per unit of distance from the wall.
    Contact { slope: f64 },
}

/// Measurements of an image for a case.
#[derive(Debug)]
struct Found {
    /// Relative to the expected value: the width for `Parallel`, its increase for `Contact`.
    width: f64,
    shape: f64,
    /// Displacement, texels.
    shift: f64,
    fall: f64,
    /// Width at the line of contact, texels.
    contact: f64,
}

fn half_plane(height: f64, middle: f64) -> Mesh {
    let at = |x: f64, z: f64| dvec3(x, height, middle + z);
    let [a, b, c, d] = [at(-20.0, -20.0), at(-20.0, 20.0), at(EDGE, 20.0), at(EDGE, -20.0)];
    mesh(&[[a, b, c], [a, c, d]])
}

fn wall() -> Mesh {
    let at = |x: f64, y: f64| dvec3(x, y, WALL);
    let [a, b, c, d] = [at(-20.0, 0.0), at(EDGE, 0.0), at(EDGE, 20.0), at(-20.0, 20.0)];
    mesh(&[[a, b, c], [a, c, d]])
}

fn middle(index: usize) -> f64 {
    APART * index as f64
}

fn scene() -> Scene {
    let half_planes = HEIGHTS.iter().enumerate().map(|(i, &h)| half_plane(h, middle(i)));
    let parts = half_planes.chain([wall(), plane(300.0)]).map(|m| (m, DAffine3::IDENTITY)).collect();
    made::scene(parts, perspective(DVec3::Y, DVec3::ZERO, 0.1), made::sun(DVec3::Y))
}

/// Returns a camera that looks straight down at a point of the plane; `width` is the world width of the image there.
fn camera(target: DVec3, height: f64, width: f64) -> CameraView {
    let aspect = f64::from(SIZE[0]) / f64::from(SIZE[1]);
    let fov_y = 2.0 * (0.5 * width / aspect / height).atan();
    CameraView::perspective(look_along(target + height * DVec3::Y, DVec3::NEG_Y), fov_y, aspect, 0.02)
}

fn spot(eye: DVec3, target: DVec3, half: f64, size: f64) -> LightView {
    let distance = eye.distance(target);
    LightView::spot(look_at(eye, target), 2.0 * (half / distance).atan(), 1.0, 2.0 * distance, size)
}

fn sun(towards: DVec3, target: DVec3, angle: f64) -> LightView {
    let eye = target + 2.0 * ABOVE * towards;
    LightView::directional(look_along(eye, -towards), [HALF; 2], 0.0, 4.0 * ABOVE, angle)
}

fn cases() -> Vec<Case> {
    let mut cases = vec![];
    let mut parallel = |name: String, height: f64, z: f64, light: LightView, width: f64, at: f64| {
        let camera = camera(dvec3(at, 0.0, z), 0.5 * height, 3.0 * width);
        cases.push(Case { name, light, camera, expected: Expected::Parallel { width, at } });
    };
    for (i, height) in HEIGHTS.into_iter().enumerate() {
        let under = dvec3(0.0, 0.0, middle(i));
        for size in SPOTS {
            let light = spot(under + ABOVE * DVec3::Y, under, HALF, size);
            let (z_r, z_b) = (ABOVE, ABOVE - height);
            let name = format!("spot {size}, blocker at {height}");
            parallel(name, height, under.z, light, size * (z_r - z_b) / z_b, EDGE * z_r / z_b);
        }
        let width = SUNS[i] * TEXEL;
        let angle = 2.0 * (0.5 * width / height).atan();
        let name = format!("sun {:.2} degrees, blocker at {height}", angle.to_degrees());
        parallel(name, height, under.z, sun(DVec3::Y, under, angle), width, EDGE);
    }
    let [elevation, angle] = ASLANT;
    let towards = dvec3(0.0, elevation.sin(), elevation.cos());
    let (height, z) = (HEIGHTS[1], middle(1));
    let width = 2.0 * (0.5 * angle).tan() * height / elevation.sin();
    parallel("sun aslant".into(), height, z, sun(towards, dvec3(0.0, 0.0, z), angle), width, EDGE);

    // The light's rays to a point at distance z from the wall are this far apart in x at the wall's edge, and from
    // there in proportion at the point.
    let target = dvec3(EDGE, 0.0, WALL + 1.0);
    let mut contact = |name: &str, light, slope: f64| {
        let camera = camera(target, 1.0, 2.7);
        cases.push(Case { name: name.into(), light, camera, expected: Expected::Contact { slope } });
    };
    let eye = dvec3(EDGE, BEFORE, WALL - BEFORE);
    contact("spot at a wall", spot(eye, target, HALF, 1.2), 1.2 / BEFORE);
    let towards = dvec3(0.0, 1.0, -1.0).normalize();
    contact("sun at a wall", sun(towards, target, 0.1), 2.0 * 0.05f64.tan() / 0.5f64.sqrt());
    cases
}

/// World x of each column and z of each row; the camera looks straight down, with x to the right.
struct Places {
    x: Vec<f64>,
    z: Vec<f64>,
}

impl Places {
    fn new(camera: &CameraView) -> Self {
        let ndc = |i: u32, n: u32| (2.0 * f64::from(i) + 1.0) / f64::from(n) - 1.0;
        let hit = |x: f64, y: f64| {
            let (eye, ray) = camera.ray([x, y]);
            eye - ray * (eye.y / ray.y)
        };
        Self {
            x: (0..SIZE[0]).map(|i| hit(ndc(i, SIZE[0]), 0.0).x).collect(),
            z: (0..SIZE[1]).map(|i| hit(0.0, ndc(i, SIZE[1])).z).collect(),
        }
    }

    /// Returns the world width of a pixel.
    fn step(&self) -> f64 {
        (self.x[self.x.len() - 1] - self.x[0]) / (self.x.len() - 1) as f64
    }
}

fn row(image: &[f32], y: usize) -> impl Iterator<Item = f64> + '_ {
    let width = SIZE[0] as usize;
    image[y * width..(y + 1) * width].iter().map(|&v| f64::from(v))
}

/// Returns the width of a row's profile, world units.
fn width(image: &[f32], y: usize, step: f64) -> f64 {
    6.0 * step * row(image, y).map(|v| v * (1.0 - v)).sum::<f64>()
}

/// Returns the position of the hard edge with the same lit area as a row; the lit side is right, up to the last
/// pixel's end.
fn place(image: &[f32], y: usize, places: &Places) -> f64 {
    places.x[places.x.len() - 1] + places.step() * (0.5 - row(image, y).sum::<f64>())
}

/// Returns the largest fall in a row.
fn fall(image: &[f32], y: usize) -> f64 {
    let values: Vec<f64> = row(image, y).collect();
    values.windows(2).map(|v| v[0] - v[1]).fold(0.0, f64::max)
}

fn mean(values: impl Iterator<Item = f64>) -> f64 {
    let (sum, count) = values.fold((0.0, 0), |(sum, count), v| (sum + v, count + 1));
    sum / f64::from(count)
}

/// Fits a line by least squares: returns its value at 0 and its slope.
fn line(points: &[(f64, f64)]) -> [f64; 2] {
    let [x, y] = [mean(points.iter().map(|p| p.0)), mean(points.iter().map(|p| p.1))];
    let covariance = mean(points.iter().map(|p| (p.0 - x) * (p.1 - y)));
    let slope = covariance / mean(points.iter().map(|p| (p.0 - x).powi(2)));
    [y - slope * x, slope]
}

/// Returns the root mean square difference of a row from a ramp of this width and position, within a width of it.
fn off_ramp(image: &[f32], y: usize, places: &Places, width: f64, at: f64) -> f64 {
    let pairs = places.x.iter().zip(row(image, y)).filter(|(x, _)| (*x - at).abs() < width);
    let ramp = |x: f64| (0.5 + (x - at) / width).clamp(0.0, 1.0);
    mean(pairs.map(|(x, v)| (v - ramp(*x)).powi(2))).sqrt()
}

/// Measures an image; `expected` is the case's own, or another that should be rejected.
fn measure(image: &[f32], camera: &CameraView, expected: Expected) -> Found {
    let places = Places::new(camera);
    let step = places.step();
    let rows = SIZE[1] as usize;
    // Kernels reach over the image's border in the outer rows.
    let inner = rows / 4..rows - rows / 4;
    match expected {
        Expected::Parallel { width: expected, at } => Found {
            width: mean(inner.clone().map(|y| width(image, y, step))) / expected,
            shape: mean(inner.clone().map(|y| off_ramp(image, y, &places, expected, place(image, y, &places)))),
            shift: (mean(inner.clone().map(|y| place(image, y, &places))) - at) / TEXEL,
            fall: inner.map(|y| fall(image, y)).fold(0.0, f64::max),
            contact: 0.0,
        },
        Expected::Contact { slope: expected } => {
            let near = |y: &usize| (0.15..1.85).contains(&(places.z[*y] - WALL));
            let seen: Vec<usize> = (0..rows).filter(near).collect();
            let widths: Vec<_> = seen.iter().map(|&y| (places.z[y] - WALL, width(image, y, step))).collect();
            let [contact, slope] = line(&widths);
            // Closer to the wall, the map's stairs are as wide as the penumbra.
            let far: Vec<usize> = seen.into_iter().filter(|&y| places.z[y] - WALL > 0.8).collect();
            let off = |y: &usize| {
                let expected = expected * (places.z[*y] - WALL);
                off_ramp(image, *y, &places, expected, place(image, *y, &places))
            };
            Found {
                width: slope / expected,
                shape: mean(far.iter().map(off)),
                shift: mean(far.iter().map(|&y| place(image, y, &places) - EDGE)) / TEXEL,
                fall: far.iter().map(|&y| fall(image, y)).fold(0.0, f64::max),
                contact: contact / TEXEL,
            }
        }
    }
}

impl Found {
    /// Returns what exceeds the limits; NaN always does.
    fn faults(&self, limits: &Limits) -> Vec<&'static str> {
        let checks = [
            ("width", (self.width - 1.0).abs() <= limits.width),
            ("shape", self.shape <= limits.shape),
            ("shift", self.shift.abs() <= limits.shift),
            ("fall", self.fall <= limits.fall),
            ("contact", self.contact.abs() <= limits.contact),
        ];
        checks.into_iter().filter(|c| !c.1).map(|c| c.0).collect()
    }
}

/// The scene, for rays and for the renderer.
struct Bed<'h> {
    scene: Scene,
    rays: RayScene,
    renderer: Renderer<'h>,
    cases: Vec<Case>,
}

/// Way of making an image.
enum How {
    Traced,
    Drawn(Box<dyn Technique>),
}

impl<'h> Bed<'h> {
    fn new(host: &'h Host) -> Self {
        let (scene, cases) = (scene(), cases());
        let renderer = Renderer::new(host, &scene, cases[0].camera, &scene.lights[0], desc(SIZE, MAP)).unwrap();
        Self { rays: RayScene::build(&scene).unwrap(), scene, renderer, cases }
    }

    fn how(&self, id: &str, settings: &[(&str, &str)]) -> How {
        if id == TRUTH { How::Traced } else { How::Drawn(prepare(&self.renderer, id, settings)) }
    }

    fn image(&mut self, how: &mut How, case: usize, light: LightView) -> Vec<f32> {
        let camera = self.cases[case].camera;
        match how {
            How::Traced => {
                let settings = SoftSettings { samples: SAMPLES, ..SoftSettings::default() };
                soft(&self.rays, &camera, &light, SIZE, &settings, &|_, _| {}).unwrap().visibility
            }
            How::Drawn(technique) => {
                self.renderer.set_light(&self.scene, light);
                self.renderer.set_camera(&self.scene, camera).unwrap();
                self.renderer.frame(technique.as_mut()).unwrap();
                self.renderer.visibility(technique.as_ref()).unwrap()
            }
        }
    }

    /// Returns the images of all cases.
    fn images(&mut self, how: &mut How) -> Vec<Vec<f32>> {
        (0..self.cases.len()).map(|i| self.image(how, i, self.cases[i].light)).collect()
    }

    /// Returns the faults of each case; prints all figures.
    fn judge(&self, name: &str, images: &[Vec<f32>], limits: &Limits) -> Vec<(String, Vec<&'static str>)> {
        let judged = self.cases.iter().zip(images).map(|(case, image)| {
            let found = measure(image, &case.camera, case.expected);
            let off = found.width - 1.0;
            let texels = match case.expected {
                Expected::Parallel { width, .. } => {
                    format!("{:+.2} of {:.1} texels", off * width / TEXEL, width / TEXEL)
                }
                Expected::Contact { slope } => format!("{:+.4} of {slope:.3} a unit", off * slope),
            };
            println!(
                "{name:22} {:32} width off by {:+.2} %, {texels:22} off the ramp {:.4}, {:+.2} texels aside, \
                 falls by {:.4}, at contact {:+.2} texels",
                case.name,
                100.0 * off,
                found.shape,
                found.shift,
                found.fall,
                found.contact
            );
            (case.name.clone(), found.faults(limits))
        });
        judged.collect()
    }

    /// Returns the fraction of pixels, over all cases, that differ from another technique's under lights without size.
    fn without_size(&mut self, how: &mut How, hard: &mut How, tolerance: f32) -> f64 {
        let (mut off, mut all) = (0, 0);
        for i in 0..self.cases.len() {
            let mut light = self.cases[i].light;
            light.kind = match light.kind {
                LightKind::Spot { .. } => LightKind::Spot { size: 0.0 },
                LightKind::Directional { .. } => LightKind::Directional { angle: 0.0 },
            };
            let [mine, other] = [self.image(how, i, light), self.image(hard, i, light)];
            let dark = other.iter().filter(|v| **v == 0.0).count();
            assert!(dark * 5 > other.len() && dark * 5 < 4 * other.len(), "{}: {dark} are dark", self.cases[i].name);
            off += differing(&mine, &other, tolerance);
            all += mine.len();
        }
        off as f64 / all as f64
    }
}

/// Counts the cases with any fault, or with the given one.
fn faulty(judged: &[(String, Vec<&str>)], fault: Option<&str>) -> usize {
    judged.iter().filter(|(_, faults)| fault.map_or(!faults.is_empty(), |f| faults.contains(&f))).count()
}

#[test]
fn penumbrae_are_as_wide_as_similar_triangles_say() {
    with_gpu(|host| {
        let mut bed = Bed::new(host);
        if !is_full_sweep() {
            // Keeps each kind of light straight above only once, each over a half-plane at another height.
            let kinds = SPOTS.len() + 1;
            let mut i = 0;
            bed.cases.retain(|_| {
                i += 1;
                i > kinds * HEIGHTS.len() || (i - 1) % (kinds + 1) == 0
            });
        }
        let mut bad = vec![];
        for Subject { id, hard, limits } in SUBJECTS {
            let mut how = bed.how(id, &[]);
            let images = bed.images(&mut how);
            let judged = bed.judge(id, &images, limits);
            bad.extend(judged.into_iter().filter(|j| !j.1.is_empty()).map(|(case, f)| format!("{id}, {case}: {f:?}")));
            let mut hard_one = bed.how(hard.id, hard.settings);
            let off = bed.without_size(&mut how, &mut hard_one, hard.tolerance);
            println!("{id}: {:.4} % of the pixels differ from {} under lights without size", 100.0 * off, hard.id);
            if off > 0.0 {
                bad.push(format!("{id}: {off} of the pixels are not those of {}", hard.id));
            }
        }
        assert!(bad.is_empty(), "{}", bad.join("\n"));
    });
}

#[test]
fn wrong_penumbrae_are_found() {
    with_gpu(|host| {
        let mut bed = Bed::new(host);
        let count = bed.cases.len();
        // A width that does not depend on the light is right by chance where it equals the light's, and nowhere else.
        for (kernel, right) in [(FITTING, 2), ("15", 0)] {
            let mut how = bed.how("pcf", &[("width", kernel)]);
            let images = bed.images(&mut how);
            let judged = bed.judge(&format!("pcf width={kernel}"), &images, &WIDE);
            assert_eq!(faulty(&judged, None), count - right, "width {kernel}: {judged:?}");
            assert!(faulty(&judged, Some("width")) == count - right, "width {kernel}: {judged:?}");
            assert_eq!(faulty(&judged, Some("contact")), 2, "width {kernel}: {judged:?}");
            let (mut how, mut hard) = (how, bed.how("sm", &[]));
            let off = bed.without_size(&mut how, &mut hard, 0.0);
            assert!(off > 0.01, "width {kernel}: {off} of the pixels are not hard");
        }
        // The renderer's hard images equal the traced ones, up to the map's texels.
        let mut hard = bed.how("sm", &[]);
        let off = bed.without_size(&mut How::Traced, &mut hard, 0.0);
        assert!(off > 0.0 && off < 0.03, "{off} of the pixels");
        // Right images with wrong expectations: each limit notices its own.
        let limits = &SUBJECTS[0].limits;
        let images = bed.images(&mut How::Traced);
        let width = SIZE[0] as usize;
        for (case, image) in bed.cases.iter().zip(&images) {
            let faults = |image: &[f32], expected| measure(image, &case.camera, expected).faults(limits);
            let off = |expected| faults(image, expected);
            match case.expected {
                Expected::Parallel { width, at } => {
                    for by in [0.99, 1.01] {
                        assert!(off(Expected::Parallel { width: by * width, at }).contains(&"width"), "{}", case.name);
                    }
                    let aside = Expected::Parallel { width, at: at + 0.25 * TEXEL };
                    assert!(off(aside).contains(&"shift"), "{}", case.name);
                    assert!(off(Expected::Parallel { width: 1.1 * width, at }).contains(&"shape"), "{}", case.name);
                }
                Expected::Contact { slope } => {
                    assert!(off(Expected::Contact { slope: 1.02 * slope }).contains(&"width"), "{}", case.name);
                }
            }
            let mut planted = image.clone();
            let place = planted[64 * width..65 * width].iter().position(|v| *v > 0.4).unwrap();
            planted[64 * width + place] = planted[64 * width + place - 1] - 0.05;
            assert!(faults(&planted, case.expected).contains(&"fall"), "{}", case.name);
            planted[64 * width + place] = f32::NAN;
            assert!(faults(&planted, case.expected).contains(&"width"), "{}", case.name);
            // A smooth step of the same integral is not a ramp.
            let smooth: Vec<f32> = image.iter().map(|v| v * v * (3.0 - 2.0 * v)).collect();
            assert!(faults(&smooth, case.expected).contains(&"shape"), "{}", case.name);
        }
    });
}
