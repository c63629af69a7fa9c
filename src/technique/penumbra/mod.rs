//! Penumbrae around shadow edges in the camera image, by the distance to the nearest edge.

pub mod edge_place;
pub mod edge_seeds;
pub mod edtsm;
pub mod edtsm_star;
pub mod edtssm;
pub mod edtssm_star;
mod euclidean;
pub mod fixed_width;
pub mod mean_filter;
pub mod nearest_edge;
pub mod seed_width;
pub mod shared;
