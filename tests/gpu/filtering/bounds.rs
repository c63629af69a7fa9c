//! Bounds from moments equal their closed forms, and lie on their side of the truth.

use super::moments::params;
use crate::common::{assert_in_range, with_gpu};
use crate::noise::visibility_of;
use crate::soft::ground::{Ground, IMAGE, MAP, UNDER_NOISE, noise, on_ground, upload};
use edgeshade::host::Host;
use edgeshade::reference::filtering::moments::signed_depth;
use edgeshade::technique::filtering::{moment_kind, vsm};

/// No stretching, no bias, so that the bound itself is seen.
const PLAIN: [(&str, &str); 5] =
    [("reduction", "0"), ("normal_offset", "0"), ("depth_bias", "0"), ("mips", "off"), ("fetch", "texels")];

fn plain(width: &str, more: &[(&'static str, &'static str)]) -> Vec<(&'static str, &'static str)> {
    let mut all = PLAIN.to_vec();
    all.retain(|(name, _)| more.iter().all(|m| m.0 != *name));
    all.push(("width", width.to_owned().leak()));
    all.extend(more);
    all
}

fn seen(host: &Host, ground: &Ground, id: &str, set: &[(&str, &str)], map: &[f32]) -> Vec<f32> {
    let map = upload(host, map);
    visibility_of(host, on_ground(host, id, params(id, set)).as_mut(), &ground.inputs(&map))
}

/// Position of a pixel of the image's middle row in the map, texels from the left.
fn place(ground: &Ground, pixel: usize) -> f64 {
    ground.x(pixel) / ground.texel() + 0.5 * f64::from(MAP[0])
}

/// Share of a box of `width` texels, slid by bilinear interpolation, that lies to the right of texel `edge`.
fn share_right(at: f64, edge: f64, width: f64) -> f64 {
    let mean = |texel: f64| ((texel + 0.5 * width + 0.5 - edge) / width).clamp(0.0, 1.0);
    let first = (at - 0.5).floor();
    let f = at - 0.5 - first;
    (1.0 - f) * mean(first) + f * mean(first + 1.0)
}

/// The receiver's signed depth and a stored one's, as the techniques have them.
fn depths(ground: &Ground, blocker: f64) -> (f64, f64) {
    let range = moment_kind::range(&ground.light[0]);
    // The bias that the shaders share.
    let bias = 4.0 / 8388608.0;
    (
        signed_depth(f64::from(ground.stored(Ground::distance())) - bias, range),
        signed_depth(ground.stored(blocker).into(), range),
    )
}

/// An occluder over half of the map, before a receiver that is the only other thing: the step, as wide as the window, is
/// exact for four moments, and Chebyshev's bound for two.
#[test]
fn a_single_occluder_over_a_plane_gives_closed_forms() {
    with_gpu(|host| {
        for (is_spot, width) in [(true, "3"), (false, "3"), (true, "9"), (false, "15")] {
            let ground = Ground::new(host, is_spot, 0.0, 0.0);
            let (receiver, blocker) = (ground.stored(Ground::distance()), ground.stored(6.0));
            let half = MAP[0] / 2;
            let map: Vec<f32> =
                (0..MAP[0] * MAP[1]).map(|i| if i % MAP[0] < half { blocker } else { receiver }).collect();
            let (t, occluder) = depths(&ground, 6.0);
            let behind = signed_depth(receiver.into(), moment_kind::range(&ground.light[0]));
            let w: f64 = width.parse().unwrap();
            let worst = |gpu: &[f32], expected: &dyn Fn(f64) -> f64| {
                let mut worst = 0.0f64;
                for x in 0..IMAGE[0] as usize {
                    let pixel = (IMAGE[1] / 2 * IMAGE[0]) as usize + x;
                    // Away from the map's rim, beyond which everything is lit.
                    let at = place(&ground, pixel);
                    if at > w && at < f64::from(MAP[0]) - w {
                        let lit = share_right(at, f64::from(half), w);
                        worst = worst.max((f64::from(gpu[pixel]) - expected(lit)).abs());
                    }
                }
                worst
            };
            for bits in ["32", "16"] {
                let gpu = seen(host, &ground, "msm", &plain(width, &[("bits", bits)]), &map);
                let found = worst(&gpu, &|lit| lit);
                println!("msm {bits} bits, spot {is_spot}, width {width}: off the step by {found:.1e}");
                // Sixteen bits need a bias that lets a tenth of the light through.
                let allowed = if bits == "32" { 0.02 } else { 0.15 };
                assert!(found < allowed, "{found}");
                assert!(worst(&gpu, &|lit| (lit + 0.2).min(1.0)) > 0.15);
            }
            let set = plain(width, &[]);
            let gpu = seen(host, &ground, "vsm", &set, &map);
            let least = f64::from(vsm::least_deviation(&params("vsm", &set))).powi(2);
            let chebyshev = |lit: f64| {
                let mean = lit * behind + (1.0 - lit) * occluder;
                let variance = (lit * (1.0 - lit) * (behind - occluder).powi(2)).max(least);
                if t <= mean { 1.0 } else { variance / (variance + (t - mean).powi(2)) }
            };
            let found = worst(&gpu, &chebyshev);
            println!("vsm, spot {is_spot}, width {width}: off Chebyshev's bound by {found:.1e}");
            assert!(found < 2e-3, "{found}");
            assert!(worst(&gpu, &|lit| chebyshev((lit + 0.05).min(1.0))) > 0.02);
        }
    });
}

