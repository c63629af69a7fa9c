//! Views: the caller's camera and light, in `f64`.
//!
//! World space is right-handed. As in glTF, a view looks along its own `-Z` and `+Y` is up. Matrices are
//! column-major. They stay in `f64` until they have been composed *relative to the camera*, and only then are rounded
//! to the `f32` that the GPU gets. A scene 1e6 units from the origin therefore keeps its precision (see
//! [`crate::Inputs`]).

use glam::{DAffine3, DMat3, DMat4, DVec2, DVec3, dvec3};
use std::f64::consts::PI;

/// Direction in which depth values grow.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub enum DepthRange {
    /// 0 at the near plane, 1 at the far plane; a cleared pixel holds 1.
    Standard,
    /// 1 at the near plane, 0 at the far plane, which may be infinitely far; a cleared pixel holds 0.
    #[default]
    Reversed,
}

/// A camera: its position, orientation and projection.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CameraView {
    /// Rigid transform from the camera's own space to the world.
    pub world_from_view: DAffine3,
    /// Projection to Vulkan's clip space, up to a positive factor: `x, y` in `[-w, w]` with **y down**, `z` in `[0,
    /// w]`.
    pub clip_from_view: DMat4,
    /// Depth range of the depth buffer made with this projection.
    pub depth: DepthRange,
}

impl CameraView {
    /// Perspective projection with reversed Z and an infinitely far plane: the project's own convention.
    ///
    /// `fov_y` is the full vertical angle in radians, `aspect` the image's width divided by its height, `near` the
    /// distance of the near plane in world units.
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

    /// Parallel projection with reversed Z. `half` holds the half width and half height; these and the planes'
    /// distances are in world units.
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

    /// Position of the camera in world space.
    pub fn position(&self) -> DVec3 {
        self.world_from_view.translation
    }

    /// Returns an error that names what is wrong with the matrices and how to fix it.
    pub(crate) fn check(&self) -> Result<(), String> {
        check_matrices(&self.world_from_view, &self.clip_from_view, self.depth)
    }

    /// True for a parallel projection.
    pub fn is_orthographic(&self) -> bool {
        self.clip_from_view.row(3).truncate() == DVec3::ZERO
    }

    /// Transform from an object's space to this view's clip space; see [`clip_from_object`].
    pub(crate) fn clip_from_object(&self, world_from_object: &DAffine3) -> DMat4 {
        clip_from_object(&self.world_from_view, self.clip_from_view, world_from_object)
    }

    /// World-space ray through a point of the image: its origin and unit direction.
    ///
    /// `ndc` is the point, `x` to the right and `y` down, both in `[-1, 1]`. The centre of pixel `(i, j)` of a `w x
    /// h` image is `((2i + 1)/w - 1, (2j + 1)/h - 1)`. The ray starts at the eye, or on the near plane for a parallel
    /// projection.
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

/// Kind and size of the light that casts the shadow.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum LightKind {
    /// A point or spot light. `size` describes the square area light that it stands for, which is centred on the
    /// light and faces along its view axis; 0 means a point.
    Spot {
        /// Full width of the square light in world units.
        size: f64,
    },
    /// A directional light (the sun). `angle` is its full angular width; 0 means parallel rays.
    Directional {
        /// Full angular width in radians.
        angle: f64,
    },
}

/// The view that the shadow map was rendered from.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LightView {
    /// Rigid transform from the light's own space to the world; the light shines along its `-Z`.
    pub world_from_view: DAffine3,
    /// Projection of the shadow map to Vulkan's clip space (y down): perspective for a spot light, parallel for a
    /// directional light.
    pub clip_from_view: DMat4,
    /// Depth range of the shadow map made with this projection. Only [`DepthRange::Standard`], 0 near to 1 far, is
    /// supported; [`DepthRange::Reversed`] is rejected.
    pub depth: DepthRange,
    /// Kind and size of the light.
    pub kind: LightKind,
}

