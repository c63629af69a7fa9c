//! A scene in memory: what a glTF file holds of it that shadows need, and nothing of Vulkan.

use crate::view::CameraView;
use glam::{DAffine3, DVec3, Vec3};

/// Triangles, materials, where they stand, and who looks and shines.
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
    /// What stands where.
    pub instances: Vec<Instance>,
    /// Cameras of the file in file order (none if it has none: see [`crate::scene::fit`]).
    pub cameras: Vec<Camera>,
    /// Lights of the file in file order (none if it has none: see [`crate::scene::fit`]).
    pub lights: Vec<Light>,
    /// Cameras of the file that cannot be used, in file order.
    pub broken_cameras: Vec<Broken>,
    /// Lights of the file that cannot be used, in file order.
    pub broken_lights: Vec<Broken>,
    /// What was dropped or approximated on loading, one sentence each.
    pub warnings: Vec<String>,
}

/// An indexed triangle list in object space. Every array of vertices has the same length, every
/// index is below it, every position is finite.
#[derive(Clone, Debug, Default)]
pub struct Mesh {
    /// For error messages and debug labels.
    pub name: String,
    /// Object-space positions.
    pub positions: Vec<[f32; 3]>,
    /// Unit normals.
    pub normals: Vec<[f32; 3]>,
    /// Base-colour texture coordinates, `KHR_texture_transform` already applied.
    pub uvs: Vec<[f32; 2]>,
    /// Linear vertex colours, or empty for white.
    pub colors: Vec<[f32; 4]>,
    /// Three indices a triangle.
    pub indices: Vec<u32>,
    /// Index into [`Scene::materials`].
    pub material: usize,
    /// Bounds of the positions that a triangle uses, object space.
    pub bounds: Bounds,
}

/// How a surface looks and whether light passes through its holes.
#[derive(Clone, Debug)]
pub struct Material {
    /// For error messages and debug labels.
    pub name: String,
    /// Linear RGB factor and alpha factor.
    pub base_color: [f32; 4],
    /// Index into [`Scene::textures`].
    pub texture: Option<usize>,
    /// `Some(cutoff)` for alpha mode MASK: a texel whose alpha is below the cutoff is a hole.
    pub alpha_cutoff: Option<f32>,
    /// Visible from both sides.
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

/// What becomes of alpha-masked surfaces.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Masked {
    /// Light passes their holes.
    #[default]
    Keep,
    /// They are left out.
    Exclude,
    /// Their holes are closed.
    Solid,
}

/// How texture coordinates outside `[0, 1]` are read.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub enum Wrap {
    /// The image repeats.
    #[default]
    Repeat,
    /// The image repeats, every other time mirrored.
    MirroredRepeat,
    /// The border texel goes on.
    ClampToEdge,
}

/// An image with its sampler: 8-bit sRGB colour, linear alpha, rows from top to bottom.
#[derive(Clone, Debug, Default)]
pub struct Texture {
    /// For error messages and debug labels.
    pub name: String,
    /// Texels, at least 1 x 1.
    pub size: [u32; 2],
    /// `size[0] * size[1]` texels, RGBA.
    pub rgba: Vec<[u8; 4]>,
    /// Wrap modes of u and v.
    pub wrap: [Wrap; 2],
    /// True for nearest magnification.
    pub nearest: bool,
}

/// A mesh placed in the world.
#[derive(Clone, Copy, Debug)]
pub struct Instance {
    /// Index into [`Scene::meshes`].
    pub mesh: usize,
    /// Any affine transform: negative and non-uniform scale included.
    pub world_from_object: DAffine3,
}

/// A camera of the file.
#[derive(Clone, Debug)]
pub struct Camera {
    /// Name of the camera, or of its node.
    pub name: String,
    /// Rigid (scale removed).
    pub world_from_camera: DAffine3,
    /// How it projects.
    pub projection: Projection,
}

/// A camera or light of the file that cannot be used. Others of the file can.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Broken {
    /// Number of sound ones of its kind before it in the file.
    pub number: usize,
    /// Its name, or that of its node.
    pub name: String,
    /// Its place in the file: `cameras[1].perspective.znear`.
    pub place: String,
    /// Description of the fault, and of what would be right.
    pub problem: String,
}

