//! Offset of a receiver before it is tested against the shadow map.

use crate::technique::Param;

/// The offset that every technique moves its receivers by.
pub(crate) const NORMAL_OFFSET: Param = Param::float(
    "normal_offset",
    0.0,
    16.0,
    1.0,
    "planes",
    "receiver moved along its normal, in multiples of the part of a texel that a plane of its tilt needs",
);
