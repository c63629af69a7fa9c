//! Signed distances of forms around their own origin; negative inside.

use glam::{DVec2, dvec2};

/// Occluder before it is rotated and placed.
#[derive(Clone, Debug)]
pub(super) enum Form {
    /// Half-plane of negative y.
    HalfPlane,
    /// Disc with this radius, texels.
    Disc(f64),
    /// Rectangle with these half-sides, texels.
    Rect(DVec2),
    /// Wedge around the positive x axis, with this half-angle in radians.
    Wedge(f64),
    /// Two bars along x: the gap between them and the width of each, texels.
    TwoBars {
        gap: f64,
        width: f64,
    },
    /// Chessboard with cells of this side, texels.
    Chess(f64),
    Leaves(Vec<Leaf>),
    Glyph(Glyph),
    /// Region below `amplitude sin(frequency x + phase)`.
    Wave {
        amplitude: f64,
        frequency: f64,
        phase: f64,
    },
}

/// Intersection of two discs.
#[derive(Clone, Copy, Debug)]
pub(super) struct Leaf {
    pub center: DVec2,
    /// Cosine and sine of the long axis' angle.
    pub turn: DVec2,
    /// Half-length and half-width, texels; the length is greater.
    pub half: DVec2,
}

/// Letter of straight strokes and arcs, y down.
#[derive(Clone, Copy, Debug)]
pub(super) struct Glyph {
    pub letter: Letter,
    /// Scale of the positions; it does not apply to the strokes' width.
    pub scale: f64,
    /// Half-width of the strokes, texels.
    pub half_width: f64,
}

#[derive(Clone, Copy, Debug)]
pub(super) enum Letter {
    A,
    R,
    /// Two quarter rings.
    Hooks,
    N,
    /// A stroke and a quarter ring.
    Tail,
}

impl Form {
    pub(super) fn distance(&self, p: DVec2) -> f64 {
        match self {
            Self::HalfPlane => p.y,
            Self::Disc(radius) => p.length() - radius,
            Self::Rect(half) => rect(p, *half),
            Self::Wedge(half_angle) => wedge(p, *half_angle),
            Self::TwoBars { gap, width } => (p.y.abs() - 0.5 * (gap + width)).abs() - 0.5 * width,
            Self::Chess(cell) => chess(p / *cell) * cell,
            Self::Leaves(leaves) => leaves.iter().map(|l| l.distance(p)).fold(f64::INFINITY, f64::min),
            Self::Glyph(glyph) => glyph.distance(p),
            Self::Wave { amplitude, frequency, phase } => {
                let angle = frequency * p.x + phase;
                (p.y - amplitude * angle.sin()) / (amplitude * frequency * angle.cos()).hypot(1.0)
            }
        }
    }

    /// Returns `true` only if no silhouette lies within `radius`.
    pub(super) fn is_clear(&self, p: DVec2, radius: f64) -> bool {
        match self {
            // The wave's distance is exact only near the silhouette, but the height above it changes with a bounded
            // slope.
            Self::Wave { amplitude, frequency, phase } => {
                let height = p.y - amplitude * (frequency * p.x + phase).sin();
                height.abs() > radius * (amplitude * frequency).hypot(1.0)
            }
            _ => self.distance(p).abs() > radius,
        }
    }
}

fn rect(p: DVec2, half: DVec2) -> f64 {
    let q = p.abs() - half;
    q.max(DVec2::ZERO).length() + q.x.max(q.y).min(0.0)
}

fn wedge(p: DVec2, half_angle: f64) -> f64 {
    let p = dvec2(p.x, p.y.abs());
    let side = DVec2::from_angle(half_angle);
    let distance = (p - side * p.dot(side).max(0.0)).length();
    if p.x * side.y - p.y * side.x > 0.0 { -distance } else { distance }
}

/// Returns the distance for cells of side 1; cells with an even sum of coordinates are occluders.
fn chess(p: DVec2) -> f64 {
    // Distance from the nearest line, negative in every second column.
    let axis = |x: f64| {
        let x = x.rem_euclid(2.0);
        if x < 1.0 { x.min(1.0 - x) } else { -(x - 1.0).min(2.0 - x) }
    };
    let (x, y) = (axis(p.x), axis(p.y));
    let distance = x.abs().min(y.abs());
    if x * y > 0.0 { -distance } else { distance }
}

impl Leaf {
    fn distance(&self, p: DVec2) -> f64 {
        let d = p - self.center;
        let p = dvec2(self.turn.dot(d), self.turn.perp().dot(d)).abs();
        let (a, b) = (self.half.x, self.half.y);
        let radius = (a * a + b * b) / (2.0 * b);
        let apart = radius - b;
        // Beyond the tip, the tip is nearest; elsewhere, the rim of the farther disc.
        if (p.x - a) * apart > p.y * a { p.distance(dvec2(a, 0.0)) } else { p.distance(dvec2(0.0, -apart)) - radius }
    }
}

impl Glyph {
    fn distance(&self, p: DVec2) -> f64 {
        let k = self.scale;
        let stroke = |ax: f64, ay: f64, bx: f64, by: f64| {
            let (a, b) = (dvec2(ax, ay) * k, dvec2(bx, by) * k);
            let along = (b - a).normalize();
            let d = p - 0.5 * (a + b);
            rect(dvec2(d.dot(along), along.perp_dot(d)), dvec2(0.5 * a.distance(b), self.half_width))
        };
        let ring = |x: f64, y: f64, radius: f64| (p.distance(dvec2(x, y) * k) - radius * k).abs() - self.half_width;
        let any = |parts: &[f64]| parts.iter().copied().fold(f64::INFINITY, f64::min);
        match self.letter {
            Letter::A => any(&[stroke(-10., 14., 0., -14.), stroke(10., 14., 0., -14.), stroke(-6., 4., 6., 4.)]),
            Letter::R => {
                any(&[stroke(-8., 14., -8., -14.), ring(-2., -6., 8.).max(-(p.x + 8. * k)), stroke(-4., 2., 8., 14.)])
            }
            Letter::Hooks => {
                any(&[ring(0., -7., 7.).max(-p.x.min(p.y + 7. * k)), ring(0., 7., 7.).max(-(-p.x).min(7. * k - p.y))])
            }
            Letter::N => any(&[stroke(-9., -14., -9., 14.), stroke(9., -14., 9., 14.), stroke(-9., -14., 9., 14.)]),
            Letter::Tail => any(&[ring(0., 0., 11.).max(-p.x.min(p.y - 2. * k)), stroke(-11., 0., 11., 0.)]),
        }
    }
}
