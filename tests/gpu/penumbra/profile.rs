//! A straight shadow edge has a penumbra of the requested width everywhere.

use super::Pairs;
use crate::common::{desc, prepare, renderer, visibility, with_gpu};
use crate::made::{self, cuboid, moved, plane, sun};
use edgeshade::host::Host;
use edgeshade::scene::{Camera, Projection, Renderer, Scene};
use edgeshade::view::look_at;
use glam::{DAffine3, DVec2, DVec3, dvec2, dvec3};

const SIZE: [u32; 2] = [640, 360];
const MAP: u32 = 1024;
const PENUMBRA: f64 = 0.5;
const FILTER: f64 = 0.5 * PENUMBRA;
const TAPS: f64 = 15.0;
const FOV: f64 = 0.8;

/// Returns a plane half below a plate far above it, whose shadow ends along the line `x = 0` or along `z = 0`. The
/// camera stands 3 above the plane and looks down at the line by `tilt` radians.
fn scene(along_z: bool, tilt: f64) -> Scene {
    let place = if along_z { dvec3(20.0, 30.0, 0.0) } else { dvec3(0.0, 30.0, -20.0) };
    let parts = vec![(plane(30.0), DAffine3::IDENTITY), (cuboid(dvec3(20.0, 0.5, 20.0)), moved(place))];
    let eye = dvec3(0.0, 3.0, 3.0 / tilt.tan());
    let projection = Projection::Perspective { fov_y: FOV, near: 0.1 };
    let camera = Camera { name: "made".into(), world_from_camera: look_at(eye, DVec3::ZERO), projection };
    made::scene(parts, camera, sun(DVec3::Y))
}

/// Returns where the pixels' rays meet the plane: x and z, and the distance along the view's axis; NaN in the sky.
fn places(r: &Renderer<'_>) -> Vec<(DVec2, f64)> {
    let ndc = |i: u32, n: u32| (2.0 * f64::from(i) + 1.0) / f64::from(n) - 1.0;
    let forward = r.camera().world_from_view.transform_vector3(DVec3::NEG_Z);
    (0..SIZE[0] * SIZE[1])
        .map(|i| {
            let (eye, ray) = r.camera().ray([ndc(i % SIZE[0], SIZE[0]), ndc(i / SIZE[0], SIZE[1])]);
            let t = if ray.y < 0.0 { -eye.y / ray.y } else { f64::NAN };
            let hit = eye + t * ray;
            (dvec2(hit.x, hit.z), (hit - eye).dot(forward))
        })
        .collect()
}

/// Returns the distance from the edge at which eq. 8, blurred by a filter of width `w`, is 0.1 or 0.9. The blurred
/// profile is the integral of the overlap of two boxes, the penumbra's and the filter's.
fn tenth(w: f64) -> f64 {
    let (a, b) = (PENUMBRA.min(w), PENUMBRA.max(w));
    let t = (0.2 * a * b).sqrt();
    0.5 * (a + b) - if t <= a { t } else { 0.1 * b + 0.5 * a }
}

/// Returns the blurred profile at a distance from the edge, positive where lit.
fn profile(x: f64, w: f64) -> f64 {
    let (a, b) = (PENUMBRA.min(w), PENUMBRA.max(w));
    let outer = |t: f64| 0.5 * t * t / (a * b);
    match x + 0.5 * (a + b) {
        t if t <= 0.0 => 0.0,
        t if t <= a => outer(t),
        t if t <= b => (t - 0.5 * a) / b,
        t if t < a + b => 1.0 - outer(a + b - t),
        _ => 1.0,
    }
}

/// Line of pixels across the edge, from dark to lit: position across the edge, visibility, index along the image's
/// axis.
struct Line {
    samples: Vec<(f64, f64, usize)>,
    /// World width of a pixel in the image plane at the edge.
    pixel: f64,
    /// Ratio of the step from pixel to pixel on the plane to `pixel`: above 1 where view rays meet the plane at an
    /// angle, 1 along image rows.
    stretch: f64,
}

