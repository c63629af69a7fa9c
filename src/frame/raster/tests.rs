use super::*;
use crate::gpu::{
    Blend, BufferDesc, DepthState, ImageDesc, MemoryKind, RasterState, ShaderStruct, StencilFace, StencilState,
    bindings, shader_struct,
};
use crate::host::{Host, HostDesc};
use crate::timing::{Statistics, Timings};
use crate::{Context, ContextDesc, DeviceFeatures, Handoff, Pass, Threads};
use std::sync::Arc;

const SIZE: [u32; 2] = [32, 16];
const PIXELS: usize = (SIZE[0] * SIZE[1]) as usize;

/// A rectangle of whole pixels: `x0, y0, x1, y1`.
#[derive(Clone, Copy)]
struct Quad {
    pixels: [i32; 4],
    depth: f32,
    value: f32,
    is_back: bool,
}

impl Quad {
    const WHOLE: Self = Self { pixels: [0, 0, SIZE[0] as i32, SIZE[1] as i32], depth: 0.5, value: 1.0, is_back: false };

    fn covers(&self, i: usize) -> bool {
        let [x, y] = [i as u32 % SIZE[0], i as u32 / SIZE[0]].map(|v| v as i32);
        let [x0, y0, x1, y1] = self.pixels;
        (x0..x1).contains(&x) && (y0..y1).contains(&y)
    }

    /// Words of the quad in the layout of `Quad` in `quads.vert`.
    fn words(&self) -> [u32; 7] {
        let [x0, y0, x1, y1] = self.pixels;
        let clip = |v: i32, n: u32| (2.0 * v as f32 / n as f32 - 1.0).to_bits();
        let (depth, value) = (self.depth.to_bits(), self.value.to_bits());
        [clip(x0, SIZE[0]), clip(y0, SIZE[1]), clip(x1, SIZE[0]), clip(y1, SIZE[1]), depth, value, self.is_back.into()]
    }
}

shader_struct! {
    struct WidthPush {
        width: u32,
    }
}

bindings! {
    struct QuadBindings { Quads }
    struct CountBindings { ..quads: QuadBindings, Counts }
    // The order differs from that of the shader's bindings on purpose: only the names count.
    struct ReadBindings { result, Counts, stencil }
    struct OtherBindings { Counts, Quads, stencil }
}

fn with_host(test: impl FnOnce(&Host)) {
    let host = Host::new(&HostDesc { validation: true, ..HostDesc::default() }).unwrap();
    let messages = host.messages().clone();
    test(&host);
    drop(host);
    let messages = messages.all();
    assert!(messages.is_empty(), "validation:\n{}", messages.join("\n"));
}

