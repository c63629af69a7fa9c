//! Recording of one frame: labels, barriers, timestamps, bindings, dispatches and draws. No other module records
//! commands.

mod bind;
mod copy;
mod raster;
#[cfg(feature = "app")]
mod transfer;

pub use crate::gpu::Bind;
pub(crate) use raster::{Bound, Draw, RasterPass, Target};

use crate::context::Context;
use crate::gpu::{Bindings, Buffer, ComputePipeline, Image, ImageRef, Recorded};
use crate::hazard::{Barrier, Hazards, Use};
use crate::inputs::Handoff;
use crate::timing::{Counted, Timings};
use crate::{Error, Result};
use ash::vk::{self, Handle};
use std::borrow::Cow;
use std::ffi::CString;

/// Number of workgroups that run.
#[derive(Clone, Copy)]
pub enum Threads<'a> {
    /// Number of threads in x, y and z, rounded up to whole workgroups.
    Count([u32; 3]),
    /// Buffer and byte offset of a `VkDispatchIndirectCommand` that holds the number of workgroups.
    Indirect(&'a Buffer, u64),
}

/// One compute pass.
pub struct Pass<'a> {
    /// Name for labels and timings; unique among the passes that a technique records into a frame.
    pub name: &'a str,
    /// Pipeline that runs.
    pub pipeline: &'a ComputePipeline,
    /// Resources of the pass, in a value of the type that the pipeline was made with.
    pub bind: &'a dyn Bindings,
    /// Push constants; see [`crate::gpu::ShaderStruct`].
    pub push: &'a [u8],
    /// Number of threads or workgroups that run.
    pub threads: Threads<'a>,
}

/// Recording into the caller's command buffer, from [`Frame::begin`] to [`Frame::finish`] or [`Frame::end`].
///
/// A frame may be dropped before either, for example by a `?`. The techniques then forget what they recorded in it, so
/// the command buffer may be discarded or submitted.
pub struct Frame<'a> {
    context: &'a Context,
    cmd: vk::CommandBuffer,
    handoff: Handoff,
    timings: Option<&'a mut Timings>,
    hazards: Hazards,
    groups: u32,
    /// States that this frame has changed. They are reset if the frame is dropped before it is finished.
    changed: Vec<Recorded>,
    closed: bool,
    /// Number of passes until one fails, for tests of errors in the middle of a recording.
    #[cfg(test)]
    pub(crate) passes_left: Option<u32>,
    /// Suffix for the names of passes; see [`Frame::mark_passes`].
    mark: &'static str,
    /// Stages in which this frame and earlier frames access memory. This frame has already waited for the earlier
    /// accesses in these stages.
    stages: vk::PipelineStageFlags2,
    /// Function to call before each pass, with the name of the pass, and after it.
    #[cfg(feature = "app")]
    cut: Option<Cut<'a>>,
}

/// Function that takes the command buffer recorded so far and returns another one for the rest of the frame. The new
/// command buffer is recording for the same queue.
#[cfg(feature = "app")]
pub(crate) type Cut<'a> = &'a mut dyn FnMut(Option<&str>) -> vk::CommandBuffer;

/// Every stage in which the library accesses memory, except the stages of raster passes.
const OWN_STAGES: vk::PipelineStageFlags2 = vk::PipelineStageFlags2::from_raw(
    vk::PipelineStageFlags2::COMPUTE_SHADER.as_raw()
        | vk::PipelineStageFlags2::DRAW_INDIRECT.as_raw()
        | vk::PipelineStageFlags2::ALL_TRANSFER.as_raw(),
);
const MEMORY: vk::AccessFlags2 =
    vk::AccessFlags2::from_raw(vk::AccessFlags2::MEMORY_READ.as_raw() | vk::AccessFlags2::MEMORY_WRITE.as_raw());

impl<'a> Frame<'a> {
    /// Starts recording. `handoff` states how the caller reads the output, both of this frame and of the one before.
    /// The library reuses its images from frame to frame on the same queue. A barrier that is recorded here orders the
    /// frames, so any number of them may be in flight.
    ///
    /// # Safety
    /// * `cmd` is recording, outside a render pass, for a queue with compute (and graphics, for techniques with raster
    ///   passes), and belongs to the context's device.
    /// * Command buffers recorded through one context are submitted to one queue, once each, in the order of their
    ///   recording. If a command buffer with a finished frame is discarded instead, the caller calls
    ///   [`Technique::reset`](crate::technique::Technique::reset) on every technique recorded into it before that
    ///   technique records again, because layouts and kept results are tracked as recorded.
    /// * Techniques, inputs and the casters' vertex buffers outlive the execution of the commands.
    /// * Every [`ImageRef`] that a technique gets with this frame is true: the view belongs to the image and has the
    ///   stated format; the image has the stated extent, layers and samples and was made with `SAMPLED`; and while the
    ///   commands run, the image is in the stated layout and its contents are visible to
    ///   [`Inputs::STAGE`](crate::Inputs::STAGE).
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
            changed: vec![],
            closed: false,
            #[cfg(test)]
            passes_left: None,
            mark: "",
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

