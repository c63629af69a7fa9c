//! Alpha test: holes of masked materials.
//!
//! The arithmetic is fixed so that a shader with four loads and explicit weights gets the same bits. `u` and `v` are
//! rounded to `f32` from the `f64` barycentrics. Everything after that is `f32`, with one rounding per operation and
//! no fused multiply-add:
//!
//! * nearest: texel `floor(u * w), floor(v * h)`;
//! * bilinear: `x = u * w - 0.5`, `x0 = floor(x)`, `f = x - x0`, columns `x0` and `x0 + 1`, the same in `v`;
//!   `mix(mix(t00, t10, fx), mix(t01, t11, fx), fy)` with `mix(a, b, f) = a * (1 - f) + b * f`;
//! * integer texel coordinates are wrapped: repeat `x mod w`; mirrored `m = x mod 2w`, then `2w - 1 - m` if
//!   `m >= w`; clamp to `[0, w - 1]`;
//! * a texel's alpha is `byte / 255`;
//! * `alpha = (factor * texel) * vertex`; the surface has a hole where `alpha < cutoff`.
//!
//! The level of detail is always 0: a shadow must not depend on the viewer's distance.

use crate::scene::{Material, Mesh, Scene, Texture, Wrap};

/// Data of a mesh for the alpha test.
#[derive(Debug)]
pub(super) struct Mask {
    indices: Vec<u32>,
    uvs: Vec<[f32; 2]>,
    /// Vertex alpha; empty if it is 1 everywhere.
    vertex: Vec<f32>,
    cutoff: f32,
    factor: f32,
    texture: Option<AlphaTexture>,
}

impl Mask {
    /// Returns the data for the alpha test; `None` if the material has no holes.
    pub fn new(scene: &Scene, mesh: &Mesh) -> Option<Self> {
        let material: &Material = scene.materials.get(mesh.material)?;
        Some(Self {
            cutoff: material.alpha_cutoff?,
            factor: material.base_color[3],
            texture: material.texture.and_then(|t| scene.textures.get(t)).map(AlphaTexture::new),
            indices: mesh.indices.clone(),
            uvs: mesh.uvs.clone(),
            vertex: mesh.colors.iter().map(|c| c[3]).collect(),
        })
    }

    /// Returns whether the `triangle`-th triangle of the mesh has a hole at these barycentrics.
    pub fn is_hole(&self, triangle: usize, barycentrics: [f64; 3]) -> bool {
        let corner = |k: usize| self.indices[3 * triangle + k] as usize;
        let interpolate =
            |f: &dyn Fn(usize) -> f32| (0..3).map(|k| barycentrics[k] * f64::from(f(corner(k)))).sum::<f64>() as f32;
        let texel = match &self.texture {
            Some(t) => t.sample(interpolate(&|v| self.uvs[v][0]), interpolate(&|v| self.uvs[v][1])),
            None => 1.0,
        };
        let vertex = if self.vertex.is_empty() { 1.0 } else { interpolate(&|v| self.vertex[v]) };
        self.factor * texel * vertex < self.cutoff
    }

    /// Returns the number of bytes held on the heap.
    pub fn bytes(&self) -> usize {
        4 * self.indices.len()
            + 8 * self.uvs.len()
            + 4 * self.vertex.len()
            + self.texture.as_ref().map_or(0, |t| t.alpha.len())
    }
}

/// Alpha channel of a texture.
#[derive(Debug)]
struct AlphaTexture {
    size: [u32; 2],
    alpha: Vec<u8>,
    wrap: [Wrap; 2],
    nearest: bool,
}

impl AlphaTexture {
    fn new(texture: &Texture) -> Self {
        Self {
            size: texture.size,
            alpha: texture.rgba.iter().map(|t| t[3]).collect(),
            wrap: texture.wrap,
            nearest: texture.nearest,
        }
    }

    fn texel(&self, x: i64, y: i64) -> f32 {
        let x = wrap(x, self.size[0], self.wrap[0]);
        let y = wrap(y, self.size[1], self.wrap[1]);
        f32::from(self.alpha[y * self.size[0] as usize + x]) / 255.0
    }

    fn sample(&self, u: f32, v: f32) -> f32 {
        let (x, y) = (u * self.size[0] as f32, v * self.size[1] as f32);
        if self.nearest {
            return self.texel(x.floor() as i64, y.floor() as i64);
        }
        let (x, y) = (x - 0.5, y - 0.5);
        let (x0, y0) = (x.floor(), y.floor());
        let (fx, fy) = (x - x0, y - y0);
        // The cast saturates; NaN becomes 0. Halving the range leaves room for the + 1.
        let index = |c: f32| (c as i64).clamp(i64::MIN / 2, i64::MAX / 2);
        let (x0, y0) = (index(x0), index(y0));
        let mix = |a: f32, b: f32, f: f32| a * (1.0 - f) + b * f;
        let row = |y: i64| mix(self.texel(x0, y), self.texel(x0 + 1, y), fx);
        mix(row(y0), row(y0 + 1), fy)
    }
}

fn wrap(x: i64, size: u32, mode: Wrap) -> usize {
    let size = i64::from(size);
    let x = match mode {
        Wrap::Repeat => x.rem_euclid(size),
        Wrap::MirroredRepeat => {
            let m = x.rem_euclid(2 * size);
            if m >= size { 2 * size - 1 - m } else { m }
        }
        Wrap::ClampToEdge => x.clamp(0, size - 1),
    };
    x as usize
}

#[cfg(test)]
mod tests {
    use super::*;

    fn ramp(wrap: Wrap, nearest: bool) -> AlphaTexture {
        AlphaTexture { size: [4, 1], alpha: vec![0, 51, 102, 255], wrap: [wrap; 2], nearest }
    }

    #[test]
    fn texel_centres_are_exact_and_halfway_is_the_mean() {
        let t = ramp(Wrap::ClampToEdge, false);
        assert_eq!(t.sample(0.375, 0.5), 0.2);
        assert!((t.sample(0.5, 0.5) - 0.3).abs() < 1e-6);
        assert_eq!(ramp(Wrap::ClampToEdge, true).sample(0.499, 0.5), 0.2);
    }

    #[test]
    fn wrap_modes_continue_the_image_in_their_own_way() {
        let at = |mode, x| wrap(x, 4, mode);
        assert_eq!([-1, 0, 3, 4, 9].map(|x| at(Wrap::Repeat, x)), [3, 0, 3, 0, 1]);
        assert_eq!([-1, -2, 4, 7, 8].map(|x| at(Wrap::MirroredRepeat, x)), [0, 1, 3, 0, 0]);
        assert_eq!([-9, 2, 4].map(|x| at(Wrap::ClampToEdge, x)), [0, 2, 3]);
        // At u = 0 a repeating image blends its two ends; a clamped one does not.
        assert!((ramp(Wrap::Repeat, false).sample(0.0, 0.5) - 0.5).abs() < 1e-6);
        assert_eq!(ramp(Wrap::ClampToEdge, false).sample(0.0, 0.5), 0.0);
    }

    #[test]
    fn absurd_coordinates_do_not_panic() {
        for mode in [Wrap::Repeat, Wrap::MirroredRepeat, Wrap::ClampToEdge] {
            for u in [f32::NAN, f32::INFINITY, f32::NEG_INFINITY, 3e38, -3e38] {
                let _ = ramp(mode, false).sample(u, u);
                let _ = ramp(mode, true).sample(u, u);
            }
        }
    }
}
