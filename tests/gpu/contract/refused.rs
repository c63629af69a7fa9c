//! Inputs that would silently give a wrong picture are errors that name the input and the remedy.

use super::every_technique;
use crate::common::{desc, prepare, renderer, with_gpu};
use crate::made::{still_life, sun};
use crate::noise::{FlatReceiver, IMAGE, MAP, Noise};
use ash::vk::{self, Format, SampleCountFlags};
use edgeshade::casters::{CasterMesh, Casters, VertexBuffer, Vertices};
use edgeshade::host::Host;
use edgeshade::technique::{self, OutputFormat, Params, Setup, Technique};
use edgeshade::view::{CameraView, DepthRange, LightKind, LightView, look_at};
use edgeshade::{Context, ContextDesc, DeviceFeatures, Frame, Handoff, ImageRef, Inputs, NormalEncoding};
use glam::{DAffine3, DMat3, DMat4, DVec3, dvec3, dvec4};
use std::ffi::CStr;

/// Records a frame and returns the technique's result. Nothing is submitted after an error.
fn outcome(host: &Host, technique: &mut dyn Technique, inputs: &Inputs<'_>) -> Result<(), String> {
    host.run(|cmd| {
        // SAFETY: `cmd` is recording; the host waits for it, or discards it after an error.
        let mut frame = unsafe { Frame::begin(host.context(), cmd, Handoff::default(), None) };
        technique.record(&mut frame, inputs)?;
        frame.finish(technique.output());
        Ok(())
    })
    .map_err(|e| e.to_string())
}

/// Panics unless the inputs are rejected with all these words.
fn refused(host: &Host, technique: &mut dyn Technique, inputs: &Inputs<'_>, words: &[&str]) {
    let error = outcome(host, technique, inputs).expect_err(&format!("accepted, though {words:?}"));
    assert!(words.iter().all(|w| error.contains(w)), "{error:?} lacks some of {words:?}");
}

fn sm(host: &Host) -> Box<dyn Technique> {
    let params = Params::new(technique::find("sm").unwrap());
    let setup =
        Setup { extent: IMAGE, map_size: MAP, output: OutputFormat::R8, params, intermediates: false, casters: None };
    technique::prepare("sm", host.context(), &setup).unwrap()
}

/// Change to an image, and words of the error that it must cause.
type Mistake<'a> = (&'a dyn Fn(&mut ImageRef), &'a [&'a str]);

