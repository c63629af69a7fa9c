//! The contract with an engine: what is refused and in which words, and what never gives a wrong picture.

mod kept;
mod refused;
mod rounding;
mod times;

use edgeshade::technique::{ALL, Kind};

/// Settings under which a technique keeps something of the light that it does not keep at its defaults, or makes it
/// otherwise.
const KEEPERS: &[(&str, &[(&str, &str)])] = &[
    ("pcf", &[("width", "15"), ("skip", "tiles")]),
    ("pcf", &[("width", "31")]),
    ("rpcf", &[("skip", "bounds")]),
    ("sssm", &[("generation", "raster")]),
    ("edsm", &[("border", "4")]),
    ("edsm-x", &[("generation", "raster"), ("border", "2")]),
    ("shadow-volumes", &[("path", "geometry"), ("robust", "always")]),
];

/// Every technique of the registry at its defaults, and what keeps more.
fn every_technique() -> impl Iterator<Item = (&'static str, &'static [(&'static str, &'static str)])> {
    let real_time = ALL.iter().filter(|t| matches!(t.kind, Kind::RealTime(_)));
    real_time.map(|t| (t.id, &[][..])).chain(KEEPERS.iter().copied())
}
