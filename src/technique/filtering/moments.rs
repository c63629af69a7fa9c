//! Moments of the shadow map, filtered before they are looked up: what `vsm`, `evsm` and `msm` share.

use super::moment_kind::{Kind, range};
use super::summed_area::{SummedArea, TablePush};
use crate::gpu::{Buffer, ComputePipeline, Image, ImageDesc, bindings, shader_struct};
use crate::technique::common::bindings::CameraBindings;
use crate::technique::common::kept::Kept;
use crate::technique::{Param, Params, Passes, Setup};
use crate::{Bind, Context, Error, Frame, Inputs, Pass, Result, Threads};
use ash::vk;
use std::sync::Arc;

pub(super) const FILTER: Param = Param::choice(
    "filter",
    &["box", "gaussian"],
    0,
    "mean over width x width texels, or a Gaussian of the same variance, cut off at three standard deviations",
);
pub(super) const WIDTH: Param = Param::odd("width", 1, 255, 3, "texels", "width of the filter");
pub(super) const MIPS: Param =
    Param::switch("mips", true, "a chain of coarser moments, for pixels that cover many texels of the map");
pub(super) const ANISOTROPY: Param =
    Param::int("anisotropy", 1, 16, 8, "taps", "most lookups along the longer axis of what a pixel covers; needs mips");
pub(crate) const DEPTH_BIAS: Param = Param::float(
    "depth_bias",
    0.0,
    16.0,
    0.0,
    "half windows",
    "subtracted from the receiver's depth in addition, as a share of the rise of its plane from the window's middle to its corner",
);
pub(crate) const DEVIATION: Param = Param::float(
    "deviation",
    0.0,
    0.1,
    0.0005,
    "light depths",
    "least standard deviation of the depths in a window; rounding may require more",
);
pub(crate) const MOMENT_BIAS: Param = Param::float(
    "moment_bias",
    0.0,
    0.1,
    0.0,
    "share",
    "share of moments that are certainly possible, against rounding; 0 = what the bits and the widest window need",
);
pub(crate) const REDUCTION: Param = Param::float(
    "reduction",
    0.0,
    0.99,
    0.0,
    "visibility",
    "light leaking: what is darker counts as shadow, and the rest is stretched to 0 to 1",
);
pub(super) const FETCH: Param = Param::choice(
    "fetch",
    &["auto", "sampler", "texels"],
    0,
    "moments interpolated by the device's sampler, or in the shader from single texels; auto asks what the format allows",
);

shader_struct! {
    /// Push constants of `glsl/filtering/moment_rows.comp` and `moment_columns.comp`.
    pub struct MomentPush {
        map_size: [i32; 2],
        range: f32,
        exponents: [f32; 2],
    }
}

shader_struct! {
    /// Push constants of `glsl/filtering/moment_lookup.glsl`.
    pub struct LookupPush {
        /// Multiples of what a plane needs.
        normal_offset: f32,
        /// Share of the rise of the receiver's plane from the window's middle to its corner.
        depth_bias: f32,
        /// Width of the filter, texels.
        width: f32,
        /// Value of [`range`]; set when the pass is recorded.
        range: f32,
        /// Most taps along a pixel's longer axis.
        anisotropy: i32,
        /// Largest visibility that counts as shadow.
        reduction: f32,
        /// Least standard deviation of signed depths.
        least_deviation: f32,
        /// Share of moments that are certainly possible.
        moment_bias: f32,
        /// Exponents of the warps.
        exponents: [f32; 2],
    }
}

bindings! {
    struct RowsBindings { shadow_map, filtered_rows }
    struct ColumnsBindings { filtered_rows, moments }
    struct MeansBindings { table, moments }
    struct MipBindings { finer, coarser }
    struct LookupBindings { ..camera: CameraBindings, moments, visibility }
}

/// Way in which the moments are filtered.
enum Filter {
    /// A box of any width by four entries of a table.
    Table(Box<SummedArea>, Arc<ComputePipeline>),
    /// Along the rows, then along the columns.
    Separable { rows: Arc<ComputePipeline>, columns: Arc<ComputePipeline>, filtered_rows: Image },
}

