//! The example of `glsl/README.md`, run as another engine would run it: without passes or structs of the library.

use crate::common::with_gpu;
use crate::noise::{IMAGE, MAP, Noise, ZOOM, edge_point, place};
use ash::vk;
use edgeshade::gpu::{Image, ImageDesc};
use edgeshade::host::Host;
use edgeshade::reference::revectorization::revectorize::silhouette_visibility;
use glam::{DVec2, Mat4, dvec2};

const SPIRV: &[u8] = include_bytes!("../../../spv/example/foreign.comp.spv");
const MAXDIST: u32 = 32;
/// Offset that moves the points off the lines between texels, texels.
const SHIFT: DVec2 = dvec2(0.013, 0.029);

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

/// Dispatches the example with three textures and one image.
fn dispatch(host: &Host, textures: [&Image; 3], visibility: &Image, push: &[u8]) {
    let device = &host.context().device().raw;
    let stage = vk::ShaderStageFlags::COMPUTE;
    let kind = |i| if i < 3 { vk::DescriptorType::COMBINED_IMAGE_SAMPLER } else { vk::DescriptorType::STORAGE_IMAGE };
    let bindings = [0, 1, 2, 3].map(|i| {
        vk::DescriptorSetLayoutBinding::default()
            .binding(i)
            .descriptor_type(kind(i))
            .descriptor_count(1)
            .stage_flags(stage)
    });
    let code = ash::util::read_spv(&mut std::io::Cursor::new(SPIRV)).unwrap();
    let sizes = [0, 3].map(|i| vk::DescriptorPoolSize { ty: kind(i), descriptor_count: 4 });
    // SAFETY: every handle outlives its use: the submission has finished before any is destroyed.
    unsafe {
        let info = vk::DescriptorSetLayoutCreateInfo::default().bindings(&bindings);
        let sets = [device.create_descriptor_set_layout(&info, None).unwrap()];
        let ranges = [vk::PushConstantRange { stage_flags: stage, offset: 0, size: push.len() as u32 }];
        let info = vk::PipelineLayoutCreateInfo::default().set_layouts(&sets).push_constant_ranges(&ranges);
        let layout = device.create_pipeline_layout(&info, None).unwrap();
        let module = device.create_shader_module(&vk::ShaderModuleCreateInfo::default().code(&code), None).unwrap();
        let entry = vk::PipelineShaderStageCreateInfo::default().stage(stage).module(module).name(c"main");
        let info = vk::ComputePipelineCreateInfo::default().stage(entry).layout(layout);
        let pipeline = device.create_compute_pipelines(vk::PipelineCache::null(), &[info], None).unwrap()[0];
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
            device.cmd_bind_pipeline(cmd, vk::PipelineBindPoint::COMPUTE, pipeline);
            device.cmd_bind_descriptor_sets(cmd, vk::PipelineBindPoint::COMPUTE, layout, 0, &set, &[]);
            device.cmd_push_constants(cmd, layout, stage, 0, push);
            device.cmd_dispatch(cmd, IMAGE[0].div_ceil(8), IMAGE[1].div_ceil(8), 1);
            device.cmd_pipeline_barrier2(cmd, &barrier);
            Ok(())
        })
        .unwrap();
        device.destroy_descriptor_pool(pool, None);
        device.destroy_pipeline(pipeline, None);
        device.destroy_shader_module(module, None);
        device.destroy_pipeline_layout(layout, None);
        device.destroy_descriptor_set_layout(sets[0], None);
    }
}

#[test]
fn the_example_gives_the_listings_visibility() {
    with_gpu(|host| {
        let noise = Noise::new(7, [5, 3]);
        let map = noise.upload(host, false);
        let pixels = (IMAGE[0] * IMAGE[1]) as usize;
        // Every eleventh pixel is sky. The receiver is tilted along u, by less than the distance between the map's two
        // depths.
        let sky = |i: usize| i.is_multiple_of(11);
        let slope = 0.004;
        let at = |i: usize| place(i) + SHIFT;
        let position = |i: usize| {
            let p = at(i);
            [
                p.x as f32,
                p.y as f32,
                (0.5 + slope * (p.x - 0.5 * f64::from(MAP[0]))) as f32,
                f32::from(u8::from(!sky(i))),
            ]
        };
        let n = DVec2::new(slope, -1.0).normalize();
        let normal = [n.x as f32, 0.0, n.y as f32, 0.0];
        let positions = texture(host, "positions", &(0..pixels).map(position).collect::<Vec<_>>());
        let normals = texture(host, "normals", &vec![normal; pixels]);
        let desc = ImageDesc::storage("visibility", vk::Format::R32_SFLOAT, IMAGE);
        let unwritten = vec![0.5_f32; pixels];
        // With a bias of the whole depth range nothing is in shadow, so the bias is passed on.
        for (bias, is_all_lit) in [(1e-3, false), (1.5, true)] {
            let visibility = host.upload_image(&desc, bytemuck::cast_slice(&unwritten)).unwrap();
            dispatch(host, [&positions, &normals, &map], &visibility, &push(bias));
            let got = host.read_values(&visibility).unwrap();
            // A shifted pixel may lie outside the map, where it is lit.
            let expected = |i: usize| -> Option<f64> {
                let p = at(i);
                let is_inside = p.x <= f64::from(MAP[0]) && p.y <= f64::from(MAP[1]);
                if sky(i) || !is_inside || is_all_lit {
                    return Some(1.0);
                }
                let texel = p.floor();
                Some(match edge_point(&noise, p, MAXDIST) {
                    None => f64::from(u8::from(noise.lit([texel.x as i64, texel.y as i64]))),
                    Some(e) if e.d.lit && (e.nrd.x + e.nrd.y - 1.0).abs() < 1e-4 => return None,
                    Some(e) => silhouette_visibility(e.d, e.nrd),
                })
            };
            let wrong =
                |got: &[f32]| (0..pixels).filter(|&i| expected(i).is_some_and(|e| f64::from(got[i]) != e)).count();
            assert_eq!(wrong(&got), 0, "of {pixels} pixels, {ZOOM} a texel; bias {bias}");
            assert!((0..pixels).filter(|&i| expected(i).is_none()).count() < pixels / 1000, "too many ties");
            let lit = got.iter().filter(|&&v| v == 1.0).count();
            assert_eq!(lit == pixels, is_all_lit);
            let mut planted = got.clone();
            planted[pixels / 2] = 1.0 - planted[pixels / 2];
            assert_eq!(wrong(&planted), 1, "a planted difference goes unnoticed");
        }
    });
}
