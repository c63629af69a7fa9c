//! Suite `penumbra`: soft edges of a fixed width against the truth of the same width, over scenes and map sizes.

mod texel;

use super::driver::*;
use super::judge::{mask, renderer, tracer, visibility};
use crate::cli::techniques::Choice;
use edgeshade::metrics::{self, Report};
use edgeshade::technique;

pub static SUITE: Suite<Report> = Suite {
    name: "penumbra",
    about: "error against penumbrae of the same width over scenes and map sizes, with a plot",
    extent: |quick| match quick {
        true => Extent { scenes: vec!["jenga", "robot"], maps: &[1024], size: [192, 108] },
        false => Extent { scenes: every_scene(), maps: &[512, 1024, 2048], size: [640, 360] },
    },
    variants: |_| {
        Ok(Variants { found: contenders().map(|(_, c)| c.variant(None)).collect::<Result<_>>()?, left_out: vec![] })
    },
    measure,
    summary,
    page,
    chart: Some(chart),
    ..Suite::BASE
};

/// What is to be the lowest of its group.
const SUBJECT: &str = "edtsm-star";

/// Contenders at one width of the penumbra.
struct Group {
    /// Width of the penumbra in texels of the map at hand, and of the kernels.
    texels: u32,
    contenders: &'static [Contender],
}

/// A technique; those that have a parameter `penumbra` are given the group's width on top.
struct Contender {
    name: &'static str,
    id: &'static str,
    settings: &'static [(&'static str, &'static str)],
}

/// Parameter that takes the width.
const PENUMBRA: &str = "penumbra";

/// EDTSM* as its paper has it.
const PAPER: &[(&str, &str)] =
    &[("nearest", "pixel"), ("surfaces", "depth"), ("seeds", "any"), ("edge", "pixel"), ("receiver", "fixed")];

const GROUPS: [Group; 2] = [
    Group {
        texels: 15,
        contenders: &[
            Contender { name: "pcf", id: "pcf", settings: &[("width", "15")] },
            Contender { name: "edtsm", id: "edtsm", settings: &[] },
            Contender { name: SUBJECT, id: "edtsm-star", settings: &[] },
            Contender { name: "edtsm-star as in the paper", id: "edtsm-star", settings: PAPER },
        ],
    },
    Group {
        texels: 7,
        contenders: &[
            Contender { name: "pcf", id: "pcf", settings: &[("width", "7")] },
            Contender { name: "rpcf", id: "rpcf", settings: &[("width", "7")] },
            Contender { name: "edtsm", id: "edtsm", settings: &[] },
            Contender { name: SUBJECT, id: "edtsm-star", settings: &[] },
        ],
    },
];

/// What tables and means show.
const COLUMNS: [Column<Report>; 5] = [
    Column::new("rmse", "RMSE", 4, |r| Some(r.rmse)),
    Column::new("penumbra_rmse", "in the band", 4, |r| r.penumbra_rmse),
    Column::new("mae", "MAE", 4, |r| Some(r.mae)),
    Column::new("over", "over", 4, |r| Some(r.over)),
    Column::new("under", "under", 4, |r| Some(r.under)),
];

/// Every contender with the width of its group.
fn contenders() -> impl Iterator<Item = (u32, &'static Contender)> {
    GROUPS.iter().flat_map(|g| g.contenders.iter().map(|c| (g.texels, c)))
}

impl Contender {
    /// It under its name, where it has such a parameter with that width of the penumbra.
    fn variant(&self, penumbra: Option<f64>) -> Result<Variant> {
        let has_penumbra = technique::find(self.id)?.params.iter().any(|p| p.name == PENUMBRA);
        let settings = self.settings.iter().map(|&(n, v)| (n.to_owned(), v.to_owned()));
        let penumbra = penumbra.filter(|_| has_penumbra).map(|p| (PENUMBRA.to_owned(), p.to_string()));
        let choice = Choice::new(self.id, &settings.chain(penumbra).collect::<Vec<_>>())?;
        Ok(Variant { label: self.name.into(), ..Variant::new(choice) })
    }
}

