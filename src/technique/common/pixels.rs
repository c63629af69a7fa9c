//! A pass of two dispatches. The first decides most pixels and lists the others. The second works on the list, so that
//! all of its threads have work. A single dispatch without a list gives the same image.

use super::tiles::{TILE, TileList, indirect_list};
use crate::gpu::{Bindings, Buffer, ComputePipeline, Constant, Image};
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
/// Offset of the number of pixels.
pub(crate) const COUNT: u64 = 12;
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
    /// Decides whole tiles and lists the others, for [`Step::List`].
    Tiles,
    /// Works on all pixels of the tiles that [`Step::LoneTiles`] lists.
    OpenTiles,
    /// Decides whole tiles and lists the others, for [`Step::OpenTiles`].
    LoneTiles,
}

impl Step {
    /// Returns the constant `TOGETHER` of `glsl/common/pixel_steps.glsl` for a dispatch that makes a list. `rounds`: most rounds
    /// of loops that one pixel takes in the dispatches over that list.
    ///
    /// A CPU driver clears all registers of a shader for every workgroup, which in a long shader costs as much as several
    /// pixels. Mesa's ends all loops of a thread after 65535 rounds. A GPU works faster on many workgroups.
    pub(crate) fn together(self, context: &Context, rounds: u32) -> Constant {
        let most = match self {
            _ if !context.device().is_cpu() => 1,
            // Four pixels a thread.
            Self::Tiles => 4,
            _ => 16,
        };
        ("TOGETHER", (60_000 / rounds).clamp(1, most))
    }
}

/// The constant `TOGETHER` of dispatches that make no list, or one whose pixels may take any number of rounds.
pub(crate) const ALONE: Constant = ("TOGETHER", 1);

/// The pipelines of such a pass, and its list of 4 bytes per pixel.
pub struct PixelPass {
    pixels: Arc<ComputePipeline>,
    /// Pipeline that works on the list, if there is one.
    listed: Option<Arc<ComputePipeline>>,
    list: Arc<Buffer>,
    tiles_total: u32,
    /// Pipeline that decides whole tiles, if there is one, and the list of the others.
    tiles: Option<(Arc<ComputePipeline>, TileList)>,
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
        Ok(Self { buffer: pixel_list(context, name, extent)?, tiles_total: tiles(extent) })
    }

    pub(crate) fn memory_bytes(&self) -> u64 {
        self.buffer.size()
    }

    /// Empties the list.
    pub(crate) fn clear(&self, frame: &mut Frame<'_>) {
        clear_list(frame, &self.buffer);
    }

    /// The list, for binding.
    pub(crate) fn bind(&self) -> Bind<'_> {
        Bind::Buffer(&self.buffer)
    }

    /// The workgroups of the list.
    pub(crate) fn threads(&self) -> Threads<'_> {
        Threads::Indirect(&self.buffer, 0)
    }

    /// Reports how many tiles the pixels would fill that the last recorded pass worked on.
    pub(crate) fn count(&self, frame: &mut Frame<'_>) {
        frame.count_tiles(self.tiles_total, &self.buffer, TILES);
    }
}

/// Makes a buffer for a list with room for every pixel of an image.
///
/// # Errors
/// [`Error::Parameter`] for an image with more pixels than a storage buffer may have entries.
pub(crate) fn pixel_list(context: &Context, name: &str, extent: [u32; 2]) -> Result<Buffer> {
    let [width, height] = extent;
    let entries = u64::from(width) * u64::from(height);
    if !fits(context, entries) {
        let problem = format!(
            "a list of the pixels of a {width}x{height} image is larger than a storage buffer of this device: choose a smaller image"
        );
        return Err(Error::Parameter(problem));
    }
    indirect_list(context.device(), name, HEADER, entries)
}

/// Returns true if [`pixel_list`] makes a list for the image.
pub(crate) fn fits_list(context: &Context, [width, height]: [u32; 2]) -> bool {
    fits(context, u64::from(width) * u64::from(height))
}

fn fits(context: &Context, entries: u64) -> bool {
    HEADER + 4 * entries <= u64::from(context.device().limits.max_storage_buffer_range)
}

fn tiles([width, height]: [u32; 2]) -> u32 {
    width.div_ceil(TILE) * height.div_ceil(TILE)
}

