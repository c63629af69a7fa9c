//! Small patterns with values computed by hand, and properties that hold for any pattern.

use super::*;
use glam::{DVec3, DVec4, dvec2};

const FUNCTIONS: [Function; 6] = [
    Function::Silhouette,
    Function::Filtered,
    Function::Star,
    Function::Profile(Quality::Run),
    Function::Profile(Quality::Neighbours),
    Function::Profile(Quality::Line),
];
const RUN: Function = Function::Profile(Quality::Run);

/// Returns a pattern in which `#` is shadow. The upper left texel is 0, 0; texels outside repeat the nearest one
/// inside.
fn pattern(rows: &'static [&'static str]) -> impl Texels {
    move |[x, y]: [i64; 2]| {
        let row = rows[y.clamp(0, rows.len() as i64 - 1) as usize].as_bytes();
        row[x.clamp(0, row.len() as i64 - 1) as usize] != b'#'
    }
}

/// Runs of 4 texels that rise to the right.
const STEPS: [&str; 4] = ["............", "........####", "....########", "############"];

/// Returns a reproducible source of random numbers in `[0, 1)`.
fn random(seed: u64) -> impl FnMut() -> f64 {
    use rand_pcg::rand_core::Rng as _;
    let mut pcg = rand_pcg::Pcg64::new(seed.into(), 0);
    move || (pcg.next_u64() >> 11) as f64 / (1u64 << 53) as f64
}

/// Returns the tests of a random pattern that repeats every 16 x 16 texels: from noise to blobs.
fn random_pattern(seed: u64) -> impl Fn([i64; 2]) -> bool + Copy {
    let mut next = random(seed);
    let mut bits = [[false; 16]; 16];
    let share = 0.15 + 0.7 * next();
    bits.iter_mut().flatten().for_each(|b| *b = next() < share);
    for _ in 0..(3.0 * next()) as usize {
        let old = bits;
        let count = |x: usize, y: usize| (0..9).filter(|i| old[(y + 15 + i / 3) % 16][(x + 15 + i % 3) % 16]).count();
        (0..256).for_each(|i| bits[i / 16][i % 16] = count(i % 16, i / 16) > 4);
    }
    move |[x, y]| bits[y.rem_euclid(16) as usize][x.rem_euclid(16) as usize]
}

fn near(a: f64, b: f64) -> bool {
    a == b || (a - b).abs() < 1e-12
}

#[track_caller]
fn check(texels: &impl Texels, texel: [i64; 2], at: [f64; 2], expected: [(Function, f64, f64); 4]) {
    for (function, value, margin) in expected {
        let o = visibility(texels, texel, at.into(), function, 16);
        assert!(near(o.visibility, value) && near(o.margin, margin), "{function:?} {o:?}, not {value} {margin}");
    }
}

const SURE: f64 = f64::INFINITY;

#[test]
fn the_lit_side_of_a_step() {
    let steps = pattern(&STEPS);
    let d = discontinuity(&steps, [5, 1]);
    assert_eq!((d, d.packed()), (Discontinuity { mask: 4, lit: true }, DVec3::new(0.0, 0.5, 0.0)));
    let traversal = traverse_all(&steps, [5, 1], d, 16);
    assert_eq!(traversal, [-2, 3, 1, -1]);
    let distance = distance_to_edge(dvec2(0.25, 0.25), traversal);
    assert_eq!(distance, DVec4::new(-1.25, 2.75, 0.75, -0.25));
    assert_eq!(normalized(distance, traversal), DVec4::new(0.6875, 0.75, 0.0, 0.0));
    // The lines fall by one texel over the 4 of the run.
    let per = 1.0f64.hypot(0.25);
    check(
        &steps,
        [5, 1],
        [0.25, 0.25],
        [
            (Function::Silhouette, 1.0, 0.4375 / per),
            (Function::Filtered, 1.0, SURE),
            (Function::Star, 1.0, 0.9375 / per),
            (RUN, 1.0, 0.9375 / per),
        ],
    );
    check(
        &steps,
        [7, 1],
        [0.75, 0.9],
        [
            (Function::Silhouette, 0.0, 0.8375 / per),
            (Function::Filtered, 0.1625, SURE),
            (Function::Star, 0.0, 0.3375 / per),
            (RUN, 0.0, 0.3375 / per),
        ],
    );
    // On the line of equation 7 the point is lit, with no margin.
    check(
        &steps,
        [6, 1],
        [0.5, 0.875],
        [
            (Function::Silhouette, 0.0, 0.5 / per),
            (Function::Filtered, 0.5, SURE),
            (Function::Star, 1.0, 0.0),
            (RUN, 1.0, 0.0),
        ],
    );
}

