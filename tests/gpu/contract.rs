//! Contract with an engine: what is rejected and with which words, and what never gives a wrong picture.

mod kept;
mod refused;
mod rounding;
mod times;

use edgeshade::technique::{ALL, Kind};

/// Settings with which a technique keeps more data of the light than by default, or makes it differently.
const KEEPERS: &[(&str, &[(&str, &str)])] = &[
    ("pcf", &[("width", "15"), ("skip", "tiles")]),
    ("pcf", &[("width", "31")]),
    ("vsm", &[("filter", "gaussian"), ("mips", "off")]),
    ("msm", &[("filter", "gaussian"), ("bits", "16")]),
    ("rpcf", &[("skip", "quads")]),
    ("sssm", &[("generation", "raster")]),
    ("edsm", &[("border", "4")]),
    ("edsm-x", &[("generation", "raster"), ("border", "2")]),
    ("shadow-volumes", &[("path", "geometry"), ("robust", "always")]),
];

/// Returns every technique of the registry with its defaults, and the settings of [`KEEPERS`].
fn every_technique() -> impl Iterator<Item = (&'static str, &'static [(&'static str, &'static str)])> {
    let real_time = ALL.iter().filter(|t| matches!(t.kind, Kind::RealTime(_)));
    real_time.map(|t| (t.id, &[][..])).chain(KEEPERS.iter().copied())
}
