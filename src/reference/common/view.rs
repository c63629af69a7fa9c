//! Code that the mirrors share: a frame's data as the GPU has it, receivers, light space, the receiver plane.
//!
//! A mirror computes in `f64` what a shader computes in `f32`, from the same `f32` inputs: images and constants as
//! they were read back. Every value carries a bound on what the shader's single precision may have changed in it
//! (running error analysis). A decision whose margin lies within its bound is in doubt: the shader may rightly decide
//! the other way.

use crate::technique::common::view::ViewConstants;
use crate::{Error, Result};
use glam::{DMat3, DMat4, DVec2, DVec3, DVec4, Mat3, Mat4, Vec4, dvec2, dvec3};

/// Relative rounding error of a few dependent single-precision operations. A division or an inverse square root may be
/// off by 2.5 times `f32::EPSILON` (Vulkan, "Precision and Operation of SPIR-V Instructions").
pub(crate) const ROUNDING: f64 = 3.0 * f32::EPSILON as f64;
/// Rounding error of a sum of four products, relative to the sum of their magnitudes: four times half of
/// `f32::EPSILON`.
const PRODUCT_ROUNDING: f64 = 2.0 * f32::EPSILON as f64;
/// `POSITION_ULPS` of `glsl/lib/shadow_test.glsl`.
const POSITION_ULPS: f64 = 4.0 / 8388608.0;
/// `DEPTH_ULPS` of `glsl/lib/shadow_test.glsl`.
pub(crate) const DEPTH_ULPS: f64 = 4.0 / 8388608.0;

/// Inputs of a frame, read back from the GPU, row by row from the top.
#[derive(Clone, Copy, Debug)]
pub struct FrameData<'a> {
    /// Uniform block that the passes were given.
    pub constants: &'a ViewConstants,
    /// Camera depth, one value per pixel.
    pub depth: &'a [f32],
    /// Normals as a shader fetches them, unused components 0; empty where the normals are derived from depth.
    pub normal: &'a [[f32; 3]],
    /// Shadow-map depth, one value per texel.
    pub shadow_map: &'a [f32],
}

/// Result of the mirror of a visibility pass.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Mirror {
    /// Visibility of every pixel: 1 is lit, 0 is in shadow.
    pub visibility: Vec<f64>,
    /// Largest change of each pixel's visibility by decisions within the rounding; for a hard test 0 or 1.
    pub doubt: Vec<f64>,
    /// Further change of each pixel's visibility by rounding that affects no decision, such as rounding of a kernel's
    /// position or of its sums.
    pub rounding: Vec<f64>,
}

impl Mirror {
    pub(crate) fn collect(pixels: Vec<Verdict>) -> Self {
        Self {
            visibility: pixels.iter().map(|v| v.visibility).collect(),
            doubt: pixels.iter().map(|v| v.doubt).collect(),
            rounding: pixels.iter().map(|v| v.rounding).collect(),
        }
    }
}

/// Visibility of one pixel.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Verdict {
    pub visibility: f64,
    pub doubt: f64,
    pub rounding: f64,
}

impl Verdict {
    /// Verdict of a pixel with too much in doubt to follow up.
    pub const ANYTHING: Self = Self { visibility: 1.0, doubt: 1.0, rounding: 0.0 };

    pub const fn sure(visibility: f64) -> Self {
        Self { visibility, doubt: 0.0, rounding: 0.0 }
    }

    /// Adds the doubt of another branch, with the visibility `other`, that may be taken as well.
    pub fn or(self, other: f64) -> Self {
        Self { doubt: self.doubt.max((self.visibility - other).abs() + self.doubt).min(1.0), ..self }
    }

    /// Adds the doubt of another verdict that may be reached as well.
    pub fn or_verdict(self, other: Self) -> Self {
        let doubt = self.doubt.max((self.visibility - other.visibility).abs() + other.doubt).min(1.0);
        Self { doubt, rounding: self.rounding.max(other.rounding), ..self }
    }
}

