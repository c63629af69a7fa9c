//! Views: the camera and the light as the caller has them, in `f64`.
//!
//! World space is right-handed. A view looks down its own `-Z`, `+Y` up, as in glTF. Matrices are
//! column-major and stay in `f64` until they are composed *relative to the camera*: only then are
//! they rounded to the `f32` that the GPU gets, so that a scene 1e6 units from the origin keeps its
//! precision (see [`crate::Inputs`]).

use glam::{DAffine3, DMat3, DMat4, DVec2, DVec3, dvec3};
use std::f64::consts::PI;

/// Which end of the depth range the viewer is at.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub enum DepthRange {
    /// 0 near, 1 far; a cleared pixel holds 1.
    Standard,
    /// 1 near, 0 far (possibly infinitely far); a cleared pixel holds 0.
    #[default]
    Reversed,
}

/// A camera: where it stands and how it projects.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CameraView {
    /// Rigid transform from the camera's own space to the world.
    pub world_from_view: DAffine3,
    /// Projection with Vulkan's clip space: `x, y` in `[-w, w]` with **y down**, `z` in `[0, w]`; or a multiple of it.
    pub clip_from_view: DMat4,
    /// How the depth buffer made with this projection is to be read.
    pub depth: DepthRange,
}

impl CameraView {
    /// Perspective with reversed Z and an infinitely far plane: the project's own convention.
    ///
    /// `fov_y` is the full vertical angle in radians, `near` in world units.
    pub fn perspective(world_from_view: DAffine3, fov_y: f64, aspect: f64, near: f64) -> Self {
        let f = 1.0 / (0.5 * fov_y).tan();
        let clip_from_view = DMat4::from_cols_array(&[
            f / aspect,
            0.0,
            0.0,
            0.0, //
            0.0,
            -f,
            0.0,
            0.0, //
            0.0,
            0.0,
            0.0,
            -1.0, //
            0.0,
            0.0,
            near,
            0.0,
        ]);
        Self { world_from_view, clip_from_view, depth: DepthRange::Reversed }
    }

    /// Parallel projection with reversed Z; the half extents and the planes are in world units.
    pub fn orthographic(world_from_view: DAffine3, half: [f64; 2], near: f64, far: f64) -> Self {
        let r = 1.0 / (far - near);
        let clip_from_view = DMat4::from_cols_array(&[
            1.0 / half[0],
            0.0,
            0.0,
            0.0, //
            0.0,
            -1.0 / half[1],
            0.0,
            0.0, //
            0.0,
            0.0,
            r,
            0.0, //
            0.0,
            0.0,
            far * r,
            1.0,
        ]);
        Self { world_from_view, clip_from_view, depth: DepthRange::Reversed }
    }

    /// Position of the camera in the world.
    pub fn position(&self) -> DVec3 {
        self.world_from_view.translation
    }

    /// Returns an error that names the fault of the matrices, and the remedy.
    pub(crate) fn check(&self) -> Result<(), String> {
        check_matrices(&self.world_from_view, &self.clip_from_view, self.depth)
    }

    /// True for a parallel projection.
    pub fn is_orthographic(&self) -> bool {
        self.clip_from_view.row(3).truncate() == DVec3::ZERO
    }

    /// This view's clip space from an object's: see [`clip_from_object`].
    pub(crate) fn clip_from_object(&self, world_from_object: &DAffine3) -> DMat4 {
        clip_from_object(&self.world_from_view, self.clip_from_view, world_from_object)
    }

    /// The ray through a point of the image, in the world: origin and unit direction.
    ///
    /// `ndc` has `x` right and `y` down, both in `[-1, 1]`; the centre of pixel `(i, j)` of a `w x h`
    /// image is `((2i + 1)/w - 1, (2j + 1)/h - 1)`. The origin is the eye, or for a parallel
    /// projection the point of the near plane.
    pub fn ray(&self, ndc: [f64; 2]) -> (DVec3, DVec3) {
        let view_from_clip = self.clip_from_view.inverse();
        let unproject = |z: f64| {
            let p = view_from_clip * glam::dvec4(ndc[0], ndc[1], z, 1.0);
            p.truncate() / p.w
        };
        let near = unproject(if self.depth == DepthRange::Reversed { 1.0 } else { 0.0 });
        let (origin, direction) =
            if self.is_orthographic() { (near, dvec3(0.0, 0.0, -1.0)) } else { (DVec3::ZERO, near.normalize()) };
        (self.world_from_view.transform_point3(origin), self.world_from_view.transform_vector3(direction))
    }
}

/// What kind of light casts the shadow, and how large it is.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum LightKind {
    /// A point or spot light. `size` is the full width, in world units, of the square area light that
    /// it stands for; the square is centred on the light and faces along its view axis. 0 = a point.
    Spot {
        /// Full width of the square light, world units.
        size: f64,
    },
    /// A directional light (the sun). `angle` is the full angular width in radians. 0 = parallel rays.
    Directional {
        /// Full angular width, radians.
        angle: f64,
    },
}

