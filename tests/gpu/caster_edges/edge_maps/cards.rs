//! Cut-outs over a ground and shipped scenes, compared with ray-traced truth and with plain shadow mapping.

use crate::common::passes::Random;
use crate::common::{desc, renderer, shipped_scene, visibility, with_gpu};
use crate::made::{self, mesh, moved, perspective, plane, sun};
use edgeshade::host::Host;
use edgeshade::reference::ray_traced::{RayScene, hard};
use edgeshade::scene::Scene;
use glam::{DAffine3, DVec2, DVec3, dvec2, dvec3};

const SIZE: [u32; 2] = [320, 240];

type Triangles = Vec<[DVec2; 3]>;

/// Returns a star whose tips start at a given inner radius.
fn star(tips: u32, inner: f64) -> Triangles {
    let at = |k: u32, r: f64| r * DVec2::from_angle(std::f64::consts::PI * f64::from(k) / f64::from(tips) + 0.1);
    (0..tips)
        .flat_map(|t| {
            let (a, b, c) = (at(2 * t, inner), at(2 * t + 1, 2.0), at(2 * t + 2, inner));
            [[a, b, c], [DVec2::ZERO, a, c]]
        })
        .collect()
}

fn rectangle(middle: DVec2, half: DVec2, angle: f64) -> Triangles {
    let p = |x: f64, y: f64| middle + DVec2::from_angle(angle).rotate(half * dvec2(x, y));
    let (a, b, c, d) = (p(-1.0, -1.0), p(1.0, -1.0), p(1.0, 1.0), p(-1.0, 1.0));
    vec![[a, b, c], [a, c, d]]
}

fn random_triangles(count: u32, size: f64) -> Triangles {
    let mut random = Random(u64::from(count));
    let mut unit = || 2.0 * f64::from(random.unit()) - 1.0;
    (0..count)
        .map(|_| {
            let middle = 2.0 * dvec2(unit(), unit());
            [0; 3].map(|_| middle + size * dvec2(unit(), unit()))
        })
        .collect()
}

/// Returns a scene of cards above the ground, one for each list of triangles.
fn scene(cards: Vec<Triangles>) -> Scene {
    let card = |(i, t): (usize, Triangles)| {
        let flat: Vec<[DVec3; 3]> = t.iter().map(|t| t.map(|p| dvec3(p.x, 0.0, p.y))).collect();
        (mesh(&flat), moved(dvec3(0.0, 2.0 + 1e-3 * i as f64, 0.0)))
    };
    let ground = (plane(6.0), DAffine3::IDENTITY);
    let parts = std::iter::once(ground).chain(cards.into_iter().enumerate().map(card)).collect();
    // The camera looks from below the cards.
    made::scene(parts, perspective(dvec3(-3.5, 1.7, 3.5), dvec3(-0.6, 0.0, 0.6), 0.05), sun(dvec3(-0.25, 1.0, 0.2)))
}

/// Returns bars 0.7 texels wide with gaps of 1.9 texels; a texel is at most 1/8 wide.
fn bars() -> Triangles {
    (-8..=8).flat_map(|k| rectangle(dvec2(0.33 * f64::from(k), 0.0), dvec2(0.045, 2.0), 0.3)).collect()
}

/// Returns the percentage of wrong pixels among those that count.
fn wrong(host: &Host, scene: &Scene, map: u32, modes: &[Mode]) -> Vec<f64> {
    let mut r = renderer(host, scene, desc(SIZE, map));
    let rays = RayScene::build(scene).unwrap();
    let seen: Vec<_> = modes.iter().map(|(id, settings)| visibility(&mut r, id, settings)).collect();
    let truth = hard(&rays, r.camera(), r.light(), SIZE, &|_, _| {}).unwrap();
    let counts = truth.judged(&host.read_image::<u32>(&r.gbuffer().triangle).unwrap());
    let all = counts.iter().filter(|c| **c).count();
    let off =
        |v: &[f32]| (0..v.len()).filter(|&i| counts[i] && (v[i] < 0.5) != (truth.visibility[i] < 0.5)).count() as f64;
    seen.iter().map(|v| 100.0 * off(v) / all as f64).collect()
}

type Mode = (&'static str, &'static [(&'static str, &'static str)]);
const MODES: &[Mode] = &[
    ("sm", &[]),
    ("rbsm-star", &[]),
    ("sssm", &[]),
    ("sssm", &[("kill", "off")]),
    ("edsm", &[]),
    ("edsm", &[("priority", "cosine")]),
    ("edsm", &[("kill", "off")]),
];

fn header() {
    println!(
        "wrong pixels, %       {}",
        MODES.iter().map(|m| format!(" {:>10}{:10}", m.0, m.1.first().map_or("", |s| s.1))).collect::<String>()
    );
}

fn row(name: &str, values: &[f64]) {
    println!("{name:22}{}", values.iter().map(|v| format!(" {v:10.3}          ")).collect::<String>());
}

/// Checks that, by default, both techniques have at most the fraction `most` of plain shadow mapping's wrong pixels,
/// `sssm` first.
fn check(name: &str, values: &[f64], most: [f64; 2]) {
    for (i, most) in [2, 4].into_iter().zip(most) {
        let (of, own, sm) = (MODES[i].0, values[i], values[0]);
        assert!(own <= most * sm, "{name}: {of} has {own:.3} %, sm {sm:.3} %");
    }
}

#[test]
fn cut_outs_are_better_than_plain_shadow_mapping() {
    with_gpu(|host| {
        let shapes: [(&str, Vec<Triangles>, f64); 6] = [
            ("star, 5 sharp tips", vec![star(5, 0.6)], 0.35),
            ("star, 16 needles", vec![star(16, 0.8)], 0.7),
            ("bars of 0.7 texels", vec![bars()], 1.0),
            (
                "crossing rectangles",
                vec![
                    rectangle(dvec2(0.0, 0.0), dvec2(1.9, 0.4), 0.35),
                    rectangle(dvec2(0.1, 0.1), dvec2(0.35, 1.8), 0.2),
                ],
                0.45,
            ),
            ("40 triangles", random_triangles(40, 0.9).into_iter().map(|t| vec![t]).collect(), 1.0),
            ("250 small triangles", random_triangles(250, 0.3).into_iter().map(|t| vec![t]).collect(), 1.1),
        ];
        header();
        for (name, cards, most) in shapes {
            let values = wrong(host, &scene(cards), 96, MODES);
            row(name, &values);
            assert!(values[0] > 0.3, "{name}: no stairs");
            check(name, &values, [most; 2]);
        }
    });
}

#[test]
fn shipped_scenes_are_better_than_plain_shadow_mapping() {
    with_gpu(|host| {
        header();
        // Most bars of the fence are narrower than two texels, and a texel keeps only one of the two edges in its
        // cell.
        for (name, most) in [("fence", [0.6, 0.85]), ("jenga", [0.5; 2]), ("drum", [0.5; 2])] {
            let values = wrong(host, &shipped_scene(name), 512, MODES);
            row(name, &values);
            check(name, &values, most);
        }
    });
}
