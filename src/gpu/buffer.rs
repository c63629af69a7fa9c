//! Buffers that own their memory.

use super::Device;
use crate::Result;
use crate::error::VkContext;
use ash::vk;
use gpu_allocator::MemoryLocation;
use gpu_allocator::vulkan::{Allocation, AllocationCreateDesc, AllocationScheme};
use std::sync::Arc;

/// Kind of memory that holds a buffer.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum MemoryKind {
    /// Memory of the GPU, filled by a transfer or a shader.
    Gpu,
    /// Mapped memory that the CPU writes.
    Upload,
    /// Mapped memory that the CPU reads.
    Readback,
}

/// Description of a [`Buffer`] to make.
#[derive(Clone, Copy, Debug)]
pub struct BufferDesc<'a> {
    /// Debug name.
    pub name: &'a str,
    /// Size in bytes. Sizes below 4 are raised to 4, because Vulkan has no empty buffers.
    pub size: u64,
    /// Vulkan usage.
    pub usage: vk::BufferUsageFlags,
    /// Kind of memory.
    pub memory: MemoryKind,
}

/// A buffer with its memory. The owner must not drop it while the GPU still uses it.
pub struct Buffer {
    device: Arc<Device>,
    allocation: Option<Allocation>,
    handle: vk::Buffer,
    size: u64,
}

impl Buffer {
    /// Makes the buffer and allocates its memory. On a device that only compiles, which has no memory, there is no
    /// Vulkan buffer behind it.
    pub fn new(device: &Arc<Device>, desc: &BufferDesc<'_>) -> Result<Self> {
        let size = desc.size.max(4);
        if !device.has_memory() {
            return Ok(Self { device: device.clone(), allocation: None, handle: vk::Buffer::null(), size });
        }
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

    /// Size in bytes.
    pub fn size(&self) -> u64 {
        self.size
    }

    /// The mapped bytes of an upload or readback buffer; empty for a buffer that is not mapped.
    pub fn bytes(&self) -> &[u8] {
        let mapped = self.allocation.as_ref().and_then(|a| a.mapped_slice());
        mapped.map_or(&[], |m| &m[..self.size as usize])
    }

    /// Writes into the mapped bytes of an upload buffer. Returns false if the buffer is not mapped or too small. On a
    /// device that only compiles, which has no memory, the bytes are dropped.
    pub fn write(&mut self, offset: usize, bytes: &[u8]) -> bool {
        if !self.device.has_memory() {
            return (offset + bytes.len()) as u64 <= self.size;
        }
        let mapped = self.allocation.as_mut().and_then(|a| a.mapped_slice_mut());
        let target = mapped.and_then(|m| m.get_mut(offset..offset + bytes.len()));
        target.map(|t| t.copy_from_slice(bytes)).is_some()
    }
}

impl Drop for Buffer {
    fn drop(&mut self) {
        // SAFETY: the owner guarantees that the GPU is done with it.
        unsafe { self.device.raw.destroy_buffer(self.handle, None) };
        if let Some(allocation) = self.allocation.take() {
            self.device.free(allocation);
        }
    }
}
