//! Data that a technique keeps from frame to frame belongs to one light and one map. It is not used if the commands
//! that made it never ran.

use super::every_technique;
use crate::common::{assert_same_bits, desc, messages_of, prepare, renderer, with_gpu};
use crate::made::{self, spot, still_life, sun};
use crate::noise::visibility_of;
use edgeshade::host::Host;
use edgeshade::scene::{Light, LightShape, Renderer, light_view};
use edgeshade::technique::{Technique, find};
use edgeshade::{Error, Frame, Handoff, Inputs};
use glam::{DVec3, dvec3};

const SIZE: [u32; 2] = [120, 80];
const MAP: u32 = 160;
/// Same version for all lights.
const VERSION: Option<u64> = Some(7);

/// Area lights, for which the soft techniques search blockers.
fn lights() -> [Light; 3] {
    let lamp = |eye| Light { shape: LightShape::Spot { outer: 0.6, size: Some(0.3) }, ..spot(eye, DVec3::ZERO, 0.6) };
    let day = sun(dvec3(1.0, 1.5, 1.5));
    [
        lamp(dvec3(3.0, 7.0, 2.0)),
        lamp(dvec3(-4.0, 6.0, 3.0)),
        Light { shape: LightShape::Directional { angle: Some(0.05) }, ..day },
    ]
}

/// Returns a renderer whose map and G-buffer are drawn.
fn drawn<'h>(host: &'h Host, light: &Light) -> Renderer<'h> {
    let mut r = renderer(host, &still_life(light.clone()), desc(SIZE, MAP));
    let mut any = prepare(&r, "sm", &[]);
    r.frame(any.as_mut()).unwrap();
    r
}

fn inputs<'a>(r: &'a Renderer<'_>) -> Inputs<'a> {
    Inputs { light_version: VERSION, ..r.inputs() }
}

#[test]
fn two_lights_of_one_version_do_not_mix() {
    with_gpu(|host| {
        let renderers = lights().map(|light| drawn(host, &light));
        let mut kept = 0;
        for (id, settings) in every_technique() {
            // Each light with its own technique, from the same casters.
            let alone = [0, 1, 2]
                .map(|i| visibility_of(host, prepare(&renderers[0], id, settings).as_mut(), &inputs(&renderers[i])));
            let mut shared = prepare(&renderers[0], id, settings);
            for i in [0, 1, 0, 2, 1, 1] {
                let seen = visibility_of(host, shared.as_mut(), &inputs(&renderers[i]));
                assert_same_bits(&alone[i], &seen, &format!("{id} {settings:?}, light {i}"));
            }
            let other = (0..seen_pixels()).filter(|&i| alone[0][i] != alone[1][i]).count();
            assert!(other > 200, "{id} {settings:?}: the lights' pictures differ in {other} pixels only");
            kept += 1;
        }
        println!("{kept} techniques and settings");
    });
}

fn seen_pixels() -> usize {
    (SIZE[0] * SIZE[1]) as usize
}

/// An engine may draw all its lights into one image, so the handle does not identify the light.
#[test]
fn two_lights_in_one_image_do_not_mix() {
    with_gpu(|host| {
        let [a, b, _] = lights();
        let scene = still_life(a.clone());
        let mut r = drawn(host, &a);
        let all: Vec<_> = every_technique().collect();
        let mut shared: Vec<_> = all.iter().map(|(id, settings)| prepare(&r, id, settings)).collect();
        for technique in &mut shared {
            visibility_of(host, technique.as_mut(), &inputs(&r));
        }
        r.set_light(&scene, light_view(&scene, &b));
        let mut any = prepare(&r, "sm", &[]);
        r.frame(any.as_mut()).unwrap();
        for ((id, settings), technique) in all.iter().zip(&mut shared) {
            let seen = visibility_of(host, technique.as_mut(), &inputs(&r));
            let fresh = visibility_of(host, prepare(&r, id, settings).as_mut(), &inputs(&r));
            assert_same_bits(&fresh, &seen, &format!("{id} {settings:?}"));
        }
    });
}

const SAMPLED: Handoff = Handoff::FRAGMENT_SAMPLED;

/// Records a frame and discards the command buffer; the frame is either finished or dropped before.
fn throw_away(host: &Host, technique: &mut dyn Technique, inputs: &Inputs<'_>, finished: bool) {
    let thrown: edgeshade::Result<()> = host.run(|cmd| {
        // SAFETY: `cmd` is recording, and is never submitted.
        let mut frame = unsafe { Frame::begin(host.context(), cmd, SAMPLED, None) };
        technique.record(&mut frame, inputs)?;
        if finished {
            frame.finish(technique.output());
        }
        Err(Error::Usage("thrown away".into()))
    });
    assert_eq!(thrown.unwrap_err().to_string(), "thrown away");
}

