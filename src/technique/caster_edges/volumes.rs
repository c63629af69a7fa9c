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
    /// `VolumeCamera` of `glsl/caster_edges/volumes.glsl`.
    pub struct VolumeCamera {
        clip_from_object: [[f32; 4]; 4],
        shells: u32,
    }
}

impl VolumeCamera {
    /// Composed as the host's rasterisation composes it, bit by bit.
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

    /// Resources that every draw of volumes binds.
    struct VolumeBindings { Positions, Lights, Cameras }
    struct TriangleBindings { ..volumes: VolumeBindings, Triangles, Chunks, Instances, Facing }
    struct NeighbourBindings { ..triangles: TriangleBindings, Neighbours }
    struct EdgeBindings { ..volumes: VolumeBindings, Silhouettes }
    struct ResolveBindings { ..receiver: ReceiverBindings, stencil, blended, visibility, count_image }
}

/// Way to count the volumes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Counting {
    /// The stencil: 8 bits, so a multiple of 256 volumes is lit.
    Stencil,
    /// A 16-bit float that is blended to: exact up to 2048.
    Blended,
}

/// Way to make sides and far caps.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Path {
    /// Compute shaders: a list of silhouette edges, a quad each.
    Compute,
    /// A geometry shader, over all triangles.
    Geometry,
}

/// Settings of the shadow volumes.
#[derive(Clone, Copy, Debug)]
pub struct Settings {
    /// Way to count them.
    pub counting: Counting,
    /// Way to make them.
    pub path: Path,
    /// Count triangles everywhere, not shells where a mesh is closed.
    pub robust: bool,
    /// Leave out what the camera does not see.
    pub cull: bool,
    /// Depth bias of near caps, away from the camera: slopes.
    pub cap_bias: f32,
    /// Ask the shadow map too, where the casters say that there are alpha-masked ones.
    pub masked: bool,
    /// Normal offset of the shadow map's test: multiples of what a plane needs.
    pub normal_offset: f32,
}

const DEPTH: vk::Format = vk::Format::D32_SFLOAT_S8_UINT;
const COUNT: vk::Format = vk::Format::R16_SFLOAT;
/// Depth bias of near caps on top of the slopes, in steps of the depth format.
const CAP_STEPS: f32 = 2.0;
/// What takes the place of infinity for a parallel camera under a light with a position, as a fraction of the distance from
/// the light: all of a parallel camera's rays meet the plane at infinity in one point, where no rasteriser finds a cap.
const NEARNESS: f32 = 1.0 / (1 << 20) as f32;
/// Vertices that a chunk of triangles stands for.
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
    /// Pipeline of the sides on the compute path, where far caps come from the near ones' shader; otherwise of both.
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

/// An instance that is drawn.
struct Visible {
    vertices: Range<u32>,
    instance: usize,
    rect: Rect,
    /// True if triangles with the facing bit 0, and 1, count.
    facing: [bool; 2],
}

impl ShadowVolumes {
    /// Allocates for images of `extent` pixels; `keep_count` for [`ShadowVolumes::resolve`].
    ///
    /// # Errors
    /// [`crate::Error::NoDevice`] if the caller's device was made without what the settings need, beside those of memory and
    /// pipelines.
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
        // Compare and bias follow the camera's depth, which comes with the frame.
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
            // Weights are multiplicities; a closed mesh that is counted by shells takes each of its edges once.
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

    /// Bytes of device memory, without the casters'.
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
        // Of a transform without inverse no side of a triangle is known.
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

    /// Returns the volumes that can be seen, each with its instance and its rectangle.
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
            // What fails the test above.
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
            // Those of a parallel light are points.
            if self.far.is_some() && !inputs.light[0].is_directional() {
                draw.bind(2)?;
                draw.compare(compare);
                self.caps(draw, visible, push, true)?;
            }
            Ok(())
        })
    }

    /// Draws the caps that face the light and those that face away, which count the other way round.
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

    /// Writes the visibility of every pixel, and the counts into `count` (`R32_SFLOAT`) if there is one.
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

/// Caps of what faces the light are counter-clockwise seen from there.
const FRONT: vk::FrontFace = vk::FrontFace::COUNTER_CLOCKWISE;
