//! A hybrid of soft shadows.

use super::classified::{MapClasses, MeasuredFilter, SearchBindings, check_taps};
use super::pcss::{self, PcssConfig};
use super::rbssm::{self, LEAST_WIDTH, RbssmConfig, RbssmVisibility, VISIBILITY, check_least_width};
use crate::gpu::{Buffer, ComputePipeline, Image, ImageDesc, bindings};
use crate::technique::common::bindings::PixelBindings;
use crate::technique::common::blocker_search::{self, SearchWindow};
use crate::technique::common::pixels::{PixelList, PixelPass, Step, no_list};
use crate::technique::common::rbsm_receiver::RbsmPush;
use crate::technique::common::receiver::{self, ReceiverPush};
use crate::technique::revectorization::rbsm_pass::{RbsmConfig, RbsmOfList, Revectorization};
use crate::technique::revectorization::revectorized::{DEPTH_BIAS, MAX_DISTANCE, NORMAL_OFFSET};
use crate::technique::{Info, Kind, Param, Passes, Setup};
use crate::{Bind, Context, Error, Frame, Inputs, Result};
use ash::vk;
use std::sync::Arc;

/// The registry entry.
pub const INFO: Info = Info {
    id: "soft-auto",
    title: "Hybrid of soft shadows",
    paper: "this project; named as future work by Macedo, Apolinário, Agüero 2019",
    summary: "One blocker search, then what each penumbra is worth: hard edges, revectorized visibility under every tap, or percentage-closer filtering.",
    params: &[
        blocker_search::SEARCH_TAPS,
        Param::odd(
            "filter_taps",
            1,
            63,
            15,
            "taps",
            "taps of the filter of wide penumbrae along each axis, 2 x 2 texels each",
        ),
        Param::odd(
            "kernel_taps",
            1,
            63,
            11,
            "taps",
            "taps of the filter of narrow ones along each axis, each a place in the map",
        ),
        blocker_search::SEARCH,
        Param::float(
            "hard_pixels",
            0.0,
            64.0,
            0.5,
            "pixels",
            "penumbrae that are narrower on the screen are hard edges; 0 = none",
        ),
        Param::float(
            "kernel_texels",
            0.0,
            1e6,
            2.0,
            "texels",
            "penumbrae that are narrower in the map average revectorized visibility, wider ones plain tests; 0 = all of these",
        ),
        Param::float(
            "thin_distance",
            0.0,
            1e6,
            16.0,
            "texels",
            "bars and gaps one texel wide that far from the receiver or farther: plain tests however narrow the penumbra",
        ),
        VISIBILITY,
        LEAST_WIDTH,
        MAX_DISTANCE,
        NORMAL_OFFSET,
        DEPTH_BIAS,
        Param::choice(
            "skip",
            &["auto", "off"],
            0,
            "decide pixels whose window is lit or in shadow by depth bounds of the map, before the search and after it: the same image",
        ),
    ],
    needs: &[],
    kind: Kind::RealTime(prepare),
};

struct Hybrid {
    passes: SoftAuto,
    push: ReceiverPush,
}

fn prepare(context: &Context, setup: &Setup) -> Result<Box<dyn Passes>> {
    let p = &setup.params;
    let config = SoftAutoConfig {
        search_taps: p.int("search_taps"),
        filter_taps: p.int("filter_taps"),
        kernel_taps: p.int("kernel_taps"),
        window: blocker_search::search_window(p),
        visibility: rbssm::visibility(p),
        least_width: p.float("least_width"),
        max_distance: p.int("max_distance"),
        hard_pixels: p.float("hard_pixels"),
        kernel_texels: p.float("kernel_texels"),
        thin_distance: p.float("thin_distance"),
        classify: p.word("skip") == "auto",
    };
    Ok(Box::new(Hybrid {
        passes: SoftAuto::new(context, setup.extent, setup.map_size, config)?,
        push: receiver::push(setup),
    }))
}

impl Passes for Hybrid {
    fn record(&mut self, frame: &mut Frame<'_>, view: &Buffer, inputs: &Inputs<'_>, visibility: &Image) -> Result<()> {
        self.passes.record(frame, view, inputs, self.push, visibility)
    }

