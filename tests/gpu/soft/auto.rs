//! The hybrid of soft shadows compared with its mirror, and with the techniques that it combines.

use super::ground::{self, Ground, UNDER_NOISE, noise, upload};
use super::rbssm::settings_of;
use crate::common::enlarged;
use crate::common::{
    Shot, assert_in_range, assert_same_bits, desc, differing, every_nth, every_shipped, frame, is_llvmpipe,
};
use crate::common::{renderer, shipped_scene, visibility, with_gpu};
use crate::mirrors::compare;
use crate::noise::visibility_of;
use edgeshade::host::Host;
use edgeshade::reference::Mirror;
use edgeshade::reference::soft::soft_auto::{self, Settings};
use edgeshade::scene::RenderDesc;
use edgeshade::technique::{self, OutputFormat, Params, Setup, Technique, find};

type Set = &'static [(&'static str, &'static str)];

/// Default; many pixels for each kind of filter; as in the papers, with few taps; only plain tests.
const FORMS: [Set; 4] = [
    &[],
    &[("kernel_texels", "5"), ("max_distance", "7"), ("thin_distance", "0")],
    &[("search", "near"), ("visibility", "recovery"), ("kernel_taps", "5"), ("filter_taps", "7"), ("least_width", "0")],
    &[("kernel_texels", "0"), ("search_taps", "3")],
];

fn params(set: Set) -> Params {
    Params::parse(find("soft-auto").unwrap(), set.iter().copied()).unwrap()
}

fn settings(set: Set) -> Settings {
    let p = params(set);
    Settings {
        kernel: settings_of(&p, p.int("kernel_taps")),
        filter_taps: p.int("filter_taps"),
        kernel_texels: p.float("kernel_texels"),
        thin_distance: p.float("thin_distance"),
    }
}

fn on_ground(host: &Host, set: Set) -> Box<dyn Technique> {
    ground::on_ground(host, "soft-auto", params(set))
}

/// Checks an image against its mirror. The mirror must have few doubts, since one that doubts everything agrees with
/// anything.
fn check(gpu: &[f32], mirror: &Mirror, what: &str, most_ties: f64) {
    compare(gpu, mirror, 1e-4).check(what, most_ties);
    let doubt = mirror.doubt.iter().sum::<f64>() / mirror.doubt.len() as f64;
    println!("{what:42} on average doubt {doubt:.1e}");
    assert!(doubt < 0.02, "{what}: {doubt:.1e}");
}

#[test]
fn it_equals_its_mirror_on_scenes() {
    with_gpu(|host| {
        // The lights have sizes at which each kind of filter gets pixels.
        let cases = [
            ("robot", 4.0, 1024, true),
            ("courtyard", 6.0, 512, true),
            ("jenga", 3.0, 333, false),
            ("fence", 1.0, 1024, true),
        ];
        let mut noticed = [0; 3];
        for (k, (name, factor, map_size, normals)) in cases.into_iter().enumerate() {
            let scene = shipped_scene(name);
            let mut r = renderer(host, &scene, RenderDesc { normals, ..desc([160, 90], map_size) });
            let light = enlarged(r.light(), factor);
            r.set_light(&scene, light);
            // Half of the forms on every other scene.
            for set in FORMS.into_iter().skip(k % 2).step_by(2) {
                let gpu = visibility(&mut r, "soft-auto", set);
                let shot = Shot::of(host, &r, normals);
                let mirror = |s: &Settings| soft_auto::visibility(&shot.data(), s).unwrap();
                let what = format!("soft-auto {name} {map_size} {set:?}");
                let s = settings(set);
                check(&gpu, &mirror(&s), &what, 0.05);
                // Each kind of filter gives another image.
                let wrong = |s: Settings| compare(&gpu, &mirror(&s), 1e-4).wrong;
                let others = [
                    wrong(Settings { kernel_texels: 2.0 * s.kernel_texels + 3.0, ..s }),
                    wrong(Settings { filter_taps: 1, ..s }),
                    wrong(Settings { thin_distance: s.thin_distance + 1e3, ..s }),
                ];
                println!("{what}: wrong with another width of kernels, taps, distance {others:?}");
                noticed = std::array::from_fn(|i| noticed[i] + others[i]);
            }
        }
        assert!(noticed.iter().all(|n| *n > 50), "a setting goes unnoticed: {noticed:?}");
    });
}

#[test]
fn it_equals_its_mirror_on_noise() {
    with_gpu(|host| {
        for (f, set) in FORMS.into_iter().enumerate() {
            let mut technique = on_ground(host, set);
            let mut unskipped = on_ground(host, [set, &[("skip", "off")]].concat().leak());
            let half = UNDER_NOISE.into_iter().enumerate().filter(|(k, _)| (k + f) % 2 == 0);
            for (k, (is_spot, size, tilt)) in half {
                let ground = Ground::new(host, is_spot, size, tilt);
                let texels = noise(&ground, k as u64);
                let map = upload(host, &texels);
                let gpu = visibility_of(host, technique.as_mut(), &ground.inputs(&map));
                let what = format!("soft-auto on noise, spot {is_spot} {size} tilt {tilt} {set:?}");
                assert_in_range(&gpu, &what);
                let plain = visibility_of(host, unskipped.as_mut(), &ground.inputs(&map));
                assert_same_bits(&plain, &gpu, &what);
                let mirror = |ground: &Ground| {
                    let constants = ground.constants(&map);
                    soft_auto::visibility(&ground.data(&constants, &texels), &settings(set)).unwrap()
                };
                check(&gpu, &mirror(&ground), &what, 0.25);
                // A slightly larger light gives another image, unless it has no size.
                let wrong = compare(&gpu, &mirror(&ground.with_size(1.05)), 1e-4).wrong;
                assert!(if size == 0.0 { wrong == 0 } else { wrong > 20 }, "{what}: {wrong} pixels");
            }
        }
    });
}