/// Constants in `f64`, with the images.
pub(crate) struct View<'a> {
    view_from_clip: DMat4,
    light_clip_from_view: DMat4,
    light_position_view: DVec4,
    light_depth_scale: f64,
    view_from_world: DMat3,
    pub size: [usize; 2],
    pub map_size: [usize; 2],
    normal_encoding: u32,
    far_depth: f32,
    camera_depth_error: f64,
    pixel_size: [f64; 2],
    depth: &'a [f32],
    normal: &'a [[f32; 3]],
    shadow_map: &'a [f32],
}

/// Surface point with the bounds of its errors.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Receiver {
    pub position: DVec3,
    pub position_error: DVec3,
    pub normal: DVec3,
    pub normal_error: f64,
    /// Allowance of the shader for the camera depth's precision, world units.
    pub allowance: f64,
}

/// Answer to a yes-or-no question.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Decision {
    Yes,
    No,
    /// The exact answer, whose margin lies within the rounding.
    Doubtful(bool),
}

impl Decision {
    /// Decides `margin > 0`, with `margin` known up to `error`.
    pub fn positive(margin: f64, error: f64) -> Self {
        match margin {
            m if m > error => Self::Yes,
            m if m < -error => Self::No,
            m => Self::Doubtful(m > 0.0),
        }
    }

    /// Returns whether both hold.
    pub fn and(self, other: Self) -> Self {
        match (self, other) {
            (Self::No, _) | (_, Self::No) => Self::No,
            (Self::Yes, Self::Yes) => Self::Yes,
            _ => Self::Doubtful(self.is_yes() && other.is_yes()),
        }
    }

    /// Returns the opposite.
    pub fn opposite(self) -> Self {
        match self {
            Self::Yes => Self::No,
            Self::No => Self::Yes,
            Self::Doubtful(likely) => Self::Doubtful(!likely),
        }
    }

    /// Returns whether at least one holds.
    pub fn or(self, other: Self) -> Self {
        self.opposite().and(other.opposite()).opposite()
    }

    /// Keeps this answer, but in doubt if `other` may be the answer as well and differs.
    pub fn unless(self, other: Self) -> Self {
        if self == other { self } else { Self::Doubtful(self.is_yes()) }
    }

    pub fn is_yes(self) -> bool {
        matches!(self, Self::Yes | Self::Doubtful(true))
    }

    pub fn is_doubtful(self) -> bool {
        matches!(self, Self::Doubtful(_))
    }
}

/// Point in shadow-map space, with the bounds of its errors.
#[derive(Clone, Copy, Debug)]
pub(crate) struct LightPoint {
    pub uv: DVec2,
    pub uv_error: DVec2,
    pub depth: f64,
    pub depth_error: f64,
    pub w: f64,
    pub w_error: f64,
    pub ndc: DVec2,
    pub ndc_error: DVec2,
    pub inside: Decision,
    /// `Yes` between the frustum's sides, whatever the depth.
    pub within_sides: Decision,
}

/// Slope of the receiver plane: change of depth per uv.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Plane {
    pub slope: DVec2,
    pub error: DVec2,
    /// `false` where rounding may have let the shader take the plane for edge-on.
    pub sure: bool,
}

impl<'a> View<'a> {
    pub fn new(data: &FrameData<'a>) -> Result<Self> {
        let c = data.constants;
        let size = c.size.map(|n| n as usize);
        let map_size = c.map_size.map(|n| n as usize);
        let pixels = size[0] * size[1];
        let wanted_normals = if c.normal_encoding == 0 { 0 } else { pixels };
        for (what, found, wanted) in [
            ("depth", data.depth.len(), pixels),
            ("normal", data.normal.len(), wanted_normals),
            ("shadow map", data.shadow_map.len(), map_size[0] * map_size[1]),
        ] {
            if found != wanted {
                return Err(Error::Usage(format!("mirror: the {what} has {found} values, but {wanted} are needed")));
            }
        }
        let matrix = |m: &[[f32; 4]; 4]| Mat4::from_cols_array_2d(m).as_dmat4();
        Ok(Self {
            view_from_clip: matrix(&c.view_from_clip),
            light_clip_from_view: matrix(&c.light_clip_from_view[0]),
            light_position_view: Vec4::from(c.light_position_view[0]).as_dvec4(),
            light_depth_scale: f64::from(c.light_depth_scale[0]),
            view_from_world: Mat3::from_cols_array_2d(&c.view_from_world).as_dmat3(),
            size,
            map_size,
            normal_encoding: c.normal_encoding,
            far_depth: c.far_depth,
            camera_depth_error: c.depth_error.into(),
            pixel_size: c.pixel_size.map(f64::from),
            depth: data.depth,
            normal: data.normal,
            shadow_map: data.shadow_map,
        })
    }

