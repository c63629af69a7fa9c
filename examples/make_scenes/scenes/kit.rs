//! Tools for all generators: trigonometry that gives the same bits on every platform, seeded random numbers,
//! placements, and the stage on which a scene is built.
//!
//! The platforms' own `sin` and `pow` differ in the last bit, so everything here uses the `libm` crate. `sqrt` and
//! plain arithmetic are exact by IEEE 754.

use super::mesh_builder::MeshBuilder;
use edgeshade::scene::{Camera, Instance, Light, LightShape, Material, Projection, Scene, Texture};
use glam::{DAffine3, DMat3, DVec3, dvec3};

pub(super) use std::f64::consts::{PI, TAU};

pub(super) fn sin(x: f64) -> f64 {
    libm::sin(x)
}

pub(super) fn cos(x: f64) -> f64 {
    libm::cos(x)
}

/// Cosine and sine of an angle in radians.
pub(super) fn circle(angle: f64) -> (f64, f64) {
    (cos(angle), sin(angle))
}

/// Rotation about an axis by the right-hand rule; the angle is in radians.
pub(super) fn rotation(axis: DVec3, angle: f64) -> DMat3 {
    let (c, s) = circle(angle);
    let a = axis.normalize();
    DMat3::from_cols(
        turned(DVec3::X, a, c, s), //
        turned(DVec3::Y, a, c, s),
        turned(DVec3::Z, a, c, s),
    )
}

/// Rotates a vector about an axis by Rodrigues' formula, given cosine and sine of the angle.
fn turned(v: DVec3, axis: DVec3, c: f64, s: f64) -> DVec3 {
    v * c + axis.cross(v) * s + axis * (axis.dot(v) * (1.0 - c))
}

pub(super) fn at(x: f64, y: f64, z: f64) -> DAffine3 {
    DAffine3::from_translation(dvec3(x, y, z))
}

pub(super) fn rot_x(angle: f64) -> DAffine3 {
    DAffine3::from_mat3(rotation(DVec3::X, angle))
}

pub(super) fn rot_y(angle: f64) -> DAffine3 {
    DAffine3::from_mat3(rotation(DVec3::Y, angle))
}

pub(super) fn rot_z(angle: f64) -> DAffine3 {
    DAffine3::from_mat3(rotation(DVec3::Z, angle))
}

pub(super) fn scaled(s: f64) -> DAffine3 {
    DAffine3::from_scale(DVec3::splat(s))
}

/// Smallest rotation that turns `+Y` into `direction`.
pub(super) fn align_y(direction: DVec3) -> DAffine3 {
    let d = direction.normalize();
    let z = if d.x.abs() < 0.9 { d.cross(DVec3::X) } else { d.cross(DVec3::Z) }.normalize();
    let x = d.cross(z);
    DAffine3::from_mat3(DMat3::from_cols(x, d, z))
}

/// Frame of a viewer at `eye` who looks at `target` along its own `-Z`.
pub(super) fn look_at(eye: DVec3, target: DVec3) -> DAffine3 {
    let z = (eye - target).normalize();
    let up = if z.y.abs() > 0.999 { DVec3::X } else { DVec3::Y };
    let x = up.cross(z).normalize();
    DAffine3 { matrix3: DMat3::from_cols(x, z.cross(x), z), translation: eye }
}

/// 0 below `a`, 1 above `b`, smooth in between.
pub(super) fn smoothstep(a: f64, b: f64, x: f64) -> f64 {
    let t = ((x - a) / (b - a)).clamp(0.0, 1.0);
    t * t * (3.0 - 2.0 * t)
}

/// A seeded generator of random numbers (splitmix64), the same on every platform.
pub(super) struct Rng(pub u64);

impl Rng {
    pub fn next(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        z ^ (z >> 31)
    }

    /// Uniform in `[a, b)`.
    pub fn range(&mut self, a: f64, b: f64) -> f64 {
        a + (b - a) * ((self.next() >> 11) as f64 / (1u64 << 53) as f64)
    }

    /// Uniform in `[-a, a)`.
    pub fn spread(&mut self, a: f64) -> f64 {
        self.range(-a, a)
    }

    /// Uniform in `0..n`.
    pub fn below(&mut self, n: usize) -> usize {
        (self.range(0.0, n as f64) as usize).min(n.saturating_sub(1))
    }
}

/// Converts sRGB `0xrrggbb` to linear RGB.
pub(super) fn linear(hex: u32) -> [f32; 3] {
    [16, 8, 0].map(|shift| {
        let c = f64::from(hex >> shift & 0xff) / 255.0;
        (if c <= 0.04045 { c / 12.92 } else { libm::pow((c + 0.055) / 1.055, 2.4) }) as f32
    })
}

/// A scene under construction.
pub(super) struct Stage {
    pub scene: Scene,
}

impl Stage {
    pub fn new(name: &str) -> Self {
        Self { scene: Scene { name: name.into(), ..Scene::default() } }
    }

    /// Adds a material of one sRGB colour.
    pub fn paint(&mut self, name: &str, hex: u32) -> usize {
        self.material(name, hex, None, None)
    }

