//! GPU times, tile counts and pipeline statistics for each pass, read back without waiting.

use crate::context::Context;
use crate::error::VkContext;
use crate::gpu::{Buffer, BufferDesc, Device, MemoryKind};
use crate::{Error, Result};
use ash::vk;
use std::collections::VecDeque;
use std::sync::Arc;

/// Number of passes that one frame can time; later ones are recorded but not timed.
pub const MAX_PASSES: u32 = 256;

/// Queries of a slot: two for each pass, and a last one that follows everything else.
const SLOT_QUERIES: u32 = MAX_PASSES * 2 + 1;

/// Words of a slot: the counters, and the number of the frame that they belong to.
const SLOT_WORDS: usize = MAX_PASSES as usize + 1;
const NUMBER: usize = MAX_PASSES as usize;

/// Time and counts of one pass of one frame.
#[derive(Clone, Debug, PartialEq)]
pub struct PassTiming {
    /// Name given when the pass was recorded.
    pub name: String,
    /// Milliseconds between the timestamps before and after the pass.
    pub gpu_ms: f64,
    /// Tiles of the frame and tiles that the pass worked on; only for passes that skip tiles.
    pub tiles: Option<Tiles>,
    /// Values that the pass counted, with their names, such as edges found and edges lost.
    pub counts: Vec<(&'static str, u32)>,
    /// Pipeline statistics, if [`Timings::with_statistics`] asked for them.
    pub statistics: Option<Statistics>,
}

/// Pipeline statistics of a pass, as `VK_QUERY_TYPE_PIPELINE_STATISTICS` counts them. Drivers may count slightly more
/// or less than the Vulkan specification suggests.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[cfg_attr(feature = "app", derive(serde::Serialize))]
pub struct Statistics {
    /// Primitives that the draws assembled from their vertices.
    pub input_primitives: u64,
    /// Invocations of the vertex shader.
    pub vertex_invocations: u64,
    /// Primitives left after clipping, before culling by facing.
    pub clipped_primitives: u64,
    /// Invocations of the fragment shader.
    pub fragment_invocations: u64,
    /// Invocations of the compute shader.
    pub compute_invocations: u64,
}

impl Statistics {
    /// Statistics of a queue with graphics, in the order of the values.
    const GRAPHICS: vk::QueryPipelineStatisticFlags = vk::QueryPipelineStatisticFlags::from_raw(
        vk::QueryPipelineStatisticFlags::INPUT_ASSEMBLY_PRIMITIVES.as_raw()
            | vk::QueryPipelineStatisticFlags::VERTEX_SHADER_INVOCATIONS.as_raw()
            | vk::QueryPipelineStatisticFlags::CLIPPING_PRIMITIVES.as_raw()
            | vk::QueryPipelineStatisticFlags::FRAGMENT_SHADER_INVOCATIONS.as_raw()
            | Self::COMPUTE.as_raw(),
    );
    /// Statistics of a queue without graphics.
    const COMPUTE: vk::QueryPipelineStatisticFlags = vk::QueryPipelineStatisticFlags::COMPUTE_SHADER_INVOCATIONS;

    fn new(values: &[u64]) -> Option<Self> {
        match *values {
            [input_primitives, vertex_invocations, clipped_primitives, fragment_invocations, compute_invocations] => {
                Some(Self {
                    input_primitives,
                    vertex_invocations,
                    clipped_primitives,
                    fragment_invocations,
                    compute_invocations,
                })
            }
            [compute_invocations] => Some(Self { compute_invocations, ..Self::default() }),
            _ => None,
        }
    }
}

/// Queries of the statistics: one for each pass.
struct StatisticsPool {
    pool: vk::QueryPool,
    /// Number of values that each query holds.
    figures: usize,
}

/// Tiles that a skipping pass worked on.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Tiles {
    /// Tiles of the whole image.
    pub total: u32,
    /// Tiles that the pass worked on.
    pub active: u32,
}

/// Times of one frame.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct FrameTiming {
    /// Passes in recording order.
    pub passes: Vec<PassTiming>,
    /// Milliseconds from before the first pass until after the last.
    pub total_gpu_ms: f64,
}

/// Meaning of a counter.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Counted {
    /// Tiles that the pass worked on, out of this many.
    Tiles(u32),
    /// Anything else, by name.
    Named(&'static str),
}

#[derive(Default)]
struct Slot {
    names: Vec<String>,
    /// One entry for each counter copied: the index of its pass and its meaning.
    counters: Vec<(usize, Counted)>,
    /// Number of the frame that the slot was last recorded for. The frame's commands write this number into memory
    /// right after they reset the queries; while memory holds another number, the results belong to another frame.
    number: u32,
    pending: bool,
}

