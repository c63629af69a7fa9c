//! Classes of pixels, which decide where to search and filter, compared with the mirror of the classification.

use super::{pcss as pcss_tests, rbssm as rbssm_tests};
use crate::common::enlarged;
use crate::common::{Shot, assert_same_bits, desc, frame, prepare, renderer, shipped_scene, visibility, with_gpu};
use edgeshade::host::Host;
use edgeshade::reference::FrameData;
use edgeshade::reference::soft::pcss::{Class, ClassBy, Classified, MapClasses};
use edgeshade::reference::soft::{pcss, rbssm};
use edgeshade::scene::{RenderDesc, Renderer};

type Set = &'static [(&'static str, &'static str)];

/// Techniques that classify, each with both search windows.
const FORMS: [(&str, Set); 4] =
    [("pcss", &[]), ("pcss", &[("search", "near")]), ("rbssm", &[]), ("rbssm", &[("search", "near")])];

/// Returns the classes from the GPU.
fn drawn(host: &Host, r: &mut Renderer<'_>, id: &str, set: Set) -> Vec<Class> {
    let mut technique = prepare(r, id, set);
    r.frame(technique.as_mut()).unwrap();
    let images = technique.intermediates();
    let (_, image) = images.iter().find(|(name, _)| *name == "classes").unwrap();
    let class = |v: f32| match v {
        0.0 => Class::Umbra,
        1.0 => Class::Lit,
        0.5 => Class::Penumbra,
        _ => panic!("{id}: class {v}"),
    };
    host.read_values(image).unwrap().into_iter().map(class).collect()
}

fn mirrored(data: &FrameData<'_>, id: &str, set: Set, map: &MapClasses, by: ClassBy) -> Vec<Classified> {
    match id {
        "pcss" => pcss::classes(data, &pcss_tests::settings(set), map, by),
        _ => rbssm::classes(data, &rbssm_tests::settings(set), map, by),
    }
    .unwrap()
}

/// Counts the decided pixels whose class the mirror does not explain.
fn wrong(drawn: &[Class], mirror: &[Classified]) -> usize {
    assert_eq!(drawn.len(), mirror.len());
    drawn.iter().zip(mirror).filter(|(class, m)| **class != Class::Penumbra && !m.explains(**class)).count()
}

/// Counts the pixels that are open though the mirror decides them.
fn left_open(drawn: &[Class], mirror: &[Classified]) -> usize {
    drawn.iter().zip(mirror).filter(|(class, m)| **class == Class::Penumbra && !m.explains(Class::Penumbra)).count()
}

/// Returns a map whose cells hold a quarter of what they should: each level has the bounds of the finer one.
fn one_level_off(map: &MapClasses) -> MapClasses {
    let mut planted = map.clone();
    for l in 1..map.hsm.levels.len() {
        let finer = &map.hsm.levels[l - 1];
        let level = &mut planted.hsm.levels[l];
        for (i, bounds) in level.bounds.iter_mut().enumerate() {
            let at = [2 * (i % level.size[0]), 2 * (i / level.size[0])];
            *bounds = finer.bounds[at[1].min(finer.size[1] - 1) * finer.size[0] + at[0].min(finer.size[0] - 1)];
        }
    }
    planted
}

