//! Metrics against their definitions; each is shown to detect the error that it is meant for.
#![cfg(feature = "app")]

use edgeshade::metrics::{FalseShadow, Motion, Report, Shot, compare, false_shadow, flip, motion};

type Plane = Vec<f32>;

fn plane(size: [u32; 2], f: impl Fn(i64, i64) -> f32) -> Plane {
    (0..i64::from(size[1])).flat_map(|y| (0..i64::from(size[0])).map(move |x| (x, y))).map(|(x, y)| f(x, y)).collect()
}

fn all(size: [u32; 2]) -> Vec<bool> {
    vec![true; (size[0] * size[1]) as usize]
}

fn whole(test: &[f32], truth: &[f32], size: [u32; 2]) -> Report {
    compare(test, truth, &all(size), size).unwrap()
}

/// Reproducible values in [0, 1).
fn random(seed: u64) -> impl FnMut() -> f32 {
    let mut state = seed;
    move || {
        state = state.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
        (state >> 40) as f32 / (1u64 << 24) as f32
    }
}

fn disc(size: [u32; 2], radius: f64) -> Plane {
    let c = [0.5 * f64::from(size[0]), 0.5 * f64::from(size[1])];
    plane(size, |x, y| {
        let d = (x as f64 + 0.5 - c[0]).hypot(y as f64 + 0.5 - c[1]);
        if d < radius { 0.0 } else { 1.0 }
    })
}

fn close(a: f64, b: f64, tolerance: f64) {
    assert!((a - b).abs() <= tolerance, "{a} is not {b} ± {tolerance}");
}

#[test]
fn equal_pictures_have_no_error() {
    let size = [64, 48];
    let v = disc(size, 15.0);
    let r = whole(&v, &v, size);
    assert_eq!(r.pixels, 64 * 48);
    assert_eq!([r.rmse, r.mae, r.mismatch, r.over, r.under], [0.0; 5]);
    assert_eq!(r.ssim, Some(1.0));
    for b in [r.boundary.unwrap(), r.boundary_reverse.unwrap()] {
        assert_eq!([b.mean, b.p95, b.max], [0.0; 3]);
    }
    assert_eq!([r.false_shadow, r.false_shadow_share, r.light_leak, r.light_leak_share], [Some(0.0); 4]);
    assert_eq!(r.penumbra_rmse, Some(0.0));
    assert!(r.penumbra_pixels > 0);
}

#[test]
fn one_planted_pixel_changes_every_measure_by_what_it_must() {
    let size = [40u32, 30];
    let n = 1200.0;
    let truth = plane(size, |x, _| if x < 20 { 0.0 } else { 1.0 });
    let mut test = truth.clone();
    test[15 * 40 + 35] = 0.0; // well inside the lit half, beyond the band
    let r = whole(&test, &truth, size);
    assert_eq!(r.mismatch, 1.0 / n);
    assert_eq!(r.mae, 1.0 / n);
    assert_eq!(r.over, 1.0 / n);
    assert_eq!(r.under, 0.0);
    close(r.rmse, (1.0f64 / n).sqrt(), 1e-15);
    let lit = 17.0 * 30.0; // columns 23..40: 3 px from the edge are eroded
    assert_eq!(r.false_shadow, Some(1.0 / lit));
    assert_eq!(r.false_shadow_share, Some(1.0 / lit));
    assert_eq!(r.light_leak, Some(0.0));
    assert_eq!(r.penumbra_rmse, Some(0.0));
    assert!(r.ssim.unwrap() < 1.0);
    // Its four sides are boundary, 15, 15.5 or 16 px from the true one, all of it shadow that should not exist.
    let b = r.boundary.unwrap();
    assert_eq!(b.max, 16.0);
    close(b.mean, (15.0 + 15.5 + 15.5 + 16.0) / 34.0, 1e-12);
    assert_eq!(r.boundary_reverse.unwrap().max, 0.0);

    // The same error inside the shadow is a light leak.
    let mut test = truth.clone();
    test[15 * 40 + 4] = 1.0;
    let r = whole(&test, &truth, size);
    assert_eq!([r.mismatch, r.over, r.under], [1.0 / n, 0.0, 1.0 / n]);
    assert_eq!(r.light_leak, Some(1.0 / (17.0 * 30.0)));
    assert_eq!(r.false_shadow, Some(0.0));
    assert!(r.boundary.unwrap().mean < 0.0);
}

