//! Mirrors of the revectorization techniques, and the shapes on which visibility functions are studied.
//!
//! [`rbsm`] covers `rbsm_branches.comp`, `rbsm_view.comp` and `rbsm_function.glsl`.

pub mod rbsm;
pub mod revectorize;
pub mod rpcf;
pub mod shapes;
