//! Maps that end before the scene does, and maps of a few texels. Outside them everything is lit, and their texels are
//! farther than everything.

use crate::common::{Shot, assert_in_range, desc, every_nth, renderer, visibility, with_gpu};
use crate::made::{self, cuboid, moved, perspective, plane, spot};
use crate::mirrors::compare;
use crate::properties::hits;
use crate::revectorization::flat::{Flat, Window, expected, expected_of};
use crate::revectorization::revectorize::{FILTERED, FUNCTIONS, settings, tolerance};
use edgeshade::reference::revectorization::rbsm::{self, Settings};
use edgeshade::reference::revectorization::revectorize::Function;
use edgeshade::reference::revectorization::rpcf;
use glam::{DAffine3, DVec3, dvec3};

/// Technique, its settings, its visibility function, and the width of its average.
type Mode = (&'static str, Vec<(&'static str, &'static str)>, Function, u32);
type Pattern = (&'static str, fn([i64; 2]) -> bool);

fn modes() -> Vec<Mode> {
    let single = FUNCTIONS.iter().map(|&(id, params, function)| (id, params.to_vec(), function, 1));
    let mean = FILTERED.iter().map(|&(word, f)| ("rpcf", vec![("visibility", word), ("width", "5")], f, 5));
    single.chain(mean).collect()
}

/// Patterns of texels with names.
const PATTERNS: [Pattern; 4] = [
    ("lit", |_| true),
    ("dark", |_| false),
    ("chess", |[x, y]| (x + y) % 2 == 0),
    // A dark bar with a step, which crosses every border.
    ("bar", |[x, y]| y > x / 2 + 1 || y < x / 2 - 1),
];

#[test]
fn maps_of_a_few_texels_end_in_light() {
    with_gpu(|host| {
        let mut ties = 0;
        // Pixels that would be wrong if texels outside the map were in shadow.
        let mut noticed = vec![0; modes().len()];
        for map in every_nth(2, [[1, 1], [2, 2], [3, 5], [9, 1]]) {
            let texels = map.map(|n| n + 4);
            let w = Window { map, first: [-2; 2], texels, zoom: 4, rise: [0.5, -0.2] };
            for (name, lit) in PATTERNS {
                let flat = Flat::new(host, w, &lit);
                for (max_distance, text) in [(1, "1"), (64, "64")] {
                    for (k, (id, params, function, width)) in modes().into_iter().enumerate() {
                        let what = format!("{id} {params:?} M {text}, map {map:?}, {name}");
                        let gpu = flat.visibility(host, id, &[&params[..], &[("max_distance", text)]].concat());
                        assert_in_range(&gpu, &what);
                        let says = expected(&w, &lit, function, max_distance, width);
                        assert_eq!(says.wrong(&gpu), 0, "{what}");
                        ties += says.ties();
                        let settings = Settings { normal_offset: 0.0, ..settings(function, false, max_distance) };
                        let mirror = match width {
                            1 => rbsm::visibility(&flat.data(), &settings),
                            _ => rpcf::visibility(&flat.data(), &settings, width),
                        };
                        let tolerance = if width == 1 { tolerance(function) } else { 1e-4 };
                        assert_eq!(compare(&gpu, &mirror.unwrap(), tolerance).wrong, 0, "{what}");
                        if name == "lit" {
                            assert!(gpu.iter().all(|v| *v == 1.0), "{what}");
                        }
                        let inside = |t: [i64; 2]| (0..2).all(|k| (0..i64::from(map[k])).contains(&t[k]));
                        let dark = |t: [i64; 2]| inside(t) && lit(t);
                        noticed[k] += expected_of(&w, &dark, function, max_distance, width).wrong(&gpu);
                    }
                }
            }
        }
        println!("{ties} ties; pixels that tell dark texels outside the map from lit ones: {noticed:?}");
        assert!(noticed.iter().all(|n| *n > 50), "{noticed:?}");
    });
}

/// A lamp with a small cone lights the part of the scene that its map covers; the rest counts as lit.
#[test]
fn a_shadow_that_crosses_the_maps_border_ends_there() {
    with_gpu(|host| {
        let (size, map_size) = ([200, 150], 64);
        let light = spot(dvec3(2.0, 12.0, 1.0), DVec3::ZERO, 0.12);
        // A beam across the cone, rotated relative to the map, and a block in one corner.
        let turn = DAffine3::from_rotation_y(0.3) * moved(dvec3(0.2, 1.5, 0.1));
        let parts = vec![
            (plane(5.0), DAffine3::IDENTITY),
            (cuboid(dvec3(4.0, 0.1, 0.25)), turn),
            (cuboid(dvec3(0.5, 0.2, 0.5)), moved(dvec3(1.3, 0.8, -1.0))),
        ];
        let camera = perspective(dvec3(0.0, 6.0, 2.0), DVec3::ZERO, 0.1);
        let scene = made::scene(parts, camera, light);
        let mut r = renderer(host, &scene, desc(size, map_size));
        let light = *r.light();
        // Distance from the map's border, texels; positive inside. Only for the ground.
        let depths: Vec<Option<f64>> = hits(&scene, &r, size)
            .into_iter()
            .map(|hit| hit.filter(|h| h.triangle < 2))
            .map(|hit| {
                let p = light.world_from_view.inverse().transform_point3(hit?.position);
                let q = light.clip_from_view * p.extend(1.0);
                Some((1.0 - (q.x / q.w).abs().max((q.y / q.w).abs())) * 0.5 * f64::from(map_size))
            })
            .collect();
        for (id, params, function, width) in modes() {
            let what = format!("{id} {params:?}, small cone");
            let gpu = visibility(&mut r, id, &params);
            assert_in_range(&gpu, &what);
            let count = |is: &dyn Fn(f64, f32) -> bool| {
                (0..gpu.len()).filter(|&i| depths[i].is_some_and(|d| is(d, gpu[i]))).count()
            };
            // A pixel's normal offset is at most a tenth of a texel.
            let outside = count(&|d, _| d < -0.2);
            let dark_outside = count(&|d, v| d < -0.2 && v < 1.0);
            let dark_at_border = count(&|d, v| (0.0..2.0).contains(&d) && v < 1.0);
            println!("{what}: {outside} pixels outside, {dark_outside} dark; {dark_at_border} dark at the border");
            assert!(outside > 1000 && dark_at_border > 50, "{what}: {outside}, {dark_at_border}");
            assert_eq!(dark_outside, 0, "{what}");
            let shot = Shot::of(host, &r, true);
            let settings = settings(function, false, 16);
            let (mirror, tolerance) = match width {
                1 => (rbsm::visibility(&shot.data(), &settings), tolerance(function)),
                _ => (rpcf::visibility(&shot.data(), &settings, width), 1e-4),
            };
            compare(&gpu, &mirror.unwrap(), tolerance).check(&what, if width == 1 { 0.03 } else { 0.3 });
        }
    });
}
