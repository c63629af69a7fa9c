//! The validation layer is active, so a test without messages means something.

use crate::common::messages_of;
use ash::vk;
use edgeshade::gpu::{Buffer, BufferDesc, Image, ImageDesc, MemoryKind};

#[test]
fn wrong_use_is_reported() {
    let messages = messages_of(|host| {
        let info = vk::BufferCreateInfo::default().size(4);
        let raw = &host.context().device().raw;
        // SAFETY: wrong on purpose (a buffer without a use); drivers tolerate it.
        unsafe {
            if let Ok(buffer) = raw.create_buffer(&info, None) {
                raw.destroy_buffer(buffer, None);
            }
        }
    });
    assert!(messages.iter().any(|m| m.contains("VUID-VkBufferCreateInfo")), "{messages:?}");
}

#[test]
fn a_missing_barrier_is_reported() {
    let messages = messages_of(|host| {
        let device = host.context().device();
        let desc = BufferDesc {
            name: "written twice",
            size: 16,
            usage: vk::BufferUsageFlags::TRANSFER_DST,
            memory: MemoryKind::Gpu,
        };
        let buffer = Buffer::new(device, &desc).unwrap();
        host.run(|cmd| {
            for value in 0..2 {
                // SAFETY: the buffer outlives the submission; the race is on purpose.
                unsafe { device.raw.cmd_fill_buffer(cmd, buffer.handle(), 0, 16, value) };
            }
            Ok(())
        })
        .unwrap();
    });
    // Newer layers write the hazard's name with other dashes.
    let hazards = messages.iter().map(|m| m.replace('_', "-"));
    assert!(hazards.into_iter().any(|m| m.contains("WRITE-AFTER-WRITE")), "{messages:?}");
}

#[test]
fn what_is_left_behind_is_reported() {
    let messages = messages_of(|host| {
        // SAFETY: leaked on purpose; the device is destroyed right after.
        let fence = unsafe { host.context().device().raw.create_fence(&vk::FenceCreateInfo::default(), None) };
        fence.unwrap();
    });
    assert!(messages.iter().any(|m| m.contains("vkDestroyDevice")), "{messages:?}");
}

#[test]
fn a_slow_way_is_reported() {
    let messages = messages_of(|host| {
        let device = host.context().device();
        let desc = ImageDesc::storage("copied into", vk::Format::R32_UINT, [4, 4]);
        let desc = ImageDesc { usage: desc.usage | vk::ImageUsageFlags::TRANSFER_DST, ..desc };
        let image = Image::new(device, &desc).unwrap();
        let usage = vk::BufferUsageFlags::TRANSFER_SRC;
        let desc = BufferDesc { name: "source", size: 64, usage, memory: MemoryKind::Gpu };
        let source = Buffer::new(device, &desc).unwrap();
        host.run(|cmd| {
            let layout = vk::ImageLayout::GENERAL;
            let barrier = vk::ImageMemoryBarrier2::default()
                .image(image.as_ref().image)
                .new_layout(layout)
                .dst_stage_mask(vk::PipelineStageFlags2::ALL_TRANSFER)
                .dst_access_mask(vk::AccessFlags2::TRANSFER_WRITE)
                .subresource_range(
                    vk::ImageSubresourceRange::default()
                        .aspect_mask(vk::ImageAspectFlags::COLOR)
                        .level_count(1)
                        .layer_count(1),
                );
            let barriers = [barrier];
            let region = vk::BufferImageCopy::default()
                .image_subresource(
                    vk::ImageSubresourceLayers::default().aspect_mask(vk::ImageAspectFlags::COLOR).layer_count(1),
                )
                .image_extent(vk::Extent3D { width: 4, height: 4, depth: 1 });
            // SAFETY: image and buffer outlive the submission; GENERAL is allowed for the copy, but not optimal.
            unsafe {
                let info = vk::DependencyInfo::default().image_memory_barriers(&barriers);
                device.raw.cmd_pipeline_barrier2(cmd, &info);
                let image = image.as_ref().image;
                device.raw.cmd_copy_buffer_to_image(cmd, source.handle(), image, layout, &[region]);
            }
            Ok(())
        })
        .unwrap();
    });
    if messages.is_empty() {
        println!("skipped: this validation layer does not report copies in the GENERAL layout");
        return;
    }
    assert!(messages.len() == 1 && messages[0].contains("For optimal performance"), "{messages:?}");
}