/// A ring of timestamp queries with one slot for each [`crate::Frame`] in flight. A command buffer may hold several
/// frames.
///
/// Pass it to [`crate::Frame::begin`], submit, and call [`Timings::poll`] whenever convenient to get the frames that
/// the GPU has finished since. Results are lost if a slot is reused before the GPU has finished its frame, or if a
/// command buffer is discarded; [`Timings::lost`] counts these frames.
pub struct Timings {
    device: Arc<Device>,
    pool: vk::QueryPool,
    statistics: Option<StatisticsPool>,
    counters: Buffer,
    slots: Vec<Slot>,
    current: usize,
    /// Number of frames begun.
    frames: u32,
    /// Frames collected when their slots were reused, kept for the next poll.
    finished: VecDeque<FrameTiming>,
    lost: u64,
    /// Milliseconds per tick, and the mask of a timestamp's valid bits.
    tick_ms: f64,
    mask: u64,
}

impl Timings {
    /// Creates the queries for frames that run on a queue of the family `queue_family`. `frames_in_flight` is the
    /// number of frames that may be recorded before the GPU has finished the first one, and also the number of
    /// finished frames that may wait to be polled; the results of older ones are lost.
    pub fn new(context: &Context, queue_family: u32, frames_in_flight: u32) -> Result<Self> {
        Self::make(context, queue_family, frames_in_flight, false)
    }

    /// Same as [`Self::new`], with [`Statistics`] for every pass. Counting them may itself cost time.
    ///
    /// # Errors
    /// [`Error::NoDevice`] if the device was made without [`crate::DeviceFeatures::pipeline_statistics`].
    pub fn with_statistics(context: &Context, queue_family: u32, frames_in_flight: u32) -> Result<Self> {
        Self::make(context, queue_family, frames_in_flight, true)
    }

    fn make(context: &Context, queue_family: u32, frames_in_flight: u32, statistics: bool) -> Result<Self> {
        if statistics && !context.features().pipeline_statistics {
            let problem = "pipeline statistics need the feature pipelineStatisticsQuery, which this device lacks \
                           according to ContextDesc::features";
            return Err(Error::NoDevice(problem.into()));
        }
        let device = context.device().clone();
        let slots = frames_in_flight.max(1);
        // SAFETY: the physical device is the caller's and is alive.
        let families = unsafe { device.instance.get_physical_device_queue_family_properties(device.physical_device) };
        let family = families.get(queue_family as usize);
        let bits = family.map_or(0, |f| f.timestamp_valid_bits);
        let has_graphics = family.is_some_and(|f| f.queue_flags.contains(vk::QueueFlags::GRAPHICS));
        let info =
            vk::QueryPoolCreateInfo::default().query_type(vk::QueryType::TIMESTAMP).query_count(slots * SLOT_QUERIES);
        // SAFETY: the create info is complete.
        let pool = unsafe { device.raw.create_query_pool(&info, None) }.context("vkCreateQueryPool(timings)")?;
        device.name(pool, "timings");
        let counters = Buffer::new(
            &device,
            &BufferDesc {
                name: "tile counters",
                size: slots as u64 * SLOT_WORDS as u64 * 4,
                usage: vk::BufferUsageFlags::TRANSFER_DST,
                memory: MemoryKind::Readback,
            },
        )?;
        let mut timings = Self {
            pool,
            statistics: None,
            counters,
            slots: (0..slots).map(|_| Slot::default()).collect(),
            current: slots as usize - 1,
            frames: 0,
            finished: VecDeque::new(),
            lost: 0,
            tick_ms: f64::from(device.limits.timestamp_period) * 1e-6,
            mask: if bits >= 64 { u64::MAX } else { (1 << bits) - 1 },
            device,
        };
        if statistics {
            timings.count_statistics(if has_graphics { Statistics::GRAPHICS } else { Statistics::COMPUTE })?;
        }
        Ok(timings)
    }

    fn count_statistics(&mut self, which: vk::QueryPipelineStatisticFlags) -> Result<()> {
        let info = vk::QueryPoolCreateInfo::default()
            .query_type(vk::QueryType::PIPELINE_STATISTICS)
            .pipeline_statistics(which)
            .query_count(self.slots.len() as u32 * MAX_PASSES);
        // SAFETY: the feature is enabled, and the queue can count all these values.
        let pool =
            unsafe { self.device.raw.create_query_pool(&info, None) }.context("vkCreateQueryPool(statistics)")?;
        self.device.name(pool, "statistics");
        self.statistics = Some(StatisticsPool { pool, figures: which.as_raw().count_ones() as usize });
        Ok(())
    }

