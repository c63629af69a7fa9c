//! Steps that `pcss`, `rbssm` and `soft-auto` share: pixels are classified by the depths under their search window, the
//! others are searched and filtered; or filtered alone, where another pass has listed them.

use crate::gpu::{Buffer, ComputePipeline, Image, ShaderStruct, bindings};
use crate::technique::common::bindings::PixelBindings;
use crate::technique::common::blocker_search::SearchWindow;
use crate::technique::common::depth_bounds::DepthBounds;
use crate::technique::common::hsm::Hsm;
use crate::technique::common::pixels::{PixelList, PixelPass, Step, no_list};
use crate::technique::{Param, Passes, Setup, classes_view};
use crate::{Bind, Context, Frame, Inputs, Pass, Result};
use std::sync::Arc;

/// Parameter of the techniques that classify pixels first.
pub(super) const SKIP: Param = Param::choice(
    "skip",
    SKIP_CHOICES,
    0,
    "decide pixels whose whole search window is lit or in shadow by depth bounds of the map, and work on the others: none are decided (off), tiles and then 2 x 2 \
     pixels, which leaves a list of pixels (quads), or tiles alone (tiles); auto takes tiles on a CPU, quads on a GPU; the image is the same",
);
/// Values of such a parameter; see [`Skip`].
pub(super) const SKIP_CHOICES: &[&str] = &["auto", "off", "quads", "tiles"];

/// Parts of the image that depth bounds of the map decide before blockers are searched.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Skip {
    /// Nothing: every pixel is searched.
    Off,
    /// Tiles, then quads of 2 x 2 pixels. The pixels that are left are listed.
    Quads,
    /// Tiles. All pixels of the tiles that are left are searched.
    Tiles,
}

impl Skip {
    /// Returns the value of the parameter `skip`. A CPU driver loses more by a list of pixels than it saves. The view of the
    /// classes needs those of quads.
    pub(super) fn of(context: &Context, setup: &Setup) -> Self {
        match setup.params.word("skip") {
            "off" => Self::Off,
            "quads" => Self::Quads,
            "tiles" => Self::Tiles,
            _ if context.device().is_cpu() && !setup.intermediates => Self::Tiles,
            _ => Self::Quads,
        }
    }

    /// Makes the pass that searches.
    pub(super) fn pass(
        self,
        context: &Context,
        name: &str,
        extent: [u32; 2],
        pipeline: impl Fn(Step) -> Result<Arc<ComputePipeline>>,
    ) -> Result<PixelPass> {
        match self {
            Self::Tiles => PixelPass::of_open_tiles(context, name, extent, pipeline, Arc::new(no_list(context)?)),
            _ => PixelPass::by_tiles(context, name, extent, self == Self::Quads, pipeline),
        }
    }
}

bindings! {
    /// Everything that a blocker search reads and writes.
    pub(super) struct SearchBindings { ..pixels: PixelBindings, hsm, blocks, half_widths, open_tiles }
}

/// Depth bounds of the map that classify pixels and narrow their search windows. Bounds that are not needed are not made.
pub(super) struct MapClasses {
    hsm: Option<Hsm>,
    bounds: Option<DepthBounds>,
}

impl MapClasses {
    /// Allocates for a shadow map; `classified`: the bounds decide pixels.
    pub(super) fn new(context: &Context, map_size: [u32; 2], window: SearchWindow, classified: bool) -> Result<Self> {
        let narrow = window == SearchWindow::Blockers;
        Ok(Self {
            hsm: if classified || narrow { Some(Hsm::new(context, map_size)?) } else { None },
            bounds: if classified { Some(DepthBounds::new(context, map_size)?) } else { None },
        })
    }

    pub(super) fn memory_bytes(&self) -> u64 {
        self.hsm.as_ref().map_or(0, |h| h.bounds().memory_bytes())
            + self.bounds.as_ref().map_or(0, |b| b.blocks().memory_bytes())
    }

