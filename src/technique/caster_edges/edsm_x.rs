//! Edge distance shadow maps with edge identities.

use super::edge_map::{EdgeIds, EdgeMap, EdgeMapConfig, Generation, LEAST_REACH};
use super::edsm::border_kernel;
use super::kept_segments::KeptSegments;
use super::silhouette_view::SilhouetteView;
use crate::gpu::{Buffer, ComputePipeline, Image, ImageDesc, bindings, shader_struct};
use crate::technique::common::bindings::PixelBindings;
use crate::technique::common::pixels::{ALONE, PixelPass, SKIP};
use crate::technique::common::rbsm_receiver::{DEPTH_BIAS, SLACK};
use crate::technique::{Info, Kind, Need, Param, Passes, Setup};
use crate::{Bind, Context, Frame, Inputs, Result};
use ash::vk;
use std::sync::Arc;

/// The registry entry.
pub const INFO: Info = Info {
    id: "edsm-x",
    title: "Edge distance shadow mapping with edge identities",
    paper: "after Kenzel 2013; the identities and the crossing rule are ours",
    summary: "Hard shadows that follow the casters' own edges at any map resolution, for the cost of a map lookup.",
    params: &[
        Param::int(
            "slots",
            1,
            8,
            2,
            "edges",
            "number of slots of a cell between four texels; they hold the edges nearest to its centre (K)",
        ),
        Param::int(
            "spill",
            0,
            4096,
            256,
            "edges",
            "largest number of edges of a cell beyond its slots, kept in a chain; further edges are lost and counted",
        ),
        Param::choice(
            "generation",
            &["compute", "raster"],
            0,
            "write edges into the map by threads that walk along them, or by drawing quads; the map is the same",
        ),
        Param::choice(
            "resolve",
            &["always", "mixed-only"],
            0,
            "use the edges wherever there are any, or only where the tests of the depth map differ, as in the thesis; features smaller than a texel are then lost",
        ),
        Param::switch(
            "kill",
            true,
            "leave out edges that lie behind everything that the light sees around a cell, so that they take no slots",
        ),
        Param::float("border", 0.0, 16.0, 0.0, "texels", "width of the shadow's border; 0 = hard"),
        Param::choice(
            "kernel",
            &["box", "smoothstep", "disc"],
            2,
            "profile of the visibility across the border: a ramp, a ramp with soft ends, or that of an edge under a round light",
        ),
        Param::float(
            "edge_bias",
            0.0,
            4.0,
            0.02,
            "texel slopes",
            "depth by which an edge may lie in front of the receiver and still count as on it, in multiples of its plane's change of depth per texel",
        ),
        DEPTH_BIAS,
        SLACK,
        SKIP,
    ],
    published: &[],
    needs: &[Need::Casters, Need::Int64Atomics],
    kind: Kind::RealTime(prepare),
};

shader_struct! {
    /// Push constants of `glsl/caster_edges/edsm_x.comp`.
    pub struct EdsmXPush {
        edge_bias: f32,
        depth_bias: f32,
        slack: f32,
        half_border: f32,
    }
}

bindings! {
    struct LookupBindings { ..pixels: PixelBindings, Keys, Segments, spill, Heads, LowerKeys, decisions }
}

struct EdsmX {
    edges: KeptSegments,
    map: EdgeMap,
    lookup: PixelPass,
    decisions: Image,
    viewed: bool,
    ids: Option<EdgeIds>,
    seen: Option<SilhouetteView>,
    push: EdsmXPush,
}

