//! Raster passes of the host: the shadow map and the camera's G-buffer.

use super::cull::{DrawList, GpuInstance};
use super::gpu_scene::{GpuScene, MaterialPush};
use crate::frame::{Bound, Draw, RasterPass, Target};
use crate::gpu::{Buffer, BufferDesc, DepthState, Image, ImageDesc, MemoryKind, RasterPipeline, RasterState, bindings};
use crate::host::Host;
use crate::{Bind, Error, Frame, Result};
use ash::vk;

/// Options for drawing casters into the shadow map.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CasterOptions {
    /// Faces that cast shadows.
    pub faces: CasterFaces,
    /// Constant depth bias, in the units of `vkCmdSetDepthBias`.
    pub constant_bias: f32,
    /// Depth bias per slope of the polygon.
    pub slope_bias: f32,
}

impl Default for CasterOptions {
    /// Returns both faces without bias. The map is the same for all techniques, which bias the receiver instead.
    fn default() -> Self {
        Self { faces: CasterFaces::Both, constant_bias: 0.0, slope_bias: 0.0 }
    }
}

/// Faces that cast shadows. Double-sided materials always cast with both.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum CasterFaces {
    /// Both faces, as in the ray-traced truth.
    #[default]
    Both,
    /// Only faces towards the light.
    Front,
    /// Only faces away from the light: no acne on closed bodies, but light leaking at thin ones.
    Back,
}

/// Shadow map: D32, an array of one layer.
pub struct ShadowMap {
    depth: Image,
    instances: InstanceBuffer,
    opaque: RasterPipeline,
    masked: RasterPipeline,
    faces: CasterFaces,
}

/// G-buffer of the camera: depth, normals, albedo and triangle ids.
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

/// Instances of one view, written by the CPU each frame. Only one frame is in flight, because the host waits.
struct InstanceBuffer {
    buffer: Buffer,
}

