//! Suite `pareto`: the time that techniques add to `sm` against their error, and the fronts of those that no other beats
//! in both.

use super::driver::*;
use super::errors;
use super::judge::{hard, mask, tracer};
use super::texel;
use crate::cli::stats::{self, Span};
use crate::cli::techniques::Choice;
use crate::cli::truth::{self, Seed};
use crate::cli::view;
use edgeshade::metrics;
use edgeshade::scene::{RenderDesc, Renderer};
use edgeshade::technique::OutputFormat;
use edgeshade::timing::FrameTiming;

pub static SUITE: Suite = Suite {
    name: "pareto",
    about: "time that every technique adds to sm against its error, with the fronts, a plot and the cheapest of ours",
    extent: |quick| match quick {
        true => Extent { scenes: vec!["jenga", "robot"], maps: &[1024], size: [320, 180] },
        false => Extent { scenes: every_scene(), maps: &[1024], size: SIZE },
    },
    variants: |device| {
        let classes = CLASSES.iter().map(|class| variants(class, device));
        Ok(classes.fold(Variants::default(), |mut all, one| {
            all.found.extend(one.found);
            all.left_out.extend(one.left_out);
            all
        }))
    },
    least_frames: 20,
    // One more warms up, and another one is judged. About a quarter of the variants may be on a front.
    frames: |plan| plan.frames.min(FEW) + 2 + plan.frames / 4,
    shows_scenes: true,
    resumes: true,
    measure,
    settings: |plan| {
        let (samples, left_out) = (samples(plan).into(), plan.left_out.clone().into());
        Record::of([("samples", samples), ("frames", plan.frames.into()), ("left_out", left_out)])
    },
    summary,
    page,
    chart: Some(chart),
    fronts,
    ..Suite::BASE
};

/// Techniques that are judged against the same truth.
struct Class {
    name: &'static str,
    /// Description of the truth, for the page.
    truth: &'static str,
    /// Rungs of each technique's ladder, in the syntax of the command line. The first one is the base, and the last one
    /// is the base again: what lies between the two is noise.
    ladder: &'static str,
    /// Rival that a user would take otherwise, at all its settings.
    rival: &'static str,
}

const CLASSES: [Class; 3] = [
    Class {
        name: "hard",
        truth: "a light without size",
        ladder: "sm pcf:width=3 rbsm rbsm:preset=published rbsm-filtered rbsm-star rbsm-star:preset=published \
                 rbsm-profile:quality=run rbsm-profile:quality=neighbours rbsm-profile:quality=line edsm sssm edsm-x \
                 shadow-volumes exact-hard sm",
        rival: "pcf",
    },
    Class {
        name: "fixed penumbrae",
        truth: "penumbrae as wide as 15 texels",
        ladder: "sm pcf:width=7 pcf:width=11 pcf:width=15 pcf:width=19 vsm:width=7 vsm:width=15 evsm:width=7 \
                 evsm:width=15 msm:width=7 msm:width=15 rpcf:width=7 rpcf:width=15 edtsm edtsm-star \
                 edtsm-star:seed_shape=point edtsm-star:preset=published sm",
        rival: "pcf",
    },
    Class {
        name: "soft",
        truth: "the scene's own area light",
        ladder: "sm pcss:search_taps=5,filter_taps=5 pcss:search_taps=5,filter_taps=9 pcss pcss:filter_taps=25 \
                 pcss:preset=published vssm mssm ssabss rbssm:search_taps=5,filter_taps=7 rbssm \
                 rbssm:preset=published ssrbssm ssrbssm:preset=published edtssm edtssm-star soft-auto exact-soft sm",
        rival: "pcss",
    },
];

/// Techniques of others, which are not counted among ours.
const OF_OTHERS: [&str; 12] =
    ["sm", "pcf", "vsm", "evsm", "msm", "pcss", "vssm", "mssm", "ssabss", "shadow-volumes", "sssm", "rbssm-naive"];

/// Frames of each variant, after which it is known which ones may be on a front. Those alone are drawn in all frames.
const FEW: u32 = 3;
/// A variant may be on the front unless another one errs less and adds less than this share of its time.
const CLEARLY: f64 = 0.8;

/// Width of fixed penumbrae, texels of the map.
const TEXELS: f64 = 15.0;
/// Parameter for the width in world units.
const PENUMBRA: &str = "penumbra";

