//! The RBSM family against its mirror in `f64`, pixel by pixel.

use crate::common::{Shot, assert_same_bits, every_shipped, shipped_scene, visibility, with_gpu};
use crate::mirrors::{Agreement, compare, default_of, lit_renderer};
use edgeshade::reference::rbsm::{self, Settings};
use edgeshade::reference::revectorize::{Function, Quality};
use edgeshade::reference::{Mirror, rpcf};

const SIZE: [u32; 2] = [256, 144];

type Member = (&'static str, &'static [(&'static str, &'static str)], Function);

/// Every function of the family, with the technique that is it.
pub const FUNCTIONS: &[Member] = &[
    ("rbsm", &[], Function::Silhouette),
    ("rbsm-filtered", &[], Function::Filtered),
    ("rbsm-star", &[], Function::Star),
    ("rbsm-profile", &[("quality", "run")], Function::Profile(Quality::Run)),
    ("rbsm-profile", &[("quality", "neighbours")], Function::Profile(Quality::Neighbours)),
    ("rbsm-profile", &[("quality", "line")], Function::Profile(Quality::Line)),
];

pub fn settings(function: Function, fixed_depth: bool, max_distance: u32) -> Settings {
    Settings {
        function,
        fixed_depth,
        max_distance,
        normal_offset: default_of("rbsm", "normal_offset"),
        depth_bias: default_of("rbsm", "depth_bias"),
        slack: default_of("rbsm", "slack"),
    }
}

/// A ramp may be off by rounding; a binary result by nothing.
pub fn tolerance(function: Function) -> f64 {
    if function == Function::Filtered { 1e-4 } else { 1e-6 }
}

fn agreement(gpu: &[f32], mirror: &Mirror, function: Function) -> Agreement {
    compare(gpu, mirror, tolerance(function))
}

#[test]
fn the_family_equals_its_mirrors() {
    with_gpu(|host| {
        let cases: &[(u32, bool, bool, u32)] = &[
            (512, true, false, 16),
            (333, true, false, 64),
            (1024, false, false, 16),
            (512, true, true, 16),
            (100, true, false, 1),
        ];
        for (i, scene) in every_shipped().enumerate() {
            for (k, &(map_size, normals, fixed, max_distance)) in cases.iter().enumerate() {
                // Every case on every other scene.
                if (i + k) % 2 == 1 {
                    continue;
                }
                let mut renderer = lit_renderer(host, &scene, SIZE, map_size, normals);
                for &(id, params, function) in FUNCTIONS {
                    let distance = max_distance.to_string();
                    let receiver = if fixed { "fixed" } else { "plane" };
                    let mut all = vec![("receiver", receiver), ("max_distance", &distance)];
                    all.extend(params);
                    let mut run = |skip| visibility(&mut renderer, id, &[&all[..], &[("skip", skip)]].concat());
                    let (off, list) = (run("off"), run("list"));
                    let what = format!("{id} {params:?} {} {map_size} {receiver} M {max_distance}", scene.name);
                    assert_same_bits(&off, &list, &what);
                    let shot = Shot::of(host, &renderer, normals);
                    let mirror = rbsm::visibility(&shot.data(), &settings(function, fixed, max_distance)).unwrap();
                    let most_ties = if normals { 0.01 } else { 0.05 };
                    agreement(&off, &mirror, function).check(&what, most_ties);
                }
            }
        }
    });
}