impl InstanceBuffer {
    fn new(host: &Host, name: &str, capacity: usize) -> Result<Self> {
        let each = size_of::<GpuInstance>() as u64;
        let most = u64::from(host.context().device().limits.max_storage_buffer_range) / each;
        if capacity as u64 > most {
            let problem = format!(
                "{name}: the scene has {capacity} instances, but this device takes at most {most}: split the scene"
            );
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

bindings! {
    struct OpaqueBindings { Instances }
    struct MaterialBindings { Instances, base_color_texture }
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
            vertex: "common/depth.vert",
            attributes: &[POSITION],
            depth: Some(DepthState::new(desc.format, vk::CompareOp::LESS)),
            bias: [options.constant_bias, options.slope_bias],
            depth_clamp: host.depth_clamp(),
            ..RasterState::default()
        };
        let masked = RasterState {
            name: "shadow map, masked",
            vertex: "common/depth_masked.vert",
            fragment: Some("common/depth_masked.frag"),
            attributes: &[POSITION, UV, COLOR],
            ..state.clone()
        };
        Ok(Self {
            depth: Image::new(device, &desc)?,
            instances: InstanceBuffer::new(host, "shadow-map instances", instances)?,
            opaque: RasterPipeline::new::<OpaqueBindings, ()>(device, &state)?,
            masked: RasterPipeline::new::<MaterialBindings, MaterialPush>(device, &masked)?,
            faces: options.faces,
        })
    }

    /// Returns the map: a 2D array view in `GENERAL`.
    pub fn image(&self) -> &Image {
        &self.depth
    }

    /// Draws the casters.
    pub fn record(&mut self, frame: &mut Frame<'_>, scene: &GpuScene, list: &DrawList) -> Result<()> {
        self.instances.write(list)?;
        let cull = |double_sided: bool| match self.faces {
            _ if double_sided => vk::CullModeFlags::NONE,
            CasterFaces::Both => vk::CullModeFlags::NONE,
            CasterFaces::Front => vk::CullModeFlags::BACK,
            CasterFaces::Back => vk::CullModeFlags::FRONT,
        };
        let (instances, white) = (Bind::Buffer(&self.instances.buffer), scene.white().as_ref());
        let opaque = OpaqueBindings { Instances: instances };
        let masked = MaterialBindings { Instances: instances, base_color_texture: Bind::Input(&white) };
        let bound = [Bound { pipeline: &self.opaque, bind: &opaque }, Bound { pipeline: &self.masked, bind: &masked }];
        let pass = RasterPass {
            name: "shadow map",
            extent: self.depth.extent(),
            colors: &[],
            depth: Some(Target::depth(&self.depth, 1.0)),
            bound: &bound,
            indirect: &[],
        };
        frame.raster(&pass, |draw| {
            for is_masked in [false, true] {
                let with_uv = [(&scene.positions, 0), (&scene.uvs, 0), (&scene.colors, 0)];
                let buffers = if is_masked { &with_uv[..] } else { &with_uv[..1] };
                draw_all(draw, scene, list, buffers, &self.instances.buffer, is_masked, is_masked, &cull)?;
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
        // Signed normalised render targets are optional in Vulkan.
        let snorm = vk::Format::R16G16_SNORM;
        let attachable = device.format_features(snorm).contains(vk::FormatFeatureFlags::COLOR_ATTACHMENT);
        let normal = if attachable { snorm } else { vk::Format::R32G32_SFLOAT };
        let colors = [normal, normal, vk::Format::R8G8B8A8_SRGB, vk::Format::R32_UINT];
        let pipeline = |is_masked: bool| {
            let state = RasterState {
                name: if is_masked { "g-buffer, masked" } else { "g-buffer" },
                vertex: "common/gbuffer.vert",
                fragment: Some("common/gbuffer.frag"),
                attributes: &[POSITION, UV, COLOR, NORMAL],
                colors: &colors,
                depth: Some(DepthState::new(vk::Format::D32_SFLOAT, vk::CompareOp::GREATER)),
                constants: &[("MASKED", is_masked.into())],
                ..RasterState::default()
            };
            RasterPipeline::new::<MaterialBindings, MaterialPush>(device, &state)
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

    /// Draws the instances that the camera sees.
    pub fn record(&mut self, frame: &mut Frame<'_>, scene: &GpuScene, list: &DrawList) -> Result<()> {
        self.instances.write(list)?;
        let zero = [0.0; 4];
        let sky = vk::ClearValue { color: vk::ClearColorValue { uint32: [u32::MAX; 4] } };
        let targets = [
            Target::color(&self.geometric_normal, zero),
            Target::color(&self.shading_normal, zero),
            Target::color(&self.albedo, zero),
            Target { image: &self.triangle, clear: Some(sky) },
        ];
        let cull = |double_sided| if double_sided { vk::CullModeFlags::NONE } else { vk::CullModeFlags::BACK };
        let white = scene.white().as_ref();
        let bind = MaterialBindings {
            Instances: Bind::Buffer(&self.instances.buffer),
            base_color_texture: Bind::Input(&white),
        };
        let pass = RasterPass {
            name: "g-buffer",
            extent: self.depth.extent(),
            colors: &targets,
            depth: Some(Target::depth(&self.depth, 0.0)),
            bound: &[&self.opaque, &self.masked].map(|pipeline| Bound { pipeline, bind: &bind }),
            indirect: &[],
        };
        let buffers = [(&scene.positions, 0), (&scene.uvs, 0), (&scene.colors, 0), (&scene.normals, 0)];
        frame.raster(&pass, |draw| {
            for is_masked in [false, true] {
                draw_all(draw, scene, list, &buffers, &self.instances.buffer, is_masked, true, &cull)?;
            }
            Ok(())
        })
    }

    /// Returns the size of the device memory, bytes.
    pub fn memory_bytes(&self) -> u64 {
        [&self.depth, &self.geometric_normal, &self.shading_normal, &self.albedo, &self.triangle]
            .map(Image::memory_bytes)
            .iter()
            .sum()
    }
}

/// Draws the meshes whose material is masked with the pass's second pipeline, or the others with its first.
#[allow(clippy::too_many_arguments)]
fn draw_all(
    draw: &mut Draw<'_, '_>,
    scene: &GpuScene,
    list: &DrawList,
    buffers: &[(&Buffer, u64)],
    instances: &Buffer,
    is_masked: bool,
    with_material: bool,
    cull: &dyn Fn(bool) -> vk::CullModeFlags,
) -> Result<()> {
    let mut bound = None;
    for call in &list.calls {
        let material = &scene.materials[scene.mesh_materials[call.mesh]];
        if material.is_masked() != is_masked || scene.ranges[call.mesh].is_empty() {
            continue;
        }
        if bound.is_none() {
            draw.bind(is_masked.into())?;
            draw.vertices(buffers);
            draw.indices(&scene.indices);
        }
        let texture = with_material.then_some(material.texture);
        if bound != Some(texture) {
            if with_material {
                let image = scene.textures[material.texture].as_ref();
                draw.rebind(&MaterialBindings {
                    Instances: Bind::Buffer(instances),
                    base_color_texture: Bind::Input(&image),
                })?;
            }
            bound = Some(texture);
        }
        let front = if call.mirrored { vk::FrontFace::CLOCKWISE } else { vk::FrontFace::COUNTER_CLOCKWISE };
        draw.faces(cull(material.double_sided), front);
        draw.push(if with_material { bytemuck::bytes_of(&material.push) } else { &[] })?;
        draw.indexed(scene.ranges[call.mesh].clone(), call.instances.clone())?;
    }
    Ok(())
}
