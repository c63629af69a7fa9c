//! Shapes made of triangles. Every closed shape is watertight by position, winds counter-clockwise as seen from
//! outside, and has unit normals that point outward.

use super::kit::{PI, TAU, circle, cos, rotation, sin};
use edgeshade::scene::Mesh;
use glam::{DAffine3, DMat3, DVec2, DVec3, dvec2, dvec3};
use std::collections::BTreeMap;
use std::f64::consts::FRAC_1_SQRT_2;

/// Cosine of the angle between two faces above which their common edge is shaded smoothly.
const SMOOTH_COS: f64 = 0.7;

/// Triangles with normals and texture coordinates, in `f64` until [`MeshBuilder::build`].
#[derive(Clone, Debug, Default)]
pub(super) struct MeshBuilder {
    pub positions: Vec<DVec3>,
    pub normals: Vec<DVec3>,
    pub uvs: Vec<DVec2>,
    pub indices: Vec<u32>,
}

impl MeshBuilder {
    pub fn new() -> Self {
        Self::default()
    }

    /// Adds one vertex and returns its index.
    pub fn vertex(&mut self, position: DVec3, normal: DVec3, uv: DVec2) -> u32 {
        self.positions.push(position);
        self.normals.push(normal);
        self.uvs.push(uv);
        (self.positions.len() - 1) as u32
    }

    /// Adds a triangle unless two of its corners are the same point.
    pub fn triangle(&mut self, a: u32, b: u32, c: u32) {
        let [p, q, r] = [a, b, c].map(|i| self.positions[i as usize]);
        if p != q && q != r && r != p {
            self.indices.extend([a, b, c]);
        }
    }

    /// Adds the quad `a b c d`, counter-clockwise.
    pub fn quad(&mut self, a: u32, b: u32, c: u32, d: u32) {
        self.triangle(a, b, c);
        self.triangle(a, c, d);
    }

    /// Adds a copy of another shape, moved by any affine transform.
    pub fn add(&mut self, other: &MeshBuilder, t: DAffine3) -> &mut Self {
        let base = self.positions.len() as u32;
        let m: DMat3 = t.matrix3;
        let flip = m.determinant() < 0.0;
        // Unlike the cofactor matrix, the inverse transpose keeps normals outward under mirroring.
        let normal = m.inverse().transpose();
        self.positions.extend(other.positions.iter().map(|&p| t.transform_point3(p)));
        self.normals.extend(other.normals.iter().map(|&n| (normal * n).normalize()));
        self.uvs.extend_from_slice(&other.uvs);
        for tri in other.indices.chunks_exact(3) {
            let [a, b, c] = [tri[0] + base, tri[1] + base, tri[2] + base];
            self.indices.extend(if flip { [a, c, b] } else { [a, b, c] });
        }
        self
    }

    /// Returns a moved copy.
    pub fn moved(&self, t: DAffine3) -> Self {
        let mut out = Self::new();
        out.add(self, t);
        out
    }

    /// Sets texture coordinates from object space: `(u, v) = f(position, normal)`.
    pub fn map_uv(mut self, f: impl Fn(DVec3, DVec3) -> DVec2) -> Self {
        for i in 0..self.positions.len() {
            self.uvs[i] = f(self.positions[i], self.normals[i]);
        }
        self
    }

    /// Makes the mesh in `f32`. Merges equal vertices and drops triangles that collapse by rounding. Without
    /// `textured` all texture coordinates are 0.
    pub fn build(&self, name: &str, material: usize, textured: bool) -> Mesh {
        let mut mesh = Mesh { name: name.into(), material, ..Mesh::default() };
        let mut known: BTreeMap<[u32; 8], u32> = BTreeMap::new();
        let mut index = |i: u32| {
            let i = i as usize;
            // `+ 0.0` turns -0 into 0.
            let p = self.positions[i].as_vec3().to_array().map(|x| x + 0.0);
            let n = self.normals[i].as_vec3().to_array().map(|x| x + 0.0);
            let uv = if textured { self.uvs[i].as_vec2().to_array().map(|x| x + 0.0) } else { [0.0; 2] };
            let key = [p[0], p[1], p[2], n[0], n[1], n[2], uv[0], uv[1]].map(f32::to_bits);
            *known.entry(key).or_insert_with(|| {
                mesh.positions.push(p);
                mesh.normals.push(n);
                mesh.uvs.push(uv);
                (mesh.positions.len() - 1) as u32
            })
        };
        let mut indices = Vec::with_capacity(self.indices.len());
        for t in self.indices.chunks_exact(3) {
            let [a, b, c] = [t[0], t[1], t[2]].map(|i| self.positions[i as usize].as_vec3());
            if a != b && b != c && c != a {
                indices.extend([index(t[0]), index(t[1]), index(t[2])]);
            }
        }
        mesh.indices = indices;
        mesh.compute_bounds();
        mesh
    }
}

