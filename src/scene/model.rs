//! Scene in memory: the parts of a glTF file that shadows need, without Vulkan.

use crate::view::CameraView;
use glam::{DAffine3, DVec3, Vec3};

/// Scene: meshes, materials, instances, cameras and lights.
#[derive(Clone, Debug, Default)]
pub struct Scene {
    /// Name of the shipped scene, or the file's stem.
    pub name: String,
    /// Triangle meshes in their own space; an instance places one.
    pub meshes: Vec<Mesh>,
    /// Materials, at least one as soon as there is a mesh.
    pub materials: Vec<Material>,
    /// Decoded base-colour images.
    pub textures: Vec<Texture>,
    /// Placed meshes.
    pub instances: Vec<Instance>,
    /// Cameras of the file in file order (none if it has none: see [`crate::scene::fit`]).
    pub cameras: Vec<Camera>,
    /// Lights of the file in file order (none if it has none: see [`crate::scene::fit`]).
    pub lights: Vec<Light>,
    /// Cameras of the file that cannot be used, in file order.
    pub broken_cameras: Vec<Broken>,
    /// Lights of the file that cannot be used, in file order.
    pub broken_lights: Vec<Broken>,
    /// Descriptions of what was dropped or approximated on loading, one sentence each.
    pub warnings: Vec<String>,
}

/// Indexed triangle list in object space. Every array of vertices is empty or has the same length, every index is
/// below it, and every position is finite.
#[derive(Clone, Debug, Default)]
pub struct Mesh {
    /// Name for error messages and debug labels.
    pub name: String,
    /// Object-space positions.
    pub positions: Vec<[f32; 3]>,
    /// Unit normals.
    pub normals: Vec<[f32; 3]>,
    /// Base-colour texture coordinates, `KHR_texture_transform` already applied.
    pub uvs: Vec<[f32; 2]>,
    /// Linear vertex colours, or empty for white.
    pub colors: Vec<[f32; 4]>,
    /// Three indices per triangle.
    pub indices: Vec<u32>,
    /// Index into [`Scene::materials`].
    pub material: usize,
    /// Bounds of the positions that a triangle uses, object space.
    pub bounds: Bounds,
}

/// Appearance of a surface, and whether light passes through its holes.
#[derive(Clone, Debug)]
pub struct Material {
    /// Name for error messages and debug labels.
    pub name: String,
    /// Linear RGB factor and alpha factor.
    pub base_color: [f32; 4],
    /// Index into [`Scene::textures`].
    pub texture: Option<usize>,
    /// `Some(cutoff)` for alpha mode MASK: a texel whose alpha is below the cutoff is a hole.
    pub alpha_cutoff: Option<f32>,
    /// `true` if the surface is visible from both sides.
    pub double_sided: bool,
}

impl Default for Material {
    fn default() -> Self {
        Self {
            name: "default".into(),
            base_color: [0.8, 0.8, 0.8, 1.0],
            texture: None,
            alpha_cutoff: None,
            double_sided: false,
        }
    }
}

/// Treatment of alpha-masked surfaces.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Masked {
    /// Light passes through their holes.
    #[default]
    Keep,
    /// They are left out.
    Exclude,
    /// Their holes are closed.
    Solid,
}

/// Mode of reading texture coordinates outside `[0, 1]`.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub enum Wrap {
    /// The image repeats.
    #[default]
    Repeat,
    /// The image repeats, with every other copy mirrored.
    MirroredRepeat,
    /// The border texels repeat.
    ClampToEdge,
}

/// Image with its sampler: 8-bit sRGB colour, linear alpha, rows from top to bottom.
#[derive(Clone, Debug, Default)]
pub struct Texture {
    /// Name for error messages and debug labels.
    pub name: String,
    /// Width and height in texels, at least 1 x 1.
    pub size: [u32; 2],
    /// `size[0] * size[1]` texels, RGBA.
    pub rgba: Vec<[u8; 4]>,
    /// Wrap modes of u and v.
    pub wrap: [Wrap; 2],
    /// `true` for nearest magnification, `false` for linear.
    pub nearest: bool,
}

