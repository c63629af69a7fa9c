//! A straight shadow edge on a plane has a penumbra as wide in the world as the light makes it, from any viewpoint.

use super::{Pairs, image, prepare};
use crate::common::{desc, renderer, with_gpu};
use crate::made::{self, moved, plane};
use edgeshade::scene::{Camera, Light, LightShape, Projection, Renderer, Scene};
use edgeshade::view::look_at;
use glam::{DAffine3, DVec2, DVec3, dvec2, dvec3};

const SIZE: [u32; 2] = [480, 270];
const MAP: u32 = 2048;
/// Width of the image's border that is not judged, pixels.
const BORDER: usize = 24;
const HEIGHT: f64 = 10.0;
/// Full angle of the sun, radians: a penumbra 0.5 wide under a sun in the zenith.
const ANGLE: f64 = 0.05;
const FOV: f64 = 0.8;

/// Returns a plane half below a plate, whose shadow ends along the line `x = 0` or along `z = 0`. The camera stands 3
/// above the plane and looks down at the line by `tilt` radians. The sun is `lean` radians off the zenith, across the
/// edge.
fn scene(along_z: bool, tilt: f64, lean: f64, target: DVec3) -> Scene {
    let across = if along_z { DVec3::X } else { DVec3::NEG_Z };
    let place = dvec3(0.0, HEIGHT, 0.0) + across * (8.0 + HEIGHT * lean.tan());
    // The map is as wide as the casters: another plate far off makes room for the lit half of the penumbra.
    let far_off = dvec3(0.0, HEIGHT, 0.0) + across * (HEIGHT * lean.tan() - 11.0);
    let parts = vec![(plane(12.0), DAffine3::IDENTITY), (plane(8.0), moved(place)), (plane(0.2), moved(far_off))];
    let eye = target + dvec3(0.0, 3.0, 3.0 / tilt.tan());
    let projection = Projection::Perspective { fov_y: FOV, near: 0.1 };
    let camera = Camera { name: "made".into(), world_from_camera: look_at(eye, target), projection };
    let from = DVec3::Y + lean.tan() * across;
    let shape = LightShape::Directional { angle: Some(ANGLE) };
    let light = Light { name: "sun".into(), world_from_light: look_at(from, DVec3::ZERO), shape, color: [1.0; 3] };
    made::scene(parts, camera, light)
}

/// Returns where the pixels' rays meet the plane: x and z, and the world width of a pixel there; NaN in the sky.
fn places(r: &Renderer<'_>) -> Vec<(DVec2, f64)> {
    let ndc = |i: u32, n: u32| (2.0 * f64::from(i) + 1.0) / f64::from(n) - 1.0;
    let forward = r.camera().world_from_view.transform_vector3(DVec3::NEG_Z);
    (0..SIZE[0] * SIZE[1])
        .map(|i| {
            let (eye, ray) = r.camera().ray([ndc(i % SIZE[0], SIZE[0]), ndc(i / SIZE[0], SIZE[1])]);
            let t = if ray.y < 0.0 { -eye.y / ray.y } else { f64::NAN };
            let hit = eye + t * ray;
            (dvec2(hit.x, hit.z), 2.0 * (0.5 * FOV).tan() / f64::from(SIZE[1]) * (hit - eye).dot(forward))
        })
        .collect()
}

/// Returns the standard deviation of the blurred edge across rows or columns of the image, world units. It covers the
/// lines that contain a whole penumbra of this width, more than 12 pixels wide.
fn deviations(places: &[(DVec2, f64)], visibility: &[f32], along_z: bool, width: f64) -> Vec<f64> {
    let (w, h) = (SIZE[0] as usize, SIZE[1] as usize);
    let lines = if along_z { h } else { w };
    let deviation = |line: usize| {
        let pixels: Vec<usize> =
            if along_z { (0..w).map(|x| line * w + x).collect() } else { (0..h).map(|y| y * w + line).collect() };
        let across = |i: usize| if along_z { -places[i].0.x } else { places[i].0.y };
        let mut samples: Vec<(f64, f64)> = pixels.iter().map(|&i| (across(i), visibility[i].into())).collect();
        samples.retain(|s| s.0.abs() < 1.5 * width);
        samples.sort_by(|a, b| a.0.total_cmp(&b.0));
        let (first, last) = (samples.first()?, samples.last()?);
        let nearest = pixels.iter().min_by(|a, b| across(**a).abs().total_cmp(&across(**b).abs()))?;
        let seen_wide = width / places[*nearest].1
            * if along_z { 1.0 } else { places[*nearest].1 * samples.len() as f64 / 3.0 / width };
        if first.0 > -width || last.0 < width || first.1 > 0.0 || last.1 < 1.0 || seen_wide < 12.0 {
            return None;
        }
        // Treats the slope as a distribution.
        let steps = || samples.windows(2).map(|s| (0.5 * (s[0].0 + s[1].0), s[1].1 - s[0].1));
        let mean: f64 = steps().map(|(x, d)| x * d).sum();
        Some(steps().map(|(x, d)| (x - mean).powi(2) * d).sum::<f64>().sqrt())
    };
    // Outside the image there is nothing to filter, so a filter that leaves it obliquely is cut on one side only.
    (BORDER..lines - BORDER).filter_map(deviation).collect()
}