#[test]
fn a_constant_offset_is_rmse_and_mae() {
    let size = [33, 21];
    let truth = plane(size, |x, y| ((x * 7 + y * 3) % 11) as f32 / 16.0);
    for c in [0.125f32, -0.25] {
        let test: Plane = truth.iter().map(|v| v + c).collect();
        let r = whole(&test, &truth, size);
        let e = f64::from(c.abs());
        close(r.rmse, e, 1e-12);
        close(r.mae, e, 1e-12);
        close(if c < 0.0 { r.over } else { r.under }, e, 1e-12);
        close(if c < 0.0 { r.under } else { r.over }, 0.0, 0.0);
    }
}

#[test]
fn a_shifted_half_plane_is_displaced_by_the_shift() {
    let size = [96u32, 50];
    for upright in [true, false] {
        let half = |at: i64| plane(size, |x, y| if (if upright { x } else { y }) < at { 0.0 } else { 1.0 });
        let truth = half(25);
        let length = f64::from(if upright { size[1] } else { size[0] });
        for k in [-12i64, -3, -1, 0, 1, 2, 5, 20] {
            let r = whole(&half(25 + k), &truth, size);
            let magnitude = k.unsigned_abs() as f64;
            for b in [r.boundary.unwrap(), r.boundary_reverse.unwrap()] {
                close(b.mean, k as f64, 0.13);
                assert_eq!([b.p95, b.max], [magnitude; 2]);
            }
            close(r.mismatch * 96.0 * 50.0, magnitude * length, 1e-9);
            close(if k > 0 { r.over } else { r.under }, r.mismatch, 1e-15);
        }
    }
}

#[test]
fn displacement_equals_its_definition_and_shows_missing_shadows() {
    // The definition: take the sides between differing pixels, and for each the nearest point on a side of the other
    // picture.
    let size = [45u32, 37];
    let (w, h) = (45usize, 37usize);
    let mut next = random(7);
    let noise: Plane = disc(size, 11.0).iter().map(|&v| if next() < 0.02 { 1.0 - v } else { v }).collect();
    let truth = disc(size, 13.0);
    let mut mask = all(size);
    mask.iter_mut().for_each(|m| *m = next() > 0.03);
    // Each side as (x0, y0, x1, y1).
    let sides = |v: &[f32]| {
        let mut s = Vec::new();
        for y in 0..h {
            for x in 0..w {
                let i = y * w + x;
                if x + 1 < w && mask[i] && mask[i + 1] && v[i] != v[i + 1] {
                    s.push([x + 1, y, x + 1, y + 1].map(|c| c as f64));
                }
                if y + 1 < h && mask[i] && mask[i + w] && v[i] != v[i + w] {
                    s.push([x, y + 1, x + 1, y + 1].map(|c| c as f64));
                }
            }
        }
        s
    };
    let distances = |from: &[f32], to: &[f32]| {
        let others = sides(to);
        let mut d: Vec<f64> = sides(from)
            .iter()
            .map(|s| {
                let m = [0.5 * (s[0] + s[2]), 0.5 * (s[1] + s[3])];
                let near = |o: &[f64; 4]| (m[0] - m[0].clamp(o[0], o[2])).hypot(m[1] - m[1].clamp(o[1], o[3]));
                others.iter().map(near).fold(f64::INFINITY, f64::min)
            })
            .collect();
        d.sort_by(f64::total_cmp);
        d
    };
    let r = compare(&noise, &truth, &mask, size).unwrap();
    for (b, d) in [(r.boundary, distances(&noise, &truth)), (r.boundary_reverse, distances(&truth, &noise))] {
        let b = b.unwrap();
        close(b.max, *d.last().unwrap(), 1e-12);
        close(b.p95, d[(0.95 * d.len() as f64).ceil() as usize - 1], 1e-12);
        assert!(b.mean.abs() <= d.iter().sum::<f64>() / d.len() as f64 + 1e-12);
    }

    // The truth has two discs and the test only one: only the reverse direction shows it.
    let size = [100, 50];
    let spot = |cx: f64| move |x: i64, y: i64| (x as f64 + 0.5 - cx).hypot(y as f64 + 0.5 - 25.0) < 8.0;
    let (left, right) = (spot(20.0), spot(80.0));
    let truth = plane(size, |x, y| if left(x, y) || right(x, y) { 0.0 } else { 1.0 });
    let test = plane(size, |x, y| if left(x, y) { 0.0 } else { 1.0 });
    let r = whole(&test, &truth, size);
    assert_eq!(r.boundary.unwrap().max, 0.0);
    let b = r.boundary_reverse.unwrap();
    assert!(b.max > 50.0 && b.mean < -20.0, "{b:?}");
}

