//! Casters on the GPU: their data that stays the same from frame to frame.

use super::topology::{Edge, Topology};
use crate::gpu::{Buffer, BufferDesc, MemoryKind, shader_struct};
use crate::{Bind, Context, Error, Result};
use ash::vk;
use glam::{DAffine3, DVec4};

/// Number of triangles, or edges, per workgroup: `CHUNK` of `glsl/caster_edges/casters.glsl`.
pub const CHUNK: u32 = 64;

/// Triangle mesh that casts shadows, in object space.
///
/// Pass all parts of one solid as *one* mesh, even if they have different materials. Parts that share a border are
/// closed only together, and closed meshes halve the cost of shadow volumes.
#[derive(Clone, Copy, Debug)]
pub struct CasterMesh<'a> {
    /// Name for error messages.
    pub name: &'a str,
    /// Positions, object space.
    pub positions: &'a [[f32; 3]],
    /// Three indices per triangle, into `positions`.
    pub indices: &'a [u32],
    /// Index of the vertex in [`Vertices::Buffer`] that holds the first of `positions`.
    pub first_vertex: u32,
}

/// Vertex buffer of the caller; the shaders read positions from it in place.
#[derive(Clone, Copy, Debug)]
pub struct VertexBuffer {
    buffer: vk::Buffer,
    size: u64,
    stride: u32,
}

/// Size of a position, bytes.
const POSITION: u64 = 12;

impl VertexBuffer {
    /// Describes a vertex buffer. `size` is the buffer's size in bytes. `stride` is the distance between vertices in
    /// bytes, a multiple of 4. The first three `f32` of a vertex are its position.
    ///
    /// # Safety
    /// The buffer must belong to the context's device, have the usage `STORAGE_BUFFER` and at least `size` bytes, and
    /// outlive the casters and all frames that use them. Writes to it must be visible to
    /// [`Inputs::STAGE`](crate::Inputs::STAGE) and, for techniques with raster passes, to vertex shaders.
    pub unsafe fn new(buffer: vk::Buffer, size: u64, stride: u32) -> Self {
        Self { buffer, size, stride }
    }

    /// Fails unless the shaders can read all vertices of the meshes from the buffer.
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
                "the casters' vertex buffer has {size} bytes, but a storage buffer of this device has at most {largest}: \
                 split it, or use Vertices::Copy"
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

/// Source of the positions that the shaders read.
#[derive(Clone, Copy, Debug)]
pub enum Vertices {
    /// The caller's vertex buffer, without a copy. Its content may change, as long as vertices that coincided still
    /// do.
    Buffer(VertexBuffer),
    /// A copy that the casters own: 12 bytes per vertex.
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
    /// Number of instances.
    pub instances: u32,
    /// Number of triangles over all instances.
    pub triangles: u32,
    /// Number of edges over all instances: the largest possible number of silhouettes.
    pub edges: u32,
    /// Number of workgroups of [`CHUNK`] triangles.
    pub triangle_chunks: u32,
    /// Number of workgroups of [`CHUNK`] edges.
    pub edge_chunks: u32,
}

/// Meshes with the adjacency of their triangles, and the instances of them in the scene. Made once, on load.
///
/// The instances' transforms come with every frame ([`crate::Inputs::casters`]). Alpha-masked surfaces do not belong
/// here, because the edges of their mesh are not the edges of their shadow. Leave them in the shadow map, where the
/// techniques based on silhouettes find them with the map's own test.
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
    /// Centre and radius of each instance's mesh, object space.
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
    /// Builds the adjacency of every mesh and uploads it. `instances` holds an index into `meshes` for each instance.
    /// `masked` says that the shadow map has further, alpha-masked casters.
    ///
    /// # Errors
    /// Fails with [`Error::Usage`] for an index out of range, for vertices beyond the end of the caller's buffer, or
    /// for more data than the device's buffers hold.
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
                let problem = format!("caster {i} refers to mesh {mesh}, but there are {} meshes", meshes.len());
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

    /// Returns the counts over all instances.
    pub fn counts(&self) -> CasterCounts {
        self.counts
    }

    /// Returns whether the scene has alpha-masked casters too.
    pub fn masked(&self) -> bool {
        self.masked
    }

    /// Returns the data of an instance that shaders read.
    pub fn instance(&self, i: usize) -> &CasterInstance {
        &self.table[i]
    }

    /// Returns whether front faces alone define the shadow of an instance. This is so if its mesh is closed, with its
    /// outer side outwards, and the light is outside it. The light is in object space (`w` is 1 for a position and 0
    /// for a direction).
    pub fn is_shell(&self, i: usize, light: DVec4) -> bool {
        let (center, radius) = self.spheres[i];
        self.table[i].outward != 0 && (light.w == 0.0 || light.truncate().distance(center.into()) > radius)
    }

    /// Returns centre and radius of the sphere around an instance's mesh, object space.
    pub fn sphere(&self, i: usize) -> ([f64; 3], f64) {
        self.spheres[i]
    }

    /// Returns the greatest distance of vertices from the origin of their mesh's space, world units, over the meshes that
    /// lie apart from it by more than their diameter; 0 if there is none. Single precision places such vertices with an
    /// error in proportion to this distance. `transforms` has one for each instance.
    pub fn far_vertices(&self, transforms: &[DAffine3]) -> f64 {
        let far = |(t, (center, radius)): (&DAffine3, &([f64; 3], f64))| {
            let distance = glam::DVec3::from(*center).length();
            let scale = t
                .matrix3
                .to_cols_array_2d()
                .map(|axis| glam::DVec3::from(axis).length())
                .into_iter()
                .fold(0.0, f64::max);
            if distance > 2.0 * radius { scale * (distance + radius) } else { 0.0 }
        };
        transforms.iter().zip(&self.spheres).map(far).fold(0.0, f64::max)
    }

    /// Returns the size of the device memory, bytes.
    pub fn memory_bytes(&self) -> u64 {
        self.memory_bytes
    }

    /// Checks that there is a finite transform for each instance.
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

    /// Returns the positions for binding.
    pub(crate) fn positions(&self) -> Bind<'_> {
        match (&self.copy, self.vertices) {
            (Some(copy), _) => Bind::Buffer(copy),
            (None, Vertices::Buffer(v)) => Bind::Foreign(v.buffer, v.size),
            // A copy is always made if there is no buffer of the caller's.
            (None, Vertices::Copy) => Bind::Buffer(&self.triangles),
        }
    }

    /// Returns the stride of the vertices, in `f32`.
    pub(crate) fn stride(&self) -> u32 {
        match self.vertices {
            Vertices::Buffer(v) => v.stride / 4,
            Vertices::Copy => 3,
        }
    }
}

/// Data of all meshes, one after the other.
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

/// Returns the sphere around the used vertices, centred on their bounding box.
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
            return Err(Error::Usage(format!(
                "{name}: {} bytes, but a storage buffer of this device has at most {most}",
                bytes.len()
            )));
        }
        let desc = BufferDesc {
            name,
            size: bytes.len() as u64,
            usage: vk::BufferUsageFlags::STORAGE_BUFFER,
            // The memory is visible to the host, because the library submits no commands and so cannot copy. It is
            // read-only after the upload.
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