/// Projection of a [`Camera`]; the aspect ratio is the image's.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Projection {
    /// Full vertical angle in radians; near plane in world units. The far plane is infinite.
    Perspective {
        /// Full vertical angle, radians.
        fov_y: f64,
        /// Near plane, world units.
        near: f64,
    },
    /// Half height and planes in world units; the half width follows from the aspect ratio.
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
    /// The view for an image of the given size.
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

/// A light of the file.
#[derive(Clone, Debug)]
pub struct Light {
    /// Name of the light, or of its node.
    pub name: String,
    /// Rigid (scale removed); it shines along its own `-Z`.
    pub world_from_light: DAffine3,
    /// Spot or directional.
    pub shape: LightShape,
    /// Linear RGB, without intensity: the picture's exposure is set by the renderer.
    pub color: [f32; 3],
}

/// What a [`Light`] lights, and how large it is.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum LightShape {
    /// A cone; `outer` is the half angle in radians. `size` is the full width of the square area
    /// light in world units, `None` where the file does not say (glTF has no such field; we read and
    /// write `extras.edgeshade.size`).
    Spot {
        /// Half angle at which the light ends, radians.
        outer: f64,
        /// Full width of the square light, world units.
        size: Option<f64>,
    },
    /// Parallel rays; `angle` is the full angular width in radians (`extras.edgeshade.angle`).
    Directional {
        /// Full angular width, radians.
        angle: Option<f64>,
    },
}

/// An axis-aligned box; empty where `min > max`.
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
    /// The box of nothing.
    pub const EMPTY: Self = Self { min: DVec3::INFINITY, max: DVec3::NEG_INFINITY };

    /// True if the box holds no point.
    pub fn is_empty(&self) -> bool {
        !(self.min.cmple(self.max).all())
    }

    /// The smallest box with `p` in it.
    pub fn include(&mut self, p: DVec3) {
        self.min = self.min.min(p);
        self.max = self.max.max(p);
    }

    /// The smallest box around both.
    pub fn union(self, other: Self) -> Self {
        Self { min: self.min.min(other.min), max: self.max.max(other.max) }
    }

    /// Middle of the box; the origin if it is empty.
    pub fn center(&self) -> DVec3 {
        if self.is_empty() { DVec3::ZERO } else { 0.5 * (self.min + self.max) }
    }

    /// Half the diagonal; 0 if the box is empty.
    pub fn radius(&self) -> f64 {
        if self.is_empty() { 0.0 } else { 0.5 * (self.max - self.min).length() }
    }

    /// The eight corners.
    pub fn corners(&self) -> [DVec3; 8] {
        std::array::from_fn(|i| {
            let pick = |bit: usize, axis: usize| if i >> bit & 1 == 1 { self.max[axis] } else { self.min[axis] };
            DVec3::new(pick(0, 0), pick(1, 1), pick(2, 2))
        })
    }

    /// The box around this box after an affine transform; exact about emptiness.
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
    /// Number of triangles.
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
    /// Bounds of one instance in the world.
    pub fn instance_bounds(&self, instance: &Instance) -> Bounds {
        self.meshes[instance.mesh].bounds.transformed(&instance.world_from_object)
    }

    /// Bounds of everything in the world.
    pub fn bounds(&self) -> Bounds {
        self.instances.iter().fold(Bounds::EMPTY, |b, i| b.union(self.instance_bounds(i)))
    }

    /// Number of triangles, instances counted.
    pub fn triangles(&self) -> usize {
        self.instances.iter().map(|i| self.meshes[i.mesh].triangles()).sum()
    }

    /// Makes alpha-masked surfaces solid, or takes the instances that have one out, for comparing techniques that cannot
    /// cut shadows by a mask: their masked casters then err in no one's figures.
    pub fn set_masked(&mut self, masked: Masked) {
        let Self { meshes, materials, instances, .. } = self;
        match masked {
            Masked::Keep => {}
            Masked::Solid => materials.iter_mut().for_each(|m| m.alpha_cutoff = None),
            Masked::Exclude => instances.retain(|i| materials[meshes[i.mesh].material].alpha_cutoff.is_none()),
        }
    }

    /// Moves and scales the whole scene, cameras and lights along with it (`t` must scale uniformly).
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