/// A box of the full size `size` around the origin with rounded edges; each edge has `rings` strips (1 = a soft
/// chamfer).
pub(super) fn rounded_box(size: DVec3, radius: f64, rings: usize) -> MeshBuilder {
    let half = 0.5 * size;
    let inner = half - DVec3::splat(radius.min(0.49 * size.min_element()));
    // Grid lines of one axis: an arc of angles, the flat middle, an arc. The tangent spaces them evenly.
    let lines = |axis: usize| -> Vec<f64> {
        let arc = |i: usize| (libm::tan(0.25 * PI * i as f64 / rings as f64)) * (half[axis] - inner[axis]);
        let mut out: Vec<f64> = (0..=rings).rev().map(|i| -inner[axis] - arc(i)).collect();
        out.extend((0..=rings).map(|i| inner[axis] + arc(i)));
        out
    };
    let mut out = MeshBuilder::new();
    for (w, u, v) in [(0, 1, 2), (1, 2, 0), (2, 0, 1)] {
        for sign in [1.0, -1.0] {
            let (us, vs) = (lines(u), lines(v));
            let base = out.positions.len() as u32;
            for &b in &vs {
                for &a in &us {
                    let mut p = DVec3::ZERO;
                    (p[w], p[u], p[v]) = (sign * half[w], sign * a, b);
                    let core = p.clamp(-inner, inner);
                    let n = (p - core).normalize();
                    out.vertex(core + n * (half - inner).x, n, dvec2(0.5 + a / size[u], 0.5 - b / size[v]));
                }
            }
            let row = us.len() as u32;
            for j in 0..vs.len() as u32 - 1 {
                for i in 0..row - 1 {
                    let a = base + j * row + i;
                    out.quad(a, a + 1, a + row + 1, a + row);
                }
            }
        }
    }
    out
}

/// [`rounded_box`] with a single chamfer strip.
pub(super) fn block(x: f64, y: f64, z: f64, radius: f64) -> MeshBuilder {
    rounded_box(dvec3(x, y, z), radius, 1)
}

/// A surface over `[0, 1] x [0, 1]`, with `point` giving the position. Its front faces `d/du x d/dv`.
pub(super) fn surface(nu: usize, nv: usize, point: impl Fn(f64, f64) -> DVec3) -> MeshBuilder {
    let mut out = MeshBuilder::new();
    let e = 1e-4;
    for j in 0..=nv {
        for i in 0..=nu {
            let (u, v) = (i as f64 / nu as f64, j as f64 / nv as f64);
            let du = point(u + e, v) - point(u - e, v);
            let dv = point(u, v + e) - point(u, v - e);
            out.vertex(point(u, v), du.cross(dv).normalize(), dvec2(u, v));
        }
    }
    let row = nu as u32 + 1;
    for j in 0..nv as u32 {
        for i in 0..nu as u32 {
            let a = j * row + i;
            out.quad(a, a + 1, a + row + 1, a + row);
        }
    }
    out
}

/// A flat rectangle in the plane `y = 0` that faces up, made of `nx` by `nz` quads.
pub(super) fn floor(x: f64, z: f64, nx: usize, nz: usize) -> MeshBuilder {
    surface(nx, nz, |u, v| dvec3((u - 0.5) * x, 0.0, (0.5 - v) * z))
}

/// A photographer's backdrop: a floor from `z = front` to `back`, a quarter round, and a wall up to `top`.
pub(super) fn studio(width: f64, front: f64, back: f64, radius: f64, top: f64) -> MeshBuilder {
    let (flat, round) = (front - back, 0.5 * PI * radius);
    // Rows lie where the surface bends; the flat parts need none.
    let rows = 26;
    let along = |v: f64| match v * rows as f64 {
        r if r < 1.0 => flat * r,
        r if r < 25.0 => flat + round * (r - 1.0) / 24.0,
        r => flat + round + (top - radius) * (r - 25.0),
    };
    surface(1, rows, |u, v| {
        let s = along(v);
        let (z, y) = if s < flat {
            (front - s, 0.0)
        } else if s < flat + round {
            let (c, sn) = circle((s - flat) / radius);
            (back - radius * sn, radius * (1.0 - c))
        } else {
            (back - radius, radius + s - flat - round)
        };
        dvec3(width * (u - 0.5), y, z)
    })
}

