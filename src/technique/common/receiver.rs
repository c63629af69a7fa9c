//! Offset and bias of a receiver before it is tested against the shadow map.

use crate::gpu::shader_struct;
use crate::technique::{Param, Params, Setup};

shader_struct! {
    /// Push constants of the passes that test a receiver against the shadow map.
    pub struct ReceiverPush {
        /// Multiples of what a plane needs.
        normal_offset: f32,
        /// Slopes of the receiver's plane a texel, summed over both axes; for `glsl/filtering/sm.comp`, light depth.
        depth_bias: f32,
    }
}

/// Parameter for the distance by which every technique moves its receivers.
pub(crate) const NORMAL_OFFSET: Param = Param::float(
    "normal_offset",
    0.0,
    16.0,
    1.0,
    "planes",
    "distance by which the receiver is moved along its normal, in multiples of the offset that a plane of its tilt needs",
);
/// The bias of the techniques that test many texels on the receiver's plane.
pub(crate) const DEPTH_BIAS: Param = Param::float(
    "depth_bias",
    0.0,
    16.0,
    0.5,
    "texel slopes",
    "additional bias of the receiver's depth, in multiples of its plane's change of depth per texel",
);

pub(crate) const RECEIVER: Param = Param::choice(
    "receiver",
    &["plane", "fixed"],
    0,
    "compare texels with the receiver's plane, or all with the fragment's own depth as in the papers",
);

/// Returns true if [`RECEIVER`] says that all texels are compared with the receiver's own depth.
pub(crate) fn is_fixed(params: &Params) -> bool {
    params.word("receiver") == "fixed"
}

/// Returns the constants of a frame from the parameters.
pub(crate) fn push(setup: &Setup) -> ReceiverPush {
    let p = &setup.params;
    ReceiverPush { normal_offset: p.float("normal_offset"), depth_bias: p.float("depth_bias") }
}