/// The view that the shadow map was rendered from.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LightView {
    /// Rigid transform from the light's own space to the world; the light shines along its `-Z`.
    pub world_from_view: DAffine3,
    /// Projection of the shadow map, Vulkan clip space (y down): in perspective for a spot light, parallel for a directional
    /// one.
    pub clip_from_view: DMat4,
    /// Depth range of the shadow map made with this projection. Only [`DepthRange::Standard`], 0 near to 1 far, is
    /// supported: the other is refused.
    pub depth: DepthRange,
    /// Kind and size.
    pub kind: LightKind,
}

impl LightView {
    /// A spot light with a square frustum: `fov` is its full angle in radians.
    pub fn spot(world_from_view: DAffine3, fov: f64, near: f64, far: f64, size: f64) -> Self {
        let f = 1.0 / (0.5 * fov).tan();
        let r = 1.0 / (near - far);
        let clip_from_view = DMat4::from_cols_array(&[
            f,
            0.0,
            0.0,
            0.0, //
            0.0,
            -f,
            0.0,
            0.0, //
            0.0,
            0.0,
            far * r,
            -1.0, //
            0.0,
            0.0,
            near * far * r,
            0.0,
        ]);
        Self { world_from_view, clip_from_view, depth: DepthRange::Standard, kind: LightKind::Spot { size } }
    }

    /// A directional light over a box: half extents and planes in world units, from `world_from_view`'s origin.
    pub fn directional(world_from_view: DAffine3, half: [f64; 2], near: f64, far: f64, angle: f64) -> Self {
        let r = 1.0 / (near - far);
        let clip_from_view = DMat4::from_cols_array(&[
            1.0 / half[0],
            0.0,
            0.0,
            0.0, //
            0.0,
            -1.0 / half[1],
            0.0,
            0.0, //
            0.0,
            0.0,
            r,
            0.0, //
            0.0,
            0.0,
            near * r,
            1.0,
        ]);
        Self { world_from_view, clip_from_view, depth: DepthRange::Standard, kind: LightKind::Directional { angle } }
    }

    /// This view's clip space from an object's: see [`clip_from_object`].
    pub(crate) fn clip_from_object(&self, world_from_object: &DAffine3) -> DMat4 {
        clip_from_object(&self.world_from_view, self.clip_from_view, world_from_object)
    }

    /// Returns an error that names the fault of the matrices, the kind or the size, and the remedy.
    pub(crate) fn check(&self) -> Result<(), String> {
        check_matrices(&self.world_from_view, &self.clip_from_view, self.depth)?;
        let m = &self.clip_from_view;
        if self.depth == DepthRange::Reversed {
            return Err("depth is stated as Reversed, but reversed-Z shadow maps are not supported: render the map with \
                        depth 0 near to 1 far, as LightView::spot and LightView::directional project, clear it to 1, and \
                        state DepthRange::Standard"
                .into());
        }
        let scale = m.w_axis.w - m.z_axis.w;
        if scale != 1.0 {
            return Err(format!(
                "clip_from_view is {scale} times a projection: divide it by that, so that w is the distance"
            ));
        }
        if is_tilted(m) {
            return Err(
                "clip_from_view has a near plane that is not at right angles to the light's axis: the map's depth \
                        must depend on the distance along the axis alone"
                    .into(),
            );
        }
        let problem = match self.kind {
            LightKind::Spot { .. } if is_parallel(m) => {
                "kind is Spot, but clip_from_view is a parallel projection: state \
                 LightKind::Directional, or project in perspective (LightView::spot)"
                    .into()
            }
            LightKind::Directional { .. } if !is_parallel(m) => {
                "kind is Directional, but clip_from_view is a perspective \
                 projection: state LightKind::Spot, or project in parallel (LightView::directional)"
                    .into()
            }
            LightKind::Spot { size } if !(0.0..f64::INFINITY).contains(&size) => {
                format!("the size {size} is not possible: world units, 0 for a point or more")
            }
            LightKind::Directional { angle } if !(0.0..PI).contains(&angle) => {
                format!("the angle {angle} is not possible: radians, 0 for parallel rays up to less than pi")
            }
            _ => return Ok(()),
        };
        Err(problem)
    }

    /// True for a directional light.
    pub fn is_directional(&self) -> bool {
        matches!(self.kind, LightKind::Directional { .. })
    }

    /// Position of a spot light in the world (for a directional light: the origin of its view).
    pub fn position(&self) -> DVec3 {
        self.world_from_view.translation
    }

    /// Unit vector along which the light shines.
    pub fn direction(&self) -> DVec3 {
        self.world_from_view.transform_vector3(dvec3(0.0, 0.0, -1.0))
    }

