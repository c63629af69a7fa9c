//! Suites of the five source papers: their tables in the form that each paper describes and in ours, the printed figures
//! beside them, and what becomes of the papers' claims here.

mod claims;
mod data;

use self::claims::Verdict;
use self::data::{Axis, Judged, Method, Paper, Table};
use super::driver::*;
use super::errors;
use super::judge::{self, hard, mask, tracer};
use super::timed;
use crate::cli::stats::{self, Span};
use crate::cli::truth::{self, Seed};
use crate::cli::view;
use edgeshade::metrics;
use edgeshade::scene::{RenderDesc, Renderer};

const BASE: Suite = Suite {
    extent: |_| Extent { scenes: vec![], maps: &[1024], size: SIZE },
    variants: |device| Ok(possible(available("sm"), device)),
    frames: |plan| frames_in_a_table(plan),
    measure,
    settings: |plan| Record::of([("frames", plan.frames.into())]),
    summary,
    page,
    ..Suite::BASE
};

macro_rules! suite {
    ($name:ident, $paper:ident) => {
        pub static $name: Suite = Suite {
            name: data::$paper.suite,
            about: data::$paper.about,
            extent: |quick| Extent { scenes: data::$paper.parts(quick), maps: &[1024], size: SIZE },
            ..BASE
        };
    };
}

suite!(PAPER_000, EDTSM_STAR);
suite!(PAPER_001, RBSSM);
suite!(PAPER_002, EDTSSM);
suite!(PAPER_003, EDSM);
suite!(PAPER_004, RBSM);

/// Rays per pixel of the truth under an area light.
const SAMPLES: u32 = 256;
/// Forms of a technique: the paper's and ours.
const FORMS: [(&str, &str); 2] = [("published", "preset=published"), ("defaults", "")];

fn paper_of(plan: &Plan) -> &'static Paper {
    let all = data::ALL.iter();
    all.copied().find(|p| p.suite == plan.suite).unwrap_or(&data::RBSM)
}

/// Frames of the largest table, for the progress.
fn frames_in_a_table(plan: &Plan) -> u32 {
    let part = paper_of(plan)
        .tables
        .iter()
        .map(|t| t.columns(plan.quick).len() * t.scenes(plan.quick).len() * (2 * t.methods.len() + 1));
    part.max().unwrap_or(0) as u32 * (plan.frames + 1)
}

fn measure(host: &Host, run: &mut Run<'_>, part: &'static str) -> Result<()> {
    run.start(part);
    let paper = paper_of(run.plan);
    if let Some(table) = paper.tables.iter().find(|t| t.name == part) {
        return measure_table(host, run, table);
    }
    match paper.judged.iter().find(|j| j.name == part) {
        Some(judged) => measure_errors(host, run, judged),
        None => Ok(()),
    }
}

/// A technique with settings in a form; `None` if the technique has no such form.
fn variant(method: &Method, axis: Axis, column: u32, form: (&str, &str)) -> Option<Variant> {
    let (id, settings) = method.technique.split_once(':').unwrap_or((method.technique, ""));
    let kernel = match method.kernel {
        Some(name) if axis == Axis::Kernel => format!("{name}={column}"),
        _ => String::new(),
    };
    // The table's kernel replaces that of the method.
    let settings =
        settings.split(',').filter(|s| kernel.is_empty() || Some(s.split('=').next().unwrap_or(s)) != method.kernel);
    let all: Vec<_> = [form.1].into_iter().chain(settings).chain([kernel.as_str()]).filter(|s| !s.is_empty()).collect();
    let text = if all.is_empty() { id.to_owned() } else { format!("{id}:{}", all.join(",")) };
    available(&text).found.pop()
}

/// The forms of a method that the device supports.
fn forms(host: &Host, method: &Method, axis: Axis, column: u32) -> Vec<(&'static str, Variant)> {
    let all = FORMS.into_iter().filter_map(|form| Some((form.0, variant(method, axis, column, form)?)));
    let features = host.context().features();
    all.filter(|(_, v)| v.choice.info.needs.iter().all(|n| n.is_met(features))).collect()
}

