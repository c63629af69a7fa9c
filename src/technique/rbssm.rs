//! Revectorization-based soft shadow mapping.

use super::revectorized::{self, MAX_DISTANCE, SLACK};
use super::{Info, Kind, Param, Setup, Technique, sm, visibility_image};
use crate::gpu::Image;
use crate::pass::rbsm::RbsmPush;
use crate::pass::rbssm::{Rbssm, RbssmConfig};
use crate::pass::soft::SearchWindow;
use crate::pass::view::ViewBuffer;
use crate::{Context, Frame, ImageRef, Inputs, Result};

/// The registry entry.
pub const INFO: Info = Info {
    id: "rbssm",
    title: "Revectorization-based soft shadow mapping",
    paper: "Macedo, Apolinário, Agüero 2019, algorithms 2 and 3",
    summary: "Percentage-closer soft shadows whose filter averages revectorized visibility: no stairs in narrow penumbrae.",
    params: &[
        Param::odd("search_taps", 1, 63, 9, "taps", "taps of the blocker search along each axis"),
        Param::odd("filter_taps", 1, 63, 11, "taps", "taps of the filter along each axis"),
        Param::choice(
            "search",
            &["near", "blockers"],
            1,
            "window of the blocker search: up to the light's near plane as in the papers, or as far as the nearest blocker in it allows",
        ),
        Param::choice(
            "visibility",
            &["recovery", "improved", "profile", "test", "filtered"],
            1,
            "what is averaged: silhouette recovery (listing 4) as in the paper, RBSM*, or the edge profile of runs",
        ),
        Param::choice("counted", &["all", "lit", "one", "wide"], 1, "experiment"),
        MAX_DISTANCE,
        Param { default: 0.25, ..sm::NORMAL_OFFSET },
        revectorized::DEPTH_BIAS,
        SLACK,
        Param::choice(
            "skip",
            &["auto", "off"],
            0,
            "decide pixels whose whole search window is lit or in shadow by depth bounds of the map: the same image",
        ),
    ],
    kind: Kind::RealTime(prepare),
};

struct SoftShadows {
    view: ViewBuffer,
    rbssm: Rbssm,
    push: RbsmPush,
    map_size: [u32; 2],
    visibility: Image,
}

fn prepare(context: &Context, setup: &Setup) -> Result<Box<dyn Technique>> {
    let p = &setup.params;
    let config = RbssmConfig {
        search_taps: p.int("search_taps"),
        filter_taps: p.int("filter_taps"),
        window: if p.word("search") == "near" { SearchWindow::Near } else { SearchWindow::Blockers },
        visibility: match p.word("visibility") {
            "recovery" => 0,
            "improved" => 1,
            "profile" => 2,
            "test" => 3,
            _ => 4,
        },
        counted: match p.word("counted") {
            "all" => 0,
            "lit" => 1,
            "one" => 2,
            _ => 3,
        },
        max_distance: p.int("max_distance"),
        listed: p.word("skip") == "auto",
    };
    Ok(Box::new(SoftShadows {
        view: ViewBuffer::new(context.device())?,
        rbssm: Rbssm::new(context, setup.extent, setup.map_size, config)?,
        push: revectorized::push(setup),
        map_size: setup.map_size,
        visibility: visibility_image(context.device(), "rbssm visibility", setup)?,
    }))
}

impl Technique for SoftShadows {
    fn record(&mut self, frame: &mut Frame<'_>, inputs: &Inputs<'_>) -> Result<ImageRef> {
        let visibility = &self.visibility;
        inputs.check(INFO.id, visibility.extent(), self.map_size)?;
        frame.begin_group(INFO.title);
        let view = self.view.update(frame, inputs);
        self.rbssm.record(frame, view, inputs, self.push, visibility)?;
        frame.end_group();
        Ok(visibility.as_ref())
    }

    fn output(&self) -> &Image {
        &self.visibility
    }

    fn memory_bytes(&self) -> u64 {
        self.visibility.memory_bytes() + self.rbssm.memory_bytes()
    }
}