    /// Sets a state to its value after the commands recorded so far, and returns the previous value.
    pub(crate) fn note(&mut self, state: &Recorded, value: i32) -> i32 {
        self.changed.push(state.clone());
        state.set(value)
    }

    /// Returns the current place in the recording, for [`Frame::since`] and [`Frame::give_up`].
    pub(crate) fn mark(&self) -> Mark {
        Mark { changes: self.changed.len(), groups: self.groups }
    }

    /// Returns the states changed since the mark; one may occur several times.
    pub(crate) fn since(&self, mark: &Mark) -> &[Recorded] {
        &self.changed[mark.changes..]
    }

    /// Resets the states changed since the mark, and closes the groups opened since then.
    pub(crate) fn give_up(&mut self, mark: &Mark) {
        self.since(mark).iter().for_each(Recorded::forget);
        while self.groups > mark.groups {
            self.end_group();
        }
    }

    #[cfg(test)]
    fn fail_in_turn(&mut self, pass: &str) -> Result<()> {
        match &mut self.passes_left {
            Some(0) => return Err(Error::Usage(format!("the pass {pass} fails for a test"))),
            Some(n) => *n -= 1,
            None => {}
        }
        Ok(())
    }

    /// Starts a recording that is cut into several command buffers, one for each pass. Barriers and debug labels work
    /// across them, because both follow the order of the queue, not of a command buffer.
    ///
    /// # Safety
    /// The contract is that of [`Frame::begin`]. In addition, each command buffer that `cut` takes is submitted at
    /// once.
    #[cfg(feature = "app")]
    pub(crate) unsafe fn begin_cut(
        context: &'a Context,
        cmd: vk::CommandBuffer,
        timings: &'a mut Timings,
        cut: Cut<'a>,
    ) -> Self {
        // SAFETY: guaranteed by the caller.
        let mut frame = unsafe { Self::begin(context, cmd, Handoff::default(), Some(timings)) };
        frame.cut = Some(cut);
        frame
    }

    /// The context that this frame records for.
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

