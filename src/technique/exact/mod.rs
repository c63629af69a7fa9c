//! Exact shadows from lists of the casters' triangles and silhouette edges in a grid of the light's view.

pub mod exact_hard;
pub mod exact_soft;
pub mod grid;
mod list_view;
