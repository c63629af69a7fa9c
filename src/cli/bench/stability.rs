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
        let size = if quick { [192, 108] } else { [480, 272] };
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

/// Section of the page about a case, with its figures.
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
    if !case.limits.is_empty() {
        text += &format!("* Known limits: {}.\n", case.limits.trim_end_matches('.'));
    }
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

#[cfg(test)]
mod tests {
    use super::cases::differing;
    use super::lab::{Claim, Shot, claim, scene};
    use super::*;
    use crate::cli::bench::tilted::Lamp;
    use edgeshade::host::HostDesc;
    use edgeshade::view::{LightKind, LightView};
    use glam::DAffine3;

    /// Cases of the short form: cheap, and exact for every technique.
    const SHORT: [&str; 4] =
        ["repeat", "scale by a power of two", "degenerate triangles", "inputs that are no numbers"];

    /// Runs the short form for techniques whose index in the registry is in the range.
    fn short_form(range: std::ops::Range<usize>) {
        let host = Host::new(&HostDesc { validation: true, ..HostDesc::default() }).unwrap();
        let lab = Lab { host: &host, size: [96, 56], map: 128, quick: true };
        let all = every_technique(host.context().features()).unwrap().found;
        let index = |v: &Variant| technique::ALL.iter().position(|t| t.id == v.choice.info.id).unwrap();
        let variants: Vec<_> = all.iter().filter(|v| range.contains(&index(v))).collect();
        let mut failed = vec![];
        for case in ALL.iter().filter(|c| SHORT.contains(&c.name)) {
            let found = (case.measure)(&lab, &variants).unwrap();
            assert_eq!(found.len(), variants.len());
            let mut measured = 0;
            for (v, finding) in variants.iter().zip(found) {
                let Finding::Measured(m) = finding else { continue };
                measured += 1;
                if !m.holds() {
                    failed.push(format!("{}, {}: {} ({})", case.name, v.label, m.figure, m.place));
                }
            }
            assert!(measured > 0 && measured + 3 >= variants.len(), "{}: {measured} techniques measured", case.name);
        }
        assert!(failed.is_empty(), "{}", failed.join("\n"));
        changes_are_noticed(&lab, &variants);
        let messages = host.messages().clone();
        drop(host);
        assert_eq!(messages.all(), Vec::<String>::new());
    }

    /// A light turned by ten degrees gives another picture; so does one of another size, for techniques that claim to show
    /// its size and for no others.
    fn changes_are_noticed(lab: &Lab<'_>, variants: &[&Variant]) {
        let stage = lab.stage(scene(Lamp::Spot));
        let start = *lab.shot(&stage).unwrap().renderer.light();
        let shot = |view| {
            let mut shot = lab.shot(&stage).unwrap();
            shot.set_light(view);
            shot
        };
        let turn = DAffine3::from_rotation_y(10f64.to_radians());
        let turned = LightView { world_from_view: turn * start.world_from_view, ..start };
        let larger = LightView { kind: LightKind::Spot { size: 2.0 }, ..start };
        let mut shots = [start, turned, larger].map(shot);
        for v in variants {
            let image = |shot: &mut Shot<'_>| shot.image(&v.choice).unwrap();
            let [Some(own), Some(turned), Some(larger)] = shots.each_mut().map(image) else { continue };
            assert!(differing(&own, &turned, 0.05) > 0.004, "{}: a turned light", v.label);
            let reads_size = differing(&own, &larger, 0.0) > 0.0;
            assert_eq!(reads_size, claim(v.choice.info.id) == Claim::Soft, "{}: a larger light", v.label);
        }
    }

    /// Number of techniques that the first of the two tests takes: two tests share two cores.
    const HALF: usize = 18;

    #[test]
    fn the_short_form_holds_for_the_first_techniques() {
        short_form(0..HALF);
    }

    #[test]
    fn the_short_form_holds_for_the_other_techniques() {
        short_form(HALF..technique::ALL.len());
    }

    #[test]
    fn figures_show_two_digits_that_count() {
        let case = |is_share| ALL.iter().find(|c| c.is_share == is_share).unwrap();
        let shown = [0.0, 1.0, 0.029, 0.0000077].map(|v| figure(case(true), v));
        assert_eq!(shown, ["0.00 %", "100.00 %", "2.90 %", "0.00077 %"]);
        assert_eq!([1.406, 0.0123].map(|v| figure(case(false), v)), ["1.41", "0.012"]);
    }
}
