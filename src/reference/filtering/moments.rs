//! Mirror of the filters of moments and of their lookup: `moment_kind.glsl`, `moment_kernel.glsl`, `moment_rows.comp`,
//! `moment_columns.comp`, `moment_mips.comp` and `moment_lookup.glsl`.
//!
//! The filters are compared with exact sums over the shadow map. The lookup starts from the filtered moments as the GPU
//! has them, so that its own errors show.

use crate::Result;
use crate::reference::common::map_receiver::{MapReceiver, OpenReceiver, receive};
use crate::reference::common::view::{FrameData, Mirror, ROUNDING, Receiver, Verdict, View};
use glam::{DVec2, DVec3, dvec2};

/// Moments that a technique keeps of a texel.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Kept {
    /// Depth and its square.
    Variance,
    /// Warps with these exponents, each with its square.
    Warped([f32; 2]),
    /// Four moments, packed.
    Packed,
    /// Four powers.
    Powers,
}

/// A filter over a shadow map.
#[derive(Clone, Copy, Debug)]
pub struct Filter {
    /// Moments that are filtered.
    pub kept: Kept,
    /// Width of the box, texels; odd.
    pub width: u32,
    /// Takes a Gaussian of the same variance.
    pub gaussian: bool,
    /// Far over near, minus 1; 0 for a parallel light.
    pub range: f32,
}

/// Settings of the lookup.
#[derive(Clone, Copy, Debug)]
pub struct Settings {
    /// Normal offset, in multiples of what a plane needs.
    pub normal_offset: f32,
    /// Share of the rise of the receiver's plane from the window's middle to its corner.
    pub depth_bias: f32,
    /// Width of the filter, texels.
    pub width: u32,
    /// Far over near, minus 1; 0 for a parallel light.
    pub range: f32,
    /// Largest number of taps; 0 without a mip chain.
    pub anisotropy: u32,
    /// Largest visibility that counts as shadow.
    pub reduction: f32,
    /// Interpolates in fixed point, as a sampler may.
    pub sampled: bool,
}

/// Filtered moments as the GPU has them.
#[derive(Clone, Copy, Debug)]
pub struct Stored<'a> {
    /// Moments of each texel of each level of the mip chain, row by row from the top; unused ones 0.
    pub levels: &'a [Vec<[f32; 4]>],
}

/// Signed linear depth of a stored depth.
pub fn signed_depth(depth: f64, range: f32) -> f64 {
    let range = f64::from(range);
    (2.0 * depth / (1.0 + range * (1.0 - depth)) - 1.0).clamp(-1.0, 1.0)
}

/// Moments of a texel as they are filtered.
pub fn moments_of(depth: f32, kept: Kept, range: f32) -> [f64; 4] {
    let x = signed_depth(depth.into(), range);
    match kept {
        Kept::Variance => [x, x * x, 0.0, 0.0],
        Kept::Warped([positive, negative]) => {
            let (p, n) = ((f64::from(positive) * x).exp(), -(f64::from(-negative) * x).exp());
            [p, p * p, n, n * n]
        }
        Kept::Packed => pack([x, x * x, x * x * x, x * x * x * x]),
        Kept::Powers => [x, x * x, x * x * x, x * x * x * x],
    }
}

/// The basis in which four moments are stored.
pub fn pack([b1, b2, b3, b4]: [f64; 4]) -> [f64; 4] {
    let root = 3.0f64.sqrt();
    [1.5 * b1 - 2.0 * b3 + 0.5, 4.0 * (b2 - b4), root / 2.0 * b1 - 2.0 * root / 9.0 * b3 + 0.5, 0.5 * (b2 + b4)]
}

/// Returns the moments of which [`pack`] is made.
pub fn unpack([p1, p2, p3, p4]: [f64; 4]) -> [f64; 4] {
    // p1 and p3 give two equations in b1 and b3, p2 and p4 two in b2 and b4.
    let root = 3.0f64.sqrt();
    let (u, v) = (p1 - 0.5, p3 - 0.5);
    let det = 1.5 * (-2.0 * root / 9.0) + 2.0 * (root / 2.0);
    let b1 = (u * (-2.0 * root / 9.0) + 2.0 * v) / det;
    let b3 = (1.5 * v - root / 2.0 * u) / det;
    [b1, p4 + p2 / 8.0, b3, p4 - p2 / 8.0]
}