#[test]
fn the_dark_side_of_a_step() {
    let steps = pattern(&STEPS);
    let d = discontinuity(&steps, [5, 2]);
    assert_eq!((d, d.packed()), (Discontinuity { mask: 8, lit: false }, DVec3::new(0.0, 0.25, 1.0)));
    assert_eq!(traverse_all(&steps, [5, 2], d, 16), [2, -3, -1, 1]);
    let per = 1.0f64.hypot(0.25);
    let expected = |filtered, sum: f64| {
        let lit = f64::from(u8::from(sum < 0.5));
        [
            (Function::Silhouette, 0.0, SURE),
            (Function::Filtered, filtered, SURE),
            (Function::Star, lit, (sum - 0.5).abs() / per),
            (RUN, lit, (sum - 0.5).abs() / per),
        ]
    };
    check(&steps, [5, 2], [0.25, 0.25], expected(0.4375, 0.5625));
    check(&steps, [5, 2], [0.25, 0.1], expected(0.5875, 0.4125));
}

#[test]
fn the_run_of_a_step() {
    let steps = pattern(&STEPS);
    let crack = Crack { texel: [5, 1], side: Side::PlusV, lit: true };
    let run = run(&steps, crack, 16);
    assert_eq!(run, Run { before: 1, after: 2, ends: [End::Away, End::Toward], big: [false; 2] });
    for (u, height) in [(0.0, -0.5), (2.0, 0.0), (3.0, 0.25), (4.0, 0.5)] {
        assert!(near(profile_height(&run, u, 16, None, [None; 2]), height));
    }
    // The adjacent runs continue beyond all distances.
    let next = next_door(&steps, crack, &run, 16);
    assert_eq!(next.map(|n| n.end), [End::Unknown; 2]);
    assert_eq!(profile_curve(&run, Some(next), [None; 2], 16), Curve::Line { heights: [-0.5, 0.5] });
    // The same from the right: steps in the opposite direction.
    let mirrored = |[x, y]: [i64; 2]| steps.lit([11 - x, y]);
    let run = super::run(&mirrored, Crack { texel: [6, 1], ..crack }, 16);
    assert_eq!(run, Run { before: 2, after: 1, ends: [End::Toward, End::Away], big: [false; 2] });
}

#[test]
fn the_runs_next_door_tilt_and_bow() {
    let run = |ends| Run { before: 1, after: 2, ends, big: [false; 2] };
    let next = |length, end| NextDoor { length, end };
    let z = run([End::Away, End::Toward]);
    let curve = |run, a, b| profile_curve(&run, Some([a, b]), [None; 2], 16);
    let heights = |curve| match curve {
        Curve::Line { heights } => heights,
        other => panic!("{other:?}"),
    };
    let [a, b] = heights(curve(z, next(5, End::Away), next(3, End::Toward)));
    assert!(near(a, -0.5 + 0.66 / 9.0) && near(b, 0.5 + 0.66 / 7.0), "{a} {b}");
    // Adjacent runs of another kind, or of a very different length, have no effect.
    assert_eq!(heights(curve(z, next(5, End::Toward), next(6, End::Toward))), [-0.5, 0.5]);
    assert_eq!(heights(curve(z, NextDoor::NONE, next(2, End::Toward))), [-0.5, 0.5]);
    // A line's height takes precedence over those, within half a texel.
    let lines = [Some(-1.3), Some(0.6)];
    assert_eq!(heights(profile_curve(&z, Some([next(5, End::Away), NextDoor::NONE]), lines, 16)), [-1.0, 0.6]);

    // A bow of 4 texels has the peak 1/8 by its length. Runs of 2 texels on both sides ask for 1 / (2^2 - 1) - 1/2.
    // Then the weights of the two are 0.3 and 0.7.
    let u = run([End::Toward; 2]);
    let Curve::Bow { height, depth } = curve(u, NextDoor::NONE, next(2, End::Toward)) else { panic!() };
    assert!(near(height, 0.5) && near(depth, 0.625));
    let Curve::Bow { depth, .. } = curve(u, next(2, End::Toward), next(2, End::Toward)) else { panic!() };
    assert!(near(depth, 0.5 + 0.3 * 0.125 + 0.7 * (1.0 / 3.0 - 0.5)));
    let hump = run([End::Away; 2]);
    let Curve::Bow { height, depth } = curve(hump, NextDoor::NONE, NextDoor::NONE) else { panic!() };
    assert!(near(height, -0.5) && near(depth, -0.625));
    let middle = profile_height(&hump, 2.0, 16, None, [None; 2]);
    assert!(near(middle, 0.125) && near(profile_height(&hump, 4.0, 16, None, [None; 2]), -0.5));
}