impl Line {
    /// Returns the line of an image row or column, if the edge runs through its inner part.
    fn new(places: &[(DVec2, f64)], visibility: &[f32], along_z: bool, index: usize) -> Option<Self> {
        let (w, h) = (SIZE[0] as usize, SIZE[1] as usize);
        let pixels: Vec<usize> =
            if along_z { (0..w).map(|x| index * w + x).collect() } else { (0..h).map(|y| y * w + index).collect() };
        let across = |i: usize| if along_z { -places[i].0.x } else { places[i].0.y };
        let mut samples: Vec<_> =
            pixels.iter().enumerate().map(|(k, &i)| (across(i), f64::from(visibility[i]), k)).collect();
        samples.retain(|s| s.0.abs() < 1.2 * PENUMBRA * 1.5);
        samples.sort_by(|a, b| a.0.total_cmp(&b.0));
        if samples.len() < 20 {
            return None;
        }
        let middle = *pixels.iter().min_by(|a, b| across(**a).abs().total_cmp(&across(**b).abs()))?;
        let complete = samples.first()?.0 < -PENUMBRA && samples.last()?.0 > PENUMBRA;
        let pixel = 2.0 * (0.5 * FOV).tan() / h as f64 * places[middle].1;
        let step = samples[samples.len() / 2 + 1].0 - samples[samples.len() / 2].0;
        complete.then_some(Self { samples, pixel, stretch: if along_z { 1.0 } else { step.abs() / pixel } })
    }

    /// Returns the first position at which visibility reaches a value.
    fn reaches(&self, value: f64) -> f64 {
        let k = self.samples.iter().position(|s| s.1 >= value).unwrap_or(0).max(1);
        let (a, b) = (self.samples[k - 1], self.samples[k]);
        a.0 + (value - a.1) / (b.1 - a.1) * (b.0 - a.0)
    }

    /// Returns the width of the filter across the edge. A box of some taps is wider than the distance from its first
    /// to its last.
    fn filter(&self) -> f64 {
        let taps =
            TAPS.min((FILTER / self.pixel).ceil() + if (FILTER / self.pixel).ceil() % 2.0 == 0.0 { 1.0 } else { 0.0 });
        FILTER * self.stretch * taps / (taps - 1.0)
    }
}

/// Returns the lines of an image across the edge on which a penumbra is more than 12 pixels wide.
fn lines(places: &[(DVec2, f64)], visibility: &[f32], along_z: bool) -> Vec<Line> {
    let count = if along_z { SIZE[1] } else { SIZE[0] } as usize;
    let all = (0..count).filter_map(|i| Line::new(places, visibility, along_z, i));
    all.filter(|l| PENUMBRA / l.pixel > 12.0).collect()
}

/// Returns the width between visibilities 0.1 and 0.9, as a fraction of the expected width.
fn width(line: &Line) -> f64 {
    (line.reaches(0.9) - line.reaches(0.1)) / (2.0 * tenth(line.filter()))
}

/// Returns the largest and the mean error of the steps from pixel to pixel compared with the profile, inside tiles and
/// across their borders. Also returns the largest fall where the profile should rise.
fn steps(lines: &[Line]) -> ([[f64; 2]; 2], f64) {
    let mut off = [(0.0f64, 0.0, 0); 2];
    let mut fall = 0.0f64;
    for line in lines {
        let (filter, middle) = (line.filter(), line.reaches(0.5));
        for pair in line.samples.windows(2) {
            let (a, b) = (pair[0], pair[1]);
            fall = fall.max(a.1 - b.1);
            let expected = profile(b.0 - middle, filter) - profile(a.0 - middle, filter);
            let found = (b.1 - a.1 - expected).abs();
            let of = &mut off[usize::from(a.2.max(b.2) % 8 == 0)];
            *of = (of.0.max(found), of.1 + found, of.2 + 1);
        }
    }
    (off.map(|(largest, sum, count)| [largest, sum / f64::from(count)]), fall)
}

/// Returns whether steps across borders of tiles have larger errors than others.
fn has_seam([inside, border]: [[f64; 2]; 2]) -> bool {
    border[0] > 1.5 * inside[0] || border[1] > 1.3 * inside[1]
}

