//! Penumbrae of an area light by a search for its blockers, filtered in the map or in the image.

mod classified;
pub mod mssm;
pub(in crate::technique) mod pcss;
mod penumbra_width;
pub mod rbssm;
pub(super) mod rbssm_naive;
pub mod screen_filter;
mod screen_space;
pub(super) mod soft_auto;
pub(super) mod ssabss;
pub(super) mod ssrbssm;
pub mod vssm;
mod window_moments;
