//! One frame's recording: labels, barriers, timestamps, bindings, dispatches. Nothing else records.

mod bind;
mod copy;
mod raster;
#[cfg(feature = "app")]
mod transfer;

pub use bind::Bind;
pub(crate) use raster::{Bound, Draw, RasterPass, Target};

use crate::context::Context;
use crate::gpu::{Buffer, ComputePipeline, Image};
use crate::hazard::{Barrier, Hazards, Use};
use crate::inputs::{Handoff, ImageRef};
use crate::timing::{Counted, Timings};
use crate::{Error, Result};
use ash::vk::{self, Handle};
use std::ffi::CString;

/// How many workgroups run.
#[derive(Clone, Copy)]
pub enum Threads<'a> {
    /// At least this many threads in x, y and z, rounded up to whole workgroups.
    Count([u32; 3]),
    /// As many workgroups as a `VkDispatchIndirectCommand` at this offset of a buffer says.
    Indirect(&'a Buffer, u64),
}

/// One compute pass.
pub struct Pass<'a> {
    /// Name for labels and timings.
    pub name: &'a str,
    /// What runs.
    pub pipeline: &'a ComputePipeline,
    /// What is bound, in ascending order of the shader's bindings.
    pub bind: &'a [Bind<'a>],
    /// Push constants; see [`crate::gpu::ShaderStruct`].
    pub push: &'a [u8],
    /// How much runs.
    pub threads: Threads<'a>,
}

/// Records into the caller's command buffer, from [`Frame::begin`] to [`Frame::finish`].
pub struct Frame<'a> {
    context: &'a Context,
    cmd: vk::CommandBuffer,
    handoff: Handoff,
    timings: Option<&'a mut Timings>,
    hazards: Hazards,
    groups: u32,
    /// The stages in which this frame and those before it touch memory, as far as this frame has waited for them.
    stages: vk::PipelineStageFlags2,
    /// Called before each pass, with its name, and after it.
    #[cfg(feature = "app")]
    cut: Option<Cut<'a>>,
}

/// Takes away the command buffer recorded so far and returns one to go on with, which is recording for the same queue.
#[cfg(feature = "app")]
pub(crate) type Cut<'a> = &'a mut dyn FnMut(Option<&str>) -> vk::CommandBuffer;

/// Every stage in which the library itself touches memory, those of raster passes apart.
const OWN_STAGES: vk::PipelineStageFlags2 = vk::PipelineStageFlags2::from_raw(
    vk::PipelineStageFlags2::COMPUTE_SHADER.as_raw()
        | vk::PipelineStageFlags2::DRAW_INDIRECT.as_raw()
        | vk::PipelineStageFlags2::ALL_TRANSFER.as_raw(),
);
const MEMORY: vk::AccessFlags2 =
    vk::AccessFlags2::from_raw(vk::AccessFlags2::MEMORY_READ.as_raw() | vk::AccessFlags2::MEMORY_WRITE.as_raw());

impl<'a> Frame<'a> {
    /// Starts recording. `handoff` says how the caller reads the output, of this frame and of the one
    /// before: the library's images are reused from frame to frame on the same queue, ordered by a
    /// barrier here, so any number of frames may be in flight.
    ///
    /// # Safety
    /// `cmd` is recording, outside a render pass, for a queue with compute (and graphics, for techniques with raster passes), and belongs to the
    /// context's device. Command buffers recorded through one context are submitted to one queue, in
    /// the order of their recording; none is thrown away, since layouts and kept results are tracked as
    /// recorded. Techniques and inputs outlive the execution.
    pub unsafe fn begin(
        context: &'a Context,
        cmd: vk::CommandBuffer,
        handoff: Handoff,
        timings: Option<&'a mut Timings>,
    ) -> Self {
        let mut frame = Self {
            context,
            cmd,
            handoff,
            timings,
            hazards: Hazards::default(),
            groups: 0,
            stages: OWN_STAGES,
            #[cfg(feature = "app")]
            cut: None,
        };
        frame.stages |= frame.raster_stages();
        if let Some(timings) = &mut frame.timings {
            timings.begin(cmd);
        }
        frame.memory_barrier(&Barrier {
            src_stage: frame.stages | handoff.stage,
            src_access: vk::AccessFlags2::MEMORY_WRITE,
            dst_stage: frame.stages,
            dst_access: MEMORY,
        });
        frame
    }

    /// Starts a recording that is cut into several command buffers, one a pass. Barriers and debug labels hold across
    /// them: both are of the queue's order, not of a command buffer.
    ///
    /// # Safety
    /// That of [`Frame::begin`]; what `cut` takes away is submitted at once.
    #[cfg(feature = "app")]
    pub(crate) unsafe fn begin_cut(
        context: &'a Context,
        cmd: vk::CommandBuffer,
        timings: &'a mut Timings,
        cut: Cut<'a>,
    ) -> Self {
        // SAFETY: vouched for by the caller.
        let frame = unsafe { Self::begin(context, cmd, Handoff::default(), Some(timings)) };
        Self { cut: Some(cut), ..frame }
    }

