//! A scene's meshes and textures on the GPU.

use super::{Scene, Texture, Wrap};
use crate::gpu::{Buffer, Image, ImageDesc, shader_struct};
use crate::host::Host;
use crate::{Error, Result};
use ash::vk;

shader_struct! {
    /// Push constants of the raster shaders: `glsl/common/material.glsl`.
    pub struct MaterialPush {
        base_color: [f32; 4],
        alpha_cutoff: f32,
        wrap_u: u32,
        wrap_v: u32,
        nearest: u32,
    }
}

/// Material, ready to draw with.
pub struct GpuMaterial {
    pub(super) push: MaterialPush,
    /// Index into [`GpuScene::textures`].
    pub(super) texture: usize,
    pub(super) double_sided: bool,
}

impl GpuMaterial {
    /// Returns whether the material has holes.
    pub fn is_masked(&self) -> bool {
        self.push.alpha_cutoff >= 0.0
    }
}

/// All meshes in one set of buffers, all textures and all materials.
pub struct GpuScene {
    pub(super) positions: Buffer,
    pub(super) normals: Buffer,
    pub(super) uvs: Buffer,
    pub(super) colors: Buffer,
    pub(super) indices: Buffer,
    /// Index range of each mesh.
    pub(super) ranges: Vec<std::ops::Range<u32>>,
    /// Index into `materials` for each mesh.
    pub(super) mesh_materials: Vec<usize>,
    pub(super) materials: Vec<GpuMaterial>,
    /// Textures of the scene, and last a white one.
    pub(super) textures: Vec<Image>,
    memory_bytes: u64,
}

impl GpuScene {
    /// Uploads the scene.
    ///
    /// # Errors
    /// Fails if the device does, or if the scene has more vertices or triangles than an index or an id can number.
    pub fn new(host: &Host, scene: &Scene) -> Result<Self> {
        let vertices = scene.meshes.iter().map(|m| m.positions.len()).sum();
        let largest_index = host.context().device().limits.max_draw_indexed_index_value;
        if vertices as u64 > u64::from(largest_index) {
            let problem = format!(
                "scene {}: {vertices} vertices, but this device draws at most {largest_index}: split the scene",
                scene.name
            );
            return Err(Error::Usage(problem));
        }
        let indices: usize = scene.meshes.iter().map(|m| m.indices.len()).sum();
        // The last id stands for the sky.
        if scene.triangles() as u64 >= u64::from(u32::MAX) || indices as u64 > u64::from(u32::MAX) {
            let problem = format!(
                "scene {}: {} triangles over all instances, but at most {} can have ids: split the scene",
                scene.name,
                scene.triangles(),
                u32::MAX - 1
            );
            return Err(Error::Usage(problem));
        }
        let mut positions: Vec<[f32; 3]> = Vec::with_capacity(vertices);
        let mut normals: Vec<[f32; 3]> = Vec::with_capacity(vertices);
        let mut uvs: Vec<[f32; 2]> = Vec::with_capacity(vertices);
        let mut colors: Vec<[f32; 4]> = Vec::with_capacity(vertices);
        let mut indices: Vec<u32> = vec![];
        let mut ranges = vec![];
        for mesh in &scene.meshes {
            let (base, first) = (positions.len() as u32, indices.len() as u32);
            indices.extend(mesh.indices.iter().map(|i| i + base));
            ranges.push(first..indices.len() as u32);
            positions.extend_from_slice(&mesh.positions);
            normals.extend_from_slice(&mesh.normals);
            uvs.extend_from_slice(&mesh.uvs);
            colors.extend_from_slice(&mesh.colors);
            colors.resize(positions.len(), [1.0; 4]);
        }
        let vertex = vk::BufferUsageFlags::VERTEX_BUFFER;
        let mut textures = scene.textures.iter().map(|t| texture(host, t)).collect::<Result<Vec<_>>>()?;
        let white = Texture { name: "white".into(), size: [1; 2], rgba: vec![[255; 4]], ..Texture::default() };
        textures.push(texture(host, &white)?);
        let materials = scene.materials.iter().map(|m| {
            let texture = m.texture.and_then(|i| scene.textures.get(i));
            GpuMaterial {
                push: MaterialPush {
                    base_color: m.base_color,
                    alpha_cutoff: m.alpha_cutoff.unwrap_or(-1.0),
                    wrap_u: texture.map_or(0, |t| wrap(t.wrap[0])),
                    wrap_v: texture.map_or(0, |t| wrap(t.wrap[1])),
                    nearest: texture.is_some_and(|t| t.nearest).into(),
                },
                texture: m.texture.filter(|&i| i < scene.textures.len()).unwrap_or(scene.textures.len()),
                double_sided: m.double_sided,
            }
        });
        let materials = materials.collect();
        let image_bytes: u64 = textures.iter().map(Image::memory_bytes).sum();
        let gpu = Self {
            // The techniques that use the casters' geometry read this buffer too.
            positions: host.upload("positions", vertex | vk::BufferUsageFlags::STORAGE_BUFFER, &positions)?,
            normals: host.upload("normals", vertex, &normals)?,
            uvs: host.upload("uvs", vertex, &uvs)?,
            colors: host.upload("colors", vertex, &colors)?,
            indices: host.upload("indices", vk::BufferUsageFlags::INDEX_BUFFER, &indices)?,
            ranges,
            mesh_materials: scene.meshes.iter().map(|m| m.material).collect(),
            materials,
            textures,
            memory_bytes: image_bytes + 48 * vertices as u64 + 4 * indices.len() as u64,
        };
        Ok(gpu)
    }

    /// Returns the texture for materials without one.
    pub(super) fn white(&self) -> &Image {
        &self.textures[self.textures.len() - 1]
    }

    /// Returns the size of the device memory, bytes.
    pub fn memory_bytes(&self) -> u64 {
        self.memory_bytes
    }
}

fn wrap(w: Wrap) -> u32 {
    match w {
        Wrap::Repeat => 0,
        Wrap::MirroredRepeat => 1,
        Wrap::ClampToEdge => 2,
    }
}

fn texture(host: &Host, t: &Texture) -> Result<Image> {
    let usage = vk::ImageUsageFlags::SAMPLED;
    let desc = ImageDesc { usage, ..ImageDesc::storage(&t.name, vk::Format::R8G8B8A8_SRGB, t.size) };
    host.upload_image(&desc, bytemuck::cast_slice(&t.rgba))
}
