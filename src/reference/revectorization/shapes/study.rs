//! Study of the error of each visibility function over all shapes.
//!
//! A flat receiver is sampled with many points per texel. The result is the mismatch area per texel of silhouette,
//! which is the mean displacement of the boundary. It is the sum of over-darkening and under-darkening. Every class
//! has the same weight, whatever the length of its silhouettes.

use super::{Class, Shape, TILE, center};
use crate::reference::revectorization::revectorize::{
    Function, Prepared, Quality, Side, Texels, discontinuity, prepare, traverse_all,
};
use glam::{DVec2, dvec2};
use rayon::prelude::*;
use std::cell::Cell;
use std::sync::atomic::{AtomicU64, Ordering};

/// Width of the margin around the tile whose tests are stored, texels; tests beyond it are computed from the shape.
const MARGIN: i64 = 40;
/// Number of cells along a texel's side for measuring the length of the silhouette.
const LENGTH_CELLS: usize = 8;
/// Half of a texel's diagonal, rounded up, texels.
const TEXEL_RADIUS: f64 = 0.708;

/// Method that computes visibility from the binary shadow map.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Method {
    /// The test of the texel.
    ShadowMap,
    /// Bilinear mean of the four nearest texels' tests; lit from 0.5 up.
    Bilinear,
    /// A revectorization function; lit from 0.5 up.
    Revectorized(Function),
}

impl Method {
    /// All methods, in the order of the table.
    pub const ALL: [Self; 8] = [
        Self::ShadowMap,
        Self::Revectorized(Function::Silhouette),
        Self::Revectorized(Function::Filtered),
        Self::Revectorized(Function::Star),
        Self::Bilinear,
        Self::Revectorized(Function::Profile(Quality::Run)),
        Self::Revectorized(Function::Profile(Quality::Neighbours)),
        Self::Revectorized(Function::Profile(Quality::Line)),
    ];

    /// Filters, which have values between lit and shadow.
    pub const FILTERS: [Self; 4] = [
        Self::Bilinear,
        Self::Revectorized(Function::Filtered),
        Self::Revectorized(Function::Ramp),
        Self::Revectorized(Function::ProfileRamp(Quality::Run, 0.5)),
    ];

    /// Returns the name in tables, where values count as lit from 0.5 up.
    pub fn name(self) -> &'static str {
        match self {
            Self::ShadowMap => "shadow map",
            Self::Bilinear => "bilinear PCF at 0.5",
            Self::Revectorized(Function::Silhouette) => "silhouette recovery (listing 4)",
            Self::Revectorized(Function::Filtered) => "filtering (listing 5) at 0.5",
            Self::Revectorized(Function::Star) => "improved visibility (eq. 7)",
            Self::Revectorized(Function::Profile(Quality::Run)) => "edge profile, run",
            Self::Revectorized(Function::Profile(Quality::Neighbours)) => "edge profile, neighbours",
            Self::Revectorized(Function::Profile(Quality::Line)) => "edge profile, line",
            Self::Revectorized(Function::Ramp) => "ramp of eq. 7 at 0.5",
            Self::Revectorized(Function::ProfileRamp(..)) => "edge profile with a ramp at 0.5",
        }
    }

    /// Returns the name in tables, where values count as they are.
    pub fn filter_name(self) -> &'static str {
        self.name().trim_end_matches(" at 0.5")
    }

    /// Returns whether the method depends on the largest distance of a traversal.
    pub fn traverses(self) -> bool {
        matches!(self, Self::Revectorized(_))
    }
}

/// Options of the study.
#[derive(Clone, Debug, PartialEq)]
pub struct Options {
    /// Methods to compare.
    pub methods: Vec<Method>,
    /// Number of shapes per class, from number 0; at least 1.
    pub shapes: u32,
    /// Number of points along a texel's side; at least 1.
    pub subsamples: u32,
    /// Largest traversal distances to compare, texels.
    pub max_distances: Vec<u32>,
}

impl Default for Options {
    fn default() -> Self {
        Self { methods: Method::ALL.into(), shapes: 40, subsamples: 16, max_distances: vec![8, 16, 32] }
    }
}

/// Row of the study.
#[derive(Clone, Debug, PartialEq)]
pub struct Row {
    /// Method measured.
    pub method: Method,
    /// Largest distance of its traversals, texels; `None` if it has none.
    pub max_distance: Option<u32>,
    /// Over-darkening: area per length of silhouette, texels; mean over the classes.
    pub over: f64,
    /// Under-darkening: area per length of silhouette, texels; mean over the classes.
    pub under: f64,
    /// Distance of the farthest mismatch from the silhouette, texels: the largest per shape, averaged over the shapes.
    pub displacement: f64,
    /// Shadow tests per texel that differs from one of its four neighbours, as implemented here.
    pub fetches: f64,
    /// The same count if listing 3 reads all four neighbours of each texel that it steps to.
    pub fetches_as_listed: f64,
    /// Mismatch of each class, texels, in the order of [`Class::ALL`].
    pub classes: Vec<f64>,
    /// Squared error of the values of each class, summed over the area, per texel of silhouette. For a hard edge it equals
    /// the mismatch.
    pub squares: Vec<f64>,
}

