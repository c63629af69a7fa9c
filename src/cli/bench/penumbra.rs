//! Suite `penumbra`: soft edges of a fixed width against the truth of the same width, for several scenes and map
//! sizes.

use super::driver::*;
use super::errors::{self, COLUMNS, LEGEND, lowest};
use super::judge::{mask, renderer, tracer, visibility};
use super::texel;
use crate::cli::techniques::Choice;
use edgeshade::metrics::{self, Report};

pub static SUITE: Suite = Suite {
    name: "penumbra",
    about: "error against penumbrae of the same width over scenes and map sizes, with a plot",
    extent: |quick| match quick {
        true => Extent { scenes: vec!["jenga", "robot"], maps: &[1024], size: [192, 108] },
        false => Extent { scenes: every_scene(), maps: &[512, 1024, 2048], size: [640, 360] },
    },
    variants: |_| {
        let found = GROUPS.into_iter().map(|(_, group)| contenders(group, None)).collect::<Result<Vec<_>>>()?;
        Ok(Variants { found: found.concat(), left_out: vec![] })
    },
    measure,
    summary,
    page,
    chart: Some(chart),
    ..Suite::BASE
};

/// Variant that should have the lowest error of its group.
const SUBJECT: &str = "edtsm-star";

/// Widths of the penumbra in texels of the current map, with contenders whose kernels have these widths.
const GROUPS: [(u32, &str); 2] = [
    (15, "pcf:width=15 edtsm edtsm-star edtsm-star:preset=published"),
    (7, "pcf:width=7 rpcf:width=7 edtsm edtsm-star"),
];

/// Parameter for the width in world units.
const PENUMBRA: &str = "penumbra";

/// Contenders of a group, labelled with their ids. Those that have the parameter get the given width of the penumbra.
fn contenders(group: &str, penumbra: Option<f64>) -> Result<Vec<Variant>> {
    let one = |Variant { mut choice, .. }: Variant| {
        let id = choice.info.id;
        let is_of_paper = choice.params.is_published();
        let has_penumbra = choice.info.params.iter().any(|p| p.name == PENUMBRA);
        if let Some(width) = penumbra.filter(|_| has_penumbra) {
            choice.params.set(id, PENUMBRA, &width.to_string())?;
        }
        let label = if is_of_paper { format!("{id} as in the paper") } else { id.to_owned() };
        Ok(Variant { label, ..Variant::new(choice) })
    };
    available(group).found.into_iter().map(one).collect()
}

fn measure(host: &Host, run: &mut Run<'_>, scene: &'static str) -> Result<()> {
    let Plan { size, maps, .. } = *run.plan;
    run.start(scene);
    let stage = run.plan.stage(scene)?;
    let mut whole_map = None;
    for &map in maps {
        let mut renderer = renderer(host, &stage, size, map)?;
        let light = *renderer.light();
        let mut tracer = tracer(&stage, &light, size).quiet();
        let hard = tracer.hard()?;
        let mask = mask(host, &mut renderer, &hard)?;
        let texel = match whole_map {
            Some(width) => width,
            None => *whole_map.insert(
                texel::median_width(&hard, &mask, &stage.camera, &light)
                    .ok_or_else(|| Error::Usage(format!("{scene}: nothing to judge at {size:?} pixels")))?,
            ),
        } / f64::from(map);
        for (texels, group) in GROUPS {
            let penumbra = to_4_digits(f64::from(texels) * texel);
            let settings = [(PENUMBRA.to_owned(), penumbra.to_string())];
            let (truth, _) = tracer.fixed_penumbra(&Choice::new("fixed-penumbra", &settings)?)?;
            for variant in contenders(group, Some(penumbra))? {
                let test = visibility(&mut renderer, &variant.choice)?;
                let report = metrics::compare(&test, &truth.visibility, &mask, size);
                let place = || format!("{scene}, map {map}, {}", Variant::new(variant.choice.clone()).label);
                let report = report.map_err(|e| Error::Usage(format!("{}: {e}", place())))?;
                let view = format!("{scene}, penumbrae {texels} texels wide");
                run.picture(&view, map, &variant, [&test, &truth.visibility], &mask)?;
                run.push(row(scene, map, texels, penumbra, &variant, report), 1);
            }
        }
    }
    Ok(())
}

