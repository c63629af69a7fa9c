//! `ray-traced`: exact visibility, the truth that every technique is measured against.
//!
//! A primary ray goes through each pixel centre, and from the surface that it meets one ray ([`hard`]) or many
//! ([`soft`]) go to the light. Everything is `f64` except the boxes of the hierarchy, which are padded so that
//! they never reject what the `f64` triangle test would hit. [`fixed_penumbra`](mod@fixed_penumbra) puts penumbrae of a
//! given width around the boundary of the hard shadows.
//!
//! What counts as an occluder, for every ray:
//!
//! * triangles of any material, from both sides; holes of masked materials let light through;
//! * also casters between the light and its near plane, and outside the shadow map's frustum;
//! * not the triangle that the ray starts on, and nothing of zero area.
//!
//! ```no_run
//! use edgeshade::reference::ray_traced::{RayScene, hard};
//! # fn f(scene: edgeshade::scene::Scene, camera: edgeshade::view::CameraView, light: edgeshade::view::LightView)
//! # -> edgeshade::Result<()> {
//! let rays = RayScene::build(&scene)?;
//! let truth = hard(&rays, &camera, &light, [1280, 720], &|done, total| eprintln!("{done} of {total} pixels"))?;
//! # Ok(()) }
//! ```

// `!(x > y)` is how NaN is kept on the safe side.
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

/// [`hard`], [`soft`] or [`fixed_penumbra()`], as `method` says.
///
/// # Errors
/// As the three functions.
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