    /// Frames finished since the last call, oldest first. Does not wait.
    pub fn poll(&mut self) -> Vec<FrameTiming> {
        let mut frames: Vec<_> = self.finished.drain(..).collect();
        let count = self.slots.len();
        frames.extend((1..=count).filter_map(|i| self.collect((self.current + i) % count)));
        frames
    }

    /// Number of frames whose results are lost: their slot was reused before they had finished, they were never
    /// submitted, or they were not polled in time.
    pub fn lost(&self) -> u64 {
        self.lost
    }

    /// Word of a slot in [`Self::counters`], as last written by the GPU.
    fn word(&self, index: usize, word: usize) -> Option<u32> {
        let at = (index * SLOT_WORDS + word) * 4;
        let bytes = self.counters.bytes().get(at..at + 4)?;
        // SAFETY: the four bytes are mapped and as aligned as the mapping; the GPU may be writing them.
        Some(unsafe { bytes.as_ptr().cast::<u32>().read_volatile() })
    }

    fn collect(&mut self, index: usize) -> Option<FrameTiming> {
        let passes = self.slots[index].names.len();
        if !self.slots[index].pending || self.word(index, NUMBER) != Some(self.slots[index].number) {
            return None;
        }
        let mut ticks = vec![[0u64; 2]; passes * 2];
        let first = index as u32 * SLOT_QUERIES;
        let flags = vk::QueryResultFlags::TYPE_64 | vk::QueryResultFlags::WITH_AVAILABILITY;
        // SAFETY: the range lies within the pool; each element holds a value and its availability.
        let result = unsafe { self.device.raw.get_query_pool_results(self.pool, first, &mut ticks, flags) };
        if result.is_err() || ticks.iter().any(|t| t[1] == 0) {
            return None;
        }
        // The counters are copied after the timestamp of their pass, so wait for the timestamp that follows the
        // copies.
        let mut last = [[0u64; 2]];
        // SAFETY: as above.
        let result =
            unsafe { self.device.raw.get_query_pool_results(self.pool, first + SLOT_QUERIES - 1, &mut last, flags) };
        if result.is_err() || last[0][1] == 0 {
            return None;
        }
        let statistics = self.collect_statistics(index, passes)?;
        let counted: Vec<_> = (0..self.slots[index].counters.len()).map(|i| self.word(index, i)).collect();
        let slot = &mut self.slots[index];
        slot.pending = false;
        let (mask, tick_ms) = (self.mask, self.tick_ms);
        let span = |from: u64, to: u64| (to.wrapping_sub(from) & mask) as f64 * tick_ms;
        let mut passes: Vec<_> = slot
            .names
            .drain(..)
            .zip(ticks.chunks_exact(2))
            .zip(statistics)
            .map(|((name, t), statistics)| PassTiming {
                name,
                gpu_ms: span(t[0][0], t[1][0]),
                tiles: None,
                counts: vec![],
                statistics,
            })
            .collect();
        for ((pass, counted), value) in slot.counters.drain(..).zip(counted) {
            let Some(value) = value else { continue };
            match counted {
                Counted::Tiles(total) => passes[pass].tiles = Some(Tiles { total, active: value }),
                Counted::Named(name) => passes[pass].counts.push((name, value)),
            }
        }
        let total_gpu_ms = span(ticks[0][0], ticks[ticks.len() - 1][0]);
        Some(FrameTiming { passes, total_gpu_ms })
    }

    /// Statistics of each pass; `None` if the GPU has not finished. Call this once the timestamps are known to belong
    /// to the frame: the statistics are reset together with them.
    fn collect_statistics(&self, index: usize, passes: usize) -> Option<Vec<Option<Statistics>>> {
        let Some(statistics) = &self.statistics else { return Some(vec![None; passes]) };
        let width = statistics.figures + 1;
        // Reads one query at a time: ash's own call takes a query's values as one element type, whose length would
        // have to be constant.
        let one = |i: usize| {
            let mut values = vec![0u64; width];
            let query = index as u32 * MAX_PASSES + i as u32;
            // SAFETY: the query lies within the pool, and `values` has room for its values and their availability.
            let result = unsafe {
                (self.device.raw.fp_v1_0().get_query_pool_results)(
                    self.device.raw.handle(),
                    statistics.pool,
                    query,
                    1,
                    size_of_val(&values[..]),
                    values.as_mut_ptr().cast(),
                    size_of_val(&values[..]) as u64,
                    vk::QueryResultFlags::TYPE_64 | vk::QueryResultFlags::WITH_AVAILABILITY,
                )
            };
            let (available, figures) = values.split_last()?;
            (result == vk::Result::SUCCESS && *available != 0).then(|| Statistics::new(figures))
        };
        (0..passes).map(one).collect()
    }