/// Turns a profile of `(radius, height)` about `+Y`. The outside is to the right of a profile that runs upward.
/// Corners sharper than about 45 degrees stay sharp, and ends at radius 0 close the shape.
pub(super) fn lathe(profile: &[(f64, f64)], segments: usize) -> MeshBuilder {
    lathe_shaped(profile, segments, |_, r| r)
}

/// Same as [`lathe`] with a radius that depends on the angle: `shape(angle, radius)`.
pub(super) fn lathe_shaped(profile: &[(f64, f64)], segments: usize, shape: impl Fn(f64, f64) -> f64) -> MeshBuilder {
    let points: Vec<DVec2> = profile.iter().map(|&(r, y)| dvec2(r, y)).collect();
    let spans: Vec<DVec2> = points.windows(2).map(|w| w[1] - w[0]).collect();
    let mut out = MeshBuilder::new();
    for (k, &along) in spans.iter().enumerate() {
        let before = k.checked_sub(1).and_then(|i| spans.get(i));
        let ends = [joined(along, before), joined(along, spans.get(k + 1))];
        let base = out.positions.len() as u32;
        for i in 0..=segments {
            let angle = TAU * (i % segments) as f64 / segments as f64;
            let (c, s) = circle(angle);
            let e = 1e-4;
            for (p, tangent) in [points[k], points[k + 1]].into_iter().zip(ends) {
                let r = shape(angle, p.x);
                // d(radius)/d(angle) tilts the normal sideways.
                let dr = if p.x > 0.0 { (shape(angle + e, p.x) - shape(angle - e, p.x)) / (2.0 * e * r) } else { 0.0 };
                let side = dvec3(c, 0.0, -s) + dr * dvec3(s, 0.0, c);
                let n = side * tangent.y - DVec3::Y * tangent.x;
                let uv = dvec2(i as f64 / segments as f64, p.y);
                out.vertex(dvec3(r * c, p.y, -r * s), n.normalize(), uv);
            }
        }
        for i in 0..segments as u32 {
            let a = base + 2 * i;
            out.quad(a, a + 2, a + 3, a + 1);
        }
    }
    out
}

/// Direction of a profile or outline at the end where `other` follows; smooth unless the corner is sharp. The longer
/// span has more weight, so that a bevel does not tilt the normals of a large flat face.
fn joined(along: DVec2, other: Option<&DVec2>) -> DVec2 {
    match other {
        Some(&o) if o.normalize().dot(along.normalize()) > SMOOTH_COS => (o + along).normalize(),
        _ => along.normalize(),
    }
}

/// A cylinder from `y = 0` to `height` with a rounded rim.
pub(super) fn cylinder(radius: f64, height: f64, segments: usize, rim: f64) -> MeshBuilder {
    let mut profile = vec![(0.0, 0.0)];
    if rim > 0.0 {
        let h = 0.293 * rim;
        profile.extend([(radius - rim, 0.0), (radius - h, h), (radius, rim)]);
        profile.extend([(radius, height - rim), (radius - h, height - h), (radius - rim, height)]);
    } else {
        profile.extend([(radius, 0.0), (radius, height)]);
    }
    profile.push((0.0, height));
    lathe(&profile, segments)
}

/// A sphere around the origin.
pub(super) fn sphere(radius: f64, segments: usize, rings: usize) -> MeshBuilder {
    let profile: Vec<(f64, f64)> = (0..=rings)
        .map(|i| {
            let a = PI * i as f64 / rings as f64;
            // The poles lie exactly on the axis, so that the shape closes.
            (if i == 0 || i == rings { 0.0 } else { radius * sin(a) }, -radius * cos(a))
        })
        .collect();
    lathe(&profile, segments)
}

/// A torus about `+Y`.
pub(super) fn torus(radius: f64, tube: f64, segments: usize, sides: usize) -> MeshBuilder {
    let path: Vec<DVec3> = (0..segments)
        .map(|i| {
            let (c, s) = circle(TAU * i as f64 / segments as f64);
            radius * dvec3(c, 0.0, -s)
        })
        .collect();
    tube_loop(&path, |_| tube, sides)
}

