//! Percentage-closer soft shadows compared with the mirror, with a closed form, and without their shortcuts.

use super::ground::{self, Ground, IMAGE, MAP, UNDER_NOISE, noise, upload};
use crate::common::enlarged;
use crate::common::{Shot, assert_in_range, assert_same_bits, desc, differing, every_shipped, frame, renderer};
use crate::common::{search_form, search_window, shipped_scene, visibility, with_gpu};
use crate::mirrors::{Agreement, compare};
use crate::noise::visibility_of;
use edgeshade::host::Host;
use edgeshade::reference::Mirror;
use edgeshade::reference::soft::pcss::{self, Settings};
use edgeshade::technique::{Params, Technique, find};

type Set = &'static [(&'static str, &'static str)];

/// Forms of the technique: default; as in the papers, on the receiver's plane and entirely; taps wherever a window is wider
/// than a few texels; odd mixtures.
const FORMS: [Set; 5] = [
    &[],
    &[("search", "near"), ("taps", "nearest"), ("narrow", "taps")],
    &[("preset", "published")],
    &[("search_taps", "3"), ("filter_taps", "5")],
    &[("search_taps", "1"), ("filter_taps", "31"), ("taps", "nearest")],
];

fn params(set: Set) -> Params {
    Params::parse(find("pcss").unwrap(), set.iter().copied()).unwrap()
}

pub fn settings(set: Set) -> Settings {
    let p = params(set);
    Settings {
        search_taps: p.int("search_taps"),
        filter_taps: p.int("filter_taps"),
        window: search_window(&p),
        form: search_form(&p),
        bilinear: p.word("taps") == "bilinear",
        exact_box: p.word("narrow") == "box",
        normal_offset: p.float("normal_offset"),
        depth_bias: p.float("depth_bias"),
    }
}

fn on_ground(host: &Host, set: Set) -> Box<dyn Technique> {
    ground::on_ground(host, "pcss", params(set))
}

/// Checks an image against its mirror. A mirror that doubts everything agrees with anything, so its doubts must stay
/// small and planted errors must be found despite them.
fn check(gpu: &[f32], mirror: &Mirror, what: &str, most_ties: f64) -> Agreement {
    let agreement = compare(gpu, mirror, 1e-4);
    agreement.check(what, most_ties);
    let mean = |values: &[f64]| values.iter().sum::<f64>() / values.len() as f64;
    let (doubt, rounding) = (mean(&mirror.doubt), mean(&mirror.rounding));
    println!("{what:42} on average doubt {doubt:.1e}, rounding {rounding:.1e}");
    assert!(doubt < 0.02 && rounding < 5e-3, "{what}: {doubt:.1e}, {rounding:.1e}");
    agreement
}

/// Counts the pixels that are partly shadowed: neither nearly lit nor nearly dark.
fn partly(values: &[f32]) -> usize {
    values.iter().filter(|v| (0.05..0.95).contains(*v)).count()
}

#[test]
fn it_equals_its_mirror_on_scenes() {
    with_gpu(|host| {
        for (name, factor, map_size, normals) in [
            ("robot", 4.0, 1024, true),
            ("courtyard", 6.0, 512, true),
            ("jenga", 3.0, 333, false),
            ("fence", 2.0, 1024, true),
        ] {
            let scene = shipped_scene(name);
            let mut r = renderer(host, &scene, edgeshade::scene::RenderDesc { normals, ..desc([160, 90], map_size) });
            let light = enlarged(r.light(), factor);
            r.set_light(&scene, light);
            for set in FORMS {
                let gpu = visibility(&mut r, "pcss", set);
                let shot = Shot::of(host, &r, normals);
                let mirror = |s: &Settings| pcss::visibility(&shot.data(), s).unwrap();
                let what = format!("pcss {name} {map_size} {set:?}");
                assert!(partly(&gpu) > 100, "{what}: {} pixels in penumbra", partly(&gpu));
                check(&gpu, &mirror(&settings(set)), &what, 0.02);
                // Another number of taps gives another image.
                let s = settings(set);
                let other = Settings { filter_taps: s.filter_taps + 2, exact_box: false, ..s };
                assert!(compare(&gpu, &mirror(&other), 1e-4).wrong > 20, "{what}: other taps go unnoticed");
            }
        }
    });
}

#[test]
fn it_equals_its_mirror_on_noise() {
    with_gpu(|host| {
        for set in FORMS {
            let mut technique = on_ground(host, set);
            let mut unskipped = on_ground(host, &[set, &[("skip", "off")]].concat().leak()[..]);
            for (k, (is_spot, size, tilt)) in UNDER_NOISE.into_iter().enumerate() {
                let ground = Ground::new(host, is_spot, size, tilt);
                let texels = noise(&ground, k as u64);
                let map = upload(host, &texels);
                let gpu = visibility_of(host, technique.as_mut(), &ground.inputs(&map));
                let what = format!("pcss on noise, spot {is_spot} {size} tilt {tilt} {set:?}");
                assert_in_range(&gpu, &what);
                let plain = visibility_of(host, unskipped.as_mut(), &ground.inputs(&map));
                assert_same_bits(&plain, &gpu, &what);
                let constants = ground.constants(&map);
                let mirror = pcss::visibility(&ground.data(&constants, &texels), &settings(set)).unwrap();
                check(&gpu, &mirror, &what, 0.25);
                // A slightly larger light gives another image, unless it has no size.
                let larger = Ground::new(host, is_spot, size, tilt).with_size(1.05);
                let constants = larger.constants(&map);
                let mirror = pcss::visibility(&larger.data(&constants, &texels), &settings(set)).unwrap();
                let wrong = compare(&gpu, &mirror, 1e-4).wrong;
                assert!(if size == 0.0 { wrong == 0 } else { wrong > 100 }, "{what}: {wrong} pixels");
            }
        }
    });
}