#[test]
fn images_that_cannot_be_read_as_depth() {
    with_gpu(|host| {
        let map = Noise::new(3, [4, 4]).upload(host, true);
        let flat = FlatReceiver::new(host);
        let good = flat.inputs(&map);
        let mut t = sm(host);
        let with = |image: ImageRef, change: &dyn Fn(&mut ImageRef)| {
            let mut image = image;
            change(&mut image);
            image
        };
        let wrong: &[Mistake<'_>] = &[
            (&|i| i.format = Format::R8G8B8A8_UNORM, &["R8G8B8A8_UNORM", "allowed", "D32_SFLOAT", "D16_UNORM"]),
            (&|i| i.format = Format::R16_SFLOAT, &["R16_SFLOAT", "allowed"]),
            (&|i| i.format = Format::S8_UINT, &["S8_UINT", "allowed"]),
            (&|i| i.format = Format::UNDEFINED, &["UNDEFINED", "allowed"]),
            (&|i| i.samples = SampleCountFlags::TYPE_4, &["4 samples", "resolve", "sample 0"]),
            (&|i| i.samples = SampleCountFlags::empty(), &["ImageRef::samples", "TYPE_1"]),
            (&|i| i.extent[0] += 1, &["prepared for", "Setup"]),
            (&|i| i.extent[1] -= 1, &["prepared for", "Setup"]),
            (&|i| i.layers = 0, &["ImageRef::layers"]),
            (&|i| i.layout = vk::ImageLayout::UNDEFINED, &["layout UNDEFINED", "barrier"]),
            (&|i| i.image = vk::Image::null(), &["null"]),
            (&|i| i.view = vk::ImageView::null(), &["null"]),
        ];
        for (change, words) in wrong {
            let words = |input| [&["sm: ", input][..], words].concat();
            let inputs = Inputs { depth: with(good.depth, change), ..good };
            refused(host, t.as_mut(), &inputs, &words("input depth"));
            let inputs = Inputs { shadow_map: with(good.shadow_map, change), ..good };
            refused(host, t.as_mut(), &inputs, &words("input shadow_map"));
            let normal = with(ImageRef { format: Format::R16G16_SNORM, ..good.depth }, change);
            let inputs = Inputs { normal: Some((normal, NormalEncoding::OctahedralSigned)), ..good };
            let (error, wanted) = (outcome(host, t.as_mut(), &inputs).unwrap_err(), words("input normal"));
            // Normals may have other formats than depth.
            let wanted = wanted.iter().filter(|w| !w.starts_with('D'));
            assert!(wanted.clone().all(|w| error.contains(w)), "{error:?} lacks some of {wanted:?}");
        }
        for (encoding, format) in [
            (NormalEncoding::OctahedralSigned, Format::R8G8_UNORM),
            (NormalEncoding::OctahedralUnsigned, Format::R16G16_SNORM),
            (NormalEncoding::Cartesian, Format::R16G16_SFLOAT),
        ] {
            let normal = ImageRef { format, ..good.depth };
            let inputs = Inputs { normal: Some((normal, encoding)), ..good };
            refused(host, t.as_mut(), &inputs, &["input normal", &format!("{format:?}"), "allowed"]);
        }
        assert_eq!(outcome(host, t.as_mut(), &good), Ok(()));
    });
}

fn reversed(m: DMat4) -> DMat4 {
    // z' = w - z.
    let flip = DMat4::from_cols(
        dvec4(1.0, 0.0, 0.0, 0.0),
        dvec4(0.0, 1.0, 0.0, 0.0),
        dvec4(0.0, 0.0, -1.0, 0.0),
        dvec4(0.0, 0.0, 1.0, 1.0),
    );
    flip * m
}

