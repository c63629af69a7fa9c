//! `bounded-row`: the nearest columns of every row. For small radii a CPU driver searches windows of columns; otherwise
//! they come from the lower envelope of the row, computed in segments if there is a radius.

use super::columns::{Columns, ColumnsBindings};
use super::{EdtPush, NO_SEED, Output, UNBOUNDED, storage};
use crate::gpu::{Bindings, Buffer, ComputePipeline, bindings};
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
    struct EnvelopeBindings { ..columns: ColumnsBindings, Sites, Labels, SquaredDistances, Active, Done }
    struct WindowBindings { ..columns: ColumnsBindings, Labels, SquaredDistances, Active, Done }
}

/// A pass over the rows.
struct Rows {
    pipeline: Arc<ComputePipeline>,
    push: EdtPush,
    threads: [u32; 3],
    /// Number of segments or tiles of all rows.
    items: u32,
    /// Number of those that were worked on.
    active: Buffer,
}

impl Rows {
    /// Makes the pass that searches windows of columns. With `marked`, it marks the tiles of each row that it has finished.
    fn window(context: &Context, push: EdtPush, marked: bool) -> Result<Self> {
        let [width, height] = push.size;
        let tiles = width.div_ceil(32);
        let radius = push.radius.min(MAX_WINDOW);
        let halo = radius.max(1).next_multiple_of(32);
        let constants = [("HALO", halo), ("SQUARED", push.squared), ("MARKED", marked.into())];
        Ok(Self {
            pipeline: context
                .pipeline::<WindowBindings, EdtPush>("distance_transform/edt_row_window.comp", &constants)?,
            push: EdtPush { radius, span: WINDOW_TILES, ..push },
            threads: [height, tiles.div_ceil(WINDOW_TILES), 1],
            items: tiles * height.div_ceil(ROWS),
            active: storage(context, "edt active tiles", 1, 4)?,
        })
    }

    /// Makes the pass that computes lower envelopes of `segments`; with `gaps`, only in the tiles that the windows left.
    fn envelope(context: &Context, push: EdtPush, segments: &Segments, gaps: bool) -> Result<Self> {
        let [width, height] = push.size;
        let constants = [("OWN_SITES", segments.own_sites), ("GAPS", gaps.into())];
        Ok(Self {
            pipeline: context.pipeline::<EnvelopeBindings, EdtPush>("distance_transform/edt_row.comp", &constants)?,
            push: EdtPush { span: segments.span, ..push },
            threads: [segments.groups * ROWS, 1, 1],
            items: width.div_ceil(segments.span) * height,
            active: storage(context, "edt active rows", 1, 4)?,
        })
    }

    fn record(&self, frame: &mut Frame<'_>, name: &str, bind: &dyn Bindings) -> Result<()> {
        frame.dispatch(&Pass {
            name,
            pipeline: &self.pipeline,
            bind,
            push: bytemuck::bytes_of(&self.push),
            threads: Threads::Count(self.threads),
        })?;
        frame.count_tiles(self.items, &self.active, 0);
        Ok(())
    }
}

/// Segments of rows whose lower envelopes are computed.
struct Segments {
    /// Columns of a segment.
    span: u32,
    /// Workgroups of [`ROWS`] rows that take the segments in turn.
    groups: u32,
    /// Sites that a thread keeps in an array of its own, or 1 if all are in a buffer.
    own_sites: u32,
}

impl Segments {
    fn new(push: EdtPush, is_cpu: bool) -> Self {
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
        Self { span, groups, own_sites }
    }

    /// Number of sites in the buffer.
    fn shared_sites(&self) -> u64 {
        if self.own_sites > 1 { 1 } else { u64::from(self.groups * ROWS) * u64::from(self.span) }
    }
}

/// The pass over lower envelopes.
struct Envelopes {
    rows: Rows,
    sites: Buffer,
}

pub(super) struct Row {
    width: u32,
    columns: Columns,
    windows: Option<Rows>,
    envelopes: Option<Envelopes>,
    /// Tiles of each row that the windows have finished, if envelopes follow them.
    done: Option<Buffer>,
    /// Labels, with rows padded to whole groups of four pixels.
    labels: Arc<Buffer>,
    /// True if `labels` belongs to others too.
    shared: bool,
    squared: Option<Buffer>,
}

