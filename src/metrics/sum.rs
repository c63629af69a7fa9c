//! Sums whose result does not depend on the number of threads.

use rayon::prelude::*;

/// Adds up the results of `row(0)`, `row(1)`, ...: computes rows in parallel and adds them in order.
pub(crate) fn sum_rows<const N: usize>(rows: usize, row: impl Fn(usize) -> [f64; N] + Sync) -> [f64; N] {
    let parts: Vec<[f64; N]> = (0..rows).into_par_iter().map(&row).collect();
    let mut total = [0.0; N];
    for part in parts {
        (0..N).for_each(|k| total[k] += part[k]);
    }
    total
}
