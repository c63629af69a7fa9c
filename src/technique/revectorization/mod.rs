//! Techniques that straighten shadow edges in the shadow map: the papers' listings, the edge profile, and a filter over
//! either.

pub(super) mod rbsm;
pub(super) mod rbsm_branches;
pub(super) mod rbsm_filtered;
pub(super) mod rbsm_listings;
pub(super) mod rbsm_pass;
pub(super) mod rbsm_profile;
pub(super) mod rbsm_star;
mod rbsm_view;
pub(super) mod revectorized;
pub(super) mod rpcf;