/// Two layers before a receiver: light leaks through two moments by the closed form, hardly through warped or four ones.
#[test]
fn light_leaks_where_two_layers_overlap() {
    with_gpu(|host| {
        let ground = Ground::new(host, false, 0.0, 0.0);
        let (upper, lower) = (ground.stored(3.0), ground.stored(8.0));
        let half = MAP[0] / 2;
        let map: Vec<f32> = (0..MAP[0] * MAP[1]).map(|i| if i % MAP[0] < half { upper } else { lower }).collect();
        let [(t, a), (_, b)] = [3.0, 8.0].map(|d| depths(&ground, d));
        let leaked = |id: &str, more: &[(&'static str, &'static str)]| {
            let gpu = seen(host, &ground, id, &plain("15", more), &map);
            let row = (IMAGE[1] / 2 * IMAGE[0]) as usize;
            let mut all = vec![];
            for (pixel, &v) in gpu.iter().enumerate().skip(row).take(IMAGE[0] as usize) {
                let at = place(&ground, pixel);
                if at > 16.0 && at < f64::from(MAP[0]) - 16.0 {
                    let q = share_right(at, f64::from(half), 15.0);
                    let variance = q * (1.0 - q) * (b - a) * (b - a);
                    let expected = variance / (variance + (t - (1.0 - q) * a - q * b).powi(2));
                    all.push((f64::from(v), expected));
                }
            }
            all
        };
        let most = |all: &[(f64, f64)]| all.iter().map(|v| v.0).fold(0.0, f64::max);
        let plain = leaked("vsm", &[]);
        let off = plain.iter().map(|(v, e)| (v - e).abs()).fold(0.0, f64::max);
        println!("vsm leaks up to {:.3}, off the closed form by {off:.1e}", most(&plain));
        assert!(off < 2e-3, "{off}");
        assert!(most(&plain) > 0.3);
        for (id, more, allowed) in [("evsm", &[][..], 1e-3), ("msm", &[], 0.02), ("vsm", &[("reduction", "0.6")], 0.0)]
        {
            let leak = most(&leaked(id, more));
            println!("{id} {more:?} leaks up to {leak:.4}");
            assert!(leak <= allowed, "{id} {more:?}: {leak}");
        }
    });
}

/// A map of one depth: in front of it everything is lit, far behind it nothing, by the least variance in between.
#[test]
fn a_constant_map_gives_closed_forms() {
    with_gpu(|host| {
        for is_spot in [true, false] {
            let ground = Ground::new(host, is_spot, 0.0, 0.0);
            for (depth, expected) in [(1.0, 1.0), (ground.stored(12.0), 1.0), (ground.stored(6.0), 0.0), (0.0, 0.0)] {
                for id in ["vsm", "evsm", "msm"] {
                    for more in [&[("filter", "box")][..], &[("filter", "gaussian"), ("reduction", "0.05")]] {
                        let gpu = seen(host, &ground, id, &plain("5", more), &vec![depth; (MAP[0] * MAP[1]) as usize]);
                        // Beside the map's rim everything else is lit.
                        let (x, y) = (IMAGE[0] / 4..IMAGE[0] * 3 / 4, IMAGE[1] / 3..IMAGE[1] * 2 / 3);
                        let inner = y.flat_map(|y| x.clone().map(move |x| (y * IMAGE[0] + x) as usize));
                        let worst = inner.map(|i| (f64::from(gpu[i]) - expected).abs()).fold(0.0, f64::max);
                        println!("{id} {more:?} spot {is_spot} at {depth}: off by {worst:.1e}");
                        // The least variance lets 1e-4 of the light through behind an occluder, the moment bias 1e-2.
                        assert!(worst <= if id == "msm" { 1e-2 } else { 1e-3 }, "{id} {more:?} {depth}: {worst}");
                    }
                }
            }
        }
    });
}

