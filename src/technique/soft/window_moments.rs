//! Soft shadows from a summed-area table of moments: what `vssm` and `mssm` share.
//!
//! The table's integers are as precise as sums over `window` x `window` texels allow. Wider windows are cut down to that
//! width: blockers beyond are not found, and penumbrae that should be wider are drawn as wide as the window.

use super::classified::MapClasses;
use crate::gpu::{Buffer, ComputePipeline, Image, bindings, shader_struct};
use crate::technique::common::bindings::CameraBindings;
use crate::technique::common::blocker_search::{SearchWindow, search_window};
use crate::technique::filtering::moment_kind::{Kind, range};
use crate::technique::filtering::moments;
use crate::technique::filtering::summed_area::SummedArea;
use crate::technique::{Param, Passes, Setup};
use crate::{Bind, Context, Frame, Inputs, Pass, Result, Threads};
use std::sync::Arc;

pub(super) const WINDOW: Param = Param::odd(
    "window",
    7,
    1023,
    127,
    "texels",
    "widest window of search and filter: no penumbra is wider, in texels of the map; the precision of the moments falls with its area",
);
pub(super) const CLASSIFY: Param = Param::switch(
    "classify",
    true,
    "pixels whose whole search window is lit or in shadow by depth bounds of the map get 1 or 0, without the moments' light leaking",
);
pub(super) const DEPTH_BIAS: Param = Param { default: 0.25, ..moments::DEPTH_BIAS };
pub(super) const REDUCTION: Param = Param { default: 0.1, ..moments::REDUCTION };

shader_struct! {
    /// Push constants of `glsl/soft/moment_window.glsl`.
    pub struct WindowPush {
        normal_offset: f32,
        depth_bias: f32,
        range: f32,
        scale: f32,
        widest: f32,
        reduction: f32,
        least_variance: f32,
        moment_bias: f32,
    }
}

bindings! {
    struct WindowBindings { ..camera: CameraBindings, table, visibility, hsm, blocks }
}

/// Returns the half-width of the widest window whose rim of parts of texels still fits into the table's, texels.
pub fn widest(window: u32) -> f32 {
    0.5 * (window as f32 - 1.0)
}

/// Passes of a technique: the table, the bounds by which windows are found and decided, and the lookup.
pub(super) struct WindowMoments {
    name: &'static str,
    table: SummedArea,
    classes: MapClasses,
    lookup: Arc<ComputePipeline>,
    push: WindowPush,
}

impl WindowMoments {
    /// Allocates for a shadow map. `name` is the lookup's in timings, the technique's id; `constants` are those of its
    /// shader alone, and `push` has what the technique adds to the settings that both have.
    pub fn new(
        context: &Context,
        setup: &Setup,
        (name, kind): (&'static str, Kind),
        (shader, constants): (&str, &[(&'static str, u32)]),
        push: WindowPush,
    ) -> Result<Self> {
        let p = &setup.params;
        let (window, classified) = (search_window(p), p.on("classify"));
        let narrow = window == SearchWindow::Blockers;
        let table = SummedArea::new(context, setup.map_size, kind, p.int("window"))?;
        let constants =
            [&[("CLASSIFIED", classified.into()), ("NEAREST_BLOCKER", narrow.into())][..], constants].concat();
        let push = WindowPush {
            normal_offset: p.float("normal_offset"),
            depth_bias: p.float("depth_bias"),
            scale: table.scale(),
            widest: widest(p.int("window")),
            reduction: p.float("reduction"),
            ..push
        };
        Ok(Self {
            name,
            table,
            classes: MapClasses::new(context, setup.map_size, SearchWindow::Blockers, classified)?,
            lookup: context.pipeline::<WindowBindings, WindowPush>(shader, &constants)?,
            push,
        })
    }
}

impl Passes for WindowMoments {
    fn record(&mut self, frame: &mut Frame<'_>, view: &Buffer, inputs: &Inputs<'_>, visibility: &Image) -> Result<()> {
        let range = range(&inputs.light[0]);
        self.table.record(frame, inputs, range)?;
        self.classes.record(frame, inputs)?;
        let [hsm, blocks] = self.classes.bind(inputs);
        let [width, height] = visibility.extent();
        frame.dispatch(&Pass {
            name: self.name,
            pipeline: &self.lookup,
            bind: &WindowBindings {
                camera: CameraBindings::new(view, inputs),
                table: Bind::Image(self.table.table()),
                visibility: Bind::Image(visibility),
                hsm,
                blocks,
            },
            push: bytemuck::bytes_of(&WindowPush { range, ..self.push }),
            threads: Threads::Count([width, height, 1]),
        })
    }
    fn memory_bytes(&self) -> u64 {
        self.table.memory_bytes() + self.classes.memory_bytes()
    }
}
