//! Analytic shadows on a flat receiver: shapes whose shadow map and exact visibility are both known. Units are texels.
//!
//! A shape is an occluder in the plane of the map, given as a signed distance. The binary shadow map is its sign at
//! the texels' centres, and the exact visibility its sign at any point. Each class has an unlimited number of shapes:
//! the same class and number give the same shape on every machine.

mod draw;
mod form;
pub mod study;

use crate::reference::revectorization::revectorize::Texels;
use form::Form;
use glam::DVec2;

/// Side of the tile that a shape is made for, texels: `[0, TILE]` on both axes. Shapes extend beyond it.
pub const TILE: u32 = 48;

/// Depth of the occluder in [`Shape::shadow_map`].
pub const CASTER_DEPTH: f32 = 0.25;

/// Depth where nothing occludes.
pub const LIT_DEPTH: f32 = 1.0;

/// Class of shapes, by the kind of shadow boundary.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Class {
    /// Straight edges with slopes of at most 1/16 to an axis.
    ShallowEdge,
    /// Straight edges with slopes of 1/16 to 1/2 to the nearer axis.
    SlopedEdge,
    /// Straight edges with slopes of 1/2 to 1 to the nearer axis.
    DiagonalEdge,
    /// Discs and round holes, radius 2 to 6 texels.
    SmallDisc,
    /// Discs and round holes, radius 6 to 60 texels.
    LargeDisc,
    /// Sine waves.
    Wave,
    /// Bars and slits, 0.5 to 1.5 texels wide.
    ThinBar,
    /// Bars and slits, 1.5 to 4 texels wide.
    WideBar,
    /// Corners of 30 to 150 degrees, convex and concave.
    Corner,
    /// Boxes and box-shaped holes along the axes.
    AlignedBox,
    /// Boxes and box-shaped holes at any angle.
    RotatedBox,
    /// Two bars with a gap of 0.5 to 4 texels.
    TwoBars,
    /// Scattered leaves, and chessboards.
    Foliage,
    /// Letters drawn with strokes 1.2 to 4 texels wide.
    Glyph,
}

impl Class {
    /// All classes.
    pub const ALL: [Self; 14] = [
        Self::ShallowEdge,
        Self::SlopedEdge,
        Self::DiagonalEdge,
        Self::SmallDisc,
        Self::LargeDisc,
        Self::Wave,
        Self::ThinBar,
        Self::WideBar,
        Self::Corner,
        Self::AlignedBox,
        Self::RotatedBox,
        Self::TwoBars,
        Self::Foliage,
        Self::Glyph,
    ];

    /// Returns the name in tables.
    pub fn name(self) -> &'static str {
        match self {
            Self::ShallowEdge => "shallow edge",
            Self::SlopedEdge => "sloped edge",
            Self::DiagonalEdge => "diagonal edge",
            Self::SmallDisc => "small disc",
            Self::LargeDisc => "large disc",
            Self::Wave => "wave",
            Self::ThinBar => "thin bar",
            Self::WideBar => "wide bar",
            Self::Corner => "corner",
            Self::AlignedBox => "aligned box",
            Self::RotatedBox => "rotated box",
            Self::TwoBars => "two bars",
            Self::Foliage => "foliage",
            Self::Glyph => "glyph",
        }
    }

    /// Returns the shapes of the class, without end.
    pub fn shapes(self) -> impl Iterator<Item = Shape> {
        (0..).map(move |number| Shape::new(self, number))
    }
}

/// An occluder.
#[derive(Clone, Debug)]
pub struct Shape {
    /// Class of the shape.
    pub class: Class,
    /// Number within the class.
    pub number: u32,
    center: DVec2,
    /// Cosine and sine of the angle by which the form is rotated.
    turn: DVec2,
    /// `true` if the form is a hole in an infinite occluder.
    is_hole: bool,
    form: Form,
}

impl Shape {
    /// Returns the shape of that class with that number.
    pub fn new(class: Class, number: u32) -> Self {
        draw::shape(class, number)
    }

    /// Returns the distance of a point from the silhouette, texels; negative inside the occluder. It is exact except
    /// for waves (to first order) and glyphs (where strokes overlap inside); the sign is always right.
    pub fn distance(&self, point: DVec2) -> f64 {
        let distance = self.form.distance(self.local(point));
        if self.is_hole { -distance } else { distance }
    }

    /// Returns the exact visibility of a point given in texels: `true` if lit.
    pub fn truth(&self, point: DVec2) -> bool {
        self.distance(point) >= 0.0
    }

    /// Returns `true` only if the visibility is the same in the whole disc.
    pub fn is_uniform(&self, center: DVec2, radius: f64) -> bool {
        self.form.is_clear(self.local(center), radius)
    }