    /// The context this frame records for.
    pub fn context(&self) -> &'a Context {
        self.context
    }

    /// Opens a labelled group of passes; close it with [`Frame::end_group`].
    pub fn begin_group(&mut self, name: &str) {
        self.groups += 1;
        self.begin_label(name);
    }

    /// Closes the innermost group.
    pub fn end_group(&mut self) {
        if self.groups > 0 {
            self.groups -= 1;
            self.end_label();
        }
    }

    /// Runs a compute pass, after the barrier that it needs, if it needs one.
    pub(crate) fn dispatch(&mut self, pass: &Pass<'_>) -> Result<()> {
        let interface = &pass.pipeline.interface;
        interface.check(pass.bind)?;
        if pass.push.len() != interface.push_size as usize {
            let problem = format!("got {} bytes of push constants", pass.push.len());
            return Err(Error::Shader { shader: interface.name.clone(), problem });
        }
        let mut uses = interface.uses(pass.bind);
        if let Threads::Indirect(buffer, _) = pass.threads {
            uses.push((buffer.handle().as_raw(), INDIRECT_USE));
        }
        self.transition(pass.bind.iter().filter_map(|b| b.owned()), vk::PipelineStageFlags2::COMPUTE_SHADER);
        self.hazard(&uses);
        let query = self.begin_pass(pass.name);
        let (raw, cmd) = (&self.context.device().raw, self.cmd);
        // SAFETY: the command buffer records (contract of `begin`); bindings and push constants were
        // checked against the shader above.
        unsafe {
            raw.cmd_bind_pipeline(cmd, vk::PipelineBindPoint::COMPUTE, pass.pipeline.handle);
            self.push_descriptors(vk::PipelineBindPoint::COMPUTE, interface, pass.bind);
            if !pass.push.is_empty() {
                raw.cmd_push_constants(cmd, interface.layout, interface.push_stages, 0, pass.push);
            }
            match pass.threads {
                Threads::Count(n) => {
                    let groups: [u32; 3] =
                        std::array::from_fn(|i| n[i].div_ceil(pass.pipeline.reflection.local_size[i]));
                    if !groups.contains(&0) {
                        raw.cmd_dispatch(cmd, groups[0], groups[1], groups[2]);
                    }
                }
                Threads::Indirect(buffer, offset) => raw.cmd_dispatch_indirect(cmd, buffer.handle(), offset),
            }
        }
        self.end_pass(query);
        Ok(())
    }

    /// Writes bytes (a multiple of 4) into a buffer, in stream order: no CPU copy to keep.
    pub(crate) fn update(&mut self, buffer: &Buffer, bytes: &[u8]) {
        self.hazard(&[(buffer.handle().as_raw(), TRANSFER_USE)]);
        for (i, part) in bytes.chunks(UPDATE).enumerate() {
            let raw = &self.context.device().raw;
            // SAFETY: `begin`'s contract; the callers size the buffer for the bytes.
            unsafe { raw.cmd_update_buffer(self.cmd, buffer.handle(), (i * UPDATE) as u64, part) };
        }
    }

    /// Notes how many tiles the pass recorded last worked on: a `u32` at `offset` of `counter`.
    pub(crate) fn count_tiles(&mut self, tiles_total: u32, counter: &Buffer, offset: u64) {
        self.count(Counted::Tiles(tiles_total), counter, offset);
    }

    /// Notes something that the pass recorded last has counted: a `u32` at `offset` of `counter`.
    pub(crate) fn count(&mut self, counted: Counted, counter: &Buffer, offset: u64) {
        if self.timings.is_none() {
            return;
        }
        let read = Use { stage: TRANSFER_USE.stage, access: vk::AccessFlags2::TRANSFER_READ, writes: false };
        self.hazard(&[(counter.handle().as_raw(), read)]);
        let raw = &self.context.device().raw;
        if let Some((target, at)) = self.timings.as_mut().and_then(|t| t.counter(counted)) {
            let region = vk::BufferCopy { src_offset: offset, dst_offset: at, size: 4 };
            // SAFETY: both ranges lie within their buffers.
            unsafe { raw.cmd_copy_buffer(self.cmd, counter.handle(), target.handle(), &[region]) };
        }
    }

    /// Ends recording and hands `output` over as the caller asked at [`Frame::begin`]: the result is the image
    /// in the layout that it is left in. Image and view stay the same for as long as the technique lives.
    pub fn finish(mut self, output: &Image) -> ImageRef {
        self.close();
        let barrier = self
            .image_barrier(output, self.handoff.layout)
            .src_stage_mask(self.stages)
            .src_access_mask(vk::AccessFlags2::MEMORY_WRITE)
            .dst_stage_mask(self.handoff.stage)
            .dst_access_mask(self.handoff.access);
        self.image_barriers(&[barrier]);
        ImageRef { layout: self.handoff.layout, ..output.as_ref() }
    }

    /// Ends a recording that hands nothing over.
    pub fn end(mut self) {
        self.close();
    }

    fn close(&mut self) {
        while self.groups > 0 {
            self.end_group();
        }
        if let Some(timings) = self.timings.as_ref().filter(|t| t.has_counters()) {
            self.memory_barrier(&TO_HOST);
            timings.end_counters(self.cmd);
        }
    }

    fn image_barrier(&self, image: &Image, new: vk::ImageLayout) -> vk::ImageMemoryBarrier2<'static> {
        let r = image.as_ref();
        vk::ImageMemoryBarrier2::default()
            .image(r.image)
            .old_layout(image.swap_layout(new))
            .new_layout(new)
            .src_queue_family_index(vk::QUEUE_FAMILY_IGNORED)
            .dst_queue_family_index(vk::QUEUE_FAMILY_IGNORED)
            .subresource_range(vk::ImageSubresourceRange {
                aspect_mask: crate::gpu::full_aspect(r.format),
                base_mip_level: 0,
                level_count: vk::REMAINING_MIP_LEVELS,
                base_array_layer: 0,
                layer_count: vk::REMAINING_ARRAY_LAYERS,
            })
    }

    fn image_barriers(&self, barriers: &[vk::ImageMemoryBarrier2<'_>]) {
        let info = vk::DependencyInfo::default().image_memory_barriers(barriers);
        // SAFETY: `begin`'s contract; the old layouts are those that the last barrier left.
        unsafe { self.context.device().raw.cmd_pipeline_barrier2(self.cmd, &info) };
    }

    /// Brings images of ours into `GENERAL` where they are not: at first use and after a hand-over.
    fn transition<'i>(&self, images: impl Iterator<Item = &'i Image>, stage: vk::PipelineStageFlags2) {
        let barriers: Vec<_> = images
            .filter(|i| i.layout() != vk::ImageLayout::GENERAL)
            .map(|i| {
                self.image_barrier(i, vk::ImageLayout::GENERAL)
                    .src_stage_mask(self.stages | self.handoff.stage | stage)
                    .src_access_mask(vk::AccessFlags2::MEMORY_WRITE)
                    .dst_stage_mask(self.stages | stage)
                    .dst_access_mask(MEMORY)
            })
            .collect();
        if !barriers.is_empty() {
            self.image_barriers(&barriers);
        }
    }

    fn hazard(&mut self, uses: &[(u64, Use)]) {
        let barrier = self.hazards.before(uses);
        if !barrier.is_empty() {
            self.memory_barrier(&barrier);
        }
    }

    fn memory_barrier(&self, b: &Barrier) {
        let barriers = [vk::MemoryBarrier2::default()
            .src_stage_mask(b.src_stage)
            .src_access_mask(b.src_access)
            .dst_stage_mask(b.dst_stage)
            .dst_access_mask(b.dst_access)];
        let info = vk::DependencyInfo::default().memory_barriers(&barriers);
        // SAFETY: `begin`'s contract.
        unsafe { self.context.device().raw.cmd_pipeline_barrier2(self.cmd, &info) };
    }

    fn begin_pass(&mut self, name: &str) -> Option<u32> {
        self.cut(Some(name));
        self.begin_label(name);
        let cmd = self.cmd;
        self.timings.as_mut().and_then(|t| t.begin_pass(cmd, name))
    }

    fn end_pass(&mut self, query: Option<u32>) {
        if let Some(timings) = &self.timings {
            timings.end_pass(self.cmd, query);
        }
        self.end_label();
        self.cut(None);
    }

    /// Passes begin and end here, for a frame that is cut into passes.
    #[inline]
    fn cut(&mut self, _next: Option<&str>) {
        #[cfg(feature = "app")]
        if let Some(cut) = &mut self.cut {
            self.cmd = cut(_next);
        }
    }

    fn begin_label(&self, name: &str) {
        let Some(debug) = &self.context.device().debug_utils else { return };
        let name = CString::new(name).unwrap_or_default();
        let label = vk::DebugUtilsLabelEXT::default().label_name(&name);
        // SAFETY: `begin`'s contract.
        unsafe { debug.cmd_begin_debug_utils_label(self.cmd, &label) };
    }

    fn end_label(&self) {
        if let Some(debug) = &self.context.device().debug_utils {
            // SAFETY: every call follows a `begin_label`.
            unsafe { debug.cmd_end_debug_utils_label(self.cmd) };
        }
    }
}

/// What makes copies visible to the CPU once a fence has signalled.
const TO_HOST: Barrier = Barrier {
    src_stage: vk::PipelineStageFlags2::ALL_TRANSFER,
    src_access: vk::AccessFlags2::TRANSFER_WRITE,
    dst_stage: vk::PipelineStageFlags2::HOST,
    dst_access: vk::AccessFlags2::HOST_READ,
};

/// Bytes that one command may update.
const UPDATE: usize = 65536;

const INDIRECT_USE: Use = Use {
    stage: vk::PipelineStageFlags2::DRAW_INDIRECT,
    access: vk::AccessFlags2::INDIRECT_COMMAND_READ,
    writes: false,
};
const TRANSFER_USE: Use =
    Use { stage: vk::PipelineStageFlags2::ALL_TRANSFER, access: vk::AccessFlags2::TRANSFER_WRITE, writes: true };
