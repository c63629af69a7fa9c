//! The geometry that casts: what techniques that know it work from.

pub mod topology;

#[cfg(test)]
pub(crate) mod shapes;
