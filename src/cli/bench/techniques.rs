//! Suites `techniques` and `map-sizes`: every real-time technique, in all scenes and with all sizes of the map.

use super::driver::*;
use super::judge::real_time;
use super::timed;
use edgeshade::scene::shipped;

pub static TECHNIQUES: Suite = Suite {
    name: "techniques",
    about: "every real-time technique on every shipped scene",
    extent: |quick| timed::extent(quick, every_scene(), &[1024]),
    variants: defaults,
    ..timed::BASE
};

pub static MAP_SIZES: Suite = Suite {
    name: "map-sizes",
    about: "every real-time technique, maps of 512 to 4096 texels",
    extent: |quick| timed::extent(quick, vec![shipped::DEFAULT], &[512, 1024, 2048, 4096]),
    variants: defaults,
    group: |_, _, variant| Some(variant.label.clone()),
    ..timed::BASE
};

/// All real-time techniques at their defaults.
fn defaults(_: DeviceFeatures) -> Result<Variants> {
    Ok(available(&real_time().collect::<Vec<_>>().join(" ")))
}
