//! The examples of `glsl/README.md`, run as another engine would run them: without passes or structs of the library.

use crate::common::with_gpu;
use crate::noise::{EdgePoint, IMAGE, MAP, Noise, ZOOM, edge_point, place};
use ash::vk;
use edgeshade::gpu::{Image, ImageDesc};
use edgeshade::host::Host;
use edgeshade::reference::revectorization::revectorize::{filtered_visibility, silhouette_visibility};
use glam::{DVec2, Mat4, dvec2};

macro_rules! spirv {
    ($file:literal) => {
        include_bytes!(concat!("../../../spv/", $file, ".spv"))
    };
}

/// Offset that moves the points off the lines between texels, texels.
const SHIFT: DVec2 = dvec2(0.013, 0.029);

/// Largest displacement of a position in the map by single precision, over both axes together, texels: four roundings a
/// coordinate. Listing 5 changes by no more than the position.
const PLACE_ERROR: f64 = 2.0 * 4.0 * f32::EPSILON as f64 * MAP[0] as f64;

/// Returns the push constants as the shader declares them.
fn push(bias: f32) -> Vec<u8> {
    // World units are the map's texels; z is the depth.
    let [w, h] = MAP.map(|n| n as f32);
    let clip_from_world = Mat4::from_cols_array(&[
        2.0 / w,
        0.0,
        0.0,
        0.0, //
        0.0,
        2.0 / h,
        0.0,
        0.0, //
        0.0,
        0.0,
        1.0,
        0.0, //
        -1.0,
        -1.0,
        0.0,
        1.0,
    ]);
    [bytemuck::bytes_of(&clip_from_world), bytemuck::bytes_of(&[0.0, bias])].concat()
}

fn texture(host: &Host, name: &str, texels: &[[f32; 4]]) -> Image {
    let usage = vk::ImageUsageFlags::SAMPLED;
    let desc = ImageDesc { usage, ..ImageDesc::storage(name, vk::Format::R32G32B32A32_SFLOAT, IMAGE) };
    host.upload_image(&desc, bytemuck::cast_slice(texels)).unwrap()
}

