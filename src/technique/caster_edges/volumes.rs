//! Shadow volumes, counted beyond the surfaces that the camera sees.

use super::silhouettes::{CasterLight, Silhouettes};
use super::volume_cull::{self, Rect};
use crate::casters::Casters;
use crate::frame::{Bound, Draw, RasterPass, Target};
use crate::gpu::{
    Blend, Buffer, BufferDesc, ComputePipeline, DepthState, Image, ImageDesc, MemoryKind, RasterPipeline, RasterState,
    StencilFace, StencilState, bindings, shader_struct,
};
use crate::technique::common::bindings::ReceiverBindings;
use crate::technique::common::view::depth_error;
use crate::view::{CameraView, DepthRange};
use crate::{Bind, Context, Frame, Inputs, Pass, Result, Threads};
use ash::vk;
use glam::DAffine3;
use std::ops::Range;
use std::sync::Arc;

shader_struct! {
    /// Push constants of `glsl/caster_edges/volume.glsl`.
    pub struct VolumePush {
        stride: u32,
        facing: u32,
        infinite: u32,
        depth_step: f32,
        nearness: f32,
    }
}

shader_struct! {
    /// `VolumeCamera` of `glsl/caster_edges/casters.glsl`.
    pub struct VolumeCamera {
        clip_from_object: [[f32; 4]; 4],
        shells: u32,
    }
}

impl VolumeCamera {
    /// Composes the matrix exactly as the host's rasterisation does, bit by bit.
    pub(super) fn new(camera: &CameraView, world_from_object: &DAffine3, shells: bool) -> Self {
        let clip_from_object = camera.clip_from_object(world_from_object).as_mat4().to_cols_array_2d();
        Self { clip_from_object, shells: shells.into() }
    }
}

shader_struct! {
    /// Push constants of `glsl/caster_edges/volume_draws.comp`.
    pub struct VolumeDrawsPush {
        instance_count: u32,
        chunk_count: u32,
    }
}

shader_struct! {
    /// Push constants of `glsl/caster_edges/shadow_volumes.comp`.
    pub struct ShadowVolumesPush {
        normal_offset: f32,
    }
}

bindings! {
    struct DrawsBindings { Instances, Offsets, Header, Cameras, Draws }
    struct CopyBindings { camera_depth }

    /// Resources of every draw of volumes.
    struct VolumeBindings { Positions, Lights, Cameras }
    struct TriangleBindings { ..volumes: VolumeBindings, Triangles, Chunks, Instances, Facing }
    struct NeighbourBindings { ..triangles: TriangleBindings, Neighbours }
    struct EdgeBindings { ..volumes: VolumeBindings, Silhouettes }
    struct ResolveBindings { ..receiver: ReceiverBindings, stencil, blended, visibility, count_image }
}

/// Way to count the volumes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Counting {
    /// Counts in the stencil. It has 8 bits, so a point in a multiple of 256 volumes appears lit.
    Stencil,
    /// Counts by blending into a 16-bit float, which is exact up to 2048.
    Blended,
}

/// Way to make sides and far caps.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Path {
    /// Compute shaders make a list of silhouette edges; each becomes a quad.
    Compute,
    /// A geometry shader works on all triangles.
    Geometry,
}

/// Settings of the shadow volumes.
#[derive(Clone, Copy, Debug)]
pub struct Settings {
    /// Way to count the volumes.
    pub counting: Counting,
    /// Way to make the sides and far caps.
    pub path: Path,
    /// True to count triangles of all meshes, instead of shells of closed ones.
    pub robust: bool,
    /// True to leave out volumes that the camera cannot see.
    pub cull: bool,
    /// Depth bias of near caps, away from the camera, in multiples of their slope.
    pub cap_bias: f32,
    /// True to test the shadow map as well if there are alpha-masked casters.
    pub masked: bool,
    /// Normal offset of the shadow map's test, in multiples of the offset that a plane needs.
    pub normal_offset: f32,
}

