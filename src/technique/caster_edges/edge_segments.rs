//! Silhouette edges as segments in the plane of the shadow map.

use super::silhouettes::Silhouettes;
use crate::gpu::{Buffer, BufferDesc, ComputePipeline, MemoryKind, bindings, shader_struct};
use crate::view::LightView;
use crate::{Bind, Context, Error, Frame, Inputs, Pass, Result};
use ash::vk;
use glam::DMat3;
use std::sync::Arc;

/// Bytes of an `EdgeSegment` of `glsl/lib/edge_segment.glsl`.
pub const SEGMENT: u64 = 44;

shader_struct! {
    /// Push constants of `glsl/caster_edges/edge_segments.comp`.
    pub struct EdgeSegmentsPush {
        map_size: [f32; 2],
        margin: f32,
        nearest: f32,
        mirrored: f32,
        stride: u32,
    }
}

bindings! {
    struct SegmentsBindings { Positions, Lights, Header, Silhouettes, Segments, Triangles }
}

/// The pass with its list: one segment for each edge of [`Silhouettes`].
pub struct EdgeSegments {
    pipeline: Arc<ComputePipeline>,
    segments: Buffer,
}

/// Smallest distance from a light at which edges are projected, as a fraction of the distance of the near plane.
/// Casters in front of the near plane still cast shadows.
const NEAREST: f64 = 1.0 / 64.0;

impl EdgeSegments {
    /// Makes the pass, with room for every edge of the casters.
    ///
    /// # Errors
    /// [`Error::Usage`] if there are more edges than a buffer of the device holds.
    pub fn new(context: &Context, silhouettes: &Silhouettes) -> Result<Self> {
        let size = u64::from(silhouettes.casters().counts().edges) * SEGMENT;
        let most = u64::from(context.device().limits.max_storage_buffer_range);
        if size > most {
            let problem =
                format!("segments of edges: {size} bytes, but a storage buffer of this device has at most {most}");
            return Err(Error::Usage(problem));
        }
        let usage = vk::BufferUsageFlags::STORAGE_BUFFER | vk::BufferUsageFlags::TRANSFER_SRC;
        let desc = BufferDesc { name: "segments of edges", size, usage, memory: MemoryKind::Gpu };
        Ok(Self {
            pipeline: context.pipeline::<SegmentsBindings, EdgeSegmentsPush>("caster_edges/edge_segments.comp", &[])?,
            segments: Buffer::new(context.device(), &desc)?,
        })
    }

    /// Push constants for a light and its map. Segments reach up to `margin` texels beyond the map.
    pub fn push(light: &LightView, map_size: [u32; 2], margin: f32, stride: u32) -> EdgeSegmentsPush {
        let p = &light.clip_from_view;
        // Three directions determine the handedness of the image: the rows x and y, and the direction in which distance
        // grows.
        let away = if light.is_directional() { glam::DVec3::NEG_Z } else { p.row(3).truncate() };
        let image = DMat3::from_cols(p.row(0).truncate(), p.row(1).truncate(), away);
        let near = (p.w_axis.z / p.z_axis.z).abs();
        EdgeSegmentsPush {
            map_size: map_size.map(|n| n as f32),
            margin,
            nearest: if light.is_directional() { 0.0 } else { (near * NEAREST) as f32 },
            mirrored: if image.determinant() < 0.0 { -1.0 } else { 1.0 },
            stride,
        }
    }

    /// Projects the edges in the list of `silhouettes`.
    pub fn record(
        &self,
        frame: &mut Frame<'_>,
        inputs: &Inputs<'_>,
        silhouettes: &Silhouettes,
        margin: f32,
    ) -> Result<()> {
        let casters = silhouettes.casters();
        let push = Self::push(&inputs.light[0], inputs.shadow_map.extent, margin, casters.stride());
        frame.dispatch(&Pass {
            name: "segments of edges",
            pipeline: &self.pipeline,
            bind: &SegmentsBindings {
                Positions: casters.positions(),
                Lights: Bind::Buffer(silhouettes.lights()),
                Header: Bind::Buffer(silhouettes.header()),
                Silhouettes: Bind::Buffer(silhouettes.edges()),
                Segments: Bind::Buffer(&self.segments),
                Triangles: Bind::Buffer(&casters.triangles),
            },
            push: bytemuck::bytes_of(&push),
            threads: silhouettes.threads(),
        })
    }

    /// The list, with [`SEGMENT`] bytes per edge.
    pub fn segments(&self) -> &Buffer {
        &self.segments
    }

    /// Bytes of device memory.
    pub fn memory_bytes(&self) -> u64 {
        self.segments.size()
    }
}
