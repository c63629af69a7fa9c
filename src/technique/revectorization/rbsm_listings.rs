//! Revectorization by the papers' listings line by line: the opponent of `rbsm`, `rbsm-filtered` and `rbsm-star`.

use super::revectorized::{DEPTH_BIAS, MAX_DISTANCE, NORMAL_OFFSET, RECEIVER, SLACK, push};
use crate::gpu::{Buffer, ComputePipeline, Image, bindings};
use crate::technique::common::bindings::ReceiverBindings;
use crate::technique::common::rbsm_receiver::RbsmPush;
use crate::technique::{Info, Kind, Param, Passes, Setup};
use crate::{Bind, Context, Frame, Inputs, Pass, Result, Threads};
use std::sync::Arc;

/// The registry entry.
pub const INFO: Info = Info {
    id: "rbsm-listings",
    title: "Revectorization by the papers' listings",
    paper: "Macedo, Apolinário, Agüero 2017, listings 1-5; Macedo, Apolinário 2018, eq. 5-7",
    summary: "The images of rbsm, rbsm-filtered (shapes=printed) and rbsm-star, bit for bit, from the printed code: to read beside the papers.",
    params: &[VARIANT, RECEIVER, MAX_DISTANCE, NORMAL_OFFSET, DEPTH_BIAS, SLACK],
    published: &[],
    needs: &[],
    kind: Kind::RealTime(prepare),
};

const VARIANT: Param = Param::choice(
    "variant",
    &["silhouette", "filtered", "star"],
    0,
    "listing 4 (the image of rbsm), listing 5 (rbsm-filtered with shapes=printed), or equation 7 (rbsm-star)",
);

bindings! {
    struct ListingBindings { ..receiver: ReceiverBindings, visibility }
}

struct Listings {
    pipeline: Arc<ComputePipeline>,
    push: RbsmPush,
}

fn prepare(context: &Context, setup: &Setup) -> Result<Box<dyn Passes>> {
    let p = &setup.params;
    let function = match p.word("variant") {
        "silhouette" => 0,
        "filtered" => 1,
        _ => 2,
    };
    let is_fixed = p.word("receiver") == "fixed";
    let constants = [("FIXED", is_fixed.into()), ("MAX_DISTANCE", p.int("max_distance")), ("FUNCTION", function)];
    let pipeline = context.pipeline::<ListingBindings, RbsmPush>("revectorization/rbsm_listings.comp", &constants)?;
    Ok(Box::new(Listings { pipeline, push: push(setup) }))
}

impl Passes for Listings {
    fn record(&mut self, frame: &mut Frame<'_>, view: &Buffer, inputs: &Inputs<'_>, visibility: &Image) -> Result<()> {
        let [width, height] = visibility.extent();
        frame.dispatch(&Pass {
            name: "listings",
            pipeline: &self.pipeline,
            bind: &ListingBindings {
                receiver: ReceiverBindings::new(view, inputs),
                visibility: Bind::Image(visibility),
            },
            push: bytemuck::bytes_of(&self.push),
            threads: Threads::Count([width, height, 1]),
        })
    }
}
