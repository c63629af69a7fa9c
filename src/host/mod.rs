//! A Vulkan device that Edgeshade opens itself, for the command-line tool, the tests and the benchmarks.

mod clock;
mod owner;
mod select;
mod transfer;

pub use clock::Timing;
pub use owner::Messages;
pub use select::{DeviceInfo, devices};

use crate::error::VkContext;
use crate::timing::{FrameTiming, Timings};
use crate::{Context, ContextDesc, Error, Frame, Handoff, Result};
use ash::vk;
use clock::{Clock, Span, accounts_for, agree, by_wall_clock};
use owner::Owner;
use std::cell::Cell;
use std::sync::Arc;
use std::time::Instant;

/// Options for opening a device.
#[derive(Clone, Debug)]
pub struct HostDesc {
    /// Index in [`devices`] or part of a device's name; `None` takes a device of the fastest kind.
    pub device: Option<String>,
    /// Turns on the validation layer with synchronization validation and collects its messages.
    pub validation: bool,
    /// Clock that the times of passes come from. `None` takes timestamps unless they miss work, as those of Mesa 25's
    /// CPU driver miss compute passes. The first frame is repeated to find out.
    pub timing: Option<Timing>,
    /// Opens the device for its compiler alone: pipelines are made with statistics where the driver has them, nothing is
    /// ever submitted, and a device without memory will do, such as RADV's null hardware.
    pub compile_only: bool,
}

impl Default for HostDesc {
    fn default() -> Self {
        Self { device: None, validation: false, timing: Some(Timing::Timestamps), compile_only: false }
    }
}

/// Instance, device, one queue and the library's context. The host waits for everything that it submits.
pub struct Host {
    owner: Arc<Owner>,
    context: Context,
    pool: vk::CommandPool,
    fence: vk::Fence,
    info: DeviceInfo,
    /// `None` until the first frame has shown which clock is right.
    timing: Cell<Option<Timing>>,
}

impl Host {
    /// Opens a device.
    ///
    /// # Errors
    /// [`Error::NoDevice`] says what to install, or which feature the device lacks.
    pub fn new(desc: &HostDesc) -> Result<Self> {
        let owner = Arc::new(Owner::new(desc)?);
        // SAFETY: the owner made the handles with the required features and extensions. The context holds the owner,
        // so the owner outlives it.
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
        let info = DeviceInfo::new(&owner.instance, owner.physical_device);
        let (pool, fence) = Default::default();
        let mut host = Self { owner, context, pool, fence, info, timing: Cell::new(desc.timing) };
        if !desc.compile_only {
            host.make_ready()?;
        }
        Ok(host)
    }

    /// Makes the objects that submissions need. Null hardware has none.
    fn make_ready(&mut self) -> Result<()> {
        let device = &self.owner.device;
        let info = vk::CommandPoolCreateInfo::default()
            .queue_family_index(self.owner.queue_family)
            .flags(vk::CommandPoolCreateFlags::TRANSIENT);
        // SAFETY: plain creation on a live device; `drop` destroys the pool.
        self.pool = unsafe { device.create_command_pool(&info, None) }.context("vkCreateCommandPool")?;
        // SAFETY: as above.
        self.fence = unsafe { device.create_fence(&vk::FenceCreateInfo::default(), None) }.context("vkCreateFence")?;
        self.context.device().name(self.pool, "host");
        self.context.device().name(self.fence, "host");
        Ok(())
    }

    /// The library's context on this device.
    pub fn context(&self) -> &Context {
        &self.context
    }

    /// Description of the device.
    pub fn info(&self) -> &DeviceInfo {
        &self.info
    }

    /// Family of the queue that everything runs on.
    pub fn queue_family(&self) -> u32 {
        self.owner.queue_family
    }

    /// Messages of the validation layer so far.
    pub fn messages(&self) -> &Messages {
        &self.owner.messages
    }

    /// True if the device clamps depth instead of clipping.
    pub fn depth_clamp(&self) -> bool {
        self.owner.features.depth_clamp
    }

    /// Clock that the times of [`Host::frame`] come from. Unless [`HostDesc::timing`] chose it, ask after the first
    /// frame.
    pub fn timing(&self) -> Timing {
        self.timing.get().unwrap_or_default()
    }

    /// Records a command buffer, submits it and waits until it has run.
    pub fn run<T>(&self, record: impl FnOnce(vk::CommandBuffer) -> Result<T>) -> Result<T> {
        let cmd = self.begin()?;
        let result = record(cmd).and_then(|value| self.submit(cmd).map(|_| value));
        self.free(&[cmd]);
        result
    }

