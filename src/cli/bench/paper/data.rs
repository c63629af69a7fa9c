//! The papers' tables as data: scenes, axes, methods and printed figures.

use super::claims::{self, Claim};
use crate::cli::bench::record::Record;

/// Quantity that a table varies.
#[derive(Clone, Copy, PartialEq, Eq)]
pub enum Axis {
    /// Side of the shadow map, texels.
    Map,
    /// Height of the picture, pixels.
    Height,
    /// Width of the kernel, texels or taps.
    Kernel,
}

impl Axis {
    pub fn name(self) -> &'static str {
        match self {
            Self::Map => "map",
            Self::Height => "height",
            Self::Kernel => "kernel",
        }
    }
}

/// A technique of a paper.
pub struct Method {
    /// Name in the paper.
    pub name: &'static str,
    /// Technique and settings, in the syntax of the command line.
    pub technique: &'static str,
    /// Parameter that the kernel's width sets.
    pub kernel: Option<&'static str>,
    /// Printed milliseconds of whole frames, by scene and column; empty if the paper has a chart alone.
    pub ms: &'static [&'static [f64]],
}

/// A table of times.
pub struct Table {
    pub name: &'static str,
    /// Shipped scenes, and what the paper calls the scenes that they stand in for.
    pub scenes: &'static [(&'static str, &'static str)],
    pub axis: Axis,
    pub at: &'static [u32],
    /// Side of the map if the axis is another.
    pub map: u32,
    /// Lights without size.
    pub hard: bool,
    /// Printed milliseconds of shadow mapping, by scene and column.
    pub sm: &'static [&'static [f64]],
    pub methods: &'static [Method],
}

impl Table {
    pub fn scenes(&self, quick: bool) -> &'static [(&'static str, &'static str)] {
        if quick { &self.scenes[..1] } else { self.scenes }
    }

    pub fn columns(&self, quick: bool) -> &'static [u32] {
        if quick { &self.at[..2] } else { self.at }
    }

    /// Size of the picture and side of the map of a column.
    pub fn place(&self, column: u32, quick: bool) -> ([u32; 2], u32) {
        let height = if self.axis == Axis::Height { column } else { 720 };
        let width = if height == 480 { 854 } else { height * 16 / 9 };
        let size = if quick { [width / 4, height / 4] } else { [width, height] };
        (size, if self.axis == Axis::Map { column } else { self.map })
    }

    /// Printed time of a method (`None`: shadow mapping) and its ratio to shadow mapping.
    pub fn printed(&self, method: Option<&Method>, scene: usize, column: usize) -> Record {
        let at = |ms: &[&[f64]]| ms.get(scene).and_then(|row| row.get(column)).copied();
        let (ms, sm) = (at(method.map_or(self.sm, |m| m.ms)), at(self.sm));
        let ratio = ms.zip(sm).map(|(ms, sm)| ms / sm);
        let added = ms.zip(sm).map(|(ms, sm)| ms - sm);
        Record::of([("paper_ms", ms.into()), ("paper_ratio", ratio.into()), ("paper_added_ms", added.into())])
    }
}

/// Errors that a paper's figures show.
pub struct Judged {
    pub name: &'static str,
    pub scenes: &'static [(&'static str, &'static str)],
    pub maps: &'static [u32],
    /// The truth is that of the scene's area light; otherwise the light has no size.
    pub soft: bool,
    pub methods: &'static [Method],
    /// Printed RMSE by scene and method.
    pub rmse: &'static [&'static [f64]],
}

pub struct Paper {
    pub suite: &'static str,
    pub about: &'static str,
    pub citation: &'static str,
    pub tables: &'static [Table],
    pub judged: &'static [Judged],
    pub claims: &'static [Claim],
}

impl Paper {
    /// Names of its tables and figures.
    pub fn parts(&self, quick: bool) -> Vec<&'static str> {
        let all: Vec<_> = self.tables.iter().map(|t| t.name).chain(self.judged.iter().map(|j| j.name)).collect();
        // One table and one figure.
        let few = |name: &&str| {
            Some(*name) == self.tables.first().map(|t| t.name) || self.judged.iter().any(|j| j.name == *name)
        };
        all.into_iter().filter(|name| !quick || few(name)).collect()
    }
}