/// A round bar along a polyline, with bevelled flat ends; `radius(t)` takes `t` from 0 to 1.
pub(super) fn tube(path: &[DVec3], radius: impl Fn(f64) -> f64, sides: usize) -> MeshBuilder {
    let n = path.len();
    let mut out = MeshBuilder::new();
    if n < 2 {
        return out;
    }
    let tangents: Vec<DVec3> =
        (0..n).map(|i| (path[(i + 1).min(n - 1)] - path[i.saturating_sub(1)]).normalize()).collect();
    let frames = transport(&tangents);
    for i in 0..n {
        let r = radius(i as f64 / (n - 1) as f64);
        ring(&mut out, path[i], frames[i], r, sides, i as f64);
    }
    stitch(&mut out, n - 1, sides, false);
    for (i, end) in [(0, -1.0), (n - 1, 1.0)] {
        let r = radius(if i == 0 { 0.0 } else { 1.0 });
        let axis = tangents[i] * end;
        let base = out.positions.len() as u32;
        for k in 0..sides {
            let side = around(frames[i], k, sides);
            out.vertex(path[i] + r * side, axis, DVec2::ZERO);
        }
        let middle = out.vertex(path[i], axis, DVec2::ZERO);
        for k in 0..sides as u32 {
            let (a, b) = (base + k, base + (k + 1) % sides as u32);
            if end > 0.0 {
                out.triangle(middle, a, b)
            } else {
                out.triangle(middle, b, a)
            };
        }
    }
    out
}

/// A round bar along a closed polyline.
pub(super) fn tube_loop(path: &[DVec3], radius: impl Fn(f64) -> f64, sides: usize) -> MeshBuilder {
    let n = path.len();
    let mut out = MeshBuilder::new();
    let tangents: Vec<DVec3> = (0..n).map(|i| (path[(i + 1) % n] - path[(i + n - 1) % n]).normalize()).collect();
    let mut frames = transport(&tangents);
    // After one round the frame is turned against the first one; this spreads the turn over the loop.
    let [first, last] = [frames[0], carry(frames[n - 1], tangents[n - 1], tangents[0])];
    let twist = libm::atan2(last.0.dot(first.1), last.0.dot(first.0));
    for (i, frame) in frames.iter_mut().enumerate() {
        let m = rotation(tangents[i], -twist * i as f64 / n as f64);
        *frame = (m * frame.0, m * frame.1);
        ring(&mut out, path[i], *frame, radius(i as f64 / n as f64), sides, i as f64);
    }
    stitch(&mut out, n, sides, true);
    out
}

/// A straight round bar.
pub(super) fn rod(a: DVec3, b: DVec3, radius: f64, sides: usize) -> MeshBuilder {
    tube(&[a, b], |_| radius, sides)
}

/// A box of the full size `x`, `y`, `z` around the origin with sharp edges.
pub(super) fn sharp_box(x: f64, y: f64, z: f64) -> MeshBuilder {
    let (w, h) = (0.5 * x, 0.5 * y);
    plate(&[dvec2(-w, -h), dvec2(w, -h), dvec2(w, h), dvec2(-w, h)], z, 0.0)
}

/// A straight bar from `a` to `b` with sharp edges, `width` across and `height` as upright as its direction allows.
pub(super) fn beam(a: DVec3, b: DVec3, width: f64, height: f64) -> MeshBuilder {
    let along = (b - a).normalize();
    let side = if along.y.abs() < 0.999 { DVec3::Y.cross(along).normalize() } else { DVec3::X };
    let frame = DMat3::from_cols(side, along.cross(side), along);
    let place = DAffine3 { matrix3: frame, translation: 0.5 * (a + b) };
    sharp_box(width, height, (b - a).length()).moved(place)
}

