//! The validation layer listens: a test without messages means something.

use crate::common::messages_of;
use ash::vk;
use edgeshade::gpu::{Buffer, BufferDesc, MemoryKind};

#[test]
fn wrong_use_is_reported() {
    let messages = messages_of(|host| {
        let info = vk::BufferCreateInfo::default().size(4);
        let raw = &host.context().device().raw;
        // SAFETY: wrong on purpose (a buffer without a use), which drivers bear.
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
    assert!(messages.iter().any(|m| m.contains("SYNC-HAZARD-WRITE-AFTER-WRITE")), "{messages:?}");
}

#[test]
fn what_is_left_behind_is_reported() {
    let messages = messages_of(|host| {
        // SAFETY: leaked on purpose; the device goes right after.
        let fence = unsafe { host.context().device().raw.create_fence(&vk::FenceCreateInfo::default(), None) };
        fence.unwrap();
    });
    assert!(messages.iter().any(|m| m.contains("vkDestroyDevice")), "{messages:?}");
}
