//! Revectorization-based soft shadow mapping compared with the mirror, and without its shortcuts.

use super::ground::{self, Ground, IMAGE, MAP, UNDER_NOISE, noise, upload};
use crate::common::enlarged;
use crate::common::{Shot, assert_in_range, assert_same_bits, desc, differing, every_nth, every_shipped, frame};
use crate::common::{is_full_sweep, renderer, search_form, search_window, shipped_scene, visibility, with_gpu};
use crate::mirrors::compare;
use crate::noise::visibility_of;
use edgeshade::host::Host;
use edgeshade::reference::Mirror;
use edgeshade::reference::soft::rbssm::{self, SearchForm, Settings};
use edgeshade::scene::RenderDesc;
use edgeshade::technique::soft::rbssm::{RbssmVisibility, Reuse};
use edgeshade::technique::{Params, Technique, find};

type Set = &'static [(&'static str, &'static str)];

/// Default; as in the paper, but on the receiver's plane and with accelerations that keep the image; windows with few taps
/// and with many, short runs and long ones.
const FORMS: [Set; 4] = [
    &[],
    &[("search", "near"), ("visibility", "recovery"), ("least_width", "0")],
    &[("search_taps", "3"), ("filter_taps", "5"), ("max_distance", "3")],
    &[("search_taps", "5"), ("filter_taps", "33"), ("max_distance", "40"), ("least_width", "3")],
];

fn params(id: &str, set: Set) -> Params {
    Params::parse(find(id).unwrap(), set.iter().copied()).unwrap()
}

pub fn settings(set: Set) -> Settings {
    let p = params("rbssm", set);
    let reuse = if p.word("reuse") == "printed" { Reuse::AsPrinted } else { Reuse::EachRun };
    Settings { form: search_form(&p), reuse, ..settings_of(&p, p.int("filter_taps")) }
}

/// Returns the mirror's settings from the parameters of `rbssm` or `soft-auto`.
pub fn settings_of(p: &Params, filter_taps: u32) -> Settings {
    Settings {
        search_taps: p.int("search_taps"),
        filter_taps,
        window: search_window(p),
        form: SearchForm::default(),
        reuse: Reuse::EachRun,
        visibility: match p.word("visibility") {
            "recovery" => RbssmVisibility::Recovery,
            _ => RbssmVisibility::Improved,
        },
        least_width: p.float("least_width"),
        max_distance: p.int("max_distance"),
        normal_offset: p.float("normal_offset"),
        depth_bias: p.float("depth_bias"),
    }
}

fn on_ground(host: &Host, id: &str, set: Set) -> Box<dyn Technique> {
    ground::on_ground(host, id, params(id, set))
}

/// Checks an image against its mirror. The mirror must have few doubts, since one that doubts everything agrees with
/// anything.
fn check(gpu: &[f32], mirror: &Mirror, what: &str, most_ties: f64) {
    compare(gpu, mirror, 1e-4).check(what, most_ties);
    let doubt = mirror.doubt.iter().sum::<f64>() / mirror.doubt.len() as f64;
    println!("{what:42} on average doubt {doubt:.1e}");
    assert!(doubt < 0.02, "{what}: {doubt:.1e}");
}

fn partly(values: &[f32]) -> usize {
    values.iter().filter(|v| (0.05..0.95).contains(*v)).count()
}