fn measure_table(host: &Host, run: &mut Run<'_>, table: &'static Table) -> Result<()> {
    let plan = run.plan;
    for (scene_index, &(scene, _)) in table.scenes(plan.quick).iter().enumerate() {
        for (i, &column) in table.columns(plan.quick).iter().enumerate() {
            let (size, map) = table.place(column, plan.quick);
            let stage = Stage::shipped(find_scene(scene)?, size)?;
            let light = if table.hard { hard(&stage.light) } else { stage.light.clone() };
            let stage = Stage { light, ..stage };
            let desc = RenderDesc { size, map_size: map, ..RenderDesc::default() };
            let mut renderers = [Renderer::new(host, &stage.scene, stage.camera, &stage.light, desc)?];
            let Some(base) = available("sm").found.pop() else { return Ok(()) };
            let mut members: Vec<(&str, Option<&Method>, Variant)> = vec![("defaults", None, base)];
            for method in table.methods {
                let forms = forms(host, method, table.axis, column).into_iter();
                members.extend(forms.map(|(form, variant)| (form, Some(method), variant)));
            }
            let variants: Vec<_> = members.iter().map(|m| (0, &m.2)).collect();
            let drawn = run.in_turns(&mut renderers, &variants)?;
            for ((form, method, variant), mine) in members.iter().zip(&drawn) {
                let place = [
                    ("table", table.name.into()),
                    ("scene", scene.into()),
                    ("axis", table.axis.name().into()),
                    ("amount", column.into()),
                    ("method", method.map_or("SM", |m| m.name).into()),
                    ("form", (*form).into()),
                ];
                let group = format!("{}, {scene}, {column}", table.name);
                let figures = times(mine, &drawn[0]).and(table.printed(*method, scene_index, i).0);
                run.push(Row::of(place, variant, &group, figures), 0);
            }
        }
    }
    Ok(())
}

/// Times of a variant, and what it adds to those of `sm` in the same turns.
fn times(mine: &Drawn, base: &Drawn) -> Record {
    let turns = || mine.frames.iter().zip(&base.frames);
    let median = |values: &mut dyn Iterator<Item = f64>| Span::of(values.filter(|v| v.is_finite())).map(|s| s.median);
    let own = stats::technique(&mine.frames);
    Record::of([
        ("gpu_ms", own.map(|s| s.median).into()),
        ("gpu_ms_min", own.map(|s| s.min).into()),
        ("gpu_ms_max", own.map(|s| s.max).into()),
        ("added_ms", median(&mut turns().map(|(m, b)| stats::technique_ms(m) - stats::technique_ms(b))).into()),
        ("frame_ratio", median(&mut turns().map(|(m, b)| m.total_gpu_ms / b.total_gpu_ms)).into()),
        ("total_gpu_ms", stats::total(&mine.frames).map(|s| s.median).into()),
        ("passes", Field::Passes(stats::passes(&mine.frames))),
    ])
}

/// Size of the pictures that are judged, pixels.
fn size_of_errors(quick: bool) -> [u32; 2] {
    if quick { [192, 108] } else { [640, 360] }
}

