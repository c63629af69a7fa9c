//! The constants of a frame: what every pass knows of camera and light.

use crate::gpu::{Buffer, BufferDesc, Device, MemoryKind, shader_struct};
use crate::view::{CameraView, DepthRange, LightKind, LightView};
use crate::{Frame, Inputs, NormalEncoding, Result};
use ash::vk;
use glam::{DMat2, DMat3, DMat4, DVec2, Mat3, Mat4, Vec4Swizzles, dvec2};
use std::sync::Arc;

/// Layers that the constants have room for: a point light's six.
pub const MAX_LAYERS: usize = 6;

shader_struct! {
    /// `ViewBlock` of `glsl/common/view.glsl`. Everything is relative to the camera: composed in `f64`,
    /// rounded last.
    pub struct ViewConstants {
        view_from_clip: [[f32; 4]; 4],
        light_clip_from_view: [[[f32; 4]; 4]; MAX_LAYERS],
        light_position_view: [[f32; 4]; MAX_LAYERS],
        light_depth_scale: [f32; MAX_LAYERS],
        view_from_world: [[f32; 3]; 3],
        size: [u32; 2],
        map_size: [u32; 2],
        normal_encoding: u32,
        far_depth: f32,
        depth_error: f32,
        pixel_size: [f32; 2],
        off_axis: f32,
        light_area: [[f32; 4]; MAX_LAYERS],
    }
}

/// How far a stored camera depth may lie off, signed towards the viewer. Reversed floating-point depth errs
/// relative to the distance only, which the shaders allow for anyway: 0.
pub(crate) fn depth_error(format: vk::Format, range: DepthRange) -> f32 {
    // Rasterisation adds to the rounding of the format: four steps of D32 next to 1 were measured to suffice.
    let steps = match format {
        vk::Format::D16_UNORM | vk::Format::D16_UNORM_S8_UINT => 1.0 / 65535.0,
        vk::Format::X8_D24_UNORM_PACK32 | vk::Format::D24_UNORM_S8_UINT => 4.0 / 16_777_215.0,
        _ if range == DepthRange::Reversed => 0.0,
        _ => 4.0 / 16_777_216.0,
    };
    if range == DepthRange::Reversed { steps } else { -steps }
}

/// Largest rounding of a depth by a shadow map's format: half a step, and a tenth of one for the driver. Shaders allow for D32
/// anyway: 0 there.
fn map_rounding(format: vk::Format) -> f64 {
    match format {
        vk::Format::D16_UNORM | vk::Format::D16_UNORM_S8_UINT => 0.6 / 65535.0,
        vk::Format::X8_D24_UNORM_PACK32 | vk::Format::D24_UNORM_S8_UINT => 0.6 / 16_777_215.0,
        _ => 0.0,
    }
}

/// A light's view as depths are compared with its map: less by what the map's format may round away, so that a surface does
/// not shadow itself. Receivers and casters' edges go through the same view, and keep their order.
pub(crate) fn map_view(inputs: &Inputs<'_>, layer: usize) -> LightView {
    let mut light = inputs.light[layer];
    let rounding = map_rounding(inputs.shadow_map.format);
    if rounding > 0.0 {
        let m = &mut light.clip_from_view;
        // Off the quotient z/w.
        for column in [&mut m.x_axis, &mut m.y_axis, &mut m.z_axis, &mut m.w_axis] {
            column.z -= rounding * column.w;
        }
    }
    light
}

/// World width of a pixel, finer axis, at eye depth `z`: `[0] z + [1]`; and the largest secant of the view rays.
fn pixel_size(camera: &CameraView, extent: [u32; 2]) -> ([f32; 2], f32) {
    // Of a multiple of a projection, the projection.
    let m = &(camera.clip_from_view / (camera.clip_from_view.w_axis.w - camera.clip_from_view.z_axis.w));
    // The matrix takes device coordinates to the plane one unit away. A projection may turn the image, as displays are mounted.
    let plane_from_ndc = DMat2::from_cols(m.x_axis.xy(), m.y_axis.xy()).inverse();
    let step = |axis: DVec2, pixels: u32| (plane_from_ndc * axis * (2.0 / f64::from(pixels))).length();
    let finest = step(DVec2::X, extent[0]).min(step(DVec2::Y, extent[1]));
    if camera.is_orthographic() {
        return ([0.0, finest as f32], 1.0);
    }
    // An off-centre projection shears along the axis.
    let corner = |x: f64, y: f64| (plane_from_ndc * (dvec2(x, y) + m.z_axis.xy())).length_squared();
    let farthest = corner(1.0, 1.0).max(corner(1.0, -1.0)).max(corner(-1.0, 1.0)).max(corner(-1.0, -1.0));
    ([finest as f32, 0.0], (1.0 + farthest).sqrt() as f32)
}

