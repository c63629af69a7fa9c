//! Suite `pcf`: widths of the kernel, methods of fetching and skipping.

use super::driver::*;
use super::timed;
use edgeshade::scene::shipped;

pub static SUITE: Suite = Suite {
    name: "pcf",
    about: "pcf of widths 3 to 31, loop and gather, with and without skipping",
    extent: |quick| timed::extent(quick, vec![shipped::DEFAULT], &[1024]),
    variants: widths,
    group: |_, _, variant| Some(format!("width {}", variant.choice.params.int("width"))),
    ..timed::BASE
};

fn widths(_: DeviceFeatures) -> Result<Variants> {
    let mut wanted = String::new();
    for width in [3, 7, 15, 31] {
        for skip in ["off", "pixels", "tiles"] {
            for fetch in ["loop", "gather"] {
                wanted += &format!("pcf:width={width},fetch={fetch},skip={skip} ");
            }
        }
    }
    Ok(available(&wanted))
}