    /// Computes a value for every pixel, in parallel.
    pub fn every_pixel<T: Send>(&self, pixel: impl Fn([usize; 2]) -> T + Sync) -> Vec<T> {
        use rayon::prelude::*;
        let width = self.size[0];
        (0..width * self.size[1]).into_par_iter().with_min_len(64).map(|i| pixel([i % width, i / width])).collect()
    }

    pub fn map_extent(&self) -> DVec2 {
        dvec2(self.map_size[0] as f64, self.map_size[1] as f64)
    }

    /// Returns the world's up direction in camera view space.
    pub fn up(&self) -> DVec3 {
        self.view_from_world * DVec3::Y
    }

    /// Returns the unit axis of the light's view along which `w` grows.
    pub fn light_axis(&self) -> DVec3 {
        self.row(3).normalize_or_zero()
    }

    /// Returns the map's axes, not normalised: the directions in which its `x` and `y` grow.
    pub fn light_sides(&self) -> [DVec3; 2] {
        [0, 1].map(|i| self.row(i))
    }

    pub fn index(&self, pixel: [usize; 2]) -> usize {
        pixel[1] * self.size[0] + pixel[0]
    }

    pub fn is_surface(&self, pixel: [usize; 2]) -> bool {
        self.depth[self.index(pixel)] != self.far_depth
    }

    /// Returns the camera depth of a pixel.
    pub fn depth_at(&self, pixel: [usize; 2]) -> f64 {
        f64::from(self.depth[self.index(pixel)])
    }

    /// Returns the world width of a pixel at a point, and the bound of its error.
    pub fn pixel_width(&self, p: DVec3, p_error: DVec3) -> (f64, f64) {
        let [slope, offset] = self.pixel_size;
        let width = slope * p.z.abs() + offset;
        (width, slope * p_error.z + ROUNDING * width)
    }

    /// Returns the error of the distance between a pixel's point and a plane through `p`, world units, when single
    /// precision transforms the plane to clip space first.
    pub fn clip_plane_error(&self, pixel: [usize; 2], p: &Receiver) -> f64 {
        let ndc = |i: usize| (2.0 * pixel[i] as f64 + 1.0) / self.size[i] as f64 - 1.0;
        let clip = glam::dvec4(ndc(0), ndc(1), f64::from(self.depth[self.index(pixel)]), 1.0);
        let w = self.view_from_clip.row(3).dot(clip).abs();
        let plane = p.normal.extend(-p.normal.dot(p.position)).abs();
        let m = &self.view_from_clip;
        // The normalised device coordinates have an absolute error, a fraction of 1.
        let terms = (m.x_axis.abs() + m.y_axis.abs() + m.z_axis.abs() * clip.z.abs() + m.w_axis.abs()).dot(plane);
        3.0 * ROUNDING * terms / w
    }

    /// Returns the point where the ray of an image position meets the plane through `p` with normal `n`. Pixel centres
    /// are whole numbers.
    pub fn meet(&self, at: DVec2, p: DVec3, n: DVec3) -> DVec3 {
        let ndc = |i: usize| (2.0 * at[i] + 1.0) / self.size[i] as f64 - 1.0;
        let point = |depth: f64| {
            let q = self.view_from_clip * glam::dvec4(ndc(0), ndc(1), depth, 1.0);
            q.truncate() / q.w
        };
        let (a, b) = (point(0.25), point(0.75));
        a + (b - a) * (n.dot(p - a) / n.dot(b - a))
    }