impl LightView {
    /// A spot light with a square frustum. `fov` is the frustum's full angle in radians; `near`, `far` and `size` are
    /// in world units.
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

    /// A directional light over a box. The box's half extents and planes are in world units, measured from the origin
    /// of `world_from_view`; `angle` is in radians.
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

    /// Transform from an object's space to this view's clip space; see [`clip_from_object`].
    pub(crate) fn clip_from_object(&self, world_from_object: &DAffine3) -> DMat4 {
        clip_from_object(&self.world_from_view, self.clip_from_view, world_from_object)
    }

    /// Returns an error that names what is wrong with the matrices, the kind or the size, and how to fix it.
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
                "clip_from_view is {scale} times a projection: divide it by this factor, so that w is the distance"
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
                format!("the size {size} is not possible: it must be 0 (a point) or more world units")
            }
            LightKind::Directional { angle } if !(0.0..PI).contains(&angle) => {
                format!(
                    "the angle {angle} is not possible: it must be 0 (parallel rays) or more and less than pi radians"
                )
            }
            _ => return Ok(()),
        };
        Err(problem)
    }

    /// True for a directional light.
    pub fn is_directional(&self) -> bool {
        matches!(self.kind, LightKind::Directional { .. })
    }

    /// Position of a spot light in world space; for a directional light, the origin of its view.
    pub fn position(&self) -> DVec3 {
        self.world_from_view.translation
    }

    /// Unit vector along which the light shines.
    pub fn direction(&self) -> DVec3 {
        self.world_from_view.transform_vector3(dvec3(0.0, 0.0, -1.0))
    }

    /// Unit vector from a point in world space towards the centre of the light.
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

/// True if depth depends on more than the distance along the axis, as with an oblique near plane.
fn is_tilted(clip_from_view: &DMat4) -> bool {
    clip_from_view.row(2).truncate().truncate() != DVec2::ZERO
}

/// Largest deviation of a rigid transform's axes from unit length and from right angles. At 1e-4 a shadow moves by a
/// tenth of a texel in a map of 1024 x 1024 texels.
const RIGID: f64 = 1e-4;

/// Returns an error that names what is wrong with a view's matrices and how to fix it.
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
    // The GPU gets both the matrix and its inverse in single precision.
    if m.determinant() == 0.0 || !m.as_mat4().is_finite() || !m.inverse().as_mat4().is_finite() {
        return Err(
            "clip_from_view has no inverse: a projection needs extents other than 0, and near and far planes that \
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
    // Sign of the slope of depth(d) = (z_w - z_z d) / (w_w - w_z d), where d is the distance along -Z.
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

/// Transform from an object's space to a view's clip space. Subtracts positions before it multiplies anything, which
/// keeps the precision far from the origin.
fn clip_from_object(world_from_view: &DAffine3, clip_from_view: DMat4, world_from_object: &DAffine3) -> DMat4 {
    let rotation = world_from_view.matrix3.transpose();
    let view_from_object = DAffine3 {
        matrix3: rotation * world_from_object.matrix3,
        translation: rotation * (world_from_object.translation - world_from_view.translation),
    };
    clip_from_view * DMat4::from(view_from_object)
}

/// Rigid transform of a view at `eye` that looks at `target`. `+Y` is up unless it is the view axis.
pub fn look_at(eye: DVec3, target: DVec3) -> DAffine3 {
    let forward = (target - eye).try_normalize().unwrap_or(DVec3::NEG_Z);
    look_along(eye, forward)
}

/// Rigid transform of a view at `eye` that looks along the unit vector `forward`.
pub fn look_along(eye: DVec3, forward: DVec3) -> DAffine3 {
    let up = if forward.y.abs() > 0.999 { DVec3::NEG_Z } else { DVec3::Y };
    let right = forward.cross(up).normalize();
    DAffine3 { matrix3: glam::DMat3::from_cols(right, right.cross(forward), -forward), translation: eye }
}