/// Mesh placed in the world.
#[derive(Clone, Copy, Debug)]
pub struct Instance {
    /// Index into [`Scene::meshes`].
    pub mesh: usize,
    /// Any affine transform, including negative and non-uniform scale.
    pub world_from_object: DAffine3,
}

/// Camera of the file.
#[derive(Clone, Debug)]
pub struct Camera {
    /// Name of the camera, or of its node.
    pub name: String,
    /// Rigid transform (scale removed).
    pub world_from_camera: DAffine3,
    /// Projection of the camera.
    pub projection: Projection,
}

/// Camera or light of the file that cannot be used; others of the file can.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Broken {
    /// Number of usable ones of its kind before it in the file.
    pub number: usize,
    /// Name of the camera or light, or of its node.
    pub name: String,
    /// Place in the file, such as `cameras[1].perspective.znear`.
    pub place: String,
    /// Description of the fault, and of what would be right.
    pub problem: String,
}

/// Projection of a [`Camera`]; the aspect ratio is the image's.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Projection {
    /// Perspective projection; the far plane is infinite.
    Perspective {
        /// Full vertical angle, radians.
        fov_y: f64,
        /// Near plane, world units.
        near: f64,
    },
    /// Parallel projection; the half width follows from the aspect ratio.
    Orthographic {
        /// Half the height of the view, world units.
        half_height: f64,
        /// Near plane, world units.
        near: f64,
        /// Far plane, world units.
        far: f64,
    },
}

impl Camera {
    /// Returns the view for an image of the given size.
    pub fn view(&self, size: [u32; 2]) -> CameraView {
        let aspect = f64::from(size[0].max(1)) / f64::from(size[1].max(1));
        match self.projection {
            Projection::Perspective { fov_y, near } => {
                CameraView::perspective(self.world_from_camera, fov_y, aspect, near)
            }
            Projection::Orthographic { half_height, near, far } => {
                CameraView::orthographic(self.world_from_camera, [half_height * aspect, half_height], near, far)
            }
        }
    }
}

/// Light of the file.
#[derive(Clone, Debug)]
pub struct Light {
    /// Name of the light, or of its node.
    pub name: String,
    /// Rigid transform (scale removed); the light shines along its own `-Z`.
    pub world_from_light: DAffine3,
    /// Shape: spot or directional.
    pub shape: LightShape,
    /// Linear RGB without intensity; the renderer sets the picture's exposure.
    pub color: [f32; 3],
}

/// Shape and size of a [`Light`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum LightShape {
    /// Cone with a square area light. glTF has no field for the size; it is read from and written to
    /// `extras.edgeshade.size`.
    Spot {
        /// Half angle at which the light ends, radians.
        outer: f64,
        /// Full width of the square light, world units; `None` if the file does not give one.
        size: Option<f64>,
    },
    /// Parallel rays. The angle is read from and written to `extras.edgeshade.angle`.
    Directional {
        /// Full angular width, radians; `None` if the file does not give one.
        angle: Option<f64>,
    },
}

/// Axis-aligned box; empty if `min > max`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Bounds {
    /// Smallest corner.
    pub min: DVec3,
    /// Largest corner.
    pub max: DVec3,
}

impl Default for Bounds {
    fn default() -> Self {
        Self::EMPTY
    }
}

impl Bounds {
    /// Empty box.
    pub const EMPTY: Self = Self { min: DVec3::INFINITY, max: DVec3::NEG_INFINITY };

    /// Returns whether the box contains no point.
    pub fn is_empty(&self) -> bool {
        !(self.min.cmple(self.max).all())
    }

    /// Enlarges the box to contain `p`.
    pub fn include(&mut self, p: DVec3) {
        self.min = self.min.min(p);
        self.max = self.max.max(p);
    }

    /// Returns the smallest box around both.
    pub fn union(self, other: Self) -> Self {
        Self { min: self.min.min(other.min), max: self.max.max(other.max) }
    }