/// A closed piece of ground: [`surface`] on top, upright sides, and a flat underside at the height `base`.
pub(super) fn ground(nu: usize, nv: usize, base: f64, point: impl Fn(f64, f64) -> DVec3) -> MeshBuilder {
    let mut out = surface(nu, nv, point);
    let row = nu + 1;
    let corner = |i: usize, j: usize| j * row + i;
    // Once around the border, counter-clockwise as seen from above.
    let mut border: Vec<usize> = (0..nu).map(|i| corner(i, 0)).collect();
    border.extend((0..nv).map(|j| corner(nu, j)));
    border.extend((0..nu).map(|i| corner(nu - i, nv)));
    border.extend((0..nv).map(|j| corner(0, nv - j)));
    let top: Vec<DVec3> = border.iter().map(|&i| out.positions[i]).collect();
    let foot = |p: DVec3| dvec3(p.x, base, p.z);
    let middle = foot(top.iter().sum::<DVec3>() / top.len() as f64);
    let center = out.vertex(middle, DVec3::NEG_Y, DVec2::ZERO);
    for (i, &a) in top.iter().enumerate() {
        let b = top[(i + 1) % top.len()];
        let normal = (foot(b) - foot(a)).cross(DVec3::Y).normalize();
        let side = [foot(a), foot(b), b, a].map(|p| out.vertex(p, normal, DVec2::ZERO));
        out.quad(side[0], side[1], side[2], side[3]);
        let under = [foot(b), foot(a)].map(|p| out.vertex(p, DVec3::NEG_Y, DVec2::ZERO));
        out.triangle(center, under[0], under[1]);
    }
    out
}

type Frame = (DVec3, DVec3);

fn carry(frame: Frame, from: DVec3, to: DVec3) -> Frame {
    let axis = from.cross(to);
    let s = axis.length();
    if s < 1e-12 {
        return frame;
    }
    let m = rotation(axis, libm::atan2(s, from.dot(to)));
    (m * frame.0, m * frame.1)
}

/// Frames along a curve that turn no more than the curve does (parallel transport).
fn transport(tangents: &[DVec3]) -> Vec<Frame> {
    let t = tangents[0];
    let x = if t.y.abs() < 0.9 { t.cross(DVec3::Y) } else { t.cross(DVec3::X) }.normalize();
    let mut frame = (x, t.cross(x));
    let mut out = vec![frame];
    for w in tangents.windows(2) {
        frame = carry(frame, w[0], w[1]);
        out.push(frame);
    }
    out
}

fn around(frame: Frame, k: usize, sides: usize) -> DVec3 {
    let (c, s) = circle(TAU * k as f64 / sides as f64);
    frame.0 * c + frame.1 * s
}

fn ring(out: &mut MeshBuilder, center: DVec3, frame: Frame, radius: f64, sides: usize, v: f64) {
    for k in 0..sides {
        let side = around(frame, k, sides);
        out.vertex(center + radius * side, side, dvec2(k as f64 / sides as f64, v));
    }
}

fn stitch(out: &mut MeshBuilder, spans: usize, sides: usize, closed: bool) {
    let (rings, sides) = (if closed { spans } else { spans + 1 } as u32, sides as u32);
    for i in 0..spans as u32 {
        for k in 0..sides {
            let (a, b) = (i * sides, (i + 1) % rings * sides);
            let l = (k + 1) % sides;
            out.quad(a + k, a + l, b + l, b + k);
        }
    }
}

/// A plate: a simple counter-clockwise outline in the xy plane in metres, `depth` thick about `z = 0`, with edges
/// bevelled by `bevel`. Outline corners below about 45 degrees are shaded smoothly.
pub(super) fn plate(outline: &[DVec2], depth: f64, bevel: f64) -> MeshBuilder {
    let n = outline.len();
    let edge = |i: usize| (outline[(i + 1) % n] - outline[i % n]).normalize();
    let right = |d: DVec2| dvec2(d.y, -d.x);
    // Each corner moved inward by `bevel` along both of its edges.
    let inset: Vec<DVec2> = (0..n)
        .map(|i| {
            let (a, b) = (right(edge(i + n - 1)), right(edge(i)));
            outline[i] - (a + b) * (bevel / (1.0 + a.dot(b)).max(0.3))
        })
        .collect();
    let half = 0.5 * depth;
    // Upper and lower border of each strip: points, height, and the tilt of its normal along z.
    let rows = [
        (&inset[..], half, FRAC_1_SQRT_2),
        (outline, half - bevel, FRAC_1_SQRT_2),
        (outline, half - bevel, 0.0),
        (outline, bevel - half, 0.0),
        (outline, bevel - half, -FRAC_1_SQRT_2),
        (&inset[..], -half, -FRAC_1_SQRT_2),
    ];
    let mut out = MeshBuilder::new();
    for pair in rows.chunks_exact(2) {
        for i in 0..n {
            let span = |i: usize| outline[(i + 1) % n] - outline[i % n];
            let sides = [i + n - 1, i + 1].map(|other| right(joined(span(i), Some(&span(other)))));
            let corner = |out: &mut MeshBuilder, row: (&[DVec2], f64, f64), which: usize| -> u32 {
                let p = row.0[(i + which) % n];
                let normal = (sides[which] * (1.0 - row.2 * row.2).sqrt()).extend(row.2).normalize();
                out.vertex(p.extend(row.1), normal, p)
            };
            let a = corner(&mut out, pair[1], 0);
            let b = corner(&mut out, pair[1], 1);
            let c = corner(&mut out, pair[0], 1);
            let e = corner(&mut out, pair[0], 0);
            out.quad(a, b, c, e);
        }
    }
    let faces = ear_clip(&inset);
    for (z, normal) in [(half, DVec3::Z), (-half, DVec3::NEG_Z)] {
        let base = out.positions.len() as u32;
        for &p in &inset {
            out.vertex(p.extend(z), normal, p);
        }
        for t in &faces {
            let [a, b, c] = t.map(|i| base + i as u32);
            if z > 0.0 {
                out.triangle(a, b, c)
            } else {
                out.triangle(a, c, b)
            };
        }
    }
    out
}