impl Row {
    /// Returns the mismatch area per texel of silhouette, texels.
    pub fn mismatch(&self) -> f64 {
        self.over + self.under
    }

    /// Returns the mean of [`Row::squares`] over the classes.
    pub fn square(&self) -> f64 {
        self.squares.iter().sum::<f64>() / self.squares.len() as f64
    }
}

/// Errors of a method on a shape.
#[derive(Clone, Copy, Debug, Default)]
struct Tally {
    over: f64,
    under: f64,
    square: f64,
    displacement: f64,
    fetches: u64,
    fetches_as_listed: u64,
}

struct Measured {
    /// Length of the silhouette in the tile, texels.
    length: f64,
    boundary_texels: u64,
    tallies: Vec<Tally>,
}

/// Runs the study. Any thread may call `progress` with the number of shapes done and of all shapes.
pub fn study(options: &Options, progress: impl Fn(u64, u64) + Sync) -> Vec<Row> {
    let variants: Vec<(Method, Option<u32>)> = options.methods.iter().flat_map(|&m| variants(m, options)).collect();
    let numbers = Class::ALL.into_iter().flat_map(|class| (0..options.shapes).map(move |number| (class, number)));
    let numbers: Vec<_> = numbers.collect();
    let done = AtomicU64::new(0);
    let measured: Vec<Measured> = numbers
        .par_iter()
        .map(|&(class, number)| {
            let measured = measure(&Shape::new(class, number), &variants, options.subsamples);
            progress(done.fetch_add(1, Ordering::Relaxed) + 1, numbers.len() as u64);
            measured
        })
        .collect();
    variants.iter().enumerate().map(|(i, &variant)| row(variant, i, &measured, options.shapes as usize)).collect()
}

/// Measures one shape. Each row's `classes` has only that shape's mismatch, and `options.shapes` is ignored.
pub fn of_shape(shape: &Shape, options: &Options) -> Vec<Row> {
    let variants: Vec<(Method, Option<u32>)> = options.methods.iter().flat_map(|&m| variants(m, options)).collect();
    let measured = [measure(shape, &variants, options.subsamples)];
    variants.iter().enumerate().map(|(i, &variant)| row(variant, i, &measured, 1)).collect()
}

/// Returns the image that a method makes of a shape's tile, `true` where lit: `TILE * scale` points a side, row by
/// row.
pub fn image(shape: &Shape, method: Method, max_distance: u32, scale: u32) -> Vec<bool> {
    let tests = Tests::new(shape);
    let mut image = vec![];
    for y in 0..TILE {
        let arounds: Vec<_> = (0..TILE).map(|x| Around::new(&tests, [x.into(), y.into()])).collect();
        let answers =
            (0..TILE as usize).map(|x| answer(method, &tests, &arounds[x], [x as i64, y.into()], max_distance));
        let answers: Vec<_> = answers.collect();
        for j in 0..scale {
            image.extend((0..TILE * scale).map(|i| {
                let fraction = (dvec2((i % scale).into(), j.into()) + 0.5) / f64::from(scale);
                answers[(i / scale) as usize].visibility(fraction) >= 0.5
            }));
        }
    }
    image
}

fn variants(method: Method, options: &Options) -> Vec<(Method, Option<u32>)> {
    if method.traverses() {
        options.max_distances.iter().map(|&m| (method, Some(m))).collect()
    } else {
        vec![(method, None)]
    }
}

fn row((method, max_distance): (Method, Option<u32>), index: usize, measured: &[Measured], shapes: usize) -> Row {
    let classes = measured.chunks(shapes.max(1));
    let mean = |of: &dyn Fn(&[Measured]) -> f64| classes.clone().map(of).sum::<f64>() / classes.len() as f64;
    let sum = |class: &[Measured], of: &dyn Fn(&Tally) -> f64| class.iter().map(|m| of(&m.tallies[index])).sum::<f64>();
    let length = |class: &[Measured]| class.iter().map(|m| m.length).sum::<f64>();
    let boundary = |class: &[Measured]| class.iter().map(|m| m.boundary_texels).sum::<u64>() as f64;
    Row {
        method,
        max_distance,
        over: mean(&|c| sum(c, &|t| t.over) / length(c)),
        under: mean(&|c| sum(c, &|t| t.under) / length(c)),
        displacement: mean(&|c| sum(c, &|t| t.displacement) / c.len() as f64),
        fetches: mean(&|c| sum(c, &|t| t.fetches as f64) / boundary(c)),
        fetches_as_listed: mean(&|c| sum(c, &|t| t.fetches_as_listed as f64) / boundary(c)),
        classes: classes.clone().map(|c| sum(c, &|t| t.over + t.under) / length(c)).collect(),
        squares: classes.clone().map(|c| sum(c, &|t| t.square) / length(c)).collect(),
    }
}

