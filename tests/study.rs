//! Study of the visibility functions: our shapes reproduce the figures that are known for these functions.

use edgeshade::reference::revectorization::revectorize::{Function, Quality};
use edgeshade::reference::revectorization::shapes::study::{Method, Options, Row, study};

/// Mismatch area per texel of silhouette at a largest distance of 16 texels, in total, over and under. The figures
/// come from an independent implementation with other shapes of the same classes.
const KNOWN: [(Method, f64, [f64; 2]); 8] = [
    (Method::ShadowMap, 0.244, [0.124, 0.120]),
    (Method::Revectorized(Function::Silhouette), 0.445, [0.431, 0.014]),
    (Method::Revectorized(Function::Filtered), 0.212, [0.099, 0.113]),
    (Method::Revectorized(Function::Star), 0.144, [0.072, 0.072]),
    (Method::Bilinear, 0.203, [0.103, 0.100]),
    (Method::Revectorized(Function::Profile(Quality::Run)), 0.128, [0.065, 0.063]),
    (Method::Revectorized(Function::Profile(Quality::Neighbours)), 0.116, [0.059, 0.058]),
    (Method::Revectorized(Function::Profile(Quality::Line)), 0.111, [0.056, 0.055]),
];

/// Relative tolerance of a mismatch.
const TOLERANCE: f64 = 0.05;
/// Tolerance of over and under in texels. Holes and solids are drawn at random, and exchanging them exchanges over and
/// under.
const SIDE_TOLERANCE: f64 = 0.01;

/// Differences from the known figures.
fn differences(rows: &[Row]) -> Vec<String> {
    let mut differences = vec![];
    for (method, mismatch, [over, under]) in KNOWN {
        let Some(row) = rows.iter().find(|r| r.method == method) else {
            differences.push(format!("{}: no figure", method.name()));
            continue;
        };
        if (row.mismatch() / mismatch - 1.0).abs() > TOLERANCE {
            differences.push(format!("{}: mismatch {:.4}, known {mismatch}", method.name(), row.mismatch()));
        }
        if (row.over - over).abs() > SIDE_TOLERANCE || (row.under - under).abs() > SIDE_TOLERANCE {
            let (o, u) = (row.over, row.under);
            differences.push(format!("{}: over {o:.4} under {u:.4}, known {over} and {under}", method.name()));
        }
    }
    differences
}

#[test]
fn the_figures_are_as_known() {
    let rows = study(&Options { max_distances: vec![16], ..Options::default() }, |_, _| {});
    assert_eq!(differences(&rows), [""; 0]);

    // Results under the name of another method are noticed, however similar the two are.
    for (i, j) in [(3, 5), (5, 6), (0, 2)] {
        let mut planted = rows.clone();
        planted[i].method = rows[j].method;
        planted[j].method = rows[i].method;
        assert!(!differences(&planted).is_empty(), "{} for {}", rows[i].method.name(), rows[j].method.name());
    }
    // Exchanging dark and light is noticed, and so are missing figures.
    let mut planted = rows.clone();
    (planted[1].over, planted[1].under) = (rows[1].under, rows[1].over);
    assert_eq!(differences(&planted).len(), 1);
    assert_eq!(differences(&rows[1..]).len(), 1);
}

#[test]
fn a_larger_distance_never_costs_fewer_fetches_and_mends_shallow_edges() {
    let methods = vec![Method::Revectorized(Function::Star), Method::Revectorized(Function::Profile(Quality::Run))];
    let options = Options { methods, shapes: 8, subsamples: 8, max_distances: vec![4, 8, 16, 32] };
    for rows in study(&options, |_, _| {}).chunks(4) {
        for pair in rows.windows(2) {
            assert!(pair[0].fetches < pair[1].fetches && pair[0].fetches_as_listed <= pair[1].fetches_as_listed);
            // Shallow edges are the first class.
            assert!(pair[0].classes[0] > pair[1].classes[0], "{:?}", pair[0].method);
        }
    }
}
