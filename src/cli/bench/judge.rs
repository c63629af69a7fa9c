//! Variants of techniques that the suites judge, with renderers and truths for judging them.

use super::record::Field;
use crate::cli::args::TruthArgs;
use crate::cli::report;
use crate::cli::stage::Stage;
use crate::cli::techniques::{self, Choice};
use crate::cli::truth::Tracer;
use edgeshade::host::Host;
use edgeshade::reference::ray_traced::Truth;
use edgeshade::scene::{Light, LightShape, Moving, RenderDesc, Renderer};
use edgeshade::technique::{self, Kind, OutputFormat};
use edgeshade::timing::FrameTiming;
use edgeshade::view::LightView;
use edgeshade::{DeviceFeatures, Result};
use std::collections::BTreeSet;

/// A technique with its settings, as suites measure them.
#[derive(Clone)]
pub struct Variant {
    /// Id and changed settings, to be displayed.
    pub label: String,
    pub choice: Choice,
    /// True if the technique uses no shadow map, so that it is measured once in each scene.
    pub has_no_map: bool,
}

impl Variant {
    pub fn new(choice: Choice) -> Self {
        let label = match choice.settings().as_str() {
            "-" => choice.info.id.to_owned(),
            settings => format!("{} {settings}", choice.info.id),
        };
        Self { label, choice, has_no_map: false }
    }

    /// Technique and settings as written to the JSON.
    pub fn fields(&self) -> [(&'static str, Field); 2] {
        let Choice { info, params } = &self.choice;
        [("technique", info.id.into()), ("params", report::params(info, params).into())]
    }
}

/// Supported variants, and those that are left out.
#[derive(Default)]
pub struct Variants {
    pub found: Vec<Variant>,
    pub left_out: Vec<String>,
}

/// Ids of all real-time techniques.
pub fn real_time() -> impl Iterator<Item = &'static str> {
    technique::ALL.iter().filter(|t| matches!(t.kind, Kind::RealTime(_))).map(|t| t.id)
}

/// Splits a list of techniques in the syntax of the command line, such as `sm pcf:width=15,skip=off`, into those that
/// the registry has and those that are left out, with the reason if it is a setting.
pub fn available(wanted: &str) -> Variants {
    let mut variants = Variants::default();
    for text in wanted.split_whitespace() {
        let (id, label) = (text.split(':').next().unwrap_or(text), text.replace([':', ','], " "));
        match techniques::parse(&[text.to_owned()], None) {
            Ok(choices) => variants.found.extend(choices.into_iter().map(Variant::new)),
            Err(_) if technique::find(id).is_err() => variants.left_out.push(label),
            Err(e) => variants.left_out.push(format!("{label} ({e})")),
        }
    }
    variants
}

/// Leaves out variants that the device does not support, with the reason.
pub fn possible(Variants { found, mut left_out }: Variants, device: DeviceFeatures) -> Variants {
    let missing = |v: &Variant| v.choice.info.needs.iter().find(|n| !n.is_met(device));
    left_out
        .extend(found.iter().filter_map(|v| Some(format!("{} (the device has no {})", v.label, missing(v)?.text()))));
    Variants { found: found.into_iter().filter(|v| missing(v).is_none()).collect(), left_out }
}

/// Marks variants that use no shadow map.
pub fn mapless(mut variants: Variants) -> Variants {
    let is_mapless = |id| matches!(id, "shadow-volumes" | "exact-hard");
    variants.found.iter_mut().for_each(|v| v.has_no_map = is_mapless(v.choice.info.id));
    variants
}

/// A page's note about the variants left out; empty if there are none.
pub fn left_out_note(left_out: &[String]) -> String {
    if left_out.is_empty() {
        return String::new();
    }
    format!("Left out because they are not supported: {}.\n\n", left_out.join(", "))
}

/// Variants that are judged in addition to the defaults, if the registry has them.
const BESIDE: &str = "pcf:width=3 rbsm-profile:quality=run rbsm-profile:quality=neighbours rbsm-profile:quality=line rpcf:width=7 \
     rpcf:preset=published,width=7";

/// Techniques that are not judged, because their images equal those of `rbsm`, `rbsm-filtered` and `rbsm-star` bit for
/// bit.
const SAME: [&str; 2] = ["rbsm-branches", "rbsm-listings"];

