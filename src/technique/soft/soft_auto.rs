//! A hybrid of soft shadows.

use super::classified::{MapClasses, MeasuredFilter, SKIP_CHOICES, SearchBindings, Skip};
use super::pcss::{self, PcssConfig};
use super::rbssm::{self, LEAST_WIDTH, RbssmConfig, VISIBILITY};
use crate::gpu::{Buffer, ComputePipeline, Image, ImageDesc, bindings};
use crate::technique::common::bindings::PixelBindings;
use crate::technique::common::blocker_search::{self, SEARCH, SEARCH_TAPS, SearchWindow};
use crate::technique::common::hsm::Hsm;
use crate::technique::common::pixels::{PixelList, PixelPass, Step, no_list};
use crate::technique::common::rbsm_receiver::RbsmPush;
use crate::technique::common::receiver::{self, ReceiverPush};
use crate::technique::common::tiles::indirect_list;
use crate::technique::revectorization::revectorized::{DEPTH_BIAS, MAX_DISTANCE, NORMAL_OFFSET};
use crate::technique::{Info, Kind, Param, Params, Passes, Setup};
use crate::{Bind, Context, Frame, Inputs, Pass, Result, Threads};
use ash::vk;
use std::sync::Arc;

/// The registry entry.
pub const INFO: Info = Info {
    id: "soft-auto",
    title: "Hybrid of soft shadows",
    paper: "this project; named as future work by Macedo, Apolinário, Agüero 2019",
    summary: "One blocker search, then what each penumbra is worth: revectorized visibility under every tap, or percentage-closer filtering.",
    params: &[
        SEARCH_TAPS,
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
        SEARCH,
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
        Param { default: 0.3, ..NORMAL_OFFSET },
        DEPTH_BIAS,
        Param::choice(
            "skip",
            SKIP_CHOICES,
            0,
            "decide pixels whose window is lit or in shadow by depth bounds of the map, before the search and after it; the values are those of pcss, the image is the same",
        ),
    ],
    published: &[],
    needs: &[],
    kind: Kind::RealTime(prepare),
};

bindings! {
    struct EstimateBindings { ..search: SearchBindings, kernel, wide }
    struct OnDemandBindings { list, Groups }
}

/// The technique with its lists: 20 bytes a pixel, less 4 if the threshold rules out the filter of narrow penumbrae.
pub(in crate::technique) struct SoftAuto {
    classes: MapClasses,
    estimate: PixelPass,
    half_widths: Image,
    kernel: Option<(MeasuredFilter, PixelList)>,
    wide: (MeasuredFilter, PixelList),
    /// Stands in for the list of a filter that is ruled out.
    unlisted: Buffer,
    /// Makes the pyramid only if another pass has listed pixels.
    on_demand: Option<OnDemand>,
    edge_push: RbsmPush,
    push: ReceiverPush,
}

/// Dispatch arguments of the depth pyramid, which a pass turns to zero if a list is empty.
struct OnDemand {
    decide: Arc<ComputePipeline>,
    groups: Buffer,
}

fn prepare(context: &Context, setup: &Setup) -> Result<Box<dyn Passes>> {
    Ok(Box::new(SoftAuto::new(context, setup, None)?))
}

impl SoftAuto {
    /// Prepares the technique, with its parameters in `setup`. With `listed`, another pass lists the pixels, see
    /// [`SoftAuto::record_listed`]; the parameter `skip` is then off.
    fn new(context: &Context, setup: &Setup, listed: Option<&Arc<Buffer>>) -> Result<Self> {
        let (p, extent) = (&setup.params, setup.extent);
        let kernel_texels = p.float("kernel_texels");
        let skip = Skip::of(context, setup);
        let kernel = RbssmConfig::new(p, p.int("kernel_taps"));
        let RbssmConfig { search_taps, window, .. } = kernel;
        let filter_taps = p.int("filter_taps");
        let (mean_depth, fixed_depth) = (false, false);
        let wide =
            PcssConfig { search_taps, filter_taps, window, mean_depth, fixed_depth, bilinear: true, exact_box: true };
        let list = |name: &str| PixelList::new(context, name, extent);
        // Made first: it rejects an image with too many pixels to list, where the pass would work without a list.
        let wide = (pcss::measured_filter(context, wide)?, list("pixels in wide penumbrae")?);
        // The search makes the lists of both filters, so the dearest of the three counts.
        let rounds = (blocker_search::rounds(search_taps) + 500)
            .max(kernel.filter_rounds())
            .max(pcss::filter_rounds(filter_taps));
        let pipeline = |step: Step| {
            let constants = [
                // Declared by `glsl/common/rbsm_receiver.glsl`: texels are tested on the receiver's plane.
                ("FIXED", 0),
                ("SEARCH_TAPS", search_taps),
                ("CLASSIFY", (skip != Skip::Off).into()),
                ("NEAREST_BLOCKER", (window == SearchWindow::Blockers).into()),
                ("STEP", step as u32),
                step.together(context, rounds),
                ("LEAST_WIDTH", kernel.least_width.to_bits()),
                ("KERNEL_TEXELS", kernel_texels.to_bits()),
                ("THIN_DISTANCE", p.float("thin_distance").to_bits()),
            ];
            context.pipeline::<EstimateBindings, RbsmPush>("soft/soft_auto.comp", &constants)
        };
        let name = "pixels in penumbrae";
        let estimate = match skip {
            Skip::Off => PixelPass::sharing(context, name, extent, true, pipeline, listed)?,
            _ => skip.pass(context, name, extent, pipeline)?,
        };
        let kernel = match kernel_texels > 0.0 {
            true => Some((rbssm::measured_filter(context, kernel)?, list("pixels in narrow penumbrae")?)),
            false => None,
        };
        let classes = MapClasses::new(context, setup.map_size, window, skip != Skip::Off)?;
        let on_demand = |pyramid: &Hsm| -> Result<OnDemand> {
            let size = 16 * pyramid.groups().len() as u64;
            Ok(OnDemand {
                decide: context.pipeline::<OnDemandBindings, ()>("soft/on_demand.comp", &[])?,
                groups: indirect_list(context.device(), "workgroups of the depth pyramid", size, 0)?,
            })
        };
        let on_demand = classes.pyramid().filter(|_| listed.is_some()).map(on_demand).transpose()?;
        let widths = ImageDesc::storage("half-widths of filters", vk::Format::R32G32_SFLOAT, extent);
        Ok(Self {
            classes,
            on_demand,
            estimate,
            half_widths: Image::new(context.device(), &widths)?,
            kernel,
            wide,
            unlisted: no_list(context)?,
            edge_push: rbssm::push(p),
            push: receiver::push(setup),
        })
    }