fn row(scene: &str, map: u32, texels: u32, penumbra: f64, variant: &Variant, report: Report) -> Row {
    let place = [
        ("scene", scene.into()),
        ("shadow_map", map.into()),
        // Width of the penumbra in texels and in world units.
        ("texels", texels.into()),
        ("penumbra", penumbra.into()),
        ("variant", variant.label.as_str().into()),
    ];
    let row = Row::of(place, variant, &format!("{scene} {map} {texels}"), errors::figures(&report));
    row.and_shown([("penumbra", penumbra.to_string().into())])
}

/// Rounds a width to four digits, so that the printed value reproduces it.
fn to_4_digits(width: f64) -> f64 {
    format!("{width:.3e}").parse().unwrap_or(width)
}

/// Means over the scenes, and the groups in which the subject does not have the lowest error.
fn summary(_: &Plan, rows: &[Row]) -> Record {
    let cells = by_scene(rows).next().unwrap_or_default();
    let keys = cells.iter().map(|r| Row::new(&r.label, "", r.fields.only(&["shadow_map", "texels", "variant"])));
    let is_lowest = |r: &Row| groups(rows).filter_map(lowest).any(|lowest| std::ptr::eq(lowest, r));
    let means = means(rows, keys.collect(), &COLUMNS, |mine| {
        let lowest = mine.iter().filter(|r| is_lowest(r)).count();
        Record::of([("scenes", mine.len().into()), ("lowest", lowest.into())])
    });
    let beaten = groups(rows).filter_map(|group| {
        let best = lowest(group)?;
        let mine = group.iter().find(|r| r.label == SUBJECT)?;
        let [rmse, by_rmse] = [mine, best].map(|r| r.number("rmse"));
        let beaten = [("rmse", rmse.into()), ("by", best.label.as_str().into()), ("by_rmse", by_rmse.into())];
        let place = mine.fields.only(&["scene", "shadow_map", "texels"]);
        (rmse > by_rmse).then(|| Row::new("", "", place.and(beaten)))
    });
    Record::of([("means", Field::Rows(means)), ("beaten", Field::Rows(beaten.collect()))])
}

/// Tables of means over the scenes, then tables of every scene.
fn page(results: &Results<'_>) -> String {
    let mut text = results.head("against ray-traced penumbrae of a fixed width.")
        + "All penumbrae of a group should be equally wide: 15 or 7 texels of the map. Kernels have this width in texels. The truth \
           and the techniques that take a width in world units get P: 15 or 7 times the width of a texel on the surfaces that the \
           camera sees, which is the square root of the area that a texel covers there, as the median over the judged pixels. \
           Where a texel is larger or smaller than this, kernels are wider or narrower than the truth, which counts as their \
           error.\n\n"
        + LEGEND
        + ".\n\n";
    text += &beaten(results);
    let of_all = |m: &Row| format!("{} of {}", number(m.number("lowest"), 0), number(m.number("scenes"), 0));
    let means = results.list("means").iter().map(|m| m.clone().and_shown([("lowest_of", of_all(m).into())]));
    let mut means: Vec<_> = means.collect();
    // The widest penumbra comes first, as in the list of groups.
    means.sort_by_key(|m| GROUPS.iter().position(|g| m.number("texels") == Some(g.0.into())));
    let lead =
        [("texels", "texels", 0), ("map", "shadow_map", 0), ("<variant", "label", 0), ("lowest in", "lowest_of", 0)];
    text += &format!("\n## Mean over the scenes\n\n{}", table(&[&lead[..], &COLUMNS].concat(), &means));
    let lead = [("map", "shadow_map", 0), ("texels", "texels", 0), ("P", "penumbra", 0), ("<variant", "label", 0)];
    text + &tables_by_scene(&[&lead[..], &COLUMNS].concat(), &results.rows)
}

/// Sentence that says in which groups the subject does not have the lowest error.
fn beaten(results: &Results<'_>) -> String {
    let total = results.rows.iter().filter(|r| r.label == SUBJECT).count();
    let list = results.list("beaten").iter().map(|b| {
        let [map, texels] = ["shadow_map", "texels"].map(|name| number(b.number(name), 0));
        let [mine, other] = ["rmse", "by_rmse"].map(|name| number(b.number(name), 4));
        format!("{} {map}, {texels} texels ({mine}; {} {other})", b.text("scene"), b.text("by"))
    });
    let list: Vec<_> = list.collect();
    match list.len() {
        0 => format!("`{SUBJECT}` has the lowest RMSE of its group in all {total} cells.\n"),
        n => format!("`{SUBJECT}` is not the lowest of its group in {n} of {total} cells: {}.\n", list.join(", ")),
    }
}

