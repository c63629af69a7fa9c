//! Suite `edges`: hard shadows that know the casters' edges, next to those from a map alone, against the truth.

use super::accuracy::{HEADER, LEGEND, Mean, Plan, Row, chart, mean_line, means, one_scene, row_line};
use super::judge::{Wanted, available, left_out_note, possible, save};
use super::{Args, SIZE, shown};
use crate::cli::report::Origin;
use crate::cli::techniques::Choice;
use edgeshade::Result;
use edgeshade::host::Host;
use edgeshade::picture::write_atomic;
use edgeshade::scene::Masked;
use edgeshade::scene::shipped::{self, Shipped};
use serde::Serialize;

/// Sides of the shadow maps, texels.
const MAPS: [u32; 5] = [256, 512, 1024, 2048, 4096];
/// The one scene and the size of the image of a quick run.
const QUICK: (&str, [u32; 2]) = ("jenga", [320, 180]);

/// As far as the registry has them.
const CONTENDERS: [Wanted; 9] = [
    ("sm", &[]),
    ("rbsm-star", &[]),
    ("rbsm-profile", &[]),
    ("edsm", &[]),
    ("sssm", &[]),
    ("edsm-x", &[]),
    ("edsm-x", &[("slots", "1")]),
    ("edsm-x", &[("slots", "4")]),
    ("shadow-volumes", &[]),
];

/// What passes count of the map of edges.
const COUNTS: [&str; 3] = ["edges", "edges_spilled", "edges_lost"];

/// True where no shadow map is looked at.
pub fn has_no_map(choice: &Choice) -> bool {
    choice.info.id == "shadow-volumes"
}

/// What the suite writes.
#[derive(Serialize)]
struct Figures {
    suite: &'static str,
    #[serde(flatten)]
    origin: Origin,
    size: [u32; 2],
    /// What registry or device do not have.
    left_out: Vec<String>,
    results: Vec<Row>,
    /// Over the scenes.
    means: Vec<Mean>,
}

/// Pixels of all frames, for the estimate of the time.
pub fn pixels(args: &Args) -> Result<u64> {
    let (scenes, maps) = if args.quick { (1, 2) } else { (shipped::ALL.len(), MAPS.len()) };
    let size = args.size.unwrap_or(if args.quick { QUICK.1 } else { SIZE });
    Ok(super::pixels(size, scenes * maps * CONTENDERS.len(), 1))
}

pub fn run(args: &Args, host: &Host) -> Result<()> {
    let scenes: Vec<&Shipped> = shipped::ALL.iter().filter(|s| !args.quick || s.name == QUICK.0).collect();
    let (choices, mut left_out) = available(&CONTENDERS);
    let (choices, impossible) = possible(choices, host.context().features());
    left_out.extend(impossible);
    let plan = Plan {
        suite: "edges",
        masked: Masked::Exclude,
        maps: if args.quick { &MAPS[..2] } else { &MAPS },
        size: args.size.unwrap_or(if args.quick { QUICK.1 } else { SIZE }),
        choices: &choices,
        has_no_map,
    };
    let mut results = vec![];
    for scene in scenes {
        results.extend(one_scene(host, scene, &plan)?);
    }
    let means = means(&results, &plan);
    let figures = Figures { suite: plan.suite, origin: Origin::new(host), size: plan.size, left_out, results, means };
    let path = save(args, host, figures.suite, &figures, &page(&figures))?.with_extension("svg");
    write_atomic(&path, chart(&figures.means, &plan)?.as_bytes())?;
    args.say(format_args!("wrote {}", shown(&path)))
}

