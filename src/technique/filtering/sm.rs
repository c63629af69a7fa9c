//! Shadow mapping.

use crate::gpu::{Buffer, ComputePipeline, Image};
use crate::technique::common::bindings::PixelBindings;
use crate::technique::common::pixels::{ALONE, Step, no_list};
use crate::technique::common::receiver::{self, NORMAL_OFFSET, ReceiverPush};
use crate::technique::{Info, Kind, Param, Passes, Setup};
use crate::{Bind, Context, Frame, Inputs, Pass, Result, Threads};
use std::sync::Arc;

/// The registry entry.
pub const INFO: Info = Info {
    id: "sm",
    title: "Shadow mapping",
    paper: "Williams 1978",
    summary: "One test per pixel: the fastest technique, with the map's texels visible as stairs along every edge.",
    params: &[
        NORMAL_OFFSET,
        Param::float("depth_bias", 0.0, 1.0, 0.0, "light depth", "additional bias of the receiver's depth"),
    ],
    published: &[],
    needs: &[],
    kind: Kind::RealTime(prepare),
};

struct ShadowMapping {
    test: Sm,
    push: ReceiverPush,
}

fn prepare(context: &Context, setup: &Setup) -> Result<Box<dyn Passes>> {
    Ok(Box::new(ShadowMapping { test: Sm::new(context)?, push: receiver::push(setup) }))
}

impl Passes for ShadowMapping {
    fn record(&mut self, frame: &mut Frame<'_>, view: &Buffer, inputs: &Inputs<'_>, visibility: &Image) -> Result<()> {
        self.test.record(frame, view, inputs, self.push, visibility)
    }
}

/// The pass with its pipeline.
pub struct Sm {
    pipeline: Arc<ComputePipeline>,
    /// Buffer for the shader's binding if there is no list.
    no_list: Buffer,
}

impl Sm {
    /// Makes the pipeline.
    pub fn new(context: &Context) -> Result<Self> {
        Self::with_step(context, Step::AtOnce)
    }

    /// Makes the pipeline for the pixels of a list that another pass makes.
    pub(crate) fn of_list(context: &Context) -> Result<Self> {
        Self::with_step(context, Step::Listed)
    }

    fn with_step(context: &Context, step: Step) -> Result<Self> {
        let pipeline =
            context.pipeline::<PixelBindings, ReceiverPush>("filtering/sm.comp", &[("STEP", step as u32), ALONE])?;
        Ok(Self { pipeline, no_list: no_list(context)? })
    }

    /// Writes the visibility of every pixel into `output`.
    pub fn record(
        &self,
        frame: &mut Frame<'_>,
        view: &Buffer,
        inputs: &Inputs<'_>,
        push: ReceiverPush,
        output: &Image,
    ) -> Result<()> {
        let [width, height] = output.extent();
        let all = (Bind::Buffer(&self.no_list), Threads::Count([width, height, 1]));
        self.record_list(frame, view, inputs, push, all, output)
    }

    /// Writes the visibility of the listed pixels.
    pub(crate) fn record_list(
        &self,
        frame: &mut Frame<'_>,
        view: &Buffer,
        inputs: &Inputs<'_>,
        push: ReceiverPush,
        (list, threads): (Bind<'_>, Threads<'_>),
        output: &Image,
    ) -> Result<()> {
        frame.dispatch(&Pass {
            name: "shadow test",
            pipeline: &self.pipeline,
            bind: &PixelBindings::new(view, inputs, output, list),
            push: bytemuck::bytes_of(&push),
            threads,
        })
    }
}