fn measure(shape: &Shape, variants: &[(Method, Option<u32>)], subsamples: u32) -> Measured {
    let tests = Tests::new(shape);
    let mut measured = Measured { length: 0.0, boundary_texels: 0, tallies: vec![Tally::default(); variants.len()] };
    let points: Vec<DVec2> = (0..subsamples * subsamples)
        .map(|i| (dvec2((i % subsamples).into(), (i / subsamples).into()) + 0.5) / f64::from(subsamples))
        .collect();
    for texel in (0..i64::from(TILE)).flat_map(|y| (0..i64::from(TILE)).map(move |x| [x, y])) {
        let around = Around::new(&tests, texel);
        let has_silhouette = !shape.is_uniform(center(texel), TEXEL_RADIUS);
        if !has_silhouette && around.is_uniform() {
            continue;
        }
        let corner = dvec2(texel[0] as f64, texel[1] as f64);
        if has_silhouette {
            measured.length += silhouette_length(shape, corner);
        }
        let distances: Vec<f64> = points.iter().map(|&p| shape.distance(corner + p)).collect();
        let is_boundary = around.has_boundary();
        measured.boundary_texels += u64::from(is_boundary);
        for (&(method, max_distance), tally) in variants.iter().zip(&mut measured.tallies) {
            let max_distance = max_distance.unwrap_or(0);
            let counter = Counter { texels: &tests, count: Cell::new(0) };
            let answer = answer(method, &counter, &around, texel, max_distance);
            if is_boundary {
                let made = match method {
                    Method::ShadowMap => 1,
                    Method::Bilinear => 4,
                    Method::Revectorized(_) => counter.count.get(),
                };
                tally.fetches += made;
                tally.fetches_as_listed += as_listed(method, &tests, texel, max_distance).unwrap_or(made);
            }
            let area = 1.0 / points.len() as f64;
            for (&point, &distance) in points.iter().zip(&distances) {
                let value = answer.visibility(point);
                let (lit, truth) = (value >= 0.5, distance >= 0.0);
                tally.square += area * (value - f64::from(u8::from(truth))).powi(2);
                if lit != truth {
                    *(if lit { &mut tally.under } else { &mut tally.over }) += area;
                    tally.displacement = tally.displacement.max(distance.abs());
                }
            }
        }
    }
    measured
}

fn answer<'a>(method: Method, texels: &impl Texels, around: &'a Around, at: [i64; 2], max_distance: u32) -> Answer<'a> {
    match method {
        Method::ShadowMap => Answer::Constant(around.lit()),
        Method::Bilinear => Answer::Bilinear(around),
        Method::Revectorized(function) => Answer::new(prepare(texels, at, function, max_distance)),
    }
}

/// Method prepared for a texel.
enum Answer<'a> {
    Constant(bool),
    Bilinear(&'a Around),
    Prepared(Prepared),
}

impl Answer<'_> {
    fn new(prepared: Prepared) -> Self {
        if prepared.keeps_test() { Self::Constant(prepared.is_lit()) } else { Self::Prepared(prepared) }
    }

    fn visibility(&self, fraction: DVec2) -> f64 {
        match self {
            Self::Constant(lit) => f64::from(u8::from(*lit)),
            Self::Bilinear(around) => around.bilinear(fraction),
            Self::Prepared(prepared) => prepared.at(fraction).visibility,
        }
    }
}

/// Returns the number of shadow tests that a method takes if listings 1 to 3 run as printed; `None` for edge profiles
/// and for methods that do not traverse edges.
fn as_listed(method: Method, tests: &Tests<'_>, texel: [i64; 2], max_distance: u32) -> Option<u64> {
    let Method::Revectorized(function) = method else { return None };
    match function {
        Function::Profile(_) | Function::ProfileRamp(..) => return None,
        Function::Silhouette if !tests.lit(texel) => return Some(1),
        _ => {}
    }
    let traversal = traverse_all(tests, texel, discontinuity(tests, texel), max_distance);
    // A step reads the texel that it reaches, and its four neighbours unless its test differs.
    let steps = |t: i64| match t {
        1.. => 5 * t - 4,
        _ => 5 * t.abs().min(i64::from(max_distance)),
    };
    Some(5 + traversal.into_iter().map(steps).sum::<i64>() as u64)
}

/// Shadow tests of a tile and its margin.
struct Tests<'a> {
    shape: &'a Shape,
    lit: Vec<bool>,
}

