//! Choice of the test that tells whether two points lie on one surface.

use crate::technique::{Param, Params};

/// Test that tells whether two points lie on one surface.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum SurfaceTest {
    /// Each lies near the plane of the other.
    Planes,
    /// Their eye depths are similar, as in the paper.
    Depth,
}

impl SurfaceTest {
    /// Default tolerance of the test. For planes it is a distance in pixels from the plane per pixel of distance, found
    /// by measurement. For depths it is a share of the depth, the paper's value.
    pub fn usual_tolerance(self) -> f32 {
        match self {
            Self::Planes => 0.35,
            Self::Depth => 2.5e-3,
        }
    }
}

pub(crate) const EDGE_THRESHOLD: Param = Param::float(
    "edge_threshold",
    0.0,
    8.0,
    0.0,
    "see help",
    "of that test: pixels off the plane a pixel of distance, or a share of the depth; 0: 0.35 and 0.0025",
);

/// Returns the test that a technique's parameter `surfaces` chooses, and its tolerance by [`EDGE_THRESHOLD`].
pub(crate) fn surface_test(params: &Params) -> (SurfaceTest, f32) {
    let test = if params.word("surfaces") == "plane" { SurfaceTest::Planes } else { SurfaceTest::Depth };
    let tolerance = match params.float("edge_threshold") {
        0.0 => test.usual_tolerance(),
        given => given,
    };
    (test, tolerance)
}