    /// Records a compute pass, and the barrier that it needs before it, if any.
    pub(crate) fn dispatch(&mut self, pass: &Pass<'_>) -> Result<()> {
        #[cfg(test)]
        self.fail_in_turn(pass.name)?;
        let interface = &pass.pipeline.interface;
        let bind = interface.bind(pass.bind)?;
        if pass.push.len() != interface.push_size as usize {
            let problem = format!("got {} bytes of push constants", pass.push.len());
            return Err(Error::Shader { shader: interface.name.clone(), problem });
        }
        let mut uses = interface.uses(&bind);
        if let Threads::Indirect(buffer, _) = pass.threads {
            uses.push((buffer.handle().as_raw(), INDIRECT_USE));
        }
        self.transition(bind.iter().filter_map(|b| b.owned()), vk::PipelineStageFlags2::COMPUTE_SHADER);
        self.hazard(&uses);
        let query = self.begin_pass(pass.name);
        let (raw, cmd) = (&self.context.device().raw, self.cmd);
        // SAFETY: the command buffer is recording (contract of `begin`); bindings and push constants were checked
        // against the shader above.
        unsafe {
            raw.cmd_bind_pipeline(cmd, vk::PipelineBindPoint::COMPUTE, pass.pipeline.handle);
            self.push_descriptors(vk::PipelineBindPoint::COMPUTE, interface, &bind);
            if !pass.push.is_empty() {
                raw.cmd_push_constants(cmd, interface.layout, interface.push_stages, 0, pass.push);
            }
            match pass.threads {
                Threads::Count(n) => {
                    let groups: [u32; 3] = std::array::from_fn(|i| n[i].div_ceil(pass.pipeline.local_size[i]));
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

    /// Makes an image of an earlier frame ready for later commands of this one.
    pub(crate) fn use_again(&mut self, image: &Image) {
        self.transition([image].into_iter(), vk::PipelineStageFlags2::COMPUTE_SHADER);
    }

    /// Writes bytes (a multiple of 4) into a buffer, in the order of the commands. The bytes are copied into the
    /// command buffer, so the caller need not keep them.
    pub(crate) fn update(&mut self, buffer: &Buffer, bytes: &[u8]) {
        self.hazard(&[(buffer.handle().as_raw(), TRANSFER_USE)]);
        for (i, part) in bytes.chunks(UPDATE).enumerate() {
            let raw = &self.context.device().raw;
            // SAFETY: `begin`'s contract; the callers size the buffer for the bytes.
            unsafe { raw.cmd_update_buffer(self.cmd, buffer.handle(), (i * UPDATE) as u64, part) };
        }
    }

    /// Reports the number of tiles that the last recorded pass worked on: a `u32` at `offset` of `counter`.
    pub(crate) fn count_tiles(&mut self, tiles_total: u32, counter: &Buffer, offset: u64) {
        self.count(Counted::Tiles(tiles_total), counter, offset);
    }

    /// Reports a number that the last recorded pass has counted: a `u32` at `offset` of `counter`.
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

    /// Ends the recording and hands `output` over as the caller asked at [`Frame::begin`]. The result names the image,
    /// its view and its layout after the hand-over. Image and view stay the same as long as the technique lives.
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

    /// Ends the recording without handing over an image.
    pub fn end(mut self) {
        self.close();
    }

    fn close(&mut self) {
        self.closed = true;
        while self.groups > 0 {
            self.end_group();
        }
        if let Some(timings) = self.timings.as_ref().filter(|t| t.is_used()) {
            self.memory_barrier(&TO_HOST);
            timings.end(self.cmd);
        }
    }

    fn image_barrier(&mut self, image: &Image, new: vk::ImageLayout) -> vk::ImageMemoryBarrier2<'static> {
        let r = image.as_ref();
        let old = vk::ImageLayout::from_raw(self.note(image.layout(), new.as_raw()));
        vk::ImageMemoryBarrier2::default()
            .image(r.image)
            .old_layout(old)
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
        // SAFETY: `begin`'s contract; the old layouts are those that the last barriers left.
        unsafe { self.context.device().raw.cmd_pipeline_barrier2(self.cmd, &info) };
    }

    /// Brings images of the library into `GENERAL` if they are in another layout, as at first use and after a
    /// hand-over.
    fn transition<'i>(&mut self, images: impl Iterator<Item = &'i Image>, stage: vk::PipelineStageFlags2) {
        self.transition_to(vk::ImageLayout::GENERAL, images, stage);
    }

    /// Brings an image of the library into a layout for transfers. After the copy, [`Self::transition`] brings it back,
    /// because all other commands expect the library's images in `GENERAL`.
    fn transition_for_copy(&mut self, image: &Image, layout: vk::ImageLayout) {
        self.transition_to(layout, [image].into_iter(), TRANSFER_USE.stage);
    }

    fn transition_to<'i>(
        &mut self,
        layout: vk::ImageLayout,
        images: impl Iterator<Item = &'i Image>,
        stage: vk::PipelineStageFlags2,
    ) {
        let mut barriers = vec![];
        for image in images {
            if image.layout().get() != layout.as_raw() {
                let barrier = self
                    .image_barrier(image, layout)
                    .src_stage_mask(self.stages | self.handoff.stage | stage)
                    .src_access_mask(vk::AccessFlags2::MEMORY_WRITE)
                    .dst_stage_mask(self.stages | stage)
                    .dst_access_mask(MEMORY);
                barriers.push(barrier);
            }
        }
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

    /// Appends `mark` to the names of all passes from here to the next call. It distinguishes passes that a technique
    /// records twice in a frame.
    pub(crate) fn mark_passes(&mut self, mark: &'static str) {
        self.mark = mark;
    }

    fn begin_pass(&mut self, name: &str) -> Option<u32> {
        let name = &*match self.mark {
            "" => Cow::Borrowed(name),
            mark => Cow::Owned(format!("{name}{mark}")),
        };
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

    /// Switches to the next command buffer if the frame is cut into passes. Called at the beginning and end of each
    /// pass.
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

impl Drop for Frame<'_> {
    fn drop(&mut self) {
        if !self.closed {
            self.changed.iter().for_each(Recorded::forget);
        }
    }
}

/// A place in a frame's recording.
pub(crate) struct Mark {
    changes: usize,
    groups: u32,
}

/// Barrier that makes copies visible to the CPU once a fence has signalled.
const TO_HOST: Barrier = Barrier {
    src_stage: vk::PipelineStageFlags2::ALL_TRANSFER,
    src_access: vk::AccessFlags2::TRANSFER_WRITE,
    dst_stage: vk::PipelineStageFlags2::HOST,
    dst_access: vk::AccessFlags2::HOST_READ,
};

/// Largest number of bytes that one update command may write.
const UPDATE: usize = 65536;

const INDIRECT_USE: Use = Use {
    stage: vk::PipelineStageFlags2::DRAW_INDIRECT,
    access: vk::AccessFlags2::INDIRECT_COMMAND_READ,
    writes: false,
};
const TRANSFER_USE: Use =
    Use { stage: vk::PipelineStageFlags2::ALL_TRANSFER, access: vk::AccessFlags2::TRANSFER_WRITE, writes: true };