const DEPTH: vk::Format = vk::Format::D32_SFLOAT_S8_UINT;
const COUNT: vk::Format = vk::Format::R16_SFLOAT;
/// Constant part of the depth bias of near caps, in steps of the depth format.
const CAP_STEPS: f32 = 2.0;
/// Replaces infinity for a parallel camera and a light with a position: the caster's distance from the light, as a
/// share of its image's distance. All rays of a parallel camera meet the plane at infinity in one point, so caps at
/// infinity would not be rasterised.
const NEARNESS: f32 = 1.0 / (1 << 20) as f32;
/// Number of vertices of a chunk of triangles.
const CHUNK_VERTICES: u32 = 3 * crate::casters::CHUNK;
/// Bytes of a `VkDrawIndirectCommand`.
const DRAW: u64 = 16;

/// The passes with their pipelines and targets.
pub struct ShadowVolumes {
    settings: Settings,
    casters: Arc<Casters>,
    silhouettes: Silhouettes,
    copy: Arc<RasterPipeline>,
    near: Arc<RasterPipeline>,
    /// Pipeline of the sides. On the geometry path it draws the far caps too; on the compute path `far` draws them.
    sides: Arc<RasterPipeline>,
    far: Option<Arc<RasterPipeline>>,
    ranges: Arc<ComputePipeline>,
    resolve: Arc<ComputePipeline>,
    cameras: Buffer,
    draws: Buffer,
    stencil: Image,
    blended: Option<Image>,
    extent: [u32; 2],
}

/// An instance whose volume is drawn.
struct Visible {
    vertices: Range<u32>,
    instance: usize,
    rect: Rect,
    /// Flags for both values of the facing bit: true if triangles with that bit count.
    facing: [bool; 2],
}

impl ShadowVolumes {
    /// Makes the passes for images of `extent` pixels. `keep_count` must be true if [`ShadowVolumes::resolve`] is to
    /// write the counts.
    ///
    /// # Errors
    /// [`crate::Error::NoDevice`] if the caller's device was made without the features that the settings need. Other
    /// errors come from memory and pipelines.
    pub fn new(
        context: &Context,
        casters: &Arc<Casters>,
        extent: [u32; 2],
        settings: Settings,
        keep_count: bool,
    ) -> Result<Self> {
        let device = context.device();
        let blended = settings.counting == Counting::Blended;
        let attachment = |name, format| Image::new(device, &ImageDesc::attachment(name, format, extent));
        // Comparison and bias depend on the camera's depth range, which is only known in the frame.
        let depth = DepthState { format: DEPTH, compare: vk::CompareOp::GREATER, write: false };
        let wrap = StencilState {
            front: StencilFace::on_depth_fail(vk::StencilOp::DECREMENT_AND_WRAP),
            back: StencilFace::on_depth_fail(vk::StencilOp::INCREMENT_AND_WRAP),
        };
        let state = RasterState {
            depth: Some(depth),
            stencil: (!blended).then_some(wrap),
            fragment: blended.then_some("caster_edges/volume_count.frag"),
            colors: if blended { &[COUNT] } else { &[] },
            blend: Blend::Add,
            depth_clamp: true,
            ..RasterState::default()
        };
        let caps = |name, bias| {
            let state = RasterState { name, vertex: "caster_edges/volume_cap.vert", bias, ..state.clone() };
            context.raster_pipeline::<TriangleBindings, VolumePush>(&state)
        };
        let bias = if settings.cap_bias > 0.0 { [CAP_STEPS, settings.cap_bias] } else { [0.0; 2] };
        let (sides, far) = match settings.path {
            Path::Compute => {
                let side =
                    RasterState { name: "volume sides", vertex: "caster_edges/volume_side.vert", ..state.clone() };
                (context.raster_pipeline::<EdgeBindings, VolumePush>(&side)?, Some(caps("volume far caps", [0.0; 2])?))
            }
            Path::Geometry => {
                let state = RasterState {
                    name: "volume sides and far caps",
                    vertex: "caster_edges/volume.vert",
                    geometry: Some("caster_edges/volume.geom"),
                    ..state.clone()
                };
                (context.raster_pipeline::<NeighbourBindings, VolumePush>(&state)?, None)
            }
        };
        let copy = RasterState {
            name: "camera depth, copied",
            vertex: "caster_edges/fullscreen.vert",
            fragment: Some("caster_edges/depth_copy.frag"),
            depth: Some(DepthState::new(DEPTH, vk::CompareOp::ALWAYS)),
            ..RasterState::default()
        };
        let masked = settings.masked && casters.masked();
        let resolve = context.pipeline::<ResolveBindings, ShadowVolumesPush>(
            "caster_edges/shadow_volumes.comp",
            &[("BLENDED", blended.into()), ("MASKED", masked.into()), ("KEEP_COUNT", keep_count.into())],
        )?;
        let instances = u64::from(casters.counts().instances.max(1));
        let buffer = |name, size, usage| {
            let usage = usage | vk::BufferUsageFlags::STORAGE_BUFFER;
            Buffer::new(device, &BufferDesc { name, size, usage, memory: MemoryKind::Gpu })
        };
        Ok(Self {
            casters: casters.clone(),
            // Without shells, weights are multiplicities. A closed mesh that is counted by shells draws each of its
            // edges once.
            silhouettes: Silhouettes::new(context, casters, false)?,
            copy: context.raster_pipeline::<CopyBindings, ()>(&copy)?,
            near: caps("volume near caps", bias)?,
            sides,
            far,
            ranges: context.pipeline::<DrawsBindings, VolumeDrawsPush>(
                "caster_edges/volume_draws.comp",
                &[("BLENDED", blended.into())],
            )?,
            resolve,
            cameras: buffer(
                "casters' cameras",
                instances * size_of::<VolumeCamera>() as u64,
                vk::BufferUsageFlags::TRANSFER_DST,
            )?,
            draws: buffer("volume draws", instances * DRAW, vk::BufferUsageFlags::INDIRECT_BUFFER)?,
            stencil: attachment("volume stencil", DEPTH)?,
            blended: blended.then(|| attachment("volume count", COUNT)).transpose()?,
            extent,
            settings,
        })
    }