/// Returns the weights of a filter's texels, from one side to the other; their sum is 1.
fn weights(filter: &Filter) -> Vec<f64> {
    let width = f64::from(filter.width);
    let variance = width * width / 12.0;
    let radius = if filter.gaussian { (3.0 * variance.sqrt()).ceil() as i64 } else { i64::from(filter.width) / 2 };
    let weight = |i: i64| if filter.gaussian { (-(i * i) as f64 / (2.0 * variance)).exp() } else { 1.0 };
    let all: Vec<f64> = (-radius..=radius).map(weight).collect();
    let sum: f64 = all.iter().sum();
    all.into_iter().map(|w| w / sum).collect()
}

/// Returns the filtered moments of every texel.
pub fn filtered(shadow_map: &[f32], size: [u32; 2], filter: &Filter) -> Vec<[f64; 4]> {
    let [width, height] = size.map(|n| n as usize);
    let texels: Vec<_> = shadow_map.iter().map(|&d| moments_of(d, filter.kept, filter.range)).collect();
    let far = moments_of(1.0, filter.kept, filter.range);
    let weights = weights(filter);
    let radius = weights.len() as i64 / 2;
    let line = |values: &[[f64; 4]], count: usize, at: usize, stride: usize, own: usize| -> [f64; 4] {
        let mut sum = [0.0; 4];
        for (k, w) in weights.iter().enumerate() {
            let i = own as i64 + k as i64 - radius;
            let value = if (0..count as i64).contains(&i) { values[at + i as usize * stride] } else { far };
            sum = std::array::from_fn(|c| sum[c] + w * value[c]);
        }
        sum
    };
    let rows: Vec<_> = (0..width * height).map(|i| line(&texels, width, i / width * width, 1, i % width)).collect();
    (0..width * height).map(|i| line(&rows, height, i % width, width, i / width)).collect()
}

/// A level of a mip chain.
pub struct Level {
    /// Width and height.
    pub size: [usize; 2],
    /// Row by row from the top.
    pub texels: Vec<[f64; 4]>,
}

impl Level {
    /// Returns the next level: each texel is the mean over the area that it covers.
    pub fn coarser(&self) -> Self {
        let size = self.size.map(|n| (n / 2).max(1));
        let cover = |axis: usize, i: usize| {
            let step = self.size[axis] as f64 / size[axis] as f64;
            let (low, high) = (i as f64 * step, (i + 1) as f64 * step);
            (low as usize..self.size[axis])
                .take_while(move |&k| (k as f64) < high - 1e-9)
                .map(move |k| (k, ((k + 1) as f64).min(high) - (k as f64).max(low)))
        };
        let mut texels = vec![];
        for y in 0..size[1] {
            for x in 0..size[0] {
                let (mut sum, mut all) = ([0.0; 4], 0.0);
                for (j, wy) in cover(1, y) {
                    for (i, wx) in cover(0, x) {
                        let t = self.texels[j * self.size[0] + i];
                        sum = std::array::from_fn(|c| sum[c] + wx * wy * t[c]);
                        all += wx * wy;
                    }
                }
                texels.push(sum.map(|s| s / all));
            }
        }
        Self { size, texels }
    }

    /// Interpolates at a position in uv.
    fn at(&self, uv: DVec2) -> [f64; 4] {
        let size = dvec2(self.size[0] as f64, self.size[1] as f64);
        let place = uv * size - 0.5;
        let (first, f) = (place.floor(), place - place.floor());
        let texel = |dx: i64, dy: i64| {
            let at = |v: f64, d: i64, n: usize| (v as i64 + d).clamp(0, n as i64 - 1) as usize;
            self.texels[at(first.y, dy, self.size[1]) * self.size[0] + at(first.x, dx, self.size[0])]
        };
        let corners = [texel(0, 0), texel(1, 0), texel(0, 1), texel(1, 1)];
        let w = [(1.0 - f.x) * (1.0 - f.y), f.x * (1.0 - f.y), (1.0 - f.x) * f.y, f.x * f.y];
        std::array::from_fn(|c| (0..4).map(|i| w[i] * corners[i][c]).sum())
    }
}

/// Ellipse that a pixel covers in the map, texels.
struct Footprint {
    along: DVec2,
    major: f64,
    minor: f64,
    /// Relative error of all of it.
    error: f64,
}

