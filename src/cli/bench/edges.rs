//! Suite `edges`: hard shadows that use silhouette edges of the casters, compared with those that use a map alone,
//! against the truth.

use super::driver::*;
use super::hard;
use super::judge::mapless;
use edgeshade::scene::Masked;

pub static SUITE: Suite = Suite {
    name: "edges",
    about: "error of hard shadows from silhouette edges over scenes and map sizes, with a plot",
    extent: |quick| hard::extent(quick, &[256, 512, 1024, 2048, 4096]),
    variants: |device| Ok(mapless(possible(available(CONTENDERS), device))),
    resumes: true,
    measure: |host, run, scene| hard::measure(host, run, scene, Masked::Exclude),
    settings: |plan| Record::of([("left_out", plan.left_out.clone().into())]),
    page: |r| hard::page(r, ABOUT, NOTE, &COUNTS),
    ..hard::BASE
};

/// Techniques to compare, if the registry has them.
const CONTENDERS: &str =
    "sm rbsm-star rbsm-profile edsm sssm edsm-x edsm-x:slots=1 edsm-x:slots=4 shadow-volumes exact-hard";

const ABOUT: &str = "lights without size, alpha-masked surfaces left out, against the ray-traced truth.";

const NOTE: &str = " `edges`: silhouette edges in the scene; `spilled`: entries in the chains of cells with more edges than \
                    slots; `lost`: entries that found no place there either. `shadow-volumes` and `exact-hard` use no map and are \
                    judged once per scene.";

/// Counts of the map of edges.
const COUNTS: [Column; 3] =
    [("edges", "counts.edges", 0), ("spilled", "counts.edges_spilled", 0), ("lost", "counts.edges_lost", 0)];

#[cfg(test)]
mod tests {
    use super::super::plot;
    use super::*;
    use crate::cli::report::Origin;
    use edgeshade::metrics;

    /// Two lit pixels and two dark ones, of which `wrong` are taken for the other.
    fn row(scene: &'static str, map: Option<u32>, variant: &Variant, wrong: usize) -> Row {
        let truth = [1.0, 1.0, 0.0, 0.0];
        let test: Vec<f32> = truth.iter().enumerate().map(|(i, v)| if i < wrong { 1.0 - v } else { *v }).collect();
        let counts = [("edges", 70), ("edges_lost", 3)].into_iter().filter(|_| variant.choice.info.id == "edsm-x");
        let report = metrics::compare(&test, &truth, &[true; 4], [2, 2]).unwrap();
        hard::row(scene, map, variant, &report, counts.collect())
    }

    fn plan() -> Plan {
        let Variants { found, left_out } = mapless(available("sm edsm-x:slots=1 shadow-volumes"));
        assert!(left_out.is_empty(), "{left_out:?}");
        let plan = SUITE.plan(false, 1, Some([2, 2]), DeviceFeatures::default()).unwrap();
        Plan { maps: &[256, 512], variants: found, left_out: vec!["none".into()], ..plan }
    }

    fn results(plan: &Plan) -> Results<'_> {
        let [sm, x, volumes] = &plan.variants[..] else { panic!("three") };
        let mut rows = vec![];
        for (scene, more) in [("a", 0), ("b", 1)] {
            rows.push(row(scene, Some(256), sm, 2 + more));
            rows.push(row(scene, Some(256), x, 1));
            rows.push(row(scene, None, volumes, more));
            rows.push(row(scene, Some(512), sm, 1 + more));
            rows.push(row(scene, Some(512), x, more));
        }
        SUITE.results(plan, Origin::default(), rows)
    }

    #[test]
    fn means_are_of_their_own_map_and_volumes_have_none() {
        let plan = plan();
        let results = results(&plan);
        let found: Vec<_> = (results.list("means").iter())
            .map(|m| (&m.label[..], m.number("shadow_map"), m.number("scenes"), m.number("mismatch")))
            .collect();
        let expected = [
            ("shadow-volumes", None, Some(2.0), Some(0.125)),
            ("sm", Some(256.0), Some(2.0), Some(0.625)),
            ("edsm-x slots=1", Some(256.0), Some(2.0), Some(0.25)),
            ("sm", Some(512.0), Some(2.0), Some(0.375)),
            ("edsm-x slots=1", Some(512.0), Some(2.0), Some(0.125)),
        ];
        assert_eq!(found, expected);
    }

    #[test]
    fn the_page_has_every_row_with_its_edges_and_names_what_is_left_out() {
        let plan = plan();
        let text = (SUITE.page)(&results(&plan));
        assert!(text.contains("Left out because they are not supported: none."), "{text}");
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
        let plan = plan();
        let svg = plot::svg(&SUITE.chart.unwrap()(&results(&plan))).unwrap();
        assert_eq!(svg.matches("<circle").count(), 3 * 2);
        assert!(svg.contains("shadow-volumes"));
    }

    #[test]
    fn every_contender_is_there_once() {
        let Variants { found, left_out } = mapless(available(CONTENDERS));
        assert!(left_out.is_empty(), "{left_out:?}");
        let labels: Vec<_> = found.iter().map(|v| &v.label).collect();
        assert!(labels.iter().enumerate().all(|(i, l)| !labels[..i].contains(l)), "{labels:?}");
        assert_eq!(found.iter().filter(|v| v.has_no_map).count(), 2);
    }
}