/// Rays per pixel of the truth under an area light.
fn samples(plan: &Plan) -> u32 {
    if plan.quick { 64 } else { 256 }
}

/// A class's rungs that the registry and the device have.
fn variants(class: &Class, device: DeviceFeatures) -> Variants {
    possible(available(class.ladder), device)
}

/// The truth of a class in one scene.
struct Judge {
    truth: Vec<f32>,
    mask: Vec<bool>,
    picture: edgeshade::picture::Picture,
    /// Width of fixed penumbrae, world units.
    penumbra: Option<f64>,
}

fn judge(
    host: &Host,
    class: &Class,
    stage: &Stage,
    plan: &Plan,
    map: u32,
    renderer: &mut Renderer<'_>,
) -> Result<Judge> {
    let light = *renderer.light();
    let mut tracer = tracer(stage, &light, plan.size);
    let hard = tracer.hard()?;
    let mask = mask(host, renderer, &hard)?;
    let (truth, penumbra) = match class.name {
        "hard" => (hard, None),
        "soft" => (tracer.truth(samples(plan), Seed::Truth)?.0, None),
        _ => {
            let width = texel::median_width(&hard, &mask, &stage.camera, &light)
                .ok_or_else(|| Error::Usage(format!("nothing to judge at {:?} pixels", plan.size)))?;
            let penumbra = TEXELS * width / f64::from(map);
            let settings = [(PENUMBRA.to_owned(), penumbra.to_string())];
            (tracer.fixed_penumbra(&Choice::new("fixed-penumbra", &settings)?)?.0, Some(penumbra))
        }
    };
    renderer.shade_with(&truth.visibility)?;
    let picture = view::picture(host, renderer.picture())?;
    Ok(Judge { truth: truth.visibility, mask, picture, penumbra })
}

/// The variant with the width of the penumbra, if it has that parameter. It keeps its label.
fn with_penumbra(mut variant: Variant, penumbra: Option<f64>) -> Result<Variant> {
    let Choice { info, params } = &mut variant.choice;
    if let Some(width) = penumbra.filter(|_| info.params.iter().any(|p| p.name == PENUMBRA)) {
        params.set(info.id, PENUMBRA, &width.to_string())?;
    }
    Ok(variant)
}

fn measure(host: &Host, run: &mut Run<'_>, scene: &'static str) -> Result<()> {
    let plan = run.plan;
    let own = plan.stage(scene)?;
    run.start(scene);
    for class in &CLASSES {
        let light = if class.name == "hard" { hard(&own.light) } else { own.light.clone() };
        let stage = Stage { light, ..plan.stage(scene)? };
        for &map in plan.maps {
            // The map is drawn in every frame, so that everything derived from it counts.
            let desc =
                RenderDesc { size: plan.size, map_size: map, output: OutputFormat::R32, ..RenderDesc::default() };
            let mut renderers = [Renderer::new(host, &stage.scene, stage.camera, &stage.light, desc)?];
            let judge = judge(host, class, &stage, plan, map, &mut renderers[0])?;
            let variants = variants(class, host.context().features()).found;
            let variants =
                variants.into_iter().map(|v| with_penumbra(v, judge.penumbra)).collect::<Result<Vec<_>>>()?;
            let places: Vec<_> = variants.iter().map(|v| (0, v)).collect();
            let mut drawn = run.in_turns_for(plan.frames.min(FEW), &mut renderers, &places)?;
            let base: Vec<FrameTiming> = drawn[0].frames.clone();
            let last = variants.len() - 1;
            let mut rows = vec![];
            for (i, (variant, mine)) in variants.iter().zip(&mut drawn).enumerate() {
                let renderer = &mut renderers[0];
                renderer.frame(mine.technique.as_mut())?;
                let test = renderer.visibility(mine.technique.as_ref())?;
                let picture = view::picture(host, renderer.picture())?;
                let place = |e| Error::Usage(format!("{scene}, {}, map {map}, {}: {e}", class.name, variant.label));
                let report = metrics::compare(&test, &judge.truth, &judge.mask, plan.size).map_err(place)?;
                let figures = [("flip", truth::flip(&picture, &judge.picture, &judge.mask)?.into())];
                let figures = Record::of(figures).and(errors::figures(&report).0);
                let figures = figures.and(times(&mine.frames, &base, mine.memory_bytes).0);
                let label = if i == last { format!("{} again", variant.label) } else { variant.label.clone() };
                let variant = Variant { label, ..variant.clone() };
                let place = [("scene", scene.into()), ("class", class.name.into()), ("shadow_map", map.into())];
                let group = format!("{scene}, {}", class.name);
                if i < last {
                    run.picture(&group, map, &variant, [&test, &judge.truth], &judge.mask)?;
                }
                rows.push(Row::of(place, &variant, &group, figures));
                run.drawn(1);
            }
            let again = drawn_longer(&rows, class);
            if plan.frames > FEW {
                let places: Vec<_> = again.iter().map(|&i| (0, &variants[i])).collect();
                drop(drawn);
                let drawn = run.in_turns(&mut renderers, &places)?;
                for (&i, mine) in again.iter().zip(&drawn) {
                    let times = times(&mine.frames, &drawn[0].frames, mine.memory_bytes);
                    rows[i].fields.replace(times);
                }
            }
            run.rows.extend(rows);
        }
    }
    Ok(())
}

