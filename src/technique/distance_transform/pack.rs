//! Passes that turn a mask into seed bits.

use super::EdtPush;
use crate::gpu::{Buffer, ComputePipeline, bindings};
use crate::{Bind, Error, Frame, ImageRef, Pass, Result, Threads};
use ash::vk;
use std::sync::Arc;

bindings! {
    struct ImageBindings { mask, SeedBits }
    struct BytesBindings { Mask, SeedBits }
}

/// The pipelines, one for each kind of mask. Each is made at its first use.
#[derive(Default)]
pub(super) struct Pack {
    unorm: Option<Arc<ComputePipeline>>,
    uint: Option<Arc<ComputePipeline>>,
    bytes: Option<Arc<ComputePipeline>>,
}

impl Pack {
    pub fn record(
        &mut self,
        frame: &mut Frame<'_>,
        mask: &ImageRef,
        extent: [u32; 2],
        seed_bits: &Buffer,
    ) -> Result<()> {
        let wrong = |problem| Err(Error::Input { technique: "edt".into(), input: "mask", problem });
        if mask.extent != extent {
            let ([w, h], [width, height]) = (mask.extent, extent);
            return wrong(format!("it has {w}x{h} pixels, but the transform was made for {width}x{height}"));
        }
        let (slot, shader) = match mask.format {
            vk::Format::R8_UINT | vk::Format::R16_UINT | vk::Format::R32_UINT => {
                (&mut self.uint, "distance_transform/edt_pack_uint.comp")
            }
            vk::Format::R8_UNORM | vk::Format::R16_UNORM | vk::Format::R16_SFLOAT | vk::Format::R32_SFLOAT => {
                (&mut self.unorm, "distance_transform/edt_pack.comp")
            }
            format => {
                return wrong(format!(
                    "{format:?} is not a single-channel format of numbers; use R8_UNORM, for example"
                ));
            }
        };
        let pipeline = match slot {
            Some(pipeline) => pipeline,
            None => slot.insert(frame.context().pipeline::<ImageBindings, EdtPush>(shader, &[])?),
        };
        frame.dispatch(&Pass {
            name: "edt pack",
            pipeline,
            bind: &ImageBindings { mask: Bind::Input(mask), SeedBits: Bind::Buffer(seed_bits) },
            push: bytemuck::bytes_of(&EdtPush { size: extent, ..EdtPush::default() }),
            threads: Threads::Count([extent[0], extent[1].div_ceil(32), 1]),
        })
    }

    pub fn record_bytes(
        &mut self,
        frame: &mut Frame<'_>,
        mask: &Buffer,
        extent: [u32; 2],
        seed_bits: &Buffer,
    ) -> Result<()> {
        let needed = u64::from(extent[0].next_multiple_of(4)) * u64::from(extent[1]);
        if mask.size() < needed {
            let problem = format!(
                "it has {} bytes, but {needed} are needed: rows are padded to multiples of 4 bytes",
                mask.size()
            );
            return Err(Error::Input { technique: "edt".into(), input: "mask", problem });
        }
        // Words per row that a thread reads. A GPU is faster with more threads.
        let words = if frame.context().device().is_cpu() && extent[0].is_multiple_of(16) { 4 } else { 1 };
        let pipeline = match &mut self.bytes {
            Some(pipeline) => pipeline,
            slot => {
                let shader = "distance_transform/edt_pack_bytes.comp";
                let constants = [("WORDS", words)];
                slot.insert(frame.context().pipeline::<BytesBindings, EdtPush>(shader, &constants)?)
            }
        };
        frame.dispatch(&Pass {
            name: "edt pack",
            pipeline,
            bind: &BytesBindings { Mask: Bind::Buffer(mask), SeedBits: Bind::Buffer(seed_bits) },
            push: bytemuck::bytes_of(&EdtPush { size: extent, ..EdtPush::default() }),
            threads: Threads::Count([extent[0].div_ceil(4 * words), extent[1].div_ceil(32), 1]),
        })
    }
}
