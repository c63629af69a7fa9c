//! Tests that tell which points lie on one surface.

/// Test that tells whether two points lie on one surface.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum SurfaceTest {
    /// Each lies near the plane of the other.
    Planes,
    /// Their eye depths are alike, as in the paper.
    Depth,
}

impl SurfaceTest {
    /// What the test allows unless the user says otherwise: pixels a pixel off the plane, by measurement; or a share of the
    /// depth, the paper's figure.
    pub fn usual_tolerance(self) -> f32 {
        match self {
            Self::Planes => 0.35,
            Self::Depth => 2.5e-3,
        }
    }
}
