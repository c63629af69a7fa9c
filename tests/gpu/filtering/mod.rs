//! Shadow mapping and percentage-closer filtering equal their mirrors in `f64`, pixel by pixel.

mod bounds;
mod moments;
pub mod summed_area;

use crate::common::{
    Shot, assert_same_bits, differing, every_nth, every_shipped, frame, shipped_scene, visibility, with_gpu,
};
use crate::mirrors::{compare, default_of, lit_renderer};
use edgeshade::reference::Mirror;
use edgeshade::reference::filtering::pcf::Settings;
use edgeshade::reference::filtering::{pcf, sm};
use edgeshade::technique::{Params, find};

const SIZE: [u32; 2] = [256, 144];

fn mirror_sm(shot: &Shot) -> Mirror {
    sm::visibility(&shot.data(), default_of("sm", "normal_offset"), default_of("sm", "depth_bias")).unwrap()
}

fn pcf_settings(width: u32) -> Settings {
    let normal_offset = default_of("pcf", "normal_offset");
    let depth_bias = default_of("pcf", "depth_bias");
    Settings { width, nearest: false, fixed_depth: false, normal_offset, depth_bias }
}

#[test]
fn sm_equals_its_mirror() {
    with_gpu(|host| {
        for scene in every_shipped() {
            for (map_size, normals) in [(1024, true), (333, true), (1024, false)] {
                let mut renderer = lit_renderer(host, &scene, SIZE, map_size, normals);
                let gpu = visibility(&mut renderer, "sm", &[]);
                let mirror = mirror_sm(&Shot::of(host, &renderer, normals));
                let from = if normals { "normals" } else { "depth" };
                let what = format!("sm {} {map_size} {from}", scene.name);
                compare(&gpu, &mirror, 0.5).check(&what, if normals { 0.003 } else { 0.02 });
                // An empty picture would agree as well, so check that this one is not.
                let lit = gpu.iter().filter(|v| **v == 1.0).count();
                assert!(lit > gpu.len() / 10 && lit < gpu.len() * 97 / 100, "{what}: {lit} pixels lit");
            }
        }
    });
}

#[test]
fn pcf_equals_its_mirror_in_both_fetch_modes() {
    with_gpu(|host| {
        for (i, scene) in every_nth(2, every_shipped().enumerate()) {
            let cases: &[(u32, [u32; 2], u32, bool)] = &[
                (1, SIZE, 1024, true),
                (3, SIZE, 1024, true),
                (7, SIZE, 333, true),
                (15, SIZE, 1024, true),
                (63, [96, 54], 1024, true),
                (3, SIZE, 1024, false),
                (15, SIZE, 333, false),
            ];
            for &(width, size, map_size, normals) in cases {
                if width == 63 && i % 3 != 0 {
                    continue;
                }
                let mut renderer = lit_renderer(host, &scene, size, map_size, normals);
                let w = width.to_string();
                let mut run =
                    |fetch, skip| visibility(&mut renderer, "pcf", &[("width", &w), ("fetch", fetch), ("skip", skip)]);
                let gather = run("gather", "off");
                let one_by_one = run("loop", "off");
                let mirror = pcf::visibility(&Shot::of(host, &renderer, normals).data(), &pcf_settings(width)).unwrap();
                let from = if normals { "normals" } else { "depth" };
                let what = format!("pcf {} w{width} {map_size} {from}", scene.name);
                // Each of a wide kernel's many taps may cause a tie; few of them make a difference.
                let most_ties: f64 = match width {
                    0..=3 => 0.005,
                    4..=7 => 0.02,
                    _ => 0.3,
                };
                let most_ties = if normals { most_ties } else { most_ties.max(0.05) };
                compare(&gather, &mirror, 1e-4).check(&format!("{what} gather"), most_ties);
                compare(&one_by_one, &mirror, 1e-4).check(&format!("{what} loop"), most_ties);
                // The sums are formed in another order and are equal up to their rounding.
                let bits = differing(&gather, &one_by_one, 0.0);
                println!("{what}: {bits} pixels differ in a bit between loop and gather");
                assert_eq!(differing(&gather, &one_by_one, 1e-6), 0, "{what}: loop and gather differ");
            }
        }
    });
}

/// Single texels and a fixed depth, together as in the paper and each alone, with all ways to skip.
#[test]
fn the_published_form_of_pcf_equals_its_mirror() {
    with_gpu(|host| {
        for scene in every_nth(2, every_shipped()) {
            for (width, map_size) in [(3u32, 1024), (15, 333)] {
                let mut renderer = lit_renderer(host, &scene, SIZE, map_size, true);
                let w = width.to_string();
                for (taps, receiver) in [("nearest", "fixed"), ("nearest", "plane"), ("bilinear", "fixed")] {
                    let form = [("preset", "published"), ("width", &w[..]), ("taps", taps), ("receiver", receiver)];
                    let off = visibility(&mut renderer, "pcf", &[&form[..], &[("skip", "off")]].concat());
                    let shot = Shot::of(host, &renderer, true);
                    let (nearest, fixed_depth) = (taps == "nearest", receiver == "fixed");
                    let p = Params::published(find("pcf").unwrap()).unwrap();
                    let [normal_offset, depth_bias] = ["normal_offset", "depth_bias"].map(|name| p.float(name));
                    let settings = Settings { width, nearest, fixed_depth, normal_offset, depth_bias };
                    let mirror = |s: &Settings| pcf::visibility(&shot.data(), s).unwrap();
                    let what = format!("pcf {} w{width} {map_size} {taps} {receiver}", scene.name);
                    compare(&off, &mirror(&settings), 1e-4).check(&what, if width > 3 { 0.3 } else { 0.03 });
                    let pixels = visibility(&mut renderer, "pcf", &[&form[..], &[("skip", "pixels")]].concat());
                    assert_same_bits(&off, &pixels, &format!("{what}, pixels"));
                    let (tiles, timing) = frame(&mut renderer, "pcf", &[&form[..], &[("skip", "tiles")]].concat());
                    assert_same_bits(&off, &tiles, &format!("{what}, tiles"));
                    let tiles = timing.passes.iter().find_map(|p| p.tiles).unwrap();
                    let listed = pcf::listed(&shot.data(), &settings).unwrap();
                    assert!((listed.least..=tiles.total).contains(&tiles.active), "{what}: {tiles:?}, {listed:?}");
                    // The other forms give other images.
                    for other in
                        [Settings { nearest: !nearest, ..settings }, Settings { fixed_depth: !fixed_depth, ..settings }]
                    {
                        let wrong = compare(&off, &mirror(&other), 1e-4).wrong;
                        assert!(wrong > 10, "{what}: {other:?} goes unnoticed, {wrong} pixels");
                    }
                }
            }
        }
    });
}

