//! Passes on images made here, compared with their mirrors.

use crate::common::{plain_inputs, run_passes, upload_depths, with_gpu};
use crate::made;
use ash::vk;
use edgeshade::gpu::{Buffer, BufferDesc, Image, ImageDesc, MemoryKind};
use edgeshade::host::Host;
use edgeshade::reference::common::accumulate;
use edgeshade::reference::common::depth_bounds::{Bounds, Level, first_level, next_level};
use edgeshade::scene::{fit, light_view};
use edgeshade::technique::common::accumulate::Accumulate;
use edgeshade::technique::common::depth_bounds::{BLOCKS, DepthBounds};
use glam::DVec3;

pub struct Random(pub u64);

impl Random {
    pub fn unit(&mut self) -> f32 {
        self.0 = self.0.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
        (self.0 >> 40) as f32 / (1u64 << 24) as f32
    }
}

/// Reads the texels of one mip level of an image in `GENERAL`.
pub fn read_mip<T: bytemuck::Pod>(host: &Host, image: &Image, level: u32) -> Vec<T> {
    let device = host.context().device();
    let [width, height] = image.mip(level).extent;
    let desc = BufferDesc {
        name: "mip",
        size: u64::from(width * height) * size_of::<T>() as u64,
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
        let [general, source] = [vk::ImageLayout::GENERAL, vk::ImageLayout::TRANSFER_SRC_OPTIMAL];
        let change = |old, new| {
            [vk::ImageMemoryBarrier2::default()
                .image(image.as_ref().image)
                .old_layout(old)
                .new_layout(new)
                .src_stage_mask(vk::PipelineStageFlags2::ALL_TRANSFER)
                .dst_stage_mask(vk::PipelineStageFlags2::ALL_TRANSFER)
                .dst_access_mask(vk::AccessFlags2::TRANSFER_READ)
                .subresource_range(vk::ImageSubresourceRange {
                    aspect_mask: vk::ImageAspectFlags::COLOR,
                    base_mip_level: 0,
                    level_count: vk::REMAINING_MIP_LEVELS,
                    base_array_layer: 0,
                    layer_count: vk::REMAINING_ARRAY_LAYERS,
                })]
        };
        let (before, after) = (change(general, source), change(source, general));
        let before = vk::DependencyInfo::default().image_memory_barriers(&before);
        let after = vk::DependencyInfo::default().image_memory_barriers(&after).memory_barriers(&visible);
        // SAFETY: the image is in GENERAL, its last use has finished, and the buffer holds the level.
        unsafe {
            device.raw.cmd_pipeline_barrier2(cmd, &before);
            device.raw.cmd_copy_image_to_buffer(cmd, image.as_ref().image, source, buffer.handle(), &[region]);
            device.raw.cmd_pipeline_barrier2(cmd, &after);
        }
        Ok(())
    })
    .unwrap();
    bytemuck::cast_slice(buffer.bytes()).to_vec()
}

/// Counts the blocks of a level that differ from the mirror. A slope is accepted if it is as flat as the mirror's,
/// since either of two equally flat ones is right.
fn wrong_blocks(got: &Level, mirror: impl Fn(&Level) -> Level) -> usize {
    let expected = mirror(got);
    let wrong = |(g, e): (&Bounds, &Bounds)| {
        let slope_is_off = (g.slope.abs() - e.slope.abs()).abs().max_element() > 2e-7;
        // Slopes that are equally flat but have another sign bound something else; there only the contract holds.
        let same_slope = (g.slope - e.slope).abs().max_element() <= 2e-7;
        let tolerance = 2e-6 * (1.0 + (g.slope.x.abs() + g.slope.y.abs()) * got.block as f64);
        slope_is_off || same_slope && ((g.low - e.low).abs() > tolerance || (g.high - e.high).abs() > tolerance)
    };
    assert_eq!(got.bounds.len(), expected.bounds.len(), "blocks of {}", got.block);
    got.bounds.iter().zip(&expected.bounds).filter(|p| wrong(*p)).count()
}

#[test]
fn depth_bounds_hold_and_are_tight() {
    with_gpu(|host| {
        let scene = made::still_life(made::sun(DVec3::ONE));
        let camera = fit::camera(&scene, [1, 1]).view([1, 1]);
        let light = [light_view(&scene, &scene.lights[0])];
        let mut random = Random(1);
        for size in [[1, 1], [2, 63], [64, 64], [65, 64], [100, 333], [512, 192], [1000, 8]] {
            for is_smooth in [false, true] {
                // Noise with many texels at the ends of the range, or tilted planes with steps and holes.
                let texels: Vec<f32> = (0..size[0] * size[1])
                    .map(|i| {
                        let (x, y) = ((i % size[0]) as f32, (i / size[0]) as f32);
                        let plane = 0.3 + 1e-3 * x - 7e-4 * y;
                        match (is_smooth, (x as u32 / 40 + y as u32 / 27) % 3) {
                            (false, _) => 1.5 * random.unit() - 0.25,
                            (true, 0) => plane,
                            (true, 1) => 0.2 + 3e-3 * x,
                            _ => 1.0,
                        }
                        .clamp(0.0, 1.0)
                    })
                    .collect();
                let map = upload_depths(host, &texels, size, true);
                let mut pass = DepthBounds::new(host.context(), size).unwrap();
                run_passes(host, |frame| pass.record(frame, &plain_inputs(&camera, &map, &map, &light)));
                let mut below: Option<Level> = None;
                for (i, block) in (0u32..).zip(BLOCKS) {
                    let extent = pass.blocks().mip(i).extent.map(|n| n as usize);
                    let bounds = read_mip::<[f32; 4]>(host, pass.blocks(), i).into_iter().map(Bounds::from).collect();
                    let got = Level { block: block as usize, size: extent, bounds };
                    let what = format!("{size:?}, smooth {is_smooth}, blocks of {block}");
                    assert_eq!(got.violations(&texels, size, 1e-7), 0, "{what}");
                    let mirror = |_: &Level| below.as_ref().map_or_else(|| first_level(&texels, size), next_level);
                    assert_eq!(wrong_blocks(&got, mirror), 0, "{what}");
                    // Both checks can fail.
                    let mut planted = got.clone();
                    planted.bounds[0].high -= 1e-3;
                    assert_eq!(wrong_blocks(&planted, mirror), 1, "{what}: a planted difference goes unnoticed");
                    let mut planted = texels.clone();
                    planted[texels.len() / 2] = -1e3;
                    assert_eq!(got.violations(&planted, size, 1e-7), 1, "{what}: a planted texel goes unnoticed");
                    below = Some(got);
                }
            }
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
            // Two rounds: the first sample starts again.
            for _ in 0..2 {
                for (i, sample) in (0u32..).zip(&samples) {
                    let desc = ImageDesc { usage, ..ImageDesc::storage("sample", format, size) };
                    let image = host.upload_image(&desc, bytemuck::cast_slice(sample)).unwrap();
                    run_passes(host, |frame| pass.record(frame, &image.as_ref(), i, count, &output));
                }
            }
            let got = host.read_values(&output).unwrap();
            let expected = accumulate::average(&samples);
            // The count is exact; the single division may be off by 2.5 units in the last place.
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
