//! `bounded-row`: the lower envelope of every row, computed in segments if there is a radius.

use super::columns::{Columns, ColumnsBindings};
use super::{EdtPush, NO_SEED, Output, UNBOUNDED, storage};
use crate::gpu::{Buffer, ComputePipeline, bindings};
use crate::{Bind, Context, Frame, Pass, Result, Threads};
use std::sync::Arc;

/// Number of rows of a workgroup of `edt_row.comp`.
const ROWS: u32 = 8;
/// Number of columns of a segment for small radii, a multiple of 4. Shorter segments are skipped more often; in longer
/// ones the margins on both sides cost less.
const SEGMENT: u32 = 128;
/// Largest number of sites that a thread keeps in an array of its own. A CPU driver puts the array on the stack of its
/// thread, with 8 bytes per site for each of 8 or 16 lanes.
const MOST_OWN_SITES: u32 = 8192;
/// Largest number of columns that a thread of a CPU driver visits, unless a single segment has more.
const ROUNDS: u32 = 18_000;

bindings! {
    struct RowBindings { ..columns: ColumnsBindings, Sites, Labels, SquaredDistances, Active }
}

pub(super) struct Row {
    columns: Columns,
    pipeline: Arc<ComputePipeline>,
    push: EdtPush,
    groups: u32,
    /// Number of segments of all rows.
    items: u32,
    sites: Buffer,
    /// Labels, with rows padded to whole groups of four pixels.
    labels: Arc<Buffer>,
    /// True if `labels` belongs to others too.
    shared: bool,
    squared: Option<Buffer>,
    active: Buffer,
}

impl Row {
    pub fn new(context: &Context, push: EdtPush, is_cpu: bool, rows: Option<&Arc<Buffer>>) -> Result<Self> {
        let [width, height] = push.size;
        let span = match push.radius {
            UNBOUNDED.. => width,
            radius => SEGMENT.max(radius.saturating_mul(4)).min(width),
        };
        let items = width.div_ceil(span) * height.div_ceil(ROWS);
        // Each site owns a pixel, so a segment has at most as many sites as pixels.
        let own_sites = if is_cpu && span <= MOST_OWN_SITES { span.next_power_of_two().max(256) } else { 1 };
        let longest = span.saturating_add(push.radius.saturating_mul(2)).min(width);
        // Workgroups that share the buffer of sites work on several segments in turn. llvmpipe ends all loops of a
        // thread after 65535 rounds in total, and each column takes up to 3.3 rounds. A workgroup on a CPU driver
        // therefore gets only as many segments as stay below that limit.
        let groups = match (is_cpu, own_sites > 1) {
            (true, true) => items,
            (true, false) => items.div_ceil((ROUNDS / longest).max(1)),
            (false, _) => items.min(1024),
        };
        let shared = if own_sites > 1 { 1 } else { u64::from(groups * ROWS) * u64::from(span) };
        let padded = u64::from(width.next_multiple_of(4)) * u64::from(height);
        Ok(Self {
            columns: Columns::new(context, push, if is_cpu { 1 } else { height.div_ceil(256) })?,
            pipeline: context
                .pipeline::<RowBindings, EdtPush>("distance_transform/edt_row.comp", &[("OWN_SITES", own_sites)])?,
            push: EdtPush { span, ..push },
            groups,
            items: width.div_ceil(span) * height,
            sites: storage(context, "edt sites", shared, 8)?,
            labels: match rows {
                Some(rows) => rows.clone(),
                None => Arc::new(storage(context, "edt label rows", padded, 4)?),
            },
            shared: rows.is_some(),
            squared: match push.squared {
                0 => None,
                _ => Some(storage(context, "edt squared distance rows", padded, 4)?),
            },
            active: storage(context, "edt active rows", 1, 4)?,
        })
    }

    pub fn record(&self, frame: &mut Frame<'_>, seed_bits: &Buffer, output: &Output<'_>) -> Result<()> {
        self.columns.record(frame, seed_bits)?;
        frame.update(&self.active, &[0; 4]);
        if self.push.radius < UNBOUNDED {
            frame.fill("edt clear labels", &self.labels, NO_SEED);
            if let Some(squared) = &self.squared {
                frame.fill("edt clear squared distances", squared, NO_SEED);
            }
        }
        frame.dispatch(&Pass {
            name: "edt rows",
            pipeline: &self.pipeline,
            bind: &RowBindings {
                columns: self.columns.bind(),
                Sites: Bind::Buffer(&self.sites),
                Labels: Bind::Buffer(&self.labels),
                // Without squared distances, the shader's binding still needs a buffer.
                SquaredDistances: Bind::Buffer(self.squared.as_ref().unwrap_or(&self.labels)),
                Active: Bind::Buffer(&self.active),
            },
            push: bytemuck::bytes_of(&self.push),
            threads: Threads::Count([self.groups * ROWS, 1, 1]),
        })?;
        frame.count_tiles(self.items, &self.active, 0);
        let row_pixels = self.push.size[0].next_multiple_of(4);
        frame.copy_to_image("edt copy labels", &self.labels, row_pixels, output.labels);
        if let Some(squared) = &self.squared {
            frame.copy_to_image("edt copy squared distances", squared, row_pixels, output.squared);
        }
        Ok(())
    }

    pub fn memory_bytes(&self) -> u64 {
        let squared = self.squared.as_ref().map_or(0, Buffer::size);
        let labels = if self.shared { 0 } else { self.labels.size() };
        self.columns.memory_bytes() + self.sites.size() + labels + squared + self.active.size()
    }
}
