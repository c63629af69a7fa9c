//! Revectorized visibility: against its mirrors, the listings' own rules, and shapes of known truth.

mod borders;
mod branches;
mod flat;
mod foreign;
mod hard_test;
mod revectorize;
mod shapes;
