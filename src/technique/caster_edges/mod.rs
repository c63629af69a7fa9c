//! Shadows from the silhouette edges of the casters' meshes.

mod edge_lookup;
pub mod edge_map;
pub mod edge_segments;
pub mod edsm;
pub mod edsm_x;
pub mod kept_segments;
pub mod shadow_volumes;
pub mod silhouette_view;
pub mod silhouettes;
pub mod sssm;
mod volume_cull;
pub mod volumes;