/// Empties a list that [`pixel_list`] made.
pub(crate) fn clear_list(frame: &mut Frame<'_>, list: &Buffer) {
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
        Self::sharing(context, name, extent, listed, pipeline, None)
    }

    /// Makes the pass as [`Self::new`] does, but with a list that other passes use before and after, as [`pixel_list`] makes it.
    pub(crate) fn sharing(
        context: &Context,
        name: &str,
        extent: [u32; 2],
        listed: bool,
        pipeline: impl Fn(Step) -> Result<Arc<ComputePipeline>>,
        list: Option<&Arc<Buffer>>,
    ) -> Result<Self> {
        let entries = u64::from(extent[0]) * u64::from(extent[1]);
        let listed = listed && fits(context, entries);
        let (pixels, edges) = match listed {
            true => (pipeline(Step::List)?, Some(pipeline(Step::Listed)?)),
            false => (pipeline(Step::AtOnce)?, None),
        };
        // Without a list, the shader's binding still needs a buffer.
        let list = match list {
            Some(shared) => shared.clone(),
            None => Arc::new(indirect_list(context.device(), name, HEADER, if listed { entries } else { 0 })?),
        };
        Ok(Self { pixels, listed: edges, list, tiles_total: tiles(extent), tiles: None })
    }

    /// Makes the pass for a shader that decides whole tiles first. Each workgroup of the dispatch that lists pixels works on
    /// four of the tiles that are left (`glsl/common/quad_classes.glsl`). A dispatch without a list keeps one thread for each
    /// pixel.
    pub(crate) fn by_tiles(
        context: &Context,
        name: &str,
        extent: [u32; 2],
        listed: bool,
        pipeline: impl Fn(Step) -> Result<Arc<ComputePipeline>>,
    ) -> Result<Self> {
        Self::new(context, name, extent, listed, &pipeline)?.with_tiles(context, name, extent, pipeline)
    }

    /// Adds the dispatch that decides whole tiles to a pass with a list; see [`Self::by_tiles`]. A pass without one stays as it
    /// is.
    pub(crate) fn with_tiles(
        self,
        context: &Context,
        name: &str,
        extent: [u32; 2],
        pipeline: impl Fn(Step) -> Result<Arc<ComputePipeline>>,
    ) -> Result<Self> {
        if !self.is_listed() {
            return Ok(self);
        }
        let list = TileList::new(context.device(), &format!("{name}, tiles"), extent)?;
        Ok(Self { tiles: Some((pipeline(Step::Tiles)?, list)), ..self })
    }

    /// Makes the pass for a shader that decides whole tiles first and then works on all pixels of the others at once. It reads
    /// no list of pixels, but may write one for other passes.
    pub(crate) fn of_open_tiles(
        context: &Context,
        name: &str,
        extent: [u32; 2],
        pipeline: impl Fn(Step) -> Result<Arc<ComputePipeline>>,
        list: Arc<Buffer>,
    ) -> Result<Self> {
        Ok(Self {
            pixels: pipeline(Step::OpenTiles)?,
            listed: None,
            list,
            tiles_total: tiles(extent),
            tiles: Some((
                pipeline(Step::LoneTiles)?,
                TileList::new(context.device(), &format!("{name}, tiles"), extent)?,
            )),
        })
    }

    /// Bytes of device memory that the list holds.
    pub fn memory_bytes(&self) -> u64 {
        self.list.size() + self.tiles.as_ref().map_or(0, |(_, list)| list.buffer().size())
    }

    /// The list, for binding.
    pub(crate) fn list(&self) -> Bind<'_> {
        Bind::Buffer(&self.list)
    }

    /// The list of the tiles that are not decided as a whole, for binding. The list of pixels stands in for one that the
    /// shader does not read.
    pub(crate) fn tile_list(&self) -> Bind<'_> {
        Bind::Buffer(self.tiles.as_ref().map_or(&self.list, |(_, list)| list.buffer()))
    }

    /// The workgroups of the list, once it is made. Without a list, one thread for each pixel of the image.
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
            clear_list(frame, &self.list);
        }
    }

    /// Records the dispatches that decide. They write the pixels of `output` that they decide and leave the others.
    pub(crate) fn record_decided(
        &self,
        frame: &mut Frame<'_>,
        name: &str,
        bind: &dyn Bindings,
        push: &[u8],
        output: &Image,
    ) -> Result<()> {
        self.clear(frame);
        self.record_first(frame, [name; 2], bind, push, output)
    }

    /// Records all dispatches before the one over listed pixels. `names` holds the name of those that decide, and that of one
    /// that leaves no pixel.
    fn record_first(
        &self,
        frame: &mut Frame<'_>,
        [name, whole]: [&str; 2],
        bind: &dyn Bindings,
        push: &[u8],
        output: &Image,
    ) -> Result<()> {
        let [width, height] = output.extent();
        let Some((pipeline, list)) = &self.tiles else {
            let threads = Threads::Count([width, height, 1]);
            return frame.dispatch(&Pass { name, pipeline: &self.pixels, bind, push, threads });
        };
        list.clear(frame);
        let threads = Threads::Count([width.div_ceil(TILE), height.div_ceil(TILE), 1]);
        frame.dispatch(&Pass { name: &format!("{name}, tiles"), pipeline, bind, push, threads })?;
        let name = if self.is_listed() { name } else { whole };
        frame.dispatch(&Pass { name, pipeline: &self.pixels, bind, push, threads: list.threads() })?;
        list.count(frame);
        Ok(())
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
        self.record_first(frame, names, bind, push, output)?;
        self.record_listed(frame, names[1], bind, push)
    }

    /// Records the dispatch over the listed pixels, if pixels are listed.
    pub(crate) fn record_listed(
        &self,
        frame: &mut Frame<'_>,
        name: &str,
        bind: &dyn Bindings,
        push: &[u8],
    ) -> Result<()> {
        if let Some(listed) = &self.listed {
            let threads = Threads::Indirect(&self.list, 0);
            frame.dispatch(&Pass { name, pipeline: listed, bind, push, threads })?;
            frame.count_tiles(self.tiles_total, &self.list, TILES);
        }
        Ok(())
    }
}