    /// Makes the bounds again if the light has changed.
    pub(super) fn record(&mut self, frame: &mut Frame<'_>, inputs: &Inputs<'_>) -> Result<()> {
        if let Some(hsm) = &mut self.hsm {
            hsm.record(frame, inputs)?;
        }
        if let Some(bounds) = &mut self.bounds {
            bounds.record(frame, inputs)?;
        }
        Ok(())
    }

    /// The pyramid, if it is needed.
    pub(super) fn pyramid(&self) -> Option<&Hsm> {
        self.hsm.as_ref()
    }

    /// Returns the pyramid and the blocks, for binding; another image stands in for one that the shader does not read.
    pub(super) fn bind<'a>(&'a self, inputs: &'a Inputs<'_>) -> [Bind<'a>; 2] {
        let unread = Bind::Input(&inputs.depth);
        [
            self.hsm.as_ref().map_or(unread, |h| Bind::Image(h.bounds())),
            self.bounds.as_ref().map_or(unread, |b| Bind::Image(b.blocks())),
        ]
    }
}

/// Technique that decides pixels by depth bounds of the map, and searches and filters at the others.
pub(super) struct Classified<P> {
    names: [String; 3],
    classes: MapClasses,
    pass: PixelPass,
    push: P,
    /// Image of the classes, for viewing.
    classes_view: Option<Image>,
}

impl<P: ShaderStruct> Classified<P> {
    /// Allocates the technique whose passes are named after `id`.
    pub(super) fn new(
        context: &Context,
        setup: &Setup,
        id: &str,
        (window, skip): (SearchWindow, Skip),
        push: P,
        pipeline: impl Fn(Step) -> Result<Arc<ComputePipeline>>,
    ) -> Result<Self> {
        let pass = skip.pass(context, &format!("{id} pixels"), setup.extent, pipeline)?;
        Ok(Self {
            names: [format!("{id} classes"), format!("{id} classify"), id.into()],
            classes: MapClasses::new(context, setup.map_size, window, skip != Skip::Off)?,
            classes_view: classes_view(context, setup, pass.is_listed())?,
            pass,
            push,
        })
    }

    fn bind<'a>(&'a self, view: &'a Buffer, inputs: &'a Inputs<'_>, output: &'a Image) -> SearchBindings<'a> {
        let pixels = PixelBindings::borderless(view, inputs, output, self.pass.list());
        let [hsm, blocks] = self.classes.bind(inputs);
        SearchBindings {
            pixels,
            hsm,
            blocks,
            half_widths: Bind::Input(&inputs.depth),
            open_tiles: self.pass.tile_list(),
        }
    }
}

impl<P: ShaderStruct> Passes for Classified<P> {
    fn record(&mut self, frame: &mut Frame<'_>, view: &Buffer, inputs: &Inputs<'_>, visibility: &Image) -> Result<()> {
        self.classes.record(frame, inputs)?;
        let [shown, classify, search] = self.names.each_ref().map(String::as_str);
        let push = bytemuck::bytes_of(&self.push);
        if let Some(image) = &self.classes_view {
            frame.fill_image("open classes", image, 0.5f32.to_bits());
            self.pass.record_decided(frame, shown, &self.bind(view, inputs, image), push, image)?;
        }
        self.pass.record(frame, [classify, search], &self.bind(view, inputs, visibility), push, visibility)
    }

    /// `classes`: 1 lit, 0 in shadow, 0.5 for pixels that are searched and filtered.
    fn intermediates(&self) -> Vec<(&'static str, &Image)> {
        self.classes_view.iter().map(|image| ("classes", image)).collect()
    }

    fn memory_bytes(&self) -> u64 {
        let viewed = self.classes_view.as_ref().map_or(0, Image::memory_bytes);
        self.pass.memory_bytes() + self.classes.memory_bytes() + viewed
    }
}

/// The filter alone, over the pixels that another pass lists and the widths that it finds.
pub(super) struct MeasuredFilter {
    name: &'static str,
    pipeline: Arc<ComputePipeline>,
}

impl MeasuredFilter {
    /// Takes the pipeline of [`Step::Measured`].
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
                open_tiles: list.bind(),
            },
            push,
            threads: list.threads(),
        })?;
        list.count(frame);
        Ok(())
    }
}