impl<'a> Tests<'a> {
    const SIDE: i64 = TILE as i64 + 2 * MARGIN;

    fn new(shape: &'a Shape) -> Self {
        let mut tests = Self { shape, lit: vec![false; (Self::SIDE * Self::SIDE) as usize] };
        tests.fill([0, 0], Self::SIDE);
        tests
    }

    /// Fills a square, at once where the shape is uniform, else by quarters.
    fn fill(&mut self, from: [i64; 2], side: i64) {
        let middle = DVec2::splat(side as f64 / 2.0 - MARGIN as f64) + dvec2(from[0] as f64, from[1] as f64);
        if side == 1 || self.shape.is_uniform(middle, TEXEL_RADIUS * side as f64) {
            let lit = self.shape.truth(middle);
            for y in from[1]..from[1] + side {
                let row = (y * Self::SIDE + from[0]) as usize;
                self.lit[row..row + side as usize].fill(lit);
            }
            return;
        }
        let half = side / 2;
        for [i, j] in [[0, 0], [half, 0], [0, half], [half, half]] {
            self.fill([from[0] + i, from[1] + j], half);
        }
    }
}

// Repeated quartering ends at single texels.
const _: () = assert!(Tests::SIDE.count_ones() == 1);

impl Texels for Tests<'_> {
    fn lit(&self, texel: [i64; 2]) -> bool {
        let [x, y] = texel.map(|t| t + MARGIN);
        if (0..Self::SIDE).contains(&x) && (0..Self::SIDE).contains(&y) {
            self.lit[(y * Self::SIDE + x) as usize]
        } else {
            self.shape.lit(texel)
        }
    }
}

/// Counter of the shadow tests.
struct Counter<'a, 'b> {
    texels: &'a Tests<'b>,
    count: Cell<u64>,
}

impl Texels for Counter<'_, '_> {
    fn lit(&self, texel: [i64; 2]) -> bool {
        self.count.set(self.count.get() + 1);
        self.texels.lit(texel)
    }
}

/// Tests of a texel and of its eight neighbours, row by row.
struct Around([bool; 9]);

impl Around {
    fn new(tests: &Tests<'_>, [x, y]: [i64; 2]) -> Self {
        let offset = |i: usize| [x + i as i64 % 3 - 1, y + i as i64 / 3 - 1];
        Self(std::array::from_fn(|i| tests.lit(offset(i))))
    }

    fn lit(&self) -> bool {
        self.0[4]
    }

    fn is_uniform(&self) -> bool {
        self.0.iter().all(|&t| t == self.0[0])
    }

    fn has_boundary(&self) -> bool {
        Side::ALL.iter().any(|side| {
            let [i, j] = side.step();
            self.0[(4 + i + 3 * j) as usize] != self.lit()
        })
    }

    fn bilinear(&self, fraction: DVec2) -> f64 {
        let base = (fraction - 0.5).floor();
        let weight = fraction - 0.5 - base;
        let first = [1 + base.x as i64, 1 + base.y as i64];
        let test = |i: i64, j: i64| f64::from(u8::from(self.0[(3 * (first[1] + j) + first[0] + i) as usize]));
        let row = |j| test(0, j) * (1.0 - weight.x) + test(1, j) * weight.x;
        row(0) * (1.0 - weight.y) + row(1) * weight.y
    }
}

/// Returns the length of the silhouette in the texel at `corner`, texels, by marching squares.
fn silhouette_length(shape: &Shape, corner: DVec2) -> f64 {
    const N: usize = LENGTH_CELLS;
    let at = |i: usize, j: usize| corner + dvec2(i as f64, j as f64) / N as f64;
    let mut distance = [[0.0; N + 1]; N + 1];
    for (j, row) in distance.iter_mut().enumerate() {
        for (i, d) in row.iter_mut().enumerate() {
            *d = shape.distance(at(i, j));
        }
    }
    let mut length = 0.0;
    for (i, j) in (0..N).flat_map(|j| (0..N).map(move |i| (i, j))) {
        let places = [(i, j), (i + 1, j), (i + 1, j + 1), (i, j + 1)];
        let crossings: Vec<DVec2> = (0..4)
            .filter_map(|k| {
                let ((ai, aj), (bi, bj)) = (places[k], places[(k + 1) % 4]);
                let (a, b) = (distance[aj][ai], distance[bj][bi]);
                ((a < 0.0) != (b < 0.0)).then(|| at(ai, aj).lerp(at(bi, bj), a / (a - b)))
            })
            .collect();
        length += match crossings[..] {
            [a, b] => a.distance(b),
            // There are two pieces, and the corners do not tell how to pair their ends.
            [a, b, c, d] => (a.distance(b) + c.distance(d)).min(b.distance(c) + d.distance(a)),
            _ => 0.0,
        };
    }
    length
}
