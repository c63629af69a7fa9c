//! Exact soft shadows.

use super::exact_hard::{CELLS, ENTRIES};
use super::grid::{COARSEST, EdgeLists, GridPush, GridReceivers, TriangleLists};
use super::list_view::ListView;
use crate::gpu::{Buffer, Image, ImageDesc, bindings};
use crate::technique::caster_edges::silhouettes::Silhouettes;
use crate::technique::common::bindings::CameraBindings;
use crate::technique::common::pixels::{COUNT, PixelPass, SKIP, Step, clear_list, pixel_list};
use crate::technique::soft::pcss;
use crate::technique::soft::soft_auto::SoftAuto;
use crate::technique::{Info, Kind, Param, Params, Passes, Setup};
use crate::timing::Counted;
use crate::{Bind, Context, Frame, Inputs, Need, Result};
use std::sync::Arc;

/// The registry entry.
pub const INFO: Info = Info {
    id: "exact-soft",
    title: "Exact soft shadows",
    paper: "this project; after Johnson et al. 2009, Sintorn, Eisemann, Assarsson 2008, and Laine et al. 2005",
    summary: "Soft shadows of an area light from the casters' silhouette edges, in lists in a grid of the light's view: without noise and without a bias, at any map size. It costs more than soft-auto, and several times as much over dense meshes and for lights as large as the casters.",
    params: &[
        CELLS,
        ENTRIES,
        Param::choice("shape", &["square", "disc"], 0, "shape of the light: a square, or the disc within it"),
        SKIP,
    ],
    published: &[],
    needs: &[Need::Casters],
    kind: Kind::RealTime(prepare),
};

bindings! {
    struct SoftBindings {
        ..camera: CameraBindings,
        visibility, list, Header, Starts, Entries, GridTriangles, EdgeHeader, EdgeStarts, EdgeEntries, GridEdges, Receivers, masked_visibility, FacePlanes,
        fallback
    }
}

struct ExactSoft {
    silhouettes: Silhouettes,
    receivers: GridReceivers,
    triangles: TriangleLists,
    edges: EdgeLists,
    shade: PixelPass,
    masked: Masked,
    fallback: SoftAuto,
    /// Pixels of cells whose casters find no room.
    fallback_list: Arc<Buffer>,
    cells: u32,
    entries: u32,
    view: Option<ListView>,
}

/// Shadows of alpha-masked casters, which have no triangles here: those of the whole shadow map, filtered.
struct Masked {
    passes: Option<Box<dyn Passes>>,
    visibility: Image,
}

impl Masked {
    fn new(context: &Context, setup: &Setup, casters_masked: bool) -> Result<Self> {
        let setup = Setup { params: Params::new(&pcss::INFO), intermediates: false, ..setup.clone() };
        let passes = casters_masked.then(|| pcss::prepare(context, &setup)).transpose()?;
        let extent = if passes.is_some() { setup.extent } else { [1, 1] };
        let desc = ImageDesc::storage("visibility of masked casters", setup.output.format(), extent);
        Ok(Self { passes, visibility: Image::new(context.device(), &desc)? })
    }

    fn memory_bytes(&self) -> u64 {
        self.visibility.memory_bytes() + self.passes.as_ref().map_or(0, |p| p.memory_bytes())
    }
}

