//! A pass of two dispatches. The first decides most pixels and lists the others. The second works on the list, so that
//! all of its threads have work. A single dispatch without a list gives the same image.

use super::tiles::{TILE, indirect_list};
use crate::gpu::{Bindings, Buffer, ComputePipeline, Image};
use crate::technique::Param;
use crate::{Bind, Context, Error, Frame, Pass, Result, Threads};
use std::sync::Arc;

/// Parameter of the techniques that work longer on the pixels at a discontinuity.
pub(crate) const SKIP: Param = Param::choice(
    "skip",
    &["auto", "off", "list"],
    0,
    "list pixels at an edge for a dispatch of their own (auto, list), or work on them at once (off); the image is the same",
);

/// Bytes before the pixels: the dispatch arguments, the number of pixels, and the number of tiles with a listed pixel.
const HEADER: u64 = 20;
/// Offset of the number of tiles.
const TILES: u64 = 16;

/// Value of the specialization constant `STEP` of `glsl/common/pixel_steps.glsl`.
#[derive(Clone, Copy)]
pub(crate) enum Step {
    AtOnce,
    List,
    Listed,
    /// Works on a list whose pixels another pass has measured already.
    Measured,
}

/// The pipelines of such a pass, and its list of 4 bytes per pixel.
pub struct PixelPass {
    pixels: Arc<ComputePipeline>,
    /// Pipeline that works on the list, if there is one.
    listed: Option<Arc<ComputePipeline>>,
    list: Buffer,
    tiles_total: u32,
    /// A thread of the dispatch that lists works on 2 x 2 pixels.
    by_quads: bool,
}

/// Pixels that one pass lists for another: `PixelList` of `glsl/common/pixel_steps.glsl`, 4 bytes per pixel.
pub(crate) struct PixelList {
    buffer: Buffer,
    tiles_total: u32,
}

impl PixelList {
    /// Makes a list with room for every pixel of an image.
    ///
    /// # Errors
    /// [`Error::Parameter`] for an image with more pixels than a storage buffer may have entries.
    pub(crate) fn new(context: &Context, name: &str, extent: [u32; 2]) -> Result<Self> {
        let [width, height] = extent;
        let entries = u64::from(width) * u64::from(height);
        if !fits(context, entries) {
            let problem = format!(
                "a list of the pixels of a {width}x{height} image is larger than a storage buffer of this device"
            );
            return Err(Error::Parameter(problem));
        }
        let buffer = indirect_list(context.device(), name, HEADER, entries)?;
        Ok(Self { buffer, tiles_total: tiles(extent) })
    }

    pub(crate) fn memory_bytes(&self) -> u64 {
        self.buffer.size()
    }

    /// Empties the list.
    pub(crate) fn clear(&self, frame: &mut Frame<'_>) {
        clear(frame, &self.buffer);
    }

    /// The list, for binding.
    pub(crate) fn bind(&self) -> Bind<'_> {
        Bind::Buffer(&self.buffer)
    }

    /// One thread for each listed pixel, in workgroups of 64.
    pub(crate) fn threads(&self) -> Threads<'_> {
        Threads::Indirect(&self.buffer, 0)
    }

    /// Reports how many tiles the pixels would fill that the last recorded pass worked on.
    pub(crate) fn count(&self, frame: &mut Frame<'_>) {
        frame.count_tiles(self.tiles_total, &self.buffer, 0);
    }
}

fn fits(context: &Context, entries: u64) -> bool {
    HEADER + 4 * entries <= u64::from(context.device().limits.max_storage_buffer_range)
}

fn tiles([width, height]: [u32; 2]) -> u32 {
    width.div_ceil(TILE) * height.div_ceil(TILE)
}

fn clear(frame: &mut Frame<'_>, list: &Buffer) {
    let header: [u32; 5] = [0, 1, 1, 0, 0];
    frame.update(list, bytemuck::bytes_of(&header));
}

/// An empty list, for passes whose shader declares a list that they do not use.
pub(crate) fn no_list(context: &Context) -> Result<Buffer> {
    indirect_list(context.device(), "no list", HEADER, 0)
}

