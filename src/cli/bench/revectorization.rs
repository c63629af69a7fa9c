//! Suite `revectorization`: the RBSM family compared with plain shadow mapping, and its averages with `pcf`.

use super::driver::*;
use super::timed;
use edgeshade::scene::shipped;

pub static SUITE: Suite = Suite {
    name: "revectorization",
    about: "cost that the RBSM family adds to sm, maps of 512 to 4096 texels",
    extent: |quick| timed::extent(quick, vec![shipped::DEFAULT, "robot"], &[512, 1024, 2048, 4096]),
    variants: |_| Ok(available(FAMILY)),
    group: |scene, map, variant| {
        let is_averaged = ["pcf", "rpcf"].contains(&variant.choice.info.id);
        Some(format!("{scene} {map} {}", if is_averaged { "averaged" } else { "hard" }))
    },
    ..timed::BASE
};

const FAMILY: &str = "sm rbsm:preset=published rbsm-filtered:preset=published rbsm-star:preset=published rbsm:skip=off rbsm:skip=list rbsm-branches:skip=off rbsm-branches:skip=list rbsm-filtered:skip=off \
                      rbsm-filtered:skip=list rbsm-filtered:shapes=printed rbsm-branches:variant=filtered,skip=off rbsm-branches:variant=filtered,skip=list \
                      rbsm-listings rbsm-listings:variant=filtered rbsm-listings:variant=star \
                      rbsm-star:skip=off rbsm-star:skip=list rbsm-profile:skip=off rbsm-profile:skip=list \
                      rbsm-profile:filter=ramp rbsm-profile:quality=neighbours rbsm-profile:quality=line pcf:width=7 rpcf:skip=off rpcf:skip=quads \
                      rpcf:skip=list rpcf:visibility=star rpcf:visibility=profile";