fn footprint(view: &View<'_>, pixel: [usize; 2], r: &Receiver) -> Footprint {
    let l = view.light_point(r.position, r.position_error);
    let [u, v] = view.map_gradients(&l);
    let mut steps = [DVec2::ZERO; 2];
    let mut least_facing = f64::INFINITY;
    for (i, step) in steps.iter_mut().enumerate() {
        let mut neighbour = pixel;
        neighbour[i] += 1;
        let (p, _) = view.position_at(neighbour, view.depth_at(pixel));
        let ray = view.ray(p);
        let facing = r.normal.dot(ray).min(-0.05);
        least_facing = least_facing.min(-facing);
        let d: DVec3 = p + ray * (r.normal.dot(r.position - p) / facing) - r.position;
        *step = dvec2(u.dot(d), v.dot(d)) * view.map_extent();
    }
    let [a, b] = steps;
    let (xx, yy, xy) = (a.x * a.x + b.x * b.x, a.y * a.y + b.y * b.y, a.x * a.y + b.x * b.y);
    let (middle, apart) = (0.5 * (xx + yy), (0.25 * (xx - yy) * (xx - yy) + xy * xy).sqrt());
    let major = (middle + apart).sqrt().min(65536.0);
    let axis = if xx >= yy { dvec2(0.5 * (xx - yy) + apart, xy) } else { dvec2(xy, 0.5 * (yy - xx) + apart) };
    Footprint {
        along: axis.normalize_or_zero() * major,
        major,
        minor: (middle - apart).max(0.0).sqrt(),
        error: 1e-4 + 3.0 * r.normal_error / least_facing,
    }
}

/// Filtered moments under a receiver, with bounds of their errors.
pub(super) struct Found {
    pub moments: [f64; 4],
    /// Bound of each moment's whole error.
    pub error: [f64; 4],
    /// The part that rounding causes, independent for each moment.
    pub own: [f64; 4],
    /// The rest as moments that may have been found instead: one group for each thing that may be different.
    pub others: Vec<Vec<[f64; 4]>>,
    /// Signed depth of the receiver, with its error.
    pub depth: f64,
    pub depth_error: f64,
}

/// Returns the visibility of every pixel; `bound` gives the lit share of a window, with what rounding may change in it.
///
/// # Errors
/// Fails if the images do not fit the constants.
pub(super) fn visibility(
    data: &FrameData<'_>,
    stored: &Stored<'_>,
    settings: &Settings,
    bound: impl Fn(&Found) -> (f64, f64) + Sync,
) -> Result<Mirror> {
    let view = View::new(data)?;
    let level = |(l, texels): (usize, &Vec<[f32; 4]>)| Level {
        size: view.map_size.map(|n| (n >> l).max(1)),
        texels: texels.iter().map(|t| t.map(f64::from)).collect(),
    };
    let levels: Vec<_> = stored.levels.iter().enumerate().map(level).collect();
    let reduction = f64::from(settings.reduction);
    let pixels = view.every_pixel(|p| match receive(&view, p, settings.normal_offset, 0.0) {
        MapReceiver::Decided(verdict) => verdict,
        MapReceiver::Open(open) => {
            let Some(r) = view.receiver(p) else { return Verdict::sure(1.0) };
            let (v, rounding) = bound(&find(&view, p, &r, &open, &levels, settings));
            let stretched = |v: f64| ((v - reduction) / (1.0 - reduction)).clamp(0.0, 1.0);
            let rounding = rounding / (1.0 - reduction) + ROUNDING;
            open.with_doubts(Verdict { rounding, ..Verdict::sure(stretched(v)) })
        }
    });
    Ok(Mirror::collect(pixels))
}