/// Indices of the base, its repetition, and the rows that may be on the front or beside the rival, by the times so far.
fn drawn_longer(rows: &[Row], class: &Class) -> Vec<usize> {
    let place = |r: &Row| Some((r.number("added_ms")?, r.number("rmse")?));
    let is_beaten = |(ms, rmse): (f64, f64)| {
        rows.iter().filter_map(place).any(|(other_ms, other)| other < rmse && other_ms < CLEARLY * ms)
    };
    let rival = cheapest(rows, class);
    let is_beside = |r: &Row, ms: f64, rmse: f64| {
        rival.as_ref().is_some_and(|(rival, ours)| {
            let least = ours.and_then(|o| o.number("added_ms")).unwrap_or(f64::INFINITY);
            let enough = rival.number("rmse").unwrap_or(0.0);
            std::ptr::eq(r, *rival)
                || !OF_OTHERS.contains(&r.text("technique")) && rmse <= enough && CLEARLY * ms <= least
        })
    };
    let is_wanted = |(i, r): &(usize, &Row)| {
        *i == 0 || is_repeated(r) || place(r).is_some_and(|p| !is_beaten(p) || is_beside(r, p.0, p.1))
    };
    rows.iter().enumerate().filter(is_wanted).map(|(i, _)| i).collect()
}

/// Times of a variant's own passes, and what it adds to those of the base in the same turns.
fn times(frames: &[FrameTiming], base: &[FrameTiming], memory_bytes: u64) -> Record {
    let added = frames.iter().zip(base).map(|(mine, base)| stats::technique_ms(mine) - stats::technique_ms(base));
    let (own, added) = (stats::technique(frames), Span::of(added.filter(|v| v.is_finite())));
    Record::of([
        ("gpu_ms", own.map(|s| s.median).into()),
        ("gpu_ms_min", own.map(|s| s.min).into()),
        ("added_ms", added.map(|s| s.median).into()),
        ("added_ms_min", added.map(|s| s.min).into()),
        ("added_ms_max", added.map(|s| s.max).into()),
        ("memory_bytes", memory_bytes.into()),
        ("frames", frames.len().into()),
    ])
}

/// Columns of the means and of the tables.
const COLUMNS: [Column; 8] = [
    ("adds ms", "added_ms", 2),
    ("least", "added_ms_min", 2),
    ("most", "added_ms_max", 2),
    ("RMSE", "rmse", 4),
    ("FLIP", "flip", 4),
    ("mismatch %", "mismatch", 3),
    ("light leak %", "light_leak_share", 3),
    ("MiB", "mib", 1),
];

/// Rows that no other row of the same group beats: nobody adds less at no higher error. From the cheapest on.
fn front(rows: &[Row]) -> Vec<&Row> {
    let place = |r: &Row| Some((r.number("added_ms")?, r.number("rmse")?));
    let mut all: Vec<_> = rows.iter().filter(|r| !is_repeated(r)).filter_map(|r| Some((place(r)?, r))).collect();
    all.sort_by(|(a, _), (b, _)| a.0.total_cmp(&b.0).then(a.1.total_cmp(&b.1)));
    let mut lowest = f64::INFINITY;
    all.retain(|((_, rmse), _)| {
        let beats = *rmse < lowest;
        lowest = lowest.min(*rmse);
        beats
    });
    all.into_iter().map(|(_, row)| row).collect()
}

