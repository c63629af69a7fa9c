//! Variance and moment soft shadow mapping, compared with their mirrors and with closed forms.

use super::ground::{self, Ground, IMAGE, MAP, UNDER_NOISE, noise, upload};
use crate::common::{
    Shot, assert_in_range, desc, enlarged, renderer, search_window, shipped_scene, visibility, with_gpu,
};
use crate::filtering::summed_area::tabulated_range;
use crate::mirrors::compare;
use crate::noise::visibility_of;
use edgeshade::host::Host;
use edgeshade::reference::soft::window_moments::Settings;
use edgeshade::reference::soft::{mssm, vssm};
use edgeshade::reference::{FrameData, Mirror};
use edgeshade::scene::RenderDesc;
use edgeshade::technique::filtering::moment_kind::{Kind, range};
use edgeshade::technique::filtering::summed_area::scale;
use edgeshade::technique::soft::{mssm::moment_bias, vssm::least_variance};
use edgeshade::technique::{Params, find};
use edgeshade::view::LightView;

type Set = &'static [(&'static str, &'static str)];

/// Defaults, and every window filtered.
const FORMS: [(&str, Set); 4] = [
    ("vssm", &[]),
    ("vssm", &[("window", "31"), ("cells", "4"), ("search", "near"), ("classify", "off"), ("reduction", "0")]),
    ("mssm", &[]),
    ("mssm", &[("window", "31"), ("search", "near"), ("classify", "off"), ("reduction", "0")]),
];

/// The bounds of the windows alone, without what decides or changes them.
const PLAIN: Set = &[("window", "31"), ("classify", "off"), ("reduction", "0")];

fn params(id: &str, set: Set) -> Params {
    Params::parse(find(id).unwrap(), set.iter().copied()).unwrap()
}

fn settings(p: &Params, light: &LightView) -> Settings {
    Settings {
        window: p.int("window"),
        search: search_window(p),
        classify: p.on("classify"),
        normal_offset: p.float("normal_offset"),
        depth_bias: p.float("depth_bias"),
        reduction: p.float("reduction"),
        range: range(light),
        scale: scale(p.int("window")),
    }
}