pub static ALL: [&Paper; 5] = [&EDTSM_STAR, &RBSSM, &EDTSSM, &EDSM, &RBSM];

const MAPS: &[u32] = &[512, 1024, 2048, 4096];
const HEIGHTS: &[u32] = &[480, 720, 1080];

const fn method(
    name: &'static str,
    technique: &'static str,
    kernel: Option<&'static str>,
    ms: &'static [&'static [f64]],
) -> Method {
    Method { name, technique, kernel, ms }
}

pub static RBSM: Paper = Paper {
    suite: "paper-004",
    about: "the tables of the paper on revectorization (2017), as published and by our defaults, with its claims",
    citation: "Macedo, Apolinário, Agüero, \"Revectorization-Based Shadow Mapping\" (2017), tables 2 to 5 and figures 6 and 7, \
               on a GeForce GTX Titan X.",
    tables: &[
        Table {
            name: "table 2",
            scenes: &[("fence", "Fence")],
            axis: Axis::Map,
            at: MAPS,
            map: 0,
            hard: true,
            sm: &[&[3.03, 3.05, 3.07, 3.30]],
            methods: &[
                method("RBSM, optimized", "rbsm", None, &[&[3.22, 3.32, 3.49, 4.34]]),
                method(
                    "RBSM, not optimized",
                    "rbsm-branches:receiver=fixed,normal_offset=1,depth_bias=2",
                    None,
                    &[&[3.23, 3.33, 3.51, 4.36]],
                ),
                method("Shadow volumes", "shadow-volumes", None, &[&[140.2, 140.2, 140.2, 140.2]]),
            ],
        },
        Table {
            name: "table 3",
            scenes: &[("fence", "Fence")],
            axis: Axis::Height,
            at: &[720, 1080],
            map: 2048,
            hard: true,
            sm: &[&[3.07, 3.67]],
            methods: &[
                method("RBSM, optimized", "rbsm", None, &[&[3.49, 4.29]]),
                method(
                    "RBSM, not optimized",
                    "rbsm-branches:receiver=fixed,normal_offset=1,depth_bias=2",
                    None,
                    &[&[3.51, 4.31]],
                ),
                method("Shadow volumes", "shadow-volumes", None, &[&[140.2, 297.62]]),
            ],
        },
        Table {
            name: "table 4",
            scenes: &[("robot", "QuadBot")],
            axis: Axis::Map,
            at: MAPS,
            map: 0,
            hard: true,
            sm: &[&[5.49, 5.53, 5.58, 5.98]],
            methods: &[
                method("PCF", "pcf:width=3", None, &[&[6.25, 6.75, 6.82, 7.40]]),
                method("VSM", "vsm:width=3", None, &[&[6.45, 6.81, 7.14, 8.00]]),
                method("MSM", "msm:width=3", None, &[&[6.53, 6.84, 7.09, 8.06]]),
                method("RBSM, optimized", "rbsm-filtered", None, &[&[7.04, 7.70, 8.14, 9.40]]),
                method(
                    "RBSM, not optimized",
                    "rbsm-branches:variant=filtered,receiver=fixed,depth_bias=1.5",
                    None,
                    &[&[7.07, 7.73, 8.20, 9.46]],
                ),
            ],
        },
        Table {
            name: "table 5",
            scenes: &[("robot", "QuadBot")],
            axis: Axis::Height,
            at: &[720, 1080],
            map: 1024,
            hard: true,
            sm: &[&[5.53, 6.25]],
            methods: &[
                method("PCF", "pcf:width=3", None, &[&[6.75, 7.40]]),
                method("VSM", "vsm:width=3", None, &[&[6.81, 8.13]]),
                method("MSM", "msm:width=3", None, &[&[6.84, 8.00]]),
                method("RBSM, optimized", "rbsm-filtered", None, &[&[7.70, 9.98]]),
                method(
                    "RBSM, not optimized",
                    "rbsm-branches:variant=filtered,receiver=fixed,depth_bias=1.5",
                    None,
                    &[&[7.73, 10.04]],
                ),
            ],
        },
    ],
    judged: &[Judged {
        name: "figures 6 and 7",
        scenes: &[("fence", "Fence"), ("robot", "QuadBot")],
        maps: &[1024],
        soft: false,
        methods: &[
            method("Shadow mapping", "sm", None, &[]),
            method("RBSM", "rbsm", None, &[]),
            method("PCF", "pcf:width=3", None, &[]),
            method("VSM", "vsm:width=3", None, &[]),
            method("MSM", "msm:width=3", None, &[]),
            method("RBSM filtering", "rbsm-filtered", None, &[]),
            method("Shadow volumes", "shadow-volumes", None, &[]),
        ],
        rmse: &[],
    }],
    claims: &[
        Claim { source: "table 2", text: "RBSM adds 6 to 30 % to shadow mapping", judge: claims::rbsm_adds },
        Claim {
            source: "section 5.2",
            text: "the optimized form is about 1 % faster than the 43 branches",
            judge: claims::branches_cost_more,
        },
    ],
};

