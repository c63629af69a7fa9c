//! Raster passes of the host: the shadow map and the camera's G-buffer.

use super::cull::{DrawList, GpuInstance};
use super::gpu_scene::{GpuScene, MaterialPush};
use crate::frame::{Draw, Target};
use crate::gpu::{Buffer, BufferDesc, Image, ImageDesc, MemoryKind, RasterPipeline, RasterState};
use crate::host::Host;
use crate::{Bind, Error, Frame, Result};
use ash::vk;

/// How casters are drawn into the shadow map.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CasterOptions {
    /// Which faces cast.
    pub faces: CasterFaces,
    /// Constant depth bias, in the units of `vkCmdSetDepthBias`.
    pub constant_bias: f32,
    /// Depth bias times the polygon's slope.
    pub slope_bias: f32,
}

impl Default for CasterOptions {
    /// Both faces, no bias: the map is the same for all techniques, which bias on the receiver's side.
    fn default() -> Self {
        Self { faces: CasterFaces::Both, constant_bias: 0.0, slope_bias: 0.0 }
    }
}

/// Which faces cast; double-sided materials always cast with both.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum CasterFaces {
    /// Everything casts, as in the ray-traced truth.
    #[default]
    Both,
    /// Faces towards the light only.
    Front,
    /// Faces away from the light only: no acne on closed bodies, light leaks at thin ones.
    Back,
}

/// The shadow map: D32, an array of one layer.
pub struct ShadowMap {
    depth: Image,
    instances: InstanceBuffer,
    opaque: RasterPipeline,
    masked: RasterPipeline,
    faces: CasterFaces,
}

/// What the camera sees: depth, normals, albedo and triangle ids.
pub struct GBuffer {
    /// Reversed-Z D32.
    pub depth: Image,
    /// World-space geometric normal, octahedral.
    pub geometric_normal: Image,
    /// World-space interpolated normal, octahedral.
    pub shading_normal: Image,
    /// Base colour, sRGB.
    pub albedo: Image,
    /// Id of the visible triangle, counted over all instances in scene order; `u32::MAX` for the sky.
    pub triangle: Image,
    instances: InstanceBuffer,
    opaque: RasterPipeline,
    masked: RasterPipeline,
}

/// Instances of one view, written by the CPU each frame. One frame is in flight: the host waits.
struct InstanceBuffer {
    buffer: Buffer,
}

impl InstanceBuffer {
    fn new(host: &Host, name: &str, capacity: usize) -> Result<Self> {
        let each = size_of::<GpuInstance>() as u64;
        let most = u64::from(host.context().device().limits.max_storage_buffer_range) / each;
        if capacity as u64 > most {
            let problem = format!("{name}: the scene has {capacity} instances; this device takes {most}");
            return Err(Error::Usage(problem));
        }
        let desc = BufferDesc {
            name,
            size: capacity.max(1) as u64 * each,
            usage: vk::BufferUsageFlags::STORAGE_BUFFER,
            memory: MemoryKind::Upload,
        };
        Ok(Self { buffer: Buffer::new(host.context().device(), &desc)? })
    }

    fn write(&mut self, list: &DrawList) -> Result<()> {
        if self.buffer.write(0, bytemuck::cast_slice(&list.instances)) {
            return Ok(());
        }
        Err(Error::Usage(format!("{} instances do not fit the buffer of the prepared scene", list.instances.len())))
    }
}

const POSITION: (u32, vk::Format) = (0, vk::Format::R32G32B32_SFLOAT);
const UV: (u32, vk::Format) = (1, vk::Format::R32G32_SFLOAT);
const COLOR: (u32, vk::Format) = (2, vk::Format::R32G32B32A32_SFLOAT);
const NORMAL: (u32, vk::Format) = (3, vk::Format::R32G32B32_SFLOAT);

impl ShadowMap {
    /// Allocates a map of `size` texels for a scene with `instances` instances.
    pub fn new(host: &Host, size: [u32; 2], instances: usize, options: CasterOptions) -> Result<Self> {
        let device = host.context().device();
        let desc = ImageDesc { array: true, ..ImageDesc::attachment("shadow map", vk::Format::D32_SFLOAT, size) };
        let state = RasterState {
            name: "shadow map",
            vertex: "raster/depth.vert",
            fragment: None,
            attributes: &[POSITION],
            colors: &[],
            depth: desc.format,
            compare: vk::CompareOp::LESS,
            bias: [options.constant_bias, options.slope_bias],
            depth_clamp: host.depth_clamp(),
            constants: &[],
        };
        let masked = RasterState {
            name: "shadow map, masked",
            vertex: "raster/depth_masked.vert",
            fragment: Some("raster/depth_masked.frag"),
            attributes: &[POSITION, UV, COLOR],
            ..state.clone()
        };
        Ok(Self {
            depth: Image::new(device, &desc)?,
            instances: InstanceBuffer::new(host, "shadow-map instances", instances)?,
            opaque: RasterPipeline::new::<()>(device, &state)?,
            masked: RasterPipeline::new::<MaterialPush>(device, &masked)?,
            faces: options.faces,
        })
    }

    /// The map: a 2D array view in `GENERAL`.
    pub fn image(&self) -> &Image {
        &self.depth
    }