#[test]
fn it_equals_its_mirror_on_scenes() {
    with_gpu(|host| {
        let cases = [
            ("robot", 4.0, 1024, true),
            ("courtyard", 6.0, 512, true),
            ("jenga", 3.0, 333, false),
            ("fence", 1.0, 1024, true),
        ];
        for (k, (name, factor, map_size, normals)) in cases.into_iter().enumerate() {
            let scene = shipped_scene(name);
            let mut r = renderer(host, &scene, RenderDesc { normals, ..desc([160, 90], map_size) });
            let light = enlarged(r.light(), factor);
            r.set_light(&scene, light);
            // The first two forms on every other scene, the others on the rest.
            for set in FORMS.into_iter().skip(k % 2 * 2).take(2) {
                let gpu = visibility(&mut r, "rbssm", set);
                let shot = Shot::of(host, &r, normals);
                let mirror = |s: &Settings| rbssm::visibility(&shot.data(), s).unwrap();
                let what = format!("rbssm {name} {map_size} {set:?}");
                assert!(partly(&gpu) > 100, "{what}: {} pixels in penumbra", partly(&gpu));
                let s = settings(set);
                check(&gpu, &mirror(&s), &what, 0.05);
                // Another number of taps gives another image, and so does the other function.
                let wrong = |s: &Settings| compare(&gpu, &mirror(s), 1e-4).wrong;
                let taps = wrong(&Settings { filter_taps: s.filter_taps + 2, ..s });
                let other = match s.visibility {
                    RbssmVisibility::Recovery => RbssmVisibility::Improved,
                    RbssmVisibility::Improved => RbssmVisibility::Recovery,
                };
                let function = wrong(&Settings { visibility: other, ..s });
                assert!(taps > 20 && function > 20, "{what}: other taps {taps}, the other function {function}");
            }
        }
    });
}

/// On noise every pixel has discontinuities of all shapes. It is tested with all accelerations, with each alone, and
/// with none.
#[test]
fn it_equals_its_mirror_and_the_naive_form_on_noise() {
    with_gpu(|host| {
        for (f, set) in FORMS.into_iter().enumerate() {
            let with = |more: Set| on_ground(host, "rbssm", [set, more].concat().leak());
            let mut technique = with(&[]);
            let mut others = [
                ("naive", on_ground(host, "rbssm-naive", set)),
                ("by quads", with(&[("skip", "quads")])),
                ("by tiles", with(&[("skip", "tiles")])),
                ("without reuse", with(&[("reuse", "off")])),
                ("without skipping", with(&[("skip", "off")])),
            ];
            let wanted = |k: usize| if is_full_sweep() { (k + f).is_multiple_of(2) } else { k == f + 1 };
            for (k, (is_spot, size, tilt)) in UNDER_NOISE.into_iter().enumerate().filter(|(k, _)| wanted(*k)) {
                let ground = Ground::new(host, is_spot, size, tilt);
                let texels = noise(&ground, k as u64);
                let map = upload(host, &texels);
                let gpu = visibility_of(host, technique.as_mut(), &ground.inputs(&map));
                let what = format!("rbssm on noise, spot {is_spot} {size} tilt {tilt} {set:?}");
                assert_in_range(&gpu, &what);
                for (name, other) in &mut others {
                    let plain = visibility_of(host, other.as_mut(), &ground.inputs(&map));
                    assert_same_bits(&plain, &gpu, &format!("{what}, {name}"));
                }
                let mirror = |ground: &Ground, s: &Settings| {
                    let constants = ground.constants(&map);
                    rbssm::visibility(&ground.data(&constants, &texels), s).unwrap()
                };
                check(&gpu, &mirror(&ground, &settings(set)), &what, 0.25);
                // Another longest run gives another image, and so does a slightly larger light, unless it has no size.
                let wrong = |m: &Mirror| compare(&gpu, m, 1e-4).wrong;
                let shorter = wrong(&mirror(&ground, &Settings { max_distance: 1, ..settings(set) }));
                assert!(shorter > 20, "{what}: shorter runs, {shorter} pixels");
                let larger = ground.with_size(1.05);
                let larger = wrong(&mirror(&larger, &settings(set)));
                assert!(if size == 0.0 { larger == 0 } else { larger > 20 }, "{what}: larger light, {larger} pixels");
            }
        }
    });
}

/// The papers' forms: all of it, and its parts with the default visibility, which works on both sides of an edge.
const PUBLISHED: [Set; 3] = [
    &[("preset", "published")],
    &[("mean", "depth"), ("receiver", "fixed"), ("filter_taps", "5")],
    &[("reuse", "printed"), ("filter_taps", "7")],
];

