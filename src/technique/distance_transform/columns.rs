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
    bits: Buffer,
}

impl Columns {
    /// Makes the passes. `row_bands` is the number of bands into which the blocks of a column are divided; one thread
    /// works on one band.
    pub fn new(context: &Context, push: EdtPush, row_bands: u32) -> Result<Self> {
        let [width, height] = push.size;
        let blocks = height.div_ceil(32);
        let row_bands = row_bands.clamp(1, blocks);
        Ok(Self {
            join: context.pipeline::<JoinBindings, EdtPush>("distance_transform/edt_columns.comp", &[])?,
            live: context.pipeline::<ColumnsBindings, EdtPush>("distance_transform/edt_live.comp", &[])?,
            push: EdtPush { span: blocks.div_ceil(row_bands), ..push },
            row_bands,
            columns: Image::new(context.device(), &ImageDesc::storage("edt columns", FORMAT, [width, blocks]))?,
            bits: storage(context, "edt live columns", u64::from(width.div_ceil(32)) * u64::from(blocks), 4)?,
        })
    }

    pub fn record(&self, frame: &mut Frame<'_>, seed_bits: &Buffer) -> Result<()> {
        let [width, height] = self.push.size;
        let push = bytemuck::bytes_of(&self.push);
        frame.dispatch(&Pass {
            name: "edt columns",
            pipeline: &self.join,
            bind: &JoinBindings { SeedBits: Bind::Buffer(seed_bits), columns: Bind::Image(&self.columns) },
            push,
            threads: Threads::Count([width, self.row_bands, 1]),
        })?;
        frame.dispatch(&Pass {
            name: "edt live columns",
            pipeline: &self.live,
            bind: &self.bind(),
            push,
            threads: Threads::Count([width.div_ceil(32), height.div_ceil(32), 1]),
        })
    }

    pub fn bind(&self) -> ColumnsBindings<'_> {
        ColumnsBindings { columns: Bind::Image(&self.columns), Live: Bind::Buffer(&self.bits) }
    }

    pub fn memory_bytes(&self) -> u64 {
        self.columns.memory_bytes() + self.bits.size()
    }
}