/// Scenes that stand in for two of the paper's three.
const OF_EDTSM: &[(&str, &str)] = &[("robot", "figure 8"), ("jenga", "figure 9")];

pub static EDTSM_STAR: Paper = Paper {
    suite: "paper-000",
    about: "the tables of the paper on EDTSM* (2018), as published and by our defaults, with its claims",
    citation: "Macedo, Apolinário, \"Improved anti-aliasing for Euclidean distance transform shadow mapping\" (2018), tables 1 \
               to 4, on a GeForce GTX Titan X. Its prefiltering techniques (VSM, EVSM and MSM) have one row; here they are VSM. \
               The kernel of EDTSM and EDTSM* is that of the mean filter, as the paper says of table 3.",
    tables: &[
        Table {
            name: "table 1",
            scenes: OF_EDTSM,
            axis: Axis::Map,
            at: MAPS,
            map: 0,
            hard: true,
            sm: &[&[9.3, 9.4, 9.5, 9.9], &[0.7, 0.8, 0.9, 1.3]],
            methods: &[
                method("Prefiltering", "vsm:width=15", None, &[&[10.5, 10.6, 10.8, 12.0], &[1.9, 2.1, 2.4, 3.6]]),
                method("PCF", "pcf:width=15", None, &[&[11.3, 11.4, 11.4, 11.7], &[2.9, 3.0, 3.1, 3.5]]),
                method("EDTSM", "edtsm", None, &[&[12.8, 12.9, 13.0, 13.7], &[4.4, 4.5, 4.7, 5.6]]),
                method("EDTSM*", "edtsm-star", None, &[&[12.9, 13.0, 13.2, 13.8], &[4.5, 4.6, 4.8, 5.7]]),
                method("RPCF", "rpcf:width=7", None, &[&[26.2, 27.3, 27.8, 30.0], &[10.4, 11.0, 11.5, 12.0]]),
            ],
        },
        Table {
            name: "tables 2 and 4",
            scenes: OF_EDTSM,
            axis: Axis::Height,
            at: HEIGHTS,
            map: 1024,
            hard: true,
            sm: &[&[8.8, 9.4, 9.7], &[0.4, 0.8, 1.1]],
            methods: &[
                method("Prefiltering", "vsm:width=15", None, &[&[9.9, 10.6, 11.3], &[0.9, 2.1, 3.1]]),
                method("PCF", "pcf:width=15", None, &[&[9.8, 11.4, 11.9], &[0.9, 3.0, 4.0]]),
                method("EDTSM", "edtsm", None, &[&[10.7, 12.9, 14.7], &[2.3, 4.5, 6.9]]),
                method("EDTSM*", "edtsm-star", None, &[&[10.8, 13.0, 14.9], &[2.3, 4.6, 6.9]]),
                method("RPCF", "rpcf:width=7", None, &[&[16.4, 27.3, 30.3], &[4.3, 11.0, 12.5]]),
            ],
        },
        Table {
            name: "table 3",
            scenes: OF_EDTSM,
            axis: Axis::Kernel,
            at: &[7, 15, 23, 31],
            map: 1024,
            hard: true,
            sm: &[&[9.4, 9.4, 9.4, 9.4], &[0.8, 0.8, 0.8, 0.8]],
            methods: &[
                method(
                    "Prefiltering",
                    "vsm:width=15",
                    Some("width"),
                    &[&[10.3, 10.6, 10.8, 11.1], &[1.8, 2.1, 2.4, 2.7]],
                ),
                method("PCF", "pcf:width=15", Some("width"), &[&[9.8, 11.4, 13.5, 17.0], &[1.2, 3.0, 5.6, 9.3]]),
                method("EDTSM", "edtsm", Some("filter_taps"), &[&[12.3, 12.9, 13.5, 14.2], &[4.0, 4.5, 5.3, 6.1]]),
                method(
                    "EDTSM*",
                    "edtsm-star",
                    Some("filter_taps"),
                    &[&[12.4, 13.0, 13.5, 14.3], &[4.1, 4.6, 5.3, 6.1]],
                ),
                method(
                    "RPCF",
                    "rpcf:width=7",
                    Some("width"),
                    &[&[27.3, 77.5, 166.6, 285.7], &[11.0, 65.7, 145.3, 255.7]],
                ),
            ],
        },
    ],
    judged: &[],
    claims: &[
        Claim {
            source: "table 3",
            text: "EDTSM* overtakes PCF at kernels of 23 and more",
            judge: claims::edtsm_star_overtakes,
        },
        Claim {
            source: "table 4",
            text: "the distance transform is the bottleneck of EDTSM*",
            judge: claims::edt_is_bottleneck,
        },
        Claim { source: "tables 1 to 3", text: "RPCF is the slowest", judge: claims::rpcf_is_slowest },
    ],
};

