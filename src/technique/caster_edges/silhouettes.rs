//! Finds the triangles that face the light, and the silhouette edges at which a shadow may end.

use crate::casters::{CHUNK, Casters};
use crate::gpu::{Buffer, BufferDesc, ComputePipeline, MemoryKind, bindings, shader_struct};
use crate::technique::common::kept::Kept;
use crate::technique::common::view::map_view;
use crate::view::{LightKind, LightView};
use crate::{Bind, Context, Error, Frame, Inputs, Pass, Result, Threads};
use ash::vk;
use glam::{DAffine3, DVec4};
use std::sync::Arc;

/// Bytes of a `SilhouetteHeader` of `glsl/caster_edges/casters.glsl`.
const HEADER: u64 = 16 * 4;
/// Offset in the header of the number of edges.
pub(crate) const COUNT: u64 = 12;
/// Offset in the header of the arguments of a dispatch with 4 edges per workgroup.
pub(crate) const WALKS: u64 = 13 * 4;
/// Offset in the header of the arguments of a draw with 6 vertices per edge.
pub(crate) const QUADS: u64 = 9 * 4;
/// Bytes of an edge in the list.
const EDGE: u64 = 20;

bindings! {
    struct FacingBindings { Positions, Triangles, Chunks, Instances, Lights, Facing }
    struct EdgesBindings { Edges, Fans, Chunks, Instances, Lights, Facing, Offsets, Header, Silhouettes }
    struct OffsetsBindings { Offsets, Header }
}

/// Returns a dispatch of at least `count` workgroups of [`CHUNK`] threads. Workgroups run along x up to `MAX_GROUPS_X`,
/// then along y; `chunkIndex` of `glsl/caster_edges/casters.glsl` numbers them.
pub(crate) fn chunks(count: u32) -> Threads<'static> {
    const MAX_GROUPS_X: u32 = 65535;
    Threads::Count([CHUNK * count.min(MAX_GROUPS_X), count.div_ceil(MAX_GROUPS_X), 1])
}

shader_struct! {
    /// Push constants of the passes over casters.
    pub struct CasterPush {
        chunk_count: u32,
        stride: u32,
    }
}

shader_struct! {
    /// `CasterLight` of `glsl/caster_edges/casters.glsl`.
    pub struct CasterLight {
        clip_from_object: [[f32; 4]; 4],
        light: [f32; 4],
        orientation: f32,
        casts: u32,
        shell: u32,
    }
}

impl CasterLight {
    /// The light in the space of an instance: its position if `w` is 1, or the unit vector towards it if `w` is 0.
    pub fn light(light: &LightView, world_from_object: &DAffine3) -> DVec4 {
        let object_from_world = world_from_object.matrix3.inverse();
        match light.kind {
            LightKind::Spot { .. } => {
                let offset = light.world_from_view.translation - world_from_object.translation;
                (object_from_world * offset).extend(1.0)
            }
            // The vector is used only to tell sides, so any length would do. It is normalised because tiny and huge
            // scales would leave the range of `f32`.
            LightKind::Directional { .. } => (object_from_world * -light.direction()).normalize_or_zero().extend(0.0),
        }
    }

    /// Describes an instance as a light sees it. Everything is computed in `f64`, and positions are subtracted first.
    pub fn new(light: &LightView, world_from_object: &DAffine3) -> Self {
        Self {
            clip_from_object: light.clip_from_object(world_from_object).as_mat4().to_cols_array_2d(),
            light: Self::light(light, world_from_object).as_vec4().to_array(),
            orientation: if world_from_object.matrix3.determinant() < 0.0 { -1.0 } else { 1.0 },
            casts: 1,
            shell: 0,
        }
    }
}

/// The passes with their lists, which are kept while the light stands still ([`Inputs::light_version`]).
pub struct Silhouettes {
    casters: Arc<Casters>,
    facing_bits: Arc<ComputePipeline>,
    count: Arc<ComputePipeline>,
    offsets_scan: Arc<ComputePipeline>,
    write: Arc<ComputePipeline>,
    lights: Buffer,
    facing: Buffer,
    offsets: Buffer,
    header: Buffer,
    edges: Buffer,
    kept: Kept,
    /// Flags of the instances that cast shadows in the current list.
    casts: Vec<bool>,
}

impl Silhouettes {
    /// Makes the passes, with room for every edge of the casters. With `shells`, closed meshes count once for each
    /// shell between a point and the light instead of once for each triangle.
    ///
    /// # Errors
    /// [`Error::Usage`] if the casters need more than the device's buffers hold.
    pub fn new(context: &Context, casters: &Arc<Casters>, shells: bool) -> Result<Self> {
        let counts = casters.counts();
        let most = u64::from(context.device().limits.max_storage_buffer_range);
        let buffer = |name, size: u64, usage| {
            if size > most {
                let problem = format!("{name}: {size} bytes, but a storage buffer of this device has at most {most}");
                return Err(Error::Usage(problem));
            }
            let usage = usage | vk::BufferUsageFlags::STORAGE_BUFFER | vk::BufferUsageFlags::TRANSFER_SRC;
            Buffer::new(context.device(), &BufferDesc { name, size, usage, memory: MemoryKind::Gpu })
        };
        let none = vk::BufferUsageFlags::empty();
        let update = vk::BufferUsageFlags::TRANSFER_DST;
        let edges_step = |write: bool| {
            let constants = [("WRITE", write.into()), ("SHELLS", shells.into())];
            context.pipeline::<EdgesBindings, CasterPush>("caster_edges/silhouette_edges.comp", &constants)
        };
        Ok(Self {
            facing_bits: context.pipeline::<FacingBindings, CasterPush>("caster_edges/facing.comp", &[])?,
            count: edges_step(false)?,
            offsets_scan: context
                .pipeline::<OffsetsBindings, CasterPush>("caster_edges/silhouette_offsets.comp", &[])?,
            write: edges_step(true)?,
            lights: buffer("casters' lights", u64::from(counts.instances) * size_of::<CasterLight>() as u64, update)?,
            facing: buffer("facing bits", u64::from(counts.triangle_chunks) * 8, none)?,
            offsets: buffer("silhouette offsets", u64::from(counts.edge_chunks) * 4, none)?,
            header: buffer("silhouette header", HEADER, update | vk::BufferUsageFlags::INDIRECT_BUFFER)?,
            edges: buffer("silhouette edges", u64::from(counts.edges) * EDGE, none)?,
            casters: casters.clone(),
            kept: Kept::default(),
            casts: vec![],
        })
    }