/// `light_area` of `glsl/common/view.glsl`: half-size factors along the map's axes (uv) and in the world, and the depth
/// offset of `glsl/lib/area_light.glsl`.
fn light_area(light: &LightView) -> [f32; 4] {
    let p = &light.clip_from_view;
    let (world, offset) = match light.kind {
        // depth = f/(f-n) - (n f/(f-n))/z: the offset is f/(f-n).
        LightKind::Spot { size } => (0.5 * size, -p.z_axis.z),
        // depth = (z - n)/(f - n): the offset is f - n.
        LightKind::Directional { angle } => ((0.5 * angle).tan(), 1.0 / p.z_axis.z.abs()),
    };
    // Half the map is 1/T of the distance wide, or half the width of the box.
    let uv = |scale: f64| 0.5 * world * scale.abs();
    [uv(p.x_axis.x), uv(p.y_axis.y), world, offset].map(|v| v as f32)
}

fn columns(m: DMat4) -> [[f32; 4]; 4] {
    m.as_mat4().to_cols_array_2d()
}

impl ViewConstants {
    /// The constants of one frame.
    pub fn new(inputs: &Inputs<'_>) -> Self {
        let camera = inputs.camera;
        let view_from_world = camera.world_from_view.inverse();
        let (pixel_size, off_axis) = pixel_size(camera, inputs.depth.extent);
        let mut out = Self {
            view_from_clip: columns(camera.clip_from_view.inverse()),
            view_from_world: view_from_world.matrix3.as_mat3().to_cols_array_2d(),
            size: inputs.depth.extent,
            map_size: inputs.shadow_map.extent,
            normal_encoding: match inputs.normal {
                None => 0,
                Some((_, NormalEncoding::OctahedralSigned)) => 1,
                Some((_, NormalEncoding::OctahedralUnsigned)) => 2,
                Some((_, NormalEncoding::Cartesian)) => 3,
            },
            depth_error: depth_error(inputs.depth.format, camera.depth),
            far_depth: if camera.depth == DepthRange::Reversed { 0.0 } else { 1.0 },
            pixel_size,
            off_axis,
            ..Self::default()
        };
        for (layer, light) in inputs.light.iter().take(MAX_LAYERS).enumerate() {
            // Subtract the positions before anything is multiplied: far from the origin their product
            // with a rotation has already lost what the difference still holds.
            let offset = camera.world_from_view.translation - light.world_from_view.translation;
            let light_from_world: DMat3 = light.world_from_view.matrix3.transpose();
            let mut light_from_view = DMat4::from_mat3(light_from_world * camera.world_from_view.matrix3);
            light_from_view.w_axis = (light_from_world * offset).extend(1.0);
            out.light_clip_from_view[layer] = columns(map_view(inputs, layer).clip_from_view * light_from_view);
            out.light_area[layer] = light_area(light);
            let p = &light.clip_from_view;
            (out.light_position_view[layer], out.light_depth_scale[layer]) = match light.kind {
                LightKind::Spot { .. } => {
                    let position = camera.world_from_view.matrix3.transpose() * -offset;
                    (position.extend(1.0).as_vec4().to_array(), p.w_axis.z.abs() as f32)
                }
                LightKind::Directional { .. } => {
                    let towards = camera.world_from_view.matrix3.transpose() * -light.direction();
                    (towards.extend(0.0).as_vec4().to_array(), 0.0)
                }
            };
        }
        out
    }

    /// The camera's `view_from_clip` and a layer's `light_clip_from_view`, as the GPU has them.
    pub fn matrices(&self, layer: usize) -> (Mat4, Mat4, Mat3) {
        (
            Mat4::from_cols_array_2d(&self.view_from_clip),
            Mat4::from_cols_array_2d(&self.light_clip_from_view[layer]),
            Mat3::from_cols_array_2d(&self.view_from_world),
        )
    }
}

/// The uniform buffer; updated in stream order, so it serves any number of frames in flight.
pub struct ViewBuffer {
    buffer: Buffer,
}

impl ViewBuffer {
    /// Allocates.
    pub fn new(device: &Arc<Device>) -> Result<Self> {
        let desc = BufferDesc {
            name: "view constants",
            size: size_of::<ViewConstants>() as u64,
            usage: vk::BufferUsageFlags::UNIFORM_BUFFER | vk::BufferUsageFlags::TRANSFER_DST,
            memory: MemoryKind::Gpu,
        };
        Ok(Self { buffer: Buffer::new(device, &desc)? })
    }

    /// Records the update for this frame and returns the buffer.
    pub fn update(&self, frame: &mut Frame<'_>, inputs: &Inputs<'_>) -> &Buffer {
        frame.update(&self.buffer, bytemuck::bytes_of(&ViewConstants::new(inputs)));
        &self.buffer
    }
}