fn page(figures: &Figures) -> String {
    let [w, h] = figures.size;
    let Origin { device, driver, version, .. } = &figures.origin;
    let mut text = format!(
        "# Suite `edges`\n\n{device}, {driver}; Edgeshade {version}; {w}x{h}, lights without size, alpha-masked surfaces \
         left out, against the ray-traced truth.\n\n\
         {LEGEND} `edges`: silhouette edges in the scene; `spilled`: entries in the chains of cells that have more edges \
         than slots; `lost`: entries that found no place there either. `shadow-volumes` has no map and is judged once a \
         scene.\n\n{}## Mean over the scenes\n\n{HEADER}",
        left_out_note(&figures.left_out)
    );
    figures.means.iter().for_each(|m| text += &mean_line(m));
    let wider = HEADER.replacen("|\n", "| edges | spilled | lost |\n", 1).replacen("--:|\n", "--:|--:|--:|--:|\n", 1);
    for scene in figures.results.chunk_by(|a, b| a.scene == b.scene) {
        text += &format!("\n## {}\n\n{wider}", scene[0].scene);
        for row in scene {
            let counts = COUNTS.map(|name| row.counts.get(name).map_or_else(|| "-".to_owned(), u64::to_string));
            text += &row_line(row, &counts);
        }
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::cli::bench::judge::label;
    use crate::cli::report;
    use edgeshade::metrics;
    use std::collections::BTreeMap;

    /// Two lit pixels and two dark ones, of which `wrong` are taken for the other.
    fn row(scene: &'static str, shadow_map: Option<u32>, choice: &Choice, wrong: usize) -> Row {
        let truth = [1.0, 1.0, 0.0, 0.0];
        let test: Vec<f32> = truth.iter().enumerate().map(|(i, v)| if i < wrong { 1.0 - v } else { *v }).collect();
        let counts: &[(&'static str, u64)] =
            if choice.info.id == "edsm-x" { &[("edges", 70), ("edges_lost", 3)] } else { &[] };
        Row {
            scene,
            shadow_map,
            technique: choice.info.id,
            params: report::params(choice.info, &choice.params),
            label: label(choice),
            report: metrics::compare(&test, &truth, &[true; 4], [2, 2]).unwrap(),
            counts: counts.iter().copied().collect::<BTreeMap<_, _>>(),
        }
    }

    fn figures() -> (Figures, Vec<Choice>) {
        let (choices, left_out) = available(&[("sm", &[]), ("edsm-x", &[("slots", "1")]), ("shadow-volumes", &[])]);
        assert!(left_out.is_empty(), "{left_out:?}");
        let [sm, x, volumes] = &choices[..] else { panic!("three") };
        let mut results = vec![];
        for (scene, more) in [("a", 0), ("b", 1)] {
            results.push(row(scene, Some(256), sm, 2 + more));
            results.push(row(scene, Some(256), x, 1));
            results.push(row(scene, None, volumes, more));
            results.push(row(scene, Some(512), sm, 1 + more));
            results.push(row(scene, Some(512), x, more));
        }
        let means = means(&results, &plan(&choices));
        let origin = Origin::default();
        (Figures { suite: "edges", origin, size: [2, 2], left_out: vec!["none".into()], results, means }, choices)
    }

    fn plan(choices: &[Choice]) -> Plan<'_> {
        Plan { suite: "edges", masked: Masked::Exclude, maps: &[256, 512], size: [2, 2], choices, has_no_map }
    }

    #[test]
    fn means_are_of_their_own_map_and_volumes_have_none() {
        let (figures, _) = figures();
        let found: Vec<_> = figures.means.iter().map(|m| (&m.label[..], m.shadow_map, m.scenes, m.mismatch)).collect();
        let expected = [
            ("shadow-volumes", None, 2, Some(0.125)),
            ("sm", Some(256), 2, Some(0.625)),
            ("edsm-x slots=1", Some(256), 2, Some(0.25)),
            ("sm", Some(512), 2, Some(0.375)),
            ("edsm-x slots=1", Some(512), 2, Some(0.125)),
        ];
        assert_eq!(found, expected);
    }

    #[test]
    fn the_page_has_every_row_with_its_edges_and_names_what_is_left_out() {
        let (figures, _) = figures();
        let text = page(&figures);
        assert!(text.contains("Left out, as this version has none: none."), "{text}");
        let scene_b = text.split_once("\n## b\n").unwrap().1;
        let lines: Vec<_> = scene_b.lines().filter(|l| l.starts_with('|')).collect();
        assert_eq!(lines.len(), 2 + 5, "{scene_b}");
        for line in &lines {
            assert_eq!(line.matches('|').count(), 12, "{line}");
        }
        assert!(lines[2].starts_with("| sm | 256 | 75.000 | ") && lines[2].ends_with("| - | - | - |"), "{}", lines[2]);
        assert!(
            lines[3].starts_with("| edsm-x slots=1 | 256 |") && lines[3].ends_with("| 70 | - | 3 |"),
            "{}",
            lines[3]
        );
        assert!(lines[4].starts_with("| shadow-volumes | - | 25.000 | "), "{}", lines[4]);
    }

    #[test]
    fn the_plot_has_a_point_for_every_map_and_a_level_line_without() {
        let (figures, choices) = figures();
        let svg = chart(&figures.means, &plan(&choices)).unwrap();
        assert_eq!(svg.matches("<circle").count(), 3 * 2);
        assert!(svg.contains("shadow-volumes"));
    }

    #[test]
    fn every_contender_is_there_once() {
        let (choices, left_out) = available(&CONTENDERS);
        assert!(left_out.is_empty(), "{left_out:?}");
        let labels: Vec<_> = choices.iter().map(label).collect();
        assert!(labels.iter().enumerate().all(|(i, l)| !labels[..i].contains(l)), "{labels:?}");
        assert_eq!(choices.iter().filter(|c| has_no_map(c)).count(), 1);
    }
}
