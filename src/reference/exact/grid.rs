//! Mirror of the receivers' places and depths in the light's grid, of the depths of blocks, and of the lists' starts.

use crate::Result;
use crate::reference::caster_edges::shadow_volumes::Caster;
use crate::reference::common::view::{Decision, FrameData, LightPoint, ROUNDING, Receiver, Verdict, View};
use crate::view::LightView;
use glam::{DVec2, DVec3, Vec3};

/// `POSITION_ULPS` of `glsl/lib/shadow_test.glsl`.
const POSITION_ULPS: f64 = 4.0 / 8388608.0;
/// `RASTER_DEPTH` of `grid_receiver.glsl`.
const RASTER_DEPTH: f64 = 1.0 / 16777216.0;
/// `RASTER_MOST` of `grid_receiver.glsl`.
const RASTER_MOST: f64 = 1.0 / 1024.0;

/// Cosine between normal and light below which the receiver's plane, and how far it moves, are in doubt.
pub(super) const GRAZING: f64 = 1e-3;

/// A receiver that casters decide.
#[derive(Clone, Copy, Debug)]
pub(super) struct GridReceiver {
    pub receiver: Receiver,
    pub light: LightPoint,
    /// Distance by which the receiver moves towards the light, world units, and the bound of its error.
    pub step: f64,
    pub step_error: f64,
    /// Cosine between normal and the direction to the light.
    pub facing: f64,
    /// Visibility if an earlier decision in doubt goes the other way.
    otherwise: Option<f64>,
}

impl GridReceiver {
    /// A receiver at the origin that faces the light.
    #[cfg(test)]
    pub fn at_origin(normal: DVec3) -> Self {
        let receiver =
            Receiver { position: DVec3::ZERO, position_error: DVec3::ZERO, normal, normal_error: 0.0, allowance: 0.0 };
        let light = LightPoint {
            uv: DVec2::splat(0.5),
            uv_error: DVec2::ZERO,
            depth: 0.5,
            depth_error: 0.0,
            w: 1.0,
            w_error: 0.0,
            ndc: DVec2::ZERO,
            ndc_error: DVec2::ZERO,
            inside: Decision::Yes,
            within_sides: Decision::Yes,
        };
        Self { receiver, light, step: 0.0, step_error: 0.0, facing: 1.0, otherwise: None }
    }

    /// Adds the doubts of the earlier decisions.
    pub fn with_doubts(&self, verdict: Verdict) -> Verdict {
        self.otherwise.map_or(verdict, |v| verdict.or(v))
    }
}

/// Returns the greatest distance of vertices from the origin of their mesh's space, world units, over the meshes that lie
/// apart from it by more than their diameter.
pub(super) fn far_vertices(casters: &[Caster<'_>]) -> f64 {
    let mut most: f64 = 0.0;
    for c in casters {
        let used: Vec<DVec3> =
            c.topology.triangles.iter().flatten().map(|&v| Vec3::from(c.positions[v as usize]).as_dvec3()).collect();
        let Some(&first) = used.first() else { continue };
        let (low, high) = used.iter().fold((first, first), |(l, h), &p| (l.min(p), h.max(p)));
        let center = 0.5 * (low + high);
        let radius = used.iter().map(|p| p.distance(center)).fold(0.0, f64::max);
        if center.length() > 2.0 * radius {
            let m = c.world_from_object.matrix3;
            let scale = m.x_axis.length().max(m.y_axis.length()).max(m.z_axis.length());
            most = most.max(scale * (center.length() + radius));
        }
    }
    most
}

/// State of a pixel before any caster is read.
pub(super) enum Place {
    /// The pixel is sky, faces away from the light, or lies outside the light's frustum.
    Decided(Verdict),
    Open(Box<GridReceiver>),
}

/// Mirror of `gridReceiver` of `grid_receiver.glsl`. `far_vertices` comes from [`far_vertices`].
pub(super) fn place(view: &View<'_>, far_vertices: f64, pixel: [usize; 2]) -> Place {
    let decided = |v| Place::Decided(Verdict::sure(v));
    let doubtful = |v: f64| Place::Decided(Verdict::sure(v).or(1.0 - v));
    let Some(r) = view.receiver(pixel) else { return decided(1.0) };
    let mut otherwise = None;
    match view.faces_light(&r) {
        Decision::No => return decided(0.0),
        Decision::Doubtful(false) => return doubtful(0.0),
        Decision::Doubtful(true) => otherwise = Some(0.0),
        Decision::Yes => {}
    }
    let light = view.light_point(r.position, r.position_error);
    match light.inside {
        Decision::No => return decided(1.0),
        Decision::Doubtful(false) => return doubtful(1.0),
        Decision::Doubtful(true) => otherwise = Some(otherwise.unwrap_or(1.0)),
        Decision::Yes => {}
    }
    let (towards, towards_error) = view.towards_light(r.position, r.position_error);
    let facing = r.normal.dot(towards);
    let away = view.light_distance(r.position).unwrap_or_else(|| view.frustum_extent(&light));
    let raised = view.position_at(pixel, view.depth_at(pixel) + RASTER_DEPTH).0;
    let raster = r.normal.dot(raised - r.position).abs().min(RASTER_MOST * r.position.length());
    let step = (r.allowance + POSITION_ULPS * (r.position.length() + away + far_vertices) + raster) / facing;
    let facing_error = r.normal_error + towards_error + ROUNDING;
    let step_error = step * (facing_error / facing + 8.0 * ROUNDING) + 2.0 * r.position_error.length() / facing;
    Place::Open(Box::new(GridReceiver { receiver: r, light, step, step_error, facing, otherwise }))
}

/// A receiver in the light's grid.
#[derive(Clone, Copy, Debug)]
pub struct Seen {
    /// Place in the light's image, in [-1, 1].
    pub ndc: DVec2,
    /// Bound of the error of `ndc`.
    pub ndc_error: DVec2,
    /// -1/w of a spot light, the map's depth of a sun.
    pub depth: f64,
    /// Bound of the error of `depth`.
    pub depth_error: f64,
    /// `false` if it is in doubt whether casters decide the pixel, or how deep it lies.
    pub sure: bool,
}

impl Seen {
    /// Cells that the receiver may lie in, in a grid with `cells` along each side.
    pub fn cells(&self, cells: u32) -> Vec<usize> {
        let n = cells as usize;
        let at = |v: f64| ((0.5 * v + 0.5) * f64::from(cells)).clamp(0.0, f64::from(cells) - 1.0) as usize;
        let e = self.ndc_error + f64::from(f32::EPSILON);
        let columns = at(self.ndc.x - e.x)..=at(self.ndc.x + e.x);
        columns.flat_map(|x| (at(self.ndc.y - e.y)..=at(self.ndc.y + e.y)).map(move |y| y * n + x)).collect()
    }
}

/// Returns the receiver of every pixel that casters decide. `None` for the others.
///
/// # Errors
/// Fails if the images do not fit the constants.
pub fn receivers(data: &FrameData<'_>, light: &LightView, casters: &[Caster<'_>]) -> Result<Vec<Option<Seen>>> {
    let view = View::new(data)?;
    let far = far_vertices(casters);
    Ok(view.every_pixel(|pixel| {
        let g = match place(&view, far, pixel) {
            Place::Open(g) => g,
            Place::Decided(verdict) if verdict.doubt > 0.0 => {
                let l = view.light_point(view.receiver(pixel)?.position, DVec3::ZERO);
                return Some(Seen {
                    ndc: l.ndc,
                    ndc_error: l.ndc_error,
                    depth: l.depth,
                    depth_error: f64::INFINITY,
                    sure: false,
                });
            }
            Place::Decided(_) => return None,
        };
        let l = &g.light;
        let (depth, depth_error) = if light.is_directional() {
            let range = 1.0 / light.clip_from_view.z_axis.z.abs();
            (l.depth - g.step / range, l.depth_error + (g.step_error + ROUNDING * g.step) / range)
        } else {
            let away = view.light_distance(g.receiver.position)?;
            let closer = (1.0 - g.step / away).max(1e-3);
            let depth = -1.0 / (l.w * closer);
            (depth, depth.abs() * (l.w_error / l.w + g.step_error / away / closer + 2.0 * ROUNDING))
        };
        Some(Seen {
            ndc: l.ndc,
            ndc_error: l.ndc_error,
            depth,
            depth_error,
            sure: g.otherwise.is_none() && g.facing > GRAZING,
        })
    }))
}