#[test]
fn the_published_form_equals_its_mirror() {
    with_gpu(|host| {
        let cases = [("robot", 4.0, 1024), ("courtyard", 6.0, 512), ("jenga", 3.0, 333), ("fence", 1.0, 1024)];
        for (k, (name, factor, map_size)) in cases.into_iter().enumerate() {
            let scene = shipped_scene(name);
            let mut r = renderer(host, &scene, desc([160, 90], map_size));
            let light = enlarged(r.light(), factor);
            r.set_light(&scene, light);
            for set in [PUBLISHED[0], PUBLISHED[1 + k % 2]] {
                let gpu = visibility(&mut r, "rbssm", set);
                let shot = Shot::of(host, &r, true);
                let what = format!("rbssm {name} {map_size} {set:?}");
                check(&gpu, &rbssm::visibility(&shot.data(), &settings(set)).unwrap(), &what, 0.2);
                let unskipped = visibility(&mut r, "rbssm", &[set, &[("skip", "off")]].concat());
                assert_same_bits(&unskipped, &gpu, &what);
                let taps = settings(set).filter_taps.to_string();
                let default = visibility(&mut r, "rbssm", &[("filter_taps", &taps)]);
                assert!(differing(&gpu, &default, 0.01) > 20, "{what}: the form goes unnoticed");
            }
        }
        for (k, (is_spot, size, tilt)) in UNDER_NOISE.into_iter().enumerate().filter(|(k, _)| k % 3 == 1) {
            let ground = Ground::new(host, is_spot, size, tilt);
            let texels = noise(&ground, k as u64);
            let map = upload(host, &texels);
            // The first form has too many doubts on noise to prove anything there.
            for set in PUBLISHED.into_iter().skip(1) {
                let gpu = visibility_of(host, on_ground(host, "rbssm", set).as_mut(), &ground.inputs(&map));
                let constants = ground.constants(&map);
                let mirror = |s: &Settings| rbssm::visibility(&ground.data(&constants, &texels), s).unwrap();
                let what = format!("rbssm on noise, spot {is_spot} {size} tilt {tilt} {set:?}");
                let s = settings(set);
                check(&gpu, &mirror(&s), &what, 0.3);
                if s.reuse == Reuse::AsPrinted && size > 0.0 {
                    let wrong = compare(&gpu, &mirror(&Settings { reuse: Reuse::EachRun, ..s }), 1e-4).wrong;
                    assert!(wrong > 20, "{what}: the correction goes unnoticed, {wrong} pixels");
                }
            }
        }
    });
}

/// Without the reuse the published form is that of the technique without accelerations.
#[test]
fn the_published_naive_form_is_the_published_form_without_reuse() {
    with_gpu(|host| {
        let scene = shipped_scene("knot");
        let mut r = renderer(host, &scene, desc([160, 90], 512));
        let naive = visibility(&mut r, "rbssm-naive", &[("preset", "published")]);
        let plain = visibility(&mut r, "rbssm", &[("preset", "published"), ("reuse", "off")]);
        assert_same_bits(&plain, &naive, "knot");
        let printed = visibility(&mut r, "rbssm", &[("preset", "published")]);
        assert!(differing(&printed, &naive, 0.01) > 20, "the printed reuse goes unnoticed");
    });
}

/// No acceleration changes a bit on any scene: neither the classification, nor the bit masks of narrow windows, nor
/// the reuse of runs in wide ones.
#[test]
fn it_is_the_naive_form_on_every_scene() {
    with_gpu(|host| {
        let (mut active, mut total) = (0, 0);
        for (k, scene) in every_nth(2, every_shipped().enumerate()) {
            let cases = [([160, 90], 1024, 1.0), ([96, 54], 2048, 6.0), ([160, 90], 100, 10.0)];
            // Two of the three: narrow windows, windows with more texels than fit, and windows that leave the map.
            for (size, map_size, factor) in [cases[k % 3], cases[(k + 1) % 3]] {
                let set: Set = FORMS[k / 2 % 2];
                let mut r = renderer(host, &scene, desc(size, map_size));
                let light = enlarged(r.light(), factor);
                r.set_light(&scene, light);
                let naive = visibility(&mut r, "rbssm-naive", set);
                let (fast, timing) = frame(&mut r, "rbssm", set);
                assert_same_bits(&naive, &fast, &format!("{} {size:?}, map {map_size}, light x {factor}", scene.name));
                let tiles = timing.passes.iter().find_map(|p| p.tiles).unwrap();
                (active, total) = (active + tiles.active, total + tiles.total);
            }
        }
        println!("tiles searched: {active} of {total}");
        assert!(active > 0 && active < total, "{active} of {total} tiles");
    });
}