fn measure_errors(host: &Host, run: &mut Run<'_>, judged: &'static Judged) -> Result<()> {
    let plan = run.plan;
    let size = size_of_errors(plan.quick);
    let scenes = if plan.quick { &judged.scenes[..1] } else { judged.scenes };
    for (scene_index, &(scene, _)) in scenes.iter().enumerate() {
        let own = Stage::shipped(find_scene(scene)?, size)?;
        let light = if judged.soft { own.light.clone() } else { hard(&own.light) };
        let stage = Stage { light, ..own };
        let maps = if plan.quick { &judged.maps[..1] } else { judged.maps };
        for &map in maps {
            let mut renderer = judge::renderer(host, &stage, size, map)?;
            let view = *renderer.light();
            let mut tracer = tracer(&stage, &view, size);
            let hard = tracer.hard()?;
            let mask = mask(host, &mut renderer, &hard)?;
            let samples = if plan.quick { 64 } else { SAMPLES };
            let truth = if judged.soft { tracer.truth(samples, Seed::Truth)?.0 } else { hard };
            renderer.shade_with(&truth.visibility)?;
            let truth_picture = view::picture(host, renderer.picture())?;
            for (i, method) in judged.methods.iter().enumerate() {
                for (form, v) in forms(host, method, Axis::Map, map) {
                    let test = judge::visibility(&mut renderer, &v.choice)?;
                    let picture = view::picture(host, renderer.picture())?;
                    let report = metrics::compare(&test, &truth.visibility, &mask, size)
                        .map_err(|e| Error::Usage(format!("{scene}, map {map}, {}: {e}", v.label)))?;
                    let printed = judged.rmse.get(scene_index).and_then(|r| r.get(i)).copied();
                    let place = [
                        ("table", judged.name.into()),
                        ("scene", scene.into()),
                        ("shadow_map", map.into()),
                        ("method", method.name.into()),
                        ("form", form.into()),
                    ];
                    let flip = truth::flip(&picture, &truth_picture, &mask)?;
                    let figures = Record::of([("flip", flip.into()), ("paper_rmse", printed.into())]);
                    let group = format!("{}, {scene}, {map}", judged.name);
                    run.picture_of(size, &group, map, &v, [&test, &truth.visibility], &mask)?;
                    run.push(Row::of(place, &v, &group, figures.and(errors::figures(&report).0)), 1);
                }
            }
        }
    }
    Ok(())
}

/// A verdict for each table and each claim.
fn summary(plan: &Plan, rows: &[Row]) -> Record {
    let paper = paper_of(plan);
    let mut verdicts = vec![];
    for table in paper.tables {
        let mine: Vec<_> = rows.iter().filter(|r| r.text("table") == table.name).cloned().collect();
        if let Some((figure, verdict)) = claims::order(&mine) {
            verdicts.push(verdict_row(
                table.name,
                "techniques cost more in the same order as printed",
                &figure,
                verdict,
            ));
        }
    }
    for claim in paper.claims {
        let (figure, verdict) = (claim.judge)(rows).unwrap_or(("not measured in this run".into(), Verdict::CannotTell));
        verdicts.push(verdict_row(claim.source, claim.text, &figure, verdict));
    }
    Record::of([("verdicts", Field::Rows(verdicts))])
}

fn verdict_row(source: &str, claim: &str, figure: &str, verdict: Verdict) -> Row {
    let fields = [
        ("source", source.into()),
        ("claim", claim.into()),
        ("figure", figure.into()),
        ("verdict", verdict.text().into()),
    ];
    Row::new(source, "", Record::of(fields))
}

