//! The study's shapes on the GPU: the family equals its mirrors, the functions evaluated on the shapes themselves, and
//! the study's figures.

use crate::common::with_gpu;
use crate::mirrors::compare;
use crate::revectorization::flat::{Expected, Flat, PLACE_ERROR, Window, expected};
use crate::revectorization::revectorize::{FILTERED, FUNCTIONS, settings, tolerance};
use edgeshade::reference::revectorization::rbsm::{self, Settings};
use edgeshade::reference::revectorization::rpcf;
use edgeshade::reference::revectorization::shapes::study::{Method, Options, of_shape};
use edgeshade::reference::revectorization::shapes::{Class, Shape, TILE};
use glam::dvec2;

/// Margin of the map around the study's tile, texels.
const MARGIN: i64 = 40;
const MAX_DISTANCE: u32 = 16;
/// Receivers parallel to the map, and at 51 degrees to it.
const RISES: [[f64; 2]; 2] = [[0.0, 0.0], [1.2, -0.3]];

/// Returns a window on a part of the tile.
fn window(from: u32, texels: u32, zoom: u32, rise: [f64; 2]) -> Window {
    let (map, first) = ([TILE + 2 * MARGIN as u32; 2], [MARGIN + i64::from(from); 2]);
    Window { map, first, texels: [texels; 2], zoom, rise }
}

/// Returns the shape placed in the map.
fn placed(shape: &Shape) -> impl Fn([i64; 2]) -> bool {
    move |texel| edgeshade::reference::revectorization::revectorize::Texels::lit(shape, texel.map(|t| t - MARGIN))
}

/// Panics unless the image is right and a planted pixel is noticed.
fn check(gpu: &[f32], expected: &Expected, what: &str) {
    assert_eq!(expected.wrong(gpu), 0, "{what}");
    let sure = (0..gpu.len()).find(|&i| expected.doubt[i] == 0.0 && gpu[i] == 1.0).unwrap();
    for planted in [1.0 - 1e-3, f32::NAN] {
        let mut image = gpu.to_vec();
        image[sure] = planted;
        assert_eq!(expected.wrong(&image), 1, "{what}: {planted} planted");
    }
}

#[test]
fn the_family_equals_its_mirrors_and_the_shapes() {
    with_gpu(|host| {
        let (mut pixels, mut ties) = (0, 0);
        // Wrong pixels of each function compared with each other one, over all shapes.
        let mut others = [[0; FUNCTIONS.len()]; FUNCTIONS.len()];
        for (i, class) in Class::ALL.into_iter().enumerate() {
            let shape = Shape::new(class, 1);
            let w = window(16, 16, 8, RISES[i % 2]);
            let flat = Flat::new(host, w, &placed(&shape));
            let says: Vec<_> = FUNCTIONS.iter().map(|f| expected(&w, &placed(&shape), f.2, MAX_DISTANCE, 1)).collect();
            for (k, &(id, params, function)) in FUNCTIONS.iter().enumerate() {
                let what = format!("{id} {params:?} {}", class.name());
                let gpu = flat.visibility(host, id, params);
                check(&gpu, &says[k], &what);
                let settings = Settings { normal_offset: 0.0, ..settings(function, false, MAX_DISTANCE) };
                let mirror = rbsm::visibility(&flat.data(), &settings).unwrap();
                compare(&gpu, &mirror, tolerance(function)).check(&what, 0.02);
                pixels += gpu.len();
                ties += says[k].ties();
                for (l, other) in says.iter().enumerate() {
                    others[k][l] += other.wrong(&gpu);
                }
            }
        }
        println!("{ties} of {pixels} pixels on a line; wrong by each other function: {others:?}");
        assert!(ties * 100 < pixels);
        for (k, row) in others.iter().enumerate() {
            assert!(row.iter().enumerate().all(|(l, n)| (k == l) == (*n == 0)), "{:?}: {row:?}", FUNCTIONS[k]);
        }
    });
}

#[test]
fn rpcf_equals_its_mirror_and_the_mean_over_the_shapes() {
    with_gpu(|host| {
        for (i, class) in Class::ALL.into_iter().enumerate() {
            let shape = Shape::new(class, 2);
            let w = window(18, 12, 8, RISES[i % 2]);
            let flat = Flat::new(host, w, &placed(&shape));
            for (k, &(word, function)) in FILTERED.iter().enumerate() {
                for width in [3, 7] {
                    let what = format!("rpcf {word} {} w{width}", class.name());
                    let gpu = flat.visibility(host, "rpcf", &[("visibility", word), ("width", &width.to_string())]);
                    let says = |width| expected(&w, &placed(&shape), function, MAX_DISTANCE, width);
                    assert_eq!(says(width).wrong(&gpu), 0, "{what}");
                    assert!(says(width + 2).wrong(&gpu) > 20, "{what}: another width goes unnoticed");
                    // The mirror is slow, so it runs on some cases only.
                    if (i + k) % 3 == 0 && (width == 3 || i < 3) {
                        let settings = Settings { normal_offset: 0.0, ..settings(function, false, MAX_DISTANCE) };
                        let mirror = rpcf::visibility(&flat.data(), &settings, width).unwrap();
                        compare(&gpu, &mirror, 1e-4).check(&what, 0.3);
                    }
                }
            }
        }
    });
}

