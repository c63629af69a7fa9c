//! Suite `stability`: changes that must leave the pictures as they are, and a verdict for every technique.

mod cases;
mod inputs;
mod lab;

use self::cases::{ALL, Case, Finding};
use self::lab::Lab;
use super::driver::*;
use super::judge::mapless;
use crate::cli::techniques::{Choice, takes_samples};
use edgeshade::technique;

pub static SUITE: Suite = Suite {
    name: "stability",
    about: "changes that must leave the pictures as they are, with a verdict for every technique",
    extent: |quick| {
        let size = if quick { [240, 136] } else { [480, 272] };
        Extent { scenes: ALL.iter().map(|c| c.name).collect(), maps: &[MAP], size }
    },
    variants: |device| every_technique(device),
    measure,
    settings: |plan| {
        let case = |c: &Case| {
            let fields = [
                ("case", c.name.into()),
                ("changed", c.changed.into()),
                ("invariant", c.invariant.into()),
                ("bound_source", c.bound.into()),
            ];
            Row::new(c.name, "", Record::of(fields))
        };
        let cases = ALL.iter().map(case).collect();
        Record::of([("shadow_map", plan.maps[0].into()), ("cases", Field::Rows(cases))])
    },
    page,
    ..Suite::BASE
};

/// Side of the shadow map, texels.
const MAP: u32 = 512;
/// Samples of the references, fewer than by default: their pictures are small, and there are many.
const SAMPLES: &str = "64";

/// Every technique of the registry at its defaults.
fn every_technique(device: DeviceFeatures) -> Result<Variants> {
    let choice = |info: &technique::Info| {
        let samples = [("samples".to_owned(), SAMPLES.to_owned())];
        Ok(Variant::new(Choice::new(info.id, if takes_samples(info) { &samples } else { &[] })?))
    };
    let found = technique::ALL.iter().map(choice).collect::<Result<_>>()?;
    Ok(possible(mapless(Variants { found, left_out: vec![] }), device))
}

const HOLDS: &str = "holds";
const FAILS: &str = "fails";
const DOES_NOT_APPLY: &str = "does not apply";

fn measure(host: &Host, run: &mut Run<'_>, name: &'static str) -> Result<()> {
    let plan = run.plan;
    run.start(name);
    let lab = Lab { host, size: plan.size, map: plan.maps[0], quick: plan.quick };
    let variants: Vec<_> = plan.variants.iter().collect();
    for case in ALL.iter().filter(|c| c.name == name) {
        for (variant, finding) in variants.iter().zip((case.measure)(&lab, &variants)?) {
            run.push(row(case, variant, finding), 1);
        }
    }
    Ok(())
}

fn row(case: &Case, variant: &Variant, finding: Finding) -> Row {
    let place = [("case", case.name.into())];
    let fields = match finding {
        Finding::Measured(m) => {
            let verdict = if m.holds() { HOLDS } else { FAILS };
            let fields = Record::of([
                ("verdict", verdict.into()),
                ("figure", m.figure.into()),
                ("bound", m.bound.into()),
                ("place", m.place.into()),
            ]);
            fields.and(m.more.0)
        }
        Finding::DoesNotApply(why) => Record::of([("verdict", DOES_NOT_APPLY.into()), ("reason", why.into())]),
    };
    Row::of(place, variant, case.name, fields)
}

/// A figure with two digits that count.
fn figure(case: &Case, value: f64) -> String {
    let (value, unit) = if case.is_share { (100.0 * value, " %") } else { (value, "") };
    let digits = if value > 0.0 && value < 0.1 { (1.0 - value.log10().floor()) as usize } else { 2 };
    format!("{}{unit}", number(Some(value), digits))
}

fn page(results: &Results<'_>) -> String {
    let about = format!(
        "map {MAP}; every technique of the registry at its defaults, the references with {SAMPLES} samples. A block, a ball, \
         posts and boards over a ground, under a sun of 5.7 degrees and a spot of one unit's width. A cell is the worst \
         of all places of a case. Errors are those against the truth that a technique claims to show: the light without \
         size, penumbrae of fixed width, or the light's own size."
    );
    let mut text = results.head(&about);
    let of = |case: &Case, label: &str| results.rows.iter().find(|r| r.group == case.name && r.label == label);
    let heads = ALL.iter().fold("<technique".to_owned(), |heads, case| format!("{heads} | <{}", case.name));
    let line = |v: &Variant| {
        let verdict = |case: &Case| match of(case, &v.label) {
            Some(r) if r.text("verdict") == FAILS => {
                format!("**fails: {}**", figure(case, r.number("figure").unwrap_or(f64::NAN)))
            }
            Some(r) if r.text("verdict") == HOLDS => HOLDS.into(),
            _ => "-".into(),
        };
        [v.label.clone()].into_iter().chain(ALL.iter().map(verdict)).collect()
    };
    text += &plain_table(&heads, results.plan.variants.iter().map(line));
    for case in &ALL {
        let mine: Vec<_> = results.rows.iter().filter(|r| r.group == case.name).collect();
        text += &section(case, &mine);
    }
    text
}

/// What a case does, and its figures.
fn section(case: &Case, rows: &[&Row]) -> String {
    let with = |verdict: &'static str| rows.iter().filter(move |r| r.text("verdict") == verdict);
    let mut text = format!(
        "\n## {}\n\n* Changed: {}.\n* Invariant: {}.\n* Bound: {}.\n* {} hold, {} fail, {} do not apply.\n",
        case.name,
        case.changed,
        case.invariant,
        case.bound,
        with(HOLDS).count(),
        with(FAILS).count(),
        with(DOES_NOT_APPLY).count()
    );
    let mut reasons: Vec<_> = with(DOES_NOT_APPLY).map(|r| r.text("reason")).collect();
    reasons.dedup();
    for reason in reasons {
        let names: Vec<_> =
            with(DOES_NOT_APPLY).filter(|r| r.text("reason") == reason).map(|r| r.label.as_str()).collect();
        text += &format!("* Does not apply to {}: {reason}.\n", names.join(", "));
    }
    let shown = rows.iter().filter(|r| r.number("figure").is_some_and(|v| v > 0.0));
    let has_plateau = rows.iter().any(|r| r.number("plateau_octaves").is_some());
    let cells = |r: &&Row| {
        let [value, bound] = ["figure", "bound"].map(|n| figure(case, r.number(n).unwrap_or(f64::NAN)));
        let mut cells = vec![r.label.clone(), r.text("verdict").to_owned(), value, bound, r.text("place").to_owned()];
        if has_plateau {
            let of = |name| number(r.number(name), 4);
            cells.push(format!(
                "{} ({} to {})",
                number(r.number("plateau_octaves"), 0),
                of("plateau_from"),
                of("plateau_to")
            ));
        }
        cells
    };
    let cells: Vec<_> = shown.map(cells).collect();
    if !cells.is_empty() {
        let more = if has_plateau { " | plateau, octaves (factors)" } else { "" };
        text +=
            &format!("\n{}", plain_table(&format!("<technique | <verdict | figure | bound | <worst at{more}"), cells));
    }
    text
}