/// The boundary rises by steps of 3, 3 and 2 texels between two plains. `top` gives its row in each column.
#[test]
fn the_runs_next_door_are_found() {
    let top = |x: i64| match x {
        ..0 => 9,
        0..3 => 8,
        3..6 => 7,
        6..8 => 6,
        _ => 5,
    };
    let lit = |[x, y]: [i64; 2]| y < top(x);
    for (texel, side, is_lit) in [([4, 6], Side::PlusV, true), ([4, 7], Side::MinusV, false)] {
        let crack = Crack { texel, side, lit: is_lit };
        let run = run(&lit, crack, 16);
        let (a, b) = if is_lit { (End::Away, End::Toward) } else { (End::Toward, End::Away) };
        assert_eq!((run.before, run.after, run.ends), (1, 1, [a, b]));
        let next = next_door(&lit, crack, &run, 16);
        assert_eq!(next, [NextDoor { length: 3, end: a }, NextDoor { length: 2, end: b }]);
        // The search stops at the largest distance.
        assert_eq!(next_door(&lit, crack, &run, 2)[0], NextDoor { length: 3, end: End::Unknown });
    }
}

#[test]
fn i_shapes_keep_the_test() {
    let lit = |[_, y]: [i64; 2]| y < 0;
    for at in [[0.0, 0.0], [0.5, 0.01], [0.99, 0.99]] {
        let keep = |v| [Function::Silhouette, Function::Filtered, Function::Star, RUN].map(|f| (f, v, SURE));
        check(&lit, [7, -1], at, keep(1.0));
        check(&lit, [7, 0], at, keep(0.0));
        check(&lit, [7, 5], at, keep(0.0));
    }
    let d = discontinuity(&lit, [7, -1]);
    assert_eq!(traverse_all(&lit, [7, -1], d, 16), [-17, -17, 1, -1]);
    assert_eq!(run(&lit, Crack { texel: [7, -1], side: Side::PlusV, lit: true }, 16).ends, [End::Unknown; 2]);
}

#[test]
fn a_step_with_one_end_fades() {
    let lit = |[x, y]: [i64; 2]| y < i64::from(x < 0);
    let crack = Crack { texel: [-3, 0], side: Side::PlusV, lit: true };
    let run = run(&lit, crack, 16);
    assert_eq!(run, Run { before: 16, after: 2, ends: [End::Unknown, End::Toward], big: [false; 2] });
    // The point is 2.5 texels from the end.
    assert!(near(profile_height(&run, 16.5, 16, None, [None; 2]), 0.5 * (1.0 - 2.5 / 16.0)));
    assert_eq!(profile_height(&run, 0.0, 16, None, [None; 2]), 0.0);
    // Listing 3 steps out after 16 more texels: 19 texels in all, with 2.5 to the end.
    let o = visibility(&lit, [-3, 0], dvec2(0.5, 0.9), Function::Filtered, 16);
    assert!(near(o.visibility, 2.5 / 19.0 + 0.1), "{o:?}");
}

