//! The RBSM family equals its mirror in `f64`, pixel by pixel.

use crate::common::{
    Shot, assert_same_bits, desc, every_nth, every_shipped, is_full_sweep, prepare, renderer, shipped_scene,
    visibility, with_gpu,
};
use crate::mirrors::{Agreement, compare, default_of, lit_renderer};
use edgeshade::reference::Mirror;
use edgeshade::reference::revectorization::rbsm::{self, Settings};
use edgeshade::reference::revectorization::revectorize::{Function, Quality};
use edgeshade::reference::revectorization::rpcf;
use edgeshade::scene::RenderDesc;

const SIZE: [u32; 2] = [256, 144];

/// Technique id, settings, and the technique's function.
type Member = (&'static str, &'static [(&'static str, &'static str)], Function);

/// Every function of the family, with its technique.
pub const FUNCTIONS: &[Member] = &[
    ("rbsm", &[], Function::Silhouette),
    ("rbsm-filtered", &[("shapes", "printed")], Function::Filtered),
    ("rbsm-star", &[], Function::Star),
    ("rbsm-profile", &[("quality", "run")], Function::Profile(Quality::Run)),
    ("rbsm-profile", &[("quality", "neighbours")], Function::Profile(Quality::Neighbours)),
    ("rbsm-profile", &[("quality", "line")], Function::Profile(Quality::Line)),
];

/// Ramps across the same edges.
const RAMPS: &[Member] = &[
    ("rbsm-filtered", &[], Function::Ramp),
    ("rbsm-profile", &[("filter", "ramp")], Function::ProfileRamp(Quality::Run, 0.5)),
    (
        "rbsm-profile",
        &[("filter", "ramp"), ("filter_width", "1"), ("quality", "line")],
        Function::ProfileRamp(Quality::Line, 1.0),
    ),
];

fn family() -> impl Iterator<Item = &'static Member> + Clone {
    FUNCTIONS.iter().chain(RAMPS)
}

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

/// Returns the tolerance: rounding for a ramp, almost none for a binary result.
pub fn tolerance(function: Function) -> f64 {
    if function.slope() > 0.0 { 1e-4 } else { 1e-6 }
}

fn agreement(gpu: &[f32], mirror: &Mirror, function: Function) -> Agreement {
    compare(gpu, mirror, tolerance(function))
}

#[test]
fn the_family_equals_its_mirrors() {
    with_gpu(|host| {
        // Each distance and receiver needs its own pipelines, and compiling them takes most of the time.
        let cases: &[(u32, bool, bool, u32)] =
            &[(512, true, false, 16), (333, false, false, 16), (512, true, true, 64), (100, true, false, 1)];
        for (i, scene) in every_shipped().enumerate().take(if is_full_sweep() { usize::MAX } else { cases.len() }) {
            for (k, &(map_size, normals, fixed, max_distance)) in cases.iter().enumerate() {
                // Every case runs on every fourth scene, and every scene runs some.
                if (i + k) % 4 != 0 {
                    continue;
                }
                let mut renderer = lit_renderer(host, &scene, SIZE, map_size, normals);
                for &(id, params, function) in family() {
                    let distance = max_distance.to_string();
                    let receiver = if fixed { "fixed" } else { "plane" };
                    let mut all = vec![("receiver", receiver), ("max_distance", &distance)];
                    all.extend(params);
                    let mut run = |skip| visibility(&mut renderer, id, &[&all[..], &[("skip", skip)]].concat());
                    let [off, list, tiles] = ["off", "list", "tiles"].map(&mut run);
                    let what = format!("{id} {params:?} {} {map_size} {receiver} M {max_distance}", scene.name);
                    assert_same_bits(&off, &list, &format!("{what}, list"));
                    assert_same_bits(&off, &tiles, &format!("{what}, tiles"));
                    let shot = Shot::of(host, &renderer, normals);
                    let mirror = rbsm::visibility(&shot.data(), &settings(function, fixed, max_distance)).unwrap();
                    // A choice that rounding decides moves an edge. A hard edge then changes the pixels that it passes
                    // over, a ramp all pixels within its width, each by less.
                    let most_ties = if normals { 0.01 } else { 0.05 };
                    let doubt = mirror.doubt.iter().sum::<f64>() / mirror.doubt.len() as f64;
                    println!("mean doubt {:.3} %", 100.0 * doubt);
                    assert!(doubt <= most_ties, "{what}: {doubt}");
                    let is_wide = matches!(function, Function::ProfileRamp(_, width) if width > 0.5);
                    agreement(&off, &mirror, function).check(&what, if is_wide { 2.0 * most_ties } else { most_ties });
                }
            }
        }
    });
}

