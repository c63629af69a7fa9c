//! A Vulkan device of our own, for the command-line tool, the tests and the benchmarks.

mod owner;
mod select;
mod transfer;

pub use owner::Messages;
pub use select::{DeviceInfo, devices};

use crate::error::VkContext;
use crate::{Context, ContextDesc, Error, Result};
use ash::vk;
use owner::Owner;
use std::sync::Arc;

/// What kind of device to open.
#[derive(Clone, Debug, Default)]
pub struct HostDesc {
    /// Index in [`devices`], or part of a name; `None` takes the fastest kind there is.
    pub device: Option<String>,
    /// Turn on the validation layer with synchronization validation, and collect its messages.
    pub validation: bool,
}

/// Instance, device, one queue and the library's context. Work is submitted and waited for.
pub struct Host {
    owner: Arc<Owner>,
    context: Context,
    pool: vk::CommandPool,
    fence: vk::Fence,
    info: DeviceInfo,
}

impl Host {
    /// Opens a device.
    ///
    /// # Errors
    /// [`Error::NoDevice`] says what to install, or which feature the device lacks.
    pub fn new(desc: &HostDesc) -> Result<Self> {
        let owner = Arc::new(Owner::new(desc)?);
        // SAFETY: the owner made the handles with what the library requires, and outlives the context,
        // which holds it.
        let context = unsafe {
            Context::new(&ContextDesc {
                instance: &owner.instance,
                physical_device: owner.physical_device,
                device: &owner.device,
                features: owner.features,
                debug_utils: owner.debug_utils,
                allocator: None,
                pipeline_cache: vk::PipelineCache::null(),
                keep_alive: Some(owner.clone()),
            })
        }?;
        let pool_info = vk::CommandPoolCreateInfo::default()
            .queue_family_index(owner.queue_family)
            .flags(vk::CommandPoolCreateFlags::TRANSIENT);
        // SAFETY: plain creations on a live device.
        let pool = unsafe { owner.device.create_command_pool(&pool_info, None) }.context("vkCreateCommandPool")?;
        // SAFETY: as above.
        let fence =
            unsafe { owner.device.create_fence(&vk::FenceCreateInfo::default(), None) }.context("vkCreateFence")?;
        context.device().name(pool, "host");
        context.device().name(fence, "host");
        let info = DeviceInfo::new(&owner.instance, owner.physical_device);
        Ok(Self { owner, context, pool, fence, info })
    }

    /// The library's context on this device.
    pub fn context(&self) -> &Context {
        &self.context
    }

    /// What the device is.
    pub fn info(&self) -> &DeviceInfo {
        &self.info
    }

    /// Family of the queue that everything runs on.
    pub fn queue_family(&self) -> u32 {
        self.owner.queue_family
    }

    /// What the validation layer has said so far.
    pub fn messages(&self) -> &Messages {
        &self.owner.messages
    }

    /// True if the device clamps depth instead of clipping.
    pub fn depth_clamp(&self) -> bool {
        self.owner.features.depth_clamp
    }

    /// Records a command buffer, submits it and waits until it has run.
    pub fn run<T>(&self, record: impl FnOnce(vk::CommandBuffer) -> Result<T>) -> Result<T> {
        let device = &self.owner.device;
        let info = vk::CommandBufferAllocateInfo::default().command_pool(self.pool).command_buffer_count(1);
        // SAFETY: the pool is used by this thread only (`Host` is not `Sync`).
        let cmd = unsafe { device.allocate_command_buffers(&info) }.context("vkAllocateCommandBuffers")?[0];
        let begin = vk::CommandBufferBeginInfo::default().flags(vk::CommandBufferUsageFlags::ONE_TIME_SUBMIT);
        let commands = [cmd];
        // SAFETY: the buffer was just allocated, is submitted once and freed after the fence.
        let result = unsafe {
            (|| {
                device.begin_command_buffer(cmd, &begin).context("vkBeginCommandBuffer")?;
                let value = record(cmd)?;
                device.end_command_buffer(cmd).context("vkEndCommandBuffer")?;
                let submit = [vk::SubmitInfo::default().command_buffers(&commands)];
                device.queue_submit(self.owner.queue, &submit, self.fence).context("vkQueueSubmit")?;
                device.wait_for_fences(&[self.fence], true, u64::MAX).context("vkWaitForFences")?;
                device.reset_fences(&[self.fence]).context("vkResetFences")?;
                Ok(value)
            })()
        };
        // SAFETY: recorded only, or finished.
        unsafe { device.free_command_buffers(self.pool, &commands) };
        result
    }
}

impl Drop for Host {
    fn drop(&mut self) {
        // SAFETY: every submission was waited for.
        unsafe {
            self.owner.device.destroy_fence(self.fence, None);
            self.owner.device.destroy_command_pool(self.pool, None);
        }
    }
}

/// Text for a machine without a usable driver.
fn no_driver(detail: &str) -> Error {
    Error::NoDevice(format!(
        "{detail}\nEdgeshade needs a Vulkan 1.3 driver. On Debian or Ubuntu, `sudo apt-get install mesa-vulkan-drivers \
         libvulkan1` installs drivers for most GPUs and one that runs on the CPU; for NVIDIA install the vendor's driver."
    ))
}