/// Every real-time technique at its defaults and as published, and the additional variants, in the registry's order and
/// without duplicates.
pub fn contenders() -> Result<Variants> {
    let mut found: Vec<Variant> = vec![];
    for text in real_time().filter(|id| !SAME.contains(id)).chain(BESIDE.split_whitespace()) {
        let choices = available(text).found.into_iter().map(|v| v.choice).collect();
        found.extend(techniques::with_published(choices)?.into_iter().map(Variant::new));
    }
    found.sort_by_key(|v| technique::ALL.iter().position(|t| t.id == v.choice.info.id));
    let mut labels = BTreeSet::new();
    found.retain(|v| labels.insert(v.label.clone()));
    Ok(Variants { found, left_out: vec![] })
}

/// True if all texels are compared with one fixed depth.
pub fn is_fixed(choice: &Choice) -> bool {
    choice.params.show().iter().any(|(name, value)| *name == "receiver" && value == "fixed")
}

/// The same light without size, so that its shadows are hard.
pub fn hard(light: &Light) -> Light {
    let shape = match light.shape {
        LightShape::Spot { outer, .. } => LightShape::Spot { outer, size: Some(0.0) },
        LightShape::Directional { .. } => LightShape::Directional { angle: Some(0.0) },
    };
    Light { shape, ..light.clone() }
}

/// Renderer for measurements: it writes visibility as `f32`, and redraws the shadow map only when something has
/// moved.
pub fn renderer<'h>(host: &'h Host, stage: &Stage, size: [u32; 2], map_size: u32) -> Result<Renderer<'h>> {
    let desc =
        RenderDesc { size, map_size, output: OutputFormat::R32, moving: Moving::Camera, ..RenderDesc::default() };
    Renderer::new(host, &stage.scene, stage.camera, &stage.light, desc)
}

/// Makes a tracer for the stage; truths are kept in the usual cache.
pub fn tracer<'a>(stage: &'a Stage, light: &LightView, size: [u32; 2]) -> Tracer<'a> {
    Tracer::new(stage, light, size, &TruthArgs { samples: None, cache: None })
}

/// Visibility of one frame, with the times and counts of its passes.
pub fn frame(renderer: &mut Renderer<'_>, choice: &Choice) -> Result<(Vec<f32>, FrameTiming)> {
    let mut technique = renderer.prepare(choice.info.id, &choice.params)?;
    let timing = renderer.frame(technique.as_mut())?;
    Ok((renderer.visibility(technique.as_ref())?, timing))
}

/// Visibility of one frame.
pub fn visibility(renderer: &mut Renderer<'_>, choice: &Choice) -> Result<Vec<f32>> {
    Ok(frame(renderer, choice)?.0)
}

/// Mask of the judged pixels in the renderer's current view.
pub fn mask(host: &Host, renderer: &mut Renderer<'_>, truth: &Truth) -> Result<Vec<bool>> {
    renderer.shade_with(&truth.visibility)?;
    Ok(truth.judged(&host.read_image::<u32>(&renderer.gbuffer().triangle)?))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_technique_is_judged_and_none_twice() {
        let names: Vec<_> = contenders().unwrap().found.into_iter().map(|v| v.label).collect();
        for id in real_time().filter(|id| !SAME.contains(id)) {
            assert!(names.iter().any(|n| n == id), "{id}: {names:?}");
        }
        for (i, name) in names.iter().enumerate() {
            assert!(!names[..i].contains(name), "{names:?}");
        }
    }

    #[test]
    fn what_is_not_there_is_left_out_and_named() {
        let Variants { found, left_out } = available("sm none:a=1 pcf:width=15 pcf:no=1");
        assert_eq!(found.into_iter().map(|v| v.label).collect::<Vec<_>>(), ["sm", "pcf width=15"]);
        assert!(left_out.len() == 2 && left_out[0] == "none a=1", "{left_out:?}");
        assert!(left_out[1].starts_with("pcf no=1 (") && left_out[1].len() > 20, "{left_out:?}");
        assert_eq!(left_out_note(&[]), "");
        assert!(left_out_note(&left_out).contains("none a=1, pcf no=1 ("));
    }

    #[test]
    fn what_the_device_cannot_do_is_left_out_with_the_reason() {
        let wanted = "sm edsm-x:slots=4";
        let all = DeviceFeatures { int64_atomics: true, ..DeviceFeatures::default() };
        let Variants { found, left_out } = possible(available(wanted), all);
        assert_eq!((found.len(), left_out.len()), (2, 0));
        let Variants { found, left_out } = possible(available(wanted), DeviceFeatures::default());
        assert_eq!(found.into_iter().map(|v| v.label).collect::<Vec<_>>(), ["sm"]);
        assert!(
            left_out.len() == 1 && left_out[0].starts_with("edsm-x slots=4 (the device has no 64-bit"),
            "{left_out:?}"
        );
    }
}