    /// Bytes of device memory, without the casters' buffers.
    pub fn memory_bytes(&self) -> u64 {
        self.silhouettes.memory_bytes()
            + self.cameras.size()
            + self.draws.size()
            + self.stencil.memory_bytes()
            + self.blended.as_ref().map_or(0, Image::memory_bytes)
    }

    /// The silhouettes that [`ShadowVolumes::record`] finds.
    pub fn silhouettes(&self) -> &Silhouettes {
        &self.silhouettes
    }

    /// Counts the volumes that each pixel's point lies in.
    ///
    /// # Errors
    /// [`crate::Error::Input`] unless there is a transform for each instance.
    pub fn record(&mut self, frame: &mut Frame<'_>, inputs: &Inputs<'_>, technique: &str) -> Result<()> {
        self.casters.check_transforms(technique, inputs.casters)?;
        let light = &inputs.light[0];
        // If a transform has no inverse, it is unknown which triangles face the light. The instance then casts no
        // shadow.
        let regular = |m: &DAffine3| m.is_finite() && m.matrix3.inverse().is_finite();
        let casts: Vec<bool> = (inputs.casters.iter().enumerate())
            .map(|(i, m)| {
                let reached = !self.settings.cull || volume_cull::is_in_light(light, m, self.casters.sphere(i));
                regular(m) && reached
            })
            .collect();
        let changed = self.silhouettes.record(frame, inputs, Some(&casts))?;
        let cameras: Vec<_> = (inputs.casters.iter().enumerate())
            .map(|(i, m)| {
                let shells = !self.settings.robust && self.casters.is_shell(i, CasterLight::light(light, m));
                VolumeCamera::new(inputs.camera, m, shells)
            })
            .collect();
        if !cameras.is_empty() {
            frame.update(&self.cameras, bytemuck::cast_slice(&cameras));
        }
        if changed && !cameras.is_empty() && self.settings.path == Path::Compute {
            self.find_ranges(frame)?;
        }
        self.copy_depth(frame, inputs)?;
        let visible = self.visible(inputs, &casts, &cameras);
        self.draw(frame, inputs, &visible)
    }

