//! `bounded-tile`: one dispatch with a workgroup for each tile.

use super::{EdtPush, Output, storage};
use crate::gpu::{Buffer, ComputePipeline, bindings};
use crate::{Bind, Context, Error, Frame, Pass, Result, Threads};
use std::sync::Arc;

/// Largest radius in pixels. The shared memory of a workgroup holds no more, and for larger radii the other methods are
/// faster.
pub const MAX_RADIUS: u32 = 64;
/// Pixels per side of this method's tiles.
const TILE: u32 = 32;
/// Threads of the workgroup of `edt_tile.comp`.
const THREADS: u32 = 128;

bindings! {
    struct TileBindings { SeedBits, labels, squared_distances, Active }
}

pub(super) struct Tile {
    pipeline: Arc<ComputePipeline>,
    push: EdtPush,
    active: Buffer,
}

impl Tile {
    pub fn new(context: &Context, push: EdtPush, radius: Option<u32>) -> Result<Self> {
        if radius.is_none_or(|r| r > MAX_RADIUS) {
            let asked = radius.map_or("no radius".into(), |r| format!("a radius of {r} pixels"));
            return Err(Error::Parameter(format!(
                "bounded-tile needs a radius of 0 to {MAX_RADIUS} pixels, but {asked} was given; bounded-row and pba take any"
            )));
        }
        Ok(Self {
            pipeline: context.pipeline::<TileBindings, EdtPush>("distance_transform/edt_tile.comp", &[])?,
            push,
            active: storage(context, "edt active tiles", 1, 4)?,
        })
    }

    pub fn record(&self, frame: &mut Frame<'_>, seed_bits: &Buffer, output: &Output<'_>) -> Result<()> {
        let tiles = self.push.size.map(|n| n.div_ceil(TILE));
        frame.update(&self.active, &[0; 4]);
        frame.dispatch(&Pass {
            name: "edt tiles",
            pipeline: &self.pipeline,
            bind: &TileBindings {
                SeedBits: Bind::Buffer(seed_bits),
                labels: Bind::Image(output.labels),
                squared_distances: Bind::Image(output.squared),
                Active: Bind::Buffer(&self.active),
            },
            push: bytemuck::bytes_of(&self.push),
            threads: Threads::Count([tiles[0] * THREADS, tiles[1], 1]),
        })?;
        frame.count_tiles(tiles[0] * tiles[1], &self.active, 0);
        Ok(())
    }

    pub fn memory_bytes(&self) -> u64 {
        self.active.size()
    }
}
