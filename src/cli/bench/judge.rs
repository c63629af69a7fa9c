//! What the suites that judge techniques by the truth share.

use super::{Args, real_time, shown, slug};
use crate::cli::args::TruthArgs;
use crate::cli::stage::Stage;
use crate::cli::techniques::Choice;
use crate::cli::truth::Tracer;
use edgeshade::host::Host;
use edgeshade::picture::write_atomic;
use edgeshade::reference::ray_traced::Truth;
use edgeshade::scene::{Light, LightShape, RenderDesc, Renderer};
use edgeshade::technique::{self, OutputFormat};
use edgeshade::timing::FrameTiming;
use edgeshade::view::LightView;
use edgeshade::{DeviceFeatures, Result};
use serde::Serialize;
use std::path::PathBuf;

/// Settings that are judged beside the defaults; of a technique or parameter that is not in the registry, nothing is.
const VARIANTS: [(&str, (&str, &str)); 5] = [
    ("pcf", ("width", "3")),
    ("rbsm-profile", ("quality", "run")),
    ("rbsm-profile", ("quality", "neighbours")),
    ("rbsm-profile", ("quality", "line")),
    ("rpcf", ("width", "7")),
];

/// Each variant is judged with this as well, where it has the parameter: one depth for all texels of a kernel.
const FIXED: (&str, &str) = ("receiver", "fixed");

/// Draws what `rbsm` and `rbsm-filtered` draw, bit for bit: there is nothing more to judge.
const SAME: &str = "rbsm-branches";

/// Every real-time technique at its defaults, and the variants above; in the registry's order, none twice.
pub fn contenders() -> Result<Vec<Choice>> {
    let has = |id: &str, name: &str| technique::find(id).is_ok_and(|t| t.params.iter().any(|p| p.name == name));
    let defaults = real_time().filter(|&id| id != SAME).map(|id| (id, vec![]));
    let variants = VARIANTS.iter().filter(|(id, (name, _))| has(id, name)).map(|&(id, setting)| (id, vec![setting]));
    let mut found: Vec<Choice> = vec![];
    for (id, settings) in defaults.chain(variants) {
        for more in [None, Some(FIXED).filter(|f| has(id, f.0))] {
            let settings = settings.iter().copied().chain(more).map(|(n, v)| (n.to_owned(), v.to_owned()));
            let choice = Choice::new(id, &settings.collect::<Vec<_>>())?;
            if !found.iter().any(|c| c.info.id == id && c.params.show() == choice.params.show()) {
                found.push(choice);
            }
        }
    }
    found.sort_by_key(|c| technique::ALL.iter().position(|t| t.id == c.info.id));
    Ok(found)
}

/// Whether all of its texels are compared with one depth.
pub fn is_fixed(choice: &Choice) -> bool {
    choice.params.show().iter().any(|(name, value)| *name == FIXED.0 && value == FIXED.1)
}

/// A technique with its settings, as suites list them.
pub type Wanted = (&'static str, &'static [(&'static str, &'static str)]);

/// Those that the registry has, and what is left out, with the reason where it is a setting.
pub fn available(wanted: &[Wanted]) -> (Vec<Choice>, Vec<String>) {
    let (mut found, mut left_out) = (vec![], vec![]);
    for (id, settings) in wanted {
        let pairs: Vec<_> = settings.iter().map(|&(n, v)| (n.to_owned(), v.to_owned())).collect();
        match Choice::new(id, &pairs) {
            Ok(choice) => found.push(choice),
            Err(_) if technique::find(id).is_err() => left_out.push(wanted_label(id, settings)),
            Err(e) => left_out.push(format!("{} ({e})", wanted_label(id, settings))),
        }
    }
    (found, left_out)
}

pub fn wanted_label(id: &str, settings: &[(&str, &str)]) -> String {
    settings.iter().fold(id.to_owned(), |text, (n, v)| format!("{text} {n}={v}"))
}

/// What a page says of what is left out; empty if nothing is.
pub fn left_out_note(left_out: &[String]) -> String {
    if left_out.is_empty() {
        return String::new();
    }
    format!("Left out, as this version has none: {}.\n\n", left_out.join(", "))
}

/// Id and changed settings, for people.
pub fn label(choice: &Choice) -> String {
    match choice.settings().as_str() {
        "-" => choice.info.id.to_owned(),
        settings => format!("{} {settings}", choice.info.id),
    }
}

/// The same light without size: its shadows are hard.
pub fn hard(light: &Light) -> Light {
    let shape = match light.shape {
        LightShape::Spot { outer, .. } => LightShape::Spot { outer, size: Some(0.0) },
        LightShape::Directional { .. } => LightShape::Directional { angle: Some(0.0) },
    };
    Light { shape, ..light.clone() }
}

/// Renders for measuring: visibility in `f32`, and a map that is drawn anew only when something has moved.
pub fn renderer<'h>(host: &'h Host, stage: &Stage, size: [u32; 2], map_size: u32) -> Result<Renderer<'h>> {
    let desc = RenderDesc { size, map_size, output: OutputFormat::R32, dynamic_light: false, ..RenderDesc::default() };
    Renderer::new(host, &stage.scene, stage.camera, &stage.light, desc)
}