/// The comparison can fail.
#[test]
fn planted_differences_are_found() {
    with_gpu(|host| {
        // Texels large enough in the picture for the last quality to matter.
        let scene = shipped_scene("robot");
        let mut renderer = lit_renderer(host, &scene, SIZE, 128, true);
        let shot = |r: &_| Shot::of(host, r, true);
        let sure = |m: &Mirror| (0..m.doubt.len()).position(|i| m.doubt[i] == 0.0 && m.visibility[i] == 1.0).unwrap();
        for &(id, params, function) in family() {
            let gpu = visibility(&mut renderer, id, params);
            let mirror = |f, fixed, m| rbsm::visibility(&shot(&renderer).data(), &settings(f, fixed, m)).unwrap();
            let right = mirror(function, false, 16);
            assert_eq!(agreement(&gpu, &right, function).wrong, 0);
            let mut planted = gpu.clone();
            planted[sure(&right)] -= 3e-4;
            assert_eq!(agreement(&planted, &right, function).wrong, 1);
            planted[sure(&right)] = f32::NAN;
            assert_eq!(agreement(&planted, &right, function).wrong, 1);
            // Another function, a shorter reach, and the fixed depth.
            for &(other, other_params, f) in family() {
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

pub const FILTERED: &[(&str, Function)] = &[
    ("filtered", Function::Ramp),
    ("star", Function::Star),
    ("profile", Function::Profile(Quality::Run)),
    ("printed", Function::Filtered),
];

/// The passes share tests and runs between samples; the mirror computes every sample separately.
#[test]
fn rpcf_equals_its_mirror() {
    with_gpu(|host| {
        let size = [160, 90];
        let cases: &[(u32, u32, bool, u32)] = &[(3, 512, false, 16), (7, 333, true, 64), (7, 100, false, 16)];
        for (i, scene) in every_nth(2, every_shipped().enumerate()) {
            for (k, &(width, map_size, fixed, max_distance)) in cases.iter().enumerate() {
                if (i + k) % 3 != 0 {
                    continue;
                }
                check_rpcf(host, &scene, (size, width, map_size, fixed, max_distance));
            }
        }
        // The widest kernel, whose ring needs one bit more than a word has.
        check_rpcf(host, &shipped_scene("fence"), ([64, 36], 31, 512, false, 16));
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
        let (off, list) = (run("off"), run("list"));
        let what = format!("rpcf {word} {} w{width} {map_size} {receiver} M {max_distance}", scene.name);
        assert_same_bits(&off, &list, &format!("{what}, list"));
        assert_same_bits(&off, &run("quads"), &format!("{what}, quads"));
        let shot = Shot::of(host, &renderer, true);
        let mirror = |w| rpcf::visibility(&shot.data(), &settings(*function, fixed, max_distance), w).unwrap();
        compare(&off, &mirror(width), 1e-4).check(&what, if width < 7 { 0.03 } else { 0.3 });
        // The comparison can fail: use the mean over another width.
        assert!(compare(&off, &mirror(width + 2), 1e-4).wrong > 20, "{what}: another width goes unnoticed");
    }
}

/// The images of intermediate results.
#[test]
fn intermediates_equal_their_mirror() {
    with_gpu(|host| {
        let scene = shipped_scene("robot");
        for (quality, word) in [(Quality::Run, "run"), (Quality::Neighbours, "neighbours"), (Quality::Line, "line")] {
            let desc = RenderDesc { intermediates: true, ..desc(SIZE, 333) };
            let mut renderer = renderer(host, &scene, desc);
            let mut technique = prepare(&renderer, "rbsm-profile", &[("quality", word)]);
            renderer.frame(technique.as_mut()).unwrap();
            let images: Vec<_> = technique.intermediates();
            assert_eq!(
                images.iter().map(|i| i.0).collect::<Vec<_>>(),
                ["discontinuity", "runs", "ends", "profile-height"]
            );
            let [d, runs, ends, height] =
                [0, 1, 2, 3].map(|i: usize| host.read_image::<[f32; 4]>(images[i].1).unwrap());
            let shot = Shot::of(host, &renderer, true);
            let settings = settings(Function::Profile(quality), false, 16);
            let mirror = rbsm::intermediates(&shot.data(), &settings, quality).unwrap();
            let wrong = |height: &[[f32; 4]]| {
                (0..mirror.len())
                    .filter(|&i| {
                        let m = &mirror[i];
                        let same = (0..3).all(|k| f64::from(d[i][k]) == m.discontinuity[k])
                            && (0..4).all(|k| f64::from(runs[i][k] * ends[i][k]) == m.traversal[k])
                            && (0..4).all(|k| (f64::from(height[i][k]) - m.height[k]).abs() <= 1e-4);
                        m.sure && !same
                    })
                    .count()
            };
            let unsure = mirror.iter().filter(|m| !m.sure).count();
            println!("intermediates {word}: {} wrong, {unsure} of {} unsure", wrong(&height), mirror.len());
            assert_eq!(wrong(&height), 0, "{word}");
            assert!(unsure * 50 < mirror.len(), "{word}: {unsure} unsure");
            // The comparison can fail, and the image is not empty.
            let boundary: Vec<_> =
                (0..mirror.len()).filter(|&i| mirror[i].height != [0.0; 4] && mirror[i].sure).collect();
            assert!(boundary.len() > 200, "{word}: {} pixels at discontinuities", boundary.len());
            let mut planted = height.clone();
            planted[boundary[0]][0] += 1e-3;
            assert_eq!(wrong(&planted), 1, "{word}: a planted difference goes unnoticed");
        }
        // Without a request, no intermediates are made.
        let r = renderer(host, &scene, desc(SIZE, 64));
        assert!(prepare(&r, "rbsm", &[]).intermediates().is_empty());
    });
}