fn page(results: &Results<'_>) -> String {
    const TIMES: [Column; 8] = [
        ("<method", "method", 0),
        ("<form", "form", 0),
        ("<settings", "label", 0),
        ("frame ms", "total_gpu_ms", 2),
        ("by SM's frame", "frame_ratio", 2),
        ("adds ms", "added_ms", 2),
        ("printed ms", "paper_ms", 2),
        ("printed by SM", "paper_ratio", 2),
    ];
    const ERRORS: [Column; 7] = [
        ("<method", "method", 0),
        ("<form", "form", 0),
        ("<settings", "label", 0),
        ("RMSE", "rmse", 4),
        ("printed RMSE", "paper_rmse", 4),
        ("FLIP", "flip", 4),
        ("mismatch %", "mismatch", 3),
    ];
    const VERDICTS: [Column; 4] =
        [("<source", "source", 0), ("<claim", "claim", 0), ("<here", "figure", 0), ("<verdict", "verdict", 0)];
    let paper = paper_of(results.plan);
    let [width, height] = size_of_errors(results.plan.quick);
    let tables = if results.plan.quick { "tables in a quarter of the printed width and height, " } else { "" };
    let about =
        format!("{tables}{} frames per variant, drawn in turns; errors at {width}x{height}.", results.plan.frames);
    let mut text = results.head(&about);
    text += &format!(
        "{}\n\nThe papers' own scenes are not public: each table names the shipped scene that stands in for it. `published` is \
         the form that the paper describes, `defaults` is ours. Times are of whole frames, as the papers print them; `adds` is \
         what the technique's own passes add to those of `sm`. Printed times are from another GPU: compare the ratios.\n\n\
         ## Claims\n\n",
        paper.citation
    );
    text += &table(&VERDICTS, results.list("verdicts"));
    text += &format!("\n{}\n", claims::LEGEND);
    for rows in groups(&results.rows) {
        let title = title(paper, &rows[0]);
        let is_time = rows[0].number("total_gpu_ms").is_some();
        text += &format!("\n## {title}\n\n{}", if is_time { table(&TIMES, rows) } else { table(&ERRORS, rows) });
        let star = rows.iter().find(|r| r.text("form") == "published" && r.text("technique") == "edtsm-star");
        if let Some(row) = star.filter(|_| is_time) {
            text += &format!("\nPasses of EDTSM\\*: {}.\n", timed::passes(row));
        }
    }
    text
}

/// Title of the table of a group of rows.
fn title(paper: &Paper, row: &Row) -> String {
    let (part, scene) = (row.text("table"), row.text("scene"));
    let all = paper.tables.iter().map(|t| (t.name, t.scenes)).chain(paper.judged.iter().map(|j| (j.name, j.scenes)));
    let printed = all.filter(|a| a.0 == part).flat_map(|a| a.1).find(|s| s.0 == scene).map_or("", |s| s.1);
    let at = match (row.text("axis"), row.number("amount")) {
        ("", _) => format!("map {}", number(row.number("shadow_map"), 0)),
        (axis, amount) => format!("{axis} {}", number(amount, 0)),
    };
    format!("{part}: {scene} for {printed}, {at}")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_printed_row_has_a_figure_for_every_column() {
        for paper in data::ALL {
            for table in paper.tables {
                for method in table.methods {
                    for printed in method.ms {
                        assert_eq!(printed.len(), table.at.len(), "{}, {}, {}", paper.suite, table.name, method.name);
                    }
                    assert!(method.ms.is_empty() || method.ms.len() == table.scenes.len(), "{}", method.name);
                }
            }
            for judged in paper.judged {
                assert!(judged.rmse.iter().all(|r| r.len() == judged.methods.len()), "{}", judged.name);
            }
        }
    }

    #[test]
    fn every_method_is_in_the_registry_in_the_forms_that_it_has() {
        for paper in data::ALL {
            let of_tables = paper.tables.iter().flat_map(|t| t.methods.iter().map(|m| (m, t.axis)));
            for (method, axis) in
                of_tables.chain(paper.judged.iter().flat_map(|j| j.methods.iter().map(|m| (m, Axis::Map))))
            {
                let Some(ours) = variant(method, axis, 15, FORMS[1]) else { panic!("{}", method.technique) };
                let published = variant(method, axis, 15, FORMS[0]);
                assert_eq!(published.is_some(), !ours.choice.info.published.is_empty(), "{}", method.technique);
            }
        }
    }

    #[test]
    fn the_kernel_of_a_column_replaces_that_of_the_method() {
        let pcf = Method { name: "PCF", technique: "pcf:width=15", kernel: Some("width"), ms: &[] };
        assert_eq!(variant(&pcf, Axis::Kernel, 23, FORMS[1]).unwrap().label, "pcf width=23");
        assert_eq!(variant(&pcf, Axis::Map, 1024, FORMS[1]).unwrap().label, "pcf width=15");
    }
}