    /// Returns the image position at which a point is seen; pixel centres are whole numbers.
    pub fn pixel_of(&self, p: DVec3) -> DVec2 {
        let q = self.view_from_clip.inverse() * p.extend(1.0);
        let size = dvec2(self.size[0] as f64, self.size[1] as f64);
        0.5 * (dvec2(q.x, q.y) / q.w + 1.0) * size - 0.5
    }

    /// Returns the unit vector along the ray that sees a point.
    pub fn ray(&self, p: DVec3) -> DVec3 {
        if self.view_from_clip.z_axis.w == 0.0 { DVec3::NEG_Z } else { p.normalize() }
    }

    /// Returns the unit vector along a side of the light's square.
    pub fn light_side(&self, axis: usize) -> DVec3 {
        self.row(axis).normalize_or_zero()
    }

    /// Returns the camera's projection.
    pub fn clip_from_view(&self) -> DMat4 {
        self.view_from_clip.inverse()
    }

    fn row(&self, i: usize) -> DVec3 {
        self.light_clip_from_view.row(i).truncate()
    }

    /// Returns the camera-view position of a pixel at a depth, and the bound of its error.
    pub fn position_at(&self, pixel: [usize; 2], depth: f64) -> (DVec3, DVec3) {
        let ndc = |i: usize| (2.0 * pixel[i] as f64 + 1.0) / self.size[i] as f64 - 1.0;
        let m = &self.view_from_clip;
        let p = *m * glam::dvec4(ndc(0), ndc(1), depth, 1.0);
        // The normalised device coordinates have an absolute error, a fraction of 1; the depth is exact.
        let size = m.x_axis.abs() + m.y_axis.abs() + m.z_axis.abs() * depth.abs() + m.w_axis.abs();
        let error = ROUNDING * size;
        let position = p.truncate() / p.w;
        (position, (error.truncate() + position.abs() * error.w) / p.w.abs() + ROUNDING * position.abs())
    }

    fn position(&self, pixel: [usize; 2]) -> (DVec3, DVec3) {
        self.position_at(pixel, f64::from(self.depth[self.index(pixel)]))
    }

    /// Returns the surface point of a pixel; `None` for the sky.
    pub fn receiver(&self, pixel: [usize; 2]) -> Option<Receiver> {
        if !self.is_surface(pixel) {
            return None;
        }
        let (position, position_error) = self.position(pixel);
        let (normal, normal_error) = match self.normal_encoding {
            0 => self.normal_from_depth(pixel, position, position_error),
            encoding => {
                let e = self.normal[self.index(pixel)].map(f64::from);
                let n = match encoding {
                    1 => octahedral_decode(dvec2(e[0], e[1])),
                    2 => octahedral_decode(2.0 * dvec2(e[0], e[1]) - 1.0),
                    _ => DVec3::from(e).normalize_or_zero(),
                };
                (self.view_from_world * n, 3.0 * ROUNDING)
            }
        };
        let mut allowance = POSITION_ULPS * position.length();
        if self.camera_depth_error != 0.0 {
            let depth = f64::from(self.depth[self.index(pixel)]) + self.camera_depth_error;
            allowance += position.distance(self.position_at(pixel, depth).0);
        }
        Some(Receiver { position, position_error, normal, normal_error, allowance })
    }

