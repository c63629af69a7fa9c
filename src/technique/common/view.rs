//! Constants of a frame, which tell every pass about camera and light.

use crate::gpu::{Buffer, BufferDesc, Device, MemoryKind, shader_struct};
use crate::view::{CameraView, DepthRange, LightKind, LightView};
use crate::{Frame, Inputs, NormalEncoding, Result};
use ash::vk;
use glam::{DMat2, DMat3, DMat4, DVec2, Mat3, Mat4, Vec4Swizzles, dvec2};
use std::sync::Arc;

/// Number of layers that the constants have room for: the six faces of a point light.
pub const MAX_LAYERS: usize = 6;

shader_struct! {
    /// `ViewBlock` of `glsl/common/view.glsl`. All values are relative to the camera. They are computed in `f64` and
    /// rounded at the end.
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

/// Largest error of a stored camera depth, with the sign that points towards the viewer. It is 0 for reversed
/// floating-point depth, whose error is relative to the distance, because the shaders allow for relative errors anyway.
pub(crate) fn depth_error(format: vk::Format, range: DepthRange) -> f32 {
    // Rasterisation adds to the rounding of the format. Measurements showed that four steps of D32 near 1 suffice.
    let steps = match format {
        vk::Format::D16_UNORM | vk::Format::D16_UNORM_S8_UINT => 1.0 / 65535.0,
        vk::Format::X8_D24_UNORM_PACK32 | vk::Format::D24_UNORM_S8_UINT => 4.0 / 16_777_215.0,
        _ if range == DepthRange::Reversed => 0.0,
        _ => 4.0 / 16_777_216.0,
    };
    if range == DepthRange::Reversed { steps } else { -steps }
}

/// Largest rounding error of a depth in a shadow map's format: half a step, and a tenth of a step for the driver. It is
/// 0 for D32, because the shaders allow for its error anyway.
fn map_rounding(format: vk::Format) -> f64 {
    match format {
        vk::Format::D16_UNORM | vk::Format::D16_UNORM_S8_UINT => 0.6 / 65535.0,
        vk::Format::X8_D24_UNORM_PACK32 | vk::Format::D24_UNORM_S8_UINT => 0.6 / 16_777_215.0,
        _ => 0.0,
    }
}

/// View of a light for comparing depths with its map. Its depths are smaller by the largest rounding error of the map's
/// format, so that a surface does not shadow itself. Receivers and the casters' edges use the same view and therefore
/// keep their order.
pub(crate) fn map_view(inputs: &Inputs<'_>, layer: usize) -> LightView {
    let mut light = inputs.light[layer];
    let rounding = map_rounding(inputs.shadow_map.format);
    if rounding > 0.0 {
        let m = &mut light.clip_from_view;
        // Subtracts the rounding error from the quotient z/w.
        for column in [&mut m.x_axis, &mut m.y_axis, &mut m.z_axis, &mut m.w_axis] {
            column.z -= rounding * column.w;
        }
    }
    light
}

/// World width of a pixel along the finer axis, as `[a, b]`: it is `a z + b` at the eye depth `z`. Also returns the
/// largest secant of the angles between the view rays and the axis.
fn pixel_size(camera: &CameraView, extent: [u32; 2]) -> ([f32; 2], f32) {
    // A projection matrix times any factor is the same projection. The division makes the factor 1.
    let m = &(camera.clip_from_view / (camera.clip_from_view.w_axis.w - camera.clip_from_view.z_axis.w));
    // The matrix takes device coordinates to the plane one unit away. A projection may also rotate the image, as for a
    // rotated display.
    let plane_from_ndc = DMat2::from_cols(m.x_axis.xy(), m.y_axis.xy()).inverse();
    let step = |axis: DVec2, pixels: u32| (plane_from_ndc * axis * (2.0 / f64::from(pixels))).length();
    let finest = step(DVec2::X, extent[0]).min(step(DVec2::Y, extent[1]));
    if camera.is_orthographic() {
        return ([0.0, finest as f32], 1.0);
    }
    // An off-centre projection shears along the view axis.
    let corner = |x: f64, y: f64| (plane_from_ndc * (dvec2(x, y) + m.z_axis.xy())).length_squared();
    let farthest = corner(1.0, 1.0).max(corner(1.0, -1.0)).max(corner(-1.0, 1.0)).max(corner(-1.0, -1.0));
    ([finest as f32, 0.0], (1.0 + farthest).sqrt() as f32)
}

/// Returns `light_area` of `glsl/common/view.glsl`: the factors for half sizes along the map's axes (uv) and in the
/// world, and the depth offset of `glsl/lib/area_light.glsl`.
pub(crate) fn light_area(light: &LightView) -> [f32; 4] {
    let p = &light.clip_from_view;
    let (world, offset) = match light.kind {
        // The depth is f/(f-n) - (n f/(f-n))/z, so the offset is f/(f-n).
        LightKind::Spot { size } => (0.5 * size, -p.z_axis.z),
        // The depth is (z - n)/(f - n), so the offset is f - n.
        LightKind::Directional { angle } => ((0.5 * angle).tan(), 1.0 / p.z_axis.z.abs()),
    };
    // Half of the map, 0.5 in uv, is `1 / scale` wide for a directional light, and `1 / scale` times the distance for a
    // spot light.
    let uv = |scale: f64| 0.5 * world * scale.abs();
    [uv(p.x_axis.x), uv(p.y_axis.y), world, offset].map(|v| v as f32)
}

fn columns(m: DMat4) -> [[f32; 4]; 4] {
    m.as_mat4().to_cols_array_2d()
}

impl ViewConstants {
    /// Computes the constants of one frame.
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
            // Subtract the positions before any multiplication. Far from the origin, the product of a position and a
            // rotation loses digits that the difference still has.
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

    /// Returns `view_from_clip`, a layer's `light_clip_from_view`, and `view_from_world`, with the GPU's precision.
    pub fn matrices(&self, layer: usize) -> (Mat4, Mat4, Mat3) {
        (
            Mat4::from_cols_array_2d(&self.view_from_clip),
            Mat4::from_cols_array_2d(&self.light_clip_from_view[layer]),
            Mat3::from_cols_array_2d(&self.view_from_world),
        )
    }
}

/// The uniform buffer. It is updated in the order of the commands, so one buffer suffices for any number of frames in
/// flight.
pub struct ViewBuffer {
    buffer: Buffer,
}

impl ViewBuffer {
    /// Makes the buffer.
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
