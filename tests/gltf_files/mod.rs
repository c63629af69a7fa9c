//! Tests of the loader, one module for each part; `builder` makes the files.

mod bad;
mod builder;
mod fit;
mod fuzz;
mod geometry;
mod hierarchy;
mod outside;
mod poses;
mod surfaces;
mod views;
