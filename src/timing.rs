//! GPU times and tile counts by pass name, read back without ever waiting.

use crate::Result;
use crate::context::Context;
use crate::error::VkContext;
use crate::gpu::{Buffer, BufferDesc, Device, MemoryKind};
use ash::vk;
use std::sync::Arc;

/// Passes that one frame can time; later ones are recorded but not timed.
pub const MAX_PASSES: u32 = 256;

/// Queries of a slot: two a pass, and a last one that follows the tile counters.
const SLOT_QUERIES: u32 = MAX_PASSES * 2 + 1;

/// What one pass of one frame cost.
#[derive(Clone, Debug, PartialEq)]
pub struct PassTiming {
    /// Name given at recording.
    pub name: String,
    /// Milliseconds between the timestamps before and after the pass.
    pub gpu_ms: f64,
    /// Tiles of the frame and how many of them the pass worked on, for passes that skip.
    pub tiles: Option<Tiles>,
}

/// How much of a frame a skipping pass touched.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Tiles {
    /// Tiles of the whole image.
    pub total: u32,
    /// Tiles that the pass worked on.
    pub active: u32,
}

/// What one frame cost.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct FrameTiming {
    /// Passes in recording order.
    pub passes: Vec<PassTiming>,
    /// Milliseconds from before the first pass to after the last.
    pub total_gpu_ms: f64,
}

#[derive(Default)]
struct Slot {
    names: Vec<String>,
    /// (pass, tiles total), one for each counter copied.
    counters: Vec<(usize, u32)>,
    pending: bool,
    /// First timestamp of the slot's last collected frame: while the GPU has not yet reset the
    /// queries of a new frame, the old values still read as available, and this tells them apart.
    seen: Option<u64>,
}

/// A ring of timestamp queries, one slot for each [`crate::Frame`] in flight; a command buffer may hold several.
///
/// Hand it to [`crate::Frame::begin`], submit, and call [`Timings::poll`] whenever convenient: it
/// returns the frames that the GPU has finished since.
pub struct Timings {
    device: Arc<Device>,
    pool: vk::QueryPool,
    counters: Buffer,
    slots: Vec<Slot>,
    current: usize,
    /// Milliseconds a tick, and the bits of a timestamp that mean something.
    tick_ms: f64,
    mask: u64,
}

impl Timings {
    /// `queue_family` is the family whose queue runs the frames. `frames_in_flight` is how many frames
    /// may be recorded before the results of the first are polled; results of older ones are lost.
    pub fn new(context: &Context, queue_family: u32, frames_in_flight: u32) -> Result<Self> {
        let device = context.device().clone();
        let slots = frames_in_flight.max(1);
        // SAFETY: the physical device is the caller's and alive.
        let families = unsafe { device.instance.get_physical_device_queue_family_properties(device.physical_device) };
        let bits = families.get(queue_family as usize).map_or(0, |f| f.timestamp_valid_bits);
        let info =
            vk::QueryPoolCreateInfo::default().query_type(vk::QueryType::TIMESTAMP).query_count(slots * SLOT_QUERIES);
        // SAFETY: the create info is complete.
        let pool = unsafe { device.raw.create_query_pool(&info, None) }.context("vkCreateQueryPool(timings)")?;
        device.name(pool, "timings");
        let counters = Buffer::new(
            &device,
            &BufferDesc {
                name: "tile counters",
                size: u64::from(slots * MAX_PASSES) * 4,
                usage: vk::BufferUsageFlags::TRANSFER_DST,
                memory: MemoryKind::Readback,
            },
        )?;
        Ok(Self {
            pool,
            counters,
            slots: (0..slots).map(|_| Slot::default()).collect(),
            current: slots as usize - 1,
            tick_ms: f64::from(device.limits.timestamp_period) * 1e-6,
            mask: if bits >= 64 { u64::MAX } else { (1 << bits) - 1 },
            device,
        })
    }

    /// Frames finished since the last call, oldest first. Never waits.
    pub fn poll(&mut self) -> Vec<FrameTiming> {
        let count = self.slots.len();
        (1..=count).filter_map(|i| self.collect((self.current + i) % count)).collect()
    }