/// Runs an example with three textures and one image: a compute shader over the pixels, or a fragment shader over a
/// triangle that covers them.
fn run(
    host: &Host,
    (spirv, stage): (&[u8], vk::ShaderStageFlags),
    textures: [&Image; 3],
    visibility: &Image,
    push: &[u8],
) {
    let device = &host.context().device().raw;
    let is_compute = stage == vk::ShaderStageFlags::COMPUTE;
    let kind = |i| if i < 3 { vk::DescriptorType::COMBINED_IMAGE_SAMPLER } else { vk::DescriptorType::STORAGE_IMAGE };
    let bindings = [0, 1, 2, 3].map(|i| {
        vk::DescriptorSetLayoutBinding::default()
            .binding(i)
            .descriptor_type(kind(i))
            .descriptor_count(1)
            .stage_flags(stage)
    });
    // SAFETY: a module is destroyed below, after its last use.
    let module = |spirv: &[u8]| unsafe {
        let code = ash::util::read_spv(&mut std::io::Cursor::new(spirv)).unwrap();
        device.create_shader_module(&vk::ShaderModuleCreateInfo::default().code(&code), None).unwrap()
    };
    let sizes = [0, 3].map(|i| vk::DescriptorPoolSize { ty: kind(i), descriptor_count: 4 });
    // SAFETY: every handle outlives its use: the submission has finished before any is destroyed.
    unsafe {
        let info = vk::DescriptorSetLayoutCreateInfo::default().bindings(&bindings);
        let sets = [device.create_descriptor_set_layout(&info, None).unwrap()];
        let ranges = [vk::PushConstantRange { stage_flags: stage, offset: 0, size: push.len() as u32 }];
        let info = vk::PipelineLayoutCreateInfo::default().set_layouts(&sets).push_constant_ranges(&ranges);
        let layout = device.create_pipeline_layout(&info, None).unwrap();
        let modules = [module(spirv), module(spirv!("caster_edges/fullscreen.vert"))];
        let entries = [stage, vk::ShaderStageFlags::VERTEX].into_iter().zip(modules).map(|(stage, module)| {
            vk::PipelineShaderStageCreateInfo::default().stage(stage).module(module).name(c"main")
        });
        let entries: Vec<_> = entries.collect();
        let [width, height] = IMAGE;
        let area = vk::Rect2D { offset: vk::Offset2D::default(), extent: vk::Extent2D { width, height } };
        let pipeline = if is_compute {
            let info = vk::ComputePipelineCreateInfo::default().stage(entries[0]).layout(layout);
            device.create_compute_pipelines(vk::PipelineCache::null(), &[info], None).unwrap()[0]
        } else {
            let input = vk::PipelineVertexInputStateCreateInfo::default();
            let assembly =
                vk::PipelineInputAssemblyStateCreateInfo::default().topology(vk::PrimitiveTopology::TRIANGLE_LIST);
            let viewports =
                [vk::Viewport { width: width as f32, height: height as f32, max_depth: 1.0, ..Default::default() }];
            let scissors = [area];
            let viewport = vk::PipelineViewportStateCreateInfo::default().viewports(&viewports).scissors(&scissors);
            let raster = vk::PipelineRasterizationStateCreateInfo::default().line_width(1.0);
            let samples =
                vk::PipelineMultisampleStateCreateInfo::default().rasterization_samples(vk::SampleCountFlags::TYPE_1);
            let targets =
                [vk::PipelineColorBlendAttachmentState::default().color_write_mask(vk::ColorComponentFlags::R)];
            let blend = vk::PipelineColorBlendStateCreateInfo::default().attachments(&targets);
            let formats = [visibility.format()];
            let mut rendering = vk::PipelineRenderingCreateInfo::default().color_attachment_formats(&formats);
            let info = vk::GraphicsPipelineCreateInfo::default()
                .stages(&entries)
                .vertex_input_state(&input)
                .input_assembly_state(&assembly)
                .viewport_state(&viewport)
                .rasterization_state(&raster)
                .multisample_state(&samples)
                .color_blend_state(&blend)
                .layout(layout)
                .push_next(&mut rendering);
            device.create_graphics_pipelines(vk::PipelineCache::null(), &[info], None).unwrap()[0]
        };
        let info = vk::DescriptorPoolCreateInfo::default().max_sets(1).pool_sizes(&sizes);
        let pool = device.create_descriptor_pool(&info, None).unwrap();
        let info = vk::DescriptorSetAllocateInfo::default().descriptor_pool(pool).set_layouts(&sets);
        let set = device.allocate_descriptor_sets(&info).unwrap();
        let images = [textures[0], textures[1], textures[2], visibility].map(|image| {
            [vk::DescriptorImageInfo {
                sampler: host.context().nearest(),
                image_view: image.as_ref().view,
                image_layout: vk::ImageLayout::GENERAL,
            }]
        });
        let writes = [0, 1, 2, 3].map(|i| {
            let write = vk::WriteDescriptorSet::default().dst_set(set[0]).dst_binding(i).descriptor_type(kind(i));
            write.image_info(&images[i as usize])
        });
        device.update_descriptor_sets(&writes, &[]);
        host.run(|cmd| {
            // Makes uploads visible to reads, and writes visible to the read-back.
            let barrier = [vk::MemoryBarrier2::default()
                .src_stage_mask(vk::PipelineStageFlags2::ALL_COMMANDS)
                .src_access_mask(vk::AccessFlags2::MEMORY_WRITE)
                .dst_stage_mask(vk::PipelineStageFlags2::ALL_COMMANDS)
                .dst_access_mask(vk::AccessFlags2::MEMORY_READ | vk::AccessFlags2::MEMORY_WRITE)];
            let barrier = vk::DependencyInfo::default().memory_barriers(&barrier);
            device.cmd_pipeline_barrier2(cmd, &barrier);
            let point = if is_compute { vk::PipelineBindPoint::COMPUTE } else { vk::PipelineBindPoint::GRAPHICS };
            device.cmd_bind_pipeline(cmd, point, pipeline);
            device.cmd_bind_descriptor_sets(cmd, point, layout, 0, &set, &[]);
            device.cmd_push_constants(cmd, layout, stage, 0, push);
            if is_compute {
                device.cmd_dispatch(cmd, width.div_ceil(8), height.div_ceil(8), 1);
            } else {
                let target = [vk::RenderingAttachmentInfo::default()
                    .image_view(visibility.as_ref().view)
                    .image_layout(vk::ImageLayout::GENERAL)];
                let rendering =
                    vk::RenderingInfo::default().render_area(area).layer_count(1).color_attachments(&target);
                device.cmd_begin_rendering(cmd, &rendering);
                device.cmd_draw(cmd, 3, 1, 0, 0);
                device.cmd_end_rendering(cmd);
            }
            device.cmd_pipeline_barrier2(cmd, &barrier);
            Ok(())
        })
        .unwrap();
        device.destroy_descriptor_pool(pool, None);
        device.destroy_pipeline(pipeline, None);
        modules.into_iter().for_each(|module| device.destroy_shader_module(module, None));
        device.destroy_pipeline_layout(layout, None);
        device.destroy_descriptor_set_layout(sets[0], None);
    }
}

