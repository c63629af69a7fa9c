//! Mirrors of the techniques that list the casters' triangles and silhouette edges in a grid of the light's view.
//!
//! [`grid`] covers `grid.glsl`, `grid_receiver.glsl`, `receiver_cells.comp`, `depth_levels.comp` and `list_starts.comp`.
//! [`layers`] covers `grid_layers.glsl`, `grid_triangle.glsl`, `grid_triangles.comp`, `exact_hard.comp` and `list_view.comp`.
//! [`light_seen`] covers `grid_edge.glsl`, `grid_edges.comp`, `light_bits.glsl` and `exact_soft.comp`. Both know nothing of lists: they test
//! every caster against every receiver, in camera view space. What they find must be in the lists that
//! `caster_lists.glsl` and `refine.comp` make.

pub mod grid;
pub mod layers;
pub mod light_seen;
