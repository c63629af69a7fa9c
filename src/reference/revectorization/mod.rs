//! Mirrors of revectorized visibility, and the shapes that its functions are studied on.
//!
//! [`rbsm`] covers `rbsm_branches.comp`, `rbsm_view.comp`, `rbsm_function.glsl`, `rbsm_visibility.glsl`, `edge_list.glsl` and
//! `pixel_list.glsl`.

pub mod rbsm;
pub mod revectorize;
pub mod rpcf;
pub mod shapes;
