//! Mirror of `glsl/filtering/pcf.comp` and `pcf_classify.comp`.

use crate::Result;
use crate::reference::common::depth_bounds;
use crate::reference::common::map_receiver::{MapReceiver, OpenReceiver, receive};
use crate::reference::common::view::{Decision, FrameData, Mirror, ROUNDING, Verdict, View, shadow_test};
use crate::technique::common::tiles::TILE;
use glam::DVec2;

/// Settings of the filter.
#[derive(Clone, Copy, Debug)]
pub struct Settings {
    /// Side of the kernel, texels; odd.
    pub width: u32,
    /// Averages single texels without bilinear weights.
    pub nearest: bool,
    /// Compares all texels with the receiver's own depth.
    pub fixed_depth: bool,
    /// Normal offset, in multiples of what a plane needs.
    pub normal_offset: f32,
    /// Depth bias, as a fraction of the depth slope per texel, summed over both axes.
    pub depth_bias: f32,
}

/// Number of tiles that `pcf_classify` lists: a range, because rounding may decide some of them.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Listed {
    /// Number of tiles with a pixel that is certainly undecided.
    pub least: u32,
    /// Number of tiles with a pixel that may be undecided.
    pub most: u32,
}

/// Position of a kernel in the map.
struct Kernel {
    base: [i64; 2],
    fraction: DVec2,
    fraction_error: DVec2,
    /// Receiver position, texels, in coordinates where the centre of texel `base` is at `base`.
    center: DVec2,
    reference: f64,
    reference_error: f64,
    slope: DVec2,
    slope_error: DVec2,
}

/// Returns the filtered visibility of every pixel.
///
/// # Errors
/// Fails if the images do not fit the constants.
pub fn visibility(data: &FrameData<'_>, settings: &Settings) -> Result<Mirror> {
    let view = View::new(data)?;
    let pixels = view.every_pixel(|p| match receive(&view, p, settings.normal_offset, settings.depth_bias) {
        MapReceiver::Decided(verdict) => verdict,
        MapReceiver::Open(r) => {
            let k = kernel(&view, &r, settings);
            let width = settings.width.into();
            r.with_doubts(if settings.nearest { filter_nearest(&view, &k, width) } else { filter(&view, &k, width) })
        }
    });
    Ok(Mirror::collect(pixels))
}

/// Returns the number of tiles of `TILE` x `TILE` pixels that the depth bounds of the map's blocks leave to the
/// filter.
///
/// # Errors
/// Fails if the images do not fit the constants.
pub fn listed(data: &FrameData<'_>, settings: &Settings) -> Result<Listed> {
    let view = View::new(data)?;
    let levels = depth_bounds::blocks(data.shadow_map, data.constants.map_size);
    let open = view.every_pixel(|p| match receive(&view, p, settings.normal_offset, settings.depth_bias) {
        MapReceiver::Decided(verdict) if verdict.doubt > 0.0 => Decision::Doubtful(false),
        MapReceiver::Decided(_) => Decision::No,
        MapReceiver::Open(r) => {
            let decision = is_open(&view, &levels, &kernel(&view, &r, settings), settings.width.into());
            if r.is_doubtful() { Decision::Doubtful(decision.is_yes()) } else { decision }
        }
    });
    let tile = TILE as usize;
    let mut listed = Listed::default();
    for y in (0..view.size[1]).step_by(tile) {
        for x in (0..view.size[0]).step_by(tile) {
            let rows = y..(y + tile).min(view.size[1]);
            let columns = x..(x + tile).min(view.size[0]);
            let pixels = rows.flat_map(|j| columns.clone().map(move |i| (i, j)));
            let tile: Vec<_> = pixels.map(|(i, j)| open[j * view.size[0] + i]).collect();
            listed.least += u32::from(tile.contains(&Decision::Yes));
            listed.most += u32::from(tile.iter().any(|&d| d != Decision::No));
        }
    }
    Ok(listed)
}

fn kernel(view: &View<'_>, r: &OpenReceiver, settings: &Settings) -> Kernel {
    let (l, plane) = (&r.light, &r.plane);
    let extent = view.map_extent();
    let half = i64::from(settings.width - 1) / 2;
    // The texel that the point falls into, or the first of the four around it.
    let grid = if settings.nearest { 0.5 } else { 0.0 };
    let flat = if settings.fixed_depth { 0.0 } else { 1.0 };
    let center = l.uv * extent - 0.5;
    let center_error = l.uv_error * extent + ROUNDING * center.abs();
    let first = (center + grid).floor();
    let base = [first.x as i64 - half, first.y as i64 - half];
    let (slope, slope_error) = (flat * plane.slope / extent, flat * plane.error / extent);
    let to_base = vector(base) - center;
    Kernel {
        base,
        fraction: center + grid - first,
        fraction_error: center_error,
        center,
        reference: l.depth - r.bias + slope.dot(to_base),
        reference_error: l.depth_error
            + r.bias_error
            + slope.abs().dot(center_error)
            // Sums of terms of this size are rounded on the way.
            + ROUNDING * (1.0 + 2.0 * slope.abs().dot(to_base.abs())),
        slope,
        slope_error,
    }
}

/// Returns the reference depth of a tap and the bound of its error.
fn reference(k: &Kernel, tap: DVec2) -> (f64, f64) {
    let away = (vector(k.base) + tap - k.center).abs();
    let error = k.reference_error + k.slope_error.dot(away) + ROUNDING * k.slope.abs().dot(tap);
    (k.reference + k.slope.dot(tap), error)
}

fn weight(i: i64, fraction: f64, width: i64) -> f64 {
    match i {
        0 => 1.0 - fraction,
        i if i == width => fraction,
        _ => 1.0,
    }
}

