//! Mirror of `moment_window.glsl`: windows of a summed-area table under a receiver of an area light.
//!
//! The result is a smooth function of what rounding moves, apart from the places where a decision goes the other way. So
//! the bound is measured: the pixel is computed again with each of these quantities moved to either end of its own bound,
//! and the changes are added. Where they are large, the pixel is a tie.

use crate::Result;
use crate::reference::common::area_light::AreaLight;
use crate::reference::common::blockers::{self, Bounded, Class, Classified, MapClasses, SearchForm, SoftReceiver};
use crate::reference::common::map_receiver::{MapReceiver, receive};
use crate::reference::common::view::{FrameData, Mirror, ROUNDING, Verdict, View};
use crate::reference::filtering::moments::signed_depth;
use crate::reference::filtering::summed_area::Sums;
use crate::technique::common::blocker_search::SearchWindow;
use glam::DVec2;

/// `NARROWEST_FILTER` and `NARROWEST_SEARCH` of the shader, texels.
const NARROWEST: [f64; 2] = [0.5, 1.0];
/// Change of a pixel by rounding above which it counts as a tie.
const TIE: f64 = 0.01;

/// Settings that both techniques have.
#[derive(Clone, Copy, Debug)]
pub struct Settings {
    /// Widest window, texels.
    pub window: u32,
    /// Rule for the size of the search window.
    pub search: SearchWindow,
    /// Depth bounds of the map decide windows that are all lit or all in shadow.
    pub classify: bool,
    /// Normal offset, in multiples of what a plane needs.
    pub normal_offset: f32,
    /// Share of the rise of the receiver's plane from a window's middle to its corner.
    pub depth_bias: f32,
    /// Largest visibility that counts as shadow.
    pub reduction: f32,
    /// Far over near, minus 1; 0 for a parallel light.
    pub range: f32,
    /// Integer that stands for 1 in the table.
    pub scale: f32,
}

/// Shifts of the quantities that rounding may move, each as a multiple of its bound.
#[derive(Clone, Copy, Default)]
struct Moved {
    at: DVec2,
    depth: f64,
    search: f64,
    /// Sides of both windows, outwards.
    sides: f64,
    z: f64,
    /// Width of the second window.
    filter: f64,
    /// Mean moments of each window.
    moments: [[f64; 4]; 2],
    /// Powers that each window's moments are unpacked to.
    powers: [[f64; 4]; 2],
}

/// One of the two windows.
#[derive(Clone, Copy, PartialEq)]
pub(super) enum Query {
    Search,
    Filter,
}

/// Part of a window that lies in the map.
pub(super) struct Window {
    pub low: DVec2,
    pub high: DVec2,
    /// Signed depth of the receiver, bias subtracted.
    pub t: f64,
    query: Query,
}

/// A pixel under one of the windows that rounding may lead to, with everything moved in one direction.
pub(super) struct Pixel<'a> {
    view: &'a View<'a>,
    light: &'a AreaLight,
    sums: &'a Sums,
    settings: &'a Settings,
    receiver: &'a SoftReceiver,
    /// Half-width of the search window, uv.
    search: Bounded<DVec2>,
    /// Least signed depth in it.
    pub nearest: f64,
    moved: Moved,
}

impl Pixel<'_> {
    fn z(&self) -> f64 {
        self.receiver.z.value + self.moved.z * self.receiver.z.error
    }

    fn search_uv(&self) -> DVec2 {
        self.search.value + self.moved.search * self.search.error
    }

    /// Mirror of `windowOf` over a half-width in texels.
    fn window(&self, half: DVec2, query: Query) -> Window {
        let r = self.receiver;
        let h = half.min(DVec2::splat(0.5 * (f64::from(self.settings.window) - 1.0)));
        let at = r.at.value + self.moved.at * r.at.error;
        let sides = h + self.moved.sides * ROUNDING * (at.abs() + h);
        let extent = self.view.map_extent();
        let bias = f64::from(self.settings.depth_bias);
        let depth = r.depth.value - bias * r.slope.value.abs().dot(h);
        let error = r.depth.error + bias * r.slope.error.dot(h) + ROUNDING * depth.abs();
        // The slope of the signed depth carries the depth's error on.
        let x = |d: f64| signed_depth(d, self.settings.range);
        let step = (x(depth + error) - x(depth - error)).abs() * 0.5 + ROUNDING;
        Window {
            low: (at - sides).clamp(DVec2::ZERO, extent),
            high: (at + sides).clamp(DVec2::ZERO, extent),
            t: x(depth) + self.moved.depth * step,
            query,
        }
    }

    /// Returns the window in which blockers are searched.
    pub fn search_window(&self) -> Window {
        self.window((self.search_uv() * self.view.map_extent()).min(DVec2::splat(65536.0)), Query::Search)
    }

    /// Returns the window over which visibility is filtered, for blockers at a mean signed depth.
    pub fn filter_window(&self, blocker: f64) -> Window {
        let part = 0.5 * blocker + 0.5;
        let distance = match self.light.depth_scale > 0.0 {
            true => self.light.near() * (1.0 + f64::from(self.settings.range) * part),
            false => self.light.depth_offset * part,
        };
        let uv = self.light.filter_half_width(self.z(), distance).min(self.search_uv());
        let between = (self.z() - distance).max(f64::MIN_POSITIVE);
        // Both distances are rounded, and their difference may be much smaller.
        let relative = 2.0 * ROUNDING + (ROUNDING * distance + self.receiver.z.error) / between;
        let half =
            (uv * self.view.map_extent() * (1.0 + self.moved.filter * relative.min(1.0))).min(DVec2::splat(65536.0));
        self.window(half.max(DVec2::splat(NARROWEST[0])), Query::Filter)
    }

    /// Returns the mean of the table's moments over a part of a window.
    pub fn mean(&self, window: &Window, low: DVec2, high: DVec2) -> [f64; 4] {
        let moved = self.moved.moments[window.query as usize];
        let mean = self.sums.mean(low, high, self.settings.scale);
        std::array::from_fn(|c| mean[c] * (1.0 + moved[c] * ROUNDING))
    }

    /// Moves moments by what single precision makes of a reconstruction.
    pub fn reconstructed(&self, window: &Window, b: [f64; 4]) -> [f64; 4] {
        let moved = self.moved.powers[window.query as usize];
        std::array::from_fn(|c| b[c] + moved[c] * 8.0 * f64::from(f32::EPSILON))
    }

    /// Mirror of `reduceLeaking`.
    pub fn reduced(&self, v: f64) -> f64 {
        let reduction = f64::from(self.settings.reduction);
        ((v - reduction) / (1.0 - reduction)).clamp(0.0, 1.0)
    }
}