fn measure(host: &Host, run: &mut Run<'_, Report>, scene: &'static str) -> Result<()> {
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
        for Group { texels, contenders } in &GROUPS {
            let penumbra = to_4_digits(f64::from(*texels) * texel);
            let settings = [(PENUMBRA.to_owned(), penumbra.to_string())];
            let (truth, _) = tracer.fixed_penumbra(&Choice::new("fixed-penumbra", &settings)?)?;
            for contender in *contenders {
                let variant = contender.variant(Some(penumbra))?;
                let test = visibility(&mut renderer, &variant.choice)?;
                let report = metrics::compare(&test, &truth.visibility, &mask, size);
                let place = || format!("{scene}, map {map}, {}", Variant::new(variant.choice.clone()).label);
                let report = report.map_err(|e| Error::Usage(format!("{}: {e}", place())))?;
                run.push(row(scene, map, *texels, penumbra, &variant, report));
                run.drawn(1);
            }
        }
    }
    Ok(())
}

fn row(scene: &str, map: u32, texels: u32, penumbra: f64, variant: &Variant, report: Report) -> Row<Report> {
    let place = [
        ("scene", scene.into()),
        ("shadow_map", map.into()),
        // Width of the penumbra, and the same in world units.
        ("texels", texels.into()),
        ("penumbra", penumbra.into()),
        ("variant", variant.label.as_str().into()),
    ];
    Row::new(place, variant, &format!("{scene} {map} {texels}"), report)
}

/// So that a width can be repeated as it is printed.
fn to_4_digits(width: f64) -> f64 {
    format!("{width:.3e}").parse().unwrap_or(width)
}

/// The lowest error of a group, and whose.
fn lowest(group: &[Row<Report>]) -> Option<&Row<Report>> {
    group.iter().min_by(|a, b| a.figures.rmse.total_cmp(&b.figures.rmse))
}

/// Means over the scenes, and every group in which the subject is not the lowest.
fn summary(plan: &Plan, rows: &[Row<Report>]) -> Summary {
    let lowest_rows: Vec<_> = groups(rows).filter_map(lowest).collect();
    let key = |map: u32, (texels, c): (u32, &Contender)| {
        let place = [("shadow_map", map.into()), ("texels", texels.into()), ("variant", c.name.into())];
        (c.name.to_owned(), Record::of(place))
    };
    let keys = plan.maps.iter().flat_map(|&map| contenders().map(move |c| key(map, c)));
    let means = means(rows, keys, &COLUMNS, |mine| {
        let lowest = mine.iter().filter(|r| lowest_rows.iter().any(|l| std::ptr::eq(*l, **r))).count();
        Record::of([("scenes", mine.len().into()), ("lowest", lowest.into())])
    });
    let beaten = groups(rows).filter_map(|group| {
        let best = lowest(group)?;
        let mine = group.iter().find(|r| r.label == SUBJECT)?;
        let mut figures = mine.place.only(&["scene", "shadow_map", "texels"]);
        let by = best.label.as_str().into();
        figures.0.extend([("rmse", mine.figures.rmse.into()), ("by", by), ("by_rmse", best.figures.rmse.into())]);
        (mine.figures.rmse > best.figures.rmse).then(|| figures.into())
    });
    Fields(vec![("means", means), ("beaten", beaten.collect())])
}

/// Everything in tables.
fn page(results: &Results<'_, Report>) -> String {
    let mut text = results.head("against ray-traced penumbrae of a fixed width.")
        + "All of a group are meant to be equally wide: 15 or 7 texels of the map at hand. Kernels are that wide in texels; the \
           truth and the techniques that know widths in the world are given P, world units: so many times the width of a texel \
           on what the camera sees, which is the square root of the area that a texel covers on the surface, the median over \
           the judged pixels. Where a texel is larger or smaller than there, kernels are wider or narrower than the truth, and \
           that is an error of theirs.\n\n\
           `RMSE`, `MAE`: over the judged pixels; `in the band`: RMSE within 8 px of the true penumbra; `over`, `under`: too \
           dark, too light, mean over the judged pixels.\n\n";
    text += &beaten(results);
    let mut means: Vec<_> = results.list("means").iter().collect();
    // The widest first, as in the list of groups.
    means.sort_by_key(|m| GROUPS.iter().position(|g| m.place.number("texels") == Some(g.texels.into())));
    let cells = |m: &Row<Record>| {
        let lowest = format!("{} of {}", m.figures.text("lowest"), m.figures.text("scenes"));
        [m.place.text("texels"), m.place.text("shadow_map"), m.label.clone(), lowest]
    };
    let lead = "texels | map | <variant | lowest in";
    text += &format!("\n## Mean over the scenes\n\n{}", table_of((lead, cells), (&COLUMNS, Column::of_mean), means));
    let cells = |r: &Row<Report>| ["shadow_map", "texels", "penumbra", "variant"].map(|name| r.place.text(name));
    for (scene, rows) in by_scene(&results.rows) {
        let lead = "map | texels | P | <variant";
        text += &format!("\n## {scene}\n\n{}", table_of((lead, cells), (&COLUMNS, Column::of_row), rows));
    }
    text
}