    /// Returns the shadow map of a rectangle of texels, row by row: [`CASTER_DEPTH`] where the texel's centre is in
    /// the occluder, [`LIT_DEPTH`] elsewhere.
    pub fn shadow_map(&self, origin: [i64; 2], size: [u32; 2]) -> Vec<f32> {
        let [width, height] = size.map(i64::from);
        let texels = (0..height).flat_map(|j| (0..width).map(move |i| [origin[0] + i, origin[1] + j]));
        texels.map(|t| if self.lit(t) { LIT_DEPTH } else { CASTER_DEPTH }).collect()
    }

    fn local(&self, point: DVec2) -> DVec2 {
        let d = point - self.center;
        DVec2::new(self.turn.dot(d), self.turn.perp().dot(d))
    }
}

impl Texels for Shape {
    fn lit(&self, texel: [i64; 2]) -> bool {
        self.truth(center(texel))
    }
}

/// Returns the centre of a texel.
pub fn center(texel: [i64; 2]) -> DVec2 {
    DVec2::new(texel[0] as f64 + 0.5, texel[1] as f64 + 0.5)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Returns points all over the tile and beyond it, aligned with no grid.
    fn points() -> impl Iterator<Item = DVec2> {
        (0..400).map(|i| {
            let t = f64::from(i);
            DVec2::new((t * 0.618_034).fract(), (t * 0.754_878).fract()) * 60.0 - 6.0
        })
    }

    fn directions() -> impl Iterator<Item = DVec2> {
        (0..16).map(|i| DVec2::from_angle(f64::from(i) * 0.4))
    }

    #[test]
    fn what_is_called_uniform_is() {
        let mut uniform = 0;
        for class in Class::ALL {
            for shape in class.shapes().take(6) {
                for p in points() {
                    for radius in [0.7, 3.0] {
                        if shape.is_uniform(p, radius) {
                            uniform += 1;
                            for q in directions().flat_map(|d| [p + d * radius, p + 0.5 * d * radius]) {
                                assert_eq!(shape.truth(p), shape.truth(q), "{class:?} {} {p} {q}", shape.number);
                            }
                        }
                    }
                }
            }
        }
        assert!(uniform > 14 * 6 * 400, "{uniform}");
    }

    #[test]
    fn distances_grow_no_faster_than_the_way() {
        for class in Class::ALL.into_iter().filter(|&c| c != Class::Wave) {
            for shape in class.shapes().take(8) {
                for p in points() {
                    for q in directions().map(|d| p + 0.3 * d) {
                        let (a, b) = (shape.distance(p), shape.distance(q));
                        assert!((a - b).abs() <= 0.3 + 1e-9, "{class:?} {} {p} {q} {a} {b}", shape.number);
                    }
                }
            }
        }
    }

    /// Marches to the silhouette along the gradient: a correct distance leads there.
    #[test]
    fn distances_lead_to_the_silhouette() {
        for class in Class::ALL {
            let (mut arrived, mut tried) = (0, 0);
            for shape in class.shapes().take(8) {
                for p in points() {
                    let d = shape.distance(p);
                    let h = 1e-5;
                    let gradient = DVec2::new(
                        shape.distance(p + DVec2::X * h) - shape.distance(p - DVec2::X * h),
                        shape.distance(p + DVec2::Y * h) - shape.distance(p - DVec2::Y * h),
                    ) / (2.0 * h);
                    if d.abs() < 2.0 && gradient.length() > 0.5 {
                        tried += 1;
                        arrived +=
                            usize::from(shape.distance(p - d * gradient.normalize()).abs() < 0.05 + 0.1 * d.abs());
                    }
                }
            }
            assert!(tried > 30 && arrived * 100 > tried * 85, "{class:?}: {arrived} of {tried}");
        }
    }

    #[test]
    fn shapes_are_what_their_number_says_and_differ() {
        let map = |class: Class, number| Shape::new(class, number).shadow_map([0, 0], [TILE; 2]);
        for class in Class::ALL {
            assert_eq!(map(class, 3), map(class, 3));
            let mut different = 0;
            for number in 0..12 {
                let map = map(class, number);
                let shadow = map.iter().filter(|&&d| d == CASTER_DEPTH).count();
                assert!(map.iter().all(|&d| d == CASTER_DEPTH || d == LIT_DEPTH));
                different += usize::from(shadow > 0 && shadow < map.len());
            }
            assert_eq!(different, 12, "{class:?}: both lit and shadow in every tile");
            assert_ne!(map(class, 0), map(class, 1));
        }
    }

    #[test]
    fn a_part_of_a_shadow_map_is_that_part() {
        let shape = Shape::new(Class::Glyph, 0);
        let whole = shape.shadow_map([-8, -8], [64; 2]);
        let part = shape.shadow_map([3, 20], [7, 5]);
        for j in 0..5 {
            for i in 0..7 {
                assert_eq!(part[j * 7 + i], whole[(j + 28) * 64 + i + 11]);
            }
        }
        assert!(part.contains(&CASTER_DEPTH) || whole.contains(&CASTER_DEPTH));
    }
}