#[test]
fn grown_and_shrunken_discs_have_the_sign_of_the_shadow() {
    let size = [120, 110];
    let truth = disc(size, 30.0);
    for k in [-6.0, -2.0, 3.0, 7.0] {
        let r = whole(&disc(size, 30.0 + k), &truth, size);
        close(r.boundary.unwrap().mean, k, 0.5);
        close(r.boundary_reverse.unwrap().mean, k, 0.5);
    }
}

#[test]
fn a_leaking_umbra_is_a_leak_and_no_displacement() {
    let size = [80u32, 60];
    let truth = disc(size, 20.0);
    let test: Plane = truth.iter().map(|v| if *v == 0.0 { 0.2 } else { 1.0 }).collect();
    let area = truth.iter().filter(|v| **v == 0.0).count() as f64 / 4800.0;
    let r = whole(&test, &truth, size);
    close(r.light_leak.unwrap(), 0.2, 1e-7);
    assert_eq!(r.light_leak_share, Some(1.0));
    close(r.under, 0.2 * area, 1e-8);
    assert_eq!([r.over, r.mismatch], [0.0; 2]);
    assert_eq!(r.false_shadow, Some(0.0));
    let b = r.boundary.unwrap();
    assert_eq!([b.mean, b.p95, b.max], [0.0; 3]);
}

#[test]
fn displaced_edges_within_three_pixels_are_neither_leak_nor_acne() {
    let size = [60, 20];
    let half = |at: i64| plane(size, |x, _| if x < at { 0.0 } else { 1.0 });
    for k in [-3, 3] {
        let r = whole(&half(30 + k), &half(30), size);
        assert_eq!([r.false_shadow, r.light_leak], [Some(0.0); 2], "{k}");
    }
    let beyond = whole(&half(34), &half(30), size);
    assert_eq!(beyond.false_shadow, Some(1.0 / 27.0));
    let beyond = whole(&half(26), &half(30), size);
    assert_eq!(beyond.light_leak, Some(1.0 / 27.0));
}

#[test]
fn the_penumbra_band_is_eight_pixels_wide_and_holds_its_own_error() {
    let size = [100u32, 30];
    // A hard shadow edge between columns 49 and 50: the band is columns 41..=58.
    let truth = plane(size, |x, _| if x < 50 { 0.0 } else { 1.0 });
    let wrong_at = |column: i64| {
        let test = plane(size, |x, _| {
            if x == column {
                0.5
            } else if x < 50 {
                0.0
            } else {
                1.0
            }
        });
        whole(&test, &truth, size)
    };
    assert_eq!(wrong_at(58).penumbra_pixels, 18 * 30);
    close(wrong_at(58).penumbra_rmse.unwrap(), (0.25f64 / 18.0).sqrt(), 1e-12);
    close(wrong_at(41).penumbra_rmse.unwrap(), (0.25f64 / 18.0).sqrt(), 1e-12);
    assert_eq!(wrong_at(59).penumbra_rmse, Some(0.0));
    assert_eq!(wrong_at(40).penumbra_rmse, Some(0.0));
    // A ramp over columns 45..55 widens the band by its partly lit columns.
    let ramp = plane(size, |x, _| ((x - 44) as f32 / 11.0).clamp(0.0, 1.0));
    assert_eq!(whole(&ramp, &ramp, size).penumbra_pixels, (10 + 16) * 30);
    // Without penumbra and boundary there is no band.
    let flat = plane(size, |_, _| 1.0);
    assert_eq!(whole(&flat, &flat, size).penumbra_rmse, None);
}

/// Weight, test, truth and mask of a pixel.
type Weighted = (f64, f64, f64, bool);