/// Returns the areas that are too dark and too light, texels.
fn mismatch(w: &Window, shape: &Shape, lit: impl Fn(usize) -> bool) -> [f64; 2] {
    let mut area = [0.0; 2];
    for i in w.pixels() {
        let (texel, fraction) = w.place(i);
        let point = dvec2((texel[0] - MARGIN) as f64, (texel[1] - MARGIN) as f64) + fraction;
        if lit(i) != shape.truth(point) {
            area[usize::from(lit(i))] += f64::from(w.zoom * w.zoom).recip();
        }
    }
    area
}

/// The GPU's pictures have the mismatch that the study finds for the functions.
#[test]
fn the_studys_figures_are_those_of_the_pictures() {
    with_gpu(|host| {
        let methods: Vec<_> = FUNCTIONS.iter().map(|f| Method::Revectorized(f.2)).collect();
        let methods = [&[Method::ShadowMap], &methods[..]].concat();
        // The study's points are the pixels' centres.
        let subsamples = 4;
        let options = Options { methods, shapes: 1, subsamples, max_distances: vec![MAX_DISTANCE] };
        // Mismatch per texel of silhouette in the pictures and in the study, averaged over the shapes; pixels in
        // doubt.
        let mut table = [([0.0; 2], 0); FUNCTIONS.len()];
        let mut shapes = 0.0;
        // Number of shapes that distinguish each function from the next.
        let mut told_apart = [0; FUNCTIONS.len()];
        for (i, shape) in Class::ALL.into_iter().flat_map(|c| c.shapes().take(2)).enumerate() {
            let w = window(0, TILE, subsamples, RISES[i % 2]);
            let flat = Flat::new(host, w, &placed(&shape));
            let rows = of_shape(&shape, &options);
            // The shadow map's own mismatch gives the length of the silhouette that the study divides by.
            let plain = mismatch(&w, &shape, |i| placed(&shape)(w.place(i).0));
            let length = (plain[0] + plain[1]) / rows[0].mismatch();
            assert!(length > 5.0 && length < 5e3, "{length}");
            let sm = flat.visibility(host, "sm", &[("depth_bias", "0.005")]);
            assert_eq!(mismatch(&w, &shape, |i| sm[i] >= 0.5), plain, "sm {:?}", shape.class);
            shapes += 1.0;
            for (k, &(id, params, function)) in FUNCTIONS.iter().enumerate() {
                let gpu = flat.visibility(host, id, params);
                let area = mismatch(&w, &shape, |i| gpu[i] >= 0.5);
                let says = expected(&w, &placed(&shape), function, MAX_DISTANCE, 1);
                // Pixels are ties if they lie on a deciding line, or where the ramp is one half.
                let ramp = |v: f64| function.slope() > 0.0 && (v - 0.5).abs() <= 2.0 * PLACE_ERROR;
                let ties = (0..gpu.len()).filter(|&i| says.doubt[i] > 0.0 || ramp(says.visibility[i])).count();
                let allowed = ties as f64 / f64::from(w.zoom * w.zoom) + 1e-9;
                let is_right = |study: usize| {
                    let known = [rows[study].over * length, rows[study].under * length];
                    (0..2).all(|k| (area[k] - known[k]).abs() <= allowed)
                };
                assert!(is_right(k + 1), "{id} {params:?} {:?}: {area:?}, {:?}", shape.class, rows[k + 1]);
                // The study's figure for the next function is different.
                told_apart[k] += usize::from(!is_right((k + 1) % FUNCTIONS.len() + 1));
                table[k].0[0] += (area[0] + area[1]) / length;
                table[k].0[1] += rows[k + 1].mismatch();
                table[k].1 += ties;
            }
        }
        for (&(id, params, _), ([pictures, study], ties)) in FUNCTIONS.iter().zip(table) {
            let (pictures, study) = (pictures / shapes, study / shapes);
            println!("{id:14} {params:?}: mismatch {pictures:.4} in pictures, {study:.4} in the study, {ties} ties");
        }
        println!("of {shapes} shapes so many tell each function from the next: {told_apart:?}");
        assert!(told_apart.iter().all(|n| *n >= 3), "{told_apart:?}");
    });
}