/// A technique's moments and the lookup in them.
pub(super) struct Config<'a> {
    /// Name of the lookup in timings: the technique's id.
    pub name: &'static str,
    pub kind: Kind,
    /// Format of the filtered moments.
    pub format: vk::Format,
    /// Exponents of the warps; without meaning for other kinds.
    pub exponents: [f32; 2],
    /// The shader of the lookup, and its constants beyond those of `moment_lookup.glsl`.
    pub shader: &'a str,
    pub constants: &'a [(&'static str, u32)],
    pub push: LookupPush,
}

/// Texels of a separable filter on each side of its middle: a Gaussian's standard deviation is the width over the root of
/// 12, and it ends at three of them.
pub(super) fn radius(width: u32, gaussian: bool) -> u32 {
    if gaussian { (0.75f64.sqrt() * f64::from(width)).ceil() as u32 } else { width / 2 }
}

/// Settings of the lookup that all three techniques have; the others are 0.
pub(super) fn lookup_push(p: &Params) -> LookupPush {
    LookupPush {
        normal_offset: p.float("normal_offset"),
        depth_bias: p.float("depth_bias"),
        width: p.int("width") as f32,
        anisotropy: p.int("anisotropy") as i32,
        reduction: p.float("reduction"),
        ..LookupPush::default()
    }
}

/// True if the filter of the technique's parameters is a box over a summed-area table, of which warped moments have none.
pub(super) fn is_table(kind: Kind, p: &Params) -> bool {
    kind != Kind::Warped && p.word("filter") == "box"
}

/// Passes of a technique: filtered moments of the shadow map, kept while the light stands still, and their lookup.
pub(super) struct MomentMap {
    name: &'static str,
    kind: Kind,
    filter: Filter,
    mips: Option<Arc<ComputePipeline>>,
    lookup: Arc<ComputePipeline>,
    moments: Image,
    levels: u32,
    is_sampled: bool,
    push: LookupPush,
    kept: Kept,
}

impl MomentMap {
    /// Allocates for a shadow map.
    ///
    /// # Errors
    /// [`Error::Parameter`] if the device's sampler is asked for and does not filter the format.
    pub fn new(context: &Context, setup: &Setup, config: &Config<'_>) -> Result<Self> {
        let Config { kind, format, .. } = *config;
        let (p, device) = (&setup.params, context.device());
        let filters = device.format_features(format).contains(vk::FormatFeatureFlags::SAMPLED_IMAGE_FILTER_LINEAR);
        let is_sampled = match p.word("fetch") {
            "texels" => false,
            "sampler" if !filters => {
                let problem =
                    format!("fetch=sampler: this device does not filter {format:?}; take fetch=texels or auto");
                return Err(Error::Parameter(problem));
            }
            _ => filters,
        };
        let (width, gaussian) = (p.int("width"), p.word("filter") == "gaussian");
        let levels = if p.on("mips") { setup.map_size[0].max(setup.map_size[1]).ilog2() + 1 } else { 1 };
        let [kind_constant, width_constant] = [("KIND", kind as u32), ("WIDTH", width)];
        let filter = if is_table(kind, p) {
            // A table holds integers, whatever becomes of them.
            let kind = if kind == Kind::Powers { Kind::Packed } else { kind };
            let unpacked = config.kind == Kind::Powers;
            let constants = [("KIND", kind as u32), width_constant, ("UNPACKED", unpacked.into())];
            let means = context.pipeline::<MeansBindings, TablePush>("filtering/table_means.comp", &constants)?;
            Filter::Table(Box::new(SummedArea::new(context, setup.map_size, kind, width)?), means)
        } else {
            let constants =
                [kind_constant, width_constant, ("GAUSSIAN", gaussian.into()), ("RADIUS", radius(width, gaussian))];
            // Between the two the moments are not rounded to a format of 16 bits.
            let desc = ImageDesc::storage("filtered rows", wide(format), setup.map_size);
            Filter::Separable {
                rows: context.pipeline::<RowsBindings, MomentPush>("filtering/moment_rows.comp", &constants)?,
                columns: context
                    .pipeline::<ColumnsBindings, MomentPush>("filtering/moment_columns.comp", &constants)?,
                filtered_rows: Image::new(device, &desc)?,
            }
        };
        let constants = [&[("SAMPLED", is_sampled.into()), ("MIPS", (levels > 1).into())], config.constants].concat();
        let desc = ImageDesc { mips: levels, ..ImageDesc::storage("moments", format, setup.map_size) };
        Ok(Self {
            name: config.name,
            kind,
            filter,
            mips: match levels {
                1 => None,
                _ => Some(context.pipeline::<MipBindings, ()>("filtering/moment_mips.comp", &[])?),
            },
            lookup: context.pipeline::<LookupBindings, LookupPush>(config.shader, &constants)?,
            moments: Image::new(device, &desc)?,
            levels,
            is_sampled,
            push: LookupPush { exponents: config.exponents, ..config.push },
            kept: Kept::default(),
        })
    }

