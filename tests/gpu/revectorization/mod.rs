//! Revectorized visibility compared with its mirrors, with the listings' own rules, and on shapes of known truth.

mod borders;
mod branches;
mod flat;
mod foreign;
mod hard_test;
mod revectorize;
mod shapes;