    /// Returns the forward difference along an axis to the neighbour that the shader uses, and its error.
    fn tangent(&self, pixel: [usize; 2], axis: usize, p: DVec3, p_error: DVec3) -> Option<(DVec3, DVec3)> {
        let at = |steps: isize| {
            let mut q = pixel;
            q[axis] = q[axis].checked_add_signed(steps).filter(|x| *x < self.size[axis])?;
            self.is_surface(q).then_some(q)
        };
        let depth = |q: [usize; 2]| self.depth[self.index(q)];
        // Shader and mirror round the differences of stored depths alike, so they choose the same neighbour.
        let off = |steps: isize, q: [usize; 2]| {
            let step = depth(q) - depth(pixel);
            at(2 * steps).map_or(step.abs(), |beyond| step.abs().min((depth(beyond) - depth(q) - step).abs()))
        };
        let sides = [-1, 1].map(|steps| at(steps).map(|q| (off(steps, q), steps, q)));
        let (_, steps, q) = match sides {
            [Some(a), Some(b)] => Some(if b.0 < a.0 { b } else { a }),
            [a, b] => a.or(b),
        }?;
        let (other, other_error) = self.position(q);
        let d = other - p;
        Some((steps as f64 * d, p_error + other_error + ROUNDING * d.abs()))
    }

    fn normal_from_depth(&self, pixel: [usize; 2], p: DVec3, p_error: DVec3) -> (DVec3, f64) {
        // A parallel projection looks along -Z everywhere.
        let ray = if self.view_from_clip.z_axis.w == 0.0 { DVec3::NEG_Z } else { p };
        let [horizontal, vertical] = [0, 1].map(|axis| self.tangent(pixel, axis, p, p_error));
        let (Some((h, h_error)), Some((v, v_error))) = (horizontal, vertical) else { return (DVec3::Z, 0.0) };
        let c = v.cross(h);
        let length = c.length();
        if length <= 0.0 {
            return (DVec3::Z, 2.0);
        }
        let n = c / length;
        let n = if n.dot(ray) > 0.0 { -n } else { n };
        let error = (v.length() * h_error.length() + h.length() * v_error.length()) / length + 3.0 * ROUNDING;
        // If the surface is seen edge-on, rounding decides which side faces the viewer.
        let edge_on = n.dot(ray).abs() <= error * ray.length() + p_error.length();
        (n, if edge_on { 2.0 } else { error.min(2.0) })
    }

    /// Returns the unit vector towards the light, and the bound of its error.
    pub fn towards_light(&self, p: DVec3, p_error: DVec3) -> (DVec3, f64) {
        let l = self.light_position_view;
        if l.w == 0.0 {
            return (l.truncate(), 0.0);
        }
        let d = l.truncate() - p;
        let distance = d.length();
        if distance <= 0.0 {
            return (DVec3::ZERO, 1.0);
        }
        (d / distance, p_error.length() / distance + 2.0 * ROUNDING)
    }

    /// Returns the distance to the light; `None` for a directional light.
    pub fn light_distance(&self, p: DVec3) -> Option<f64> {
        let l = self.light_position_view;
        (l.w != 0.0).then(|| (l.truncate() - p).length())
    }

    /// Decides whether the surface faces the light.
    pub fn faces_light(&self, r: &Receiver) -> Decision {
        let (towards, error) = self.towards_light(r.position, r.position_error);
        Decision::positive(r.normal.dot(towards), r.normal_error + error + ROUNDING)
    }