    /// Draws the casters.
    pub fn record(&mut self, frame: &mut Frame<'_>, scene: &GpuScene, list: &DrawList) -> Result<()> {
        self.instances.write(list)?;
        let clear = vk::ClearValue { depth_stencil: vk::ClearDepthStencilValue { depth: 1.0, stencil: 0 } };
        let target = Target { image: &self.depth, clear };
        let cull = |double_sided: bool| match self.faces {
            _ if double_sided => vk::CullModeFlags::NONE,
            CasterFaces::Both => vk::CullModeFlags::NONE,
            CasterFaces::Front => vk::CullModeFlags::BACK,
            CasterFaces::Back => vk::CullModeFlags::FRONT,
        };
        let instances = &self.instances.buffer;
        frame.raster("shadow map", &[], &target, &[instances], |draw| {
            for is_masked in [false, true] {
                let pipeline = if is_masked { &self.masked } else { &self.opaque };
                let with_uv = [(&scene.positions, 0), (&scene.uvs, 0), (&scene.colors, 0)];
                let buffers = if is_masked { &with_uv[..] } else { &with_uv[..1] };
                draw_all(draw, scene, list, pipeline, buffers, instances, is_masked, is_masked, &cull);
            }
            Ok(())
        })
    }
}

impl GBuffer {
    /// Allocates targets of `size` pixels for a scene with `instances` instances.
    pub fn new(host: &Host, size: [u32; 2], instances: usize) -> Result<Self> {
        let device = host.context().device();
        let target = |name, format| Image::new(device, &ImageDesc::attachment(name, format, size));
        // Signed normalised targets are optional in Vulkan.
        let snorm = vk::Format::R16G16_SNORM;
        let attachable = device.format_features(snorm).contains(vk::FormatFeatureFlags::COLOR_ATTACHMENT);
        let normal = if attachable { snorm } else { vk::Format::R32G32_SFLOAT };
        let colors = [normal, normal, vk::Format::R8G8B8A8_SRGB, vk::Format::R32_UINT];
        let pipeline = |is_masked: bool| {
            let state = RasterState {
                name: if is_masked { "g-buffer, masked" } else { "g-buffer" },
                vertex: "raster/gbuffer.vert",
                fragment: Some("raster/gbuffer.frag"),
                attributes: &[POSITION, UV, COLOR, NORMAL],
                colors: &colors,
                depth: vk::Format::D32_SFLOAT,
                compare: vk::CompareOp::GREATER,
                bias: [0.0; 2],
                depth_clamp: false,
                constants: &[is_masked.into()],
            };
            RasterPipeline::new::<MaterialPush>(device, &state)
        };
        Ok(Self {
            depth: target("camera depth", vk::Format::D32_SFLOAT)?,
            geometric_normal: target("geometric normal", colors[0])?,
            shading_normal: target("shading normal", colors[1])?,
            albedo: target("albedo", colors[2])?,
            triangle: target("triangle id", colors[3])?,
            instances: InstanceBuffer::new(host, "camera instances", instances)?,
            opaque: pipeline(false)?,
            masked: pipeline(true)?,
        })
    }

    /// Draws what the camera sees.
    pub fn record(&mut self, frame: &mut Frame<'_>, scene: &GpuScene, list: &DrawList) -> Result<()> {
        self.instances.write(list)?;
        let color = |image, color| Target { image, clear: vk::ClearValue { color } };
        let zero = vk::ClearColorValue { float32: [0.0; 4] };
        let targets = [
            color(&self.geometric_normal, zero),
            color(&self.shading_normal, zero),
            color(&self.albedo, zero),
            color(&self.triangle, vk::ClearColorValue { uint32: [u32::MAX; 4] }),
        ];
        let clear = vk::ClearValue { depth_stencil: vk::ClearDepthStencilValue { depth: 0.0, stencil: 0 } };
        let depth = Target { image: &self.depth, clear };
        let cull = |double_sided| if double_sided { vk::CullModeFlags::NONE } else { vk::CullModeFlags::BACK };
        let instances = &self.instances.buffer;
        let buffers = [(&scene.positions, 0), (&scene.uvs, 0), (&scene.colors, 0), (&scene.normals, 0)];
        frame.raster("g-buffer", &targets, &depth, &[instances], |draw| {
            for is_masked in [false, true] {
                let pipeline = if is_masked { &self.masked } else { &self.opaque };
                draw_all(draw, scene, list, pipeline, &buffers, instances, is_masked, true, &cull);
            }
            Ok(())
        })
    }

    /// Bytes of device memory.
    pub fn memory_bytes(&self) -> u64 {
        [&self.depth, &self.geometric_normal, &self.shading_normal, &self.albedo, &self.triangle]
            .map(Image::memory_bytes)
            .iter()
            .sum()
    }
}

/// Draws the meshes whose material is, or is not, masked.
#[allow(clippy::too_many_arguments)]
fn draw_all(
    draw: &mut Draw<'_>,
    scene: &GpuScene,
    list: &DrawList,
    pipeline: &RasterPipeline,
    buffers: &[(&Buffer, u64)],
    instances: &Buffer,
    is_masked: bool,
    with_material: bool,
    cull: &dyn Fn(bool) -> vk::CullModeFlags,
) {
    let mut bound = None;
    for call in &list.calls {
        let material = &scene.materials[scene.mesh_materials[call.mesh]];
        if material.is_masked() != is_masked || scene.ranges[call.mesh].is_empty() {
            continue;
        }
        let texture = with_material.then_some(material.texture);
        if bound != Some(texture) {
            let image = scene.textures[material.texture].as_ref();
            let bind = [Bind::Buffer(instances), Bind::Input(&image)];
            draw.bind(pipeline, if with_material { &bind } else { &bind[..1] });
            draw.buffers(buffers, &scene.indices);
            bound = Some(texture);
        }
        let front = if call.mirrored { vk::FrontFace::CLOCKWISE } else { vk::FrontFace::COUNTER_CLOCKWISE };
        draw.faces(cull(material.double_sided), front);
        let push = if with_material { bytemuck::bytes_of(&material.push) } else { &[] };
        draw.indexed(pipeline, push, scene.ranges[call.mesh].clone(), call.instances.clone());
    }
}