/// Computes every window separately in both dimensions, with the variance from the deviations.
fn naive_ssim(x: &[f32], y: &[f32], mask: &[bool], size: [u32; 2]) -> Option<f64> {
    let (w, h) = (size[0] as usize, size[1] as usize);
    let mut weights = [[0.0f64; 11]; 11];
    let mut total = 0.0;
    for (j, row) in weights.iter_mut().enumerate() {
        for (i, v) in row.iter_mut().enumerate() {
            *v = (-((i as f64 - 5.0).powi(2) + (j as f64 - 5.0).powi(2)) / 4.5).exp();
            total += *v;
        }
    }
    let (mut sum, mut count) = (0.0, 0);
    for top in 0..=h.checked_sub(11)? {
        for left in 0..=w.checked_sub(11)? {
            let window: Vec<Weighted> = (0..121)
                .map(|k| {
                    let at = (top + k / 11) * w + left + k % 11;
                    (weights[k / 11][k % 11] / total, f64::from(x[at]), f64::from(y[at]), mask[at])
                })
                .collect();
            if !window.iter().all(|p| p.3) {
                continue;
            }
            let mean = |f: &dyn Fn(&Weighted) -> f64| window.iter().map(|p| p.0 * f(p)).sum::<f64>();
            let (mx, my) = (mean(&|p| p.1), mean(&|p| p.2));
            let (vx, vy) = (mean(&|p| (p.1 - mx).powi(2)), mean(&|p| (p.2 - my).powi(2)));
            let cov = mean(&|p| (p.1 - mx) * (p.2 - my));
            sum += (2.0 * mx * my + 1e-4) * (2.0 * cov + 9e-4) / ((mx * mx + my * my + 1e-4) * (vx + vy + 9e-4));
            count += 1;
        }
    }
    (count > 0).then(|| sum / f64::from(count))
}

#[test]
fn ssim_equals_a_direct_evaluation() {
    for (seed, size) in [(1, [11, 11]), (2, [40, 25]), (3, [12, 60]), (4, [10, 40]), (5, [40, 10])] {
        let mut next = random(seed);
        let truth = plane(size, |x, y| if x + 2 * y < 40 { 0.1 } else { 0.9 });
        let test: Plane = truth.iter().map(|v| v + 0.3 * (next() - 0.5)).collect();
        let mut mask = all(size);
        let full = naive_ssim(&test, &truth, &mask, size);
        match (full, compare(&test, &truth, &mask, size).unwrap().ssim) {
            (Some(a), Some(b)) => close(a, b, 1e-9),
            (a, b) => assert_eq!((a, b), (None, None)),
        }
        if size[0].min(size[1]) > 20 {
            mask[3 * size[0] as usize + 4] = false;
            mask[20 * size[0] as usize + 35] = false;
            let masked = naive_ssim(&test, &truth, &mask, size).unwrap();
            assert!((masked - full.unwrap()).abs() > 1e-6);
            close(compare(&test, &truth, &mask, size).unwrap().ssim.unwrap(), masked, 1e-9);
        }
    }
}

#[test]
fn masked_out_pixels_do_not_count_whatever_they_hold() {
    let size = [50u32, 40];
    let truth = disc(size, 12.0);
    let mut next = random(3);
    let test: Plane = truth.iter().map(|v| (v + 0.2 * next() - 0.1).clamp(0.0, 1.0)).collect();
    let mask: Vec<bool> = plane(size, |x, y| ((x * 3 + y) % 17) as f32).iter().map(|v| *v != 0.0).collect();
    let report = compare(&test, &truth, &mask, size).unwrap();
    let spoil = |v: &[f32]| -> Plane { v.iter().zip(&mask).map(|(v, m)| if *m { *v } else { f32::NAN }).collect() };
    assert_eq!(compare(&spoil(&test), &spoil(&truth), &mask, size).unwrap(), report);
    assert_eq!(report.pixels, mask.iter().filter(|m| **m).count() as u64);
}

#[test]
fn the_number_of_threads_changes_nothing() {
    let size = [131u32, 97];
    let mut next = random(11);
    let truth: Plane = disc(size, 30.0).iter().map(|v| (v + 0.3 * next() - 0.15).clamp(0.0, 1.0)).collect();
    let test: Plane = truth.iter().map(|v| (v + 0.4 * next() - 0.2).clamp(0.0, 1.0)).collect();
    let mask: Vec<bool> = truth.iter().map(|_| next() > 0.001).collect();
    let report = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| serde_json::to_string(&compare(&test, &truth, &mask, size).unwrap()).unwrap())
    };
    let one = report(1);
    for threads in [2, 3, 8] {
        assert_eq!(report(threads), one);
    }
}

