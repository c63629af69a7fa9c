//! Penumbrae around shadow edges in the camera image, by the distance to the nearest edge.

pub mod edge_line;
mod edge_seeds;
pub(super) mod edtsm;
pub(super) mod edtsm_star;
pub(super) mod edtssm;
pub(super) mod edtssm_star;
mod euclidean;
pub mod fixed_width;
mod mean_filter;
mod nearest_edge;
mod nearest_line;
mod search;
pub mod seed_width;
mod shared;
