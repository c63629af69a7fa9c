//! Choice of the test that tells whether two points lie on one surface.

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
