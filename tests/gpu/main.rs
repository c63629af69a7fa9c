//! Everything that needs a GPU, in one binary: its tests take turns on the device.
//!
//! Validation and synchronization validation are on, and any message fails the test that caused it. Run with
//! `--nocapture` to see the figures.
#![cfg(feature = "app")]

mod bias;
mod borders;
mod branches;
mod common;
mod contract;
mod edge_maps;
mod edge_views;
mod edsm_x;
mod edt;
mod flat;
mod foreign;
mod gbuffer;
mod golden;
mod hard_test;
mod made;
mod mirrors;
mod noise;
mod passes;
mod penumbra;
mod properties;
mod revectorize;
mod screen_space;
mod shadow_volumes;
mod shapes;
mod soft;
mod soft_analytic;
mod soft_edt;
mod soft_stability;
mod stability;
mod statistics;
mod structs;
mod timing;
mod validation;