/// The penumbra of a blocking half-plane, parallel to map and receiver, is a ramp. Its ends are lines from the light's
/// rim past the half-plane's edge.
#[test]
fn a_straight_edge_casts_a_ramp_of_the_right_width() {
    with_gpu(|host| {
        let (mut exact, mut spread) = (on_ground(host, &[]), on_ground(host, &[("filter_taps", "5")]));
        let (z, z_blocker) = (Ground::distance(), 6.0);
        for (is_spot, size) in [(true, 0.6), (true, 0.2), (false, 0.2), (false, 0.06)] {
            let ground = Ground::new(host, is_spot, size, 0.0);
            let blocks = ground.stored(z_blocker);
            let texels: Vec<f32> =
                (0..MAP[0] * MAP[1]).map(|i| if i % MAP[0] < MAP[0] / 2 { blocks } else { 1.0 }).collect();
            let map = upload(host, &texels);
            // Width on the receiver, by similar triangles. The filter covers the light as seen from z through the
            // edge; the map's perspective carries that to the receiver.
            let width =
                if is_spot { size * (z - z_blocker) / z_blocker } else { 2.0 * (0.5 * size).tan() * (z - z_blocker) };
            let edge = (f64::from(MAP[0] / 2) - 0.5 * f64::from(MAP[0])) * ground.texel();
            let worst = |technique: &mut dyn Technique, width: f64| {
                let gpu = visibility_of(host, technique, &ground.inputs(&map));
                // The search sees the edge only as far as its outermost tap reaches.
                let half = (0.5 * width).max(ground.texel());
                let reach = half * (1.0 - 1.0 / 9.0);
                let off = |i: usize| {
                    let x = ground.x(i) - edge;
                    let ramp = (0.5 + x / width).clamp(0.0, 1.0);
                    let expected = if x < reach { ramp } else { 1.0 };
                    let tie = (x - reach).abs() < 1e-3 * half;
                    if tie { 0.0 } else { (f64::from(gpu[i]) - expected).abs() }
                };
                // Pixels near the map's rim do not count: everything outside it is lit.
                let inner = |i: &usize| {
                    ground.x(*i).abs() < 2.5 && (IMAGE[1] / 3..IMAGE[1] * 2 / 3).contains(&(*i as u32 / IMAGE[0]))
                };
                (0..gpu.len()).filter(inner).map(off).fold(0.0, f64::max)
            };
            let (found, by_taps) = (worst(exact.as_mut(), width), worst(spread.as_mut(), width));
            let texels = width / ground.texel();
            println!("edge, spot {is_spot} {size}: {texels:.1} texels, off by {found:.1e}, with 5 taps {by_taps:.3}");
            assert!((1.0..15.0).contains(&texels), "{texels}");
            assert!(found < 1e-4, "{found}");
            assert!(by_taps < 0.11, "{by_taps}");
            assert!(worst(exact.as_mut(), 1.05 * width) > 1e-2, "a width off by 5 % goes unnoticed");
        }
    });
}

#[test]
fn skipping_changes_nothing() {
    with_gpu(|host| {
        let (mut active, mut total) = (0, 0);
        for scene in every_shipped() {
            for (size, map_size, factor, set) in
                [([160, 90], 1024, 1.0, FORMS[0]), ([160, 90], 100, 10.0, FORMS[0]), ([96, 54], 1024, 5.0, FORMS[1])]
            {
                let mut r = renderer(host, &scene, desc(size, map_size));
                let light = enlarged(r.light(), factor);
                r.set_light(&scene, light);
                let off = visibility(&mut r, "pcss", &[set, &[("skip", "off")][..]].concat());
                let (on, timing) = frame(&mut r, "pcss", set);
                assert_same_bits(&off, &on, &format!("{} {size:?}, map {map_size}, light x {factor}", scene.name));
                let tiles = timing.passes.iter().find_map(|p| p.tiles).unwrap();
                (active, total) = (active + tiles.active, total + tiles.total);
            }
        }
        println!("tiles searched: {active} of {total}");
        assert!(active > 0 && active < total, "{active} of {total} tiles");
    });
}

/// A light without size casts the edge of a bilinear test, which is percentage-closer filtering one texel wide.
#[test]
fn a_light_without_size_casts_a_hard_edge() {
    with_gpu(|host| {
        for name in ["robot", "jenga", "courtyard"] {
            let scene = shipped_scene(name);
            let mut r = renderer(host, &scene, desc([160, 90], 512));
            let light = enlarged(r.light(), 0.0);
            r.set_light(&scene, light);
            let soft = visibility(&mut r, "pcss", &[]);
            let hard = visibility(&mut r, "pcf", &[("width", "1"), ("skip", "off")]);
            let off = differing(&soft, &hard, 1e-4);
            println!("{name}: {off} of {} pixels differ", soft.len());
            // Only ties of the shadow test may differ: the two add up the tests in different orders.
            assert!(off * 1000 <= soft.len(), "{name}: {off} pixels");
            let wide = visibility(&mut r, "pcf", &[("width", "3"), ("skip", "off")]);
            assert!(differing(&soft, &wide, 1e-4) > 300, "{name}: another width goes unnoticed");
        }
    });
}

#[test]
fn impossible_taps_are_errors() {
    for (name, value) in [("search_taps", "8"), ("search_taps", "65"), ("filter_taps", "0"), ("taps", "many")] {
        let error = Params::parse(find("pcss").unwrap(), [(name, value)]).unwrap_err().to_string();
        assert!(error.contains(name), "{error}");
    }
}