fn is_repeated(row: &Row) -> bool {
    row.label.ends_with(" again")
}

/// The rival at its setting with the lowest error, and the cheapest of our techniques whose error is no higher.
fn cheapest<'r>(rows: &'r [Row], class: &Class) -> Option<(&'r Row, Option<&'r Row>)> {
    let rmse = |r: &Row| r.number("rmse").unwrap_or(f64::INFINITY);
    let cost = |r: &Row| r.number("added_ms").unwrap_or(f64::INFINITY);
    let rivals = rows.iter().filter(|r| r.text("technique") == class.rival);
    let rival = rivals.min_by(|a, b| rmse(a).total_cmp(&rmse(b)))?;
    let ours = rows.iter().filter(|r| !OF_OTHERS.contains(&r.text("technique")) && rmse(r) <= rmse(rival));
    Some((rival, ours.min_by(|a, b| cost(a).total_cmp(&cost(b)))))
}

/// Means over the scenes, the fronts, the noise, and what our cheapest technique costs beside the rival.
fn summary(_: &Plan, rows: &[Row]) -> Record {
    let first = rows.first().map_or("", |r| r.text("scene")).to_owned();
    let keys = rows
        .iter()
        .filter(|r| r.text("scene") == first)
        .map(|r| Row::new(&r.label, r.text("class"), r.fields.only(&["class", "technique", "shadow_map"])));
    let columns: Vec<Column> = COLUMNS
        .into_iter()
        .map(|(head, name, digits)| match name {
            "mib" => (head, "memory_bytes", digits),
            _ => (head, name, digits),
        })
        .chain([("", "gpu_ms", 2)])
        .collect();
    let means = means(rows, keys.collect(), &columns, |mine| Record::of([("scenes", mine.len().into())]));
    let fronts = |groups: Vec<&[Row]>| {
        let rows = groups.into_iter().flat_map(|group| {
            front(group).into_iter().map(|r| {
                let fields = r.fields.only(&["scene", "class", "technique", "shadow_map", "added_ms", "rmse"]);
                Row::new(&r.label, &r.group, fields.and([("variant", r.label.as_str().into())]))
            })
        });
        Field::Rows(rows.collect())
    };
    let beside = CLASSES.iter().flat_map(|class| {
        groups(rows).filter(|g| g[0].text("class") == class.name).filter_map(|group| {
            let (rival, ours) = cheapest(group, class)?;
            let share = ours.and_then(|o| Some(o.number("added_ms")? / rival.number("added_ms")?));
            Some(Row::new(
                "",
                "",
                rival.fields.only(&["scene", "class"]).and([
                    ("rival", rival.label.as_str().into()),
                    ("rival_rmse", rival.number("rmse").into()),
                    ("rival_ms", rival.number("added_ms").into()),
                    ("ours", ours.map_or("none", |o| o.label.as_str()).into()),
                    ("ours_rmse", ours.and_then(|o| o.number("rmse")).into()),
                    ("ours_ms", ours.and_then(|o| o.number("added_ms")).into()),
                    ("share", share.into()),
                ]),
            ))
        })
    });
    let spread = ["scene", "class", "added_ms", "added_ms_min", "added_ms_max"];
    let noise = rows.iter().filter(|r| is_repeated(r)).map(|r| Row::new("", "", r.fields.only(&spread)));
    let beside = Field::Rows(beside.collect());
    let of_means = fronts(groups(&means).collect());
    Record::of([
        ("fronts", fronts(groups(rows).collect())),
        ("fronts_of_means", of_means),
        ("beside_rival", beside),
        ("noise", Field::Rows(noise.collect())),
        ("means", Field::Rows(means)),
    ])
}