#[test]
fn empty_sets_give_defined_values() {
    for size in [[0, 0], [0, 5], [5, 0], [1, 1], [1, 7], [30, 30]] {
        let v = plane(size, |_, _| 0.0);
        let r = compare(&v, &v, &vec![false; v.len()], size).unwrap();
        assert_eq!(r.pixels, 0);
        assert_eq!([r.rmse, r.mae, r.mismatch, r.over, r.under], [0.0; 5]);
        assert_eq!([r.ssim, r.false_shadow, r.light_leak, r.penumbra_rmse], [None; 4]);
        assert!(r.boundary.is_none() && r.boundary_reverse.is_none());
        let json = serde_json::to_value(r).unwrap();
        assert_eq!(json["ssim"], serde_json::Value::Null);
        assert_eq!(json["rmse"], 0.0);
        let r = whole(&v, &v, size);
        assert_eq!(r.pixels, v.len() as u64);
    }
    // All lit against all in shadow: the truth has no boundary, and no lit pixels where acne could be.
    let r = whole(&[1.0; 400], &[0.0; 400], [20, 20]);
    assert_eq!((r.mismatch, r.under, r.light_leak, r.false_shadow), (1.0, 1.0, Some(1.0), None));
    assert!(r.boundary.is_none());
}

#[test]
fn bad_input_is_an_error_that_says_where() {
    let size = [7, 5];
    let good = vec![0.5f32; 35];
    let mask = all(size);
    let mut bad = good.clone();
    bad[3 * 7 + 2] = f32::NAN;
    let text = compare(&bad, &good, &mask, size).unwrap_err().to_string();
    assert!(text.contains("under test") && text.contains("NaN") && text.contains("(2, 3)"), "{text}");
    let text = compare(&good, &bad, &mask, size).unwrap_err().to_string();
    assert!(text.contains("truth") && text.contains("(2, 3)"), "{text}");
    bad[3 * 7 + 2] = f32::INFINITY;
    assert!(compare(&bad, &good, &mask, size).unwrap_err().to_string().contains("inf"));
    assert!(compare(&good[1..], &good, &mask, size).unwrap_err().to_string().contains("34 values"));
    assert!(compare(&good, &good, &mask[1..], size).unwrap_err().to_string().contains("mask"));
    assert!(compare(&[], &[], &[], [u32::MAX, 0]).unwrap_err().to_string().contains("16384"));
    assert!(flip(&[[0; 3]; 4], &[[0; 3]; 3], [2, 2]).unwrap_err().to_string().contains("true picture"));
}

#[test]
fn flip_has_the_known_values_of_a_shifted_edge() {
    let size = [256u32, 256];
    let edge = |at: i64| -> Vec<[u8; 3]> {
        plane(size, |x, _| if x < at { 40.0 } else { 200.0 }).iter().map(|v| [*v as u8; 3]).collect()
    };
    let truth = edge(128);
    for (shift, mean) in [(0, 0.0), (1, 0.0092), (2, 0.0153), (4, 0.0254), (8, 0.0418)] {
        let (found, map) = flip(&edge(128 + shift), &truth, size).unwrap();
        close(found, mean, 0.5e-4);
        assert_eq!(map.len(), 256 * 256);
        assert!(map.iter().all(|v| (0.0..=1.0).contains(v)));
        let largest = (0..map.len()).max_by(|a, b| map[*a].total_cmp(&map[*b])).unwrap() % 256;
        assert!(shift == 0 || (120..144).contains(&largest), "{largest}");
    }
    for size in [[0, 0], [1, 1], [1, 7], [7, 1]] {
        let picture = vec![[90, 100, 110]; (size[0] * size[1]) as usize];
        let (mean, map) = flip(&picture, &picture, size).unwrap();
        assert_eq!((mean, map.len()), (0.0, picture.len()));
    }
}

/// Boundary length by the cases of marching squares: where the line through a block of four pixels enters and leaves.
fn traced_length(v: &[f32], mask: &[bool], size: [u32; 2]) -> f64 {
    let (w, h) = (size[0] as usize, size[1] as usize);
    let mut total = 0.0;
    for y in 1..h {
        for x in 1..w {
            // Pixels around the block, and below the midpoints of its four sides in the same order.
            let around = [(x - 1, y - 1), (x, y - 1), (x, y), (x - 1, y)].map(|(x, y)| y * w + x);
            if around.iter().any(|&i| !mask[i]) {
                continue;
            }
            let middles = [[0.5, 0.0], [1.0, 0.5], [0.5, 1.0], [0.0, 0.5f64]];
            let crossed: Vec<usize> =
                (0..4).filter(|&k| (v[around[k]] >= 0.5) != (v[around[(k + 1) % 4]] >= 0.5)).collect();
            for pair in crossed.chunks(2) {
                let [a, b] = [middles[pair[0]], middles[pair[1]]];
                total += (a[0] - b[0]).hypot(a[1] - b[1]);
            }
        }
    }
    total
}

