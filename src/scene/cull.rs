//! Culling: the instances that a view draws, with their matrices.

use super::Scene;
use crate::view::{CameraView, LightView};
use bytemuck::{Pod, Zeroable};
use glam::{DAffine3, DMat3, DMat4, DVec3, DVec4};

/// Data of an instance for a draw: `Instance` of `glsl/common/instance.glsl`, scalar layout.
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
#[repr(C)]
pub struct GpuInstance {
    clip_from_object: [[f32; 4]; 4],
    normal_from_object: [[f32; 3]; 3],
    world_from_object: [[f32; 3]; 3],
    viewer: [f32; 4],
    first_triangle: u32,
}

/// Instanced draw of a mesh.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct DrawCall {
    /// Index into the scene's meshes.
    pub mesh: usize,
    /// `true` if the transforms mirror, which reverses the winding of front faces.
    pub mirrored: bool,
    /// Range in [`DrawList::instances`].
    pub instances: std::ops::Range<u32>,
}

/// Draws of a view.
#[derive(Clone, Debug, Default)]
pub struct DrawList {
    /// Instances in draw order.
    pub instances: Vec<GpuInstance>,
    /// Draws of ranges of the instances.
    pub calls: Vec<DrawCall>,
}

impl DrawList {
    /// Lists the instances that the camera sees.
    pub fn for_camera(scene: &Scene, camera: &CameraView) -> Self {
        let viewer = |origin: DVec3| {
            if camera.is_orthographic() {
                return camera.world_from_view.matrix3.z_axis.extend(0.0);
            }
            (camera.position() - origin).extend(1.0)
        };
        Self::new(scene, |world_from_object| camera.clip_from_object(world_from_object), viewer)
    }

    /// Lists the instances that the light's shadow map needs.
    pub fn for_light(scene: &Scene, light: &LightView) -> Self {
        // The shadow map needs no normals.
        Self::new(scene, |world_from_object| light.clip_from_object(world_from_object), |_| DVec4::ZERO)
    }

    /// Lists the visible instances; `viewer` returns [`GpuInstance`]'s `viewer` for an object with the given origin.
    fn new(scene: &Scene, clip_from_object: impl Fn(&DAffine3) -> DMat4, viewer: impl Fn(DVec3) -> DVec4) -> Self {
        let mut first_triangle = 0u32;
        let mut visible = vec![];
        for instance in &scene.instances {
            let mesh = &scene.meshes[instance.mesh];
            let first = first_triangle;
            // Only the G-buffer uses the ids; its renderer rejects a scene with too many triangles.
            first_triangle = first_triangle.wrapping_add(mesh.triangles() as u32);
            let clip_from_object = clip_from_object(&instance.world_from_object);
            if mesh.bounds.is_empty() || is_outside(&mesh.bounds.corners(), &clip_from_object) {
                continue;
            }
            let m = instance.world_from_object.matrix3;
            let mirrored = m.determinant() < 0.0;
            let normals = normal_matrix(&m);
            let largest = normals.to_cols_array().into_iter().fold(0.0, |a: f64, b| a.max(b.abs()));
            // Keeps tiny and huge objects within `f32`.
            let normals = normals * if largest > 0.0 { 1.0 / largest } else { 0.0 };
            visible.push((
                (instance.mesh, mirrored),
                GpuInstance {
                    clip_from_object: clip_from_object.as_mat4().to_cols_array_2d(),
                    normal_from_object: normals.as_mat3().to_cols_array_2d(),
                    world_from_object: m.as_mat3().to_cols_array_2d(),
                    viewer: viewer(instance.world_from_object.translation).as_vec4().to_array(),
                    first_triangle: first,
                },
            ));
        }
        // The sort is stable: within a mesh the instances stay in scene order.
        visible.sort_by_key(|v| v.0);
        let mut list = Self::default();
        for (i, ((mesh, mirrored), instance)) in (0u32..).zip(visible) {
            list.instances.push(instance);
            match list.calls.last_mut() {
                Some(c) if c.mesh == mesh && c.mirrored == mirrored => c.instances.end = i + 1,
                _ => list.calls.push(DrawCall { mesh, mirrored, instances: i..i + 1 }),
            }
        }
        list
    }
}

/// Returns the matrix for normals: the inverse transpose up to a positive factor. It is computed without a division,
/// which a flattening matrix would break.
pub(super) fn normal_matrix(m: &DMat3) -> DMat3 {
    let cofactors = DMat3::from_cols(m.y_axis.cross(m.z_axis), m.z_axis.cross(m.x_axis), m.x_axis.cross(m.y_axis));
    // The cofactors of a mirroring matrix also reverse the normal.
    if m.determinant() < 0.0 { -cofactors } else { cofactors }
}

/// Returns `true` only if all corners lie outside one plane: a side, behind the viewer, or `z > w`. The latter is the
/// far plane of a light and, since depth is reversed, the near plane of a camera. Objects nearer than a light's near
/// plane still cast shadows, and a camera's far plane is infinite.
fn is_outside(corners: &[DVec3; 8], clip_from_object: &DMat4) -> bool {
    let clip = corners.map(|c| *clip_from_object * c.extend(1.0));
    let all = |outside: fn(&DVec4) -> bool| clip.iter().all(outside);
    all(|c| c.x > c.w)
        || all(|c| c.x < -c.w)
        || all(|c| c.y > c.w)
        || all(|c| c.y < -c.w)
        || all(|c| c.w <= 0.0)
        || all(|c| c.z > c.w)
}