    pub fn light_point(&self, p: DVec3, p_error: DVec3) -> LightPoint {
        let m = &self.light_clip_from_view;
        let q = *m * p.extend(1.0);
        let absolute = DMat4::from_cols(m.x_axis.abs(), m.y_axis.abs(), m.z_axis.abs(), m.w_axis.abs());
        // `own` is the product's own rounding error. The point's earlier error is carried on by the gradients, since
        // it moves all of `q` together.
        let own = PRODUCT_ROUNDING * (absolute * p.abs().extend(1.0));
        let e = own + absolute * p_error.extend(0.0);
        let margins = [
            (q.w, e.w),
            (q.z, e.z),
            (q.w - q.z, e.w + e.z),
            (q.w - q.x.abs(), e.w + e.x),
            (q.w - q.y.abs(), e.w + e.y),
        ];
        let decide = |margins: &[(f64, f64)]| {
            if margins.iter().any(|&(m, e)| m < -e) {
                Decision::No
            } else if margins.iter().all(|&(m, e)| m > e) {
                Decision::Yes
            } else {
                Decision::Doubtful(q.w > 0.0 && margins.iter().all(|&(m, _)| m >= 0.0))
            }
        };
        let (inside, within_sides) = (decide(&margins), decide(&margins[3..]));
        let r = if q.w > 0.0 { 1.0 / q.w } else { 0.0 };
        let ndc = dvec2(q.x, q.y) * r;
        let (x, y, w) = (self.row(0), self.row(1), self.row(3));
        let moved = |gradient: DVec3| gradient.abs().dot(p_error);
        let ndc_error = (dvec2(own.x, own.y) + ndc.abs() * own.w) * r
            + dvec2(moved((x - ndc.x * w) * r), moved((y - ndc.y * w) * r))
            + ROUNDING * ndc.abs();
        let depth = q.z * r;
        let depth_error = (own.z + depth.abs() * own.w) * r + moved(self.depth_gradient(r)) + ROUNDING * depth.abs();
        LightPoint {
            uv: 0.5 * ndc + 0.5,
            uv_error: 0.5 * ndc_error + 0.5 * f64::from(f32::EPSILON),
            depth,
            depth_error,
            w: q.w,
            w_error: e.w,
            ndc,
            ndc_error,
            inside,
            within_sides,
        }
    }

    /// Returns the gradients, per world unit, of the map's u and v at a point.
    pub fn map_gradients(&self, l: &LightPoint) -> [DVec3; 2] {
        [0, 1].map(|i| 0.5 / l.w * (self.row(i) - l.ndc[i] * self.row(3)))
    }

    /// Returns the gradient of the stored depth at a point whose `w` is `1 / by_w`.
    fn depth_gradient(&self, by_w: f64) -> DVec3 {
        if self.light_depth_scale > 0.0 { self.light_depth_scale * by_w * by_w * self.row(3) } else { self.row(2) }
    }

    /// Returns the world size of a texel at the point's depth.
    fn texel_size(&self, l: &LightPoint) -> f64 {
        let scale = dvec2(self.row(0).length(), self.row(1).length()) * self.map_extent();
        2.0 * l.w / scale.x.min(scale.y)
    }

    /// Returns the extent of a directional light's frustum: its depth and its shorter side.
    pub fn frustum_extent(&self, l: &LightPoint) -> f64 {
        1.0 / self.row(2).length() + 2.0 * l.w / self.row(0).length().min(self.row(1).length())
    }

    /// Returns the change of the stored depth over a texel's world size along the light's axis.
    pub fn texel_depth(&self, l: &LightPoint) -> f64 {
        let by_w = 1.0 / l.w;
        let depth_per_unit =
            if self.light_depth_scale > 0.0 { self.light_depth_scale * by_w * by_w } else { self.row(2).length() };
        depth_per_unit * self.texel_size(l)
    }

    fn plane_offset_texels(&self, n: DVec3) -> f64 {
        0.5 * (n.dot(self.row(0).normalize()).abs() + n.dot(self.row(1).normalize()).abs())
    }

    /// Returns the receiver moved along its normal, and the bound of its error.
    pub fn offset(&self, r: &Receiver, l: &LightPoint, texels: f64) -> (DVec3, DVec3) {
        let per_plane = texels * self.texel_size(l);
        let planes = self.plane_offset_texels(r.normal);
        let offset = per_plane * planes + r.allowance;
        let offset_error = per_plane * (r.normal_error + planes * l.w_error / l.w.abs()) + 3.0 * ROUNDING * offset;
        // The allowance may be the difference of two positions.
        let offset_error =
            if self.camera_depth_error == 0.0 { offset_error } else { offset_error + 2.0 * r.position_error.length() };
        let p = r.position + r.normal * offset;
        let error = r.position_error
            + r.normal.abs() * offset_error
            + DVec3::splat(r.normal_error * offset)
            + ROUNDING * (r.position.abs() + offset);
        (p, error)
    }