    /// Unit vector from a point of the world towards the centre of the light.
    pub fn towards(&self, p: DVec3) -> DVec3 {
        match self.kind {
            LightKind::Directional { .. } => -self.direction(),
            LightKind::Spot { .. } => (self.position() - p).normalize_or_zero(),
        }
    }
}

fn is_parallel(clip_from_view: &DMat4) -> bool {
    clip_from_view.row(3).truncate() == DVec3::ZERO
}

/// True where depth depends on more than the distance along the axis: an oblique near plane.
fn is_tilted(clip_from_view: &DMat4) -> bool {
    clip_from_view.row(2).truncate().truncate() != DVec2::ZERO
}

/// Largest deviation of a rigid transform's axes from unit length and right angles: at 1e-4 a shadow moves by a tenth of a
/// texel of a map of 1024.
const RIGID: f64 = 1e-4;

/// Returns an error that names the fault of a view's matrices, and the remedy.
fn check_matrices(world_from_view: &DAffine3, clip_from_view: &DMat4, depth: DepthRange) -> Result<(), String> {
    for (name, is_finite) in
        [("world_from_view", world_from_view.is_finite()), ("clip_from_view", clip_from_view.is_finite())]
    {
        if !is_finite {
            return Err(format!("{name} has numbers that are not finite"));
        }
    }
    let axes = world_from_view.matrix3;
    if !(axes.transpose() * axes).abs_diff_eq(DMat3::IDENTITY, RIGID) || axes.determinant() < 0.0 {
        return Err(format!(
            "world_from_view is not rigid: its axes {}, {}, {} must have length 1, right angles between them, and be \
             right-handed; leave scale and mirroring out of it",
            axes.x_axis, axes.y_axis, axes.z_axis
        ));
    }
    let m = clip_from_view;
    // The GPU gets both in single precision.
    if m.determinant() == 0.0 || !m.as_mat4().is_finite() || !m.inverse().as_mat4().is_finite() {
        return Err(
            "clip_from_view has no inverse: a projection has extents other than 0, and planes near and far that \
                    differ"
                .into(),
        );
    }
    let row = m.row(3);
    let is_one = row.x == 0.0 && row.y == 0.0 && (row.z < 0.0 && row.w == 0.0 || row.z == 0.0 && row.w > 0.0);
    if !is_one {
        return Err(format!(
            "clip_from_view has the last row {row}: it must be 0, 0, -1, 0 for a perspective along the view's own -Z, or \
             0, 0, 0, 1 for a parallel projection"
        ));
    }
    if is_tilted(m) {
        return Ok(());
    }
    // Of depth(d) = (z_w - z_z d) / (w_w - w_z d), d the distance along -Z, the sign of the slope.
    let grows = m.w_axis.z * m.z_axis.w - m.z_axis.z * m.w_axis.w > 0.0;
    if grows != (depth == DepthRange::Standard) {
        let (is, near, far, other) =
            if grows { ("grows", 0, 1, DepthRange::Standard) } else { ("falls", 1, 0, DepthRange::Reversed) };
        return Err(format!(
            "depth is stated as {depth:?}, but clip_from_view makes depth that {is} with the distance, {near} near to {far} \
             far: state DepthRange::{other:?}, or project the other way round"
        ));
    }
    let near = m.w_axis.z / (m.z_axis.z - if grows { 0.0 } else { m.z_axis.w });
    let in_front = near > 0.0 && near.is_finite();
    if !(is_parallel(m) || in_front) {
        return Err(format!(
            "clip_from_view has its near plane at the distance {near}: it must be in front of the view"
        ));
    }
    Ok(())
}

/// A view's clip space from an object's: positions are subtracted before anything is multiplied.
fn clip_from_object(world_from_view: &DAffine3, clip_from_view: DMat4, world_from_object: &DAffine3) -> DMat4 {
    let rotation = world_from_view.matrix3.transpose();
    let view_from_object = DAffine3 {
        matrix3: rotation * world_from_object.matrix3,
        translation: rotation * (world_from_object.translation - world_from_view.translation),
    };
    clip_from_view * DMat4::from(view_from_object)
}

/// A rigid transform that stands at `eye` and looks at `target`; `+Y` is up unless that is the view axis.
pub fn look_at(eye: DVec3, target: DVec3) -> DAffine3 {
    let forward = (target - eye).try_normalize().unwrap_or(DVec3::NEG_Z);
    look_along(eye, forward)
}

/// A rigid transform that stands at `eye` and looks along the unit vector `forward`.
pub fn look_along(eye: DVec3, forward: DVec3) -> DAffine3 {
    let up = if forward.y.abs() > 0.999 { DVec3::NEG_Z } else { DVec3::Y };
    let right = forward.cross(up).normalize();
    DAffine3 { matrix3: glam::DMat3::from_cols(right, right.cross(forward), -forward), translation: eye }
}
