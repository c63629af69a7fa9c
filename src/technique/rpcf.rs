//! Percentage-closer filtering of revectorized visibility.

use super::revectorized::{self, DEPTH_BIAS, MAX_DISTANCE, NORMAL_OFFSET, RECEIVER, SLACK};
use super::{Info, Kind, Param, Setup, Technique, visibility_image};
use crate::gpu::Image;
use crate::pass::rbsm::RbsmPush;
use crate::pass::rpcf::{Rpcf, RpcfConfig, RpcfVisibility};
use crate::pass::view::ViewBuffer;
use crate::{Context, Frame, ImageRef, Inputs, Result};

/// The registry entry.
pub const INFO: Info = Info {
    id: "rpcf",
    title: "Revectorized percentage-closer filtering",
    paper: "Macedo, Apolinário 2018, section 5",
    summary: "Averages revectorized visibility over w x w texels: a soft edge w texels wide without the map's stairs.",
    params: &[
        Param::odd("width", 1, 31, 7, "texels", "width of the kernel"),
        Param::choice(
            "visibility",
            &["filtered", "star", "profile"],
            0,
            "what is averaged: listing 5, RBSM*, or the edge profile of runs",
        ),
        RECEIVER,
        MAX_DISTANCE,
        NORMAL_OFFSET,
        DEPTH_BIAS,
        SLACK,
        Param::choice(
            "skip",
            &["auto", "off", "list", "bounds"],
            0,
            "pixels near an edge are worked on where they are found, or listed (auto) for a dispatch of their own; with \
             bounds, depth bounds of the map's blocks decide pixels before any test, and the rest is listed: the same image",
        ),
    ],
    needs: &[],
    kind: Kind::RealTime(prepare),
};

struct RevectorizedFiltering {
    view: ViewBuffer,
    rpcf: Rpcf,
    push: RbsmPush,
    map_size: [u32; 2],
    visibility: Image,
}

fn prepare(context: &Context, setup: &Setup) -> Result<Box<dyn Technique>> {
    let p = &setup.params;
    let config = RpcfConfig {
        width: p.int("width"),
        visibility: match p.word("visibility") {
            "filtered" => RpcfVisibility::Filtered,
            "star" => RpcfVisibility::Star,
            _ => RpcfVisibility::Profile,
        },
        fixed_depth: p.word("receiver") == "fixed",
        max_distance: p.int("max_distance"),
        bounded: p.word("skip") == "bounds",
        listed: p.word("skip") != "off",
    };
    Ok(Box::new(RevectorizedFiltering {
        view: ViewBuffer::new(context.device())?,
        rpcf: Rpcf::new(context, setup.extent, setup.map_size, config)?,
        push: revectorized::push(setup),
        map_size: setup.map_size,
        visibility: visibility_image(context.device(), "rpcf visibility", setup)?,
    }))
}

impl Technique for RevectorizedFiltering {
    fn record(&mut self, frame: &mut Frame<'_>, inputs: &Inputs<'_>) -> Result<ImageRef> {
        let visibility = &self.visibility;
        inputs.check(INFO.id, visibility.extent(), self.map_size)?;
        frame.begin_group(INFO.title);
        let view = self.view.update(frame, inputs);
        self.rpcf.record(frame, view, inputs, self.push, visibility)?;
        frame.end_group();
        Ok(visibility.as_ref())
    }

    fn output(&self) -> &Image {
        &self.visibility
    }

    fn memory_bytes(&self) -> u64 {
        self.visibility.memory_bytes() + self.rpcf.memory_bytes()
    }
}
