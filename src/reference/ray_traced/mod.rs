//! `ray-traced`: exact visibility, the truth that every technique is compared with.
//!
//! A primary ray goes through each pixel centre. From the surface that it meets, one ray ([`hard`]) or many ([`soft`])
//! go to the light. Everything is `f64` except the boxes of the hierarchy; they are padded so that they never reject
//! what the `f64` triangle test would hit. [`fixed_penumbra`](mod@fixed_penumbra) puts penumbrae of a given width
//! around the boundary of the hard shadows.
//!
//! These are occluders, for every ray:
//!
//! * triangles of any material, from both sides; holes of masked materials let light through;
//! * casters between the light and its near plane, and outside the shadow map's frustum.
//!
//! The triangle that the ray starts on and triangles of zero area are not.
//!
//! ```no_run
//! use edgeshade::reference::ray_traced::{RayScene, hard};
//! # fn f(scene: edgeshade::scene::Scene, camera: edgeshade::view::CameraView, light: edgeshade::view::LightView)
//! # -> edgeshade::Result<()> {
//! let rays = RayScene::build(&scene)?;
//! let truth = hard(&rays, &camera, &light, [1280, 720], &|done, total| eprintln!("{done} of {total} pixels"))?;
//! # Ok(()) }
//! ```

// Conditions are written as `!(x > y)` so that NaN fails on the safe side.
#![allow(clippy::neg_cmp_op_on_partial_ord)]

mod alpha;
mod bvh;
mod cache;
mod edges;
pub mod fixed_penumbra;
mod flatten;
mod frame;
mod hard;
mod key;
mod pyramid;
mod smooth;
mod soft;
mod trace;
mod triangle;
mod truth;

pub use crate::sampling::Stratified;
pub use cache::{Cache, DEFAULT_CACHE_BYTES, Origin};
pub use fixed_penumbra::{FixedPenumbraSettings, fixed_penumbra};
pub use frame::Progress;
pub use hard::hard;
pub use key::{CacheKey, Method, cache_key};
pub use soft::{SoftSettings, soft};
pub use trace::{Hit, RayScene, Target};
pub use truth::{LeftOut, MIN_N_DOT_L, SKY, Truth};

use crate::Result;
use crate::view::{CameraView, LightView};

/// Traces the truth with [`hard`], [`soft`] or [`fixed_penumbra()`], as `method` says.
///
/// # Errors
/// Fails like the chosen function.
pub fn trace(
    scene: &RayScene,
    camera: &CameraView,
    light: &LightView,
    size: [u32; 2],
    method: &Method,
    progress: &Progress,
) -> Result<Truth> {
    match method {
        Method::Hard => hard(scene, camera, light, size, progress),
        Method::Soft(settings) => soft(scene, camera, light, size, settings, progress),
        Method::FixedPenumbra(settings) => fixed_penumbra(scene, camera, light, size, settings, progress),
    }
}