#[test]
fn the_examples_give_the_listings_visibility() {
    with_gpu(|host| {
        let compute = vk::ShaderStageFlags::COMPUTE;
        // The listings are at the fragment's own depth, so their receiver is level.
        check(host, (spirv!("example/foreign.comp"), compute), 32, 0.004, |e| {
            let is_tie = e.d.lit && (e.nrd.x + e.nrd.y - 1.0).abs() < 1e-4;
            (!is_tie).then(|| (silhouette_visibility(e.d, e.nrd), 0.0))
        });
        for example in [
            (&spirv!("example/listings.comp")[..], compute),
            (spirv!("example/listings.frag"), vk::ShaderStageFlags::FRAGMENT),
        ] {
            check(host, example, 16, 0.0, |e| Some((filtered_visibility(e.d, e.nrd), PLACE_ERROR)));
        }
    });
}

/// Equations 4 to 10 of Macedo, Apolinário 2018, as `glsl/lib/rbsm_listings.glsl` has them.
#[test]
fn the_equations_of_2018_have_their_values() {
    with_gpu(|host| {
        let desc = ImageDesc::storage("values", vk::Format::R32_SFLOAT, IMAGE);
        let values = host.upload_image(&desc, &vec![0; 4 * (IMAGE[0] * IMAGE[1]) as usize]).unwrap();
        // The shader declares neither textures nor constants.
        let unused = texture(host, "unused", &vec![[0.0; 4]; (IMAGE[0] * IMAGE[1]) as usize]);
        let shader = (&spirv!("test/equations.comp")[..], vk::ShaderStageFlags::COMPUTE);
        run(host, shader, [&unused; 3], &values, &push(0.0));
        let got = host.read_values(&values).unwrap();
        assert!(IMAGE[0] >= 96 && IMAGE[1] >= 32);
        let bit = |is_lit: bool| f64::from(u8::from(is_lit));
        for y in 0..32 {
            for x in 0..96 {
                let (u, v) = (f64::from(x % 16) / 16.0, f64::from(y % 16) / 16.0);
                let is_lit = y >= 16;
                let expected = match x / 16 {
                    0 => bit(u + v >= 1.0),
                    // Each side measures from its own corner, up to which it takes the other visibility.
                    1 | 2 => bit(if is_lit { u + v >= 0.5 } else { u + v <= 0.5 }),
                    3 => 0.5 + if is_lit { 0.5 } else { -0.5 } * u / (1.0 + v),
                    4 => u * if is_lit { 2.0 } else { 1.0 } / (1.0 + v),
                    _ => 0.5 / (0.5 * (0.1 + u + v)).tan(),
                };
                let got = f64::from(got[(y * IMAGE[0] + x) as usize]);
                assert!((got - expected).abs() <= 1e-5 * expected.max(1.0), "({x}, {y}): {got}, {expected}");
            }
        }
    });
}