const OF_RBSSM: &[(&str, &str)] = &[("knot", "YeahRight"), ("courtyard", "San Miguel")];

pub static RBSSM: Paper = Paper {
    suite: "paper-001",
    about: "the figures of the paper on RBSSM (2019), as published and by our defaults, with its claims",
    citation: "Macedo, Apolinário, Agüero, \"Revectorization-based soft shadow mapping\" (2019), figures 7 to 12, on a GeForce \
               GTX Titan X. Its times are charts without figures.",
    tables: &[
        Table {
            name: "figure 11",
            scenes: OF_RBSSM,
            axis: Axis::Map,
            at: MAPS,
            map: 0,
            hard: false,
            sm: &[],
            methods: OF_FIGURES_11_12,
        },
        Table {
            name: "figure 12",
            scenes: OF_RBSSM,
            axis: Axis::Height,
            at: HEIGHTS,
            map: 1024,
            hard: false,
            sm: &[],
            methods: OF_FIGURES_11_12,
        },
    ],
    judged: &[Judged {
        name: "figures 7 and 9",
        scenes: OF_RBSSM,
        maps: &[1024],
        soft: true,
        methods: &[
            method("PCSS", "pcss", None, &[]),
            method("SSABSS", "ssabss", None, &[]),
            method("MSSM", "mssm", None, &[]),
            method("RBSSM", "rbssm", None, &[]),
            method("SSRBSSM", "ssrbssm", None, &[]),
        ],
        rmse: &[&[0.0289, 0.0438, 0.0535, 0.0273, 0.0366], &[0.0970, 0.1093, 0.1077, 0.0959, 0.1080]],
    }],
    claims: &[
        Claim { source: "figures 7 and 9", text: "RBSSM has the lowest error", judge: claims::rbssm_errs_least },
        Claim {
            source: "section 6.4",
            text: "SSRBSSM is 2 to 4 times faster than RBSSM",
            judge: claims::ssrbssm_is_faster,
        },
    ],
};

const OF_FIGURES_11_12: &[Method] = &[
    method("PCSS", "pcss", None, &[]),
    method("MSSM", "mssm", None, &[]),
    method("SSABSS", "ssabss", None, &[]),
    method("SSRBSSM", "ssrbssm", None, &[]),
    method("RBSSM", "rbssm", None, &[]),
];

