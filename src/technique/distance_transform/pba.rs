//! `pba`: the Parallel Banding Algorithm.

use super::columns::{Columns, ColumnsBindings};
use super::{EdtPush, Output, storage};
use crate::gpu::{Buffer, ComputePipeline, bindings};
use crate::{Bind, Context, Frame, Pass, Result, Threads};
use std::sync::Arc;

/// Number of bands in each phase. More bands give more threads, but also more work to join them. Numbers too large for
/// the image are reduced.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Bands {
    /// Phase 1: number of bands into which the blocks of 32 rows are divided (the paper's m1).
    pub rows: u32,
    /// Phase 2: number of bands of columns, which are joined in pairs (m2).
    pub columns: u32,
    /// Phase 3: number of blocks into which the pixels of a row are divided, for separate threads (m3).
    pub pixels: u32,
}

impl Bands {
    /// Default numbers for a device. On a CPU driver, each column and each row gets one thread, because more threads do
    /// not help its few cores. Otherwise bands have 256 rows, 64 columns and 32 pixels.
    pub(super) fn for_device(is_cpu: bool, extent: [u32; 2]) -> Self {
        if is_cpu {
            return Self { rows: 1, columns: 1, pixels: 1 };
        }
        let [width, height] = extent;
        Self { rows: height.div_ceil(256), columns: width.div_ceil(64), pixels: width.div_ceil(32) }
    }
}

bindings! {
    struct SitesBindings { Sites, Bands }
    struct BandsBindings { ..columns: ColumnsBindings, ..sites: SitesBindings, }
    struct ColorBindings { ..sites: SitesBindings, labels, squared_distances }
}

pub(super) struct Pba {
    columns: Columns,
    bands: Arc<ComputePipeline>,
    /// Present only with more than one band of columns.
    merge: Option<Arc<ComputePipeline>>,
    color: Arc<ComputePipeline>,
    push: EdtPush,
    pixel_bands: u32,
    sites: Buffer,
    ranges: Buffer,
}

impl Pba {
    pub fn new(context: &Context, push: EdtPush, bands: Bands) -> Result<Self> {
        let [width, height] = push.size;
        let pixels = u64::from(width) * u64::from(height);
        let span = width.div_ceil(bands.columns.clamp(1, width));
        let push = EdtPush { span, bands: width.div_ceil(span), ..push };
        let merge = match push.bands {
            1 => None,
            _ => Some(context.pipeline::<SitesBindings, EdtPush>("distance_transform/edt_pba_merge.comp", &[])?),
        };
        Ok(Self {
            columns: Columns::new(context, push, bands.rows)?,
            bands: context.pipeline::<BandsBindings, EdtPush>("distance_transform/edt_pba_bands.comp", &[])?,
            merge,
            color: context.pipeline::<ColorBindings, EdtPush>("distance_transform/edt_pba_color.comp", &[])?,
            push,
            pixel_bands: bands.pixels.clamp(1, width),
            sites: storage(context, "edt sites", pixels, 8)?,
            ranges: storage(context, "edt bands", u64::from(push.bands) * u64::from(height), 4)?,
        })
    }

    pub fn record(&self, frame: &mut Frame<'_>, seed_bits: &Buffer, output: &Output<'_>) -> Result<()> {
        self.columns.record(frame, seed_bits)?;
        let [width, height] = self.push.size;
        let sites = SitesBindings { Sites: Bind::Buffer(&self.sites), Bands: Bind::Buffer(&self.ranges) };
        frame.dispatch(&Pass {
            name: "edt bands",
            pipeline: &self.bands,
            bind: &BandsBindings { columns: self.columns.bind(), sites },
            push: bytemuck::bytes_of(&self.push),
            threads: Threads::Count([height, self.push.bands, 1]),
        })?;
        if let Some(pipeline) = &self.merge {
            let sizes = std::iter::successors(Some(1), |n| Some(n * 2)).take_while(|&n| n < self.push.bands);
            for merge in sizes {
                frame.dispatch(&Pass {
                    name: &format!("edt merge, {} bands each", 2 * merge),
                    pipeline,
                    bind: &sites,
                    push: bytemuck::bytes_of(&EdtPush { merge, ..self.push }),
                    threads: Threads::Count([height, self.push.bands.div_ceil(2 * merge), 1]),
                })?;
            }
        }
        let span = width.div_ceil(self.pixel_bands);
        frame.dispatch(&Pass {
            name: "edt color",
            pipeline: &self.color,
            bind: &ColorBindings {
                sites,
                labels: Bind::Image(output.labels),
                squared_distances: Bind::Image(output.squared),
            },
            push: bytemuck::bytes_of(&EdtPush { span, ..self.push }),
            threads: Threads::Count([height, width.div_ceil(span), 1]),
        })
    }

    pub fn memory_bytes(&self) -> u64 {
        self.columns.memory_bytes() + self.sites.size() + self.ranges.size()
    }
}