    pub fn receiver_plane(&self, l: &LightPoint, r: &Receiver) -> Plane {
        let (x, y, w) = (self.row(0), self.row(1), self.row(3));
        let by_w = 1.0 / l.w;
        let u = 0.5 * by_w * (x - l.ndc.x * w);
        let v = 0.5 * by_w * (y - l.ndc.y * w);
        let w_relative = l.w_error / l.w.abs();
        let gradient_error = |axis: DVec3, ndc: f64, ndc_error: f64, g: DVec3| {
            0.5 * by_w * (ROUNDING * (axis.length() + ndc.abs() * w.length()) + ndc_error * w.length())
                + w_relative * g.length()
        };
        let u_error = gradient_error(x, l.ndc.x, l.ndc_error.x, u);
        let v_error = gradient_error(y, l.ndc.y, l.ndc_error.y, v);
        let d = self.depth_gradient(by_w);
        let d_error = if self.light_depth_scale > 0.0 { d.length() * (2.0 * w_relative + 2.0 * ROUNDING) } else { 0.0 };
        let area = u.cross(v);
        let facing = r.normal.dot(area);
        let product_error = |a: DVec3, a_error: f64, b: DVec3, b_error: f64| {
            let (al, bl) = (a.length(), b.length());
            al * bl * (r.normal_error + 2.0 * ROUNDING) + a_error * bl + b_error * al
        };
        let facing_error = product_error(u, u_error, v, v_error);
        let edge_on = Decision::positive(facing.abs() - 1e-3 * area.length(), 1.01 * facing_error);
        if !edge_on.is_yes() {
            return Plane { slope: DVec2::ZERO, error: DVec2::ZERO, sure: !edge_on.is_doubtful() };
        }
        let slope = dvec2(r.normal.dot(d.cross(v)), r.normal.dot(u.cross(d))) / facing;
        let certain = (facing.abs() - facing_error).max(f64::MIN_POSITIVE);
        let error = |s: f64, product: f64| (product + s.abs() * facing_error) / certain + ROUNDING * s.abs();
        Plane {
            slope,
            error: dvec2(
                error(slope.x, product_error(d, d_error, v, v_error)),
                error(slope.y, product_error(u, u_error, d, d_error)),
            ),
            sure: !edge_on.is_doubtful(),
        }
    }

    /// Returns the texel of the map nearest to `texel`.
    pub fn nearest_texel(&self, texel: [i64; 2]) -> [i64; 2] {
        [0, 1].map(|i| texel[i].clamp(0, self.map_size[i] as i64 - 1))
    }

    /// Returns the depth of a texel; outside the map 1, farther than everything.
    pub fn stored(&self, texel: [i64; 2]) -> f64 {
        let [w, h] = self.map_size.map(|n| n as i64);
        let inside = (0..w).contains(&texel[0]) && (0..h).contains(&texel[1]);
        if inside { f64::from(self.shadow_map[(texel[1] * w + texel[0]) as usize]) } else { 1.0 }
    }
}

/// Tests a reference depth with an error of up to `error`: yes if lit.
pub(crate) fn shadow_test(reference: f64, error: f64, stored: f64) -> Decision {
    // Clamped to 1, a reference never lies behind an empty texel, whatever its error.
    if stored >= 1.0 {
        return Decision::Yes;
    }
    match Decision::positive(reference.min(1.0) - stored, error) {
        Decision::Yes => Decision::No,
        Decision::No => Decision::Yes,
        Decision::Doubtful(behind) => Decision::Doubtful(!behind),
    }
}

/// Mirror of `octahedralDecode` of `glsl/lib/octahedral.glsl`.
pub(crate) fn octahedral_decode(e: DVec2) -> DVec3 {
    let mut n = dvec3(e.x, e.y, 1.0 - e.x.abs() - e.y.abs());
    if n.z < 0.0 {
        let sign = |v: f64| if v >= 0.0 { 1.0 } else { -1.0 };
        (n.x, n.y) = ((1.0 - n.y.abs()) * sign(n.x), (1.0 - n.x.abs()) * sign(n.y));
    }
    n.normalize()
}
