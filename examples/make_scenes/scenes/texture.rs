//! Procedural images for the scenes, and their PNG form.

use super::kit::{PI, Rng, TAU, circle, cos, sin, smoothstep};
use edgeshade::scene::{Texture, Wrap};
use glam::{DVec2, DVec3, dvec2, dvec3};
use image::codecs::png::{CompressionType, FilterType, PngEncoder};
use image::{ExtendedColorType, ImageEncoder};

const SIZE: usize = 256;

/// A square image from `f(u, v) -> (r, g, b, alpha)` in sRGB 0 to 1; `v` points down.
fn paint(name: &str, wrap: Wrap, f: impl Fn(f64, f64) -> (DVec3, f64)) -> Texture {
    let texel = |i: usize| {
        let (x, y) = (i % SIZE, i / SIZE);
        let (c, a) = f((x as f64 + 0.5) / SIZE as f64, (y as f64 + 0.5) / SIZE as f64);
        [c.x, c.y, c.z, a].map(|x| (255.0 * x).round().clamp(0.0, 255.0) as u8)
    };
    Texture {
        name: name.into(),
        size: [SIZE as u32; 2],
        rgba: (0..SIZE * SIZE).map(texel).collect(),
        wrap: [wrap; 2],
        nearest: false,
    }
}

/// Smooth noise in -1 to 1 that repeats every `period` lattice cells.
pub(super) fn noise(x: f64, y: f64, period: i64, seed: u64) -> f64 {
    let (i, j) = (x.floor(), y.floor());
    let (fx, fy) = (smoothstep(0.0, 1.0, x - i), smoothstep(0.0, 1.0, y - j));
    let corner = |di: i64, dj: i64| {
        let (i, j) = ((i as i64 + di).rem_euclid(period) as u64, (j as i64 + dj).rem_euclid(period) as u64);
        Rng(seed ^ i.wrapping_mul(0x9e37_79b9) ^ j.wrapping_mul(0x85eb_ca6b_0000)).range(-1.0, 1.0)
    };
    let low = corner(0, 0) * (1.0 - fx) + corner(1, 0) * fx;
    let high = corner(0, 1) * (1.0 - fx) + corner(1, 1) * fx;
    low * (1.0 - fy) + high * fy
}

/// Light wood whose grain runs along `u`, to be multiplied by the block's colour.
pub(super) fn wood() -> Texture {
    paint("wood", Wrap::Repeat, |u, v| {
        let bend = 0.9 * noise(4.0 * u, 4.0 * v, 4, 1) + 0.25 * noise(8.0 * u, 16.0 * v, 16, 2);
        let rings = sin(TAU * (5.0 * v + 0.45 * bend));
        let fibre = noise(8.0 * u, 128.0 * v, 128, 3);
        let tone = step(0.88 + 0.07 * rings + 0.04 * fibre);
        (dvec3(1.0, 0.985, 0.96) * tone, 1.0)
    })
}

/// Fine uneven brightness for plaster, earth and stone.
pub(super) fn speckle() -> Texture {
    paint("speckle", Wrap::Repeat, |u, v| {
        let mut tone = 0.0;
        let mut weight = 0.5;
        for (k, cells) in [4.0, 8.0, 16.0, 32.0, 64.0].into_iter().enumerate() {
            tone += weight * noise(cells * u, cells * v, cells as i64, 10 + k as u64);
            weight *= 0.72;
        }
        (DVec3::splat(step(0.91 + 0.07 * tone)), 1.0)
    })
}

/// Four by four square tiles with grout, each slightly different.
pub(super) fn tiles() -> Texture {
    paint("tiles", Wrap::Repeat, |u, v| {
        let (x, y) = (4.0 * u, 4.0 * v);
        let to_edge = (0.5 - (x.fract() - 0.5).abs()).min(0.5 - (y.fract() - 0.5).abs());
        let mut own = Rng(77 + 31 * x as u64 + 1009 * y as u64);
        let shade = 0.9 + own.spread(0.07);
        let warm = own.spread(0.02);
        let mottle = 0.025 * noise(32.0 * u, 32.0 * v, 32, 5) + 0.02 * noise(64.0 * u, 64.0 * v, 64, 6);
        let grout = smoothstep(0.018, 0.04, to_edge);
        let tone = step(shade + mottle);
        let tile = dvec3(tone + warm, tone, tone - warm);
        (DVec3::splat(0.62) * (1.0 - grout) + tile * grout, 1.0)
    })
}

/// Rounds a tone to few levels, so that the PNG stays small.
fn step(tone: f64) -> f64 {
    (tone * 64.0).round() / 64.0
}

/// Upper left corners `(u, v)` of the leaf atlas's cells; each cell is half as wide as the image.
pub(super) mod leaf {
    /// One broad pointed leaf, its stalk at the bottom middle.
    pub const BROAD: (f64, f64) = (0.0, 0.0);
    /// A twig with leaflets, from the bottom middle upward.
    pub const TWIG: (f64, f64) = (0.5, 0.0);
    /// Blades of grass from the bottom edge.
    pub const GRASS: (f64, f64) = (0.0, 0.5);
    /// A fern frond from the bottom middle upward.
    pub const FERN: (f64, f64) = (0.5, 0.5);
}