fn prepare(context: &Context, setup: &Setup) -> Result<Box<dyn Passes>> {
    let p = &setup.params;
    let casters = setup.casters(INFO.id)?;
    let slots = p.int("slots");
    let config = EdgeMapConfig {
        slots,
        spill: p.int("spill"),
        kill: p.on("kill"),
        reach: (0.5 * p.float("border")).max(LEAST_REACH),
        generation: if p.word("generation") == "raster" { Generation::Raster } else { Generation::Compute },
    };
    let mixed_only = p.word("resolve") == "mixed-only";
    let edges = KeptSegments::new(context, INFO.id, casters, config.reach)?;
    let map = EdgeMap::new(context, edges.silhouettes(), setup.map_size, config)?;
    let (split, soft) = (u32::from(map.is_split()), u32::from(p.float("border") > 0.0));
    let lookup = |step| -> Result<Arc<ComputePipeline>> {
        let constants = [
            ("K", slots),
            ("MIXED_ONLY", mixed_only.into()),
            ("KERNEL", border_kernel(p) as u32),
            ("VIEWED", setup.intermediates.into()),
            ("STEP", step as u32),
            ALONE,
            ("SPLIT", split),
            ("SOFT", soft),
        ];
        context.pipeline::<LookupBindings, EdsmXPush>("caster_edges/edsm_x.comp", &constants)
    };
    // The picture supports only maps in one buffer.
    let ids = (setup.intermediates && !map.is_split()).then(|| EdgeIds::new(context, &map));
    // The technique itself needs no raster passes, so the device may not support them.
    let can_draw = context.features().dynamic_rendering;
    let seen =
        (setup.intermediates && can_draw).then(|| SilhouetteView::new(context, edges.silhouettes(), setup.extent));
    let decisions = if setup.intermediates { setup.extent } else { [1, 1] };
    let desc = ImageDesc::storage("edsm-x decisions", vk::Format::R32_SFLOAT, decisions);
    Ok(Box::new(EdsmX {
        edges,
        map,
        lookup: PixelPass::new(context, "listed pixels", setup.extent, p.word("skip") != "off", lookup)?,
        decisions: Image::new(context.device(), &desc)?,
        viewed: setup.intermediates,
        ids: ids.transpose()?,
        seen: seen.transpose()?,
        push: EdsmXPush {
            edge_bias: p.float("edge_bias"),
            depth_bias: p.float("depth_bias"),
            slack: p.float("slack"),
            half_border: 0.5 * p.float("border"),
        },
    }))
}

impl Passes for EdsmX {
    fn record(&mut self, frame: &mut Frame<'_>, view: &Buffer, inputs: &Inputs<'_>, visibility: &Image) -> Result<()> {
        if self.edges.record(frame, inputs)? {
            self.map.record(frame, inputs, self.edges.silhouettes(), self.edges.segments())?;
            if let Some(ids) = &self.ids {
                ids.record(frame, &self.map)?;
            }
        }
        let bind = LookupBindings {
            pixels: PixelBindings::new(view, inputs, visibility, self.lookup.list()),
            Keys: Bind::Buffer(self.map.keys()),
            Segments: Bind::Buffer(self.edges.segments().segments()),
            spill: Bind::Buffer(self.map.spill()),
            Heads: Bind::Buffer(self.map.heads()),
            LowerKeys: Bind::Buffer(self.map.lower_keys()),
            decisions: Bind::Image(&self.decisions),
        };
        self.lookup.record(frame, ["anchors", "crossings"], &bind, bytemuck::bytes_of(&self.push), visibility)?;
        if let Some(seen) = &self.seen {
            seen.record(frame, inputs, self.edges.silhouettes())?;
        }
        Ok(())
    }

    fn intermediates(&self) -> Vec<(&'static str, &Image)> {
        let decisions = self.viewed.then_some(("decisions", &self.decisions));
        let ids = self.ids.iter().map(|i| ("edge-ids", i.image()));
        let seen = self.seen.iter().map(|s| ("silhouettes", s.image()));
        decisions.into_iter().chain(ids).chain(seen).collect()
    }

    fn memory_bytes(&self) -> u64 {
        self.decisions.memory_bytes()
            + self.edges.memory_bytes()
            + self.map.memory_bytes()
            + self.lookup.memory_bytes()
            + self.ids.as_ref().map_or(0, |i| i.image().memory_bytes())
            + self.seen.as_ref().map_or(0, SilhouetteView::memory_bytes)
    }
}
