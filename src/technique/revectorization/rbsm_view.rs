//! Pictures of the intermediate results of the RBSM family.

use super::rbsm_pass::{RbsmConfig, Revectorization};
use crate::gpu::{Buffer, ComputePipeline, Image, ImageDesc, bindings};
use crate::technique::common::bindings::ReceiverBindings;
use crate::technique::common::rbsm_receiver::RbsmPush;
use crate::{Bind, Context, Frame, Inputs, Pass, Result, Threads};
use ash::vk;
use std::sync::Arc;

/// Names of the images, which have four channels. Except in the first image, the channels are in the order of listing 2
/// (left, right, +v, -v) and are 0 where there is no edge.
///
/// * `discontinuity`: the packed form of listing 2, that is `(2 left + right)/4`, `(2 (+v) + (-v))/4`, and 1 in shadow.
///   The fourth channel is 1.
/// * `runs`: number of texels to the end of the run in listing 3; `MAXDIST` + 1 if the end was not reached.
/// * `ends`: 1 if the run ends at an edge end, -1 if it steps out of the edge or its end was not reached.
/// * `profile-height`: height of the edge profile over each side of the texel, in texels.
pub const NAMES: [&str; 4] = ["discontinuity", "runs", "ends", "profile-height"];

bindings! {
    struct ViewBindings { ..receiver: ReceiverBindings, discontinuity, runs, ends, height }
}

/// The pass with its images.
pub struct RbsmView {
    pipeline: Arc<ComputePipeline>,
    images: [Image; 4],
}

impl RbsmView {
    /// Makes the pass for a camera image.
    pub fn new(context: &Context, extent: [u32; 2], config: RbsmConfig) -> Result<Self> {
        let quality = match config.revectorization {
            Revectorization::Profile(quality) => quality as u32,
            _ => 0,
        };
        let constants =
            [("FIXED", config.fixed_depth.into()), ("MAX_DISTANCE", config.max_distance), ("QUALITY", quality)];
        let pipeline = context.pipeline::<ViewBindings, RbsmPush>("revectorization/rbsm_view.comp", &constants)?;
        let image =
            |name| Image::new(context.device(), &ImageDesc::storage(name, vk::Format::R32G32B32A32_SFLOAT, extent));
        let [d, r, e, h] = NAMES;
        Ok(Self { pipeline, images: [image(d)?, image(r)?, image(e)?, image(h)?] })
    }

    /// Names and images.
    pub fn images(&self) -> Vec<(&'static str, &Image)> {
        NAMES.into_iter().zip(&self.images).collect()
    }

    /// Bytes of device memory that the pass holds.
    pub fn memory_bytes(&self) -> u64 {
        self.images.iter().map(Image::memory_bytes).sum()
    }

    /// Fills the images.
    pub fn record(&self, frame: &mut Frame<'_>, view: &Buffer, inputs: &Inputs<'_>, push: RbsmPush) -> Result<()> {
        let [columns, rows] = self.images[0].extent();
        let [discontinuity, runs, ends, height] = self.images.each_ref().map(Bind::Image);
        frame.dispatch(&Pass {
            name: "intermediates",
            pipeline: &self.pipeline,
            bind: &ViewBindings { receiver: ReceiverBindings::new(view, inputs), discontinuity, runs, ends, height },
            push: bytemuck::bytes_of(&push),
            threads: Threads::Count([columns, rows, 1]),
        })
    }
}