/// Compares an example with a listing in f64, over a receiver whose depth rises by `slope` a texel along u. `listing`
/// returns the visibility and how far rounding may move it, or `None` where rounding may decide otherwise.
fn check(
    host: &Host,
    example: (&[u8], vk::ShaderStageFlags),
    max_distance: u32,
    slope: f64,
    listing: impl Fn(&EdgePoint) -> Option<(f64, f64)>,
) {
    let noise = Noise::new(7, [5, 3]);
    let map = noise.upload(host, false);
    let pixels = (IMAGE[0] * IMAGE[1]) as usize;
    // Every eleventh pixel is sky. The receiver is tilted along u, by less than the distance between the map's two
    // depths.
    let sky = |i: usize| i.is_multiple_of(11);
    let at = |i: usize| place(i) + SHIFT;
    let position = |i: usize| {
        let p = at(i);
        [p.x as f32, p.y as f32, (0.5 + slope * (p.x - 0.5 * f64::from(MAP[0]))) as f32, f32::from(u8::from(!sky(i)))]
    };
    let n = DVec2::new(slope, -1.0).normalize();
    let normal = [n.x as f32, 0.0, n.y as f32, 0.0];
    let positions = texture(host, "positions", &(0..pixels).map(position).collect::<Vec<_>>());
    let normals = texture(host, "normals", &vec![normal; pixels]);
    let mut desc = ImageDesc::storage("visibility", vk::Format::R32_SFLOAT, IMAGE);
    desc.usage |= vk::ImageUsageFlags::COLOR_ATTACHMENT;
    let unwritten = vec![0.5_f32; pixels];
    // With a bias of the whole depth range nothing is in shadow, so the bias is passed on.
    for (bias, is_all_lit) in [(1e-3, false), (1.5, true)] {
        let visibility = host.upload_image(&desc, bytemuck::cast_slice(&unwritten)).unwrap();
        run(host, example, [&positions, &normals, &map], &visibility, &push(bias));
        let got = host.read_values(&visibility).unwrap();
        // A shifted pixel may lie outside the map, where it is lit.
        let expected = |i: usize| -> Option<(f64, f64)> {
            let p = at(i);
            let is_inside = p.x <= f64::from(MAP[0]) && p.y <= f64::from(MAP[1]);
            if sky(i) || !is_inside || is_all_lit {
                return Some((1.0, 0.0));
            }
            let texel = p.floor();
            match edge_point(&noise, p, max_distance) {
                None => Some((f64::from(u8::from(noise.lit([texel.x as i64, texel.y as i64]))), 0.0)),
                Some(e) => listing(&e),
            }
        };
        let is_wrong = |got: f32, (value, rounding): (f64, f64)| (f64::from(got) - value).abs() > rounding;
        let wrong = |got: &[f32]| (0..pixels).filter(|&i| expected(i).is_some_and(|e| is_wrong(got[i], e))).count();
        assert_eq!(wrong(&got), 0, "of {pixels} pixels, {ZOOM} a texel; bias {bias}");
        assert!((0..pixels).filter(|&i| expected(i).is_none()).count() < pixels / 1000, "too many ties");
        let lit = got.iter().filter(|&&v| v == 1.0).count();
        assert_eq!(lit == pixels, is_all_lit);
        let mut planted = got.clone();
        planted[pixels / 2] += 0.25;
        assert_eq!(wrong(&planted), 1, "a planted difference goes unnoticed");
    }
}