#[test]
fn u_and_o_shapes() {
    // A closed slit of three texels: first lit in the dark, then dark in the light.
    let slit = pattern(&["#####", "#...#", "#####"]);
    check(
        &slit,
        [2, 1],
        [0.5, 0.2],
        [
            (Function::Silhouette, 0.0, SURE),
            (Function::Filtered, 0.0, SURE),
            (Function::Star, 1.0, SURE),
            // Bows of 3 texels: 1/12 beyond the sides in the middle.
            (RUN, 1.0, (0.2 + 1.0 / 12.0) / 1.0f64.hypot(4.0 / 3.0 * (0.75 - 1.0 / 6.0))),
        ],
    );
    let bar = |t: [i64; 2]| !slit.lit(t);
    check(
        &bar,
        [2, 1],
        [0.5, 0.2],
        [
            (Function::Silhouette, 0.0, SURE),
            (Function::Filtered, 1.0, SURE),
            (Function::Star, 0.0, SURE),
            (RUN, 0.0, (0.2 + 1.0 / 12.0) / 1.0f64.hypot(4.0 / 3.0 * (0.75 - 1.0 / 6.0))),
        ],
    );
    // A single texel: its profile loses its corners and a quarter of a texel on each side.
    let dot = |t: [i64; 2]| t == [0, 0];
    assert_eq!(discontinuity(&dot, [0, 0]).packed(), DVec3::new(0.75, 0.75, 0.0));
    let at = |x, y, function| visibility(&dot, [0, 0], dvec2(x, y), function, 16).visibility;
    assert_eq!([at(0.5, 0.5, RUN), at(0.5, 0.24, RUN), at(0.5, 0.26, RUN), at(0.1, 0.4, RUN)], [1.0, 0.0, 1.0, 0.0]);
    assert_eq!([at(0.5, 0.5, Function::Filtered), at(0.5, 0.5, Function::Star)], [0.0, 1.0]);

    // A notch 2 texels wide in a plain: a U along one axis and an L along the other.
    let notch = pattern(&["......", "##..##", "######"]);
    let d = discontinuity(&notch, [2, 1]);
    assert_eq!(d.mask, 0b0101);
    assert_eq!(traverse_all(&notch, [2, 1], d, 16), [1, 2, 1, -1]);
    let at = |function| visibility(&notch, [2, 1], dvec2(0.25, 0.4), function, 16).visibility;
    assert_eq!([at(Function::Silhouette), at(Function::Star)], [0.0, 1.0]);
    assert!(near(at(Function::Filtered), 0.6));
}

#[test]
fn bars_one_texel_wide_are_lost_to_the_listings_alone() {
    for lit in [true, false] {
        let bar = |[_, y]: [i64; 2]| (y == 0) == lit;
        let at = |function| visibility(&bar, [5, 0], dvec2(0.3, 0.6), function, 16).visibility;
        let (own, other) = (f64::from(u8::from(lit)), f64::from(u8::from(!lit)));
        let kept = [Function::Star, Function::Ramp, RUN, Function::ProfileRamp(Quality::Run, 0.5)];
        assert_eq!(kept.map(at), [own; 4]);
        assert_eq!(at(Function::Filtered), other);
        assert_eq!(at(Function::Silhouette), 0.0);
    }
}

#[test]
fn corners_of_boxes_stay_with_the_profile_and_flip_with_equation_7() {
    let lit = |[x, y]: [i64; 2]| x < 0 || y < 0;
    for at in [dvec2(0.05, 0.05), dvec2(0.5, 0.5), dvec2(0.95, 0.95)] {
        assert_eq!(visibility(&lit, [0, 0], at, Function::Star, 16).visibility, 1.0);
        assert_eq!(visibility(&lit, [0, 0], at, RUN, 16), Outcome { visibility: 0.0, margin: SURE });
    }
    let run = run(&lit, Crack { texel: [3, -1], side: Side::PlusV, lit: true }, 16);
    assert_eq!(run, Run { before: 3, after: 16, ends: [End::Away, End::Unknown], big: [true, false] });
    // The flat end of a box, and one too short to be distinguished from a rounded one.
    for (length, flat) in [(5, false), (6, true)] {
        let lit = |[x, y]: [i64; 2]| !(0..length).contains(&x) || y < 0;
        let run = super::run(&lit, Crack { texel: [2, 0], side: Side::MinusV, lit: false }, 16);
        assert_eq!((run.ends, run.big), ([End::Toward; 2], [true; 2]));
        assert_eq!(profile_curve(&run, None, [None; 2], 16) == Curve::Flat, flat);
    }
}