    /// Finds the silhouettes of the instances that cast shadows; with `None`, all instances do. Returns false if the
    /// list of the frame before is still valid.
    ///
    /// # Errors
    /// [`Error::Input`] unless there is a transform for each instance.
    pub fn record(&mut self, frame: &mut Frame<'_>, inputs: &Inputs<'_>, casts: Option<&[bool]>) -> Result<bool> {
        let counts = self.casters.counts();
        let casts = |i: usize| casts.is_none_or(|c| c[i]);
        if self.kept.holds(inputs) && self.casts.iter().enumerate().all(|(i, &cast)| cast == casts(i)) {
            return Ok(false);
        }
        self.kept.make(frame, inputs);
        self.casts.clear();
        self.casts.extend((0..counts.instances as usize).map(casts));
        let light = map_view(inputs, 0);
        let seen = inputs.casters.iter().zip(&self.casts).enumerate().map(|(i, (world_from_object, &casts))| {
            let shell = self.casters.is_shell(i, CasterLight::light(&light, world_from_object));
            CasterLight { casts: casts.into(), shell: shell.into(), ..CasterLight::new(&light, world_from_object) }
        });
        let seen: Vec<_> = seen.collect();
        frame.update(&self.lights, bytemuck::cast_slice(&seen));
        frame.update(&self.header, &[0; HEADER as usize]);
        let lights = Bind::Buffer(&self.lights);
        let push = |chunk_count| CasterPush { chunk_count, stride: self.casters.stride() };
        let c = &*self.casters;
        if counts.triangle_chunks > 0 {
            frame.dispatch(&Pass {
                name: "facing",
                pipeline: &self.facing_bits,
                bind: &FacingBindings {
                    Positions: c.positions(),
                    Triangles: Bind::Buffer(&c.triangles),
                    Chunks: Bind::Buffer(&c.triangle_chunks),
                    Instances: Bind::Buffer(&c.instances),
                    Lights: lights,
                    Facing: Bind::Buffer(&self.facing),
                },
                push: bytemuck::bytes_of(&push(counts.triangle_chunks)),
                threads: chunks(counts.triangle_chunks),
            })?;
        }
        let edges = |frame: &mut Frame<'_>, name, pipeline| {
            frame.dispatch(&Pass {
                name,
                pipeline,
                bind: &EdgesBindings {
                    Edges: Bind::Buffer(&c.edges),
                    Fans: Bind::Buffer(&c.fans),
                    Chunks: Bind::Buffer(&c.edge_chunks),
                    Instances: Bind::Buffer(&c.instances),
                    Lights: lights,
                    Facing: Bind::Buffer(&self.facing),
                    Offsets: Bind::Buffer(&self.offsets),
                    Header: Bind::Buffer(&self.header),
                    Silhouettes: Bind::Buffer(&self.edges),
                },
                push: bytemuck::bytes_of(&push(counts.edge_chunks)),
                threads: chunks(counts.edge_chunks),
            })
        };
        edges(frame, "silhouettes, counted", &self.count)?;
        frame.dispatch(&Pass {
            name: "silhouettes, offsets",
            pipeline: &self.offsets_scan,
            bind: &OffsetsBindings { Offsets: Bind::Buffer(&self.offsets), Header: Bind::Buffer(&self.header) },
            push: bytemuck::bytes_of(&push(counts.edge_chunks)),
            threads: Threads::Count([256, 1, 1]),
        })?;
        edges(frame, "silhouettes", &self.write)?;
        Ok(true)
    }

    /// The casters.
    pub fn casters(&self) -> &Arc<Casters> {
        &self.casters
    }

    /// The list of edges, as `SilhouetteEdge` of `glsl/caster_edges/casters.glsl`, with 20 bytes per edge.
    pub fn edges(&self) -> &Buffer {
        &self.edges
    }

    /// Header of the list: `SilhouetteHeader` of `glsl/caster_edges/casters.glsl`.
    pub fn header(&self) -> &Buffer {
        &self.header
    }

    /// One thread for each edge of the list, [`CHUNK`] per workgroup.
    pub(crate) fn threads(&self) -> Threads<'_> {
        Threads::Indirect(&self.header, 0)
    }

    /// Index in the list at which each workgroup of edges begins to write.
    pub(crate) fn offsets(&self) -> &Buffer {
        &self.offsets
    }

    /// `CasterLight` of every instance.
    pub fn lights(&self) -> &Buffer {
        &self.lights
    }

    /// Facing bits: triangle `t` of an instance is bit `64 first_triangle_chunk + t`.
    pub fn facing(&self) -> &Buffer {
        &self.facing
    }

    /// Bytes of device memory.
    pub fn memory_bytes(&self) -> u64 {
        [&self.lights, &self.facing, &self.offsets, &self.header, &self.edges].iter().map(|b| b.size()).sum()
    }
}