impl PixelPass {
    /// Makes the pass for an image. With `listed`, it has a list with room for every pixel; if a storage buffer cannot
    /// hold such a list, the pass works without one.
    pub(crate) fn new(
        context: &Context,
        name: &str,
        extent: [u32; 2],
        listed: bool,
        pipeline: impl Fn(Step) -> Result<Arc<ComputePipeline>>,
    ) -> Result<Self> {
        let entries = u64::from(extent[0]) * u64::from(extent[1]);
        let listed = listed && fits(context, entries);
        let (pixels, edges) = match listed {
            true => (pipeline(Step::List)?, Some(pipeline(Step::Listed)?)),
            false => (pipeline(Step::AtOnce)?, None),
        };
        // Without a list, the shader's binding still needs a buffer.
        let list = indirect_list(context.device(), name, HEADER, if listed { entries } else { 0 })?;
        Ok(Self { pixels, listed: edges, list, tiles_total: tiles(extent), by_quads: false })
    }

    /// Gives each thread of the dispatch that lists 2 x 2 pixels, for shaders that decide these together
    /// (`glsl/common/quad_classes.glsl`). A dispatch without a list keeps one thread for each pixel.
    pub(crate) fn by_quads(self) -> Self {
        Self { by_quads: true, ..self }
    }

    /// Bytes of device memory that the list holds.
    pub fn memory_bytes(&self) -> u64 {
        self.list.size()
    }

    /// The list, for binding.
    pub(crate) fn list(&self) -> Bind<'_> {
        Bind::Buffer(&self.list)
    }

    /// One thread for each listed pixel, in workgroups of 64, once the list is made. Without a list, one thread for
    /// each pixel of the image.
    pub(crate) fn threads(&self, [width, height]: [u32; 2]) -> Threads<'_> {
        if self.is_listed() { Threads::Indirect(&self.list, 0) } else { Threads::Count([width, height, 1]) }
    }

    /// True if pixels are listed.
    pub(crate) fn is_listed(&self) -> bool {
        self.listed.is_some()
    }

    /// Empties the list, for passes that list pixels before this one; see [`PixelPass::record_more`].
    pub(crate) fn clear(&self, frame: &mut Frame<'_>) {
        if self.listed.is_some() {
            clear(frame, &self.list);
        }
    }

    /// Records the first dispatch, which writes the pixels of `output` that it decides and leaves the others.
    pub(crate) fn record_decided(
        &self,
        frame: &mut Frame<'_>,
        name: &str,
        bind: &dyn Bindings,
        push: &[u8],
        output: &Image,
    ) -> Result<()> {
        self.clear(frame);
        self.record_first(frame, name, bind, push, output)
    }

    fn record_first(
        &self,
        frame: &mut Frame<'_>,
        name: &str,
        bind: &dyn Bindings,
        push: &[u8],
        output: &Image,
    ) -> Result<()> {
        let [mut width, mut height] = output.extent();
        if self.listed.is_some() && self.by_quads {
            [width, height] = [width.div_ceil(2), height.div_ceil(2)];
        }
        let threads = Threads::Count([width, height, 1]);
        frame.dispatch(&Pass { name, pipeline: &self.pixels, bind, push, threads })
    }

    /// Writes every pixel of `output`. `names` holds the names of the two dispatches.
    pub(crate) fn record(
        &self,
        frame: &mut Frame<'_>,
        names: [&str; 2],
        bind: &dyn Bindings,
        push: &[u8],
        output: &Image,
    ) -> Result<()> {
        self.clear(frame);
        self.record_more(frame, names, bind, push, output)
    }

    /// Does the same with a list that other passes have begun; see [`PixelPass::clear`].
    pub(crate) fn record_more(
        &self,
        frame: &mut Frame<'_>,
        names: [&str; 2],
        bind: &dyn Bindings,
        push: &[u8],
        output: &Image,
    ) -> Result<()> {
        self.record_first(frame, names[0], bind, push, output)?;
        if let Some(listed) = &self.listed {
            let threads = Threads::Indirect(&self.list, 0);
            frame.dispatch(&Pass { name: names[1], pipeline: listed, bind, push, threads })?;
            frame.count_tiles(self.tiles_total, &self.list, TILES);
        }
        Ok(())
    }
}