#[test]
fn lights_that_contradict_themselves() {
    with_gpu(|host| {
        let map = Noise::new(3, [4, 4]).upload(host, true);
        let flat = FlatReceiver::new(host);
        let good = flat.inputs(&map);
        let mut t = sm(host);
        let eye = look_at(dvec3(1.0, 5.0, 2.0), DVec3::ZERO);
        let spot = LightView::spot(eye, 0.8, 0.5, 30.0, 0.3);
        let sun = LightView::directional(eye, [3.0, 4.0], 0.5, 30.0, 0.01);
        for light in [spot, sun] {
            assert_eq!(outcome(host, t.as_mut(), &Inputs { light: &[light], ..good }), Ok(()));
        }
        // A map with an infinite far plane, and an off-axis map.
        let mut endless = spot;
        (endless.clip_from_view.z_axis.z, endless.clip_from_view.w_axis.z) = (-1.0, -0.5);
        let mut aside = spot;
        aside.clip_from_view.z_axis.x = 0.3;
        for light in [endless, aside] {
            assert_eq!(outcome(host, t.as_mut(), &Inputs { light: &[light], ..good }), Ok(()));
        }

        let clip = |light: LightView, m: DMat4| LightView { clip_from_view: m, ..light };
        let placed = |light: LightView, m: DAffine3| LightView { world_from_view: m, ..light };
        let kind = |light: LightView, kind| LightView { kind, ..light };
        let size = |size| kind(spot, LightKind::Spot { size });
        let angle = |angle| kind(sun, LightKind::Directional { angle });
        let scaled = |s: DVec3| DAffine3 { matrix3: eye.matrix3 * DMat3::from_diagonal(s), ..eye };
        let set = |m: DMat4, column: usize, row: usize, value: f64| {
            let mut m = m;
            m.col_mut(column)[row] = value;
            m
        };
        let mut wrong: Vec<(LightView, &[&str])> = vec![
            (kind(spot, sun.kind), &["kind is Directional", "perspective", "LightKind::Spot"]),
            (kind(sun, spot.kind), &["kind is Spot", "parallel", "LightKind::Directional"]),
            (size(f64::NAN), &["size NaN", "0"]),
            (size(-1.0), &["size -1", "0"]),
            (size(f64::INFINITY), &["size inf"]),
            (angle(f64::NAN), &["angle NaN", "radians"]),
            (angle(-0.1), &["angle -0.1", "radians"]),
            (angle(std::f64::consts::PI), &["angle 3.14", "less than pi"]),
        ];
        for light in [spot, sun] {
            let m = light.clip_from_view;
            let turned = LightView { depth: DepthRange::Reversed, ..clip(light, reversed(m)) };
            let lie = LightView { depth: DepthRange::Reversed, ..light };
            wrong.extend([
                (turned, &["not supported", "DepthRange::Standard", "render the map"] as &[&str]),
                (lie, &["stated as Reversed", "grows", "DepthRange::Standard"]),
                (clip(light, reversed(m)), &["stated as Standard", "falls", "project the other way"]),
                (clip(light, DMat4::ZERO), &["clip_from_view", "no inverse"]),
                (clip(light, set(m, 0, 0, 0.0)), &["clip_from_view", "no inverse"]),
                (clip(light, set(m, 1, 1, f64::NAN)), &["clip_from_view", "not finite"]),
                (clip(light, set(m, 3, 2, f64::INFINITY)), &["clip_from_view", "not finite"]),
                (clip(light, set(m, 0, 0, 1e60)), &["clip_from_view", "no inverse"]),
                (clip(light, -1.0 * m), &["clip_from_view", "last row"]),
                (clip(light, set(m, 0, 3, 0.1)), &["clip_from_view", "last row"]),
                (clip(light, 2.0 * m), &["2 times a projection", "divide"]),
                (clip(light, set(m, 1, 2, 0.1)), &["near plane", "right angles"]),
                (placed(light, scaled(DVec3::ZERO)), &["world_from_view", "rigid"]),
                (placed(light, scaled(DVec3::splat(2.0))), &["world_from_view", "rigid", "scale"]),
                (placed(light, scaled(dvec3(-1.0, 1.0, 1.0))), &["world_from_view", "mirroring"]),
                (placed(light, scaled(DVec3::splat(f64::NAN))), &["world_from_view", "not finite"]),
                (placed(light, DAffine3 { translation: DVec3::INFINITY, ..eye }), &["world_from_view", "not finite"]),
            ]);
        }
        // Depth 0 behind the light.
        wrong.push((clip(spot, set(set(spot.clip_from_view, 2, 2, 0.5), 3, 2, -0.5)), &["near plane", "in front"]));
        for (light, words) in &wrong {
            let words = [&["input light"][..], words].concat();
            refused(host, t.as_mut(), &Inputs { light: &[*light], ..good }, &words);
        }
        refused(host, t.as_mut(), &Inputs { light: &[], ..good }, &["input light", "give one"]);
        refused(host, t.as_mut(), &Inputs { light: &[spot, sun], ..good }, &["input light", "more than one"]);
        println!("{} lights refused", wrong.len());
    });
}