/// No pixel gets a class that the texels in its window contradict. The GPU looks at one window for 2 x 2 pixels, which may
/// leave pixels open that the bounds under their own windows decide: few of them.
#[test]
fn classes_are_those_of_the_mirror() {
    with_gpu(|host| {
        // Pixels, by form, that are noticed of a planted pyramid, of planted blocks, and of planted texels.
        let mut noticed = [[0; 3]; FORMS.len()];
        for (name, factor, map_size, normals) in
            [("robot", 4.0, 1024, true), ("courtyard", 6.0, 512, true), ("jenga", 3.0, 333, false)]
        {
            let scene = shipped_scene(name);
            let mut r =
                renderer(host, &scene, RenderDesc { normals, intermediates: true, ..desc([160, 90], map_size) });
            let light = enlarged(r.light(), factor);
            r.set_light(&scene, light);
            for ((id, set), noticed) in FORMS.into_iter().zip(&mut noticed) {
                let drawn = drawn(host, &mut r, id, set);
                let shot = Shot::of(host, &r, normals);
                let data = shot.data();
                let map = MapClasses::new(&shot.map, [map_size; 2]);
                let mirror = mirrored(&data, id, set, &map, ClassBy::Bounds);
                let what = format!("{id} {name} {map_size} {set:?}");
                let count = |class| drawn.iter().filter(|c| **c == class).count();
                let counts = [Class::Umbra, Class::Lit, Class::Penumbra].map(count);
                let ties = mirror.iter().filter(|m| m.is_doubtful()).count();
                let other = drawn.iter().zip(&mirror).filter(|(c, m)| **c != m.likely).count();
                println!("{what:42} in shadow, lit, open: {counts:?}; {ties} ties, {other} of them the other way");
                assert!(counts.iter().all(|n| *n > 100), "{what}: {counts:?}");
                let open = left_open(&drawn, &mirror);
                let by_texels = |data: &FrameData<'_>| mirrored(data, id, set, &map, ClassBy::Texels);
                println!("{what:42} left open by their quads: {open}");
                assert_eq!(wrong(&drawn, &by_texels(&data)), 0, "{what}");
                assert!(open * 25 < drawn.len(), "{what}: {open} left open");
                assert!(ties * 50 < drawn.len(), "{what}: {ties} ties");

                let more_open = |map: &MapClasses| {
                    left_open(&drawn, &mirrored(&data, id, set, map, ClassBy::Bounds)).saturating_sub(open)
                };
                noticed[0] += more_open(&one_level_off(&map));
                let mut flat = map.clone();
                for bounds in flat.blocks.iter_mut().flat_map(|level| &mut level.bounds) {
                    bounds.high = bounds.low;
                }
                noticed[1] += more_open(&flat);
                // One texel in a hundred at the near plane.
                let mut dotted = shot.map.clone();
                dotted.iter_mut().step_by(101).for_each(|depth| *depth = 0.0);
                noticed[2] += wrong(&drawn, &by_texels(&FrameData { shadow_map: &dotted, ..data }));
            }
        }
        println!(
            "noticed of a pyramid one level off, of blocks without depth, and of single texels, by form: {noticed:?}"
        );
        assert!(noticed.iter().flatten().all(|n| *n > 20), "{noticed:?}");
    });
}

/// Bounds over whole tiles decide many of them without a receiver of every pixel, and no image changes. The scenes have flat
/// and curved surfaces, under a sun and under a spot light.
#[test]
fn whole_tiles_are_decided_and_no_image_changes() {
    let forms: [(&str, Set); 7] = [
        ("pcss", &[]),
        ("pcss", &[("search", "near"), ("receiver", "fixed"), ("depth_bias", "2")]),
        ("rbssm", &[]),
        ("rbssm", &[("receiver", "fixed"), ("normal_offset", "1"), ("depth_bias", "2")]),
        ("soft-auto", &[]),
        ("ssrbssm", &[]),
        ("ssabss", &[("search", "near")]),
    ];
    with_gpu(|host| {
        for name in ["robot", "knot", "jenga"] {
            let scene = shipped_scene(name);
            // Some tiles are cut off by the image's border.
            let mut r = renderer(host, &scene, desc([484, 276], 1024));
            for factor in [1.0, 4.0] {
                let light = enlarged(r.light(), factor);
                r.set_light(&scene, light);
                for (id, set) in forms {
                    let what = format!("{id} {name} {set:?}, light x {factor}");
                    let off = visibility(&mut r, id, &[set, &[("skip", "off")]].concat());
                    for skip in ["quads", "tiles"] {
                        let (on, timing) = frame(&mut r, id, &[set, &[("skip", skip)]].concat());
                        let what = format!("{what}, {skip}");
                        assert_same_bits(&off, &on, &what);
                        let open = timing.passes.iter().find_map(|p| p.tiles).unwrap();
                        println!("{what:76} open: {} of {} tiles", open.active, open.total);
                        // Other forms have wide windows, or compare with the depths of tilted receivers.
                        let most = if factor > 1.0 || !set.is_empty() { 0.99 } else { 0.65 };
                        assert!(open.active > 0 && f64::from(open.active) < most * f64::from(open.total), "{what}");
                    }
                }
                r.set_light(&scene, enlarged(r.light(), 1.0 / factor));
            }
        }
    });
}

/// Lists shorter than what one workgroup takes lose no pixel: images of at most 15 tiles.
#[test]
fn short_lists_lose_no_pixel() {
    with_gpu(|host| {
        let scene = shipped_scene("jenga");
        for size in [[8, 8], [24, 16], [40, 24]] {
            let mut r = renderer(host, &scene, desc(size, 1024));
            for id in ["pcss", "rbssm", "soft-auto", "ssrbssm", "ssabss"] {
                let off = visibility(&mut r, id, &[("skip", "off")]);
                for skip in ["quads", "tiles"] {
                    let (on, timing) = frame(&mut r, id, &[("skip", skip)]);
                    let what = format!("{id} {size:?} {skip}");
                    assert_same_bits(&off, &on, &what);
                    let listed = timing.passes.iter().filter_map(|p| p.tiles).any(|t| t.active > 0);
                    assert!(listed, "{what}: nothing is listed");
                }
            }
        }
    });
}