/// Submits a frame, which leaves the output as [`SAMPLED`] says.
fn submit(host: &Host, technique: &mut dyn Technique, inputs: &Inputs<'_>) {
    host.run(|cmd| {
        // SAFETY: `cmd` is recording and is waited for.
        let mut frame = unsafe { Frame::begin(host.context(), cmd, SAMPLED, None) };
        technique.record(&mut frame, inputs)?;
        frame.finish(technique.output());
        Ok(())
    })
    .unwrap();
}

#[test]
fn a_command_buffer_that_is_thrown_away_leaves_nothing_behind() {
    with_gpu(|host| {
        let [a, b, _] = lights();
        let (first, second) = (drawn(host, &a), drawn(host, &b));
        for (id, settings) in every_technique() {
            let fresh = visibility_of(host, prepare(&first, id, settings).as_mut(), &inputs(&second));
            for finished in [true, false] {
                let what = format!("{id} {settings:?}, finished: {finished}");
                let mut technique = prepare(&first, id, settings);
                // First the very first frame, then one that follows another light's.
                for _ in 0..2 {
                    throw_away(host, technique.as_mut(), &inputs(&second), finished);
                    if finished {
                        technique.reset();
                    }
                    let seen = visibility_of(host, technique.as_mut(), &inputs(&second));
                    assert_same_bits(&fresh, &seen, &what);
                    submit(host, technique.as_mut(), &inputs(&first));
                }
            }
        }
    });
}

/// The test above can fail: without the reset, the validation layer reports wrong layouts.
#[test]
fn without_the_reset_layouts_are_wrong() {
    let messages = messages_of(|host| {
        let r = drawn(host, &lights()[0]);
        let mut technique = prepare(&r, "sm", &[]);
        throw_away(host, technique.as_mut(), &inputs(&r), true);
        submit(host, technique.as_mut(), &inputs(&r));
    });
    assert!(messages.iter().any(|m| m.contains("layout")), "{messages:?}");
}

/// The technique itself finds an error after its first passes: a transform is missing.
#[test]
fn an_error_half_way_leaves_nothing_behind() {
    with_gpu(|host| {
        let r = drawn(host, &lights()[0]);
        for (id, settings) in every_technique() {
            if !find(id).unwrap().needs.contains(&edgeshade::Need::Casters) {
                continue;
            }
            let fresh = visibility_of(host, prepare(&r, id, settings).as_mut(), &inputs(&r));
            let mut technique = prepare(&r, id, settings);
            let short = Inputs { casters: &r.inputs().casters[1..], ..inputs(&r) };
            // The frame continues and is submitted.
            host.run(|cmd| {
                // SAFETY: `cmd` is recording and is waited for.
                let mut frame = unsafe { Frame::begin(host.context(), cmd, Handoff::default(), None) };
                let error = technique.record(&mut frame, &short).unwrap_err().to_string();
                assert!(error.contains("casters") && error.contains("transforms"), "{error}");
                frame.finish(technique.output());
                Ok(())
            })
            .unwrap();
            let seen = visibility_of(host, technique.as_mut(), &inputs(&r));
            assert_same_bits(&fresh, &seen, id);
        }
    });
}

/// Kept results are not computed again: a second frame with the same light has fewer passes than the first.
#[test]
fn the_same_light_keeps_its_results() {
    with_gpu(|host| {
        let r = drawn(host, &lights()[0]);
        let mut timings = edgeshade::timing::Timings::new(host.context(), host.queue_family(), 1).unwrap();
        for (id, settings) in every_technique() {
            let mut technique = prepare(&r, id, settings);
            let mut passes = || {
                host.run(|cmd| {
                    // SAFETY: `cmd` is recording and is waited for.
                    let mut frame =
                        unsafe { Frame::begin(host.context(), cmd, Handoff::default(), Some(&mut timings)) };
                    technique.record(&mut frame, &inputs(&r))?;
                    frame.finish(technique.output());
                    Ok(())
                })
                .unwrap();
                let frame = timings.poll().pop().unwrap();
                frame.passes.into_iter().map(|p| p.name).collect::<Vec<_>>()
            };
            let (first, second) = (passes(), passes());
            let once: Vec<_> = first.iter().filter(|name| !second.contains(name)).collect();
            // On a CPU device these decide tiles by depth bounds of the map.
            let by_tiles = (id == "rpcf" || id.starts_with("edts")) && host.info().kind == "cpu";
            let keeps = KEEPING.contains(&id) || by_tiles || !settings.is_empty();
            assert_eq!(!once.is_empty(), keeps, "{id} {settings:?}: only in the first frame: {once:?}");
        }
    });
}

