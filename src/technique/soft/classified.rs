//! What `pcss`, `rbssm` and `soft-auto` share: the classification of pixels by the depths under their search window, a pass
//! that classifies pixels and works on the others, and its filter alone, over pixels that another pass has listed.

use crate::gpu::{Buffer, ComputePipeline, Image, bindings};
use crate::technique::Param;
use crate::technique::check_odd;
use crate::technique::common::bindings::PixelBindings;
use crate::technique::common::blocker_search::SearchWindow;
use crate::technique::common::depth_bounds::DepthBounds;
use crate::technique::common::hsm::Hsm;
use crate::technique::common::pixels::{PixelList, PixelPass, Step};
use crate::{Bind, Context, Frame, Inputs, Pass, Result};
use std::sync::Arc;

/// Parameter of the techniques that classify pixels first.
pub(super) const SKIP: Param = Param::choice(
    "skip",
    &["auto", "off"],
    0,
    "decide pixels whose whole search window is lit or in shadow by depth bounds of the map: the same image",
);

bindings! {
    /// Everything that a search for blockers reads and writes.
    pub(super) struct SearchBindings { ..pixels: PixelBindings, hsm, blocks, half_widths }
}

/// What pixels are classified by, and their search windows narrowed: of each only what is needed.
pub(super) struct MapClasses {
    hsm: Option<Hsm>,
    bounds: Option<DepthBounds>,
}

impl MapClasses {
    /// `listed`: pixels are classified at all.
    pub(super) fn new(context: &Context, map_size: [u32; 2], window: SearchWindow, listed: bool) -> Result<Self> {
        let narrow = window == SearchWindow::Blockers;
        Ok(Self {
            hsm: if listed || narrow { Some(Hsm::new(context, map_size)?) } else { None },
            bounds: if listed { Some(DepthBounds::new(context, map_size)?) } else { None },
        })
    }

    pub(super) fn memory_bytes(&self) -> u64 {
        self.hsm.as_ref().map_or(0, |h| h.bounds().memory_bytes())
            + self.bounds.as_ref().map_or(0, |b| b.blocks().memory_bytes())
    }

    /// Makes both anew if the light has changed.
    pub(super) fn record(&mut self, frame: &mut Frame<'_>, inputs: &Inputs<'_>) -> Result<()> {
        if let Some(hsm) = &mut self.hsm {
            hsm.record(frame, inputs)?;
        }
        if let Some(bounds) = &mut self.bounds {
            bounds.record(frame, inputs)?;
        }
        Ok(())
    }

    /// The pyramid and the blocks, for binding; another image stands in for what the shader does not read.
    pub(super) fn bind<'a>(&'a self, inputs: &'a Inputs<'_>) -> [Bind<'a>; 2] {
        let unread = Bind::Input(&inputs.depth);
        [
            self.hsm.as_ref().map_or(unread, |h| Bind::Image(h.bounds())),
            self.bounds.as_ref().map_or(unread, |b| Bind::Image(b.blocks())),
        ]
    }
}

/// Refuses numbers of taps that a kernel can't have.
pub(super) fn check_taps(search_taps: u32, filter_taps: u32) -> Result<()> {
    check_odd("taps along the side of the search", search_taps, 63)?;
    check_odd("taps along the side of the filter", filter_taps, 63)
}

/// The pass with its pipelines, and what it skips by.
pub(super) struct ClassifiedPass {
    pass: PixelPass,
    classes: MapClasses,
}

impl ClassifiedPass {
    /// Allocates for a camera image and a shadow map.
    pub(super) fn new(
        context: &Context,
        name: &str,
        [extent, map_size]: [[u32; 2]; 2],
        (window, listed): (SearchWindow, bool),
        pipeline: impl Fn(Step) -> Result<Arc<ComputePipeline>>,
    ) -> Result<Self> {
        let pass = PixelPass::new(context, name, extent, listed, pipeline)?;
        Ok(Self { pass, classes: MapClasses::new(context, map_size, window, listed)? })
    }

    /// Bytes of images and lists.
    pub(super) fn memory_bytes(&self) -> u64 {
        self.pass.memory_bytes() + self.classes.memory_bytes()
    }

    /// True if pixels are classified first.
    pub(super) fn is_listed(&self) -> bool {
        self.pass.is_listed()
    }

    /// Writes the visibility of every pixel into `output`.
    pub(super) fn record(
        &mut self,
        frame: &mut Frame<'_>,
        view: &Buffer,
        inputs: &Inputs<'_>,
        (names, push): ([&str; 2], &[u8]),
        output: &Image,
    ) -> Result<()> {
        self.classes.record(frame, inputs)?;
        let bind = &self.bind(view, inputs, output);
        self.pass.record(frame, names, bind, push, output)
    }

    /// Writes what the classification says of every pixel into an image of one `f32`: 1 lit, 0 in shadow, 0.5 to be searched
    /// and filtered. To be looked at; made with `TRANSFER_DST`, and only where pixels are classified.
    pub(super) fn record_classes(
        &mut self,
        frame: &mut Frame<'_>,
        view: &Buffer,
        inputs: &Inputs<'_>,
        (name, push): (&str, &[u8]),
        classes: &Image,
    ) -> Result<()> {
        self.classes.record(frame, inputs)?;
        frame.fill_image("open classes", classes, 0.5f32.to_bits());
        let bind = &self.bind(view, inputs, classes);
        self.pass.record_decided(frame, name, bind, push, classes)
    }

    fn bind<'a>(&'a self, view: &'a Buffer, inputs: &'a Inputs<'_>, output: &'a Image) -> SearchBindings<'a> {
        let pixels = PixelBindings::borderless(view, inputs, output, self.pass.list());
        let [hsm, blocks] = self.classes.bind(inputs);
        SearchBindings { pixels, hsm, blocks, half_widths: Bind::Input(&inputs.depth) }
    }
}

/// The filter alone, over pixels that another pass lists, as wide as it says.
pub(super) struct MeasuredFilter {
    name: &'static str,
    pipeline: Arc<ComputePipeline>,
}

impl MeasuredFilter {
    /// Of the pipeline for [`Step::Measured`].
    pub(super) fn new(name: &'static str, pipeline: Arc<ComputePipeline>) -> Self {
        Self { name, pipeline }
    }

    /// Writes the visibility of the listed pixels into `output`, filtered over their half-widths in texels.
    pub(super) fn record(
        &self,
        frame: &mut Frame<'_>,
        view: &Buffer,
        inputs: &Inputs<'_>,
        push: &[u8],
        (list, half_widths): (&PixelList, &Image),
        output: &Image,
    ) -> Result<()> {
        let unread = Bind::Input(&inputs.depth);
        frame.dispatch(&Pass {
            name: self.name,
            pipeline: &self.pipeline,
            bind: &SearchBindings {
                pixels: PixelBindings::borderless(view, inputs, output, list.bind()),
                hsm: unread,
                blocks: unread,
                half_widths: Bind::Image(half_widths),
            },
            push,
            threads: list.threads(),
        })?;
        list.count(frame);
        Ok(())
    }
}
