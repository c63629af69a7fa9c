//! Map of edge ids: for each texel of the shadow map its nearest silhouette edges.

use crate::gpu::{Buffer, BufferDesc, ComputePipeline, MemoryKind, shader_struct};
use crate::pass::edge_segments::EdgeSegments;
use crate::pass::silhouettes::{Silhouettes, WALKS};
use crate::{Bind, Context, Error, Frame, Inputs, Pass, Result, Threads};
use ash::vk;
use std::sync::Arc;

shader_struct! {
    /// Push constants of `glsl/pass/edge_map.comp`.
    pub struct EdgeMapPush {
        map_size: [i32; 2],
        radius: f32,
    }
}

/// What of the pass is fixed at its making.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct EdgeMapConfig {
    /// Slots a texel: 1 to 8.
    pub slots: u32,
    /// Leave out edges that lie behind everything that the light sees around a texel.
    pub kill: bool,
    /// Texels around an edge that learn of it.
    pub radius: f32,
}

/// The pass with its map: 8 bytes a slot.
pub struct EdgeMap {
    walk: Arc<ComputePipeline>,
    keys: Buffer,
    lost: Buffer,
    config: EdgeMapConfig,
    map_size: [u32; 2],
}

impl EdgeMap {
    /// Allocates.
    ///
    /// # Errors
    /// [`Error::Parameter`] for a map too large for a storage buffer of the device.
    pub fn new(context: &Context, map_size: [u32; 2], config: EdgeMapConfig) -> Result<Self> {
        let size = u64::from(map_size[0]) * u64::from(map_size[1]) * u64::from(config.slots) * 8;
        let most = u64::from(context.device().limits.max_storage_buffer_range);
        if size > most {
            let [w, h] = map_size;
            let problem = format!(
                "edge ids of a {w}x{h} map take {size} bytes with {} slots a texel; a storage buffer of this device has {most}: \
                 use a smaller map or fewer slots",
                config.slots
            );
            return Err(Error::Parameter(problem));
        }
        let usage = vk::BufferUsageFlags::STORAGE_BUFFER
            | vk::BufferUsageFlags::TRANSFER_DST
            | vk::BufferUsageFlags::TRANSFER_SRC;
        let buffer =
            |name, size| Buffer::new(context.device(), &BufferDesc { name, size, usage, memory: MemoryKind::Gpu });
        Ok(Self {
            walk: context.pipeline::<EdgeMapPush>("pass/edge_map.comp", &[config.slots, config.kill.into()])?,
            keys: buffer("edge ids", size)?,
            lost: buffer("lost edges", 4)?,
            config,
            map_size,
        })
    }

    /// Fills the map with the segments.
    pub fn record(
        &self,
        frame: &mut Frame<'_>,
        inputs: &Inputs<'_>,
        silhouettes: &Silhouettes,
        segments: &EdgeSegments,
    ) -> Result<()> {
        frame.fill("edge ids, cleared", &self.keys, u32::MAX);
        frame.update(&self.lost, &[0; 4]);
        let push = EdgeMapPush { map_size: self.map_size.map(|n| n as i32), radius: self.config.radius };
        frame.dispatch(&Pass {
            name: "edge ids",
            pipeline: &self.walk,
            bind: &[
                Bind::Input(&inputs.shadow_map),
                Bind::Buffer(segments.segments()),
                Bind::Buffer(&self.keys),
                Bind::Buffer(&self.lost),
                Bind::Buffer(silhouettes.header()),
            ],
            push: bytemuck::bytes_of(&push),
            threads: Threads::Indirect(silhouettes.header(), WALKS),
        })
    }

    /// The map: for each texel, row by row, its slots, nearest first: segment, then the bits of its squared distance.
    pub fn keys(&self) -> &Buffer {
        &self.keys
    }

    /// How many times an edge found no slot: a `u32`.
    pub fn lost(&self) -> &Buffer {
        &self.lost
    }

    /// Bytes of device memory.
    pub fn memory_bytes(&self) -> u64 {
        self.keys.size() + self.lost.size()
    }
}
