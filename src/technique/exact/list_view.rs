//! Pictures of the lists of each pixel's cell.

use super::grid::{EdgeLists, GridPush, GridReceivers, TriangleLists};
use crate::gpu::{ComputePipeline, Image, ImageDesc, bindings};
use crate::{Bind, Context, Frame, Pass, Result, Threads};
use ash::vk;
use std::sync::Arc;

bindings! {
    struct ViewBindings {
        Receivers, layers, edges, cells, fallback, Header, Starts, Entries, GridTriangles, EdgeHeader, EdgeStarts
    }
}

/// The pass with its images.
pub(super) struct ListView {
    pipeline: Arc<ComputePipeline>,
    with_edges: bool,
    layers: Image,
    edges: Image,
    cells: Image,
    fallback: Image,
}

impl ListView {
    /// Makes the pass for an image; `with_edges`: there are lists of edges.
    pub fn new(context: &Context, extent: [u32; 2], with_edges: bool) -> Result<Self> {
        let sized =
            |name, extent| Image::new(context.device(), &ImageDesc::storage(name, vk::Format::R32_SFLOAT, extent));
        let image = |name| sized(name, extent);
        Ok(Self {
            pipeline: context
                .pipeline::<ViewBindings, GridPush>("exact/list_view.comp", &[("EDGES", with_edges.into())])?,
            with_edges,
            layers: image("layers")?,
            edges: sized("listed edges", if with_edges { extent } else { [1, 1] })?,
            cells: image("cells")?,
            fallback: image("pixels without lists")?,
        })
    }

    /// Writes the images. `push` is that of the lists.
    pub fn record(
        &self,
        frame: &mut Frame<'_>,
        receivers: &GridReceivers,
        triangles: &TriangleLists,
        edges: Option<&EdgeLists>,
        push: &GridPush,
    ) -> Result<()> {
        let [header, starts, entries] = triangles.lists().bind();
        let [edge_header, edge_starts, _] = edges.map_or(triangles.lists(), EdgeLists::lists).bind();
        let [width, height] = self.layers.extent();
        frame.dispatch(&Pass {
            name: "intermediates",
            pipeline: &self.pipeline,
            bind: &ViewBindings {
                Receivers: receivers.receivers(),
                layers: Bind::Image(&self.layers),
                edges: Bind::Image(&self.edges),
                cells: Bind::Image(&self.cells),
                fallback: Bind::Image(&self.fallback),
                Header: header,
                Starts: starts,
                Entries: entries,
                GridTriangles: Bind::Buffer(triangles.triangles()),
                EdgeHeader: edge_header,
                EdgeStarts: edge_starts,
            },
            push: bytemuck::bytes_of(push),
            threads: Threads::Count([width, height, 1]),
        })
    }

    /// The images with their names.
    pub fn images(&self) -> Vec<(&'static str, &Image)> {
        let mut images = vec![("layers", &self.layers), ("cells", &self.cells), ("fallback", &self.fallback)];
        if self.with_edges {
            images.push(("edges", &self.edges));
        }
        images
    }

    /// Bytes of device memory.
    pub fn memory_bytes(&self) -> u64 {
        [&self.layers, &self.edges, &self.cells, &self.fallback].iter().map(|i| i.memory_bytes()).sum()
    }
}