fn page(results: &Results<'_>) -> String {
    let plan = results.plan;
    let mut text = results.head(&format!(
        "{} frames per variant that may be on a front and {} of the others, drawn in turns; truths of {} rays a pixel for area \
         lights.",
        plan.frames,
        plan.frames.min(FEW),
        samples(plan)
    ));
    text += "`adds`: milliseconds of a technique's own passes beyond those of `sm` in the same turn, median, least and most over \
             the turns. On a front are the variants that no other one beats: none adds less at no higher RMSE. `light leak`: share \
             of the umbra, at least 3 px from its border, with a visibility above .05.\n\n";
    text += &left_out_note(&plan.left_out);
    let noise = results.list("noise");
    let most = noise.iter().filter_map(|n| Some(n.number("added_ms")?.abs())).fold(0.0, f64::max);
    text += &format!(
        "Noise: `sm` drawn a second time in the same turns adds up to {} ms (median over the turns).\n",
        number(Some(most), 2)
    );
    for class in &CLASSES {
        let of_class = |rows: &[Row]| -> Vec<Row> {
            let mine = rows.iter().filter(|r| r.text("class") == class.name);
            mine.map(|r| {
                let mib = r.number("memory_bytes").map(|bytes| bytes / f64::from(1 << 20));
                r.clone().and_shown([("mib", mib.into())])
            })
            .collect()
        };
        text += &format!("\n## {}: against {}\n\n", class.name, class.truth);
        let lead: [Column; 1] = [("<variant", "label", 0)];
        let means = of_class(results.list("means"));
        text += &format!("### Mean over the scenes\n\n{}", table(&[&lead[..], &COLUMNS].concat(), &means));
        text += &format!("\nFront of the means: {}.\n", names(results.list("fronts_of_means"), class, None));
        text += &format!(
            "\n### Fronts and the cheapest of ours\n\n`ours`: the cheapest of our techniques whose RMSE is no higher \
                          than that of `{}` at its best setting, and its share of what that adds.\n\n",
            class.rival
        );
        let beside = results.list("beside_rival").iter().filter(|b| b.text("class") == class.name);
        let rows: Vec<_> = beside
            .map(|b| {
                let front = names(results.list("fronts"), class, Some(b.text("scene")));
                b.clone().and_shown([("front", front.into())])
            })
            .collect();
        const BESIDE: [Column; 9] = [
            ("<scene", "scene", 0),
            ("<rival", "rival", 0),
            ("RMSE", "rival_rmse", 4),
            ("ms", "rival_ms", 1),
            ("<ours", "ours", 0),
            ("RMSE", "ours_rmse", 4),
            ("ms", "ours_ms", 1),
            ("share", "share", 2),
            ("<front", "front", 0),
        ];
        text += &table(&BESIDE, &rows);
        for rows in by_scene(&of_class(&results.rows)) {
            text += &format!(
                "\n### {}, {}\n\n{}",
                rows[0].text("scene"),
                class.name,
                table(&[&lead[..], &COLUMNS].concat(), rows)
            );
        }
    }
    text
}

/// Variants on a class's front, from the cheapest on.
fn names(fronts: &[Row], class: &Class, scene: Option<&str>) -> String {
    let mine = fronts.iter().filter(|r| r.text("class") == class.name && scene.is_none_or(|s| r.text("scene") == s));
    mine.map(|r| r.label.clone()).collect::<Vec<_>>().join(", ")
}

/// Means over the scenes: the front of each class as a line.
fn chart(results: &Results<'_>) -> Chart {
    let place = |r: &Row| Some((r.number("gpu_ms")?, r.number("rmse")?));
    let means = results.list("means");
    let lines = CLASSES.iter().map(|class| {
        let mine: Vec<Row> = means.iter().filter(|m| m.text("class") == class.name).cloned().collect();
        Line { name: format!("front, {}", class.name), points: front(&mine).into_iter().filter_map(place).collect() }
    });
    Chart {
        title: "Fronts of time and error, means over the scenes".into(),
        axes: ["GPU ms of the technique's passes", "RMSE"],
        lines: lines.collect(),
    }
}