pub static EDTSSM: Paper = Paper {
    suite: "paper-002",
    about: "the tables of the paper on EDTSSM (2017), as published and by our defaults, with its claims",
    citation: "Macedo, Apolinário, \"Euclidean Distance Transform Soft Shadow Mapping\" (SIBGRAPI 2017), tables I and II, on a \
               GeForce GTX Titan X.",
    tables: &[
        Table {
            name: "table I",
            scenes: &[("robot", "figure 3"), ("knot", "figure 5")],
            axis: Axis::Map,
            at: MAPS,
            map: 0,
            hard: false,
            sm: &[],
            methods: &[
                method("PCSS", "pcss", None, &[&[2.8, 2.9, 3.0, 3.1], &[4.8, 4.9, 5.0, 5.6]]),
                method("VSSM", "vssm", None, &[&[2.0, 4.0, 6.5, 8.2], &[4.7, 6.2, 7.0, 9.1]]),
                method("MSSM", "mssm", None, &[&[1.8, 3.6, 5.1, 6.5], &[4.2, 5.7, 6.5, 8.2]]),
                method("EDTSSM", "edtssm", None, &[&[4.3, 4.5, 4.6, 5.0], &[6.7, 6.8, 7.0, 7.2]]),
            ],
        },
        Table {
            name: "table II",
            scenes: &[("robot", "figure 3"), ("knot", "figure 5")],
            axis: Axis::Height,
            at: HEIGHTS,
            map: 1024,
            hard: false,
            sm: &[],
            methods: &[
                method("PCSS", "pcss", None, &[&[1.4, 2.9, 3.1], &[3.8, 4.9, 5.3]]),
                method("VSSM", "vssm", None, &[&[3.8, 4.0, 4.3], &[5.8, 6.2, 6.6]]),
                method("MSSM", "mssm", None, &[&[3.2, 3.6, 4.0], &[5.3, 5.7, 6.0]]),
                method("EDTSSM", "edtssm", None, &[&[2.3, 4.5, 5.9], &[4.5, 6.8, 8.4]]),
            ],
        },
    ],
    judged: &[],
    claims: &[Claim {
        source: "section IV.C",
        text: "prefiltered techniques do not scale with the map, EDTSSM does",
        judge: claims::prefiltering_grows,
    }],
};

pub static EDSM: Paper = Paper {
    suite: "paper-003",
    about: "the comparison of the thesis on EDSM (2013), as published and by our defaults, with its claims",
    citation: "Kenzel, \"Edge Distance Shadow Mapping\" (2013), chapter 5. Its times are charts without figures; the suite \
               `edges` has errors over scenes and maps.",
    tables: &[Table {
        name: "figure 5.2",
        scenes: &[("jenga", "jenga"), ("courtyard", "phaeno")],
        axis: Axis::Map,
        at: &[1024, 2048],
        map: 0,
        hard: true,
        sm: &[],
        methods: &[
            method("SSSM", "sssm", None, &[]),
            method("EDSM", "edsm", None, &[]),
            method("PCF", "pcf:width=3", None, &[]),
            method("Shadow volumes", "shadow-volumes", None, &[]),
        ],
    }],
    judged: &[Judged {
        name: "figures 5.5 to 5.8",
        scenes: &[("jenga", "jenga"), ("fence", "fine structures"), ("ripples", "curved surfaces")],
        maps: &[512, 1024],
        soft: false,
        methods: &[
            method("SSM", "sm", None, &[]),
            method("PCF", "pcf:width=3", None, &[]),
            method("SSSM", "sssm", None, &[]),
            method("EDSM", "edsm", None, &[]),
        ],
        rmse: &[],
    }],
    claims: &[
        Claim {
            source: "figure 5.2",
            text: "shadow volumes are by far the slowest",
            judge: claims::volumes_are_slowest,
        },
        Claim {
            source: "section 5.2",
            text: "EDSM errs less than shadow mapping and PCF",
            judge: claims::edsm_errs_least,
        },
    ],
};
