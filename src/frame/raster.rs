//! Raster passes: dynamic rendering into images of the library.

use super::{Bind, Frame, INDIRECT_USE, MEMORY};
use crate::gpu::{Bindings, Buffer, Image, Interface, RasterPipeline, has_stencil};
use crate::hazard::{Barrier, Use};
use crate::{Error, Result};
use ash::vk::{self, Handle};
use std::ops::Range;

/// A target of a raster pass.
#[derive(Clone, Copy)]
pub struct Target<'a> {
    /// The image.
    pub image: &'a Image,
    /// Value that the target is cleared to; `None` keeps its contents.
    pub clear: Option<vk::ClearValue>,
}

impl<'a> Target<'a> {
    /// A colour target cleared to floats.
    pub fn color(image: &'a Image, float32: [f32; 4]) -> Self {
        Self { image, clear: Some(vk::ClearValue { color: vk::ClearColorValue { float32 } }) }
    }

    /// A depth target cleared to `depth`. If it has a stencil, the stencil is cleared to 0.
    pub fn depth(image: &'a Image, depth: f32) -> Self {
        let depth_stencil = vk::ClearDepthStencilValue { depth, stencil: 0 };
        Self { image, clear: Some(vk::ClearValue { depth_stencil }) }
    }

    /// A target that keeps its contents.
    pub fn kept(image: &'a Image) -> Self {
        Self { image, clear: None }
    }
}

/// A pipeline with its resources.
#[derive(Clone, Copy)]
pub struct Bound<'a> {
    /// The pipeline.
    pub pipeline: &'a RasterPipeline,
    /// Resources of the pass, in a value of the type that the pipeline was made with.
    pub bind: &'a dyn Bindings,
}

/// One raster pass.
pub struct RasterPass<'a> {
    /// Name for labels and timings.
    pub name: &'a str,
    /// Size of all targets, and of the viewport.
    pub extent: [u32; 2],
    /// Colour targets.
    pub colors: &'a [Target<'a>],
    /// Depth target, including its stencil if it has one.
    pub depth: Option<Target<'a>>,
    /// Every pipeline that the draws use, with its resources. The pass waits for these resources before it begins.
    pub bound: &'a [Bound<'a>],
    /// Buffers that [`Draw::indirect`] reads.
    pub indirect: &'a [&'a Buffer],
}

const RASTER_STAGES: vk::PipelineStageFlags2 = vk::PipelineStageFlags2::from_raw(
    // Vertex and index buffers are filled by an upload, and no other barrier makes it visible to vertex input.
    vk::PipelineStageFlags2::VERTEX_INPUT.as_raw()
        | vk::PipelineStageFlags2::PRE_RASTERIZATION_SHADERS.as_raw()
        | vk::PipelineStageFlags2::FRAGMENT_SHADER.as_raw()
        | DEPTH_USE.stage.as_raw()
        | COLOR_USE.stage.as_raw(),
);