    /// Records a frame, runs it, waits for it and returns its times. `record` ends the frame. It is called several
    /// times while the host has yet to find out which clock is right.
    pub fn frame(&self, timings: &mut Timings, mut record: impl FnMut(Frame<'_>) -> Result<()>) -> Result<FrameTiming> {
        match self.timing.get() {
            Some(Timing::Timestamps) => Ok(self.whole_frame(timings, &mut record)?.0),
            Some(Timing::Wall) => {
                let (frame, spans) = self.cut_frame(timings, &mut record)?;
                Ok(by_wall_clock(frame, &spans))
            }
            None => {
                // Warms up: in the first frame drivers compile shaders, which takes far longer than the frame itself.
                self.whole_frame(timings, &mut record)?;
                let (frame, ms) = self.whole_frame(timings, &mut record)?;
                if accounts_for(&frame, ms) {
                    self.timing.set(Some(Timing::Timestamps));
                    return Ok(frame);
                }
                let (cut, spans) = self.cut_frame(timings, &mut record)?;
                let (timing, frame) = match agree(&frame, &spans) {
                    true => (Timing::Timestamps, frame),
                    false => (Timing::Wall, by_wall_clock(cut, &spans)),
                };
                self.timing.set(Some(timing));
                Ok(frame)
            }
        }
    }

    /// Runs a frame in one submission; also returns its milliseconds by the host's clock.
    fn whole_frame(
        &self,
        timings: &mut Timings,
        record: &mut impl FnMut(Frame<'_>) -> Result<()>,
    ) -> Result<(FrameTiming, f64)> {
        let cmd = self.begin()?;
        // SAFETY: `cmd` is recording; all work goes to the host's one queue and is waited for.
        let frame = unsafe { Frame::begin(&self.context, cmd, Handoff::default(), Some(timings)) };
        let result = record(frame).and_then(|()| self.submit(cmd));
        self.free(&[cmd]);
        result.map(|ms| (timings.poll().pop().unwrap_or_default(), ms))
    }

    /// Runs a frame in one submission for each pass.
    fn cut_frame(
        &self,
        timings: &mut Timings,
        record: &mut impl FnMut(Frame<'_>) -> Result<()>,
    ) -> Result<(FrameTiming, Vec<Span>)> {
        let cmd = self.begin()?;
        let mut clock = Clock::new(self, cmd);
        let mut cut = |pass: Option<&str>| clock.cut(pass);
        // SAFETY: as in `whole_frame`; the same holds for every command buffer that the clock hands out.
        let frame = unsafe { Frame::begin_cut(&self.context, cmd, timings, &mut cut) };
        let result = record(frame).and_then(|()| clock.finish());
        self.free(&clock.commands);
        result.map(|()| (timings.poll().pop().unwrap_or_default(), clock.spans))
    }

    /// Allocates a command buffer and begins to record it.
    fn begin(&self) -> Result<vk::CommandBuffer> {
        if self.owner.compile_only {
            let problem = "the device was opened for its compiler alone (HostDesc::compile_only): it runs no commands";
            return Err(Error::Usage(problem.into()));
        }
        let device = &self.owner.device;
        let info = vk::CommandBufferAllocateInfo::default().command_pool(self.pool).command_buffer_count(1);
        // SAFETY: the pool is used by this thread only (`Host` is not `Sync`).
        let cmd = unsafe { device.allocate_command_buffers(&info) }.context("vkAllocateCommandBuffers")?[0];
        let begin = vk::CommandBufferBeginInfo::default().flags(vk::CommandBufferUsageFlags::ONE_TIME_SUBMIT);
        // SAFETY: the buffer was just allocated.
        let begun = unsafe { device.begin_command_buffer(cmd, &begin) }.context("vkBeginCommandBuffer");
        if begun.is_err() {
            self.free(&[cmd]);
        }
        begun.map(|()| cmd)
    }

    /// Ends a command buffer and runs it; returns the milliseconds from submitting to the end of the wait.
    fn submit(&self, cmd: vk::CommandBuffer) -> Result<f64> {
        let device = &self.owner.device;
        let commands = [cmd];
        let submit = [vk::SubmitInfo::default().command_buffers(&commands)];
        // SAFETY: the buffer is recording and is submitted once. The fence is not in use, because every submission is
        // waited for.
        unsafe {
            device.end_command_buffer(cmd).context("vkEndCommandBuffer")?;
            let started = Instant::now();
            device.queue_submit(self.owner.queue, &submit, self.fence).context("vkQueueSubmit")?;
            device.wait_for_fences(&[self.fence], true, u64::MAX).context("vkWaitForFences")?;
            let ms = started.elapsed().as_secs_f64() * 1e3;
            device.reset_fences(&[self.fence]).context("vkResetFences")?;
            Ok(ms)
        }
    }

    fn free(&self, commands: &[vk::CommandBuffer]) {
        // SAFETY: the buffers belong to the pool, and either have run or were never submitted.
        unsafe { self.owner.device.free_command_buffers(self.pool, commands) };
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

/// Error for a machine without a usable driver.
fn no_driver(detail: &str) -> Error {
    Error::NoDevice(format!(
        "{detail}\nEdgeshade needs a Vulkan 1.3 driver. On Debian or Ubuntu, `sudo apt-get install mesa-vulkan-drivers \
         libvulkan1` installs drivers for most GPUs and one that runs on the CPU; for NVIDIA install the vendor's driver."
    ))
}
