//! Casters on the GPU: what stays the same from frame to frame.

use super::topology::{Edge, Topology};
use crate::gpu::{Buffer, BufferDesc, MemoryKind, shader_struct};
use crate::{Bind, Context, Error, Result};
use ash::vk;
use glam::{DAffine3, DVec4};

/// Triangles, or edges, that a workgroup works on: `CHUNK` of `glsl/caster_edges/casters.glsl`.
pub const CHUNK: u32 = 64;

/// A triangle mesh that casts, in its own space.
///
/// Hand in as *one* mesh what belongs to one solid: parts of different materials that share a border are closed only
/// together, and closed meshes cost shadow volumes half.
#[derive(Clone, Copy, Debug)]
pub struct CasterMesh<'a> {
    /// For error messages.
    pub name: &'a str,
    /// Positions, object space.
    pub positions: &'a [[f32; 3]],
    /// Three indices a triangle, into `positions`.
    pub indices: &'a [u32],
    /// Where in the vertex buffer of [`Vertices::Buffer`] the first of `positions` lies, vertices.
    pub first_vertex: u32,
}

/// A vertex buffer of the caller: positions are read from it, in place.
#[derive(Clone, Copy, Debug)]
pub struct VertexBuffer {
    buffer: vk::Buffer,
    size: u64,
    stride: u32,
}

/// Bytes of a position.
const POSITION: u64 = 12;

impl VertexBuffer {
    /// `size` is the bytes of the buffer, `stride` those from one vertex to the next, a multiple of 4; a vertex's first
    /// three `f32` are its position.
    ///
    /// # Safety
    /// The buffer is of the context's device, was made with `STORAGE_BUFFER` and with at least `size` bytes, and outlives
    /// the casters and all frames that use them. What was written into it is visible to
    /// [`Inputs::STAGE`](crate::Inputs::STAGE) and, for techniques with raster passes, to vertex shaders.
    pub unsafe fn new(buffer: vk::Buffer, size: u64, stride: u32) -> Self {
        Self { buffer, size, stride }
    }

    /// An error unless the shaders can read all of the meshes' vertices from it.
    fn check(&self, meshes: &[CasterMesh<'_>], largest: u32) -> Result<()> {
        let Self { buffer, size, stride } = *self;
        if buffer == vk::Buffer::null() {
            return Err(Error::Usage("the casters' vertex buffer is null".into()));
        }
        if stride % 4 != 0 || u64::from(stride) < POSITION {
            let problem =
                format!("a stride of {stride} bytes in the casters' vertex buffer: give a multiple of 4, 12 or more");
            return Err(Error::Usage(problem));
        }
        if size > u64::from(largest) {
            let problem = format!(
                "the casters' vertex buffer has {size} bytes; a storage buffer of this device has {largest} at most: split \
                 it, or use Vertices::Copy"
            );
            return Err(Error::Usage(problem));
        }
        for mesh in meshes.iter().filter(|m| !m.positions.is_empty()) {
            let last = u64::from(mesh.first_vertex) + mesh.positions.len() as u64 - 1;
            let end = last * u64::from(stride) + POSITION;
            if end > size {
                let problem = format!(
                    "caster mesh {}: its {} vertices from first_vertex {} on reach up to byte {end} of a vertex buffer of \
                     {size}: check first_vertex, stride and size",
                    mesh.name,
                    mesh.positions.len(),
                    mesh.first_vertex
                );
                return Err(Error::Usage(problem));
            }
        }
        Ok(())
    }
}

/// Where the shaders read positions.
#[derive(Clone, Copy, Debug)]
pub enum Vertices {
    /// In the caller's vertex buffer, without a copy. Its content may change, as long as vertices that lay in one place
    /// still do.
    Buffer(VertexBuffer),
    /// In a copy that the casters own: 12 bytes a vertex.
    Copy,
}

shader_struct! {
    /// `CasterInstance` of `glsl/caster_edges/casters.glsl`.
    pub struct CasterInstance {
        first_triangle: u32,
        triangles: u32,
        first_triangle_chunk: u32,
        first_edge: u32,
        edges: u32,
        first_edge_chunk: u32,
        outward: u32,
    }
}

/// Counts over all instances.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct CasterCounts {
    /// Instances.
    pub instances: u32,
    /// Triangles, instances counted.
    pub triangles: u32,
    /// Edges, instances counted: the most that a list of silhouettes can hold.
    pub edges: u32,
    /// Workgroups of [`CHUNK`] triangles.
    pub triangle_chunks: u32,
    /// Workgroups of [`CHUNK`] edges.
    pub edge_chunks: u32,
}