fn find(
    view: &View<'_>,
    pixel: [usize; 2],
    r: &Receiver,
    open: &OpenReceiver,
    levels: &[Level],
    settings: &Settings,
) -> Found {
    let f = if settings.anisotropy > 0 {
        footprint(view, pixel, r)
    } else {
        Footprint { along: DVec2::ZERO, major: 0.0, minor: 0.0, error: 0.0 }
    };
    let most = f64::from(settings.anisotropy.max(1));
    let uv = open.light.uv;
    let across = f.minor.max(f.major / most).max(1.0);
    let last = (levels.len() - 1) as f64;
    let level = across.log2().min(last);
    let taps_at = |ratio: f64| ratio.ceil().clamp(1.0, most);
    let lookup = |uv: DVec2, level: f64, taps: f64| -> [f64; 4] {
        let low = level.floor();
        let mut sum = [0.0; 4];
        for i in 0..taps as usize {
            let at = uv + ((i as f64 + 0.5) / taps - 0.5) * f.along / view.map_extent();
            let a = levels[low as usize].at(at);
            let b = levels[(low as usize + 1).min(levels.len() - 1)].at(at);
            sum = std::array::from_fn(|c| sum[c] + (a[c] + (b[c] - a[c]) * (level - low)) / taps);
        }
        sum
    };
    let ratio = f.major / across;
    let taps = taps_at(ratio);
    let moments = lookup(uv, level, taps);
    // The shader may have read other places, another level, or another number of taps.
    let sampler = if settings.sampled { level.exp2() / 256.0 } else { 0.0 };
    let place = open.light.uv_error + (sampler + f.major * f.error) / view.map_extent() + ROUNDING * uv.abs();
    let level_error = if across > 1.0 || f.major * (1.0 + f.error) > 1.0 && f.minor * (1.0 + f.error) > 1.0 {
        2.0 * f.error + if settings.sampled { 1.0 / 256.0 } else { 0.0 } + 1e-5
    } else {
        0.0
    };
    let mut error = moments.map(|m| ROUNDING * m.abs());
    let own = error;
    let mut others = vec![];
    for axis in [DVec2::X, DVec2::Y] {
        others.push([-1.0, -0.5, 0.5, 1.0].map(|part| lookup(uv + part * place * axis, level, taps)).to_vec());
    }
    if level_error > 0.0 {
        let level = |part: f64| (level + part * level_error).clamp(0.0, last);
        others.push([-1.0, -0.5, 0.5, 1.0].map(|part| lookup(uv, level(part), taps)).to_vec());
    }
    let spread = 2.0 * f.error * ratio;
    let more_or_fewer = [taps_at(ratio - spread), taps_at(ratio + spread)];
    if more_or_fewer != [taps; 2] {
        others.push(more_or_fewer.map(|taps| lookup(uv, level, taps)).to_vec());
    }
    for group in &others {
        for c in 0..4 {
            error[c] += group.iter().map(|o| (o[c] - moments[c]).abs()).fold(0.0, f64::max);
        }
    }

    let half_window = 0.5 * (f64::from(settings.width) + (f.major - 1.0).max(0.0)) / view.map_extent();
    let bias = f64::from(settings.depth_bias);
    let slope = open.plane.slope.abs();
    let rise = slope.dot(half_window);
    let depth = open.light.depth - open.bias - bias * rise;
    let window_error = 0.5 * f.major * f.error / view.map_extent();
    let depth_error = open.light.depth_error
        + open.bias_error
        + bias * (open.plane.error.dot(half_window) + slope.dot(window_error) + ROUNDING * rise)
        + ROUNDING * depth.abs();
    let range = f64::from(settings.range);
    let divisor = 1.0 + range * (1.0 - depth);
    let gradient = 2.0 * (1.0 + range) / (divisor * divisor);
    let x = signed_depth(depth, settings.range);
    Found {
        moments,
        error,
        own,
        others,
        depth: x,
        depth_error: gradient * depth_error + 2.0 * ROUNDING * (x.abs() + 1.0),
    }
}

/// Returns Chebyshev's bound, and by how much it may move. It falls with the receiver's distance from the mean, and grows
/// with the variance.
pub(super) fn chebyshev(
    [mean, square]: [f64; 2],
    error: [f64; 2],
    (t, t_error): (f64, f64),
    (least, least_error): (f64, f64),
) -> (f64, f64) {
    let bound = |d: f64, variance: f64, least: f64| {
        let variance = variance.max(least);
        if d <= 0.0 { 1.0 } else { variance / (variance + d * d) }
    };
    let (d, variance) = (t - mean, square - mean * mean);
    let d_error = t_error + error[0] + ROUNDING * (t.abs() + mean.abs());
    let variance_error = error[1] + 2.0 * mean.abs() * error[0] + ROUNDING * (square.abs() + mean * mean);
    let exact = bound(d, variance, least);
    let low = bound(d + d_error, variance - variance_error, least - least_error);
    let high = bound(d - d_error, variance + variance_error, least + least_error);
    (exact, (exact - low).max(high - exact) + ROUNDING)
}
