//! Raster passes, for the host's shadow map and G-buffer.

use super::{Bind, Frame, MEMORY, OWN_STAGES};
use crate::Result;
use crate::gpu::{Buffer, Image, RasterPipeline};
use crate::hazard::{Barrier, Use};
use ash::vk::{self, Handle};

/// A target of a raster pass, cleared at its start.
#[derive(Clone, Copy)]
pub struct Target<'a> {
    /// The image.
    pub image: &'a Image,
    /// What it is cleared to.
    pub clear: vk::ClearValue,
}

const RASTER_STAGES: vk::PipelineStageFlags2 = vk::PipelineStageFlags2::from_raw(
    // Vertex and index buffers come from an upload, which nothing else makes visible to their fetch.
    vk::PipelineStageFlags2::VERTEX_INPUT.as_raw()
        | vk::PipelineStageFlags2::VERTEX_SHADER.as_raw()
        | vk::PipelineStageFlags2::FRAGMENT_SHADER.as_raw()
        | vk::PipelineStageFlags2::EARLY_FRAGMENT_TESTS.as_raw()
        | vk::PipelineStageFlags2::LATE_FRAGMENT_TESTS.as_raw()
        | vk::PipelineStageFlags2::COLOR_ATTACHMENT_OUTPUT.as_raw(),
);

const COLOR_USE: Use = Use {
    stage: vk::PipelineStageFlags2::COLOR_ATTACHMENT_OUTPUT,
    access: vk::AccessFlags2::COLOR_ATTACHMENT_WRITE,
    writes: true,
};

const DEPTH_USE: Use = Use {
    stage: vk::PipelineStageFlags2::from_raw(
        vk::PipelineStageFlags2::EARLY_FRAGMENT_TESTS.as_raw() | vk::PipelineStageFlags2::LATE_FRAGMENT_TESTS.as_raw(),
    ),
    access: vk::AccessFlags2::from_raw(
        vk::AccessFlags2::DEPTH_STENCIL_ATTACHMENT_READ.as_raw()
            | vk::AccessFlags2::DEPTH_STENCIL_ATTACHMENT_WRITE.as_raw(),
    ),
    writes: true,
};

const VERTEX_USE: Use =
    Use { stage: vk::PipelineStageFlags2::VERTEX_SHADER, access: vk::AccessFlags2::SHADER_STORAGE_READ, writes: false };

impl Frame<'_> {
    /// Runs a raster pass over `targets` and `depth`; `draw` records the draws.
    pub(crate) fn raster(
        &mut self,
        name: &str,
        targets: &[Target<'_>],
        depth: &Target<'_>,
        reads: &[&Buffer],
        draw: impl FnOnce(&mut Draw<'_>) -> Result<()>,
    ) -> Result<()> {
        let read = |b: &&Buffer| (b.handle().as_raw(), VERTEX_USE);
        let mut uses: Vec<_> = reads.iter().map(read).collect();
        uses.extend(targets.iter().map(|t| (t.image.as_ref().image.as_raw(), COLOR_USE)));
        uses.push((depth.image.as_ref().image.as_raw(), DEPTH_USE));
        if !std::mem::replace(&mut self.rastered, true) {
            // The frame before may still read or write these targets.
            self.memory_barrier(&Barrier {
                src_stage: OWN_STAGES | RASTER_STAGES,
                src_access: vk::AccessFlags2::MEMORY_WRITE,
                dst_stage: RASTER_STAGES,
                dst_access: MEMORY,
            });
        }
        self.transition(targets.iter().chain([depth]).map(|t| t.image), RASTER_STAGES);
        self.hazard(&uses);
        let query = self.begin_pass(name);
        let attachment = |t: &Target<'_>| {
            vk::RenderingAttachmentInfo::default()
                .image_view(t.image.as_ref().view)
                .image_layout(vk::ImageLayout::GENERAL)
                .load_op(vk::AttachmentLoadOp::CLEAR)
                .store_op(vk::AttachmentStoreOp::STORE)
                .clear_value(t.clear)
        };
        let colors: Vec<_> = targets.iter().map(attachment).collect();
        let depth_attachment = attachment(depth);
        let [width, height] = depth.image.extent();
        let area = vk::Rect2D { offset: vk::Offset2D::default(), extent: vk::Extent2D { width, height } };
        let info = vk::RenderingInfo::default()
            .render_area(area)
            .layer_count(1)
            .color_attachments(&colors)
            .depth_attachment(&depth_attachment);
        let viewport =
            vk::Viewport { x: 0.0, y: 0.0, width: width as f32, height: height as f32, min_depth: 0.0, max_depth: 1.0 };
        let (raw, cmd) = (&self.context.device().raw, self.cmd);
        // SAFETY: the targets are in GENERAL after `transition` and large enough for the area.
        unsafe {
            raw.cmd_begin_rendering(cmd, &info);
            raw.cmd_set_viewport(cmd, 0, &[viewport]);
            raw.cmd_set_scissor(cmd, 0, &[area]);
        }
        let drawn = draw(&mut Draw { frame: self });
        // SAFETY: begun above.
        unsafe { raw.cmd_end_rendering(cmd) };
        self.end_pass(query);
        drawn
    }
}