    /// Returns the middle of the box; the origin if it is empty.
    pub fn center(&self) -> DVec3 {
        if self.is_empty() { DVec3::ZERO } else { 0.5 * (self.min + self.max) }
    }

    /// Returns half the diagonal; 0 if the box is empty.
    pub fn radius(&self) -> f64 {
        if self.is_empty() { 0.0 } else { 0.5 * (self.max - self.min).length() }
    }

    /// Returns the eight corners.
    pub fn corners(&self) -> [DVec3; 8] {
        std::array::from_fn(|i| {
            let pick = |bit: usize, axis: usize| if i >> bit & 1 == 1 { self.max[axis] } else { self.min[axis] };
            DVec3::new(pick(0, 0), pick(1, 1), pick(2, 2))
        })
    }

    /// Returns the box around this box after an affine transform; an empty box stays empty.
    pub fn transformed(&self, t: &DAffine3) -> Self {
        if self.is_empty() {
            return Self::EMPTY;
        }
        let mut out = Self::EMPTY;
        for c in self.corners() {
            out.include(t.transform_point3(c));
        }
        out
    }
}

impl Mesh {
    /// Returns the number of triangles.
    pub fn triangles(&self) -> usize {
        self.indices.len() / 3
    }

    /// Computes [`Mesh::bounds`] from the positions that the triangles use.
    pub fn compute_bounds(&mut self) {
        self.bounds = Bounds::EMPTY;
        for &i in &self.indices {
            self.bounds.include(Vec3::from(self.positions[i as usize]).as_dvec3());
        }
    }
}

impl Scene {
    /// Returns the bounds of one instance in the world.
    pub fn instance_bounds(&self, instance: &Instance) -> Bounds {
        self.meshes[instance.mesh].bounds.transformed(&instance.world_from_object)
    }

    /// Returns the bounds of everything in the world.
    pub fn bounds(&self) -> Bounds {
        self.instances.iter().fold(Bounds::EMPTY, |b, i| b.union(self.instance_bounds(i)))
    }

    /// Returns the number of triangles over all instances.
    pub fn triangles(&self) -> usize {
        self.instances.iter().map(|i| self.meshes[i.mesh].triangles()).sum()
    }

    /// Makes alpha-masked surfaces solid, or removes the instances that have one. Use it to compare techniques that
    /// cannot cut shadows by a mask, so that masked casters do not affect their figures.
    pub fn set_masked(&mut self, masked: Masked) {
        let Self { meshes, materials, instances, .. } = self;
        match masked {
            Masked::Keep => {}
            Masked::Solid => materials.iter_mut().for_each(|m| m.alpha_cutoff = None),
            Masked::Exclude => instances.retain(|i| materials[meshes[i.mesh].material].alpha_cutoff.is_none()),
        }
    }

    /// Moves and scales the whole scene with its cameras and lights; `t` must scale uniformly.
    ///
    /// Near planes, parallel views and light sizes scale too, so the picture stays the same.
    pub fn transform(&mut self, t: &DAffine3) {
        let scale = t.matrix3.determinant().abs().cbrt();
        let rigid = |m: &DAffine3| {
            let moved = *t * *m;
            DAffine3 { matrix3: moved.matrix3 * (1.0 / scale), translation: moved.translation }
        };
        for i in &mut self.instances {
            i.world_from_object = *t * i.world_from_object;
        }
        for c in &mut self.cameras {
            c.world_from_camera = rigid(&c.world_from_camera);
            match &mut c.projection {
                Projection::Perspective { near, .. } => *near *= scale,
                Projection::Orthographic { half_height, near, far } => {
                    *half_height *= scale;
                    *near *= scale;
                    *far *= scale;
                }
            }
        }
        for l in &mut self.lights {
            l.world_from_light = rigid(&l.world_from_light);
            if let LightShape::Spot { size: Some(size), .. } = &mut l.shape {
                *size *= scale;
            }
        }
    }
}