    /// Names of the passes recorded last, including those that will not run.
    #[cfg(all(test, feature = "app"))]
    pub(crate) fn recorded(&self) -> &[String] {
        &self.slots[self.current].names
    }

    pub(crate) fn begin(&mut self, cmd: vk::CommandBuffer) {
        self.current = (self.current + 1) % self.slots.len();
        // Reads the old results now, because the slot's names are about to be replaced.
        if self.slots[self.current].pending {
            match self.collect(self.current) {
                Some(frame) => self.finished.push_back(frame),
                None => self.lost += 1,
            }
        }
        if self.finished.len() > self.slots.len() {
            self.finished.pop_front();
            self.lost += 1;
        }
        // Frame numbers start at 1, because memory that was never written may hold 0.
        self.frames = self.frames.wrapping_add(1).max(1);
        let slot = &mut self.slots[self.current];
        slot.names.clear();
        slot.counters.clear();
        slot.pending = false;
        slot.number = self.frames;
        let number_at = ((self.current * SLOT_WORDS + NUMBER) * 4) as u64;
        let first = self.current as u32 * SLOT_QUERIES;
        // SAFETY: `cmd` is recording outside a render pass (contract of `Frame::begin`).
        unsafe {
            self.device.raw.cmd_reset_query_pool(cmd, self.pool, first, SLOT_QUERIES);
            let number = slot.number.to_ne_bytes();
            self.device.raw.cmd_update_buffer(cmd, self.counters.handle(), number_at, &number);
            if let Some(statistics) = &self.statistics {
                let first = self.current as u32 * MAX_PASSES;
                self.device.raw.cmd_reset_query_pool(cmd, statistics.pool, first, MAX_PASSES);
            }
        }
    }

    /// Writes the first timestamp of a pass and returns the query to pass to [`Self::end_pass`].
    pub(crate) fn begin_pass(&mut self, cmd: vk::CommandBuffer, name: &str) -> Option<u32> {
        let slot = &mut self.slots[self.current];
        if self.mask == 0 || slot.names.len() >= MAX_PASSES as usize {
            return None;
        }
        let pass = slot.names.len() as u32;
        let query = self.current as u32 * SLOT_QUERIES + pass * 2;
        slot.names.push(name.into());
        slot.pending = true;
        self.stamp(cmd, query);
        if let Some(statistics) = &self.statistics {
            let query = self.current as u32 * MAX_PASSES + pass;
            // SAFETY: the query was reset when the frame began; passes neither nest nor lie within a rendering.
            unsafe { self.device.raw.cmd_begin_query(cmd, statistics.pool, query, vk::QueryControlFlags::empty()) };
        }
        Some(query + 1)
    }

    pub(crate) fn end_pass(&self, cmd: vk::CommandBuffer, query: Option<u32>) {
        let Some(query) = query else { return };
        if let Some(statistics) = &self.statistics {
            let pass = self.slots[self.current].names.len() as u32 - 1;
            // SAFETY: the query was begun with the pass, which is the last one.
            unsafe { self.device.raw.cmd_end_query(cmd, statistics.pool, self.current as u32 * MAX_PASSES + pass) };
        }
        self.stamp(cmd, query);
    }

    fn stamp(&self, cmd: vk::CommandBuffer, query: u32) {
        // SAFETY: the query was reset at the frame's begin and is written once.
        unsafe {
            self.device.raw.cmd_write_timestamp2(cmd, vk::PipelineStageFlags2::ALL_COMMANDS, self.pool, query);
        }
    }

    /// Buffer and byte offset for a counter of the last pass.
    pub(crate) fn counter(&mut self, counted: Counted) -> Option<(&Buffer, u64)> {
        let slot = &mut self.slots[self.current];
        if slot.counters.len() >= MAX_PASSES as usize {
            return None; // The buffer is full.
        }
        let pass = slot.names.len().checked_sub(1)?;
        let offset = (self.current * SLOT_WORDS + slot.counters.len()) as u64 * 4;
        slot.counters.push((pass, counted));
        Some((&self.counters, offset))
    }

    /// Writes the timestamp that marks all results of the frame as readable by the CPU.
    pub(crate) fn end(&self, cmd: vk::CommandBuffer) {
        self.stamp(cmd, (self.current as u32 + 1) * SLOT_QUERIES - 1);
    }

    /// True if the frame has timed a pass.
    pub(crate) fn is_used(&self) -> bool {
        self.slots[self.current].pending
    }
}

impl Drop for Timings {
    fn drop(&mut self) {
        // SAFETY: the owner guarantees that no command buffer in flight writes the queries.
        unsafe {
            self.device.raw.destroy_query_pool(self.pool, None);
            if let Some(statistics) = &self.statistics {
                self.device.raw.destroy_query_pool(statistics.pool, None);
            }
        }
    }
}