    fn find_ranges(&self, frame: &mut Frame<'_>) -> Result<()> {
        let counts = self.casters.counts();
        let push = VolumeDrawsPush { instance_count: counts.instances, chunk_count: counts.edge_chunks };
        frame.dispatch(&Pass {
            name: "volume draws",
            pipeline: &self.ranges,
            bind: &DrawsBindings {
                Instances: Bind::Buffer(&self.casters.instances),
                Offsets: Bind::Buffer(self.silhouettes.offsets()),
                Header: Bind::Buffer(self.silhouettes.header()),
                Cameras: Bind::Buffer(&self.cameras),
                Draws: Bind::Buffer(&self.draws),
            },
            push: bytemuck::bytes_of(&push),
            threads: Threads::Count([counts.instances, 1, 1]),
        })
    }

    fn copy_depth(&self, frame: &mut Frame<'_>, inputs: &Inputs<'_>) -> Result<()> {
        let pass = RasterPass {
            name: "camera depth, copied",
            extent: self.extent,
            colors: &[],
            depth: Some(Target::depth(&self.stencil, 0.0)),
            bound: &[Bound { pipeline: &self.copy, bind: &CopyBindings { camera_depth: Bind::Input(&inputs.depth) } }],
            indirect: &[],
        };
        frame.raster(&pass, |draw| {
            draw.bind(0)?;
            draw.draw(0..3, 0..1)
        })
    }

    /// Returns the instances whose volumes can be seen, with their rectangles.
    fn visible(&self, inputs: &Inputs<'_>, casts: &[bool], cameras: &[VolumeCamera]) -> Vec<Visible> {
        let (camera, light) = (inputs.camera, &inputs.light[0]);
        let range = volume_cull::rectangle(&volume_cull::light_range(camera, light), camera.depth, self.extent);
        let mut visible = vec![];
        for (i, world_from_object) in inputs.casters.iter().enumerate().filter(|(i, _)| casts[*i]) {
            let record = self.casters.instance(i);
            if record.triangles == 0 {
                continue;
            }
            let rect = if self.settings.cull {
                let m = camera.clip_from_object(world_from_object);
                let seen = CasterLight::light(light, world_from_object);
                let swept = volume_cull::swept(&m, self.casters.sphere(i), seen);
                volume_cull::rectangle(&swept, camera.depth, self.extent).cut(&range)
            } else {
                Rect::all(self.extent)
            };
            if rect.is_empty() {
                continue;
            }
            let first = record.first_triangle_chunk * CHUNK_VERTICES;
            let mirrored = world_from_object.matrix3.determinant() < 0.0;
            let facing = if cameras[i].shells != 0 { [mirrored, !mirrored] } else { [true; 2] };
            visible.push(Visible { vertices: first..first + 3 * record.triangles, instance: i, rect, facing });
        }
        visible
    }

