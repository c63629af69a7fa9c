//! Techniques that straighten shadow edges in the shadow map: the papers' listings, the edge profile, and a filter over
//! either.

pub mod rbsm;
pub mod rbsm_branches;
pub mod rbsm_filtered;
pub mod rbsm_listings;
pub mod rbsm_pass;
pub mod rbsm_profile;
pub mod rbsm_star;
pub mod rbsm_view;
pub(crate) mod revectorized;
pub mod rpcf;
