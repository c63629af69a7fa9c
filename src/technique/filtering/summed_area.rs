//! Summed-area table of the moments of a shadow map, in integers that may wrap around.

use super::moment_kind::Kind;
use crate::gpu::{ComputePipeline, Image, ImageDesc, bindings, shader_struct};
use crate::technique::common::kept::Kept;
use crate::{Bind, Context, Frame, Inputs, Pass, Result, Threads};
use ash::vk;
use std::sync::Arc;

shader_struct! {
    /// Push constants of `glsl/filtering/table_columns.comp`, `table_rows.comp` and `table_means.comp`.
    pub struct TablePush {
        map_size: [i32; 2],
        range: f32,
        scale: f32,
    }
}

bindings! {
    struct ColumnsBindings { shadow_map, summed_columns }
    struct RowsBindings { summed_columns, table }
}

/// Returns the integer that stands for 1 in a table whose largest window has `width` x `width` texels: the greatest for
/// which the sum over such a window is certain to fit 32 bits, and never so great that rounding to `f32` exceeds it.
///
/// A texel's moment is off by at most half of one over it, and by the 24 bits of the `f32` that it comes from: 22 bits are
/// left of each at 31 texels, 18 at 127, 14 at 511. The map's own size costs nothing.
pub fn scale(width: u32) -> f32 {
    let texels = f64::from(width) * f64::from(width);
    let most = f64::from(u32::MAX) / texels;
    // Two steps of single precision below: the shader rounds the scale, and its product with a moment.
    (most * (1.0 - 2.0 * f64::from(f32::EPSILON)) - 1.0).floor().min(f64::from(1u32 << 31)) as f32
}

/// The passes, their images, and what these were made from.
pub struct SummedArea {
    columns: Arc<ComputePipeline>,
    rows: Arc<ComputePipeline>,
    summed_columns: Image,
    table: Image,
    scale: f32,
    kept: Kept,
}

impl SummedArea {
    /// Allocates for a shadow map, and windows of up to `width` x `width` texels. Both images have 8 bytes a texel for two
    /// moments, and 16 for four.
    ///
    /// # Errors
    /// [`crate::Error`] if the device cannot make the images.
    pub fn new(context: &Context, map_size: [u32; 2], kind: Kind, width: u32) -> Result<Self> {
        let format = match kind {
            Kind::Variance => vk::Format::R32G32_UINT,
            _ => vk::Format::R32G32B32A32_UINT,
        };
        let image = |name| Image::new(context.device(), &ImageDesc::storage(name, format, map_size));
        let kind = [("KIND", kind as u32)];
        Ok(Self {
            columns: context.pipeline::<ColumnsBindings, TablePush>("filtering/table_columns.comp", &kind)?,
            rows: context.pipeline::<RowsBindings, TablePush>("filtering/table_rows.comp", &[])?,
            summed_columns: image("summed columns")?,
            table: image("summed-area table")?,
            scale: scale(width),
            kept: Kept::default(),
        })
    }

    /// The table: texel (x, y) holds the sums of the moments, as shares of [`Self::scale`], over texels 0 to x and 0 to y,
    /// modulo 2^32.
    pub fn table(&self) -> &Image {
        &self.table
    }

    /// The integer that stands for 1.
    pub fn scale(&self) -> f32 {
        self.scale
    }

    /// Bytes of both images.
    pub fn memory_bytes(&self) -> u64 {
        self.summed_columns.memory_bytes() + self.table.memory_bytes()
    }

    pub(super) fn push(&self, range: f32) -> TablePush {
        TablePush { map_size: self.table.extent().map(|n| n as i32), range, scale: self.scale }
    }

    /// Recomputes the table, unless the light has not changed since. `range` is that of [`super::moment_kind::range`].
    ///
    /// # Errors
    /// Errors are those of a dispatch.
    pub fn record(&mut self, frame: &mut Frame<'_>, inputs: &Inputs<'_>, range: f32) -> Result<()> {
        if self.kept.holds(inputs) {
            return Ok(());
        }
        self.kept.make(frame, inputs);
        let push = self.push(range);
        let push = bytemuck::bytes_of(&push);
        let [width, height] = self.table.extent();
        frame.dispatch(&Pass {
            name: "summed area, columns",
            pipeline: &self.columns,
            bind: &ColumnsBindings {
                shadow_map: Bind::Input(&inputs.shadow_map),
                summed_columns: Bind::Image(&self.summed_columns),
            },
            push,
            // One group of threads from top to bottom.
            threads: Threads::Count([width, 1, 1]),
        })?;
        frame.dispatch(&Pass {
            name: "summed area, rows",
            pipeline: &self.rows,
            bind: &RowsBindings { summed_columns: Bind::Image(&self.summed_columns), table: Bind::Image(&self.table) },
            push,
            // One group of threads a row.
            threads: Threads::Count([1, height, 1]),
        })
    }
}