/// The comparison is worth something only if it can fail.
#[test]
fn planted_differences_are_found() {
    with_gpu(|host| {
        // Texels large enough in the picture for the last quality to show.
        let scene = shipped_scene("robot");
        let mut renderer = lit_renderer(host, &scene, SIZE, 128, true);
        let shot = |r: &_| Shot::of(host, r, true);
        let sure = |m: &Mirror| (0..m.doubt.len()).position(|i| m.doubt[i] == 0.0 && m.visibility[i] == 1.0).unwrap();
        for &(id, params, function) in FUNCTIONS {
            let gpu = visibility(&mut renderer, id, params);
            let mirror = |f, fixed, m| rbsm::visibility(&shot(&renderer).data(), &settings(f, fixed, m)).unwrap();
            let right = mirror(function, false, 16);
            assert_eq!(agreement(&gpu, &right, function).wrong, 0);
            let mut planted = gpu.clone();
            planted[sure(&right)] -= 3e-4;
            assert_eq!(agreement(&planted, &right, function).wrong, 1);
            planted[sure(&right)] = f32::NAN;
            assert_eq!(agreement(&planted, &right, function).wrong, 1);
            // Another function, a shorter reach, the fixed depth.
            for &(other, other_params, f) in FUNCTIONS {
                let wrong = agreement(&gpu, &mirror(f, false, 16), function).wrong;
                let same = f == function;
                println!("{id} {params:?} against {other} {other_params:?}: {wrong} wrong");
                assert!(same == (wrong == 0), "{id} {params:?} against {other} {other_params:?}: {wrong}");
            }
            assert!(agreement(&gpu, &mirror(function, false, 1), function).wrong > 20, "{id}");
            assert!(agreement(&gpu, &mirror(function, true, 16), function).wrong > 20, "{id}");
        }
    });
}

pub const FILTERED: &[(&str, Function)] =
    &[("filtered", Function::Filtered), ("star", Function::Star), ("profile", Function::Profile(Quality::Run))];

/// The passes share tests and runs between samples; the mirror takes each sample for itself.
#[test]
fn rpcf_equals_its_mirror() {
    with_gpu(|host| {
        let size = [160, 90];
        let cases: &[(u32, u32, bool, u32)] = &[
            (1, 333, false, 16),
            (3, 512, false, 16),
            (7, 100, false, 16),
            (7, 512, false, 1),
            (7, 333, true, 64),
            (15, 333, false, 16),
        ];
        for (i, scene) in every_shipped().enumerate() {
            for (k, &(width, map_size, fixed, max_distance)) in cases.iter().enumerate() {
                if (i + k) % 3 != 0 {
                    continue;
                }
                check_rpcf(host, &scene, (size, width, map_size, fixed, max_distance));
            }
        }
        // The widest, whose ring needs a bit more than a word has.
        check_rpcf(host, &shipped_scene("fence"), ([64, 36], 31, 512, false, 16));
        check_rpcf(host, &shipped_scene("fence"), ([64, 36], 29, 512, false, 16));
    });
}

fn check_rpcf(
    host: &edgeshade::host::Host,
    scene: &edgeshade::scene::Scene,
    (size, width, map_size, fixed, max_distance): ([u32; 2], u32, u32, bool, u32),
) {
    let mut renderer = lit_renderer(host, scene, size, map_size, true);
    for (word, function) in FILTERED {
        let (w, m) = (width.to_string(), max_distance.to_string());
        let receiver = if fixed { "fixed" } else { "plane" };
        let all = [("visibility", *word), ("width", &w), ("receiver", receiver), ("max_distance", &m)];
        let mut run = |skip| visibility(&mut renderer, "rpcf", &[&all[..], &[("skip", skip)]].concat());
        let (off, pixels) = (run("off"), run("pixels"));
        let what = format!("rpcf {word} {} w{width} {map_size} {receiver} M {max_distance}", scene.name);
        assert_same_bits(&off, &pixels, &what);
        let shot = Shot::of(host, &renderer, true);
        let mirror = |w| rpcf::visibility(&shot.data(), &settings(*function, fixed, max_distance), w).unwrap();
        compare(&off, &mirror(width), 1e-4).check(&what, if width < 7 { 0.03 } else { 0.3 });
        // It can fail: the mean over another width.
        assert!(compare(&off, &mirror(width + 2), 1e-4).wrong > 20, "{what}: another width goes unnoticed");
    }
}