    fn collect(&mut self, index: usize) -> Option<FrameTiming> {
        let passes = self.slots[index].names.len();
        if !self.slots[index].pending || passes == 0 {
            return None;
        }
        let mut ticks = vec![[0u64; 2]; passes * 2];
        let first = index as u32 * SLOT_QUERIES;
        let flags = vk::QueryResultFlags::TYPE_64 | vk::QueryResultFlags::WITH_AVAILABILITY;
        // SAFETY: the range lies within the pool; each element holds a value and its availability.
        let result = unsafe { self.device.raw.get_query_pool_results(self.pool, first, &mut ticks, flags) };
        if result.is_err() || ticks.iter().any(|t| t[1] == 0) || self.slots[index].seen == Some(ticks[0][0]) {
            return None;
        }
        // The counters are copied after the stamp of their pass: wait for the stamp that follows the copies. It was
        // reset along with the others, so it is this frame's.
        let mut last = [[0u64; 2]];
        if !self.slots[index].counters.is_empty() {
            let query = first + SLOT_QUERIES - 1;
            // SAFETY: as above.
            let result = unsafe { self.device.raw.get_query_pool_results(self.pool, query, &mut last, flags) };
            if result.is_err() || last[0][1] == 0 {
                return None;
            }
        }
        let slot = &mut self.slots[index];
        slot.pending = false;
        slot.seen = Some(ticks[0][0]);
        let (mask, tick_ms) = (self.mask, self.tick_ms);
        let span = |from: u64, to: u64| (to.wrapping_sub(from) & mask) as f64 * tick_ms;
        let mut passes: Vec<_> = slot
            .names
            .drain(..)
            .zip(ticks.chunks_exact(2))
            .map(|(name, t)| PassTiming { name, gpu_ms: span(t[0][0], t[1][0]), tiles: None })
            .collect();
        for (i, (pass, total)) in slot.counters.drain(..).enumerate() {
            let at = (index * MAX_PASSES as usize + i) * 4;
            let bytes = self.counters.bytes().get(at..at + 4).and_then(|b| b.try_into().ok());
            passes[pass].tiles = bytes.map(|b| Tiles { total, active: u32::from_ne_bytes(b) });
        }
        let total_gpu_ms = span(ticks[0][0], ticks[ticks.len() - 1][0]);
        Some(FrameTiming { passes, total_gpu_ms })
    }

    pub(crate) fn begin(&mut self, cmd: vk::CommandBuffer) {
        self.current = (self.current + 1) % self.slots.len();
        let slot = &mut self.slots[self.current];
        slot.names.clear();
        slot.counters.clear();
        slot.pending = true;
        let first = self.current as u32 * SLOT_QUERIES;
        // SAFETY: `cmd` is recording outside a render pass (contract of `Frame::begin`).
        unsafe { self.device.raw.cmd_reset_query_pool(cmd, self.pool, first, SLOT_QUERIES) };
    }

    /// Writes the first timestamp of a pass; the returned query is for [`Self::end_pass`].
    pub(crate) fn begin_pass(&mut self, cmd: vk::CommandBuffer, name: &str) -> Option<u32> {
        let slot = &mut self.slots[self.current];
        if self.mask == 0 || slot.names.len() >= MAX_PASSES as usize {
            return None;
        }
        let query = self.current as u32 * SLOT_QUERIES + slot.names.len() as u32 * 2;
        slot.names.push(name.into());
        self.stamp(cmd, query);
        Some(query + 1)
    }

    pub(crate) fn end_pass(&self, cmd: vk::CommandBuffer, query: Option<u32>) {
        if let Some(query) = query {
            self.stamp(cmd, query);
        }
    }

    fn stamp(&self, cmd: vk::CommandBuffer, query: u32) {
        // SAFETY: the query was reset at the frame's begin and is written once.
        unsafe {
            self.device.raw.cmd_write_timestamp2(cmd, vk::PipelineStageFlags2::ALL_COMMANDS, self.pool, query);
        }
    }

    /// Where the tile counter of the last pass goes.
    pub(crate) fn counter(&mut self, tiles_total: u32) -> Option<(&Buffer, u64)> {
        let slot = &mut self.slots[self.current];
        if slot.counters.len() >= MAX_PASSES as usize {
            return None; // The buffer has room for no more.
        }
        let pass = slot.names.len().checked_sub(1)?;
        let offset = (self.current * MAX_PASSES as usize + slot.counters.len()) as u64 * 4;
        slot.counters.push((pass, tiles_total));
        Some((&self.counters, offset))
    }

    /// Marks that all counters of the frame are where the CPU reads them.
    pub(crate) fn end_counters(&self, cmd: vk::CommandBuffer) {
        self.stamp(cmd, (self.current as u32 + 1) * SLOT_QUERIES - 1);
    }

    pub(crate) fn has_counters(&self) -> bool {
        !self.slots[self.current].counters.is_empty()
    }
}

impl Drop for Timings {
    fn drop(&mut self) {
        // SAFETY: the owner vouches that no command buffer in flight writes the queries.
        unsafe { self.device.raw.destroy_query_pool(self.pool, None) };
    }
}
