//! Mirrors of the techniques that use the casters' edges.
//!
//! [`silhouettes`] covers `casters.glsl`, `facing.comp`, `silhouette_edges.comp` and `silhouette_offsets.comp`;
//! [`shadow_volumes`] covers `volume_draws.comp`; [`edge_map`] covers `edge_cells.glsl` and `edge_ids.comp`.

pub mod edge_map;
pub mod edge_segments;
pub mod edsm;
pub mod edsm_x;
pub mod shadow_volumes;
pub mod silhouettes;
pub mod sssm;
