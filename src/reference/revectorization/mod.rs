//! Mirrors of revectorized visibility, and the shapes that its functions are studied on.
//!
//! [`rbsm`] covers `rbsm_branches.comp`, `rbsm_view.comp` and `rbsm_function.glsl`.

pub mod rbsm;
pub mod revectorize;
pub mod rpcf;
pub mod shapes;
