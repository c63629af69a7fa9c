//! The study of the visibility functions: our shapes give the figures that the functions are known for.

use edgeshade::reference::revectorize::{Function, Quality};
use edgeshade::reference::shapes::study::{Method, Options, study};

/// Mismatch area per texel of silhouette at a largest distance of 16 texels, of another implementation with other shapes
/// of the same classes; `over` and `under` add up to it.
const KNOWN: [(Method, f64); 8] = [
    (Method::ShadowMap, 0.244),
    (Method::Revectorized(Function::Silhouette), 0.445),
    (Method::Revectorized(Function::Filtered), 0.212),
    (Method::Revectorized(Function::Star), 0.144),
    (Method::Bilinear, 0.203),
    (Method::Revectorized(Function::Profile(Quality::Run)), 0.128),
    (Method::Revectorized(Function::Profile(Quality::Neighbours)), 0.116),
    (Method::Revectorized(Function::Profile(Quality::Line)), 0.111),
];

/// Of a figure.
const TOLERANCE: f64 = 0.05;

#[test]
fn table() {
    let start = std::time::Instant::now();
    let rows = study(&Options::default(), |_, _| {});
    println!("{:?}", start.elapsed());
    for r in rows {
        println!(
            "{:32} {:?} {:.4} {:.4}/{:.4} {:.3} {:.1} {:.1}  {:?}",
            r.method.name(),
            r.max_distance,
            r.mismatch(),
            r.over,
            r.under,
            r.displacement,
            r.fetches,
            r.fetches_as_listed,
            r.classes.iter().map(|c| (c * 1000.).round() / 1000.).collect::<Vec<_>>()
        );
    }
}