const COLOR_USE: Use = Use {
    stage: vk::PipelineStageFlags2::COLOR_ATTACHMENT_OUTPUT,
    access: vk::AccessFlags2::from_raw(
        vk::AccessFlags2::COLOR_ATTACHMENT_READ.as_raw() | vk::AccessFlags2::COLOR_ATTACHMENT_WRITE.as_raw(),
    ),
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

impl RasterPass<'_> {
    /// Returns every resource that the pass accesses, with the kind of access.
    fn uses(&self, binds: &[Vec<Bind<'_>>]) -> Vec<(u64, Use)> {
        let id = |t: &Target<'_>| t.image.as_ref().image.as_raw();
        let bound = self.bound.iter().zip(binds).flat_map(|(b, bind)| b.pipeline.interface.uses(bind));
        let indirect = self.indirect.iter().map(|b| (b.handle().as_raw(), INDIRECT_USE));
        let colors = self.colors.iter().map(|t| (id(t), COLOR_USE));
        let depth = self.depth.iter().map(|t| (id(t), DEPTH_USE));
        bound.chain(indirect).chain(colors).chain(depth).collect()
    }

    fn check(&self) -> Result<()> {
        let other = |t: &&Target<'_>| t.image.extent() != self.extent;
        match self.colors.iter().chain(&self.depth).find(other) {
            None => Ok(()),
            Some(target) => Err(Error::Usage(format!(
                "the pass {} has {:?} pixels, but one of its targets has {:?}",
                self.name,
                self.extent,
                target.image.extent()
            ))),
        }
    }
}

impl<'a> Frame<'a> {
    /// Records a raster pass; `draw` records its draws. The queue of the command buffer must support graphics.
    pub(crate) fn raster(
        &mut self,
        pass: &RasterPass<'_>,
        draw: impl FnOnce(&mut Draw<'_, 'a>) -> Result<()>,
    ) -> Result<()> {
        #[cfg(test)]
        self.fail_in_turn(pass.name)?;
        let binds = pass.bound.iter().map(|b| b.pipeline.interface.bind(b.bind)).collect::<Result<Vec<_>>>()?;
        pass.check()?;
        self.wait_for_raster();
        let bound = binds.iter().flatten().filter_map(|b| b.owned());
        self.transition(pass.colors.iter().chain(&pass.depth).map(|t| t.image).chain(bound), RASTER_STAGES);
        self.hazard(&pass.uses(&binds));
        let query = self.begin_pass(pass.name);
        let attachment = |t: &Target<'_>| {
            vk::RenderingAttachmentInfo::default()
                .image_view(t.image.attachment_view())
                .image_layout(vk::ImageLayout::GENERAL)
                .load_op(if t.clear.is_some() { vk::AttachmentLoadOp::CLEAR } else { vk::AttachmentLoadOp::LOAD })
                .store_op(vk::AttachmentStoreOp::STORE)
                .clear_value(t.clear.unwrap_or_default())
        };
        let colors: Vec<_> = pass.colors.iter().map(attachment).collect();
        let depth = pass.depth.as_ref().map(attachment);
        let [width, height] = pass.extent;
        let area = vk::Rect2D { offset: vk::Offset2D::default(), extent: vk::Extent2D { width, height } };
        let mut info = vk::RenderingInfo::default().render_area(area).layer_count(1).color_attachments(&colors);
        if let Some(depth) = &depth {
            info = info.depth_attachment(depth);
        }
        if let (Some(depth), Some(target)) = (&depth, &pass.depth)
            && has_stencil(target.image.format())
        {
            info = info.stencil_attachment(depth);
        }
        let viewport =
            vk::Viewport { x: 0.0, y: 0.0, width: width as f32, height: height as f32, min_depth: 0.0, max_depth: 1.0 };
        let (raw, cmd) = (&self.context.device().raw, self.cmd);
        // SAFETY: the targets are in GENERAL after `transition` and of the area's size.
        unsafe {
            raw.cmd_begin_rendering(cmd, &info);
            raw.cmd_set_viewport(cmd, 0, &[viewport]);
            raw.cmd_set_scissor(cmd, 0, &[area]);
            raw.cmd_set_cull_mode(cmd, vk::CullModeFlags::NONE);
            raw.cmd_set_front_face(cmd, vk::FrontFace::COUNTER_CLOCKWISE);
        }
        let drawn = draw(&mut Draw { frame: self, pass, binds: &binds, pipeline: None });
        // SAFETY: begun above.
        unsafe { raw.cmd_end_rendering(cmd) };
        self.end_pass(query);
        drawn
    }

    /// Lets the first raster pass of a context wait for earlier commands in the stages of raster passes, which no frame
    /// has waited for yet. From then on, [`Frame::begin`] waits for them.
    fn wait_for_raster(&mut self) {
        if self.stages.contains(RASTER_STAGES) {
            return;
        }
        self.context.note_raster();
        self.stages |= RASTER_STAGES;
        self.memory_barrier(&Barrier {
            src_stage: self.stages,
            src_access: vk::AccessFlags2::MEMORY_WRITE,
            dst_stage: self.stages,
            dst_access: MEMORY,
        });
    }

    /// The stages of raster passes, or no stages if the context has not recorded a raster pass yet.
    pub(super) fn raster_stages(&self) -> vk::PipelineStageFlags2 {
        if self.context.has_rastered() { RASTER_STAGES } else { vk::PipelineStageFlags2::empty() }
    }
}

