//! Random distributions that shapes are drawn from.

use super::form::{Form, Glyph, Leaf, Letter};
use super::{Class, Shape, TILE};
use glam::{DVec2, dvec2};
use rand_pcg::Pcg64;
use rand_pcg::rand_core::Rng as _;
use std::f64::consts::{FRAC_PI_2, FRAC_PI_4, PI, TAU};

/// Arbitrary seed; the shapes of tables and tests depend on it.
const SEED: u128 = 0x5ead_0e5e_ed5e_ed00;

/// Half-length of bars that end outside every tile, texels.
const ENDLESS: f64 = 200.0;

struct Random(Pcg64);

impl Random {
    /// Returns a uniform number in `[0, 1)`.
    fn unit(&mut self) -> f64 {
        (self.0.next_u64() >> 11) as f64 / (1u64 << 53) as f64
    }

    fn between(&mut self, low: f64, high: f64) -> f64 {
        low + (high - low) * self.unit()
    }

    fn chance(&mut self, share: f64) -> bool {
        self.unit() < share
    }

    /// Returns a uniform number in `0..count`.
    fn below(&mut self, count: usize) -> usize {
        (self.unit() * count as f64) as usize
    }

    fn angle(&mut self) -> f64 {
        self.between(0.0, PI)
    }

    /// Returns a point at most `reach` texels from the tile's centre on either axis.
    fn near_center(&mut self, reach: f64) -> DVec2 {
        let offset = dvec2(self.between(-reach, reach), self.between(-reach, reach));
        DVec2::splat(0.5 * f64::from(TILE)) + offset
    }
}

/// Position and orientation of a form.
struct Place {
    center: DVec2,
    angle: f64,
    is_hole: bool,
}

pub(super) fn shape(class: Class, number: u32) -> Shape {
    let random = &mut Random(Pcg64::new(SEED, u128::from(class as u8) << 32 | u128::from(number)));
    let (form, place) = match class {
        Class::ShallowEdge => edge(random, 0.0, (1.0f64 / 16.0).atan()),
        Class::SlopedEdge => edge(random, (1.0f64 / 16.0).atan(), 0.5f64.atan()),
        Class::DiagonalEdge => edge(random, 0.5f64.atan(), FRAC_PI_4),
        Class::SmallDisc => disc(random, 2.0, 6.0),
        Class::LargeDisc => disc(random, 6.0, 60.0),
        Class::Wave => wave(random),
        Class::ThinBar => bar(random, 0.5, 1.5),
        Class::WideBar => bar(random, 1.5, 4.0),
        Class::Corner => corner(random),
        Class::AlignedBox => {
            let half = dvec2(random.between(0.8, 12.0), random.between(0.8, 12.0));
            let center = random.near_center(3.0);
            (Form::Rect(half), Place { center, angle: 0.0, is_hole: random.chance(0.5) })
        }
        Class::RotatedBox => {
            let half = dvec2(random.between(1.5, 12.0), random.between(1.5, 12.0));
            let center = random.near_center(3.0);
            let is_hole = random.chance(0.5);
            (Form::Rect(half), Place { center, angle: random.angle(), is_hole })
        }
        Class::TwoBars => {
            let form = Form::TwoBars { gap: random.between(0.5, 4.0), width: random.between(2.0, 5.0) };
            let angle = random.angle();
            let center = random.near_center(0.5);
            (form, Place { center, angle, is_hole: random.chance(0.5) })
        }
        Class::Foliage => foliage(random),
        Class::Glyph => glyph(random),
    };
    let Place { center, angle, is_hole } = place;
    Shape { class, number, center, turn: DVec2::from_angle(angle), is_hole, form }
}

/// Draws a straight edge at an angle in `low..high`, radians, to one of the axes.
fn edge(random: &mut Random, low: f64, high: f64) -> (Form, Place) {
    let angle = random.between(low, high) + random.below(4) as f64 * FRAC_PI_2;
    let angle = if random.chance(0.5) { -angle } else { angle };
    (Form::HalfPlane, Place { center: random.near_center(0.5), angle, is_hole: false })
}

fn disc(random: &mut Random, low: f64, high: f64) -> (Form, Place) {
    let radius = random.between(low.ln(), high.ln()).exp();
    let is_hole = random.chance(0.5);
    // A disc that does not fit into the tile has its rim near the tile's centre.
    let center = if radius < 18.0 {
        random.near_center(3.0)
    } else {
        radius * DVec2::from_angle(random.between(0.0, TAU)) + random.near_center(0.5)
    };
    (Form::Disc(radius), Place { center, angle: 0.0, is_hole })
}

fn wave(random: &mut Random) -> (Form, Place) {
    let angle = random.between(0.0, TAU);
    let center = random.near_center(0.5);
    let amplitude = random.between(0.5, 5.0);
    let frequency = TAU / random.between(14.0, 50.0);
    let phase = random.between(0.0, TAU);
    (Form::Wave { amplitude, frequency, phase }, Place { center, angle, is_hole: false })
}

fn bar(random: &mut Random, low: f64, high: f64) -> (Form, Place) {
    let width = random.between(low, high);
    let angle = random.angle();
    let center = random.near_center(0.5);
    let half_length = if random.chance(0.5) { ENDLESS } else { random.between(8.0, 16.0) };
    (Form::Rect(dvec2(half_length, 0.5 * width)), Place { center, angle, is_hole: random.chance(0.5) })
}

fn corner(random: &mut Random) -> (Form, Place) {
    let degrees = [30.0f64, 45.0, 60.0, 90.0, 120.0, 150.0][random.below(6)];
    let angle = random.between(0.0, TAU);
    let center = random.near_center(4.0);
    (Form::Wedge(0.5 * degrees.to_radians()), Place { center, angle, is_hole: random.chance(0.5) })
}

fn foliage(random: &mut Random) -> (Form, Place) {
    if random.chance(0.3) {
        let form = Form::Chess(random.between(1.5, 5.0));
        let angle = random.angle();
        return (form, Place { center: random.near_center(5.0), angle, is_hole: false });
    }
    // Leaves cover about this share of the tile and a margin of 6 texels around it.
    let side = f64::from(TILE) + 12.0;
    let share = random.between(0.15, 0.5);
    let mut covered = 0.0;
    let mut leaves = vec![];
    while covered < share * side * side {
        let length = random.between(2.0, 9.0);
        let width = length * random.between(0.25, 0.8);
        let center = dvec2(random.unit(), random.unit()) * side - 6.0;
        leaves.push(Leaf { center, turn: DVec2::from_angle(random.angle()), half: 0.5 * dvec2(length, width) });
        covered += 0.7 * length * width;
    }
    (Form::Leaves(leaves), Place { center: DVec2::ZERO, angle: 0.0, is_hole: false })
}

fn glyph(random: &mut Random) -> (Form, Place) {
    // Most letters are slanted slightly; upright strokes are the hard case.
    let angle = if random.chance(0.7) { random.between(-0.4, 0.4) } else { 0.0 };
    let scale = random.between(0.45, 1.2);
    let half_width = 0.5 * random.between(1.2, 4.0);
    let center = random.near_center(2.0);
    let letter = [Letter::A, Letter::R, Letter::Hooks, Letter::N, Letter::Tail][random.below(5)];
    (Form::Glyph(Glyph { letter, scale, half_width }), Place { center, angle, is_hole: false })
}
