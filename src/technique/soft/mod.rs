//! Penumbrae of an area light by a search for its blockers, filtered in the map or in the image.

pub mod classified;
pub mod pcss;
pub mod penumbra_width;
pub mod rbssm;
pub mod rbssm_naive;
pub mod screen_filter;
mod screen_space;
pub mod soft_auto;
pub mod ssabss;
pub mod ssrbssm;