/// On noise: the bounds lie above the true share of lit texels, the tighter ones below the others, and all are numbers.
#[test]
fn bounds_lie_on_their_side_of_the_truth() {
    with_gpu(|host| {
        for (k, (is_spot, size, tilt)) in UNDER_NOISE.into_iter().enumerate() {
            let ground = Ground::new(host, is_spot, size, tilt);
            let texels = noise(&ground, k as u64);
            let see = |id: &str, more: &[(&'static str, &'static str)]| {
                let gpu = seen(host, &ground, id, &plain("5", more), &texels);
                assert_in_range(&gpu, &format!("{id} {more:?}"));
                gpu
            };
            let vsm = see("vsm", &[]);
            let evsm = see("evsm", &[]);
            let one_warp = see("evsm", &[("warps", "positive")]);
            let hamburger = see("msm", &[]);
            let hausdorff = see("msm", &[("reconstruction", "hausdorff")]);
            see("msm", &[("bits", "16")]);
            see("evsm", &[("bits", "16")]);
            let above = |a: &[f32], b: &[f32], by: f32| a.iter().zip(b).filter(|(a, b)| **a > **b + by).count();
            assert_eq!(above(&evsm, &one_warp, 1e-5), 0, "the second warp only takes light away");
            assert_eq!(above(&hausdorff, &hamburger, 1e-5), 0, "fewer distributions, more shadow for certain");
            assert!(above(&hamburger, &hausdorff, 1e-3) > 20, "both reconstructions are the same");
            // Exact shares of the texels that are not in front of the receiver.
            if tilt == 0.0 {
                let (t, _) = depths(&ground, 6.0);
                let range = moment_kind::range(&ground.light[0]);
                let lit = |x: i64, y: i64| {
                    let inside = (0..i64::from(MAP[0])).contains(&x) && (0..i64::from(MAP[1])).contains(&y);
                    let d = if inside { texels[(y * i64::from(MAP[0]) + x) as usize] } else { 1.0 };
                    f64::from(u8::from(signed_depth(d.into(), range) >= t))
                };
                let view_y = |pixel: usize| {
                    // Both views have the same aspect, or the light's is square.
                    let y = (2.0 * (pixel / IMAGE[0] as usize) as f64 + 1.0) / f64::from(IMAGE[1]) - 1.0;
                    let p = ground.light[0].clip_from_view
                        * glam::dvec4(0.0, -y * 4.0 * f64::from(MAP[1]) / f64::from(MAP[0]), -Ground::distance(), 1.0);
                    (0.5 * p.y / p.w + 0.5) * f64::from(MAP[1])
                };
                let (mut below, mut least) = ([0; 3], 1.0f64);
                for pixel in (0..vsm.len()).step_by(7) {
                    let (u, v) = (place(&ground, pixel) - 0.5, view_y(pixel) - 0.5);
                    // The lookup does not go beyond the middle of the map's last texel.
                    let last = MAP.map(|n| f64::from(n - 1));
                    if u < 0.0 || v < 0.0 || u > last[0] || v > last[1] {
                        continue;
                    }
                    let mut share = 0.0;
                    for (x, wx) in [(u.floor(), 1.0 - u.fract()), (u.floor() + 1.0, u.fract())] {
                        for (y, wy) in [(v.floor(), 1.0 - v.fract()), (v.floor() + 1.0, v.fract())] {
                            let sum: f64 = (-2..=2)
                                .flat_map(|j| (-2..=2).map(move |i| (i, j)))
                                .map(|(i, j)| lit(x as i64 + i, y as i64 + j))
                                .sum();
                            share += wx * wy * sum / 25.0;
                        }
                    }
                    for (c, gpu) in [&vsm, &evsm, &hamburger].into_iter().enumerate() {
                        below[c] += usize::from(f64::from(gpu[pixel]) < share - 5e-3);
                    }
                    least = least.min(share);
                }
                println!("spot {is_spot} {size}: below the truth vsm, evsm, msm: {below:?}");
                assert_eq!(below, [0; 3], "a bound from above lies below");
                assert!(least < 0.1, "nothing is in shadow");
            }
        }
    });
}
