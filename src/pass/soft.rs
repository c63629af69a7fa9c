//! What the passes of an area light's penumbrae share (`glsl/pass/soft_receiver.glsl`, `blockers.glsl`, `hsm.glsl`).

use crate::gpu::shader_struct;

shader_struct! {
    /// Push constants of the passes that search for blockers.
    pub struct SoftPush {
        /// Multiples of what a plane needs.
        normal_offset: f32,
        /// Fraction of a texel's slope, along both axes.
        depth_bias: f32,
    }
}

/// Where blockers are searched: `searchWindow` of `glsl/pass/hsm.glsl`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum SearchWindow {
    /// In the papers' window, which the light's near plane cuts out of the pyramid between receiver and light.
    Near,
    /// In the part of it where blockers can be, by the smallest depth in it: still every one, under denser taps.
    Blockers,
}
