//! Shadows from the silhouette edges of the casters' meshes.

mod edge_maps;
mod edge_views;
mod edsm_x;
pub mod shadow_volumes;