/// Under a light without size, the image equals that of the hard technique, bit for bit.
#[test]
fn a_light_without_size_is_the_hard_technique() {
    with_gpu(|host| {
        for name in ["robot", "jenga", "courtyard"] {
            let scene = shipped_scene(name);
            let mut r = renderer(host, &scene, desc([160, 90], 512));
            let light = enlarged(r.light(), 0.0);
            r.set_light(&scene, light);
            let bias: Set = &[("normal_offset", "0.1"), ("depth_bias", "0.3")];
            for (word, id) in [("recovery", "rbsm"), ("improved", "rbsm-star")] {
                let soft = visibility(&mut r, "rbssm", &[bias, &[("visibility", word)]].concat());
                let hard = visibility(&mut r, id, &[bias, &[("slack", "0")]].concat());
                assert_same_bits(&hard, &soft, &format!("{name}: {id}"));
                let other = if word == "recovery" { "rbsm-star" } else { "rbsm" };
                let other = visibility(&mut r, other, &[bias, &[("slack", "0")]].concat());
                assert!(differing(&soft, &other, 0.5) > 30, "{name}: the other function goes unnoticed");
            }
        }
    });
}

/// The penumbra of a slanted half-plane is straight, where that of texels has stairs.
#[test]
fn a_slanted_edge_has_no_stairs() {
    with_gpu(|host| {
        let mut techniques = [on_ground(host, "rbssm", &[]), on_ground(host, "rbssm", &[("max_distance", "1")])];
        for (is_spot, size) in [(true, 0.05), (false, 0.02)] {
            let ground = Ground::new(host, is_spot, size, 0.0);
            let blocks = ground.stored(6.0);
            let slope = 0.13;
            let inside = |i: u32| f64::from(i % MAP[0]) - 50.0 + slope * (f64::from(i / MAP[0]) - 33.0) < 0.0;
            let texels: Vec<f32> = (0..MAP[0] * MAP[1]).map(|i| if inside(i) { blocks } else { 1.0 }).collect();
            let map = upload(host, &texels);
            // Lit fraction of each row: a straight line down the image.
            let rows = IMAGE[1] / 4..IMAGE[1] * 3 / 4;
            let [straight, stairs] = [0, 1].map(|k: usize| {
                let gpu = visibility_of(host, techniques[k].as_mut(), &ground.inputs(&map));
                let row = |y: u32| gpu[(y * IMAGE[0]) as usize..][..IMAGE[0] as usize].iter().sum::<f32>();
                let edge: Vec<f64> = rows.clone().map(|y| f64::from(row(y))).collect();
                let n = edge.len() as f64;
                let middle = (n - 1.0) / 2.0;
                let mean = edge.iter().sum::<f64>() / n;
                let spread: f64 = (0..edge.len()).map(|i| (i as f64 - middle).powi(2)).sum();
                let tilt = (0..edge.len()).map(|i| (i as f64 - middle) * edge[i]).sum::<f64>() / spread;
                let off = |i: usize| edge[i] - mean - tilt * (i as f64 - middle);
                (0..edge.len()).map(|i| off(i).powi(2)).sum::<f64>().sqrt() / n.sqrt()
            });
            println!(
                "slanted edge, spot {is_spot}: off a line by {straight:.3} pixels, with runs of one texel {stairs:.3}"
            );
            assert!(straight < 0.25 * stairs, "{straight} {stairs}");
        }
    });
}

#[test]
fn impossible_settings_are_errors() {
    for (name, value) in [("search_taps", "8"), ("filter_taps", "65"), ("least_width", "9"), ("visibility", "none")] {
        for id in ["rbssm", "rbssm-naive"] {
            let error = Params::parse(find(id).unwrap(), [(name, value)]).unwrap_err().to_string();
            assert!(error.contains(name), "{error}");
        }
    }
}