/// The draws of one raster pass. Culling is off until [`Draw::faces`] is called, counter-clockwise faces are front
/// faces, and the scissor is the whole image.
pub struct Draw<'f, 'a> {
    frame: &'f Frame<'a>,
    pass: &'f RasterPass<'f>,
    /// Resources of each entry of [`RasterPass::bound`], in the order of its slots.
    binds: &'f [Vec<Bind<'f>>],
    pipeline: Option<&'f RasterPipeline>,
}

impl Draw<'_, '_> {
    /// Binds the pipeline and the resources of [`RasterPass::bound`] with this index.
    ///
    /// # Errors
    /// [`Error::Usage`] if there is no entry with that index.
    pub fn bind(&mut self, index: usize) -> Result<()> {
        let Some((bound, bind)) = self.pass.bound.iter().zip(self.binds).nth(index) else {
            return Err(Error::Usage(format!("the pass {} has no pipeline {index}", self.pass.name)));
        };
        self.pipeline = Some(bound.pipeline);
        let (raw, cmd) = (&self.frame.context.device().raw, self.frame.cmd);
        // SAFETY: recording inside the rendering that `Frame::raster` began.
        unsafe { raw.cmd_bind_pipeline(cmd, vk::PipelineBindPoint::GRAPHICS, bound.pipeline.handle) };
        self.frame.push_descriptors(vk::PipelineBindPoint::GRAPHICS, &bound.pipeline.interface, bind);
        self.compare(bound.pipeline.compare);
        self.bias(bound.pipeline.bias);
        Ok(())
    }

    /// Binds other resources to the current pipeline. No barrier can be placed inside a pass, so a resource must either
    /// be in [`RasterPass::bound`] too, or not have been written in this frame or the one before.
    #[cfg(feature = "app")]
    pub fn rebind(&mut self, bindings: &dyn Bindings) -> Result<()> {
        let interface = self.interface()?;
        let bind = interface.bind(bindings)?;
        self.frame.push_descriptors(vk::PipelineBindPoint::GRAPHICS, interface, &bind);
        Ok(())
    }

    fn interface(&self) -> Result<&Interface> {
        let none = || Error::Usage(format!("the pass {} draws without a pipeline", self.pass.name));
        self.pipeline.map(|p| &p.interface).ok_or_else(none)
    }

    /// Binds the vertex buffers of the pipeline's attributes, each from an offset in bytes on.
    #[cfg(feature = "app")]
    pub fn vertices(&mut self, vertices: &[(&Buffer, u64)]) {
        let handles: Vec<_> = vertices.iter().map(|v| v.0.handle()).collect();
        let offsets: Vec<_> = vertices.iter().map(|v| v.1).collect();
        // SAFETY: as in `bind`.
        unsafe { self.frame.context.device().raw.cmd_bind_vertex_buffers(self.frame.cmd, 0, &handles, &offsets) };
    }