#[test]
fn cameras_that_contradict_themselves() {
    with_gpu(|host| {
        let map = Noise::new(3, [4, 4]).upload(host, true);
        let flat = FlatReceiver::new(host);
        let good = flat.inputs(&map);
        let mut t = sm(host);
        let eye = look_at(dvec3(1.0, 5.0, 2.0), DVec3::ZERO);
        let perspective = CameraView::perspective(eye, 0.9, 1.5, 0.1);
        let parallel = CameraView::orthographic(eye, [3.0, 2.0], 0.1, 50.0);
        let standard =
            |c: CameraView| CameraView { depth: DepthRange::Standard, clip_from_view: reversed(c.clip_from_view), ..c };
        // Cameras as engines have them: both depth ranges, jitter, an oblique near plane, a scaled matrix.
        let mut jittered = perspective;
        (jittered.clip_from_view.z_axis.x, jittered.clip_from_view.z_axis.y) = (1e-3, -2e-3);
        let mut oblique = perspective;
        (oblique.clip_from_view.x_axis.z, oblique.clip_from_view.z_axis.z) = (0.2, 0.4);
        let double = CameraView { clip_from_view: 2.0 * perspective.clip_from_view, ..perspective };
        for camera in [perspective, parallel, standard(perspective), standard(parallel), jittered, oblique, double] {
            assert_eq!(outcome(host, t.as_mut(), &Inputs { camera: &camera, ..good }), Ok(()), "{camera:?}");
        }
        for camera in [perspective, parallel] {
            let clip = |m: DMat4| CameraView { clip_from_view: m, ..camera };
            let placed = |m: DMat3| CameraView { world_from_view: DAffine3 { matrix3: m, ..eye }, ..camera };
            let other = CameraView { depth: DepthRange::Standard, ..camera };
            let wrong: &[(CameraView, &[&str])] = &[
                (other, &["stated as Standard", "falls", "DepthRange::Reversed"]),
                (clip(reversed(camera.clip_from_view)), &["stated as Reversed", "grows", "DepthRange::Standard"]),
                (clip(DMat4::ZERO), &["no inverse"]),
                (clip(DMat4::NAN), &["not finite"]),
                (clip(-1.0 * camera.clip_from_view), &["last row"]),
                (placed(DMat3::ZERO), &["rigid"]),
                (placed(1.1 * eye.matrix3), &["rigid"]),
                (placed(DMat3::NAN), &["not finite"]),
            ];
            for (camera, words) in wrong {
                let words = [&["input camera"][..], words].concat();
                refused(host, t.as_mut(), &Inputs { camera, ..good }, &words);
            }
        }
    });
}

/// Every technique makes these checks.
#[test]
fn every_technique_refuses() {
    with_gpu(|host| {
        let scene = still_life(sun(dvec3(1.0, 2.0, 1.0)));
        let mut r = renderer(host, &scene, desc([64, 48], 64));
        let mut any = prepare(&r, "sm", &[]);
        r.frame(any.as_mut()).unwrap();
        let good = r.inputs();
        let color = ImageRef { format: Format::R8G8B8A8_UNORM, ..good.depth };
        let nan = [LightView { kind: LightKind::Directional { angle: f64::NAN }, ..good.light[0] }];
        let blind = CameraView { clip_from_view: DMat4::ZERO, ..*good.camera };
        for (id, settings) in every_technique() {
            let mut t = prepare(&r, id, settings);
            refused(host, t.as_mut(), &Inputs { depth: color, ..good }, &[id, "input depth", "allowed"]);
            let wide = ImageRef { extent: [65, 64], ..good.shadow_map };
            refused(host, t.as_mut(), &Inputs { shadow_map: wide, ..good }, &[id, "input shadow_map", "prepared"]);
            refused(host, t.as_mut(), &Inputs { light: &nan, ..good }, &[id, "input light", "angle"]);
            refused(host, t.as_mut(), &Inputs { camera: &blind, ..good }, &[id, "input camera", "no inverse"]);
            if technique::find(id).unwrap().needs.contains(&edgeshade::Need::Casters) {
                let mut casters = good.casters.to_vec();
                casters[1].translation.y = f64::NAN;
                let inputs = Inputs { casters: &casters, ..good };
                refused(host, t.as_mut(), &inputs, &[id, "input casters", "instance 1", "not finite"]);
            }
        }
    });
}

