//! The casters' silhouette edges in the shadow map's space: what the techniques that cut a map by edges draw.

use super::silhouettes::Silhouettes;
use crate::casters::Casters;
use crate::gpu::{Buffer, BufferDesc, ComputePipeline, MemoryKind, shader_struct};
use crate::{Bind, Context, Error, Frame, Inputs, Pass, Result, Threads};
use ash::vk;
use std::sync::Arc;

/// Bytes of `MapEdge` of `glsl/pass/map_edge.glsl`.
const RECORD: u64 = 7 * 4;
/// Where the arguments to draw a quad an edge stand in `SilhouetteHeader`.
pub(crate) const QUADS: u64 = 9 * 4;

shader_struct! {
    /// Push constants of `glsl/pass/map_edges.comp`.
    pub struct MapEdgesPush {
        stride: u32,
        margin: f32,
        map_size: [u32; 2],
    }
}

/// The passes with their list. While the light stands still ([`Inputs::light_version`]), the list is kept.
pub struct MapEdges {
    silhouettes: Silhouettes,
    pipeline: Arc<ComputePipeline>,
    records: Buffer,
    margin: f32,
    technique: &'static str,
}

impl MapEdges {
    /// Allocates room for every edge of the casters. Of each edge what lies up to `margin` texels around the map is kept.
    ///
    /// # Errors
    /// [`Error::Input`] without casters; [`Error::Usage`] for more than the device's buffers hold.
    pub fn new(
        context: &Context,
        technique: &'static str,
        casters: Option<&Arc<Casters>>,
        margin: f32,
    ) -> Result<Self> {
        let Some(casters) = casters else {
            let problem = "none were given to prepare the technique with (technique::Setup::casters)";
            return Err(Error::Input { technique: technique.into(), input: "casters", problem: problem.into() });
        };
        let size = u64::from(casters.counts().edges) * RECORD;
        let most = u64::from(context.device().limits.max_storage_buffer_range);
        if size > most {
            let problem = format!("edges in the map: {size} bytes; a storage buffer of this device has {most} at most");
            return Err(Error::Usage(problem));
        }
        let usage = vk::BufferUsageFlags::STORAGE_BUFFER | vk::BufferUsageFlags::TRANSFER_SRC;
        let desc = BufferDesc { name: "edges in the map", size, usage, memory: MemoryKind::Gpu };
        Ok(Self {
            silhouettes: Silhouettes::new(context, casters, true)?,
            pipeline: context.pipeline::<MapEdgesPush>("pass/map_edges.comp", &[])?,
            records: Buffer::new(context.device(), &desc)?,
            margin,
            technique,
        })
    }

    /// Lists the edges. False if those of the frame before still hold, and all that was made of them.
    ///
    /// # Errors
    /// [`Error::Input`] unless there is a transform for each instance.
    pub fn record(&mut self, frame: &mut Frame<'_>, inputs: &Inputs<'_>) -> Result<bool> {
        let casters = self.silhouettes.casters();
        let wanted = casters.counts().instances as usize;
        if inputs.casters.len() != wanted {
            let problem = format!("{} transforms for {wanted} instances", inputs.casters.len());
            return Err(Error::Input { technique: self.technique.into(), input: "casters", problem });
        }
        if !self.silhouettes.record(frame, inputs, None)? {
            return Ok(false);
        }
        let casters = self.silhouettes.casters();
        let push = MapEdgesPush { stride: casters.stride(), margin: self.margin, map_size: inputs.shadow_map.extent };
        frame.dispatch(&Pass {
            name: "edges in the map",
            pipeline: &self.pipeline,
            bind: &[
                casters.positions(),
                Bind::Buffer(self.silhouettes.lights()),
                Bind::Buffer(self.silhouettes.header()),
                Bind::Buffer(self.silhouettes.edges()),
                Bind::Buffer(&self.records),
            ],
            push: bytemuck::bytes_of(&push),
            threads: self.threads(),
        })?;
        Ok(true)
    }

    /// A thread an edge, 64 a workgroup.
    pub(crate) fn threads(&self) -> Threads<'_> {
        Threads::Indirect(self.silhouettes.header(), 0)
    }

    /// The list: `MapEdge` of `glsl/pass/map_edge.glsl`.
    pub fn records(&self) -> &Buffer {
        &self.records
    }

    /// Their number and the arguments of dispatches and draws: `SilhouetteHeader`.
    pub fn header(&self) -> &Buffer {
        self.silhouettes.header()
    }

    /// Bytes of device memory.
    pub fn memory_bytes(&self) -> u64 {
        self.silhouettes.memory_bytes() + self.records.size()
    }
}
