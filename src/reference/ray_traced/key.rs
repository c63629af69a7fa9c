//! Hash of everything that a truth depends on.

use super::fixed_penumbra::FixedPenumbraSettings;
use super::soft::SoftSettings;
use crate::scene::{Material, Mesh, Scene, Wrap};
use crate::view::{CameraView, DepthRange, LightKind, LightView};
use glam::{DAffine3, DMat4};

/// Version of the tracer. Raise it whenever results change, so that old cache files no longer match.
const TRACER_VERSION: u32 = 1;

/// Method that computes the visibility.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Method {
    /// [`super::hard`].
    Hard,
    /// [`super::soft`].
    Soft(SoftSettings),
    /// [`super::fixed_penumbra()`].
    FixedPenumbra(FixedPenumbraSettings),
}

/// Hash of everything that a [`super::Truth`] depends on.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct CacheKey(pub [u8; 32]);

/// Returns the key of a truth: BLAKE3 over the geometry, alpha test and culling, instances, camera, light, image size,
/// method and the tracer's version. Names and colours do not matter, nor do alpha values of unmasked materials.
pub fn cache_key(scene: &Scene, camera: &CameraView, light: &LightView, size: [u32; 2], method: &Method) -> CacheKey {
    let mut k = Hasher(blake3::Hasher::new());
    k.bytes(b"edgeshade truth");
    k.u64(TRACER_VERSION.into());
    k.u64(scene.meshes.len() as u64);
    for mesh in &scene.meshes {
        k.mesh(scene, mesh);
    }
    k.u64(scene.instances.len() as u64);
    for instance in &scene.instances {
        k.u64(instance.mesh as u64);
        k.affine(&instance.world_from_object);
    }
    k.affine(&camera.world_from_view);
    k.matrix(&camera.clip_from_view);
    k.u64((camera.depth == DepthRange::Reversed).into());
    k.affine(&light.world_from_view);
    k.matrix(&light.clip_from_view);
    let is_soft = matches!(method, Method::Soft(_));
    match light.kind {
        // Hard shadows and penumbrae of a given width do not depend on the light's size.
        LightKind::Spot { size } => k.f64s(&[0.0, if is_soft { size } else { 0.0 }]),
        LightKind::Directional { angle } => k.f64s(&[1.0, if is_soft { angle } else { 0.0 }]),
    }
    k.u64(size[0].into());
    k.u64(size[1].into());
    match method {
        Method::Hard => k.u64(0),
        Method::Soft(s) => {
            k.u64(1);
            k.u64(s.samples.into());
            k.u64(s.adaptive.into());
            k.u64(s.seed);
        }
        Method::FixedPenumbra(s) => {
            k.u64(2);
            k.f64s(&[s.penumbra]);
            k.u64(s.subsamples.into());
        }
    }
    CacheKey(*k.0.finalize().as_bytes())
}

struct Hasher(blake3::Hasher);

impl Hasher {
    /// Hashes bytes with their length, so that two neighbouring fields cannot exchange bytes.
    fn bytes(&mut self, bytes: &[u8]) {
        self.u64(bytes.len() as u64);
        self.0.update(bytes);
    }

    fn u64(&mut self, x: u64) {
        self.0.update(&x.to_le_bytes());
    }

    fn f64s(&mut self, values: &[f64]) {
        for v in values {
            self.u64(v.to_bits());
        }
    }

    fn affine(&mut self, m: &DAffine3) {
        self.f64s(&m.to_cols_array());
    }

    fn matrix(&mut self, m: &DMat4) {
        self.f64s(&m.to_cols_array());
    }

    fn mesh(&mut self, scene: &Scene, mesh: &Mesh) {
        self.bytes(bytemuck::cast_slice(&mesh.positions));
        self.bytes(bytemuck::cast_slice(&mesh.indices));
        let material = scene.materials.get(mesh.material);
        self.u64(material.is_some_and(|m| m.double_sided).into());
        let Some((material, cutoff)) = material.and_then(|m| m.alpha_cutoff.map(|c| (m, c))) else {
            return self.u64(0);
        };
        self.u64(1);
        self.f64s(&[cutoff.into(), material.base_color[3].into()]);
        self.texture(scene, material);
        self.bytes(bytemuck::cast_slice(&mesh.uvs));
        let alphas: Vec<f32> = mesh.colors.iter().map(|c| c[3]).collect();
        self.bytes(bytemuck::cast_slice(&alphas));
    }

    fn texture(&mut self, scene: &Scene, material: &Material) {
        let Some(texture) = material.texture.and_then(|t| scene.textures.get(t)) else {
            return self.u64(0);
        };
        self.u64(1);
        self.u64(texture.size[0].into());
        self.u64(texture.size[1].into());
        let alphas: Vec<u8> = texture.rgba.iter().map(|t| t[3]).collect();
        self.bytes(&alphas);
        for wrap in texture.wrap {
            self.u64(match wrap {
                Wrap::Repeat => 0,
                Wrap::MirroredRepeat => 1,
                Wrap::ClampToEdge => 2,
            });
        }
        self.u64(texture.nearest.into());
    }
}