fn filter(view: &View<'_>, k: &Kernel, width: i64) -> Verdict {
    let (mut sum, mut doubtful, mut lit) = (0.0, 0.0, 0);
    for j in 0..=width {
        for i in 0..=width {
            let (depth, error) = reference(k, glam::dvec2(i as f64, j as f64));
            let test = shadow_test(depth, error, view.stored([k.base[0] + i, k.base[1] + j]));
            let weight = weight(i, k.fraction.x, width) * weight(j, k.fraction.y, width);
            if test.is_yes() {
                sum += weight;
                lit += 1;
            }
            if test.is_doubtful() {
                doubtful += weight;
            }
        }
    }
    let taps = (width + 1) * (width + 1);
    let area = (width * width) as f64;
    let visibility = match lit {
        0 => 0.0,
        n if n == taps => 1.0,
        _ => (sum / area).clamp(0.0, 1.0),
    };
    // The kernel is displaced by the error of its position; this changes at most a row and a column at its sides.
    let uniform = lit == 0 || lit == taps;
    let slid = (k.fraction_error.x + k.fraction_error.y) / width as f64;
    // Sums of up to 64 x 64 terms are rounded at each addition.
    let rounding = slid + if uniform { 0.0 } else { ROUNDING * (width + 1) as f64 };
    Verdict { visibility, doubt: (doubtful / area).min(1.0), rounding }
}

/// Mirror of `pcfNearest`, with every kernel that rounding may lead to.
fn filter_nearest(view: &View<'_>, k: &Kernel, width: i64) -> Verdict {
    let at = |base: [i64; 2]| {
        let (mut lit, mut doubtful) = (0.0, 0.0);
        for j in 0..width {
            for i in 0..width {
                let texel = [base[0] + i, base[1] + j];
                let (depth, error) = reference(k, vector(texel) - vector(k.base));
                let test = shadow_test(depth, error, view.stored(texel));
                lit += f64::from(u8::from(test.is_yes()));
                doubtful += f64::from(u8::from(test.is_doubtful()));
            }
        }
        let area = (width * width) as f64;
        Verdict { visibility: lit / area, doubt: doubtful / area, rounding: ROUNDING }
    };
    let moves = |axis: usize| {
        let (f, e) = (k.fraction[axis], k.fraction_error[axis]);
        [(true, 0), (f < e, -1), (f > 1.0 - e, 1)].into_iter().filter(|m| m.0).map(|m| m.1)
    };
    let mut verdict: Option<Verdict> = None;
    for y in moves(1) {
        for x in moves(0) {
            let moved = at([k.base[0] + x, k.base[1] + y]);
            verdict = Some(verdict.map_or(moved, |likely| likely.or_verdict(moved)));
        }
    }
    // The first move, none, is always there.
    verdict.unwrap_or(Verdict::ANYTHING)
}

/// Decides whether the depth bounds leave the pixel undecided.
fn is_open(view: &View<'_>, levels: &[depth_bounds::Level], k: &Kernel, width: i64) -> Decision {
    // If rounding moved the kernel by a texel, it may have read other blocks.
    let moved = (0..2).any(|i| {
        let (f, e) = (k.fraction[i], k.fraction_error[i]);
        f < e || f > 1.0 - e
    });
    let map = view.map_size.map(|n| n as i64);
    let last = k.base.map(|b| b + width);
    if (0..2).any(|i| k.base[i] < 0 || last[i] >= map[i]) {
        return if moved { Decision::Doubtful(true) } else { Decision::Yes };
    }
    let level = match width {
        ..8 => 0,
        8..16 => 1,
        16..32 => 2,
        _ => 3,
    };
    let size = 8 << level;
    let (mut lit, mut dark) = (Decision::Yes, Decision::Yes);
    for y in k.base[1] / size..=last[1] / size {
        for x in k.base[0] / size..=last[0] / size {
            let bounds = levels[level].at([x as usize, y as usize]);
            let corner = [size * x, size * y];
            let low = corner_vector(k.base, corner, i64::max);
            let high = corner_vector(last, corner.map(|c| c + size - 1), i64::min);
            let (middle, half) = (0.5 * (low + high), 0.5 * (high - low));
            let from_block = middle - vector(corner) - 0.5 * (size as f64 - 1.0);
            let reach = bounds.slope.abs().dot(half);
            let (depth, error) = reference(k, middle - vector(k.base));
            let stored = bounds.slope.dot(from_block);
            let all = (k.slope.abs() + bounds.slope.abs()).dot(DVec2::splat(size as f64));
            let rounding = 2.5e-7 + 5e-7 * all;
            let slack = (k.slope - bounds.slope).abs().dot(half) + rounding;
            // The bounds themselves are rounded once per level.
            let error = error + k.slope_error.dot(half) + 2.0 * ROUNDING * (1.0 + all);
            lit = lit.and(Decision::positive(stored + bounds.low - depth - slack, error));
            dark = dark.and(Decision::positive(depth - slack - stored - bounds.high, error));
            dark = dark.and(Decision::positive(
                1.0 - (stored + bounds.high + reach + if reach > 0.0 { rounding } else { 0.0 }),
                error,
            ));
        }
    }
    let open = !lit.is_yes() && !dark.is_yes();
    if moved || lit.is_doubtful() || dark.is_doubtful() {
        Decision::Doubtful(open)
    } else if open {
        Decision::Yes
    } else {
        Decision::No
    }
}

fn vector(v: [i64; 2]) -> DVec2 {
    glam::dvec2(v[0] as f64, v[1] as f64)
}

fn corner_vector(a: [i64; 2], b: [i64; 2], pick: fn(i64, i64) -> i64) -> DVec2 {
    vector([pick(a[0], b[0]), pick(a[1], b[1])])
}