    fn memory_bytes(&self) -> u64 {
        self.passes.memory_bytes()
    }
}

/// Settings that are fixed when the passes are made.
#[derive(Clone, Copy, Debug)]
pub struct SoftAutoConfig {
    /// Taps of the blocker search along each axis: odd, 1 to 63.
    pub search_taps: u32,
    /// Taps of the filter of wide penumbrae along each axis: odd, 1 to 63.
    pub filter_taps: u32,
    /// Taps of the filter of narrow penumbrae along each axis: odd, 1 to 63.
    pub kernel_taps: u32,
    /// Window in which blockers are searched.
    pub window: SearchWindow,
    /// Treatment of edges where the penumbra is narrow.
    pub visibility: RbssmVisibility,
    /// [`RbssmConfig::least_width`].
    pub least_width: f32,
    /// `MAXDIST`, texels: 1 to 64.
    pub max_distance: u32,
    /// Filters that are narrower on the screen, pixels, are left out: the edge stays hard. 0: none.
    pub hard_pixels: f32,
    /// Filters that are narrower in the map, texels, average revectorized visibility; wider ones plain tests. 0: none.
    pub kernel_texels: f32,
    /// Beside bars and gaps one texel wide plain tests are averaged, however narrow the filter, if these are farther from the
    /// receiver, widths of a texel.
    pub thin_distance: f32,
    /// Pixels are decided by the depths under their window, before the search and after it.
    pub classify: bool,
}

impl SoftAutoConfig {
    fn check(&self) -> Result<()> {
        check_taps(self.search_taps, self.filter_taps)?;
        check_least_width(self.least_width)?;
        for (what, n, unit) in [
            ("hard_pixels", self.hard_pixels, "pixels"),
            ("kernel_texels", self.kernel_texels, "texels"),
            ("thin_distance", self.thin_distance, "texels"),
        ] {
            if n.is_nan() || n < 0.0 {
                return Err(Error::Parameter(format!("{what} {n} is not possible: 0 {unit} or more")));
            }
        }
        Ok(())
    }

    fn pcss(&self) -> PcssConfig {
        PcssConfig {
            search_taps: self.search_taps,
            filter_taps: self.filter_taps,
            window: self.window,
            bilinear: true,
            exact_box: true,
            listed: true,
        }
    }

    fn rbssm(&self) -> RbssmConfig {
        RbssmConfig {
            search_taps: self.search_taps,
            filter_taps: self.kernel_taps,
            window: self.window,
            visibility: self.visibility,
            least_width: self.least_width,
            max_distance: self.max_distance,
            reuse: true,
            listed: true,
        }
    }

    fn rbsm(&self) -> RbsmConfig {
        let revectorization = match self.visibility {
            RbssmVisibility::Recovery => Revectorization::Silhouette,
            RbssmVisibility::Improved => Revectorization::Star,
        };
        RbsmConfig { revectorization, fixed_depth: false, max_distance: self.max_distance, listed: true }
    }
}

bindings! {
    struct EstimateBindings { ..search: SearchBindings, hard, kernel, wide }
}

/// The passes with their lists: 24 bytes a pixel, less 4 for each kind of filter that the thresholds rule out.
pub struct SoftAuto {
    estimate: PixelPass,
    classes: MapClasses,
    half_widths: Image,
    hard: Option<(RbsmOfList, PixelList)>,
    kernel: Option<(MeasuredFilter, PixelList)>,
    wide: (MeasuredFilter, PixelList),
    unlisted: Buffer,
}

