//! First part of the transform: for every column and block of 32 rows, the distances in rows to the next seed above and
//! below the block. Also finds the columns that have a seed in reach.

use super::{EdtPush, storage};
use crate::gpu::{Buffer, ComputePipeline, Image, ImageDesc, bindings};
use crate::{Bind, Context, Frame, Pass, Result, Threads};
use ash::vk;
use std::sync::Arc;

/// Format of an entry: the column's seed bits in the block, and the distances to the next seeds.
const FORMAT: vk::Format = vk::Format::R32G32_UINT;

bindings! {
    struct JoinBindings { SeedBits, columns }

    /// Bindings of `edt_envelope.glsl`, which the passes over rows share.
    pub(super) struct ColumnsBindings { columns, Live }
}

/// The two passes with their buffers.
pub(super) struct Columns {
    join: Arc<ComputePipeline>,
    live: Arc<ComputePipeline>,
    push: EdtPush,
    row_bands: u32,
    columns: Image,
    live_columns: LiveColumns,
    /// Columns with a seed in a shorter reach, if asked for.
    near_columns: Option<LiveColumns>,
}

/// Columns with a seed in reach of a tile.
struct LiveColumns {
    /// Name of the pass that finds them.
    name: &'static str,
    push: EdtPush,
    bits: Buffer,
}

impl LiveColumns {
    fn new(context: &Context, name: &'static str, push: EdtPush) -> Result<Self> {
        let tiles = push.size.map(|n| u64::from(n.div_ceil(32)));
        Ok(Self { name, push, bits: storage(context, name, tiles[0] * tiles[1], 4)? })
    }

    fn bind<'a>(&'a self, columns: &'a Image) -> ColumnsBindings<'a> {
        ColumnsBindings { columns: Bind::Image(columns), Live: Bind::Buffer(&self.bits) }
    }
}

impl Columns {
    /// Makes the passes. `row_bands` is the number of bands into which the blocks of a column are divided; one thread
    /// works on one band. With `near`, the columns with a seed within so many pixels are found too.
    pub fn new(context: &Context, push: EdtPush, row_bands: u32, near: Option<u32>) -> Result<Self> {
        let [width, height] = push.size;
        let blocks = height.div_ceil(32);
        let row_bands = row_bands.clamp(1, blocks);
        Ok(Self {
            join: context.pipeline::<JoinBindings, EdtPush>("distance_transform/edt_columns.comp", &[])?,
            live: context.pipeline::<ColumnsBindings, EdtPush>("distance_transform/edt_live.comp", &[])?,
            push: EdtPush { span: blocks.div_ceil(row_bands), ..push },
            row_bands,
            columns: Image::new(context.device(), &ImageDesc::storage("edt columns", FORMAT, [width, blocks]))?,
            live_columns: LiveColumns::new(context, "edt live columns", push)?,
            near_columns: near
                .map(|radius| LiveColumns::new(context, "edt near columns", EdtPush { radius, ..push }))
                .transpose()?,
        })
    }

    pub fn record(&self, frame: &mut Frame<'_>, seed_bits: &Buffer) -> Result<()> {
        let [width, height] = self.push.size;
        frame.dispatch(&Pass {
            name: "edt columns",
            pipeline: &self.join,
            bind: &JoinBindings { SeedBits: Bind::Buffer(seed_bits), columns: Bind::Image(&self.columns) },
            push: bytemuck::bytes_of(&self.push),
            threads: Threads::Count([width, self.row_bands, 1]),
        })?;
        for live in [Some(&self.live_columns), self.near_columns.as_ref()].into_iter().flatten() {
            frame.dispatch(&Pass {
                name: live.name,
                pipeline: &self.live,
                bind: &live.bind(&self.columns),
                push: bytemuck::bytes_of(&live.push),
                threads: Threads::Count([width.div_ceil(32), height.div_ceil(32), 1]),
            })?;
        }
        Ok(())
    }

    pub fn bind(&self) -> ColumnsBindings<'_> {
        self.live_columns.bind(&self.columns)
    }

    /// The columns with a seed in the shorter reach.
    pub fn bind_near(&self) -> Option<ColumnsBindings<'_>> {
        self.near_columns.as_ref().map(|near| near.bind(&self.columns))
    }

    pub fn memory_bytes(&self) -> u64 {
        let near = self.near_columns.as_ref().map_or(0, |near| near.bits.size());
        self.columns.memory_bytes() + self.live_columns.bits.size() + near
    }
}