#[test]
fn vertex_buffers_that_end_too_early() {
    with_gpu(|host| {
        let positions: Vec<[f32; 3]> = (0..6).map(|i| [i as f32, (i * i) as f32, 1.0]).collect();
        let buffer = host.upload("vertices", vk::BufferUsageFlags::STORAGE_BUFFER, &positions).unwrap();
        let made = |handle, size, stride, first_vertex| {
            // SAFETY: the shaders never run: faulty buffers are rejected, and nothing is recorded with the others.
            let vertices = Vertices::Buffer(unsafe { VertexBuffer::new(handle, size, stride) });
            let mesh = CasterMesh { name: "fan", positions: &positions, indices: &[0, 1, 2, 3, 4, 5], first_vertex };
            Casters::new(host.context(), vertices, &[mesh], &[0], false).map(|_| ()).map_err(|e| e.to_string())
        };
        let (handle, size) = (buffer.handle(), buffer.size());
        assert_eq!(made(handle, size, 12, 0), Ok(()));
        // The last vertex needs only its position.
        assert_eq!(made(handle, 5 * 20 + 12, 20, 0), Ok(()));
        for (handle, size, stride, first, words) in [
            (handle, size, 12, 1, &["fan", "first_vertex", "84", "72"][..]),
            (handle, size, 12, u32::MAX, &["fan", "first_vertex"]),
            (handle, size - 1, 12, 0, &["fan", "size"]),
            (handle, 5 * 20 + 11, 20, 0, &["fan", "stride"]),
            (handle, 0, 12, 0, &["fan", "of 0"]),
            (handle, size, 0, 0, &["stride of 0", "multiple of 4"]),
            (handle, size, 8, 0, &["stride of 8", "12 or more"]),
            (handle, size, 14, 0, &["stride of 14", "multiple of 4"]),
            (handle, 1 << 40, 12, 0, &["storage buffer", "Vertices::Copy"]),
            (vk::Buffer::null(), size, 12, 0, &["null"]),
        ] {
            let error = made(handle, size, stride, first).unwrap_err();
            assert!(words.iter().all(|w| error.contains(w)), "{error:?} lacks some of {words:?}");
        }
    });
}

/// Returns the result of `Context::new` on a device made with an instance of `version` and these extensions.
fn context_error(version: u32, extensions: &[&CStr]) -> Result<(), String> {
    // SAFETY: plain Vulkan; everything is destroyed in order.
    unsafe {
        let entry = ash::Entry::load().unwrap();
        let app = vk::ApplicationInfo::default().api_version(version);
        let instance = entry.create_instance(&vk::InstanceCreateInfo::default().application_info(&app), None).unwrap();
        let physical_device = instance.enumerate_physical_devices().unwrap()[0];
        let queues = [vk::DeviceQueueCreateInfo::default().queue_family_index(0).queue_priorities(&[1.0])];
        let extensions: Vec<_> = extensions.iter().map(|e| e.as_ptr()).collect();
        let features = edgeshade::requirements().features;
        let info = vk::DeviceCreateInfo::default()
            .queue_create_infos(&queues)
            .enabled_extension_names(&extensions)
            .enabled_features(&features);
        let device = instance.create_device(physical_device, &info, None).unwrap();
        let context = Context::new(&ContextDesc {
            instance: &instance,
            physical_device,
            device: &device,
            features: DeviceFeatures::default(),
            debug_utils: false,
            allocator: None,
            pipeline_cache: vk::PipelineCache::null(),
            keep_alive: None,
        });
        let outcome = context.map(drop).map_err(|e| e.to_string());
        device.destroy_device(None);
        instance.destroy_instance(None);
        outcome
    }
}

#[test]
fn devices_made_without_what_is_called() {
    with_gpu(|_| {
        let push = [ash::khr::push_descriptor::NAME];
        assert_eq!(context_error(vk::API_VERSION_1_3, &push), Ok(()));
        for (version, extensions, words) in [
            (vk::API_VERSION_1_3, &[][..], &["VK_KHR_push_descriptor", "enable"][..]),
            (vk::API_VERSION_1_2, &push, &["vkCmdPipelineBarrier2", "API version 1.3"]),
        ] {
            let error = context_error(version, extensions).expect_err(words[0]);
            assert!(words.iter().all(|w| error.contains(w)), "{error:?} lacks some of {words:?}");
        }
    });
}