#[test]
fn saddles() {
    let chess = |[x, y]: [i64; 2]| (x + y) % 2 == 0;
    let run = run(&chess, Crack { texel: [0, 0], side: Side::PlusV, lit: true }, 16);
    assert_eq!(run, Run { before: 0, after: 0, ends: [End::Saddle; 2], big: [false; 2] });
    assert_eq!(visibility(&chess, [0, 0], dvec2(0.1, 0.1), RUN, 16), Outcome { visibility: 1.0, margin: SURE });
    assert_eq!(fitted_line(&chess, Crack { texel: [0, 0], side: Side::PlusV, lit: true }), None);
    // A single saddle takes the opposite of the other end.
    let one = Run { ends: [End::Saddle, End::Toward], ..run };
    assert_eq!(profile_curve(&one, None, [None; 2], 16), Curve::Line { heights: [-0.5, 0.5] });
    let lost = Run { ends: [End::Saddle, End::Unknown], ..run };
    assert_eq!(profile_curve(&lost, None, [None; 2], 16), Curve::Flat);
}

/// In a staircase of equal runs, the boundary is the straight line through the middles of the steps.
#[test]
fn equal_steps_become_a_straight_line() {
    let mut next = random(5);
    for length in 1..=12 {
        let lit = |[x, y]: [i64; 2]| y < -x.div_euclid(length);
        let (mut lit_points, mut flipped) = (0, 0);
        for _ in 0..500 {
            let at = dvec2(next(), next());
            let x = (next() * 24.0) as i64 - 12;
            let y = -x.div_euclid(length) + (next() * 2.0) as i64 - 1;
            let expected = (y as f64 + at.y) < 0.5 - (x as f64 + at.x) / length as f64;
            for function in FUNCTIONS.into_iter().skip(2) {
                let o = visibility(&lit, [x, y], at, function, 16);
                assert!(
                    o.visibility == f64::from(u8::from(expected)) || o.margin < 1e-9,
                    "{length} {function:?} {o:?}"
                );
            }
            lit_points += usize::from(expected);
            flipped += usize::from(expected != lit([x, y]));
        }
        assert!((100..400).contains(&lit_points) && flipped > 50, "{length}: {lit_points} {flipped}");
    }
}

#[test]
fn lines_are_fitted() {
    // 45 degrees: coordinates of inside centres add up to 0 or less, those of outside centres to 1 or more.
    let lit = |[x, y]: [i64; 2]| x + y < 0;
    for (side, step) in [(Side::Right, [0, 1]), (Side::PlusV, [1, 0])] {
        let crack = Crack { texel: [-1, 0], side, lit: true };
        let line = fitted_line(&lit, crack).unwrap();
        let half = 0.5f64.sqrt();
        assert!((line.normal - dvec2(half, half)).length() < 1e-12 && near(line.offset, 0.5 * half), "{line:?}");
        assert!(near(line.height_over(crack, 0.5, step).unwrap(), 0.5));
        assert!(near(line.height_over(crack, -0.5, step).unwrap(), -0.5));
    }
    // Other slopes: the fit is close to the true line along the whole piece, far closer than half a step.
    for slope in [0.53, 0.618, 0.71, 0.87] {
        let truth = |x: f64| 0.3 + slope * x;
        let lit = |[x, y]: [i64; 2]| (y as f64 + 0.5) < truth(x as f64 + 0.5);
        let y = (truth(0.5) - 0.5).ceil() as i64 - 1;
        let line = fitted_line(&lit, Crack { texel: [0, y], side: Side::PlusV, lit: true }).unwrap();
        let normal = dvec2(-slope, 1.0).normalize();
        assert!(line.normal.dot(normal) > 0.05f64.cos(), "{slope} {line:?}");
        let here = dvec2(0.5, y as f64 + 0.5);
        let offset = (truth(here.x) - here.y) * normal.y;
        assert!((line.offset - offset).abs() < 0.15, "{slope} {line:?} {offset}");
    }
    // A corner is not a line.
    let lit = |[x, y]: [i64; 2]| x < 0 || y < 0;
    assert_eq!(fitted_line(&lit, Crack { texel: [0, 0], side: Side::Left, lit: false }), None);
}

