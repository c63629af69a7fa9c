//! Leaf test: a watertight ray-triangle intersection in `f64`.
//!
//! This follows Woop, Benthin and Wald, *Watertight Ray/Triangle Intersection*, JCGT 2013. The triangle is sheared so
//! that the ray becomes the axis `Z`; then the signs of three 2D edge functions decide. Each is the difference of two
//! rounded products. Rounding is monotone, so the sign of such a difference is right or the difference is zero, and
//! zero counts as inside. Two triangles that share an edge with bit-equal vertices compute exactly opposite values for
//! it, so no ray slips between them.

use glam::DVec3;

/// Triangle of the scene in local space (see [`super::RayScene`]), with the data that a hit needs.
#[derive(Clone, Copy, Debug)]
pub(super) struct Triangle {
    /// Corners in the order of the mesh.
    pub v: [[f64; 3]; 3],
    /// Id: instances in order, triangles of the mesh in order.
    pub id: u32,
    /// Index of the instance, with [`MASKED`] set if the material has holes.
    pub info: u32,
}

/// Bit of [`Triangle::info`]: a crossing counts only where the material's alpha passes.
pub(super) const MASKED: u32 = 1 << 31;

impl Triangle {
    pub fn corner(&self, k: usize) -> DVec3 {
        DVec3::from_array(self.v[k])
    }

    /// Returns `(b - a) x (c - a)`: twice the area, along the counter-clockwise normal.
    pub fn cross(&self) -> DVec3 {
        (self.corner(1) - self.corner(0)).cross(self.corner(2) - self.corner(0))
    }

    pub fn instance(&self) -> usize {
        (self.info & !MASKED) as usize
    }

    pub fn is_masked(&self) -> bool {
        self.info & MASKED != 0
    }
}

/// Ray prepared for triangles; `Z` is the axis of its largest direction component.
pub(super) struct Shear<const Z: usize> {
    origin: [f64; 3],
    /// `d[x]/d[z]`, `d[y]/d[z]`, `1/d[z]`.
    shear: [f64; 3],
}

/// Crossing of a ray with a triangle.
#[derive(Clone, Copy, Debug)]
pub(super) struct Crossing {
    /// Distance along the ray, in units of its direction.
    pub t: f64,
    /// Weights of the three corners; their sum is 1.
    pub barycentrics: [f64; 3],
}

/// Returns the axis `Z` that [`Shear::new`] needs for a direction.
pub(super) fn largest_axis(d: DVec3) -> usize {
    let a = d.abs();
    if a.x > a.y && a.x > a.z {
        0
    } else if a.y > a.z {
        1
    } else {
        2
    }
}

impl<const Z: usize> Shear<Z> {
    const X: usize = (Z + 1) % 3;
    const Y: usize = (Z + 2) % 3;

    pub fn new(origin: DVec3, direction: DVec3) -> Self {
        let d = direction.to_array();
        Self { origin: origin.to_array(), shear: [d[Self::X] / d[Z], d[Self::Y] / d[Z], 1.0 / d[Z]] }
    }

    /// Returns the crossing with `0 < t < t_max`, from either side.
    #[inline(always)]
    pub fn hit(&self, triangle: &Triangle, t_max: f64) -> Option<Crossing> {
        let o = &self.origin;
        let [sx, sy, sz] = self.shear;
        let flat = |v: &[f64; 3]| {
            let z = v[Z] - o[Z];
            ((v[Self::X] - o[Self::X]) - sx * z, (v[Self::Y] - o[Self::Y]) - sy * z, z)
        };
        let (ax, ay, az) = flat(&triangle.v[0]);
        let (bx, by, bz) = flat(&triangle.v[1]);
        let (cx, cy, cz) = flat(&triangle.v[2]);
        let u = cx * by - cy * bx;
        let v = ax * cy - ay * cx;
        let w = bx * ay - by * ax;
        if (u < 0.0 || v < 0.0 || w < 0.0) && (u > 0.0 || v > 0.0 || w > 0.0) {
            return None;
        }
        let det = u + v + w;
        // All are zero: the triangle is seen edge-on, and its neighbours are hit instead.
        if det == 0.0 {
            return None;
        }
        let t = (u * az + v * bz + w * cz) * sz / det;
        let r = 1.0 / det;
        (t > 0.0 && t < t_max).then_some(Crossing { t, barycentrics: [u * r, v * r, w * r] })
    }
}
