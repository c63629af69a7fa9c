//! Receivers whose neighbouring texels are tested on the receiver's plane: parameters and push constants.

use super::receiver;
use crate::gpu::shader_struct;
use crate::technique::{Param, Setup};

shader_struct! {
    /// Push constants of the revectorization passes (`glsl/common/rbsm_receiver.glsl`).
    pub struct RbsmPush {
        /// Multiples of what a plane needs.
        normal_offset: f32,
        /// Fraction of a texel's slope, along both axes.
        depth_bias: f32,
        /// Texels of depth a texel of distance that a curved receiver may lie before its plane.
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
    "texels a texel",
    "how far a curved receiver may lie before its plane, a texel of distance",
);

/// The constants of a frame from the parameters.
pub(crate) fn push(setup: &Setup) -> RbsmPush {
    let p = &setup.params;
    RbsmPush { normal_offset: p.float("normal_offset"), depth_bias: p.float("depth_bias"), slack: p.float("slack") }
}