/// The draws of one raster pass.
pub struct Draw<'f> {
    frame: &'f Frame<'f>,
}

impl Draw<'_> {
    /// Binds a pipeline and its resources, in ascending order of the shaders' bindings.
    pub fn bind(&mut self, pipeline: &RasterPipeline, bind: &[Bind<'_>]) {
        let cmd = self.frame.cmd;
        let interface = &pipeline.interface;
        // SAFETY: recording inside the rendering that `Frame::raster` began.
        unsafe {
            self.frame.context.device().raw.cmd_bind_pipeline(cmd, vk::PipelineBindPoint::GRAPHICS, pipeline.handle);
        }
        self.frame.push_descriptors(vk::PipelineBindPoint::GRAPHICS, interface.layout, &interface.kinds, bind);
    }

    /// Binds the vertex buffers of the pipeline's attributes, and the index buffer (`u32`).
    pub fn buffers(&mut self, vertices: &[(&Buffer, u64)], indices: &Buffer) {
        let (raw, cmd) = (&self.frame.context.device().raw, self.frame.cmd);
        let handles: Vec<_> = vertices.iter().map(|v| v.0.handle()).collect();
        let offsets: Vec<_> = vertices.iter().map(|v| v.1).collect();
        // SAFETY: as in `bind`.
        unsafe {
            raw.cmd_bind_vertex_buffers(cmd, 0, &handles, &offsets);
            raw.cmd_bind_index_buffer(cmd, indices.handle(), 0, vk::IndexType::UINT32);
        }
    }

    /// Sets which faces are culled and which winding faces the viewer.
    pub fn faces(&mut self, cull: vk::CullModeFlags, front: vk::FrontFace) {
        let (raw, cmd) = (&self.frame.context.device().raw, self.frame.cmd);
        // SAFETY: as in `bind`.
        unsafe {
            raw.cmd_set_cull_mode(cmd, cull);
            raw.cmd_set_front_face(cmd, front);
        }
    }

    /// Pushes constants and draws indexed triangles.
    pub fn indexed(
        &mut self,
        pipeline: &RasterPipeline,
        push: &[u8],
        indices: std::ops::Range<u32>,
        instances: std::ops::Range<u32>,
    ) {
        let (raw, cmd) = (&self.frame.context.device().raw, self.frame.cmd);
        let interface = &pipeline.interface;
        // SAFETY: as in `bind`; `push` is the struct the pipeline was made with.
        unsafe {
            if !push.is_empty() {
                raw.cmd_push_constants(cmd, interface.layout, interface.push_stages, 0, push);
            }
            let count = indices.end - indices.start;
            raw.cmd_draw_indexed(cmd, count, instances.end - instances.start, indices.start, 0, instances.start);
        }
    }
}
