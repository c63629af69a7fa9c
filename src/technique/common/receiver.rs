//! Offset of a receiver before it is tested against the shadow map.

use crate::technique::Param;

/// Parameter for the distance by which every technique moves its receivers.
pub(crate) const NORMAL_OFFSET: Param = Param::float(
    "normal_offset",
    0.0,
    16.0,
    1.0,
    "planes",
    "distance by which the receiver is moved along its normal, in multiples of the offset that a plane of its tilt needs",
);
