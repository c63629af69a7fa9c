//! All tests that need a GPU, in one binary: they take turns on the device.
//!
//! Validation and synchronization validation are on, and any message fails the test that caused it. Run with
//! `--nocapture` to see the figures.
//!
//! Tests of one room of `src/technique` are in the folder of its name; those here apply to all techniques.
#![cfg(feature = "app")]

mod bias;
mod caster_edges;
mod common;
mod contract;
mod distance_transform;
mod exact;
mod filtering;
mod golden;
mod made;
mod mirrors;
mod noise;
mod penumbra;
mod pipelines;
mod properties;
mod revectorization;
mod soft;
mod stability;
mod statistics;
mod structs;
mod timing;
mod validation;
