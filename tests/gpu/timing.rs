//! Frames split into one submission per pass, as the host's clock needs them.

use crate::common::{assert_same_bits, desc, messages_of_host, prepare, renderer, shipped_scene};
use edgeshade::host::{HostDesc, Timing};
use edgeshade::scene::RenderDesc;
use edgeshade::technique::Technique;
use edgeshade::timing::{FrameTiming, Timings};

const SIZE: [u32; 2] = [96, 64];

/// Techniques that cover dispatches, indirect dispatches, fills and tile counts; raster passes with stencil; geometry
/// shaders and 64-bit atomics.
const TECHNIQUES: [&str; 4] = ["pcf", "rbsm-star", "shadow-volumes", "edsm-x"];

/// Returns visibility and figures of two frames of every technique that the device supports. Validation must be
/// silent.
fn frames(timing: Timing) -> Vec<(&'static str, Vec<f32>, FrameTiming)> {
    let mut found = vec![];
    let messages = messages_of_host(HostDesc { timing: Some(timing), ..HostDesc::default() }, |host| {
        assert_eq!(host.timing(), timing);
        let statistics = host.context().features().pipeline_statistics;
        let mut renderer = renderer(host, &shipped_scene("jenga"), RenderDesc { statistics, ..desc(SIZE, 128) });
        for id in TECHNIQUES {
            if !edgeshade::technique::find(id).unwrap().needs.iter().all(|n| n.is_met(host.context().features())) {
                eprintln!("skipped: {id}: the device lacks what it needs");
                continue;
            }
            let mut technique: Box<dyn Technique> = prepare(&renderer, id, &[]);
            renderer.frame(technique.as_mut()).unwrap();
            let frame = renderer.frame(technique.as_mut()).unwrap();
            found.push((id, renderer.visibility(technique.as_ref()).unwrap(), frame));
        }
        assert_eq!(host.timing(), timing);
    });
    assert!(messages.is_empty(), "validation:\n{}", messages.join("\n"));
    found
}

#[test]
fn frames_cut_into_passes_are_the_same_frames() {
    let (whole, cut) = (frames(Timing::Timestamps), frames(Timing::Wall));
    assert!(!whole.is_empty() && whole.len() == cut.len());
    for ((id, expected, whole), (_, got, cut)) in whole.iter().zip(&cut) {
        assert_same_bits(expected, got, id);
        let counted = |f: &FrameTiming| -> Vec<_> {
            f.passes.iter().map(|p| (p.name.clone(), p.tiles, p.counts.clone(), p.statistics)).collect()
        };
        assert!(whole.passes.len() > 3, "{id}");
        assert_eq!(counted(whole), counted(cut), "{id}");
        let sum: f64 = cut.passes.iter().map(|p| p.gpu_ms).sum();
        assert!(cut.passes.iter().all(|p| p.gpu_ms > 0.0) && cut.total_gpu_ms >= sum, "{id}");
    }
}

#[test]
fn the_first_frame_is_repeated_until_the_clock_is_known() {
    let messages = messages_of_host(HostDesc { timing: None, ..HostDesc::default() }, |host| {
        let mut timings = Timings::new(host.context(), host.queue_family(), 1).unwrap();
        let mut frames = vec![];
        let mut found = vec![];
        for _ in 0..3 {
            let mut count = 0;
            host.frame(&mut timings, |frame| {
                count += 1;
                frame.end();
                Ok(())
            })
            .unwrap();
            frames.push(count);
            found.push(host.timing());
        }
        assert!((2..=3).contains(&frames[0]) && frames[1..] == [1, 1], "{frames:?}");
        assert!(found.iter().all(|f| *f == found[0]), "{found:?}");
    });
    assert!(messages.is_empty(), "validation:\n{}", messages.join("\n"));
}
