//! Tests that make every pass of every technique fail once.

use super::*;
use crate::host::{Host, HostDesc};
use crate::scene::{RenderDesc, Renderer, fit, load_bytes, shipped};
use crate::view::look_at;
use crate::{Handoff, Inputs};
use glam::{DVec3, dvec3};

const SIZE: [u32; 2] = [64, 48];

/// Settings that make more passes run, or more results be kept.
const MORE: &[(&str, &[(&str, &str)])] = &[
    ("pcf", &[("width", "15"), ("skip", "tiles")]),
    ("sssm", &[("generation", "raster")]),
    ("edsm-x", &[("generation", "raster"), ("border", "2")]),
];

/// Records a frame in which the pass after the first `after` passes fails. Returns the text of the error, if there was
/// one. A frame with an error is submitted or discarded.
fn fail(
    host: &Host,
    technique: &mut dyn Technique,
    inputs: &Inputs<'_>,
    after: u32,
    submitted: bool,
) -> Option<String> {
    let mut error = None;
    let result: Result<()> = host.run(|cmd| {
        // SAFETY: `cmd` is recording, and is waited for or discarded.
        let mut frame = unsafe { Frame::begin(host.context(), cmd, Handoff::FRAGMENT_SAMPLED, None) };
        frame.passes_left = Some(after);
        error = technique.record(&mut frame, inputs).err().map(|e| e.to_string());
        match submitted || error.is_none() {
            true => {
                frame.finish(technique.output());
                Ok(())
            }
            false => Err(Error::Usage("thrown away".into())),
        }
    });
    assert_eq!(result.is_ok(), submitted || error.is_none());
    error
}

fn picture(host: &Host, technique: &mut dyn Technique, inputs: &Inputs<'_>) -> Vec<f32> {
    assert_eq!(fail(host, technique, inputs, u32::MAX, true), None);
    host.read_values(technique.output()).unwrap()
}

#[test]
fn an_error_at_any_pass_leaves_nothing_behind() {
    let host = Host::new(&HostDesc { validation: true, ..HostDesc::default() }).unwrap();
    let messages = host.messages().clone();
    {
        let found = &shipped::ALL[0];
        let scene = load_bytes(found.name, found.bytes).unwrap();
        let camera = scene.cameras.first().cloned().unwrap_or_else(|| fit::camera(&scene, SIZE)).view(SIZE);
        let renderer = |eye: DVec3| {
            let mut light = fit::light(&scene);
            light.world_from_light = look_at(eye, DVec3::ZERO);
            let desc = RenderDesc { size: SIZE, map_size: 64, output: OutputFormat::R32, ..RenderDesc::default() };
            let mut r = Renderer::new(&host, &scene, camera, &light, desc).unwrap();
            let mut any = r.prepare("sm", &Params::new(&filtering::sm::INFO)).unwrap();
            r.frame(any.as_mut()).unwrap();
            r
        };
        // The casters of both renderers must have the same version, so only the light tells their inputs apart.
        let (first, second) = (renderer(dvec3(3.0, 5.0, 2.0)), renderer(dvec3(-3.0, 5.0, 1.0)));
        let all = ALL.iter().filter(|t| matches!(t.kind, Kind::RealTime(_))).map(|t| (t.id, &[][..]));
        let mut failures = 0;
        for (id, settings) in all.chain(MORE.iter().copied()) {
            let params = Params::parse(find(id).unwrap(), settings.iter().copied()).unwrap();
            let expected = picture(&host, first.prepare(id, &params).unwrap().as_mut(), &second.inputs());
            let mut technique = first.prepare(id, &params).unwrap();
            let stale = picture(&host, technique.as_mut(), &first.inputs());
            assert!(stale.iter().zip(&expected).filter(|(a, b)| a != b).count() > 20, "{id}: the lights tell nothing");
            let mut technique = first.prepare(id, &params).unwrap();
            let mut after = 0;
            loop {
                // A frame with another light, so that the next frame must update everything. The first round omits it,
                // to test a technique that has never run.
                if after > 0 {
                    picture(&host, technique.as_mut(), &first.inputs());
                }
                let submitted = after % 2 == 1;
                let Some(error) = fail(&host, technique.as_mut(), &second.inputs(), after, submitted) else { break };
                assert!(error.contains("fails for a test"), "{error}");
                let seen = picture(&host, technique.as_mut(), &second.inputs());
                let wrong = seen.iter().zip(&expected).filter(|(a, b)| a != b).count();
                // The order in which edsm-x chains edges varies, and two edges may tie at a pixel. A stale result would
                // show another light's picture, with far more differences.
                let chance = if id == "edsm-x" { 2 } else { 0 };
                assert!(wrong <= chance, "{id} {settings:?}: {wrong} pixels differ after an error at pass {after}");
                after += 1;
            }
            assert!(after > 0, "{id}: no pass failed");
            failures += after;
        }
        println!("{failures} passes failed");
    }
    drop(host);
    assert_eq!(messages.all(), [""; 0]);
}
