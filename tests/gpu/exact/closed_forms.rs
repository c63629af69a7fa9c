//! Rectangles under a square light, parallel to it: each hides a rectangle of the light, whose area is known.

use super::{MAP, SIZE};
use crate::common::{desc, visibility, with_gpu};
use crate::made::{self, mesh, moved, perspective, plane};
use crate::properties::hits;
use edgeshade::scene::{Mesh, Renderer};
use edgeshade::view::{LightView, look_along};
use glam::{DAffine3, DVec2, DVec3, dvec2, dvec3};

/// Height of the light over the ground, and its side.
const ABOVE: f64 = 8.0;
const SIDE: f64 = 1.6;

/// A rectangle at a height: two corners, x and z.
type Rectangle = (f64, [f64; 2], [f64; 2]);

fn card(&(y, [x0, z0], [x1, z1]): &Rectangle) -> Mesh {
    let [a, b, c, d] = [[x0, z0], [x0, z1], [x1, z1], [x1, z0]].map(|[x, z]| dvec3(x, y, z));
    mesh(&[[a, b, c], [a, c, d]])
}

/// Returns the part of the light, in [-1, 1], that a card hides from a point of the ground.
fn shadow(&(y, low, high): &Rectangle, p: DVec2) -> [DVec2; 2] {
    let on_light = |corner: [f64; 2]| (p + (DVec2::from(corner) - p) * ABOVE / y) / (0.5 * SIDE);
    [on_light(low), on_light(high)].map(|q| q.clamp(DVec2::splat(-1.0), DVec2::splat(1.0)))
}

/// Returns the share of the light outside all rectangles: a sum over the grid that their sides span.
fn outside(rectangles: &[[DVec2; 2]]) -> f64 {
    let lines = |axis: usize| {
        let mut all = vec![-1.0, 1.0];
        all.extend(rectangles.iter().flatten().map(|q| q[axis]));
        all.sort_by(f64::total_cmp);
        all
    };
    let (xs, ys) = (lines(0), lines(1));
    let mut area = 0.0;
    for x in xs.windows(2) {
        for y in ys.windows(2) {
            let middle = 0.5 * dvec2(x[0] + x[1], y[0] + y[1]);
            let hidden = |[low, high]: &[DVec2; 2]| low.cmple(middle).all() && middle.cmple(*high).all();
            if !rectangles.iter().any(hidden) {
                area += (x[1] - x[0]) * (y[1] - y[0]);
            }
        }
    }
    area / 4.0
}

/// Bound of the error. What a rectangle hides is a signed sum of four boxes between a corner of the light and the
/// rectangle's corners. The 256 samples have 256 different places along both axes, so a box as wide or as high as the light
/// is off by at most one sample; any other box by less than five, the largest discrepancy of the 256 places.
fn bound(shadows: &[[DVec2; 2]]) -> f64 {
    let is_inside = |v: f64| v.abs() < 1.0;
    let corner = |x: f64, y: f64| match (is_inside(x), is_inside(y)) {
        (true, true) => 5.0,
        (false, false) => 0.0,
        _ => 1.0,
    };
    let rectangle = |low: DVec2, high: DVec2| match (high - low).min_element() > 0.0 {
        true => corner(low.x, low.y) + corner(high.x, low.y) + corner(low.x, high.y) + corner(high.x, high.y),
        false => 0.0,
    };
    let mut samples: f64 = shadows.iter().map(|&[low, high]| rectangle(low, high)).sum();
    // The union of two rectangles is their sum less what they share.
    if let [[a, b], [c, d]] = *shadows {
        samples += rectangle(a.max(c), b.min(d));
    }
    samples / 256.0 + 1e-4
}

const WIDE: f64 = 30.0;

fn cases() -> Vec<(&'static str, Vec<Rectangle>)> {
    vec![
        ("half-plane across rows", vec![(2.0, [0.1, -WIDE], [WIDE, WIDE])]),
        ("half-plane along rows", vec![(2.0, [-WIDE, 0.1], [WIDE, WIDE])]),
        ("square", vec![(2.0, [-0.8, -0.7], [0.9, 0.6])]),
        ("bar thinner than its penumbra", vec![(3.0, [-0.07, -WIDE], [0.06, WIDE])]),
        ("crossing bars", vec![(2.0, [-1.5, -0.2], [1.4, 0.25]), (2.7, [-0.15, -1.3], [0.3, 1.4])]),
        ("nested squares", vec![(1.5, [-1.0, -1.0], [1.0, 1.0]), (2.5, [-0.5, -0.4], [0.5, 0.45])]),
        ("squares side by side", vec![(2.0, [-0.8, -0.5], [0.0, 0.5]), (2.0, [0.0, -0.5], [0.8, 0.5])]),
    ]
}

#[test]
fn rectangles_hide_what_similar_triangles_say() {
    with_gpu(|host| {
        let mut failed = vec![];
        for (name, cards) in cases() {
            let parts = std::iter::once((plane(40.0), moved(DVec3::ZERO)))
                .chain(cards.iter().map(|c| (card(c), DAffine3::IDENTITY)))
                .collect();
            // From beside and below the cards.
            let camera = perspective(dvec3(-4.0, 1.3, 1.0), dvec3(0.0, 0.0, 0.1), 0.05);
            let scene = made::scene(parts, camera, made::sun(DVec3::Y));
            let at = look_along(ABOVE * DVec3::Y, DVec3::NEG_Y);
            let light = LightView::spot(at, 1.4, 0.5, 20.0, SIDE);
            let camera = scene.cameras[0].view(SIZE);
            let mut r = Renderer::new(host, &scene, camera, &scene.lights[0], desc(SIZE, MAP)).unwrap();
            r.set_light(&scene, light);
            let seen = visibility(&mut r, "exact-soft", &[]);
            let (mut pixels, mut partly, mut largest, mut over, mut planted) = (0, 0, 0.0f64, 0, 0);
            for (i, hit) in hits(&scene, &r, SIZE).into_iter().enumerate() {
                let Some(hit) = hit.filter(|hit| hit.triangle < 2) else { continue };
                let p = dvec2(hit.position.x, hit.position.z);
                if p.abs().max_element() > 4.0 {
                    continue;
                }
                let shadows: Vec<_> = cards.iter().map(|c| shadow(c, p)).collect();
                let expected = outside(&shadows);
                let off = (f64::from(seen[i]) - expected).abs();
                pixels += 1;
                partly += usize::from(expected > 0.0 && expected < 1.0);
                largest = largest.max(off);
                over += usize::from(off > bound(&shadows));
                // A light a twentieth larger is noticed.
                let larger: Vec<_> = cards.iter().map(|c| shadow(c, 1.05 * p)).collect();
                planted += usize::from((f64::from(seen[i]) - outside(&larger)).abs() > bound(&larger));
            }
            println!(
                "{name:32} {pixels} pixels, {partly} in a penumbra, largest error {:.2}/256, {over} over the bound, {planted} over a wrong one",
                256.0 * largest
            );
            assert!(partly > 200 && planted > 20, "{name}: {partly}, {planted}");
            if over > 0 {
                failed.push(format!("{name}: {over} pixels over the bound"));
            }
        }
        assert!(failed.is_empty(), "{}", failed.join("\n"));
    });
}