    /// Binds the index buffer, of `u32`.
    #[cfg(feature = "app")]
    pub fn indices(&mut self, indices: &Buffer) {
        let (raw, cmd) = (&self.frame.context.device().raw, self.frame.cmd);
        // SAFETY: as in `bind`.
        unsafe { raw.cmd_bind_index_buffer(cmd, indices.handle(), 0, vk::IndexType::UINT32) };
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

    /// Sets how a fragment's depth must compare with the target's, until the next [`Draw::bind`].
    pub fn compare(&mut self, compare: vk::CompareOp) {
        // SAFETY: as in `bind`.
        unsafe { self.frame.context.device().raw.cmd_set_depth_compare_op(self.frame.cmd, compare) };
    }

    /// Sets the `[constant, slope]` depth bias until the next [`Draw::bind`], for a pipeline that was made with a depth
    /// bias.
    pub fn bias(&mut self, [constant, slope]: [f32; 2]) {
        // SAFETY: as in `bind`.
        unsafe { self.frame.context.device().raw.cmd_set_depth_bias(self.frame.cmd, constant, 0.0, slope) };
    }

    /// Restricts later draws to these ranges of pixels. The ranges are clipped to the image.
    pub fn scissor(&mut self, x: Range<u32>, y: Range<u32>) {
        let [width, height] = self.pass.extent;
        let cut = |r: Range<u32>, n: u32| (r.start.min(n), r.end.min(n).saturating_sub(r.start.min(n)));
        let ((x, width), (y, height)) = (cut(x, width), cut(y, height));
        let area =
            vk::Rect2D { offset: vk::Offset2D { x: x as i32, y: y as i32 }, extent: vk::Extent2D { width, height } };
        // SAFETY: as in `bind`.
        unsafe { self.frame.context.device().raw.cmd_set_scissor(self.frame.cmd, 0, &[area]) };
    }

    /// Pushes constants. They stay valid until a pipeline with another layout pushes its constants.
    ///
    /// # Errors
    /// [`Error::Shader`] if their size differs from the one that the pipeline was made with.
    pub fn push(&mut self, push: &[u8]) -> Result<()> {
        let interface = self.interface()?;
        if push.len() != interface.push_size as usize {
            let problem = format!("got {} bytes of push constants", push.len());
            return Err(Error::Shader { shader: interface.name.clone(), problem });
        }
        if !push.is_empty() {
            let (raw, cmd) = (&self.frame.context.device().raw, self.frame.cmd);
            // SAFETY: as in `bind`; the size was checked.
            unsafe { raw.cmd_push_constants(cmd, interface.layout, interface.push_stages, 0, push) };
        }
        Ok(())
    }

    /// Draws a range of vertices without indices.
    pub fn draw(&mut self, vertices: Range<u32>, instances: Range<u32>) -> Result<()> {
        self.interface()?;
        let (raw, cmd) = (&self.frame.context.device().raw, self.frame.cmd);
        let (count, copies) = (vertices.len() as u32, instances.len() as u32);
        // SAFETY: as in `bind`.
        unsafe { raw.cmd_draw(cmd, count, copies, vertices.start, instances.start) };
        Ok(())
    }

    /// Draws a range of the index buffer.
    #[cfg(feature = "app")]
    pub fn indexed(&mut self, indices: Range<u32>, instances: Range<u32>) -> Result<()> {
        self.interface()?;
        let (raw, cmd) = (&self.frame.context.device().raw, self.frame.cmd);
        let (count, copies) = (indices.len() as u32, instances.len() as u32);
        // SAFETY: as in `bind`.
        unsafe { raw.cmd_draw_indexed(cmd, count, copies, indices.start, 0, instances.start) };
        Ok(())
    }

    /// Draws according to a `VkDrawIndirectCommand` at this offset of a buffer. Its `firstInstance` is 0, and the
    /// buffer is listed in [`RasterPass::indirect`].
    pub fn indirect(&mut self, buffer: &Buffer, offset: u64) -> Result<()> {
        self.interface()?;
        if !self.pass.indirect.iter().any(|b| b.handle() == buffer.handle()) {
            return Err(Error::Usage(format!("the pass {} does not list its indirect buffer", self.pass.name)));
        }
        let (raw, cmd) = (&self.frame.context.device().raw, self.frame.cmd);
        // SAFETY: as in `bind`.
        unsafe { raw.cmd_draw_indirect(cmd, buffer.handle(), offset, 1, 0) };
        Ok(())
    }
}

#[cfg(all(test, feature = "app"))]
mod tests;