#[test]
fn traversals_end_within_the_largest_distance() {
    // A run of 40 texels: 10 before the texel, 29 after.
    let lit = |[x, y]: [i64; 2]| y < 0 && (0..40).contains(&x);
    let d = discontinuity(&lit, [10, -1]);
    for max in 0..64 {
        let expected = |end: u32| if end <= max { i64::from(end) } else { -i64::from(max) - 1 };
        assert_eq!(traverse(&lit, [10, -1], d, Side::Left, max), expected(11));
        assert_eq!(traverse(&lit, [10, -1], d, Side::Right, max), expected(30));
        let run = run(&lit, Crack { texel: [10, -1], side: Side::PlusV, lit: true }, max);
        let expected = |end: u32| if end <= max { (end - 1, End::Toward) } else { (max, End::Unknown) };
        assert_eq!([(run.before, run.ends[0]), (run.after, run.ends[1])], [expected(11), expected(30)]);
    }
}

#[test]
fn uniform_maps_stay() {
    for lit in [true, false] {
        for function in FUNCTIONS {
            for max in [0, 1, 16, 64] {
                let o = visibility(&|_: [i64; 2]| lit, [3, -9], dvec2(0.3, 0.0), function, max);
                assert_eq!(o, Outcome { visibility: f64::from(u8::from(lit)), margin: SURE });
            }
        }
    }
}

#[test]
fn values_are_in_range_on_any_pattern() {
    let mut next = random(1);
    for seed in 0..60 {
        let lit = random_pattern(seed);
        for i in 0..200 {
            let texel = [(next() * 16.0) as i64, (next() * 16.0) as i64];
            // Include points on the texel's own border.
            let at = dvec2(next(), if i % 4 == 0 { 0.0 } else { next() });
            for function in FUNCTIONS {
                let o = visibility(&lit, texel, at, function, 1 + i % 64);
                assert!((0.0..=1.0).contains(&o.visibility) && o.margin >= 0.0, "{seed} {function:?} {o:?}");
                let is_binary = o.visibility == 0.0 || o.visibility == 1.0;
                assert!(is_binary || function == Function::Filtered);
                assert!(function != Function::Silhouette || o.visibility <= f64::from(u8::from(lit(texel))));
            }
        }
    }
}

#[test]
fn far_texels_are_as_near_ones() {
    let lit = random_pattern(3);
    for origin in [[1i64 << 40, -(1 << 40)], [i64::MAX - 15, i64::MIN]] {
        let moved = |[x, y]: [i64; 2]| lit([x.wrapping_sub(origin[0]), y.wrapping_sub(origin[1])]);
        for i in 0..256 {
            let (at, near): (_, [i64; 2]) = (dvec2(0.3, 0.9), [i % 16, i / 16]);
            let far = [near[0].wrapping_add(origin[0]), near[1].wrapping_add(origin[1])];
            for function in FUNCTIONS {
                assert_eq!(visibility(&moved, far, at, function, 16), visibility(&lit, near, at, function, 16));
            }
        }
    }
}

/// Returns the eight symmetries of the square as integer matrices.
fn symmetries() -> impl Iterator<Item = [[i64; 2]; 2]> {
    [[[1, 0], [0, 1]], [[0, 1], [1, 0]]].into_iter().flat_map(|m: [[i64; 2]; 2]| {
        [[1, 1], [1, -1], [-1, 1], [-1, -1]].map(|[a, b]| [m[0].map(|v| a * v), m[1].map(|v| b * v)])
    })
}