/// A picture is kept if nothing has changed since the frame before, and made anew after any change.
#[test]
fn an_unchanged_frame_keeps_its_picture() {
    with_gpu(|host| {
        let [a, b, _] = lights();
        let scene = still_life(a.clone());
        let mut r = drawn(host, &a);
        let other = drawn(host, &b);
        let here = *r.camera();
        let all: Vec<_> = every_technique().collect();
        let mut techniques: Vec<_> = all.iter().map(|(id, settings)| prepare(&r, id, settings)).collect();
        let version = |camera_version| Inputs { camera_version: Some(camera_version), ..inputs(&r) };
        let first: Vec<_> = techniques.iter_mut().map(|t| visibility_of(host, t.as_mut(), &version(1))).collect();
        // Depth and normals change, but the caller does not say so.
        let there = made::perspective(dvec3(1.5, 4.0, 6.0), DVec3::ZERO, 0.1).view(SIZE);
        r.set_camera(&scene, there).unwrap();
        r.frame(prepare(&r, "sm", &[]).as_mut()).unwrap();
        let unsaid = Inputs { camera: &here, camera_version: Some(1), ..inputs(&r) };
        let changes = [
            ("version", Inputs { camera_version: Some(2), ..unsaid }),
            ("no version", Inputs { camera_version: None, ..unsaid }),
            ("camera", Inputs { camera: r.camera(), ..unsaid }),
            ("normals", Inputs { normal: None, ..unsaid }),
            ("images", Inputs { depth: other.inputs().depth, normal: other.inputs().normal, ..unsaid }),
            ("light's version", Inputs { light_version: Some(8), ..unsaid }),
            ("light", Inputs { light: other.inputs().light, ..unsaid }),
            ("map", Inputs { shadow_map: other.inputs().shadow_map, ..unsaid }),
        ];
        for (((id, settings), technique), first) in all.iter().zip(&mut techniques).zip(first) {
            let kept = visibility_of(host, technique.as_mut(), &unsaid);
            assert_same_bits(&first, &kept, &format!("{id} {settings:?}: kept"));
            for (what, changed) in &changes {
                let mut technique = prepare(&r, id, settings);
                visibility_of(host, technique.as_mut(), &unsaid);
                let fresh = visibility_of(host, prepare(&r, id, settings).as_mut(), changed);
                let seen = visibility_of(host, technique.as_mut(), changed);
                assert_same_bits(&fresh, &seen, &format!("{id} {settings:?}: another {what}"));
            }
            let fresh = visibility_of(host, prepare(&r, id, settings).as_mut(), &changes[0].1);
            assert!(fresh != first, "{id} {settings:?}: the pictures are the same");
            let seen = visibility_of(host, technique.as_mut(), &changes[0].1);
            assert_same_bits(&fresh, &seen, &format!("{id} {settings:?}: made anew"));
        }
    });
}

/// The image of a frame that was dropped has no known layout, so its picture is made anew.
#[test]
fn a_dropped_frame_forgets_the_kept_picture() {
    with_gpu(|host| {
        let r = drawn(host, &lights()[0]);
        let still = Inputs { camera_version: Some(1), ..inputs(&r) };
        let mut timings = edgeshade::timing::Timings::new(host.context(), host.queue_family(), 1).unwrap();
        for (id, settings) in every_technique() {
            let mut technique = prepare(&r, id, settings);
            let mut passes = |technique: &mut dyn Technique| {
                host.run(|cmd| {
                    // SAFETY: `cmd` is recording and is waited for.
                    let mut frame = unsafe { Frame::begin(host.context(), cmd, SAMPLED, Some(&mut timings)) };
                    technique.record(&mut frame, &still)?;
                    frame.finish(technique.output());
                    Ok(())
                })
                .unwrap();
                timings.poll().iter().map(|frame| frame.passes.len()).sum::<usize>()
            };
            let first = passes(technique.as_mut());
            assert!(first > 0, "{id} {settings:?}");
            assert_eq!(passes(technique.as_mut()), 0, "{id} {settings:?}: nothing has changed");
            throw_away(host, technique.as_mut(), &still, false);
            assert!(passes(technique.as_mut()) > 0, "{id} {settings:?}: a frame was dropped");
            let fresh = visibility_of(host, prepare(&r, id, settings).as_mut(), &still);
            assert_same_bits(&fresh, &host.read_values(technique.output()).unwrap(), &format!("{id} {settings:?}"));
        }
    });
}

/// Techniques that keep data by default.
const KEEPING: &[&str] = &[
    "vsm",
    "evsm",
    "msm",
    "pcss",
    "vssm",
    "mssm",
    "rbssm",
    "rbssm-naive",
    "ssabss",
    "ssrbssm",
    "edtssm",
    "edtssm-star",
    "soft-auto",
    "shadow-volumes",
    "sssm",
    "edsm",
    "edsm-x",
    "exact-hard",
    "exact-soft",
];