#[test]
fn the_boundary_length_is_that_of_the_line_between_the_pixels() {
    let size = [90u32, 70];
    let half = |f: fn(i64, i64) -> bool| plane(size, |x, y| if f(x, y) { 0.0 } else { 1.0 });
    let length = |v: &Plane| whole(v, v, size).boundary_length;
    assert_eq!(length(&half(|x, _| x < 30)), 69.0);
    assert_eq!(length(&half(|_, y| y < 30)), 89.0);
    // The line starts half a pixel below the first pixel's centre and ends between the centres of the last row.
    close(length(&half(|x, y| x < y)), 68.5 * 2f64.sqrt(), 1e-9);
    assert_eq!(length(&plane(size, |_, _| 1.0)), 0.0);
    // Round boundaries come out too long, by 5.5 % in the mean.
    close(length(&disc(size, 30.0)) / (60.0 * std::f64::consts::PI), 1.055, 0.01);

    let mut next = random(5);
    let noise: Plane = disc(size, 25.0).iter().map(|&v| if next() < 0.05 { 1.0 - v } else { v }).collect();
    let mask: Vec<bool> = noise.iter().map(|_| next() > 0.03).collect();
    let found = compare(&noise, &noise, &mask, size).unwrap().boundary_length;
    close(found, traced_length(&noise, &mask, size), 1e-9);
    assert!((found - traced_length(&noise, &all(size), size)).abs() > 1.0, "the mask counts");
}

#[test]
fn mismatch_per_boundary_is_the_distance_whatever_else_is_in_the_picture() {
    for size in [[60u32, 50], [300, 50]] {
        let half = |at: i64| plane(size, |x, _| if x < at { 0.0 } else { 1.0 });
        for k in [-4, 0, 1, 7] {
            let r = whole(&half(25 + k), &half(25), size);
            close(r.mismatch_per_boundary.unwrap(), k.unsigned_abs() as f64 * 50.0 / 49.0, 1e-12);
        }
        // On the diagonal a shift by one column is a shorter distance.
        let slant = |at: i64| plane(size, |x, y| if x - y < at { 0.0 } else { 1.0 });
        let r = whole(&slant(3), &slant(1), size);
        close(r.mismatch_per_boundary.unwrap(), 2f64.sqrt(), 0.06);
    }
    // An isolated wrong pixel counts with its area over the boundary length.
    let size = [40u32, 30];
    let truth = plane(size, |x, _| if x < 20 { 0.0 } else { 1.0 });
    let mut test = truth.clone();
    test[15 * 40 + 35] = 0.0;
    close(whole(&test, &truth, size).mismatch_per_boundary.unwrap(), 1.0 / 29.0, 1e-12);
    assert_eq!(whole(&test, &[1.0; 1200], size).mismatch_per_boundary, None);
}

#[test]
fn false_shadow_counts_what_is_dark_far_from_every_true_shadow() {
    let size = [53u32, 41];
    let (w, h) = (53i64, 41i64);
    let mut next = random(9);
    let truth = disc(size, 9.0);
    let test: Plane = truth.iter().map(|v| if next() < 0.3 { 1.0 - v } else { *v }).collect();
    let mask: Vec<bool> = truth.iter().map(|_| next() > 0.1).collect();
    for radius in [0u32, 1, 3, 8] {
        let mut expected = FalseShadow { lit: 0, dark: 0 };
        for (x, y) in (0..h).flat_map(|y| (0..w).map(move |x| (x, y))) {
            let at = |x: i64, y: i64| (y * w + x) as usize;
            let shadow = |i: usize| mask[i] && truth[i] < 1.0;
            let reach = i64::from(radius);
            let near = |dx: i64, dy: i64| {
                dx * dx + dy * dy <= reach * reach
                    && (0..w).contains(&(x + dx))
                    && (0..h).contains(&(y + dy))
                    && shadow(at(x + dx, y + dy))
            };
            if mask[at(x, y)] && !(-reach..=reach).any(|dy| (-reach..=reach).any(|dx| near(dx, dy))) {
                expected.lit += 1;
                expected.dark += u64::from(test[at(x, y)] < 0.5);
            }
        }
        assert!(expected.dark > 50);
        assert_eq!(false_shadow(&test, &truth, &mask, size, radius).unwrap(), expected, "{radius}");
        assert_eq!(false_shadow(&truth, &truth, &mask, size, radius).unwrap().share(), Some(0.0));
    }
    // Shadow that is too large by exactly the radius is not false shadow, but one more pixel is.
    let half = |at: i64| plane(size, |x, _| if x < at { 0.0 } else { 1.0 });
    let dark = |at| false_shadow(&half(at), &half(20), &all(size), size, 4).unwrap().dark;
    assert_eq!([dark(24), dark(25)], [0, 41]);
    let nothing_lit = false_shadow(&[1.0; 4], &[0.0; 4], &[true; 4], [2, 2], 1).unwrap();
    assert_eq!((nothing_lit, nothing_lit.share()), (FalseShadow { lit: 0, dark: 0 }, None));
    assert!(false_shadow(&[1.0; 3], &[0.0; 4], &[true; 4], [2, 2], 1).is_err());
}

