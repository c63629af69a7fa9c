//! A list of tiles of 8 x 8 pixels, which an expensive pass works on by indirect dispatch.

use crate::gpu::{Buffer, BufferDesc, Device, MemoryKind};
use crate::{Frame, Result, Threads};
use ash::vk;
use std::sync::Arc;

/// Pixels along a tile's side.
pub const TILE: u32 = 8;

/// Bytes before the tiles: the dispatch arguments and the number of tiles.
const HEADER: u64 = 16;
/// Offset of the number of tiles.
const COUNT: u64 = 12;

/// Makes a buffer for a list: `header` bytes that begin with the arguments of an indirect dispatch, then entries of 4
/// bytes.
pub(crate) fn indirect_list(device: &Arc<Device>, name: &str, header: u64, entries: u64) -> Result<Buffer> {
    let usage = vk::BufferUsageFlags::STORAGE_BUFFER
        | vk::BufferUsageFlags::INDIRECT_BUFFER
        | vk::BufferUsageFlags::TRANSFER_DST
        | vk::BufferUsageFlags::TRANSFER_SRC;
    Buffer::new(device, &BufferDesc { name, size: header + 4 * entries, usage, memory: MemoryKind::Gpu })
}

/// The list. `glsl/common/tiles.glsl` defines the format of its entries.
pub struct TileList {
    buffer: Buffer,
    total: u32,
}

impl TileList {
    /// Makes a list with room for every tile of an image.
    pub fn new(device: &Arc<Device>, name: &str, extent: [u32; 2]) -> Result<Self> {
        let total = extent[0].div_ceil(TILE) * extent[1].div_ceil(TILE);
        Ok(Self { buffer: indirect_list(device, name, HEADER, total.into())?, total })
    }

    /// Empties the list.
    pub fn clear(&self, frame: &mut Frame<'_>) {
        let header: [u32; 4] = [0, 1, 1, 0];
        frame.update(&self.buffer, bytemuck::bytes_of(&header));
    }

    /// The buffer, for binding.
    pub fn buffer(&self) -> &Buffer {
        &self.buffer
    }

    /// One workgroup for each listed tile.
    pub fn threads(&self) -> Threads<'_> {
        Threads::Indirect(&self.buffer, 0)
    }

    /// Reports how many tiles the last recorded pass worked on.
    pub fn count(&self, frame: &mut Frame<'_>) {
        frame.count_tiles(self.total, &self.buffer, COUNT);
    }
}
