//! The exact Euclidean distance transform.

mod edt;