fn run(host: &Host, record: impl FnOnce(&mut Frame<'_>)) {
    host.run(|cmd| {
        // SAFETY: `cmd` is recording and is waited for.
        let mut frame = unsafe { Frame::begin(host.context(), cmd, Handoff::default(), None) };
        record(&mut frame);
        frame.end();
        Ok(())
    })
    .unwrap();
}

fn buffer(host: &Host, name: &str, words: usize) -> Buffer {
    let usage = vk::BufferUsageFlags::STORAGE_BUFFER
        | vk::BufferUsageFlags::INDIRECT_BUFFER
        | vk::BufferUsageFlags::TRANSFER_DST
        | vk::BufferUsageFlags::TRANSFER_SRC;
    let desc = BufferDesc { name, size: 4 * words as u64, usage, memory: MemoryKind::Gpu };
    Buffer::new(host.context().device(), &desc).unwrap()
}

fn image(host: &Host, name: &str, format: vk::Format) -> Image {
    Image::new(host.context().device(), &ImageDesc::attachment(name, format, SIZE)).unwrap()
}

fn pipeline<B: Bindings, P: ShaderStruct>(host: &Host, state: RasterState<'_>) -> Arc<RasterPipeline> {
    host.context().raster_pipeline::<B, P>(&RasterState { vertex: "test/quads.vert", ..state }).unwrap()
}

/// Writes the quads' values into an `R32_SFLOAT` target.
fn value_pipeline(host: &Host) -> Arc<RasterPipeline> {
    let state = RasterState {
        name: "values of quads",
        fragment: Some("test/quads.frag"),
        colors: &[vk::Format::R32_SFLOAT],
        ..RasterState::default()
    };
    pipeline::<QuadBindings, ()>(host, state)
}

/// Writes quads into a buffer within the frame, so the vertex shader must wait for the write.
fn write_quads(frame: &mut Frame<'_>, target: &Buffer, quads: &[Quad]) {
    let words: Vec<u32> = quads.iter().flat_map(Quad::words).collect();
    frame.update(target, bytemuck::cast_slice(&words));
}

const FORMAT: vk::Format = vk::Format::D32_SFLOAT_S8_UINT;

#[test]
fn stencil_counts_and_fragments_store() {
    with_host(|host| {
        let stencil = StencilState {
            front: StencilFace::on_depth_fail(vk::StencilOp::DECREMENT_AND_WRAP),
            back: StencilFace::on_depth_fail(vk::StencilOp::INCREMENT_AND_WRAP),
        };
        let state = RasterState {
            name: "z-fail",
            depth: Some(DepthState { format: FORMAT, compare: vk::CompareOp::LESS, write: false }),
            ..RasterState::default()
        };
        let volumes = pipeline::<QuadBindings, ()>(host, RasterState { stencil: Some(stencil), ..state.clone() });
        let solid = RasterState {
            name: "solid",
            depth: Some(DepthState::new(FORMAT, vk::CompareOp::LESS)),
            ..RasterState::default()
        };
        let solid = pipeline::<QuadBindings, ()>(host, solid);
        let counting = RasterState { name: "count", fragment: Some("test/quads_count.frag"), ..RasterState::default() };
        let counting = pipeline::<CountBindings, WidthPush>(host, counting);
        let read = host.context().pipeline::<ReadBindings, ()>("test/stencil.comp", &[]).unwrap();

        let depth = image(host, "depth with stencil", FORMAT);
        let result =
            Image::new(host.context().device(), &ImageDesc::storage("result", vk::Format::R32_UINT, SIZE)).unwrap();
        let quads = buffer(host, "quads", 7 * 8);
        let counts = buffer(host, "counts", PIXELS);
        let list = [
            // The surface, at depth 0.5, and on the right at depth 0.25.
            Quad::WHOLE,
            Quad { pixels: [12, 0, 24, 16], depth: 0.25, ..Quad::WHOLE },
            // Faces behind both surfaces, between them, and in front of both.
            Quad { pixels: [0, 0, 20, 8], depth: 0.75, is_back: true, ..Quad::WHOLE },
            Quad { pixels: [0, 0, 20, 4], depth: 0.75, ..Quad::WHOLE },
            Quad { pixels: [4, 0, 24, 12], depth: 0.4, ..Quad::WHOLE },
            Quad { pixels: [4, 0, 24, 12], depth: 0.1, is_back: true, ..Quad::WHOLE },
            // A face exactly on the surface. Its depth is not less, so it counts.
            Quad { pixels: [0, 12, 24, 16], depth: 0.5, is_back: true, ..Quad::WHOLE },
            Quad { pixels: [2, 2, 9, 11], value: 3.0, ..Quad::WHOLE },
        ];
        for _ in 0..2 {
            run(host, |frame| {
                write_quads(frame, &quads, &list);
                frame.fill("clear counts", &counts, 0);
                let bind = QuadBindings { Quads: Bind::Buffer(&quads) };
                let pass = RasterPass {
                    name: "z-fail",
                    extent: SIZE,
                    colors: &[],
                    depth: Some(Target::depth(&depth, 1.0)),
                    bound: &[&solid, &volumes].map(|p| Bound { pipeline: p, bind: &bind }),
                    indirect: &[],
                };
                let draw = |draw: &mut Draw<'_, '_>| {
                    draw.bind(0)?;
                    draw.draw(0..12, 0..1)?;
                    draw.bind(1)?;
                    draw.draw(12..42, 0..1)
                };
                frame.raster(&pass, draw).unwrap();
                let bind = CountBindings {
                    quads: QuadBindings { Quads: Bind::Buffer(&quads) },
                    Counts: Bind::Buffer(&counts),
                };
                let pass = RasterPass {
                    name: "count",
                    extent: SIZE,
                    colors: &[],
                    depth: None,
                    bound: &[Bound { pipeline: &counting, bind: &bind }],
                    indirect: &[],
                };
                let draw = |draw: &mut Draw<'_, '_>| {
                    draw.bind(0)?;
                    draw.push(bytemuck::bytes_of(&WidthPush { width: SIZE[0] }))?;
                    draw.draw(42..48, 0..2)
                };
                frame.raster(&pass, draw).unwrap();
                let bind = ReadBindings {
                    result: Bind::Image(&result),
                    Counts: Bind::Buffer(&counts),
                    stencil: Bind::Stencil(&depth),
                };
                let [x, y] = SIZE;
                let threads = Threads::Count([x, y, 1]);
                frame.dispatch(&Pass { name: "read", pipeline: &read, bind: &bind, push: &[], threads }).unwrap();
            });
            let got = host.read_image::<u32>(&result).unwrap();
            let expected = |i: usize| {
                let surface = if list[1].covers(i) { 0.25 } else { 0.5 };
                let hidden = list[2..7].iter().filter(|q| q.covers(i) && q.depth >= surface);
                let count = hidden.fold(0u8, |n, q| if q.is_back { n.wrapping_add(1) } else { n.wrapping_sub(1) });
                // The quad is drawn twice with the value 3.
                u32::from(count) + 1000 * if list[7].covers(i) { 6 } else { 0 }
            };
            let wrong: Vec<_> = (0..PIXELS).filter(|&i| got[i] != expected(i)).collect();
            assert!(wrong.is_empty(), "{wrong:?}: {} and {}", got[wrong[0]], expected(wrong[0]));
            let found = |n: u32| got.contains(&n);
            assert!(found(0) && found(1) && found(255) && found(6000) && found(6001), "{got:?}");
        }
    });
}

#[test]
fn blending_masks_scissor_and_indirect_draws() {
    with_host(|host| {
        let format = vk::Format::R32G32_SFLOAT;
        let target = image(host, "target", format);
        let quads = buffer(host, "quads", 7 * 2);
        let commands = buffer(host, "commands", 8);
        let list = [
            Quad { pixels: [0, 0, 16, 16], value: 3.0, ..Quad::WHOLE },
            Quad { pixels: [8, 4, 24, 12], value: -2.0, ..Quad::WHOLE },
        ];
        let scissor = Quad { pixels: [4, 2, 22, 10], ..Quad::WHOLE };
        for (blend, mask, geometry) in [
            (Blend::Replace, vk::ColorComponentFlags::RGBA, None),
            (Blend::Add, vk::ColorComponentFlags::RGBA, None),
            (Blend::Min, vk::ColorComponentFlags::RGBA, None),
            (Blend::Max, vk::ColorComponentFlags::R, None),
            (Blend::Max, vk::ColorComponentFlags::G, Some("test/quads.geom")),
        ] {
            let state = RasterState {
                name: "blended",
                geometry,
                fragment: Some("test/quads.frag"),
                colors: &[format],
                blend,
                write_mask: mask,
                ..RasterState::default()
            };
            let pipeline = pipeline::<QuadBindings, ()>(host, state);
            run(host, |frame| {
                write_quads(frame, &quads, &list);
                // The second command draws the second quad alone.
                frame.update(&commands, bytemuck::cast_slice(&[12u32, 1, 0, 0, 6, 1, 6, 0]));
                let bind = QuadBindings { Quads: Bind::Buffer(&quads) };
                let mut pass = RasterPass {
                    name: "blended",
                    extent: SIZE,
                    colors: &[Target::color(&target, [0.5; 4])],
                    depth: None,
                    bound: &[Bound { pipeline: &pipeline, bind: &bind }],
                    indirect: &[&commands],
                };
                let first = |draw: &mut Draw<'_, '_>| {
                    draw.bind(0)?;
                    let [x0, y0, x1, y1] = scissor.pixels.map(|v| v as u32);
                    draw.scissor(x0..x1, y0..y1);
                    draw.indirect(&commands, 0)
                };
                frame.raster(&pass, first).unwrap();
                let kept = [Target::kept(&target)];
                pass.colors = &kept;
                let second = |draw: &mut Draw<'_, '_>| {
                    draw.bind(0)?;
                    // This scissor reaches beyond the image and must be clipped.
                    draw.scissor(0..1000, 0..1000);
                    draw.faces(vk::CullModeFlags::BACK, vk::FrontFace::COUNTER_CLOCKWISE);
                    draw.indirect(&commands, 16)?;
                    draw.faces(vk::CullModeFlags::FRONT, vk::FrontFace::COUNTER_CLOCKWISE);
                    draw.indirect(&commands, 0)
                };
                frame.raster(&pass, second).unwrap();
            });
            let meet = |old: f32, new: f32| match blend {
                Blend::Replace => new,
                Blend::Add => old + new,
                Blend::Min => old.min(new),
                Blend::Max => old.max(new),
            };
            let expected = |i: usize| {
                let mut color = [0.5; 2];
                let in_scissor = |q: &&Quad| q.covers(i) && scissor.covers(i);
                let drawn = list.iter().filter(in_scissor).chain(list[1..].iter().filter(|q| q.covers(i)));
                for quad in drawn {
                    for value in [quad.value, -quad.value].into_iter().take(1 + usize::from(geometry.is_some())) {
                        let new = [value, 2.0 * value];
                        let blended = [meet(color[0], new[0]), meet(color[1], new[1])];
                        if mask.contains(vk::ColorComponentFlags::R) {
                            color[0] = blended[0];
                        }
                        if mask.contains(vk::ColorComponentFlags::G) {
                            color[1] = blended[1];
                        }
                    }
                }
                color
            };
            let got = host.read_image::<[f32; 2]>(&target).unwrap();
            let wrong: Vec<_> = (0..PIXELS).filter(|&i| got[i] != expected(i)).collect();
            assert!(wrong.is_empty(), "{blend:?}: {wrong:?}: {:?} and {:?}", got[wrong[0]], expected(wrong[0]));
            let untouched = got.iter().filter(|v| **v == [0.5; 2]).count();
            assert!(0 < untouched && untouched < PIXELS, "{blend:?}: {untouched}");
        }
    });
}

/// The next frame on the same queue may overwrite a buffer that a frame's draws read, without any waiting by the
/// caller.
#[test]
fn frames_wait_for_the_draws_of_those_before() {
    with_host(|host| {
        let target = image(host, "target", vk::Format::R32_SFLOAT);
        let quads = buffer(host, "quads", 7);
        let pipeline = value_pipeline(host);
        host.run(|cmd| {
            for value in 1..4 {
                // SAFETY: as above; the frames of one command buffer follow one another.
                let mut frame = unsafe { Frame::begin(host.context(), cmd, Handoff::default(), None) };
                write_quads(&mut frame, &quads, &[Quad { value: value as f32, ..Quad::WHOLE }]);
                let bind = QuadBindings { Quads: Bind::Buffer(&quads) };
                let pass = RasterPass {
                    name: "one quad",
                    extent: SIZE,
                    colors: &[Target::color(&target, [0.0; 4])],
                    depth: None,
                    bound: &[Bound { pipeline: &pipeline, bind: &bind }],
                    indirect: &[],
                };
                frame.raster(&pass, |draw| draw.bind(0).and_then(|()| draw.draw(0..6, 0..1)))?;
                frame.end();
            }
            Ok(())
        })
        .unwrap();
        assert_eq!(host.read_image::<f32>(&target).unwrap(), [3.0; PIXELS]);
    });
}

#[test]
fn statistics_count_what_passes_do() {
    with_host(|host| {
        if !host.context().features().pipeline_statistics {
            eprintln!("skipped: this device has no pipeline statistics");
            return;
        }
        let depth = image(host, "depth with stencil", FORMAT);
        let target = image(host, "target", vk::Format::R32_SFLOAT);
        let result =
            Image::new(host.context().device(), &ImageDesc::storage("result", vk::Format::R32_UINT, SIZE)).unwrap();
        let quads = buffer(host, "quads", 7 * 2);
        let counts = buffer(host, "counts", PIXELS);
        let read = host.context().pipeline::<ReadBindings, ()>("test/stencil.comp", &[]).unwrap();
        let pipeline = value_pipeline(host);
        let mut timings = Timings::with_statistics(host.context(), host.queue_family(), 1).unwrap();
        // The second quad lies outside the view, so clipping removes it.
        let list = [Quad::WHOLE, Quad { depth: 2.0, ..Quad::WHOLE }];
        for _ in 0..3 {
            host.run(|cmd| {
                // SAFETY: as above.
                let mut frame = unsafe { Frame::begin(host.context(), cmd, Handoff::default(), Some(&mut timings)) };
                write_quads(&mut frame, &quads, &list);
                frame.fill("clear counts", &counts, 0);
                let bind = QuadBindings { Quads: Bind::Buffer(&quads) };
                let pass = RasterPass {
                    name: "two quads",
                    extent: SIZE,
                    colors: &[Target::color(&target, [0.0; 4])],
                    depth: Some(Target::depth(&depth, 1.0)),
                    bound: &[],
                    indirect: &[],
                };
                // This pass only clears the depth image, which is read below.
                frame.raster(&pass, |_| Ok(()))?;
                let bound = [Bound { pipeline: &pipeline, bind: &bind }];
                let pass = RasterPass { depth: None, bound: &bound, ..pass };
                frame.raster(&pass, |draw| draw.bind(0).and_then(|()| draw.draw(0..12, 0..1)))?;
                let bind = ReadBindings {
                    result: Bind::Image(&result),
                    Counts: Bind::Buffer(&counts),
                    stencil: Bind::Stencil(&depth),
                };
                let threads = Threads::Count([SIZE[0] - 1, SIZE[1] - 7, 1]);
                frame.dispatch(&Pass { name: "read", pipeline: &read, bind: &bind, push: &[], threads })?;
                frame.end();
                Ok(())
            })
            .unwrap();
            let frames = timings.poll();
            let [frame] = &frames[..] else { panic!("{frames:?}") };
            let found: Vec<_> = frame.passes.iter().map(|p| p.statistics.unwrap()).collect();
            let [fill, clear, draw, dispatch] = found[..] else { panic!("{found:?}") };
            assert_eq!([fill, clear], [Statistics::default(); 2]);
            let drawn = Statistics {
                input_primitives: 4,
                vertex_invocations: 12,
                clipped_primitives: 2,
                fragment_invocations: draw.fragment_invocations,
                compute_invocations: 0,
            };
            assert_eq!(draw, drawn);
            // Every pixel is shaded once. Drivers that run whole blocks of pixels shade the blocks along the diagonal
            // for both triangles.
            let diagonal = 16 * (SIZE[0] / 4 + SIZE[1] / 4) as usize;
            let pixels = draw.fragment_invocations as usize;
            assert!((PIXELS..=PIXELS + diagonal).contains(&pixels), "{pixels} of {PIXELS}");
            // Whole workgroups of 8x8 threads run.
            assert_eq!(dispatch, Statistics { compute_invocations: 4 * 2 * 64, ..Statistics::default() });
        }
    });
}

#[test]
fn what_the_device_was_not_made_for_is_refused() {
    with_host(|host| {
        let device = host.context().device();
        // SAFETY: the host's own handles, which outlive this context.
        let bare = unsafe {
            Context::new(&ContextDesc {
                instance: &device.instance,
                physical_device: device.physical_device,
                device: &device.raw,
                features: DeviceFeatures { dynamic_rendering: true, ..DeviceFeatures::default() },
                debug_utils: false,
                allocator: None,
                pipeline_cache: vk::PipelineCache::null(),
                keep_alive: None,
            })
        }
        .unwrap();
        let state = RasterState { name: "asked for", vertex: "test/quads.vert", ..RasterState::default() };
        let refused =
            |state: &RasterState<'_>| bare.raster_pipeline::<QuadBindings, ()>(state).err().unwrap().to_string();
        for (state, feature) in [
            (RasterState { geometry: Some("test/quads.geom"), ..state.clone() }, "geometryShader"),
            (RasterState { depth_clamp: true, ..state.clone() }, "depthClamp"),
            (RasterState { fragment: Some("test/quads_count.frag"), ..state.clone() }, "fragmentStoresAndAtomics"),
        ] {
            let text = refused(&state);
            assert!(text.contains(feature) && text.contains("asked for"), "{text}");
        }
        assert!(bare.raster_pipeline::<QuadBindings, ()>(&state).is_ok());
        assert!(Timings::with_statistics(&bare, 0, 1).err().unwrap().to_string().contains("pipelineStatisticsQuery"));
        // Wrong uses of stages and stencil are refused on every device.
        let text = refused(&RasterState { geometry: Some("test/quads.frag"), ..state.clone() });
        assert!(text.contains("another stage"), "{text}");
        let face = StencilFace::on_depth_fail(vk::StencilOp::KEEP);
        let depth = Some(DepthState::new(vk::Format::D32_SFLOAT, vk::CompareOp::LESS));
        let text = refused(&RasterState { stencil: Some(StencilState { front: face, back: face }), depth, ..state });
        assert!(text.contains("stencil"), "{text}");
    });
}

#[test]
fn wrong_passes_are_refused() {
    with_host(|host| {
        let target = image(host, "target", vk::Format::R32_SFLOAT);
        let quads = buffer(host, "quads", 7);
        let pipeline = value_pipeline(host);
        run(host, |frame| {
            let colors = [Target::color(&target, [0.0; 4])];
            let bind = QuadBindings { Quads: Bind::Buffer(&quads) };
            let bound = [Bound { pipeline: &pipeline, bind: &bind }];
            let pass =
                RasterPass { name: "p", extent: SIZE, colors: &colors, depth: None, bound: &bound, indirect: &[] };
            let mut refused = |pass: &RasterPass<'_>, draw: &dyn Fn(&mut Draw<'_, '_>) -> Result<()>| {
                frame.raster(pass, |d| draw(d)).unwrap_err().to_string()
            };
            assert!(refused(&RasterPass { extent: [8, 8], ..pass }, &|_| Ok(())).contains("[8, 8]"));
            let [quads_bind, target_bind] = [Bind::Buffer(&quads), Bind::Image(&target)];
            let other = OtherBindings { Counts: quads_bind, Quads: quads_bind, stencil: target_bind };
            let wrong: [(&dyn Bindings, _); 3] = [
                (&(), "[\"Quads\"] missing"),
                (&other, "[\"Counts\", \"stencil\"] unknown"),
                (&QuadBindings { Quads: target_bind }, "StorageBuffer"),
            ];
            for (bind, expected) in wrong {
                let bound = [Bound { pipeline: &pipeline, bind }];
                let text = refused(&RasterPass { bound: &bound, ..pass }, &|_| Ok(()));
                assert!(text.contains(expected), "{text}");
            }
            assert!(refused(&pass, &|d| d.bind(1)).contains("no pipeline 1"));
            assert!(refused(&pass, &|d| d.draw(0..3, 0..1)).contains("without a pipeline"));
            let indirect = |d: &mut Draw<'_, '_>| d.bind(0).and_then(|()| d.indirect(&quads, 0));
            assert!(refused(&pass, &indirect).contains("indirect buffer"));
            let pushed = |d: &mut Draw<'_, '_>| d.bind(0).and_then(|()| d.push(&[0; 4]));
            assert!(refused(&pass, &pushed).contains("4 bytes"));
        });
    });
}