/// Meshes with the adjacency of their triangles, and which of them stand in the scene: made once, on load.
///
/// Where they stand comes with every frame ([`crate::Inputs::casters`]). Alpha-masked surfaces do not belong here: no
/// edge of the mesh is an edge of their shadow. Leave them in the shadow map, where the techniques that cut shadows by
/// edges find them with the map's own test.
pub struct Casters {
    vertices: Vertices,
    copy: Option<Buffer>,
    pub(crate) triangles: Buffer,
    pub(crate) edges: Buffer,
    pub(crate) fans: Buffer,
    pub(crate) neighbours: Buffer,
    pub(crate) instances: Buffer,
    pub(crate) triangle_chunks: Buffer,
    pub(crate) edge_chunks: Buffer,
    table: Vec<CasterInstance>,
    counts: CasterCounts,
    /// Center and radius, object space, of each instance's mesh.
    spheres: Vec<([f64; 3], f64)>,
    masked: bool,
    memory_bytes: u64,
}

impl std::fmt::Debug for Casters {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Casters").field("counts", &self.counts).finish_non_exhaustive()
    }
}

impl Casters {
    /// Builds the adjacency of every mesh and uploads it. `instances` holds an index into `meshes` for each instance;
    /// `masked` says that there are casters besides, alpha-masked, that only the shadow map knows.
    ///
    /// # Errors
    /// [`Error::Usage`] for an index out of range, for vertices beyond the end of the caller's buffer, or for more than the
    /// device's buffers hold.
    pub fn new(
        context: &Context,
        vertices: Vertices,
        meshes: &[CasterMesh<'_>],
        instances: &[usize],
        masked: bool,
    ) -> Result<Self> {
        if let Vertices::Buffer(buffer) = vertices {
            buffer.check(meshes, context.device().limits.max_storage_buffer_range)?;
        }
        let mut upload = Upload { context, bytes: 0 };
        let mut all = Lists::default();
        let mut placed = Vec::with_capacity(meshes.len());
        for mesh in meshes {
            placed.push(all.add(mesh, matches!(vertices, Vertices::Copy))?);
        }
        let mut counts = CasterCounts { instances: instances.len() as u32, ..CasterCounts::default() };
        let (mut table, mut spheres) = (vec![], vec![]);
        let (mut triangle_chunks, mut edge_chunks): (Vec<u32>, Vec<u32>) = (vec![], vec![]);
        for (i, &mesh) in (0u32..).zip(instances) {
            let Some((record, sphere)) = placed.get(mesh) else {
                let problem = format!("caster {i} is of mesh {mesh}, but there are {}", meshes.len());
                return Err(Error::Usage(problem));
            };
            let add = |total: u32, n: u32| {
                total.checked_add(n).ok_or_else(|| Error::Usage("the casters have more than 2^32 edges".into()))
            };
            table.push(CasterInstance {
                first_triangle_chunk: triangle_chunks.len() as u32,
                first_edge_chunk: edge_chunks.len() as u32,
                ..*record
            });
            triangle_chunks.extend(std::iter::repeat_n(i, record.triangles.div_ceil(CHUNK) as usize));
            edge_chunks.extend(std::iter::repeat_n(i, record.edges.div_ceil(CHUNK) as usize));
            counts.triangles = add(counts.triangles, record.triangles)?;
            counts.edges = add(counts.edges, record.edges)?;
            spheres.push(*sphere);
        }
        counts.triangle_chunks = triangle_chunks.len() as u32;
        counts.edge_chunks = edge_chunks.len() as u32;
        let copy = match vertices {
            Vertices::Copy => Some(upload.buffer("caster positions", bytemuck::cast_slice(&all.positions))?),
            Vertices::Buffer(_) => None,
        };
        Ok(Self {
            vertices,
            copy,
            triangles: upload.buffer("caster triangles", bytemuck::cast_slice(&all.triangles))?,
            edges: upload.buffer("caster edges", bytemuck::cast_slice(&all.edges))?,
            fans: upload.buffer("caster fans", bytemuck::cast_slice(&all.fans))?,
            neighbours: upload.buffer("caster neighbours", bytemuck::cast_slice(&all.neighbours))?,
            instances: upload.buffer("caster instances", bytemuck::cast_slice(&table))?,
            triangle_chunks: upload.buffer("caster triangle chunks", bytemuck::cast_slice(&triangle_chunks))?,
            edge_chunks: upload.buffer("caster edge chunks", bytemuck::cast_slice(&edge_chunks))?,
            table,
            counts,
            spheres,
            masked,
            memory_bytes: upload.bytes,
        })
    }

    /// How much there is.
    pub fn counts(&self) -> CasterCounts {
        self.counts
    }

    /// True if the scene has alpha-masked casters too.
    pub fn masked(&self) -> bool {
        self.masked
    }

    /// What the shaders know of an instance.
    pub fn instance(&self, i: usize) -> &CasterInstance {
        &self.table[i]
    }

    /// True if front faces alone tell what an instance shadows: its mesh is closed, with its outer side outside, and
    /// the light, in object space (`w` 1 position, 0 direction), outside of it.
    pub fn is_shell(&self, i: usize, light: DVec4) -> bool {
        let (center, radius) = self.spheres[i];
        self.table[i].outward != 0 && (light.w == 0.0 || light.truncate().distance(center.into()) > radius)
    }

    /// Center and radius of the sphere around an instance's mesh, object space.
    pub fn sphere(&self, i: usize) -> ([f64; 3], f64) {
        self.spheres[i]
    }

    /// Bytes of device memory.
    pub fn memory_bytes(&self) -> u64 {
        self.memory_bytes
    }

    /// Checks that there is a transform for each instance, of finite numbers.
    pub(crate) fn check_transforms(&self, technique: &str, transforms: &[DAffine3]) -> Result<()> {
        let fail = |problem| Err(Error::Input { technique: technique.into(), input: "casters", problem });
        let (given, wanted) = (transforms.len(), self.counts.instances as usize);
        if given != wanted {
            return fail(format!("{given} transforms are given, but Setup::casters has {wanted} instances"));
        }
        match transforms.iter().position(|m| !m.is_finite()) {
            Some(i) => fail(format!("the transform of instance {i} has numbers that are not finite")),
            None => Ok(()),
        }
    }

    /// Positions, for binding.
    pub(crate) fn positions(&self) -> Bind<'_> {
        match (&self.copy, self.vertices) {
            (Some(copy), _) => Bind::Buffer(copy),
            (None, Vertices::Buffer(v)) => Bind::Foreign(v.buffer, v.size),
            // A copy is made wherever there is no buffer of the caller's.
            (None, Vertices::Copy) => Bind::Buffer(&self.triangles),
        }
    }