/// Skipping changes no bit. Bounds over whole tiles leave all tiles in which some pixel's own bounds leave it open, and at most
/// half as many again.
#[test]
fn skipping_changes_nothing() {
    with_gpu(|host| {
        let cases: &[(u32, [u32; 2], u32, bool)] = &[
            (1, SIZE, 1024, true),
            (3, SIZE, 64, true),
            (7, SIZE, 100, true),
            (15, SIZE, 333, true),
            (15, SIZE, 1024, false),
            (31, SIZE, 1024, true),
            (63, [96, 54], 1024, true),
            (63, [96, 54], 100, true),
        ];
        let (mut active, mut most, mut total) = (0, 0, 0);
        for scene in every_nth(2, every_shipped()) {
            for &(width, size, map_size, normals) in cases {
                let mut renderer = lit_renderer(host, &scene, size, map_size, normals);
                let w = width.to_string();
                let off = visibility(&mut renderer, "pcf", &[("width", &w), ("skip", "off")]);
                let pixels = visibility(&mut renderer, "pcf", &[("width", &w), ("skip", "pixels")]);
                let (tiles, timing) = frame(&mut renderer, "pcf", &[("width", &w), ("skip", "tiles")]);
                let what = format!("pcf {} w{width} {map_size} at {size:?}", scene.name);
                assert_same_bits(&off, &pixels, &format!("{what}, pixels"));
                assert_same_bits(&off, &tiles, &format!("{what}, tiles"));
                let tiles = timing.passes.iter().find_map(|p| p.tiles).unwrap();
                assert_eq!(tiles.total, size[0].div_ceil(8) * size[1].div_ceil(8), "{what}");
                let listed = pcf::listed(&Shot::of(host, &renderer, normals).data(), &pcf_settings(width)).unwrap();
                let expected = listed.least..=tiles.total;
                assert!(expected.contains(&tiles.active), "{what}: {} tiles, expected {expected:?}", tiles.active);
                (active, most, total) = (active + tiles.active, most + listed.most, total + tiles.total);
            }
        }
        println!("tiles filtered: {active} of {total}; with open pixels: {most}");
        assert!(active < total && 2 * active < 3 * most, "{active} of {total} tiles, {most} with open pixels");
    });
}

/// The comparisons can fail.
#[test]
fn planted_differences_are_found() {
    with_gpu(|host| {
        let scene = shipped_scene("jenga");
        let mut renderer = lit_renderer(host, &scene, SIZE, 1024, true);
        let hard = visibility(&mut renderer, "sm", &[]);
        let soft = visibility(&mut renderer, "pcf", &[]);
        let shot = Shot::of(host, &renderer, true);
        let sure = |m: &Mirror| (0..m.doubt.len()).position(|i| m.doubt[i] == 0.0 && m.visibility[i] == 1.0).unwrap();

        let mirror = mirror_sm(&shot);
        let mut planted = hard.clone();
        planted[sure(&mirror)] = 0.0;
        assert_eq!(compare(&planted, &mirror, 0.5).wrong, 1);

        let mirror = pcf::visibility(&shot.data(), &pcf_settings(3)).unwrap();
        let (mut planted, at) = (soft.clone(), sure(&mirror));
        planted[at] -= 2e-4;
        assert_eq!(compare(&planted, &mirror, 1e-4).wrong, 1);
        planted[at] = f32::NAN;
        assert_eq!(compare(&planted, &mirror, 1e-4).wrong, 1);

        // Some texels of the map differ from what the GPU saw.
        let mut other = Shot { map: shot.map.clone(), depth: shot.depth.clone(), normal: shot.normal.clone(), ..shot };
        let middle = 512 * 1024 + 512;
        other.map[middle..middle + 64].fill(0.0);
        assert!(compare(&soft, &pcf::visibility(&other.data(), &pcf_settings(3)).unwrap(), 1e-4).wrong > 0);
        assert!(compare(&hard, &mirror_sm(&other), 0.5).wrong > 0);

        // Another kernel, and another bias.
        other.map[middle..middle + 64].copy_from_slice(&shot.map[middle..middle + 64]);
        assert!(compare(&soft, &pcf::visibility(&other.data(), &pcf_settings(5)).unwrap(), 1e-4).wrong > 100);
        assert!(compare(&hard, &sm::visibility(&other.data(), 1.5, 0.5).unwrap(), 0.5).wrong > 100);

        // Too few values are rejected.
        other.map.pop();
        assert!(sm::visibility(&other.data(), 0.0, 0.0).unwrap_err().to_string().contains("shadow map"));
    });
}