    /// Adds a material whose texture is multiplied by an sRGB colour.
    pub fn textured(&mut self, name: &str, hex: u32, texture: usize) -> usize {
        self.material(name, hex, Some(texture), None)
    }

    /// Adds a double-sided, alpha-masked material.
    pub fn leaves(&mut self, name: &str, hex: u32, texture: usize) -> usize {
        self.material(name, hex, Some(texture), Some(0.5))
    }

    fn material(&mut self, name: &str, hex: u32, texture: Option<usize>, alpha_cutoff: Option<f32>) -> usize {
        let [r, g, b] = linear(hex);
        self.scene.materials.push(Material {
            name: name.into(),
            base_color: [r, g, b, 1.0],
            texture,
            alpha_cutoff,
            double_sided: alpha_cutoff.is_some(),
        });
        self.scene.materials.len() - 1
    }

    /// Makes a material visible from both sides, for open surfaces.
    pub fn both_sides(&mut self, material: usize) {
        self.scene.materials[material].double_sided = true;
    }

    pub fn texture(&mut self, texture: Texture) -> usize {
        self.scene.textures.push(texture);
        self.scene.textures.len() - 1
    }

    /// Adds a mesh that is placed later.
    pub fn mesh(&mut self, name: &str, shape: &MeshBuilder, material: usize) -> usize {
        let textured = self.scene.materials[material].texture.is_some();
        self.scene.meshes.push(shape.build(name, material, textured));
        self.scene.meshes.len() - 1
    }

    pub fn place(&mut self, mesh: usize, world_from_object: DAffine3) {
        self.scene.instances.push(Instance { mesh, world_from_object });
    }

    /// Adds a mesh and places it where it was built.
    pub fn add(&mut self, name: &str, shape: &MeshBuilder, material: usize) {
        let mesh = self.mesh(name, shape, material);
        self.place(mesh, DAffine3::IDENTITY);
    }

    /// Sets a camera at `eye`; `fov_y` is the full vertical angle in degrees.
    pub fn camera(&mut self, eye: [f64; 3], target: [f64; 3], fov_y: f64) {
        self.scene.cameras.push(Camera {
            name: "camera".into(),
            world_from_camera: look_at(eye.into(), target.into()),
            projection: Projection::Perspective { fov_y: fov_y.to_radians(), near: 0.1 },
        });
    }

    /// Sets a spot light; `outer` is the half angle in degrees, `size` the width of its square in metres.
    pub fn spot(&mut self, eye: [f64; 3], target: [f64; 3], outer: f64, size: f64, hex: u32) {
        let shape = LightShape::Spot { outer: outer.to_radians(), size: Some(size) };
        self.light("lamp", look_at(eye.into(), target.into()), shape, hex);
    }

    /// Sets a sun; `turn` is its azimuth from `+Z` towards `+X` and `elevation` its height, both in degrees; `angle` is its
    /// full angular width in radians.
    pub fn sun(&mut self, target: [f64; 3], turn: f64, elevation: f64, angle: f64, hex: u32) {
        let (c, s) = circle(elevation.to_radians());
        let (tc, ts) = circle(turn.to_radians());
        let target = DVec3::from(target);
        let eye = target + 20.0 * dvec3(c * ts, s, c * tc);
        self.light("sun", look_at(eye, target), LightShape::Directional { angle: Some(angle) }, hex);
    }

    fn light(&mut self, name: &str, world_from_light: DAffine3, shape: LightShape, hex: u32) {
        self.scene.lights.push(Light { name: name.into(), world_from_light, shape, color: linear(hex) });
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rotations_follow_the_right_hand() {
        let close = |a: DVec3, b: DVec3| a.abs_diff_eq(b, 1e-12);
        assert!(close(rot_y(0.5 * PI).transform_vector3(DVec3::Z), DVec3::X));
        assert!(close(rot_x(0.5 * PI).transform_vector3(DVec3::Y), DVec3::Z));
        assert!(close(rot_z(0.5 * PI).transform_vector3(DVec3::X), DVec3::Y));
        let d = dvec3(0.3, -0.8, 0.5).normalize();
        let m: DMat3 = align_y(d).matrix3;
        assert!(close(m * DVec3::Y, d) && (m.determinant() - 1.0).abs() < 1e-12);
    }

    #[test]
    fn the_viewer_looks_at_the_target() {
        let (eye, target) = (dvec3(1.0, 2.0, 3.0), dvec3(-1.0, 0.5, 0.0));
        let view = look_at(eye, target);
        assert!(view.transform_vector3(DVec3::NEG_Z).abs_diff_eq((target - eye).normalize(), 1e-12));
        assert!(view.transform_vector3(DVec3::Y).y > 0.0);
    }

    #[test]
    fn random_numbers_are_the_published_sequence() {
        // Reference values of splitmix64 for the seed 1234567.
        let mut rng = Rng(1_234_567);
        assert_eq!(rng.next(), 6_457_827_717_110_365_317);
        assert_eq!(rng.next(), 3_203_168_211_198_807_973);
        assert!((0..1000).all(|_| (2.0..3.0).contains(&rng.range(2.0, 3.0)) && rng.below(3) < 3));
    }
}