/// Mean RMSE over the size of the map, one line for each variant and group.
fn chart(results: &Results<'_>) -> Chart {
    let means = results.list("means");
    let is_first = |m: &&Row| m.number("shadow_map") == means[0].number("shadow_map");
    let line = |first: &Row| {
        let mine = means.iter().filter(|m| m.label == first.label && m.number("texels") == first.number("texels"));
        let points = mine.filter_map(|m| Some((m.number("shadow_map")?, m.number("rmse")?))).collect();
        Line { name: format!("{} texels: {}", number(first.number("texels"), 0), first.label), points }
    };
    Chart {
        title: "Error against penumbrae of the same width, mean over the scenes".into(),
        axes: ["shadow map, texels a side", "RMSE"],
        lines: means.iter().filter(is_first).map(line).collect(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::cli::report::Origin;

    /// Rows of one scene with one map, all of the first group, with these errors.
    fn cell(scene: &'static str, shadow_map: u32, errors: &[f32]) -> Vec<Row> {
        let row = |(variant, &e): (&Variant, &f32)| {
            let report = metrics::compare(&[1.0 - e; 4], &[1.0; 4], &[true; 4], [2, 2]).unwrap();
            row(scene, shadow_map, GROUPS[0].0, 1.0, variant, report)
        };
        contenders(GROUPS[0].1, None).unwrap().iter().zip(errors).map(row).collect()
    }

    #[test]
    fn means_and_beaten_cells_are_of_their_own_map() {
        let mut rows = cell("a", 512, &[0.5, 0.5, 0.25, 0.5]);
        rows.extend(cell("a", 1024, &[0.125, 0.5, 0.25, 0.5]));
        rows.extend(cell("b", 512, &[0.5, 0.5, 0.75, 0.25]));
        rows.extend(cell("b", 1024, &[0.5, 0.5, 0.25, 0.25]));
        let plan = SUITE.plan(false, 1, None, DeviceFeatures::default()).unwrap();
        let results = SUITE.results(&plan, Origin::default(), rows);
        let of = |map: u32, name, figure| {
            let place = |m: &Row| (m.number("shadow_map"), m.number("texels"));
            let mut means = results.list("means").iter().filter(|m| place(m) == (Some(map.into()), Some(15.0)));
            means.find(|m| m.label == name).unwrap().number(figure)
        };
        assert_eq!(["rmse", "scenes", "lowest"].map(|f| of(512, SUBJECT, f)), [Some(0.5), Some(2.0), Some(1.0)]);
        assert_eq!(["rmse", "lowest"].map(|f| of(1024, SUBJECT, f)), [Some(0.25), Some(1.0)]);
        assert_eq!(["over", "under"].map(|f| of(1024, "pcf", f)), [Some(0.3125), Some(0.0)]);
        let beaten = (SUITE.page)(&results);
        // A tie is no defeat.
        let expected = "in 2 of 4 cells: a 1024, 15 texels (0.2500; pcf 0.1250), \
                        b 512, 15 texels (0.7500; edtsm-star as in the paper 0.2500).\n";
        assert!(beaten.contains(expected), "{beaten}");
    }

    #[test]
    fn every_group_has_the_subject_and_its_settings_are_known() {
        for (texels, group) in GROUPS {
            let variants = contenders(group, None).unwrap();
            assert_eq!(variants.len(), group.split(' ').count());
            assert_eq!(variants.iter().filter(|v| v.label == SUBJECT).count(), 1);
            for (v, text) in variants.iter().zip(group.split(' ')) {
                assert!(!text.contains(":width") || v.choice.params.int("width") == texels, "{text}");
                let is_plain = !text.contains(':') || v.choice.info.id == "rpcf";
                assert_eq!(v.choice.settings() == "-", is_plain, "{text}");
                assert_eq!(v.label.ends_with(" as in the paper"), text.contains("preset=published"), "{text}");
            }
        }
        assert_eq!((to_4_digits(0.012_345_6), to_4_digits(123_456.0)), (0.012_35, 123_500.0));
    }
}
