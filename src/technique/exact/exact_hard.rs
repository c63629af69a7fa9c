//! Exact hard shadows.

use super::grid::{COARSEST, GridPush, GridReceivers, TriangleLists};
use super::list_view::ListView;
use crate::gpu::{Buffer, ComputePipeline, Image, bindings};
use crate::technique::caster_edges::silhouettes::Silhouettes;
use crate::technique::common::bindings::ReceiverBindings;
use crate::technique::common::receiver::NORMAL_OFFSET;
use crate::technique::{Info, Kind, Param, Passes, Setup};
use crate::{Bind, Context, Frame, Inputs, Need, Pass, Result, Threads};
use std::sync::Arc;

/// Parameter: cells of the light's grid.
pub(super) const CELLS: Param = Param::int(
    "cells",
    64,
    1024,
    512,
    "cells",
    "cells of the light's grid along each side, rounded up to a multiple of 64; the image is the same",
);
/// Parameter: room in the lists.
pub(super) const ENTRIES: Param = Param::int(
    "entries",
    1,
    1 << 22,
    1 << 20,
    "entries",
    "room in each kind of list, 32 bytes an entry; pixels of cells whose casters find no room use the shadow map: a test, or soft-auto for soft shadows (the JSON counts casters without room)",
);

/// The registry entry.
pub const INFO: Info = Info {
    id: "exact-hard",
    title: "Exact hard shadows",
    paper: "this project; after Johnson et al. 2005 and Sintorn, Eisemann, Assarsson 2008",
    summary: "Tests each receiver against the triangles between it and the light, from lists in a grid of the light's view: exact at any map size.",
    params: &[CELLS, ENTRIES, NORMAL_OFFSET],
    published: &[],
    needs: &[Need::Casters],
    kind: Kind::RealTime(prepare),
};

bindings! {
    struct HardBindings { ..receiver: ReceiverBindings, visibility, Receivers, Header, Starts, Entries, GridTriangles }
}

struct ExactHard {
    silhouettes: Silhouettes,
    receivers: GridReceivers,
    triangles: TriangleLists,
    shade: Arc<ComputePipeline>,
    cells: u32,
    entries: u32,
    normal_offset: f32,
    view: Option<ListView>,
}

fn prepare(context: &Context, setup: &Setup) -> Result<Box<dyn Passes>> {
    let p = &setup.params;
    let casters = setup.casters(INFO.id)?;
    let cells = p.int("cells").next_multiple_of(COARSEST);
    let entries = p.int("entries");
    let masked = [("MASKED", casters.masked().into())];
    Ok(Box::new(ExactHard {
        silhouettes: Silhouettes::new(context, casters, true)?,
        receivers: GridReceivers::new(context, setup.extent, cells, false)?,
        triangles: TriangleLists::new(context, casters, cells, entries, false)?,
        shade: context.pipeline::<HardBindings, GridPush>("exact/exact_hard.comp", &masked)?,
        cells,
        entries,
        normal_offset: p.float("normal_offset"),
        view: setup.intermediates.then(|| ListView::new(context, setup.extent, false)).transpose()?,
    }))
}

impl Passes for ExactHard {
    fn record(&mut self, frame: &mut Frame<'_>, view: &Buffer, inputs: &Inputs<'_>, visibility: &Image) -> Result<()> {
        self.silhouettes.casters().check_transforms(INFO.id, inputs.casters)?;
        let push = GridPush::new(inputs, self.silhouettes.casters(), self.cells, self.entries, self.normal_offset);
        self.silhouettes.record(frame, inputs, None)?;
        self.receivers.record(frame, view, inputs, &push, visibility, None)?;
        self.triangles.record(frame, &self.receivers, &self.silhouettes, &push, None)?;
        let [header, starts, entries] = self.triangles.lists().bind();
        if let Some(view) = &self.view {
            view.record(frame, &self.receivers, &self.triangles, None, &push)?;
        }
        let [width, height] = visibility.extent();
        frame.dispatch(&Pass {
            name: "triangles over receivers",
            pipeline: &self.shade,
            bind: &HardBindings {
                receiver: ReceiverBindings::new(view, inputs),
                visibility: Bind::Image(visibility),
                Receivers: self.receivers.receivers(),
                Header: header,
                Starts: starts,
                Entries: entries,
                GridTriangles: Bind::Buffer(self.triangles.triangles()),
            },
            push: bytemuck::bytes_of(&push),
            threads: Threads::Count([width, height, 1]),
        })
    }

    fn intermediates(&self) -> Vec<(&'static str, &Image)> {
        self.view.as_ref().map(ListView::images).unwrap_or_default()
    }

    fn memory_bytes(&self) -> u64 {
        self.silhouettes.memory_bytes()
            + self.receivers.memory_bytes()
            + self.triangles.memory_bytes()
            + self.view.as_ref().map_or(0, ListView::memory_bytes)
    }
}