/// Every quantity in turn, to both ends of its bound and to places between: where the moments leave hardly two depths, the
/// share in front of the receiver goes up and down in between.
fn directions() -> Vec<Vec<Moved>> {
    let along = |set: &dyn Fn(&mut Moved, f64)| {
        let moved = |by: &f64| {
            let mut moved = Moved::default();
            set(&mut moved, *by);
            moved
        };
        [-1.0, -0.3, 0.3, 1.0].iter().map(moved).collect()
    };
    let single: [fn(&mut Moved, f64); 7] = [
        |m, by| m.at.x = by,
        |m, by| m.at.y = by,
        |m, by| m.depth = by,
        |m, by| m.search = by,
        |m, by| m.sides = by,
        |m, by| m.z = by,
        |m, by| m.filter = by,
    ];
    let mut all: Vec<_> = single.iter().map(|set| along(set)).collect();
    for query in [0, 1] {
        for c in 0..4 {
            all.push(along(&|m, by| m.moments[query][c] = by));
            all.push(along(&|m, by| m.powers[query][c] = by));
        }
    }
    all
}

/// Returns the visibility of every pixel from the table that the GPU made; `filtered` is the technique's own part.
pub(super) fn visibility(
    data: &FrameData<'_>,
    table: &[[u32; 4]],
    settings: &Settings,
    filtered: impl Fn(&Pixel<'_>) -> f64 + Sync,
) -> Result<Mirror> {
    let view = View::new(data)?;
    let light = AreaLight::of(data.constants, 0);
    let sums = Sums::of(table, data.constants.map_size);
    let classes = MapClasses::new(data.shadow_map, data.constants.map_size);
    let narrow = (settings.search == SearchWindow::Blockers).then_some(&classes.hsm);
    let directions = directions();
    let pixels = view.every_pixel(|p| match receive(&view, p, settings.normal_offset, 0.0) {
        MapReceiver::Decided(verdict) => verdict,
        MapReceiver::Open(open) => {
            let receiver = SoftReceiver::new(&view, &light, &open, SearchForm::default());
            let Some(windows) = receiver.search_windows(&light, &view, narrow, 1.0) else {
                return open.with_doubts(Verdict::ANYTHING);
            };
            let least = NARROWEST[1] / view.map_extent();
            let windows: Vec<_> = windows.into_iter().map(|w| Bounded { value: w.value.max(least), ..w }).collect();
            let class = match settings.classify {
                true => receiver.classify(&view, &classes, &windows, 0.5),
                false => Classified::sure(Class::Penumbra),
            };
            let mut verdicts = vec![];
            for search in windows.into_iter().filter(|_| class.explains(Class::Penumbra)) {
                let Some(ranges) = receiver.ranges(blockers::texels(&view, search), 0.0) else {
                    return open.with_doubts(Verdict::ANYTHING);
                };
                for [first, last] in ranges {
                    let nearest = signed_depth(classes.hsm.bounds(first, last)[0].into(), settings.range);
                    let pixel = |moved: Moved| Pixel {
                        view: &view,
                        light: &light,
                        sums: &sums,
                        settings,
                        receiver: &receiver,
                        search,
                        nearest,
                        moved,
                    };
                    verdicts.push(measured(&directions, |moved| filtered(&pixel(moved))));
                }
            }
            // The likeliest comes first.
            for (decided, v) in [(Class::Lit, 1.0), (Class::Umbra, 0.0)] {
                if class.explains(decided) {
                    let place = if class.likely == decided { 0 } else { verdicts.len() };
                    verdicts.insert(place, Verdict::sure(v));
                }
            }
            open.with_doubts(verdicts.into_iter().reduce(Verdict::or_verdict).unwrap_or(Verdict::ANYTHING))
        }
    });
    Ok(Mirror::collect(pixels))
}

/// Returns the result with nothing moved, and by how much everything that rounding moves may change it.
fn measured(directions: &[Vec<Moved>], result: impl Fn(Moved) -> f64) -> Verdict {
    let visibility = result(Moved::default());
    let change = |places: &[Moved]| places.iter().map(|m| (result(*m) - visibility).abs()).fold(0.0, f64::max);
    let moved = directions.iter().map(|places| change(places)).sum::<f64>() + ROUNDING;
    match moved > TIE {
        true => Verdict { visibility, doubt: moved.min(1.0), rounding: 0.0 },
        false => Verdict { visibility, doubt: 0.0, rounding: moved },
    }
}