#[test]
fn penumbrae_are_as_wide_as_asked_for_at_every_distance() {
    assert!((tenth(1e-9) - 0.4 * PENUMBRA).abs() < 1e-6, "unfiltered, eq. 8");
    assert!([FILTER, PENUMBRA, 2.0].iter().all(|&w| (profile(-tenth(w), w) - 0.1).abs() < 1e-12));
    with_gpu(|host| {
        for (along_z, degrees) in
            [(true, 20.0f64), (true, 45.0), (true, 80.0), (false, 35.0), (false, 60.0), (false, 80.0)]
        {
            let mut r = renderer(host, &scene(along_z, degrees.to_radians()), desc(SIZE, MAP));
            let mut render = |penumbra: f64| {
                visibility(&mut r, "edtsm", &[("penumbra", &penumbra.to_string()), ("filter_width", "0.5")])
            };
            let (mut seen, wider) = (render(PENUMBRA), render(1.05 * PENUMBRA));
            let places = places(&r);
            let found = lines(&places, &seen, along_z);
            assert!(found.len() > 100, "{} lines", found.len());
            let what = format!("{degrees:2} degrees, edge {}", if along_z { "receding" } else { "across" });
            for line in found.iter().step_by(found.len() / 3) {
                let distance = line.pixel * f64::from(SIZE[1]) / (2.0 * (0.5 * FOV).tan());
                let (pixels, width) = (PENUMBRA / line.pixel, width(line));
                println!("{what} {distance:6.2} away, {pixels:5.1} pixels wide: {width:.3} of the expected width");
            }
            let largest = |lines: &[Line]| lines.iter().map(|l| (width(l) - 1.0).abs()).fold(0.0, f64::max);
            assert!(largest(&found) < 0.035, "{what}: a width is off by {}", largest(&found));
            assert!(largest(&lines(&places, &wider, along_z)) > 0.035, "{what}: a wider penumbra is noticed");
            let (off, fall) = steps(&found);
            println!(
                "{what} steps off the profile's, largest and mean: {:.5?} in tiles, {:.5?} at borders",
                off[0], off[1]
            );
            assert!(fall < 2e-3 && !has_seam(off), "{what}: falls by {fall}, {off:?}");
            // A planted seam and dent are found.
            for (i, v) in seen.iter_mut().enumerate() {
                let (x, y) = (i % SIZE[0] as usize, i / SIZE[0] as usize);
                *v += if (if along_z { x } else { y }) % 8 == 0 { 4e-3 } else { 0.0 };
            }
            let (off, fall) = steps(&lines(&places, &seen, along_z));
            assert!(has_seam(off) && fall > 2e-3, "{what}: a planted seam, {off:?}");
        }
    });
}

/// Returns how far the positions at which lines reach 0.5 move while the camera moves by eighths of a pixel along the
/// image axis that crosses the edge: the largest spread, in pixel widths on the plane.
fn wander(host: &Host, along_z: bool, settings: Pairs<'_>) -> f64 {
    let mut scene = scene(along_z, 0.9);
    let start = scene.cameras[0].world_from_camera;
    let mut r = renderer(host, &scene, desc(SIZE, MAP));
    let settings = [&[("penumbra", "0.5")], settings].concat();
    let mut technique = prepare(&r, "edtsm-star", &settings);
    let pixel = 2.0 * (0.5 * FOV).tan() / f64::from(SIZE[1]) * start.translation.length();
    let mut places_of_half: Vec<Vec<(f64, f64)>> = vec![];
    for step in 0..8 {
        let moved = f64::from(step) / 8.0 * pixel * if along_z { DVec3::X } else { DVec3::Y };
        scene.cameras[0].world_from_camera = start * DAffine3::from_translation(moved);
        r.set_camera(&scene, scene.cameras[0].view(SIZE)).unwrap();
        r.frame(technique.as_mut()).unwrap();
        let visibility = r.visibility(technique.as_ref()).unwrap();
        let lines = lines(&places(&r), &visibility, along_z);
        places_of_half.push(lines.iter().map(|l| (l.reaches(0.5), l.pixel * l.stretch)).collect());
    }
    let count = places_of_half.iter().map(Vec::len).min().unwrap();
    assert!(count > 100, "{count} lines");
    let spread = |k: usize| {
        let at = places_of_half.iter().map(|lines| lines[k].0);
        let [least, most] = [at.clone().fold(f64::INFINITY, f64::min), at.fold(f64::NEG_INFINITY, f64::max)];
        (most - least) / places_of_half[0][k].1
    };
    (0..count).map(spread).fold(0.0, f64::max)
}

#[test]
fn penumbrae_stay_where_they_are_while_the_camera_moves() {
    with_gpu(|host| {
        for along_z in [false, true] {
            let [traced, between] = ["traced", "between"].map(|edge| wander(host, along_z, &[("edge", edge)]));
            println!("receding {along_z}: traced {traced:.3}, between {between:.3} of a pixel");
            assert!(traced < 0.2, "{traced}");
            assert!(between > 0.4, "half-way between pixels it jumps: {between}");
        }
    });
}