/// Evaluates the definition: every pixel looks at every other one to find a boundary nearby.
fn naive_motion(shots: &[[&[f32]; 2]], mask: &[Vec<bool>], size: [u32; 2], radius: i64) -> Motion {
    let (w, h) = (i64::from(size[0]), i64::from(size[1]));
    let at = |x: i64, y: i64| (y * w + x) as usize;
    let inside = |x: i64, y: i64| (0..w).contains(&x) && (0..h).contains(&y);
    let near = |k: usize, x: i64, y: i64| {
        let truth = shots[k][1];
        let is_boundary = |x: i64, y: i64| {
            inside(x, y) && mask[k][at(x, y)] && {
                let v = truth[at(x, y)];
                let across = |dx: i64, dy: i64| {
                    inside(x + dx, y + dy)
                        && mask[k][at(x + dx, y + dy)]
                        && (truth[at(x + dx, y + dy)] >= 0.5) != (v >= 0.5)
                };
                v > 0.0 && v < 1.0 || [(1, 0), (-1, 0), (0, 1), (0, -1)].iter().any(|&(dx, dy)| across(dx, dy))
            }
        };
        let reach = -radius..=radius;
        reach
            .clone()
            .any(|dy| reach.clone().any(|dx| dx * dx + dy * dy <= radius * radius && is_boundary(x + dx, y + dy)))
    };
    let (mut pairs, mut triples) = ([0.0; 4], [0.0; 3]);
    for (x, y) in (0..h).flat_map(|y| (0..w).map(move |x| (x, y))) {
        let i = at(x, y);
        for k in 0..shots.len() - 1 {
            if (k..k + 2).all(|k| mask[k][i]) && (k..k + 2).any(|k| near(k, x, y)) {
                let d = [0, 1].map(|p| f64::from(shots[k + 1][p][i]) - f64::from(shots[k][p][i]));
                for (sum, v) in pairs.iter_mut().zip([1.0, d[0].abs(), d[1].abs(), (d[0] - d[1]).abs()]) {
                    *sum += v;
                }
            }
            if k + 2 < shots.len() && (k..k + 3).all(|k| mask[k][i]) && (k..k + 3).any(|k| near(k, x, y)) {
                triples[0] += 1.0;
                for p in [0, 1] {
                    let lit = [0, 1, 2].map(|j| shots[k + j][p][i] >= 0.5);
                    triples[1 + p] += f64::from(u8::from(lit == [true, false, true] || lit == [false, true, false]));
                }
            }
        }
    }
    let [change, change_truth, change_error] = [1, 2, 3].map(|k| Some(pairs[k] / pairs[0]));
    let [flicker, flicker_truth] = [1, 2].map(|k| Some(triples[k] / triples[0]));
    let (pairs, triples) = (pairs[0] as u64, triples[0] as u64);
    Motion { pairs, change, change_truth, change_error, triples, flicker, flicker_truth }
}