/// Triangles of a simple counter-clockwise polygon.
fn ear_clip(polygon: &[DVec2]) -> Vec<[usize; 3]> {
    let cross = |a: usize, b: usize, c: usize| {
        (polygon[b] - polygon[a]).perp_dot(polygon[c] - polygon[b]) //
    };
    let mut left: Vec<usize> = (0..polygon.len()).collect();
    let mut out = Vec::new();
    while left.len() > 3 {
        let n = left.len();
        let mut best: Option<(usize, f64)> = None;
        for i in 0..n {
            let (a, b, c) = (left[(i + n - 1) % n], left[i], left[(i + 1) % n]);
            if cross(a, b, c) <= 0.0 {
                continue;
            }
            let inside = |p: usize| {
                ![a, b, c].contains(&p) && cross(a, b, p) >= 0.0 && cross(b, c, p) >= 0.0 && cross(c, a, p) >= 0.0
            };
            // Chooses the ear with the shortest cut, which leaves no slivers behind.
            let cut = polygon[a].distance_squared(polygon[c]);
            if best.is_none_or(|(_, d)| cut < d) && !left.iter().any(|&p| inside(p)) {
                best = Some((i, cut));
            }
        }
        // A simple polygon always has an ear; a degenerate one is cut anywhere.
        let i = best.map_or(0, |(i, _)| i);
        out.push([left[(i + n - 1) % n], left[i], left[(i + 1) % n]]);
        left.remove(i);
    }
    if let [a, b, c] = left[..] {
        out.push([a, b, c]);
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Checks that every edge is used once in each direction: the shape is closed and winds one way.
    fn closed(shape: &MeshBuilder) -> Result<(), String> {
        let key = |i: u32| (shape.positions[i as usize] * 1e7).round().to_array().map(|x| x as i64);
        let mut edges: BTreeMap<_, i32> = BTreeMap::new();
        for t in shape.indices.chunks_exact(3) {
            for k in 0..3 {
                let (a, b) = (key(t[k]), key(t[(k + 1) % 3]));
                *edges.entry((a, b)).or_default() += 1;
                *edges.entry((b, a)).or_default() -= 1;
            }
        }
        match edges.values().filter(|n| **n != 0).count() {
            0 => Ok(()),
            n => Err(format!("{n} open edges of {}", edges.len())),
        }
    }

    fn volume(shape: &MeshBuilder) -> f64 {
        let p = |i: u32| shape.positions[i as usize];
        shape.indices.chunks_exact(3).map(|t| p(t[0]).cross(p(t[1])).dot(p(t[2])) / 6.0).sum()
    }

    fn normals_agree(shape: &MeshBuilder) -> bool {
        shape.indices.chunks_exact(3).all(|t| {
            let [a, b, c] = [t[0], t[1], t[2]].map(|i| shape.positions[i as usize]);
            let mean: DVec3 = t.iter().map(|&i| shape.normals[i as usize]).sum();
            (b - a).cross(c - a).dot(mean) > 0.0
        }) && shape.normals.iter().all(|n| (n.length() - 1.0).abs() < 1e-9)
    }

    fn arc(n: usize) -> Vec<DVec2> {
        (0..=n).map(|i| circle(PI * i as f64 / n as f64)).map(|(c, s)| dvec2(c, s)).collect()
    }

    #[test]
    fn shapes_are_closed_and_have_the_volume_they_should() {
        let square = [dvec2(-1.0, -1.0), dvec2(1.0, -1.0), dvec2(1.0, 1.0), dvec2(-1.0, 1.0)];
        let mut gate = vec![dvec2(-2.0, 0.0)];
        gate.extend(arc(24).into_iter().rev());
        gate.extend([dvec2(2.0, 0.0), dvec2(2.0, 3.0), dvec2(-2.0, 3.0)]);
        let ring: Vec<DVec3> =
            (0..64).map(|i| circle(TAU * i as f64 / 64.0)).map(|(c, s)| dvec3(c, 0.3 * c * s, s)).collect();
        let cases = [
            ("box", rounded_box(dvec3(1.0, 2.0, 3.0), 0.01, 2), 6.0),
            ("cylinder", cylinder(1.0, 2.0, 256, 0.01), TAU),
            ("bare cylinder", cylinder(1.0, 2.0, 256, 0.0), TAU),
            ("sphere", sphere(1.0, 128, 64), 4.0 / 3.0 * PI),
            ("torus", torus(2.0, 0.5, 128, 64), 2.0 * PI * PI * 2.0 * 0.25),
            ("rod", rod(DVec3::ZERO, dvec3(1.0, 2.0, 2.0), 0.1, 64), 3.0 * 0.01 * PI),
            ("beam", beam(dvec3(1.0, 0.0, 2.0), dvec3(2.0, 2.0, 4.0), 0.2, 0.5), 0.3),
            ("upright beam", beam(DVec3::ZERO, DVec3::Y, 0.2, 0.5), 0.1),
            ("ground", ground(8, 8, -1.0, |u, v| dvec3(2.0 * u, 0.5 * u * v, -3.0 * v)), 6.75),
            ("plate", plate(&square, 0.5, 0.001), 2.0),
            ("gate", plate(&gate, 1.0, 0.001), 12.0 - 0.5 * PI),
            (
                "shaped",
                lathe_shaped(&[(0.0, 0.0), (1.0, 0.0), (1.0, 1.0), (0.0, 1.0)], 256, |a, r| r * (1.0 + 0.2 * cos(a))),
                PI * 1.02,
            ),
        ];
        for (name, shape, expected) in &cases {
            assert_eq!(closed(shape), Ok(()), "{name}");
            assert!((volume(shape) / expected - 1.0).abs() < 0.02, "{name}: {} is not {expected}", volume(shape));
            assert!(normals_agree(shape), "{name}");
        }
        let warped = tube_loop(&ring, |_| 0.05, 12);
        assert_eq!(closed(&warped), Ok(()));
        assert!(normals_agree(&warped) && volume(&warped) > 0.0);
    }

    #[test]
    fn a_hole_and_a_turned_triangle_are_noticed() {
        let mut shape = sphere(1.0, 16, 8);
        shape.indices.swap(0, 1);
        assert!(closed(&shape).is_err() && !normals_agree(&shape));
        let mut shape = sphere(1.0, 16, 8);
        shape.indices.truncate(shape.indices.len() - 3);
        assert!(closed(&shape).is_err());
    }

    #[test]
    fn mirrored_and_stretched_copies_stay_outside_out() {
        let shape = cylinder(0.5, 1.0, 24, 0.1).moved(DAffine3::from_scale(dvec3(-1.0, 2.0, 0.5)));
        assert_eq!(closed(&shape), Ok(()));
        assert!(normals_agree(&shape) && volume(&shape) > 0.0);
    }

    #[test]
    fn building_merges_vertices_and_keeps_the_surface() {
        let shape = cylinder(0.5, 1.0, 24, 0.1);
        let mesh = shape.build("cylinder", 0, false);
        assert_eq!(mesh.indices.len(), shape.indices.len());
        assert!(mesh.positions.len() < shape.positions.len());
        for (a, b) in mesh.indices.iter().zip(&shape.indices) {
            assert_eq!(mesh.positions[*a as usize], shape.positions[*b as usize].as_vec3().to_array());
            assert_eq!(mesh.normals[*a as usize], shape.normals[*b as usize].as_vec3().to_array());
        }
    }
}