    fn draw(&self, frame: &mut Frame<'_>, inputs: &Inputs<'_>, visible: &[Visible]) -> Result<()> {
        let c = &*self.casters;
        let volumes = VolumeBindings {
            Positions: c.positions(),
            Lights: Bind::Buffer(self.silhouettes.lights()),
            Cameras: Bind::Buffer(&self.cameras),
        };
        let triangles = TriangleBindings {
            volumes,
            Triangles: Bind::Buffer(&c.triangles),
            Chunks: Bind::Buffer(&c.triangle_chunks),
            Instances: Bind::Buffer(&c.instances),
            Facing: Bind::Buffer(self.silhouettes.facing()),
        };
        let neighbours = NeighbourBindings { triangles, Neighbours: Bind::Buffer(&c.neighbours) };
        let edges = EdgeBindings { volumes, Silhouettes: Bind::Buffer(self.silhouettes.edges()) };
        let mut bound = vec![Bound { pipeline: &self.near, bind: &triangles }];
        match &self.far {
            Some(far) => {
                bound.push(Bound { pipeline: &self.sides, bind: &edges });
                bound.push(Bound { pipeline: far, bind: &triangles });
            }
            None => bound.push(Bound { pipeline: &self.sides, bind: &neighbours }),
        }
        let colors: Vec<_> = self.blended.iter().map(|b| Target::color(b, [0.0; 4])).collect();
        let pass = RasterPass {
            name: "shadow volumes",
            extent: self.extent,
            colors: &colors,
            depth: Some(Target::kept(&self.stencil)),
            bound: &bound,
            indirect: &[&self.draws],
        };
        let reversed = inputs.camera.depth == DepthRange::Reversed;
        let compare = match (self.settings.counting, reversed) {
            (Counting::Stencil, true) => vk::CompareOp::GREATER,
            (Counting::Stencil, false) => vk::CompareOp::LESS,
            // Blending counts the fragments that pass, so these comparisons are the opposite of those above.
            (Counting::Blended, true) => vk::CompareOp::LESS_OR_EQUAL,
            (Counting::Blended, false) => vk::CompareOp::GREATER_OR_EQUAL,
        };
        let away = if reversed { -1.0 } else { 1.0 };
        let push = VolumePush {
            stride: c.stride(),
            facing: 0,
            infinite: 0,
            depth_step: -depth_error(inputs.depth.format, inputs.camera.depth),
            nearness: if inputs.camera.is_orthographic() { NEARNESS } else { 0.0 },
        };
        frame.raster(&pass, |draw| {
            draw.bind(0)?;
            draw.compare(compare);
            if self.settings.cap_bias > 0.0 {
                draw.bias([away * CAP_STEPS, away * self.settings.cap_bias]);
            }
            self.caps(draw, visible, push, false)?;
            draw.bind(1)?;
            draw.compare(compare);
            draw.faces(vk::CullModeFlags::NONE, FRONT);
            draw.push(bytemuck::bytes_of(&push))?;
            for v in visible {
                draw.scissor(v.rect.x.clone(), v.rect.y.clone());
                match self.settings.path {
                    Path::Compute => draw.indirect(&self.draws, v.instance as u64 * DRAW)?,
                    Path::Geometry => draw.draw(v.vertices.clone(), 0..1)?,
                }
            }
            // The far caps of a parallel light are points and need no drawing.
            if self.far.is_some() && !inputs.light[0].is_directional() {
                draw.bind(2)?;
                draw.compare(compare);
                self.caps(draw, visible, push, true)?;
            }
            Ok(())
        })
    }

    /// Draws the caps that face the light, and then those that face away, with the opposite sign.
    fn caps(&self, draw: &mut Draw<'_, '_>, visible: &[Visible], push: VolumePush, infinite: bool) -> Result<()> {
        for facing in [1, 0] {
            let front = if (facing == 1) != infinite { FRONT } else { vk::FrontFace::CLOCKWISE };
            draw.faces(vk::CullModeFlags::NONE, front);
            draw.push(bytemuck::bytes_of(&VolumePush { facing, infinite: infinite.into(), ..push }))?;
            for v in visible.iter().filter(|v| v.facing[facing as usize]) {
                draw.scissor(v.rect.x.clone(), v.rect.y.clone());
                draw.draw(v.vertices.clone(), 0..1)?;
            }
        }
        Ok(())
    }

    /// Writes the visibility of every pixel, and the counts into `count` (`R32_SFLOAT`) if it is given.
    pub fn resolve(
        &self,
        frame: &mut Frame<'_>,
        view: &Buffer,
        inputs: &Inputs<'_>,
        output: &Image,
        count: Option<&Image>,
    ) -> Result<()> {
        let [width, height] = self.extent;
        let push = ShadowVolumesPush { normal_offset: self.settings.normal_offset };
        frame.dispatch(&Pass {
            name: "visibility from counts",
            pipeline: &self.resolve,
            bind: &ResolveBindings {
                receiver: ReceiverBindings::new(view, inputs),
                stencil: Bind::Stencil(&self.stencil),
                blended: Bind::Image(self.blended.as_ref().unwrap_or(&self.stencil)),
                visibility: Bind::Image(output),
                count_image: Bind::Image(count.unwrap_or(output)),
            },
            push: bytemuck::bytes_of(&push),
            threads: Threads::Count([width, height, 1]),
        })
    }
}

/// Winding of front faces. Triangles that face the light are counter-clockwise when seen from the light.
const FRONT: vk::FrontFace = vk::FrontFace::COUNTER_CLOCKWISE;