/// Without one of its two kinds of filter, it equals the technique of the other, bit for bit; skipping changes
/// nothing.
#[test]
fn its_ends_are_pcss_and_rbssm() {
    const BIAS: Set = &[("normal_offset", "0.1"), ("depth_bias", "0.3")];
    with_gpu(|host| {
        let mut apart = [0, 0];
        for (k, scene) in every_nth(2, every_shipped().enumerate()) {
            let (size, map_size, factor) =
                [([160, 90], 1024, 1.0), ([96, 54], 2048, 6.0), ([160, 90], 100, 10.0)][k % 3];
            let mut r = renderer(host, &scene, desc(size, map_size));
            let light = enlarged(r.light(), factor);
            r.set_light(&scene, light);
            let what = format!("{} {size:?}, map {map_size}, light x {factor}", scene.name);
            let auto = visibility(&mut r, "soft-auto", &[]);
            for skip in ["off", "quads", "tiles"] {
                assert_same_bits(
                    &visibility(&mut r, "soft-auto", &[("skip", skip)]),
                    &auto,
                    &format!("{what}, {skip}"),
                );
            }
            for (i, (id, texels)) in [("pcss", "0"), ("rbssm", "1e6")].into_iter().enumerate() {
                let end = visibility(
                    &mut r,
                    "soft-auto",
                    &[BIAS, &[("kernel_texels", texels), ("thin_distance", "1e6")]].concat(),
                );
                let whole = visibility(&mut r, id, BIAS);
                assert_same_bits(&whole, &end, &format!("{what}: {id}"));
                apart[i] += differing(&auto, &whole, 0.01);
            }
        }
        println!("pixels that differ from pcss and rbssm: {apart:?}");
        assert!(apart.iter().all(|n| *n > 100), "{apart:?}");
    });
}

/// Every kind of filter has some pixels, but no more than there are in penumbrae.
#[test]
fn pixels_are_listed_for_each_kind_of_filter() {
    with_gpu(|host| {
        let scene = shipped_scene("jenga");
        let mut r = renderer(host, &scene, desc([320, 180], 1024));
        let (_, timing) = frame(&mut r, "soft-auto", &[("skip", "quads")]);
        let tiles: Vec<_> = timing.passes.iter().filter_map(|p| Some((&p.name, p.tiles?))).collect();
        // Tiles that are not decided as a whole, tiles with a pixel that is searched, and those of the two filters.
        let [open, all, lists @ ..] = &tiles[..] else { panic!("no lists") };
        println!("{tiles:?}");
        assert!(all.1.active <= open.1.active, "{tiles:?}");
        assert_eq!(lists.len(), 2);
        assert!(lists.iter().all(|l| l.1.active > 0 && l.1.active < all.1.total), "{tiles:?}");
        // Groups of 64 pixels; the last group of each list is not full.
        assert!(lists.iter().map(|l| l.1.active).sum::<u32>() <= all.1.active + 2, "{tiles:?}");
    });
}

/// Under a light without size, whose filters have no width, the image equals that of RBSM*, bit for bit. Bars and gaps one
/// texel wide are left out: plain tests smooth them.
#[test]
fn a_light_without_size_is_the_hard_technique() {
    with_gpu(|host| {
        for (name, skip) in [("robot", "auto"), ("jenga", "auto"), ("courtyard", "off")] {
            let scene = shipped_scene(name);
            let mut r = renderer(host, &scene, desc([160, 90], 512));
            let light = enlarged(r.light(), 0.0);
            r.set_light(&scene, light);
            let soft =
                visibility(&mut r, "soft-auto", &[("normal_offset", "0.1"), ("thin_distance", "1e6"), ("skip", skip)]);
            let hard =
                visibility(&mut r, "rbsm-star", &[("normal_offset", "0.1"), ("depth_bias", "0.3"), ("slack", "0")]);
            assert_same_bits(&hard, &soft, name);
            let other = visibility(&mut r, "rbsm", &[("normal_offset", "0.1"), ("depth_bias", "0.3"), ("slack", "0")]);
            assert!(differing(&soft, &other, 0.5) > 30, "{name}: another function goes unnoticed");
        }
    });
}

#[test]
fn impossible_settings_are_errors() {
    for (name, value) in [("search_taps", "8"), ("kernel_taps", "0"), ("filter_taps", "65"), ("kernel_texels", "-1")] {
        let error = Params::parse(find("soft-auto").unwrap(), [(name, value)]).unwrap_err().to_string();
        assert!(error.contains(name), "{error}");
    }
    with_gpu(|host| {
        // Devices differ in the size limit of storage buffers.
        if !is_llvmpipe(host) {
            return;
        }
        let setup = Setup {
            extent: [16384, 16384],
            map_size: [64, 64],
            output: OutputFormat::R8,
            params: params(&[]),
            intermediates: false,
            casters: None,
        };
        let error = technique::prepare("soft-auto", host.context(), &setup).err().unwrap().to_string();
        assert!(error.contains("16384x16384") && error.contains("storage buffer"), "{error}");
    });
}