/// Returns the mirror's image; `change` alters its settings, so that they are not those of the GPU.
fn mirror(
    host: &Host,
    id: &str,
    set: Set,
    (data, size, light): (&FrameData<'_>, [u32; 2], &LightView),
    change: impl Fn(&mut Settings),
) -> Mirror {
    let p = params(id, set);
    let mut s = settings(&p, light);
    let kind = if id == "vssm" { Kind::Variance } else { Kind::Packed };
    let table = tabulated_range(host, data.shadow_map, size, (kind, s.window), s.range);
    change(&mut s);
    match id {
        "vssm" => vssm::visibility(data, &table, &s, (p.int("cells"), least_variance(&p))).unwrap(),
        _ => mssm::visibility(data, &table, &s, moment_bias(&p)).unwrap(),
    }
}

/// Checks an image against its mirror, and that the mirror does not doubt everything. `most_wrong` pixels in a thousand may
/// differ by more than the mirror's bounds say: the bounds follow each quantity alone, not several moved at once.
fn check(gpu: &[f32], mirror: &Mirror, what: &str, most_wrong: usize) {
    let a = compare(gpu, mirror, 1e-3);
    let (wrong, ties) = (a.wrong, a.ties);
    let mean = |values: &[f64]| values.iter().sum::<f64>() / values.len() as f64;
    let (doubt, rounding) = (mean(&mirror.doubt), mean(&mirror.rounding));
    println!(
        "{what:42} wrong {wrong}, ties {ties} of {}, on average doubt {doubt:.1e}, rounding {rounding:.1e}",
        a.pixels
    );
    assert!(wrong * 1000 <= most_wrong * a.pixels, "{what}: {a:?}");
    assert!(ties * 10 <= a.pixels && a.ties_differing * 100 <= a.pixels, "{what}: {a:?}");
    assert!(doubt < 0.02 && rounding < 1e-3, "{what}: {doubt:.1e}, {rounding:.1e}");
}

#[test]
fn they_equal_their_mirrors_on_scenes() {
    with_gpu(|host| {
        for (name, factor, map_size, normals) in [
            ("robot", 4.0, 1024, true),
            ("courtyard", 6.0, 512, true),
            ("jenga", 3.0, 333, false),
            ("fence", 2.0, 1024, true),
        ] {
            let scene = shipped_scene(name);
            let mut r = renderer(host, &scene, RenderDesc { normals, ..desc([160, 90], map_size) });
            let light = enlarged(r.light(), factor);
            r.set_light(&scene, light);
            for (id, set) in FORMS {
                let gpu = visibility(&mut r, id, set);
                let shot = Shot::of(host, &r, normals);
                let (data, what) = (shot.data(), format!("{id} {name} {map_size} {set:?}"));
                let partly = gpu.iter().filter(|v| (0.05..0.95).contains(*v)).count();
                assert!(partly > 100, "{what}: {partly} pixels in penumbra");
                check(
                    &gpu,
                    &mirror(host, id, set, (&data, [map_size; 2], &light), |_| {}),
                    &what,
                    usize::from(id == "mssm"),
                );
                // Windows cut to another width, and another bias, give other images.
                let wrong = |change: fn(&mut Settings)| {
                    compare(&gpu, &mirror(host, id, set, (&data, [map_size; 2], &light), change), 1e-3).wrong
                };
                let (cut, biased) = (wrong(|s| s.window = 5), wrong(|s| s.depth_bias += 0.1));
                assert!(cut > 20 && biased > 20, "{what}: changes go unnoticed: {cut}, {biased}");
            }
        }
    });
}

#[test]
fn they_equal_their_mirrors_on_noise() {
    with_gpu(|host| {
        for (id, set) in FORMS {
            let mut technique = ground::on_ground(host, id, params(id, set));
            let mut wrong = 0;
            for (k, (is_spot, size, tilt)) in UNDER_NOISE.into_iter().enumerate() {
                let ground = Ground::new(host, is_spot, size, tilt);
                let texels = noise(&ground, k as u64);
                let map = upload(host, &texels);
                let gpu = visibility_of(host, technique.as_mut(), &ground.inputs(&map));
                let what = format!("{id} on noise, spot {is_spot} {size} tilt {tilt} {set:?}");
                assert_in_range(&gpu, &what);
                let constants = ground.constants(&map);
                let light = &ground.light[0];
                check(&gpu, &mirror(host, id, set, (&ground.data(&constants, &texels), MAP, light), |_| {}), &what, 0);
                if size > 0.0 {
                    let larger = Ground::new(host, is_spot, size, tilt).with_size(1.05);
                    let constants = larger.constants(&map);
                    let other = mirror(host, id, set, (&larger.data(&constants, &texels), MAP, light), |_| {});
                    wrong += compare(&gpu, &other, 1e-3).wrong;
                }
            }
            assert!(wrong > 300, "{id} {set:?}: lights 5 % larger make {wrong} pixels wrong");
        }
    });
}

/// Visibility of the level ground, and the pixels that lie far enough from the map's rim.
fn on_level_ground(host: &Host, id: &str, set: Set, ground: &Ground, texels: &[f32]) -> Vec<f32> {
    let mut technique = ground::on_ground(host, id, params(id, set));
    visibility_of(host, technique.as_mut(), &ground.inputs(&upload(host, texels)))
}

fn inner(ground: &Ground) -> impl Iterator<Item = usize> {
    let all = 0..(IMAGE[0] * IMAGE[1]) as usize;
    let (x, y) = (|i: usize| ground.x(i), |i: usize| i as u32 / IMAGE[0]);
    all.filter(move |&i| x(i).abs() < 2.5 && (IMAGE[1] / 3..IMAGE[1] * 2 / 3).contains(&y(i)))
}

/// A map that holds nothing, the receiver itself, or one plate in front of all of it.
#[test]
fn even_maps_are_lit_or_dark() {
    with_gpu(|host| {
        for id in ["vssm", "mssm"] {
            for (is_spot, size) in [(true, 0.0), (true, 0.6), (false, 0.0), (false, 0.2)] {
                let ground = Ground::new(host, is_spot, size, 0.0);
                for set in [&[][..], PLAIN] {
                    let seen = |depth: f32| {
                        let gpu = on_level_ground(host, id, set, &ground, &vec![depth; (MAP[0] * MAP[1]) as usize]);
                        assert_in_range(&gpu, &format!("{id} {set:?} {depth}"));
                        let off = |expected: f32| inner(&ground).map(|i| (gpu[i] - expected).abs()).fold(0.0, f32::max);
                        [off(1.0), off(0.0)]
                    };
                    let (empty, own) = (seen(1.0)[0], seen(ground.stored(Ground::distance()))[0]);
                    let dark = [2.0, 6.0, 9.0].map(|z| seen(ground.stored(z))[1]);
                    println!("{id} spot {is_spot} {size} {set:?}: empty {empty:.1e}, own {own:.1e}, dark {dark:?}");
                    assert!(empty <= if set.is_empty() { 0.0 } else { 1e-6 }, "{id} {set:?}: {empty}");
                    // By the depth bounds both are certain; the moments leave what the bias and the least variance add.
                    let most = if set.is_empty() { [0.0; 2] } else { [1e-3, 2e-2] };
                    assert!(own <= most[0], "{id} {set:?}: {own}");
                    assert!(dark.iter().all(|d| *d <= most[1]), "{id} {set:?}: {dark:?}");
                }
            }
        }
    });
}

/// A half-plane over the level ground, and nothing else in the map: two depths, which the moments recover. So the blocker's
/// depth is the half-plane's, and the penumbra is a ramp as wide as similar triangles make it.
#[test]
fn a_straight_edge_casts_a_ramp_of_the_right_width() {
    with_gpu(|host| {
        let (z, z_blocker) = (Ground::distance(), 6.0);
        for id in ["vssm", "mssm"] {
            for (is_spot, size) in [(true, 0.6), (true, 1.0), (false, 0.2), (false, 0.1)] {
                let ground = Ground::new(host, is_spot, size, 0.0);
                let depths = [ground.stored(z_blocker), ground.stored(z)];
                let texels: Vec<f32> =
                    (0..MAP[0] * MAP[1]).map(|i| depths[usize::from(i % MAP[0] >= MAP[0] / 2)]).collect();
                let gpu = on_level_ground(host, id, PLAIN, &ground, &texels);
                let width = if is_spot {
                    size * (z - z_blocker) / z_blocker
                } else {
                    2.0 * (0.5 * size).tan() * (z - z_blocker)
                };
                let edge = (f64::from(MAP[0] / 2) - 0.5 * f64::from(MAP[0])) * ground.texel();
                // Mean difference from the ramp, over the pixels within one and a half penumbrae.
                let off = |width: f64| {
                    let near: Vec<_> = inner(&ground).filter(|&i| (ground.x(i) - edge).abs() < 0.75 * width).collect();
                    let ramp = |i: usize| (0.5 + (ground.x(i) - edge) / width).clamp(0.0, 1.0);
                    near.iter().map(|&i| (f64::from(gpu[i]) - ramp(i)).abs()).sum::<f64>() / near.len() as f64
                };
                let (exact, narrow, wide) = (off(width), off(0.9 * width), off(1.1 * width));
                let texels = width / ground.texel();
                println!(
                    "{id} spot {is_spot} {size}: {texels:.1} texels, off by {exact:.1e}; 0.9 {narrow:.1e}, 1.1 {wide:.1e}"
                );
                assert!(texels > 2.0, "{texels}");
                assert!(exact < 5e-3, "{id} spot {is_spot} {size}: {exact}");
                assert!(narrow > 2.0 * exact && wide > 2.0 * exact, "a width off by 10 % goes unnoticed");
            }
        }
    });
}

/// A light without size casts the filtered hard edge: the same as percentage-closer filtering one texel wide.
#[test]
fn a_light_without_size_casts_a_hard_edge() {
    with_gpu(|host| {
        for id in ["vssm", "mssm"] {
            for is_spot in [true, false] {
                let ground = Ground::new(host, is_spot, 0.0, 0.0);
                let depths = [ground.stored(6.0), ground.stored(Ground::distance())];
                let texels: Vec<f32> = (0..MAP[0] * MAP[1])
                    .map(|i| depths[usize::from((i % MAP[0] / 7 + i / MAP[0] / 5).is_multiple_of(2))])
                    .collect();
                let soft = on_level_ground(host, id, PLAIN, &ground, &texels);
                let hard = |width| on_level_ground(host, "pcf", width, &ground, &texels);
                let worst = |other: &[f32]| inner(&ground).map(|i| (soft[i] - other[i]).abs()).fold(0.0, f32::max);
                let (one, three) = (worst(&hard(&[("width", "1")])), worst(&hard(&[("width", "3")])));
                println!("{id} spot {is_spot}: off by {one:.1e}, three texels wide by {three:.1e}");
                assert!(one < 0.02, "{id} spot {is_spot}: {one}");
                assert!(three > 0.1, "{id} spot {is_spot}: another width goes unnoticed");
            }
        }
    });
}
