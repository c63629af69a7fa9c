//! Shared part of the EDTSM family (Macedo, Apolinário 2018, algorithm 1): hard shadows, their edges, every pixel's distance
//! to the nearest edge, eq. 8, and the mean filter; under an area light also the widths of the penumbrae.

use super::edge_seeds::{EdgeConfig, EdgePoints, EdgeSeeds};
use super::fixed_width::penumbra_width;
use super::mean_filter::MeanFilter;
use super::nearest_edge::{Nearest, NearestEdge, Viewed};
use super::seed_width::{Meet, Metric, WidthConfig};
use super::shared::{PenumbraPush, pixel_list};
use crate::gpu::{Buffer, Image};
use crate::technique::common::blocker_search;
use crate::technique::common::rbsm_receiver::RbsmPush;
use crate::technique::common::receiver;
use crate::technique::common::surface::{EDGE_THRESHOLD, surface_test};
use crate::technique::distance_transform::{Edt, EdtConfig, EdtMethod, MAX_TILE_RADIUS};
use crate::technique::revectorization::rbsm_pass::{Rbsm, RbsmConfig, Revectorization};
use crate::technique::revectorization::revectorized::{self, DEPTH_BIAS, MAX_DISTANCE, NORMAL_OFFSET, RECEIVER, SLACK};
use crate::technique::{PENUMBRA, Param, Passes, Setup};
use crate::{Context, Frame, Inputs, Result};

/// The filter is off by default, since it blurs penumbrae of one width more than it smooths them: without it their error
/// against traced penumbrae is smaller on nearly all scenes. Under an area light, a width of 0.1 changes the error by less than
/// half a percent.
const FILTER_WIDTH: Param = Param::float(
    "filter_width",
    0.0,
    4.0,
    0.0,
    "penumbrae",
    "width of the mean filter, as a share of the penumbra's; 0: no filter",
);

const FILTER_TAPS: Param = Param::odd("filter_taps", 1, 63, 15, "taps", "of the mean filter, along each axis");
const SURFACES: Param = Param::choice(
    "surfaces",
    &["plane", "depth"],
    0,
    "points are on one surface if their positions and normals fit a plane or an even curve, or if their eye depths are alike as in the paper",
);
const SEEDS: Param = Param::choice(
    "seeds",
    &["surface", "any"],
    0,
    "a seed differs from a neighbour on its surface, or on any as in the paper",
);
const NEAREST: Param = Param::choice(
    "nearest",
    &["world", "pixel"],
    0,
    "the edge nearest in the world, of those on the surface, or the one nearest in the image as in the paper",
);
const SEED_SHAPE: Param = Param::choice(
    "seed_shape",
    &["line", "point"],
    0,
    "seeds are short lines along the edge, of which a pixel measures few, or points, of which it measures many; lines need nearest=world, edge=traced and, under an area light, meet=weighted and filter_unit=penumbrae",
);
const EDT: Param = Param::choice(
    "edt",
    &["auto", "pba", "bounded-row", "bounded-tile"],
    0,
    "method of the Euclidean distance transform: the same image, but for bounded-tile, which ends at 64 pixels",
);
const EDGE: Param = Param::choice(
    "edge",
    &["traced", "between", "pixel"],
    0,
    "edges run where the hard shadow ends between two pixels, half-way between them, or through both as in the paper",
);
const SKIP: Param = Param::choice(
    "skip",
    &["auto", "off"],
    0,
    "only tiles within reach of an edge are worked on, or all: the same image",
);

/// Makes a table of the given rows and those that all techniques of the family have.
macro_rules! table {
    ($($own:expr,)*) => {
        [
            $($own,)*
            FILTER_TAPS,
            SURFACES,
            EDGE_THRESHOLD,
            SEEDS,
            NEAREST,
            EDT,
            EDGE,
            RECEIVER,
            MAX_DISTANCE,
            NORMAL_OFFSET,
            DEPTH_BIAS,
            SLACK,
            SKIP,
        ]
    };
}

/// The table for penumbrae of one width.
pub(super) const PARAMS: &[Param] = &table![PENUMBRA, FILTER_WIDTH, SEED_SHAPE,];

