//! A list of pixels that a heavy pass works off by indirect dispatch, every thread with work.

use crate::gpu::{Buffer, BufferDesc, Device, MemoryKind};
use crate::pass::tiles::TILE;
use crate::{Frame, Result, Threads};
use ash::vk;
use std::sync::Arc;

/// Bytes before the pixels: the dispatch arguments, the count of pixels, that of tiles.
const HEADER: u64 = 20;
/// Offset of the count of tiles.
const TILES: u64 = 16;

/// The list; 4 bytes a pixel. `PixelList` of the shaders is the other side.
pub struct PixelList {
    buffer: Buffer,
    tiles_total: u32,
}

impl PixelList {
    /// Room for every pixel of an image.
    pub fn new(device: &Arc<Device>, name: &str, extent: [u32; 2]) -> Result<Self> {
        let usage = vk::BufferUsageFlags::STORAGE_BUFFER
            | vk::BufferUsageFlags::INDIRECT_BUFFER
            | vk::BufferUsageFlags::TRANSFER_DST
            | vk::BufferUsageFlags::TRANSFER_SRC;
        let pixels = u64::from(extent[0]) * u64::from(extent[1]);
        let desc = BufferDesc { name, size: HEADER + 4 * pixels, usage, memory: MemoryKind::Gpu };
        let tiles_total = extent[0].div_ceil(TILE) * extent[1].div_ceil(TILE);
        Ok(Self { buffer: Buffer::new(device, &desc)?, tiles_total })
    }

    /// Empties the list.
    pub fn clear(&self, frame: &mut Frame<'_>) {
        let header: [u32; 5] = [0, 1, 1, 0, 0];
        frame.update(&self.buffer, bytemuck::bytes_of(&header));
    }

    /// For binding.
    pub fn buffer(&self) -> &Buffer {
        &self.buffer
    }

    /// A thread a listed pixel.
    pub fn threads(&self) -> Threads<'_> {
        Threads::Indirect(&self.buffer, 0)
    }

    /// Notes in how many tiles the pixels lie that the pass recorded last worked on.
    pub fn count(&self, frame: &mut Frame<'_>) {
        frame.count_tiles(self.tiles_total, &self.buffer, TILES);
    }
}