/// Says where the subject is not the lowest.
fn beaten(results: &Results<'_, Report>) -> String {
    let total = results.rows.iter().filter(|r| r.label == SUBJECT).count();
    let list = results.list("beaten").iter().map(|b| {
        let [scene, map, texels, by] = ["scene", "shadow_map", "texels", "by"].map(|name| b.figures.text(name));
        let [mine, other] = ["rmse", "by_rmse"].map(|name| number(b.figures.number(name), 4));
        format!("{scene} {map}, {texels} texels ({mine}; {by} {other})")
    });
    let list: Vec<_> = list.collect();
    match list.len() {
        0 => format!("`{SUBJECT}` has the lowest RMSE of its group in all {total} cells.\n"),
        n => format!("`{SUBJECT}` is not the lowest of its group in {n} of {total} cells: {}.\n", list.join(", ")),
    }
}

/// Mean RMSE over the map's size, a line a variant and group.
fn chart(results: &Results<'_, Report>) -> Chart {
    let line = |(texels, c): (u32, &Contender)| {
        let is_mine = |m: &&Row<Record>| m.label == c.name && m.place.number("texels") == Some(texels.into());
        let mine = results.list("means").iter().filter(is_mine);
        let points = mine.filter_map(|m| Some((m.place.number("shadow_map")?, m.figures.number("rmse")?))).collect();
        Line { name: format!("{texels} texels: {}", c.name), points }
    };
    Chart {
        title: "Error against penumbrae of the same width, mean over the scenes".into(),
        axes: ["shadow map, texels a side", "RMSE"],
        lines: contenders().map(line).collect(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::cli::report::Origin;

    /// Rows of one scene with one map, all of the first group, with these errors.
    fn cell(scene: &'static str, shadow_map: u32, errors: &[f32]) -> Vec<Row<Report>> {
        let row = |(c, &e): (&Contender, &f32)| {
            let report = metrics::compare(&[1.0 - e; 4], &[1.0; 4], &[true; 4], [2, 2]).unwrap();
            row(scene, shadow_map, GROUPS[0].texels, 1.0, &c.variant(None).unwrap(), report)
        };
        GROUPS[0].contenders.iter().zip(errors).map(row).collect()
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
            let place = |m: &Row<Record>| (m.place.number("shadow_map"), m.place.number("texels"));
            let mut means = results.list("means").iter().filter(|m| place(m) == (Some(map.into()), Some(15.0)));
            means.find(|m| m.label == name).unwrap().figures.number(figure)
        };
        assert_eq!(["rmse", "scenes", "lowest"].map(|f| of(512, SUBJECT, f)), [Some(0.5), Some(2.0), Some(1.0)]);
        assert_eq!(["rmse", "lowest"].map(|f| of(1024, SUBJECT, f)), [Some(0.25), Some(1.0)]);
        assert_eq!(["over", "under"].map(|f| of(1024, "pcf", f)), [Some(0.3125), Some(0.0)]);
        let beaten = (SUITE.page)(&results);
        // A draw is no defeat.
        let expected = "in 2 of 4 cells: a 1024, 15 texels (0.2500; pcf 0.1250), \
                        b 512, 15 texels (0.7500; edtsm-star as in the paper 0.2500).\n";
        assert!(beaten.contains(expected), "{beaten}");
    }

    #[test]
    fn every_group_has_the_subject_and_its_settings_are_known() {
        for group in &GROUPS {
            assert_eq!(group.contenders.iter().filter(|c| c.name == SUBJECT).count(), 1);
            for c in group.contenders {
                let settings: Vec<_> = c.settings.iter().map(|&(n, v)| (n.to_owned(), v.to_owned())).collect();
                let choice = Choice::new(c.id, &settings).unwrap();
                let width = c.settings.iter().find(|s| s.0 == "width").map(|s| s.1.to_owned());
                assert!(width.is_none_or(|w| w == group.texels.to_string()), "{}", c.name);
                assert_eq!(choice.settings() == "-", settings.is_empty() || choice.info.id == "rpcf", "{}", c.name);
            }
        }
        assert_eq!((to_4_digits(0.012_345_6), to_4_digits(123_456.0)), (0.012_35, 123_500.0));
    }
}
