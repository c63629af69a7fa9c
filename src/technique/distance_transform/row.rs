//! `bounded-row`: the nearest columns of every row. For small radii a CPU driver searches windows of columns; otherwise
//! they come from the lower envelope of the row, computed in segments if there is a radius.

use super::columns::{Columns, ColumnsBindings};
use super::{EdtPush, NO_SEED, Output, UNBOUNDED, storage};
use crate::gpu::{Buffer, ComputePipeline, bindings};
use crate::{Bind, Context, Frame, Pass, Result, Threads};
use std::sync::Arc;

/// Number of rows of a workgroup.
const ROWS: u32 = 8;
/// Number of columns of a segment for small radii, a multiple of 4. Shorter segments are skipped more often; in longer
/// ones the margins on both sides cost less.
const SEGMENT: u32 = 128;
/// Largest number of sites that a thread keeps in an array of its own. A CPU driver puts the array on the stack of its
/// thread, with 8 bytes per site for each of 8 or 16 lanes.
const MOST_OWN_SITES: u32 = 8192;
/// Largest number of columns that a thread of a CPU driver visits, unless a single segment has more.
const ROUNDS: u32 = 18_000;
/// Largest radius of `edt_row_window.comp`.
const MAX_WINDOW: u32 = 64;
/// Number of tiles of 32 columns in a segment of `edt_row_window.comp`. Its loops take up to 155 rounds per tile, and
/// llvmpipe ends them after 65535.
const WINDOW_TILES: u32 = 256;

bindings! {
    struct EnvelopeBindings { ..columns: ColumnsBindings, Sites, Labels, SquaredDistances, Active }
    struct WindowBindings { ..columns: ColumnsBindings, Labels, SquaredDistances, Active }
}

/// The pass over the rows.
struct Rows {
    pipeline: Arc<ComputePipeline>,
    push: EdtPush,
    threads: [u32; 3],
    /// Number of segments or tiles of all rows.
    items: u32,
    /// Sites of `edt_row.comp`; `None` for `edt_row_window.comp`.
    sites: Option<Buffer>,
}

impl Rows {
    /// Makes the pass that searches windows of columns.
    fn window(context: &Context, push: EdtPush) -> Result<Self> {
        let [width, height] = push.size;
        let tiles = width.div_ceil(32);
        let push = EdtPush { span: WINDOW_TILES, ..push };
        let constants = [("HALO", push.radius.clamp(1, MAX_WINDOW).next_multiple_of(32)), ("SQUARED", push.squared)];
        Ok(Self {
            pipeline: context
                .pipeline::<WindowBindings, EdtPush>("distance_transform/edt_row_window.comp", &constants)?,
            push,
            threads: [height, tiles.div_ceil(WINDOW_TILES), 1],
            items: tiles * height.div_ceil(ROWS),
            sites: None,
        })
    }

    /// Makes the pass that computes lower envelopes.
    fn envelope(context: &Context, push: EdtPush, is_cpu: bool) -> Result<Self> {
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
        Ok(Self {
            pipeline: context.pipeline::<EnvelopeBindings, EdtPush>(
                "distance_transform/edt_row.comp",
                &[("OWN_SITES", own_sites)],
            )?,
            push: EdtPush { span, ..push },
            threads: [groups * ROWS, 1, 1],
            items: width.div_ceil(span) * height,
            sites: Some(storage(context, "edt sites", shared, 8)?),
        })
    }
}

pub(super) struct Row {
    columns: Columns,
    rows: Rows,
    /// Labels, with rows padded to whole groups of four pixels.
    labels: Arc<Buffer>,
    /// True if `labels` belongs to others too.
    shared: bool,
    squared: Option<Buffer>,
    active: Buffer,
}

impl Row {
    pub fn new(context: &Context, push: EdtPush, is_cpu: bool, shared: Option<&Arc<Buffer>>) -> Result<Self> {
        let [width, height] = push.size;
        let padded = u64::from(width.next_multiple_of(4)) * u64::from(height);
        Ok(Self {
            columns: Columns::new(context, push, if is_cpu { 1 } else { height.div_ceil(256) })?,
            rows: match is_cpu && push.radius <= MAX_WINDOW && context.device().shuffles(ROWS) {
                true => Rows::window(context, push)?,
                false => Rows::envelope(context, push, is_cpu)?,
            },
            labels: match shared {
                Some(labels) => labels.clone(),
                None => Arc::new(storage(context, "edt label rows", padded, 4)?),
            },
            shared: shared.is_some(),
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
        if self.rows.push.radius < UNBOUNDED {
            frame.fill("edt clear labels", &self.labels, NO_SEED);
            if let Some(squared) = &self.squared {
                frame.fill("edt clear squared distances", squared, NO_SEED);
            }
        }
        let window = WindowBindings {
            columns: self.columns.bind(),
            Labels: Bind::Buffer(&self.labels),
            // Without squared distances, the shader's binding still needs a buffer.
            SquaredDistances: Bind::Buffer(self.squared.as_ref().unwrap_or(&self.labels)),
            Active: Bind::Buffer(&self.active),
        };
        let envelope = self.rows.sites.as_ref().map(|sites| EnvelopeBindings {
            columns: window.columns,
            Sites: Bind::Buffer(sites),
            Labels: window.Labels,
            SquaredDistances: window.SquaredDistances,
            Active: window.Active,
        });
        frame.dispatch(&Pass {
            name: "edt rows",
            pipeline: &self.rows.pipeline,
            bind: match &envelope {
                Some(envelope) => envelope,
                None => &window,
            },
            push: bytemuck::bytes_of(&self.rows.push),
            threads: Threads::Count(self.rows.threads),
        })?;
        frame.count_tiles(self.rows.items, &self.active, 0);
        let row_pixels = self.rows.push.size[0].next_multiple_of(4);
        frame.copy_to_image("edt copy labels", &self.labels, row_pixels, output.labels);
        if let Some(squared) = &self.squared {
            frame.copy_to_image("edt copy squared distances", squared, row_pixels, output.squared);
        }
        Ok(())
    }

    pub fn memory_bytes(&self) -> u64 {
        let squared = self.squared.as_ref().map_or(0, Buffer::size);
        let labels = if self.shared { 0 } else { self.labels.size() };
        let sites = self.rows.sites.as_ref().map_or(0, Buffer::size);
        self.columns.memory_bytes() + sites + labels + squared + self.active.size()
    }
}
