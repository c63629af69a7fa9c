//! Suite `accuracy`: hard shadows of every shipped scene against the truth, for several sizes of the map.

use super::driver::*;
use super::hard;
use edgeshade::scene::Masked;

pub static SUITE: Suite = Suite {
    name: "accuracy",
    about: "error against the truth over scenes and map sizes, with a plot",
    extent: |quick| hard::extent(quick, &[512, 1024, 2048, 4096]),
    variants: |_| contenders(),
    resumes: true,
    measure: |host, run, scene| hard::measure(host, run, scene, Masked::Keep),
    page: |r| hard::page(r, "lights without size, against the ray-traced truth.", "", &[]),
    ..hard::BASE
};