    /// From one vertex to the next, in `f32`.
    pub(crate) fn stride(&self) -> u32 {
        match self.vertices {
            Vertices::Buffer(v) => v.stride / 4,
            Vertices::Copy => 3,
        }
    }
}

/// All meshes, one after the other.
#[derive(Default)]
struct Lists {
    positions: Vec<[f32; 3]>,
    triangles: Vec<[u32; 3]>,
    edges: Vec<Edge>,
    fans: Vec<u32>,
    neighbours: Vec<[u32; 3]>,
}

impl Lists {
    fn add(&mut self, mesh: &CasterMesh<'_>, copied: bool) -> Result<(CasterInstance, ([f64; 3], f64))> {
        let built = Topology::new(mesh.positions, mesh.indices)
            .map_err(|e| Error::Usage(format!("caster mesh {}: {e}", mesh.name)))?;
        let base = if copied { self.positions.len() as u32 } else { mesh.first_vertex };
        let fan_base = self.fans.len() as u32;
        let record = CasterInstance {
            first_triangle: self.triangles.len() as u32,
            triangles: built.triangles.len() as u32,
            first_edge: self.edges.len() as u32,
            edges: built.edges.len() as u32,
            outward: built.outward.into(),
            ..CasterInstance::default()
        };
        if copied {
            self.positions.extend_from_slice(mesh.positions);
        }
        self.triangles.extend(built.triangles.iter().map(|t| t.map(|v| v + base)));
        self.fans.extend_from_slice(&built.fans);
        self.neighbours.extend_from_slice(&built.neighbours);
        self.edges.extend(built.edges.iter().map(|e| {
            let mut e = *e;
            (e.v0, e.v1) = (e.v0 + base, e.v1 + base);
            if e.faces[1] == Edge::NON_MANIFOLD {
                e.faces[0] += fan_base;
            }
            e
        }));
        Ok((record, sphere(mesh.positions, &built.triangles)))
    }
}

/// Around the middle of the box of the vertices used.
fn sphere(positions: &[[f32; 3]], triangles: &[[u32; 3]]) -> ([f64; 3], f64) {
    let used = || triangles.iter().flatten().map(|&i| glam::Vec3::from(positions[i as usize]).as_dvec3());
    let (low, high) = used().fold((glam::DVec3::INFINITY, glam::DVec3::NEG_INFINITY), |(l, h), p| (l.min(p), h.max(p)));
    if !low.cmple(high).all() {
        return ([0.0; 3], 0.0);
    }
    let middle = 0.5 * (low + high);
    (middle.to_array(), used().fold(0.0, |r: f64, p| r.max(p.distance(middle))))
}

struct Upload<'a> {
    context: &'a Context,
    bytes: u64,
}

impl Upload<'_> {
    fn buffer(&mut self, name: &str, bytes: &[u8]) -> Result<Buffer> {
        let device = self.context.device();
        let most = u64::from(device.limits.max_storage_buffer_range);
        if bytes.len() as u64 > most {
            return Err(Error::Usage(format!("{name}: {} bytes; this device takes {most}", bytes.len())));
        }
        let desc = BufferDesc {
            name,
            size: bytes.len() as u64,
            usage: vk::BufferUsageFlags::STORAGE_BUFFER,
            // Mapped: the library submits nothing, so it cannot copy. Read-only, once a changed light.
            memory: MemoryKind::Upload,
        };
        let mut buffer = Buffer::new(device, &desc)?;
        if !buffer.write(0, bytes) {
            return Err(Error::Usage(format!("{name}: the memory is not mapped")));
        }
        self.bytes += buffer.size();
        Ok(buffer)
    }
}