    fn record_moments(&mut self, frame: &mut Frame<'_>, inputs: &Inputs<'_>, range: f32) -> Result<()> {
        let [width, height] = self.moments.extent();
        let threads = Threads::Count([width, height, 1]);
        let moments = Bind::Mip(&self.moments, 0);
        match &mut self.filter {
            Filter::Table(table, means) => {
                table.record(frame, inputs, range)?;
                frame.dispatch(&Pass {
                    name: "means of the table",
                    pipeline: means,
                    bind: &MeansBindings { table: Bind::Image(table.table()), moments },
                    push: bytemuck::bytes_of(&table.push(range)),
                    threads,
                })?;
            }
            Filter::Separable { rows, columns, filtered_rows } => {
                let filtered_rows = Bind::Image(filtered_rows);
                let push = MomentPush {
                    map_size: [width as i32, height as i32],
                    range,
                    exponents: if self.kind == Kind::Warped { self.push.exponents } else { [0.0; 2] },
                };
                let push = bytemuck::bytes_of(&push);
                let shadow_map = Bind::Input(&inputs.shadow_map);
                frame.dispatch(&Pass {
                    name: "moments, rows",
                    pipeline: rows,
                    bind: &RowsBindings { shadow_map, filtered_rows },
                    push,
                    threads,
                })?;
                // A thread has 16 rows.
                let threads = Threads::Count([width, height.div_ceil(64) * 4, 1]);
                let bind = &ColumnsBindings { filtered_rows, moments };
                frame.dispatch(&Pass { name: "moments, columns", pipeline: columns, bind, push, threads })?;
            }
        }
        let Some(mips) = &self.mips else { return Ok(()) };
        for level in 1..self.levels {
            let [width, height] = [width, height].map(|n| (n >> level).max(1));
            frame.dispatch(&Pass {
                name: &format!("moments, level {level}"),
                pipeline: mips,
                bind: &MipBindings {
                    finer: Bind::Mip(&self.moments, level - 1),
                    coarser: Bind::Mip(&self.moments, level),
                },
                push: &[],
                threads: Threads::Count([width, height, 1]),
            })?;
        }
        Ok(())
    }
}

impl Passes for MomentMap {
    fn record(&mut self, frame: &mut Frame<'_>, view: &Buffer, inputs: &Inputs<'_>, visibility: &Image) -> Result<()> {
        let range = range(&inputs.light[0]);
        if !self.kept.holds(inputs) {
            self.kept.make(frame, inputs);
            self.record_moments(frame, inputs, range)?;
        }
        let [width, height] = visibility.extent();
        frame.dispatch(&Pass {
            name: self.name,
            pipeline: &self.lookup,
            bind: &LookupBindings {
                camera: CameraBindings::new(view, inputs),
                moments: if self.is_sampled { Bind::Filtered(&self.moments) } else { Bind::Image(&self.moments) },
                visibility: Bind::Image(visibility),
            },
            push: bytemuck::bytes_of(&LookupPush { range, ..self.push }),
            threads: Threads::Count([width, height, 1]),
        })
    }

    fn intermediates(&self) -> Vec<(&'static str, &Image)> {
        vec![("moments", &self.moments)]
    }

    fn memory_bytes(&self) -> u64 {
        let filter = match &self.filter {
            Filter::Table(table, _) => table.memory_bytes(),
            Filter::Separable { filtered_rows, .. } => filtered_rows.memory_bytes(),
        };
        filter + self.moments.memory_bytes()
    }
}

/// The format of 32-bit floats with as many components.
fn wide(format: vk::Format) -> vk::Format {
    match format {
        vk::Format::R32G32_SFLOAT | vk::Format::R16G16_SFLOAT => vk::Format::R32G32_SFLOAT,
        _ => vk::Format::R32G32B32A32_SFLOAT,
    }
}