/// Cut-out leaves, one kind in each quarter; the colours are pale, to be multiplied by the plant's own colour.
pub(super) fn leaves() -> Texture {
    let blades: Vec<(f64, f64, f64, f64)> = {
        let mut rng = Rng(5);
        (0..11)
            .map(|i| {
                let root = 0.12 + 0.76 * (i as f64 + 0.5) / 11.0 + rng.spread(0.02);
                (root, rng.range(0.55, 0.97), (root - 0.5) * 0.55 + rng.spread(0.16), rng.range(0.026, 0.04))
            })
            .collect()
    };
    paint("leaves", Wrap::ClampToEdge, |u, v| {
        let cell = (u >= 0.5, v >= 0.5);
        // Coordinates in the cell: x from -0.5 to 0.5, y from 0 at the bottom to 1 at the top.
        let p = dvec2((2.0 * u).fract() - 0.5, 1.0 - (2.0 * v).fract());
        let (inside, tone) = match cell {
            (false, false) => leaf_shape(p, dvec2(0.0, 0.06), dvec2(0.0, 0.97), 0.36),
            (true, false) => twig(p),
            (false, true) => grass(p, &blades),
            (true, true) => fern(p),
        };
        // A soft outline about a texel wide stays smooth under linear filtering.
        let alpha = (0.5 + inside * 0.5 * SIZE as f64).clamp(0.0, 1.0);
        (dvec3(0.93, 1.0, 0.82) * (0.8 + 0.2 * step(tone)), alpha)
    })
}

/// Signed distance (positive inside, roughly in cell units) of a pointed leaf from `a` to `b`, with a tone for its
/// veins.
fn leaf_shape(p: DVec2, a: DVec2, b: DVec2, half_width: f64) -> (f64, f64) {
    let axis = b - a;
    let length = axis.length();
    let d = axis / length;
    let along = (p - a).dot(d) / length;
    let across = (p - a).perp_dot(d);
    let t = along.clamp(0.0, 1.0);
    // The leaf is widest below its middle and tapers to a tip.
    let width = half_width * sin(PI * libm::pow(t, 0.72)) * (1.0 - 0.25 * t);
    let beyond = (along - t).abs() * length;
    let inside = width - across.abs() - beyond;
    let rib = smoothstep(0.0, 0.03 * length, across.abs());
    let veins = 0.5 + 0.5 * cos(TAU * (7.0 * along - 4.0 * across.abs() / length));
    (inside, 0.75 * rib + 0.25 * rib * smoothstep(0.0, 0.35, veins) - 0.2 * t)
}

fn twig(p: DVec2) -> (f64, f64) {
    let bend = |y: f64| 0.06 * sin(2.2 * y);
    let mut best = (0.012 - (p.x - bend(p.y)).abs() - (p.y - 0.8).max(0.0), 0.2);
    for i in 0..9 {
        let y = 0.12 + 0.085 * i as f64;
        let side = if i % 2 == 0 { 1.0 } else { -1.0 };
        let (c, s) = circle(if i == 8 { 0.5 * PI } else { 0.5 * PI - side * 0.95 });
        let root = dvec2(bend(y), y);
        let one = leaf_shape(p, root, root + dvec2(c, s) * (0.44 - 0.022 * i as f64), 0.1);
        if one.0 > best.0 {
            best = one;
        }
    }
    best
}

fn grass(p: DVec2, blades: &[(f64, f64, f64, f64)]) -> (f64, f64) {
    let mut best = (-1.0, 0.5);
    for (i, &(root, height, lean, width)) in blades.iter().enumerate() {
        let t = p.y / height;
        let x = root - 0.5 + lean * t * t;
        let inside = (width * (1.0 - t.clamp(0.0, 1.0)) - (p.x - x).abs()).min(height - p.y);
        if inside > best.0 {
            best = (inside, 0.35 + 0.5 * t.clamp(0.0, 1.0) + 0.15 * (i % 3) as f64);
        }
    }
    best
}

fn fern(p: DVec2) -> (f64, f64) {
    let mut best = (0.011 - p.x.abs() - (p.y - 0.95).max(0.0), 0.2);
    for i in 0..26 {
        let side = if i % 2 == 0 { 1.0 } else { -1.0 };
        let y = 0.08 + 0.034 * i as f64;
        let reach = 0.44 * (1.0 - smoothstep(0.25, 1.05, y)) * smoothstep(-0.25, 0.25, y) + 0.03;
        let root = dvec2(0.0, y);
        let one = leaf_shape(p, root, root + dvec2(side * reach, 0.42 * reach), 0.03);
        if one.0 > best.0 {
            best = one;
        }
    }
    best
}

/// Encodes the image as a PNG file, without alpha if it is opaque.
pub(super) fn png(texture: &Texture) -> Vec<u8> {
    let opaque = texture.rgba.iter().all(|t| t[3] == 255);
    let (kind, texels): (_, Vec<u8>) = if opaque {
        (ExtendedColorType::Rgb8, texture.rgba.iter().flat_map(|t| [t[0], t[1], t[2]]).collect())
    } else {
        (ExtendedColorType::Rgba8, texture.rgba.iter().flatten().copied().collect())
    };
    let mut out = Vec::new();
    let [w, h] = texture.size;
    PngEncoder::new_with_quality(&mut out, CompressionType::Best, FilterType::Adaptive)
        .write_image(&texels, w, h, kind)
        .expect("the size fits the texels and writing to memory does not fail");
    out
}