/// Returns the table for penumbrae of an area light with two defaults; that of `metric` is an index.
pub(super) const fn soft_params(metric: usize, line_taps: i64) -> [Param; 23] {
    table![
        SEED_SHAPE,
        Param::float(
            "beta",
            0.0,
            1e9,
            1.0,
            "factor",
            "of the penumbrae's widths, which are in world units: 1 is as wide as similar triangles say. The paper's 750 turns its light-space widths into world units, so it is 1 here"
        ),
        blocker_search::SEARCH_TAPS,
        blocker_search::SEARCH,
        blocker_search::MEAN,
        Param::choice(
            "meet",
            &["weighted", "nearest"],
            0,
            "where penumbrae overlap the edge counts whose distance is the smallest share of its penumbra's width, or the nearest as in the paper",
        ),
        Param::choice(
            "metric",
            &["light", "world"],
            metric,
            "distances on a plane parallel to the map, taken there along the light, or along the surface as in the paper",
        ),
        Param::int(
            "line_taps",
            0,
            64,
            line_taps,
            "taps",
            "across a penumbra, of the hard shadows beyond the nearest edge; 0: as if there were none, as in the paper",
        ),
        Param {
            unit: "filter_unit",
            help: "width of the mean filter, in the unit that filter_unit names; 0: no filter",
            ..FILTER_WIDTH
        },
        Param::choice(
            "filter_unit",
            &["penumbrae", "world"],
            0,
            "the filter's width is a share of each penumbra's, or one width in world units for all as in the paper",
        ),
    ]
}

/// Radius of the transform, pixels, if its labels only start the search for the edge nearest in the world.
const START_RADIUS: u32 = 32;

/// Width of the penumbrae.
#[derive(Clone, Copy)]
enum Penumbrae {
    /// One width for all, world units; 0 for one that fits the light.
    Fixed(f64),
    /// Widths that the area light gives, times `beta`.
    OfLight { beta: f32 },
}

struct Euclidean {
    hard: Rbsm,
    seeds: EdgeSeeds,
    edt: Edt,
    nearest: NearestEdge,
    /// Absent if neither the filter has a width nor penumbrae have widths of their own.
    filter: Option<MeanFilter>,
    push: RbsmPush,
    penumbrae: Penumbrae,
    /// Width of the filter as a share of the penumbra's.
    filter_width: f64,
    tolerance: f32,
}

/// Makes a technique with penumbrae of one width over the given hard shadows.
pub(super) fn prepare(context: &Context, setup: &Setup, revectorization: Revectorization) -> Result<Box<dyn Passes>> {
    let penumbrae = Penumbrae::Fixed(setup.params.get("penumbra"));
    prepare_either(context, setup, revectorization, (penumbrae, None))
}

/// Makes a technique with penumbrae of an area light over the given hard shadows.
pub(super) fn prepare_soft(
    context: &Context,
    setup: &Setup,
    revectorization: Revectorization,
) -> Result<Box<dyn Passes>> {
    let p = &setup.params;
    let config = WidthConfig {
        search_taps: p.int("search_taps"),
        window: blocker_search::search_window(p),
        meet: if p.word("meet") == "weighted" { Meet::Weighted } else { Meet::Nearest },
        metric: if p.word("metric") == "light" { Metric::Light } else { Metric::World },
        line_taps: p.int("line_taps"),
        mean_depth: blocker_search::averages_depths(p),
        fixed_depth: receiver::is_fixed(p),
        filter_in_world: p.word("filter_unit") == "world",
    };
    let penumbrae = Penumbrae::OfLight { beta: p.float("beta") };
    prepare_either(context, setup, revectorization, (penumbrae, Some(config)))
}