impl Row {
    pub fn new(context: &Context, push: EdtPush, is_cpu: bool, shared: Option<&Arc<Buffer>>) -> Result<Self> {
        let [width, height] = push.size;
        let padded = u64::from(width.next_multiple_of(4)) * u64::from(height);
        let segments = Segments::new(push, is_cpu);
        let searches = is_cpu && context.device().shuffles(ROWS);
        let windows_suffice = searches && push.radius <= MAX_WINDOW;
        // Most pixels of an unbounded transform have a seed that near as well.
        let gaps = searches && push.radius >= UNBOUNDED && segments.own_sites > 1;
        let near = gaps.then_some(MAX_WINDOW);
        let tiles = u64::from(width.div_ceil(32)) * u64::from(height);
        Ok(Self {
            width,
            columns: Columns::new(context, push, if is_cpu { 1 } else { height.div_ceil(256) }, near)?,
            windows: (windows_suffice || gaps).then(|| Rows::window(context, push, gaps)).transpose()?,
            envelopes: match windows_suffice {
                true => None,
                false => Some(Envelopes {
                    rows: Rows::envelope(context, push, &segments, gaps)?,
                    sites: storage(context, "edt sites", segments.shared_sites(), 8)?,
                }),
            },
            done: if gaps { Some(storage(context, "edt finished tiles", tiles, 4)?) } else { None },
            labels: match shared {
                Some(labels) => labels.clone(),
                None => Arc::new(storage(context, "edt label rows", padded, 4)?),
            },
            shared: shared.is_some(),
            squared: match push.squared {
                0 => None,
                _ => Some(storage(context, "edt squared distance rows", padded, 4)?),
            },
        })
    }

    pub fn record(&self, frame: &mut Frame<'_>, seed_bits: &Buffer, output: &Output<'_>) -> Result<()> {
        self.columns.record(frame, seed_bits)?;
        if let Some(done) = &self.done {
            frame.fill("edt clear finished tiles", done, 0);
        }
        // Without a radius, each row is written whole.
        let is_bounded = self.envelopes.as_ref().is_none_or(|e| e.rows.push.radius < UNBOUNDED);
        if is_bounded {
            frame.fill("edt clear labels", &self.labels, NO_SEED);
            if let Some(squared) = &self.squared {
                frame.fill("edt clear squared distances", squared, NO_SEED);
            }
        }
        let labels = Bind::Buffer(&self.labels);
        // Bindings that a form of the shaders does not use still need a buffer.
        let squared = Bind::Buffer(self.squared.as_ref().unwrap_or(&self.labels));
        if let Some(rows) = &self.windows {
            frame.update(&rows.active, &[0; 4]);
            rows.record(
                frame,
                "edt rows",
                &WindowBindings {
                    columns: self.columns.bind_near().unwrap_or_else(|| self.columns.bind()),
                    Labels: labels,
                    SquaredDistances: squared,
                    Active: Bind::Buffer(&rows.active),
                    Done: Bind::Buffer(self.done.as_ref().unwrap_or(&rows.active)),
                },
            )?;
        }
        if let Some(Envelopes { rows, sites }) = &self.envelopes {
            frame.update(&rows.active, &[0; 4]);
            rows.record(
                frame,
                if self.done.is_some() { "edt rows, gaps" } else { "edt rows" },
                &EnvelopeBindings {
                    columns: self.columns.bind(),
                    Sites: Bind::Buffer(sites),
                    Labels: labels,
                    SquaredDistances: squared,
                    Active: Bind::Buffer(&rows.active),
                    Done: Bind::Buffer(self.done.as_ref().unwrap_or(&rows.active)),
                },
            )?;
        }
        let row_pixels = self.width.next_multiple_of(4);
        frame.copy_to_image("edt copy labels", &self.labels, row_pixels, output.labels);
        if let Some(squared) = &self.squared {
            frame.copy_to_image("edt copy squared distances", squared, row_pixels, output.squared);
        }
        Ok(())
    }

    pub fn memory_bytes(&self) -> u64 {
        let squared = self.squared.as_ref().map_or(0, Buffer::size);
        let labels = if self.shared { 0 } else { self.labels.size() };
        let done = self.done.as_ref().map_or(0, Buffer::size);
        let windows = self.windows.as_ref().map_or(0, |rows| rows.active.size());
        let envelopes = self.envelopes.as_ref().map_or(0, |e| e.rows.active.size() + e.sites.size());
        self.columns.memory_bytes() + windows + envelopes + done + labels + squared
    }
}