impl SoftAuto {
    /// Allocates for a camera image and a shadow map.
    ///
    /// # Errors
    /// [`Error::Parameter`] for settings out of range, and for an image whose pixels a storage buffer cannot list.
    pub fn new(context: &Context, extent: [u32; 2], map_size: [u32; 2], config: SoftAutoConfig) -> Result<Self> {
        config.check()?;
        let list = |name: &str| PixelList::new(context, name, extent);
        // First: it refuses what the pass below would work on without a list.
        let wide = (pcss::measured_filter(context, config.pcss())?, list("pixels in wide penumbrae")?);
        let hard = match config.hard_pixels > 0.0 {
            true => Some((RbsmOfList::new(context, config.rbsm())?, list("pixels at hard edges")?)),
            false => None,
        };
        let kernel = match config.kernel_texels > 0.0 {
            true => Some((rbssm::measured_filter(context, config.rbssm())?, list("pixels in narrow penumbrae")?)),
            false => None,
        };
        let estimate =
            PixelPass::new(context, "pixels in penumbrae", extent, true, |step| pipeline(context, config, step))?;
        let widths = ImageDesc::storage("half-widths of filters", vk::Format::R32G32_SFLOAT, extent);
        Ok(Self {
            estimate,
            classes: MapClasses::new(context, map_size, config.window, config.classify)?,
            half_widths: Image::new(context.device(), &widths)?,
            hard,
            kernel,
            wide,
            unlisted: no_list(context)?,
        })
    }

    fn lists(&self) -> [Option<&PixelList>; 3] {
        [self.hard.as_ref().map(|h| &h.1), self.kernel.as_ref().map(|k| &k.1), Some(&self.wide.1)]
    }

    /// Bytes of images and lists.
    pub fn memory_bytes(&self) -> u64 {
        self.estimate.memory_bytes()
            + self.classes.memory_bytes()
            + self.half_widths.memory_bytes()
            + self.lists().into_iter().flatten().map(PixelList::memory_bytes).sum::<u64>()
    }

    /// Writes the visibility of every pixel into `output`.
    pub fn record(
        &mut self,
        frame: &mut Frame<'_>,
        view: &Buffer,
        inputs: &Inputs<'_>,
        push: ReceiverPush,
        output: &Image,
    ) -> Result<()> {
        self.classes.record(frame, inputs)?;
        for list in self.lists().into_iter().flatten() {
            list.clear(frame);
        }
        let ReceiverPush { normal_offset, depth_bias } = push;
        let edge_push = RbsmPush { normal_offset, depth_bias, slack: 0.0 };
        let [hsm, blocks] = self.classes.bind(inputs);
        let [hard, kernel, wide] = self.lists().map(|l| l.map_or(Bind::Buffer(&self.unlisted), PixelList::bind));
        let pixels = PixelBindings::borderless(view, inputs, output, self.estimate.list());
        let search = SearchBindings { pixels, hsm, blocks, half_widths: Bind::Image(&self.half_widths) };
        let bind = &EstimateBindings { search, hard, kernel, wide };
        let names = ["classify penumbrae", "search blockers"];
        self.estimate.record(frame, names, bind, bytemuck::bytes_of(&edge_push), output)?;
        if let Some((pass, list)) = &self.hard {
            pass.record(frame, view, inputs, edge_push, (list.bind(), list.threads()), output)?;
            list.count(frame);
        }
        if let Some((pass, list)) = &self.kernel {
            pass.record(frame, view, inputs, bytemuck::bytes_of(&edge_push), (list, &self.half_widths), output)?;
        }
        let (pass, list) = &self.wide;
        pass.record(frame, view, inputs, bytemuck::bytes_of(&push), (list, &self.half_widths), output)
    }
}

fn pipeline(context: &Context, config: SoftAutoConfig, step: Step) -> Result<Arc<ComputePipeline>> {
    let constants = [
        // Of `glsl/common/rbsm_receiver.glsl`, not for this pass.
        ("FIXED", 0),
        ("SEARCH_TAPS", config.search_taps),
        ("CLASSIFY", config.classify.into()),
        ("NEAREST_BLOCKER", (config.window == SearchWindow::Blockers).into()),
        ("STEP", step as u32),
        ("LEAST_WIDTH", config.least_width.to_bits()),
        ("HARD_PIXELS", config.hard_pixels.to_bits()),
        ("KERNEL_TEXELS", config.kernel_texels.to_bits()),
        ("THIN_DISTANCE", config.thin_distance.to_bits()),
    ];
    context.pipeline::<EstimateBindings, RbsmPush>("soft/soft_auto.comp", &constants)
}