    /// Prepares the technique for the pixels that another pass lists in `list`, which [`pixel_list`] makes.
    ///
    /// [`pixel_list`]: crate::technique::common::pixels::pixel_list
    pub(in crate::technique) fn for_list(context: &Context, setup: &Setup, list: &Arc<Buffer>) -> Result<Self> {
        let mut params = Params::new(&INFO);
        params.set(INFO.id, "skip", "off")?;
        Self::new(context, &Setup { params, intermediates: false, ..setup.clone() }, Some(list))
    }

    /// Writes the visibility of the listed pixels.
    pub(in crate::technique) fn record_listed(
        &mut self,
        frame: &mut Frame<'_>,
        view: &Buffer,
        inputs: &Inputs<'_>,
        visibility: &Image,
    ) -> Result<()> {
        self.record_steps(frame, view, inputs, visibility, true)
    }

    /// Makes the depth pyramid if pixels are listed.
    fn record_pyramid(&self, frame: &mut Frame<'_>, inputs: &Inputs<'_>, on_demand: &OnDemand) -> Result<()> {
        let Some(pyramid) = self.classes.pyramid() else { return Ok(()) };
        frame.update(&on_demand.groups, bytemuck::cast_slice(&pyramid.groups()));
        frame.dispatch(&Pass {
            name: "listed pixels or none",
            pipeline: &on_demand.decide,
            bind: &OnDemandBindings { list: self.estimate.list(), Groups: Bind::Buffer(&on_demand.groups) },
            push: &[],
            threads: Threads::Count([1, 1, 1]),
        })?;
        pyramid.record_indirect(frame, inputs, &on_demand.groups)
    }

    fn lists(&self) -> [Option<&PixelList>; 2] {
        [self.kernel.as_ref().map(|k| &k.1), Some(&self.wide.1)]
    }

    fn record_steps(
        &mut self,
        frame: &mut Frame<'_>,
        view: &Buffer,
        inputs: &Inputs<'_>,
        visibility: &Image,
        listed: bool,
    ) -> Result<()> {
        match &self.on_demand {
            Some(on_demand) => self.record_pyramid(frame, inputs, on_demand)?,
            None => self.classes.record(frame, inputs)?,
        }
        for list in self.lists().into_iter().flatten() {
            list.clear(frame);
        }
        let [hsm, blocks] = self.classes.bind(inputs);
        let [kernel, wide] = self.lists().map(|l| l.map_or(Bind::Buffer(&self.unlisted), PixelList::bind));
        let pixels = PixelBindings::borderless(view, inputs, visibility, self.estimate.list());
        let search = SearchBindings {
            pixels,
            hsm,
            blocks,
            half_widths: Bind::Image(&self.half_widths),
            open_tiles: self.estimate.tile_list(),
        };
        let bind = &EstimateBindings { search, kernel, wide };
        let names = ["classify penumbrae", "search blockers"];
        let edge_push = bytemuck::bytes_of(&self.edge_push);
        match listed {
            true => self.estimate.record_listed(frame, names[1], bind, edge_push)?,
            false => self.estimate.record(frame, names, bind, edge_push, visibility)?,
        }
        if let Some((pass, list)) = &self.kernel {
            pass.record(frame, view, inputs, edge_push, (list, &self.half_widths), visibility)?;
        }
        let (pass, list) = &self.wide;
        let push = bytemuck::bytes_of(&self.push);
        pass.record(frame, view, inputs, push, (list, &self.half_widths), visibility)
    }
}

impl Passes for SoftAuto {
    fn record(&mut self, frame: &mut Frame<'_>, view: &Buffer, inputs: &Inputs<'_>, visibility: &Image) -> Result<()> {
        self.record_steps(frame, view, inputs, visibility, false)
    }

    fn memory_bytes(&self) -> u64 {
        self.estimate.memory_bytes()
            + self.classes.memory_bytes()
            + self.half_widths.memory_bytes()
            + self.lists().into_iter().flatten().map(PixelList::memory_bytes).sum::<u64>()
    }
}
