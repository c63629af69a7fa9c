//! The CPU side of every claim: exact visibility by ray tracing, and a mirror in `f64` of each pass.
//!
//! A mirror has its shader's stem. These share one: `pcf` covers `pcf_classify.comp`, `pcf_bounds.glsl` and
//! `pcf_receiver.glsl`; `rbsm` covers `rbsm_branches.comp`, `rbsm_view.comp`, `rbsm_receiver.glsl`,
//! `rbsm_function.glsl`, `rbsm_visibility.glsl`, `edge_list.glsl`, `pixel_list.glsl` and `pixel_steps.glsl`; `edt`
//! covers `edt_*`; `edge_seeds` covers `edge_seeds.glsl`, `seed_format.glsl`, `edge_marks.glsl`, `edge_pixels.*`,
//! `edge_place.comp`, `edge_tiles.comp` and `marked_tiles.comp`; `nearest_edge` covers `nearest_edge.glsl`,
//! `nearest_block.comp` and `nearest_quad.comp`; `view` covers `receiver.glsl` and `view.glsl`; `soft` covers
//! `soft_receiver.glsl`, `soft_filter.glsl` and `blockers.glsl`; `rbssm` covers `edge_blockers.glsl` and
//! `revectorized_filter.glsl`; `shadow_volumes` covers `volume_draws.comp` and `volumes.glsl`; `silhouettes` covers
//! `casters.glsl`, `facing.comp`, `silhouettes.glsl` and `silhouette_*.comp`; `sm` covers `shadow_map_test.glsl`;
//! `edge_segments` covers `map_edge.glsl`; `sssm` covers `sssm_*`; `edsm` covers `edsm_*`, but `edsm_x` is a pass of
//! its own and covers `edge_rule.glsl`; `edge_map` covers `edge_cells.glsl` and `edge_ids.comp`. `tiles.glsl` is
//! exempt: it only packs numbers of tiles and pixels, which `pcf::listed` counts.
//! `tests/mirrors_exist.rs` holds this list against `glsl/pass`.

pub mod accumulate;
pub mod area_light;
pub mod depth_bounds;
pub mod edge_map;
pub mod edge_seeds;
pub mod edge_segments;
pub mod edsm;
pub mod edsm_x;
pub mod edt;
pub mod hsm;
mod map_receiver;
pub mod mean_filter;
pub mod nearest_edge;
pub mod pcf;
pub mod pcss;
pub mod penumbra_width;
pub mod ray_traced;
pub mod rbsm;
pub mod rbssm;
pub mod revectorize;
pub mod rpcf;
pub mod screen_filter;
pub mod seed_width;
pub mod shade;
pub mod shadow_volumes;
pub mod shapes;
pub mod silhouettes;
pub mod sm;
mod soft;
pub mod soft_auto;
pub mod sssm;
mod view;

pub use view::{FrameData, Mirror};
