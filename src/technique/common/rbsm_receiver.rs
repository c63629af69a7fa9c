//! Parameters and push constants of passes that test texels on the receiver's plane.

use super::receiver;
use crate::gpu::shader_struct;
use crate::technique::{Param, Setup};

shader_struct! {
    /// Push constants of the revectorization passes (`glsl/common/rbsm_receiver.glsl`).
    pub struct RbsmPush {
        /// Normal offset, in multiples of the offset that a plane needs.
        normal_offset: f32,
        /// Depth bias, as a fraction of the plane's change of depth per texel, summed over both axes.
        depth_bias: f32,
        /// Depth by which a curved receiver may lie in front of its plane, in texel widths per texel of distance.
        slack: f32,
    }
}

pub(crate) const NORMAL_OFFSET: Param = Param { default: 0.1, ..receiver::NORMAL_OFFSET };
pub(crate) const DEPTH_BIAS: Param = Param { default: 0.3, ..receiver::DEPTH_BIAS };
pub(crate) const SLACK: Param = Param::float(
    "slack",
    0.0,
    4.0,
    0.2,
    "texels per texel",
    "depth by which a curved receiver may lie in front of its plane, in texel widths per texel of distance",
);

/// Returns the push constants for the parameters.
pub(crate) fn push(setup: &Setup) -> RbsmPush {
    let p = &setup.params;
    RbsmPush { normal_offset: p.float("normal_offset"), depth_bias: p.float("depth_bias"), slack: p.float("slack") }
}