fn prepare(context: &Context, setup: &Setup) -> Result<Box<dyn Passes>> {
    let p = &setup.params;
    let casters = setup.casters(INFO.id)?;
    let cells = p.int("cells").next_multiple_of(COARSEST);
    let entries = p.int("entries");
    let shade = |step: Step| {
        let disc = p.word("shape") == "disc";
        // The shader takes fewer pixels together where lists are long.
        let constants = [
            ("MASKED", casters.masked().into()),
            ("DISC", disc.into()),
            ("STEP", step as u32),
            step.together(context, 1),
        ];
        context.pipeline::<SoftBindings, GridPush>("exact/exact_soft.comp", &constants)
    };
    // The views show all receivers. Those of listed pixels are not kept.
    let listed = p.word("skip") != "off" && !setup.intermediates;
    let shade = PixelPass::new(context, "listed pixels", setup.extent, listed, shade)?;
    let fallback_list = Arc::new(pixel_list(context, "pixels without lists", setup.extent)?);
    Ok(Box::new(ExactSoft {
        silhouettes: Silhouettes::new(context, casters, true)?,
        receivers: GridReceivers::new(context, setup.extent, cells, shade.is_listed())?,
        triangles: TriangleLists::new(context, casters, cells, entries, true)?,
        edges: EdgeLists::new(context, casters, cells, entries)?,
        shade,
        masked: Masked::new(context, setup, casters.masked())?,
        fallback: SoftAuto::for_list(context, setup, &fallback_list)?,
        fallback_list,
        cells,
        entries,
        view: setup.intermediates.then(|| ListView::new(context, setup.extent, true)).transpose()?,
    }))
}

impl Passes for ExactSoft {
    fn record(&mut self, frame: &mut Frame<'_>, view: &Buffer, inputs: &Inputs<'_>, visibility: &Image) -> Result<()> {
        self.silhouettes.casters().check_transforms(INFO.id, inputs.casters)?;
        let push = GridPush::new(inputs, self.silhouettes.casters(), self.cells, self.entries, 0.0);
        if let Some(passes) = &mut self.masked.passes {
            passes.record(frame, view, inputs, &self.masked.visibility)?;
        }
        self.silhouettes.record(frame, inputs, None)?;
        self.shade.clear(frame);
        self.receivers.record(frame, view, inputs, &push, visibility, Some(self.shade.list()))?;
        self.triangles.record(frame, &self.receivers, &self.silhouettes, &push, Some(&self.edges))?;
        self.edges.record(frame, &self.receivers, &self.silhouettes, &push)?;
        let [header, starts, entries] = self.triangles.lists().bind();
        let [edge_header, edge_starts, edge_entries] = self.edges.lists().bind();
        let bind = SoftBindings {
            camera: CameraBindings::new(view, inputs),
            visibility: Bind::Image(visibility),
            list: self.shade.list(),
            Header: header,
            Starts: starts,
            Entries: entries,
            GridTriangles: Bind::Buffer(self.triangles.triangles()),
            EdgeHeader: edge_header,
            EdgeStarts: edge_starts,
            EdgeEntries: edge_entries,
            GridEdges: Bind::Buffer(self.edges.edges()),
            Receivers: self.receivers.receivers(),
            masked_visibility: Bind::Image(&self.masked.visibility),
            FacePlanes: self.edges.planes(),
            fallback: Bind::Buffer(&self.fallback_list),
        };
        if let Some(view) = &self.view {
            view.record(frame, &self.receivers, &self.triangles, Some(&self.edges), &push)?;
        }
        let push = self.edges.push(push);
        let names = ["layers over receivers", "edges on the light"];
        clear_list(frame, &self.fallback_list);
        self.shade.record_more(frame, names, &bind, bytemuck::bytes_of(&push), visibility)?;
        frame.count(Counted::Named("fallback_pixels"), &self.fallback_list, COUNT);
        // Masked casters may have had passes of these names.
        frame.mark_passes(", fallback");
        let recorded = self.fallback.record_listed(frame, view, inputs, visibility);
        frame.mark_passes("");
        recorded
    }

    fn intermediates(&self) -> Vec<(&'static str, &Image)> {
        self.view.as_ref().map(ListView::images).unwrap_or_default()
    }

    fn memory_bytes(&self) -> u64 {
        self.view.as_ref().map_or(0, ListView::memory_bytes)
            + self.silhouettes.memory_bytes()
            + self.receivers.memory_bytes()
            + self.triangles.memory_bytes()
            + self.edges.memory_bytes()
            + self.shade.memory_bytes()
            + self.masked.memory_bytes()
            + self.fallback.memory_bytes()
    }
}