/// Time and error of all variants, in the mean and in every scene.
fn fronts(results: &Results<'_>) -> Vec<Front> {
    let [all, noise] = [results.list("means"), results.list("noise")];
    let groups = groups(all).chain(groups(&results.rows)).filter(|g| !g.is_empty());
    let made = groups.filter_map(|group| {
        let (scene, class) = (group[0].text("scene"), group[0].text("class"));
        let class = CLASSES.iter().find(|c| c.name == class)?;
        let best: Vec<_> = front(group).into_iter().map(|r| r.label.as_str()).collect();
        // The noise of the mean is the largest of the scenes.
        let here =
            noise.iter().filter(|n| n.text("class") == class.name && (scene.is_empty() || n.text("scene") == scene));
        let noise_ms = here.filter_map(|n| Some(n.number("added_ms")?.abs())).reduce(f64::max);
        let point = |r: &Row| {
            let figure = |name, digits| number(r.number(name), digits);
            Some(Point {
                variant: r.label.clone(),
                technique: r.text("technique").to_owned(),
                ours: !OF_OTHERS.contains(&r.text("technique")),
                front: best.contains(&r.label.as_str()),
                x: r.number("added_ms")?,
                y: r.number("rmse")?,
                text: format!(
                    "adds {} ms ({} to {})\nRMSE {}, FLIP {}\nmismatch {} %",
                    figure("added_ms", 2),
                    figure("added_ms_min", 2),
                    figure("added_ms_max", 2),
                    figure("rmse", 4),
                    figure("flip", 4),
                    number(r.number("mismatch").map(|m| 100.0 * m), 3)
                ),
            })
        };
        let points = group.iter().filter(|r| !is_repeated(r)).filter_map(point).collect();
        let place = if scene.is_empty() { "mean over the scenes" } else { scene };
        Some(Front { place: place.to_owned(), class: class.name, noise_ms, points })
    });
    made.collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn row(class: &str, text: &str, added: f64, rmse: f64) -> Row {
        let variant = available(text).found.remove(0);
        let figures = Record::of([("added_ms", added.into()), ("rmse", rmse.into())]);
        Row::of([("scene", "a".into()), ("class", class.into())], &variant, class, figures)
    }

    #[test]
    fn every_rung_is_in_the_registry() {
        let all = DeviceFeatures { int64_atomics: true, ..DeviceFeatures::default() };
        for class in &CLASSES {
            let variants = variants(class, all);
            let unknown: Vec<_> = variants.left_out.iter().filter(|text| !text.contains("the device has no")).collect();
            assert!(unknown.is_empty(), "{unknown:?}");
            let ids: Vec<_> = variants.found.iter().map(|v| v.choice.info.id).collect();
            assert_eq!((ids[0], ids[ids.len() - 1]), ("sm", "sm"));
            assert!(ids.contains(&class.rival));
        }
    }

    #[test]
    fn a_front_has_what_no_other_beats_and_no_repeated_base() {
        let mut again = row("soft", "sm", -0.5, 0.5);
        again.label += " again";
        let rows = [
            row("soft", "sm", 0.0, 0.5),
            row("soft", "pcss", 4.0, 0.25),
            row("soft", "rbssm", 8.0, 0.3),
            row("soft", "soft-auto", 4.0, 0.2),
            row("soft", "exact-soft", 9.0, 0.1),
            again,
        ];
        let labels: Vec<_> = front(&rows).into_iter().map(|r| r.label.as_str()).collect();
        assert_eq!(labels, ["sm", "soft-auto", "exact-soft"]);
    }

    #[test]
    fn what_is_clearly_beaten_is_drawn_in_few_frames() {
        let mut again = row("soft", "sm", 0.1, 0.5);
        again.label += " again";
        let rows = [
            row("soft", "sm", 0.0, 0.5),
            row("soft", "pcss", 4.0, 0.25),
            row("soft", "rbssm", 8.0, 0.3),    // beaten by pcss
            row("soft", "ssrbssm", 4.5, 0.26), // by less than a fifth
            row("soft", "edtssm", 13.0, 0.22), // ours at no higher error than the rival, as is the next
            row("soft", "soft-auto", 12.0, 0.2),
            row("soft", "pcss:filter_taps=25", 9.0, 0.24),
            again,
        ];
        assert_eq!(drawn_longer(&rows, &CLASSES[2]), [0, 1, 3, 4, 5, 6, 7]);
    }

    #[test]
    fn ours_is_the_cheapest_at_no_higher_error_than_the_rivals_best() {
        let soft = &CLASSES[2];
        let rows = [
            row("soft", "sm", 0.0, 0.5),
            row("soft", "pcss", 4.0, 0.25),
            row("soft", "pcss:filter_taps=25", 6.0, 0.2),
            row("soft", "rbssm", 3.0, 0.22),
            row("soft", "soft-auto", 9.0, 0.2),
            row("soft", "exact-soft", 12.0, 0.1),
        ];
        let (rival, ours) = cheapest(&rows, soft).unwrap();
        assert_eq!((rival.label.as_str(), ours.unwrap().label.as_str()), ("pcss filter_taps=25", "soft-auto"));
        let (_, ours) = cheapest(&rows[..3], soft).unwrap();
        assert!(ours.is_none());
    }
}