const TILTS: [(bool, f64); 5] = [(true, 20.0), (true, 45.0), (true, 80.0), (false, 35.0), (false, 70.0)];

/// Techniques, the footprints that are checked, and the standard deviation as a fraction of the penumbra's width.
fn kinds() -> [(&'static str, Pairs<'static>, f64); 3] {
    [
        ("ssrbssm", &[("footprint", "light")], 1.0 / 12f64.sqrt()),
        ("ssabss", &[("footprint", "plane"), ("sigma", "0.25")], 0.25),
        ("ssabss", &[("footprint", "light")], 0.29),
    ]
}

#[test]
fn penumbrae_are_as_wide_as_the_light_makes_them() {
    with_gpu(|host| {
        for (along_z, tilt) in TILTS {
            // The sun is never in the zenith, where the bias is almost zero and a plane may shadow itself by rounding.
            for lean in [0.15f64, 0.7] {
                let mut r = renderer(host, &scene(along_z, tilt.to_radians(), lean, DVec3::ZERO), desc(SIZE, MAP));
                for (id, params, share) in kinds() {
                    let visibility = image(host, &mut r, id, params);
                    // Width across the light's direction, or on the ground for the footprint that covers that.
                    let upright = 2.0 * (0.5 * ANGLE).tan() * HEIGHT / lean.cos();
                    let width = if params[0].1 == "light" { upright / lean.cos() } else { upright };
                    let found = deviations(&places(&r), &visibility, along_z, width);
                    let relative: Vec<f64> = found.iter().map(|d| d / (share * width)).collect();
                    let [least, most] = [f64::min as fn(f64, f64) -> f64, f64::max]
                        .map(|f| relative.iter().copied().reduce(f).unwrap());
                    let mean = relative.iter().sum::<f64>() / relative.len() as f64;
                    let what = format!("{id} {} {tilt} degrees, along z {along_z}, lean {lean}", params[0].1);
                    println!("{what}: {least:.3} to {most:.3}, mean {mean:.3}, of the width, {} lines", found.len());
                    assert!(found.len() > 40, "{what}: {} lines", found.len());
                    assert!((mean - 1.0).abs() < 0.03 && least > 0.94 && most < 1.06, "{what}");
                }
                // The footprint of a receiver that faces the camera gives another width.
                if !along_z && lean < 0.5 {
                    let visibility = image(host, &mut r, "ssrbssm", &[("footprint", "screen")]);
                    let width = 2.0 * (0.5 * ANGLE).tan() * HEIGHT / lean.cos();
                    let found = deviations(&places(&r), &visibility, along_z, 2.0 * width);
                    let mean = found.iter().sum::<f64>() / found.len() as f64 * 12f64.sqrt() / width;
                    println!("footprint screen, {tilt} degrees: {mean:.3} of the width");
                    assert!(found.len() > 40 && (mean - 1.0).abs() > 0.03, "a width that changes with the view passes");
                }
            }
        }
    });
}

/// If everything visible is lit, or in shadow, the filter changes nothing, however wide it is.
#[test]
fn constant_visibility_stays_constant() {
    with_gpu(|host| {
        for (side, value) in [(-1.0, 1.0f32), (1.0, 0.0)] {
            let target = dvec3(side * 1.5, 0.0, 0.0);
            let mut r = renderer(host, &scene(true, 1.5, 0.0, target), desc([144, 144], MAP));
            for id in ["ssrbssm", "ssabss"] {
                let mut technique = prepare(host, &r, id, &[("search", "near"), ("search_taps", "31")], true);
                r.frame(technique.as_mut()).unwrap();
                let visibility = r.visibility(technique.as_ref()).unwrap();
                let images = technique.intermediates();
                let read = |name: &str| host.read_values(images.iter().find(|i| i.0 == name).unwrap().1).unwrap();
                let hard = read("hard");
                assert!(hard.iter().all(|v| *v == value), "{id}: the edge is seen");
                let wide = read("width").iter().filter(|w| **w > 0.1).count();
                let largest = visibility.iter().map(|v| (v - value).abs()).fold(0.0, f32::max);
                println!("{id}, all {value}: {wide} pixels with a width, off by {largest:e}");
                assert!(wide > 100 && largest <= 1e-6, "{id}");
            }
        }
    });
}
