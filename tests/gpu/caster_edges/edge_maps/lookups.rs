//! Lookups compared with their mirrors, given the GPU's own maps.

use super::{FORMS, KERNELS, config, distances, maps, receiver_settings};
use crate::common::{Shot, desc, renderer, shipped_scene, visibility, with_gpu};
use crate::made::{spot, still_life, sun};
use crate::mirrors::compare;
use edgeshade::reference::caster_edges::edsm::{self, Lookup};
use edgeshade::reference::caster_edges::sssm;
use edgeshade::reference::common::rbsm_receiver::ReceiverSettings;
use edgeshade::scene::Scene;
use edgeshade::technique::caster_edges::edsm::{BorderKernel, DistanceConfig};
use edgeshade::technique::{Params, find};
use glam::{DVec3, dvec3};

const SIZE: [u32; 2] = [256, 144];
const HARD: Lookup = Lookup { border: 0.0, kernel: BorderKernel::Disc, eight_bits: false };

fn scenes() -> Vec<Scene> {
    let mut all: Vec<_> = ["fence", "jenga", "drum", "courtyard"].map(shipped_scene).into();
    all.push(still_life(spot(dvec3(2.0, 7.0, 3.0), DVec3::ZERO, 0.9)));
    all
}

#[test]
fn hard_lookups_equal_their_mirrors() {
    with_gpu(|host| {
        for scene in scenes() {
            for map in [512, 99] {
                let mut r = renderer(host, &scene, desc(SIZE, map));
                let seen = ["sssm", "edsm"].map(|id| visibility(&mut r, id, &[]));
                let shot = Shot::of(host, &r, true);
                let m = maps(host, &r, true);
                let mirror = sssm::visibility(&shot.data(), &receiver_settings("sssm"), &m.points).unwrap();
                compare(&seen[0], &mirror, 0.5).check(&format!("sssm {} {map}", scene.name), 0.02);
                let settings = receiver_settings("edsm");
                let hard = |distances: &[f32]| edsm::visibility(&shot.data(), &settings, distances, HARD).unwrap();
                compare(&seen[1], &hard(&m.distances[0]), 0.5).check(&format!("edsm {} {map}", scene.name), 0.02);
                // Without the maps the images differ.
                let turned: Vec<f32> = m.distances[0].iter().map(|d| -d).collect();
                assert!(compare(&seen[1], &hard(&turned), 0.5).wrong > 10, "{}", scene.name);
                let none = vec![sssm::MIDDLE; m.points.len()];
                let other = sssm::visibility(&shot.data(), &receiver_settings("sssm"), &none).unwrap();
                assert!(compare(&seen[0], &other, 0.5).wrong > 10, "{}", scene.name);
            }
        }
    });
}

/// The published form, and its interpolation alone.
#[test]
fn printed_lookups_equal_their_mirror() {
    with_gpu(|host| {
        let published = find("edsm").unwrap().published;
        let value = |name: &str| published.iter().find(|p| p.0 == name).unwrap().1.parse().unwrap();
        let fixed =
            ReceiverSettings { fixed_depth: true, depth_bias: value("depth_bias"), ..receiver_settings("edsm") };
        let cases: [(&[(&str, &str)], _, _); 2] =
            [(&[("interpolation", "8-bit")], FORMS[0], receiver_settings("edsm")), (published, FORMS[3], fixed)];
        let mut by_float = 0;
        for scene in scenes() {
            // Texels much larger than pixels, so that many pixels lie within 1/512 of a texel of an edge.
            let mut r = renderer(host, &scene, desc(SIZE, 64));
            for (params, form, settings) in &cases {
                let seen = visibility(&mut r, "edsm", params);
                let shot = Shot::of(host, &r, true);
                let distances = distances(host, &r, config(*form, true));
                let mirror = |eight_bits| {
                    let lookup = Lookup { eight_bits, ..HARD };
                    edsm::visibility(&shot.data(), settings, &distances, lookup).unwrap()
                };
                let what = format!("edsm {params:?} {}", scene.name);
                compare(&seen, &mirror(true), 0.5).check(&what, 0.02);
                by_float += compare(&seen, &mirror(false), 0.5).wrong;
            }
        }
        println!("{by_float} pixels differ with weights in single precision");
        assert!(by_float > 10, "{by_float}");
    });
}

#[test]
fn a_border_in_texels_needs_distances_in_texels() {
    with_gpu(|host| {
        let r = renderer(host, &still_life(sun(DVec3::Y)), desc(SIZE, 64));
        let params = Params::parse(find("edsm").unwrap(), [("distance", "printed"), ("border", "2")]).unwrap();
        let error = r.prepare("edsm", &params).err().unwrap().to_string();
        assert!(error.contains("border=0") && error.contains("distance=texels"), "{error}");
    });
}

#[test]
fn soft_borders_equal_their_mirror() {
    with_gpu(|host| {
        let scene = shipped_scene("jenga");
        for (word, kernel) in KERNELS {
            for width in [1.0f32, 6.0] {
                let mut r = renderer(host, &scene, desc(SIZE, 256));
                let seen = visibility(&mut r, "edsm", &[("border", &width.to_string()), ("kernel", word)]);
                let shot = Shot::of(host, &r, true);
                // Map width that a border of this width needs.
                let wide = DistanceConfig { half_width: 0.5 * width + 1.5, ..config(FORMS[0], true) };
                let distances = distances(host, &r, wide);
                let lookup = Lookup { border: width.into(), kernel, ..HARD };
                let mirror = edsm::visibility(&shot.data(), &receiver_settings("edsm"), &distances, lookup).unwrap();
                let what = format!("edsm border {width} {word}");
                compare(&seen, &mirror, 0.01).check(&what, 0.1);
                let between = seen.iter().filter(|v| (0.05..0.95).contains(*v)).count();
                assert!(between > 300, "{what}: {between} pixels in the border");
            }
        }
    });
}
