//! `bounded-row`: the lower envelope of every row, in segments under a radius.

use super::columns::Columns;
use super::{EdtPush, Output, UNBOUNDED, storage};
use crate::gpu::{Buffer, ComputePipeline};
use crate::{Bind, Context, Frame, Pass, Result, Threads};
use std::sync::Arc;

/// Rows of a workgroup of `edt_row.comp`.
const ROWS: u32 = 8;
/// Columns of a segment under a small radius: shorter ones skip more, longer ones have less of a margin.
const SEGMENT: u32 = 128;

pub(super) struct Row {
    columns: Columns,
    pipeline: Arc<ComputePipeline>,
    push: EdtPush,
    groups: u32,
    /// Segments of 8 rows.
    items: u32,
    sites: Buffer,
    active: Buffer,
}

impl Row {
    pub fn new(context: &Context, push: EdtPush, is_cpu: bool) -> Result<Self> {
        let [width, height] = push.size;
        let span = match push.radius {
            UNBOUNDED.. => width,
            radius => SEGMENT.max(radius.saturating_mul(2)).min(width),
        };
        let items = width.div_ceil(span) * height.div_ceil(ROWS);
        // A workgroup needs sites of its own: enough of them for all cores, few enough for their caches.
        let groups = items.min(if is_cpu { 32 } else { 1024 });
        let longest = (u64::from(span) + 2 * u64::from(push.radius)).min(width.into());
        Ok(Self {
            columns: Columns::new(context, push, if is_cpu { 1 } else { height.div_ceil(256) })?,
            pipeline: context.pipeline::<EdtPush>("pass/edt_row.comp", &[])?,
            push: EdtPush { span, ..push },
            groups,
            items,
            sites: storage(context, "edt sites", u64::from(groups * ROWS) * longest, 8)?,
            active: storage(context, "edt active segments", 1, 4)?,
        })
    }

    pub fn record(&self, frame: &mut Frame<'_>, seed_bits: &Buffer, output: &Output<'_>) -> Result<()> {
        self.columns.record(frame, seed_bits)?;
        frame.update(&self.active, &[0; 4]);
        let [columns, live] = self.columns.bind();
        frame.dispatch(&Pass {
            name: "edt rows",
            pipeline: &self.pipeline,
            bind: &[
                columns,
                live,
                Bind::Buffer(&self.sites),
                Bind::Image(output.labels),
                Bind::Image(output.squared),
                Bind::Buffer(&self.active),
            ],
            push: bytemuck::bytes_of(&self.push),
            threads: Threads::Count([self.groups * ROWS, 1, 1]),
        })?;
        frame.count_tiles(self.items, &self.active, 0);
        Ok(())
    }

    pub fn memory_bytes(&self) -> u64 {
        self.columns.memory_bytes() + self.sites.size() + self.active.size()
    }
}
