//! Passes on images made here, against their mirrors.

use crate::common::with_gpu;
use crate::made;
use ash::vk;
use edgeshade::gpu::{Buffer, BufferDesc, Image, ImageDesc, MemoryKind};
use edgeshade::host::Host;
use edgeshade::pass::accumulate::Accumulate;
use edgeshade::pass::min_max::{BLOCKS, MinMax};
use edgeshade::reference::{accumulate, min_max};
use edgeshade::scene::{fit, light_view};
use edgeshade::{Frame, Handoff, Inputs};
use glam::DVec3;

struct Random(u64);

impl Random {
    fn unit(&mut self) -> f32 {
        self.0 = self.0.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
        (self.0 >> 40) as f32 / (1u64 << 24) as f32
    }
}

/// Texels of one mip level of an image in `GENERAL`.
fn read_mip(host: &Host, image: &Image, level: u32) -> Vec<[f32; 2]> {
    let device = host.context().device();
    let [width, height] = image.mip(level).extent;
    let desc = BufferDesc {
        name: "mip",
        size: u64::from(width * height) * 8,
        usage: vk::BufferUsageFlags::TRANSFER_DST,
        memory: MemoryKind::Readback,
    };
    let buffer = Buffer::new(device, &desc).unwrap();
    let region = vk::BufferImageCopy::default()
        .image_subresource(vk::ImageSubresourceLayers {
            aspect_mask: vk::ImageAspectFlags::COLOR,
            mip_level: level,
            base_array_layer: 0,
            layer_count: 1,
        })
        .image_extent(vk::Extent3D { width, height, depth: 1 });
    let visible = [vk::MemoryBarrier2::default()
        .src_stage_mask(vk::PipelineStageFlags2::ALL_TRANSFER)
        .src_access_mask(vk::AccessFlags2::TRANSFER_WRITE)
        .dst_stage_mask(vk::PipelineStageFlags2::HOST)
        .dst_access_mask(vk::AccessFlags2::HOST_READ)];
    host.run(|cmd| {
        // SAFETY: the image is in GENERAL, its last use was waited for, and the buffer holds the level.
        unsafe {
            let layout = vk::ImageLayout::GENERAL;
            device.raw.cmd_copy_image_to_buffer(cmd, image.as_ref().image, layout, buffer.handle(), &[region]);
            device.raw.cmd_pipeline_barrier2(cmd, &vk::DependencyInfo::default().memory_barriers(&visible));
        }
        Ok(())
    })
    .unwrap();
    bytemuck::cast_slice(buffer.bytes()).to_vec()
}

#[test]
fn min_max_is_exact() {
    with_gpu(|host| {
        let scene = made::still_life(made::sun(DVec3::ONE));
        let camera = fit::camera(&scene).view([1, 1]);
        let light = [light_view(&scene, &scene.lights[0])];
        let mut random = Random(1);
        for size in [[1, 1], [2, 63], [64, 64], [65, 64], [100, 333], [512, 192], [1000, 8]] {
            // Many texels at the ends of the range.
            let mut depth = || (1.5 * random.unit() - 0.25).clamp(0.0, 1.0);
            let texels: Vec<f32> = (0..size[0] * size[1]).map(|_| depth()).collect();
            let usage = vk::ImageUsageFlags::SAMPLED;
            let desc =
                ImageDesc { array: true, usage, ..ImageDesc::storage("random map", vk::Format::D32_SFLOAT, size) };
            let map = host.upload_image(&desc, bytemuck::cast_slice(&texels)).unwrap();
            let mut pass = MinMax::new(host.context(), size).unwrap();
            let inputs = Inputs {
                camera: &camera,
                depth: map.as_ref(),
                normal: None,
                shadow_map: map.as_ref(),
                light: &light,
                light_version: None,
            };
            host.run(|cmd| {
                // SAFETY: `cmd` is recording and is waited for.
                let mut frame = unsafe { Frame::begin(host.context(), cmd, Handoff::default(), None) };
                pass.record(&mut frame, &inputs)?;
                frame.finish(None);
                Ok(())
            })
            .unwrap();
            let mut wrong = 0;
            let mirror = min_max::blocks(&texels, size);
            for (level, expected) in (0u32..).zip(&mirror) {
                let got = read_mip(host, pass.blocks(), level);
                assert_eq!(got.len(), expected.range.len(), "{size:?}, blocks of {}", BLOCKS[level as usize]);
                wrong += got.iter().zip(&expected.range).filter(|(a, b)| a != b).count();
            }
            assert_eq!(wrong, 0, "{size:?}");
            // Proof that it can fail: another map.
            let mut planted = texels.clone();
            planted[texels.len() / 2] = -1.0;
            assert!(min_max::blocks(&planted, size) != mirror, "{size:?}: a planted texel goes unnoticed");
        }
    });
}

#[test]
fn accumulation_is_exact() {
    with_gpu(|host| {
        let mut random = Random(2);
        for (size, count) in [([1, 1], 1), ([37, 21], 7), ([64, 3], 256)] {
            let pixels = (size[0] * size[1]) as usize;
            let samples: Vec<Vec<f32>> =
                (0..count).map(|_| (0..pixels).map(|_| (4.0 * random.unit()).floor() / 3.0).collect()).collect();
            let pass = Accumulate::new(host.context(), size).unwrap();
            let format = vk::Format::R32_SFLOAT;
            let output = Image::new(host.context().device(), &ImageDesc::storage("average", format, size)).unwrap();
            let usage = vk::ImageUsageFlags::SAMPLED;
            // Twice: the first sample starts anew.
            for _ in 0..2 {
                for (i, sample) in (0u32..).zip(&samples) {
                    let desc = ImageDesc { usage, ..ImageDesc::storage("sample", format, size) };
                    let image = host.upload_image(&desc, bytemuck::cast_slice(sample)).unwrap();
                    host.run(|cmd| {
                        // SAFETY: `cmd` is recording and is waited for.
                        let mut frame = unsafe { Frame::begin(host.context(), cmd, Handoff::default(), None) };
                        pass.record(&mut frame, &image.as_ref(), i, count, &output)?;
                        frame.finish(None);
                        Ok(())
                    })
                    .unwrap();
                }
            }
            let got = host.read_values(&output).unwrap();
            let expected = accumulate::average(&samples);
            // The count is exact; the one division may be off by 2.5 units in the last place.
            let wrong = |got: &[f32]| {
                let off = |(g, e): (&f32, &f64)| (f64::from(*g) - e).abs() > 2.5 * f64::from(f32::EPSILON);
                got.iter().zip(&expected).filter(|p| off(*p)).count()
            };
            assert_eq!(wrong(&got), 0, "{size:?}, {count} samples");
            let mut planted = got.clone();
            planted[pixels / 2] -= 0.9 / count as f32;
            assert_eq!(wrong(&planted), 1, "one sample's difference goes unnoticed");
        }
    });
}