/// Traces the stage; truths are kept in the usual cache.
pub fn tracer<'a>(stage: &'a Stage, light: &LightView, size: [u32; 2]) -> Tracer<'a> {
    Tracer::new(stage, light, size, &TruthArgs { samples: None, cache: None })
}

/// Visibility of one frame, and what its passes took and counted.
pub fn frame(renderer: &mut Renderer<'_>, choice: &Choice) -> Result<(Vec<f32>, FrameTiming)> {
    let mut technique = renderer.prepare(choice.info.id, &choice.params)?;
    let timing = renderer.frame(technique.as_mut())?;
    Ok((renderer.visibility(technique.as_ref())?, timing))
}

/// Visibility of one frame.
pub fn visibility(renderer: &mut Renderer<'_>, choice: &Choice) -> Result<Vec<f32>> {
    Ok(frame(renderer, choice)?.0)
}

/// Sorts out what the device cannot do, with the reason.
pub fn possible(choices: Vec<Choice>, device: DeviceFeatures) -> (Vec<Choice>, Vec<String>) {
    let (mut found, mut left_out) = (vec![], vec![]);
    for choice in choices {
        match choice.info.needs.iter().find(|n| !n.is_met(device)) {
            None => found.push(choice),
            Some(need) => left_out.push(format!("{} (the device has no {})", label(&choice), need.text())),
        }
    }
    (found, left_out)
}

/// The pixels that count in a frame as the renderer now stands.
pub fn mask(host: &Host, renderer: &mut Renderer<'_>, truth: &Truth) -> Result<Vec<bool>> {
    renderer.shade_with(&truth.visibility)?;
    Ok(truth.judged(&host.read_image::<u32>(&renderer.gbuffer().triangle)?))
}

/// Mean of what there is; `None` of nothing.
pub fn mean(values: impl IntoIterator<Item = Option<f64>>) -> Option<f64> {
    let (mut sum, mut count) = (0.0, 0);
    for v in values.into_iter().flatten() {
        sum += v;
        count += 1;
    }
    (count > 0).then(|| sum / f64::from(count))
}

/// Writes a suite's figures and its page, prints the page, and gives the path of the figures.
pub fn save(args: &Args, host: &Host, suite: &str, figures: &impl Serialize, page: &str) -> Result<PathBuf> {
    let page = crate::cli::report::with_times_line(page, host.timing());
    let path = args.output.join(format!("{suite}-{}.json", slug(&host.info().name)));
    args.write(&path, figures)?;
    write_atomic(&path.with_extension("md"), page.as_bytes())?;
    args.say(format_args!("{page}\nwrote {} and .md\n", shown(&path)))?;
    Ok(path)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_technique_is_judged_and_none_twice() {
        let names: Vec<_> = contenders().unwrap().iter().map(label).collect();
        for id in real_time().filter(|&id| id != SAME) {
            assert!(names.iter().any(|n| n == id), "{id}: {names:?}");
        }
        for (i, name) in names.iter().enumerate() {
            assert!(!names[..i].contains(name), "{names:?}");
        }
    }

    #[test]
    fn what_is_not_there_is_left_out_and_named() {
        let wanted: [Wanted; 4] =
            [("sm", &[]), ("none", &[("a", "1")]), ("pcf", &[("width", "15")]), ("pcf", &[("no", "1")])];
        let (found, left_out) = available(&wanted);
        assert_eq!(found.iter().map(label).collect::<Vec<_>>(), ["sm", "pcf width=15"]);
        assert!(left_out.len() == 2 && left_out[0] == "none a=1", "{left_out:?}");
        assert!(left_out[1].starts_with("pcf no=1 (") && left_out[1].len() > 20, "{left_out:?}");
        assert_eq!(left_out_note(&[]), "");
        assert!(left_out_note(&left_out).contains("none a=1, pcf no=1 ("));
    }

    #[test]
    fn what_the_device_cannot_do_is_left_out_with_the_reason() {
        let (choices, _) = available(&[("sm", &[]), ("edsm-x", &[("slots", "4")])]);
        let all = DeviceFeatures { int64_atomics: true, ..DeviceFeatures::default() };
        let (found, left_out) = possible(choices.clone(), all);
        assert_eq!((found.len(), left_out.len()), (2, 0));
        let (found, left_out) = possible(choices, DeviceFeatures::default());
        assert_eq!(found.iter().map(label).collect::<Vec<_>>(), ["sm"]);
        assert!(
            left_out.len() == 1 && left_out[0].starts_with("edsm-x slots=4 (the device has no 64-bit"),
            "{left_out:?}"
        );
    }

    #[test]
    fn means_leave_out_what_is_not_there() {
        assert_eq!(mean([Some(1.0), None, Some(2.0)]), Some(1.5));
        assert_eq!(mean([None]), None);
    }
}