/// Maps a depth to an integer of the same order, as `orderedBits` of `grid.glsl` does: 0 stands for "no receiver".
pub fn ordered_bits(depth: f32) -> u32 {
    let u = depth.to_bits();
    if u & 0x8000_0000 != 0 { !u } else { u | 0x8000_0000 }
}

/// Inverse of [`ordered_bits`].
pub fn ordered_float(bits: u32) -> f32 {
    f32::from_bits(if bits & 0x8000_0000 != 0 { bits & 0x7FFF_FFFF } else { !bits })
}

/// Greatest value of each block of 4, 16 and 64 cells along each side, row by row and one level after the other, and
/// of all cells: what follows the cells in the array of depths.
pub fn levels(depths: &[u32], cells: usize) -> Vec<u32> {
    let mut found = vec![];
    for block in [4, 16, 64] {
        let side = cells / block;
        for i in 0..side * side {
            let (x, y) = (i % side * block, i / side * block);
            let rows = (y..y + block).map(|row| &depths[row * cells + x..][..block]);
            found.push(rows.flatten().copied().max().unwrap_or(0));
        }
    }
    found.push(depths.iter().copied().max().unwrap_or(0));
    found
}

/// Place at which each cell's list starts, and the end of the last one.
pub fn starts(counts: &[u32]) -> Vec<u32> {
    let mut sum = 0;
    std::iter::once(0).chain(counts.iter().map(|n| (sum += n, sum).1)).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bits_keep_the_order_of_depths() {
        let depths = [f32::NEG_INFINITY, -3e38, -2.0, -1e-30, -0.0, 0.0, 1e-30, 0.5, 1.0];
        let bits = depths.map(ordered_bits);
        assert!(bits.is_sorted() && bits[0] > 0, "{bits:?}");
        assert_eq!(bits.map(ordered_float).map(f32::to_bits), depths.map(f32::to_bits));
    }

    #[test]
    fn starts_and_levels_of_known_cells() {
        assert_eq!(starts(&[2, 0, 3]), [0, 2, 2, 5]);
        let mut depths = vec![0; 128 * 128];
        depths[5 * 128 + 70] = 9;
        depths[127 * 128 + 3] = 4;
        let found = levels(&depths, 128);
        assert_eq!(found.len(), 32 * 32 + 8 * 8 + 2 * 2 + 1);
        let set: Vec<_> = (0..found.len()).filter(|&i| found[i] > 0).map(|i| (i, found[i])).collect();
        let (two, three) = (32 * 32, 32 * 32 + 64);
        assert_eq!(
            set,
            [(32 + 17, 9), (31 * 32, 4), (two + 4, 9), (two + 56, 4), (three + 1, 9), (three + 2, 4), (three + 4, 9)]
        );
    }
}