fn prepare_either(
    context: &Context,
    setup: &Setup,
    revectorization: Revectorization,
    (penumbrae, widths): (Penumbrae, Option<WidthConfig>),
) -> Result<Box<dyn Passes>> {
    let (p, extent) = (&setup.params, setup.extent);
    // Intermediate images need all tiles.
    let skip = p.word("skip") != "off" && !setup.intermediates;
    let (surfaces, tolerance) = surface_test(p);
    // On a CPU tiles gain more without an edge in view than they cost with many: little beside the passes that follow.
    let hard = RbsmConfig {
        listed: skip,
        by_tiles: skip && context.device().is_cpu(),
        ..revectorized::config(setup, revectorization)
    };
    let points = match p.word("edge") {
        "traced" => EdgePoints::Traced(hard),
        "between" => EdgePoints::Between,
        _ => EdgePoints::Pixels,
    };
    let weighted = |w: WidthConfig| w.meet == Meet::Weighted && !w.filter_in_world;
    let lines =
        p.word("seed_shape") == "line" && matches!(points, EdgePoints::Traced(_)) && widths.is_none_or(weighted);
    let lines = lines && p.word("nearest") == "world";
    // Taps across a penumbra read other pixels' hard shadows. The search among points does not keep these apart from the
    // visibility, so the filter writes it, even with a width of 0.
    let filtered = p.get("filter_width") > 0.0 || (widths.is_some() && !lines);
    let edges = EdgeConfig { surfaces, any_surface: p.word("seeds") == "any", points, skip, widths, filtered };
    let nearest = match p.word("nearest") {
        _ if lines => Nearest::WorldLine,
        "world" => Nearest::World,
        _ => Nearest::Pixel,
    };
    let method: EdtMethod = p.word("edt").parse()?;
    let edt = EdtConfig {
        method,
        // The search in the world carries labels farther.
        radius: match nearest {
            Nearest::World | Nearest::WorldLine => Some(START_RADIUS),
            Nearest::Pixel if method == EdtMethod::BoundedTile => Some(MAX_TILE_RADIUS),
            Nearest::Pixel => None,
        },
        ..EdtConfig::default()
    };
    let pixels = pixel_list(context, extent)?;
    Ok(Box::new(Euclidean {
        hard: Rbsm::sharing(context, extent, setup.map_size, hard, Some(&pixels))?,
        seeds: EdgeSeeds::new(context, extent, setup.map_size, edges, &pixels)?,
        edt: Edt::sharing(context, extent, edt, Some(&pixels))?,
        nearest: NearestEdge::new(context, setup, edges, nearest, &pixels)?,
        filter: if filtered { Some(MeanFilter::new(context, extent, edges, p.int("filter_taps"))?) } else { None },
        push: revectorized::push(setup),
        penumbrae,
        filter_width: p.get("filter_width"),
        tolerance,
    }))
}

impl Passes for Euclidean {
    fn record(&mut self, frame: &mut Frame<'_>, view: &Buffer, inputs: &Inputs<'_>, visibility: &Image) -> Result<()> {
        // If widths differ, each penumbra is measured in its own width.
        let (penumbra, beta) = match self.penumbrae {
            Penumbrae::Fixed(width) => (penumbra_width(width, &inputs.light[0]), 0.0),
            Penumbrae::OfLight { beta } => (1.0, beta),
        };
        let push = PenumbraPush {
            penumbra: penumbra as f32,
            filter_width: (self.filter_width * penumbra) as f32,
            tolerance: self.tolerance,
            step: 0,
            beta,
            normal_offset: self.push.normal_offset,
            depth_bias: self.push.depth_bias,
        };
        self.hard.record(frame, view, inputs, self.push, visibility)?;
        self.seeds.record(frame, view, inputs, (push, self.push), (visibility, self.edt.seed_bits()))?;
        self.edt.record_packed(frame)?;
        self.nearest.record(frame, view, inputs, push, (&self.seeds, self.edt.labels(), visibility))?;
        if let Some(filter) = &self.filter {
            filter.record(frame, view, inputs, push, (&self.seeds, &self.nearest), visibility)?;
        }
        Ok(())
    }

    fn intermediates(&self) -> Vec<(&'static str, &Image)> {
        let Some(Viewed { seeds, labels, distances, widths }) = self.nearest.viewed() else { return vec![] };
        let intensity = self.nearest.intensity();
        let shared = [("seeds", seeds), ("labels", labels), ("distance", distances), ("intensity", intensity)];
        shared.into_iter().chain(widths.map(|widths| ("width", widths))).collect()
    }

    fn memory_bytes(&self) -> u64 {
        let passes = [
            // The list of pixels is among it.
            self.hard.memory_bytes(),
            self.seeds.memory_bytes(),
            self.edt.memory_bytes(),
            self.nearest.memory_bytes(),
            self.filter.as_ref().map_or(0, MeanFilter::memory_bytes),
        ];
        passes.iter().sum::<u64>()
    }
}