/// Compares a function on a pattern with itself on the transformed pattern. Returns how many points the function
/// flipped.
fn symmetry(
    function: Function,
    seed: u64,
    swap: bool,
    inner: impl Fn(&dyn Fn([i64; 2]) -> bool, [i64; 2], glam::DVec2) -> Outcome,
) -> usize {
    let lit = random_pattern(seed);
    let mut next = random(seed + 1000);
    let mut flipped = 0;
    for _ in 0..12 {
        let texel = [(next() * 16.0) as i64, (next() * 16.0) as i64];
        let at = dvec2(next(), next());
        let o = inner(&lit, texel, at);
        flipped += usize::from(o.visibility != f64::from(u8::from(lit(texel))));
        for m in symmetries() {
            // The inverse is the transpose.
            let back = move |[x, y]: [i64; 2]| [m[0][0] * x + m[1][0] * y, m[0][1] * x + m[1][1] * y];
            let turned = move |t| lit(back(t)) != swap;
            let there = [0, 1].map(|i| m[i][0] * texel[0] + m[i][1] * texel[1]);
            let place = |i: usize| {
                let v = m[i][0] as f64 * (at.x - 0.5) + m[i][1] as f64 * (at.y - 0.5);
                v + 0.5
            };
            let other = inner(&turned, there, dvec2(place(0), place(1)));
            let expected = if swap { 1.0 - o.visibility } else { o.visibility };
            assert!(
                (other.visibility - expected).abs() < 1e-9 || o.margin < 1e-9,
                "{function:?} {seed} {m:?} {texel:?} {at}: {other:?}, not {expected}"
            );
            assert!((other.margin - o.margin).abs() < 1e-9 || other.margin == o.margin, "{function:?} {other:?} {o:?}");
        }
    }
    flipped
}

#[test]
fn functions_have_the_symmetries_of_the_square() {
    for function in FUNCTIONS {
        let swaps = !matches!(function, Function::Silhouette | Function::Filtered);
        for swap in [false, true].into_iter().take(1 + usize::from(swaps)) {
            let flipped: usize = (0..600)
                .map(|seed| symmetry(function, seed, swap, |texels, t, at| visibility(&texels, t, at, function, 12)))
                .sum();
            assert!(flipped > 50, "{function:?}: only {flipped} points are not as the test");
        }
    }
}

/// A function that treats one axis differently does not pass.
#[test]
#[should_panic(expected = "Star")]
fn a_broken_symmetry_is_noticed() {
    for seed in 0..150 {
        symmetry(Function::Star, seed, false, |texels, t, at| {
            visibility(&texels, t, dvec2(at.x, 0.9 * at.y), Function::Star, 12)
        });
    }
}

#[test]
fn margins_are_what_a_point_may_be_moved_by() {
    let (mut kept, mut turned) = (0, 0);
    for function in FUNCTIONS {
        if function == Function::Filtered {
            continue;
        }
        let mut next = random(77);
        for seed in 0..150 {
            let lit = random_pattern(seed);
            for _ in 0..12 {
                let prepared = prepare(&lit, [(next() * 16.0) as i64, (next() * 16.0) as i64], function, 12);
                let at = dvec2(next(), next());
                let o = prepared.at(at);
                let reach = o.margin.min(1.5);
                for way in (0..24).map(|i| glam::DVec2::from_angle(f64::from(i) * 0.2618)) {
                    let inside = |p: glam::DVec2| p.min_element() >= 0.0 && p.max_element() < 1.0;
                    let near = at + 0.999 * reach * way;
                    if inside(near) {
                        kept += 1;
                        assert_eq!(prepared.at(near).visibility, o.visibility, "{function:?} {seed} {at} {o:?}");
                    }
                    let beyond = at + 1.1 * (reach + 0.01) * way;
                    turned += usize::from(inside(beyond) && prepared.at(beyond).visibility != o.visibility);
                }
            }
        }
    }
    assert!(kept > 10_000 && turned > 2_000, "{kept} {turned}");
}

/// The ramp of listing 5 does not jump inside a texel.
#[test]
fn filtering_is_continuous_within_a_texel() {
    let mut next = random(9);
    let mut ramps = 0;
    for seed in 0..150 {
        let lit = random_pattern(seed);
        let prepared = prepare(&lit, [(next() * 16.0) as i64, (next() * 16.0) as i64], Function::Filtered, 12);
        let (at, way) = (dvec2(next(), next()), dvec2(next() - 0.5, next() - 0.5) * 1e-3);
        let moved = (at + way).clamp(glam::DVec2::ZERO, glam::DVec2::splat(0.999_999));
        let [a, b] = [at, moved].map(|p| prepared.at(p).visibility);
        assert!((a - b).abs() <= 1.5e-3, "{a} {b}");
        ramps += usize::from(a > 0.0 && a < 1.0);
    }
    assert!(ramps > 5, "{ramps}");
}