#[test]
fn motion_equals_its_definition() {
    let size = [37u32, 29];
    let mut next = random(21);
    let truth: Vec<Plane> = (0..5)
        .map(|k| {
            let soft = |v: &f32| if next() < 0.01 { 0.3 } else { *v };
            disc(size, 6.0 + f64::from(k)).iter().map(soft).collect()
        })
        .collect();
    let test: Vec<Plane> =
        truth.iter().map(|t| t.iter().map(|v| (v + 0.9 * (next() - 0.5)).clamp(0.0, 1.0)).collect()).collect();
    let masks: Vec<Vec<bool>> = (0..5).map(|_| truth[0].iter().map(|_| next() > 0.05).collect()).collect();
    let shots: Vec<Shot<'_>> = (0..5).map(|k| Shot { test: &test[k], truth: &truth[k], mask: &masks[k] }).collect();
    let planes: Vec<[&[f32]; 2]> = (0..5).map(|k| [&test[k][..], &truth[k]]).collect();
    for radius in [0, 2, 5] {
        let found = motion(&shots, size, radius).unwrap();
        let expected = naive_motion(&planes, &masks, size, i64::from(radius));
        assert_eq!((found.pairs, found.triples), (expected.pairs, expected.triples), "{radius}");
        for (a, b) in [
            (found.change, expected.change),
            (found.change_truth, expected.change_truth),
            (found.change_error, expected.change_error),
            (found.flicker, expected.flicker),
            (found.flicker_truth, expected.flicker_truth),
        ] {
            assert!(b.unwrap() > 1e-3);
            close(a.unwrap(), b.unwrap(), 1e-12);
        }
    }
}

#[test]
fn a_still_picture_does_not_move_and_a_planted_blink_flickers() {
    let size = [40u32, 20];
    let n = 40 * 20;
    let half = |at: i64| plane(size, |x, _| if x < at { 0.0 } else { 1.0 });
    let mask = all(size);
    let still = half(20);
    let measure = |frames: &[(&Plane, &Plane)]| {
        let shots: Vec<_> = frames.iter().map(|(test, truth)| Shot { test, truth, mask: &mask }).collect();
        motion(&shots, size, 3).unwrap()
    };
    // The band is 2 * (1 + 3) columns wide.
    let rest = measure(&[(&still, &still); 4]);
    assert_eq!((rest.pairs, rest.triples), (3 * 8 * 20, 2 * 8 * 20));
    assert_eq!([rest.change, rest.change_error, rest.flicker], [Some(0.0); 3]);
    // A constant error is no change.
    let off = half(22);
    assert_eq!(measure(&[(&off, &still); 4]), rest);
    // One pixel of the band is dark in one frame, which makes two changes and one flicker.
    let mut blink = still.clone();
    blink[10 * 40 + 21] = 0.0;
    let m = measure(&[(&still, &still), (&blink, &still), (&still, &still)]);
    assert_eq!((m.change, m.change_truth), (Some(2.0 / (2.0 * 160.0)), Some(0.0)));
    assert_eq!((m.change_error, m.flicker, m.flicker_truth), (m.change, Some(1.0 / 160.0), Some(0.0)));
    // Outside the band or the mask it does not count.
    let mut far = still.clone();
    far[10 * 40 + 30] = 0.0;
    assert_eq!(measure(&[(&still, &still), (&far, &still), (&still, &still)]).change, Some(0.0));
    let mut masked = mask.clone();
    masked[10 * 40 + 21] = false;
    let shots = [&still, &blink, &still].map(|test| Shot { test, truth: &still, mask: &masked });
    let m = motion(&shots, size, 3).unwrap();
    assert_eq!((m.pairs, m.change, m.flicker), (2 * 159, Some(0.0), Some(0.0)));
    // The truth changes: a test that follows it is right, one that stays is wrong.
    let next = half(21);
    let follows = measure(&[(&still, &still), (&next, &next)]);
    assert_eq!((follows.change, follows.change_error), (follows.change_truth, Some(0.0)));
    assert_eq!((follows.pairs, follows.change, follows.flicker), (9 * 20, Some(1.0 / 9.0), None));
    let stays = measure(&[(&still, &still), (&still, &next)]);
    assert_eq!((stays.change, stays.change_error), (Some(0.0), Some(1.0 / 9.0)));

    for shots in [vec![], vec![(&still, &still)]] {
        assert_eq!((measure(&shots).pairs, measure(&shots).change), (0, None));
    }
    let bad = vec![f32::NAN; n];
    let shots = [&still, &bad].map(|test| Shot { test, truth: &still, mask: &mask });
    let text = motion(&shots, size, 3).unwrap_err().to_string();
    assert!(text.contains("frame 1") && text.contains("NaN"), "{text}");
}
