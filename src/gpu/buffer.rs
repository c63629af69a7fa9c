//! Buffers that own their memory.

use super::Device;
use crate::Result;
use crate::error::VkContext;
use ash::vk;
use gpu_allocator::MemoryLocation;
use gpu_allocator::vulkan::{Allocation, AllocationCreateDesc, AllocationScheme};
use std::sync::Arc;

/// Where a buffer's memory lies.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum MemoryKind {
    /// On the GPU; filled by a transfer or a shader.
    Gpu,
    /// Mapped, for writing by the CPU.
    Upload,
    /// Mapped, for reading by the CPU.
    Readback,
}

/// What to make a [`Buffer`] of.
#[derive(Clone, Copy, Debug)]
pub struct BufferDesc<'a> {
    /// Debug name.
    pub name: &'a str,
    /// Bytes; 0 is rounded up to 4, since Vulkan has no empty buffer.
    pub size: u64,
    /// Vulkan usage.
    pub usage: vk::BufferUsageFlags,
    /// Where it lies.
    pub memory: MemoryKind,
}

/// A buffer with its memory. Dropping it while the GPU still uses it is the owner's mistake.
pub struct Buffer {
    device: Arc<Device>,
    allocation: Option<Allocation>,
    handle: vk::Buffer,
    size: u64,
}

impl Buffer {
    /// Allocates.
    pub fn new(device: &Arc<Device>, desc: &BufferDesc<'_>) -> Result<Self> {
        let size = desc.size.max(4);
        let info = vk::BufferCreateInfo::default().size(size).usage(desc.usage);
        // SAFETY: the create info is complete.
        let handle = unsafe { device.raw.create_buffer(&info, None) }
            .context(format!("vkCreateBuffer({}, {size} bytes)", desc.name))?;
        device.name(handle, desc.name);
        let mut buffer = Self { device: device.clone(), allocation: None, handle, size };
        // SAFETY: the handle was just made.
        let requirements = unsafe { device.raw.get_buffer_memory_requirements(handle) };
        let allocation = device.allocate(&AllocationCreateDesc {
            name: desc.name,
            requirements,
            location: match desc.memory {
                MemoryKind::Gpu => MemoryLocation::GpuOnly,
                MemoryKind::Upload => MemoryLocation::CpuToGpu,
                MemoryKind::Readback => MemoryLocation::GpuToCpu,
            },
            linear: true,
            allocation_scheme: AllocationScheme::GpuAllocatorManaged,
        })?;
        // SAFETY: the memory was allocated for these requirements and is bound once.
        unsafe { device.raw.bind_buffer_memory(handle, allocation.memory(), allocation.offset()) }
            .context(format!("vkBindBufferMemory({})", desc.name))?;
        buffer.allocation = Some(allocation);
        Ok(buffer)
    }

    /// The Vulkan handle.
    pub fn handle(&self) -> vk::Buffer {
        self.handle
    }

    /// Bytes.
    pub fn size(&self) -> u64 {
        self.size
    }

    /// The mapped bytes of an upload or readback buffer; empty for one that is not mapped.
    pub fn bytes(&self) -> &[u8] {
        let mapped = self.allocation.as_ref().and_then(|a| a.mapped_slice());
        mapped.map_or(&[], |m| &m[..self.size as usize])
    }

    /// Writes into the mapped bytes of an upload buffer. False if it is not mapped or too small.
    pub fn write(&mut self, offset: usize, bytes: &[u8]) -> bool {
        let mapped = self.allocation.as_mut().and_then(|a| a.mapped_slice_mut());
        let target = mapped.and_then(|m| m.get_mut(offset..offset + bytes.len()));
        target.map(|t| t.copy_from_slice(bytes)).is_some()
    }
}

impl Drop for Buffer {
    fn drop(&mut self) {
        // SAFETY: the owner vouches that the GPU is done with it.
        unsafe { self.device.raw.destroy_buffer(self.handle, None) };
        if let Some(allocation) = self.allocation.take() {
            self.device.free(allocation);
        }
    }
}
