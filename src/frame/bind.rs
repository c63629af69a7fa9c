//! Binding of resources to a shader: puts them into the order of its bindings, lists their uses for hazard tracking,
//! and pushes the descriptors.

use super::Frame;
use crate::gpu::{Bind, Bindings, Interface, ResourceAccess, ResourceKind, Slot};
use crate::hazard::Use;
use crate::{Error, Result};
use ash::vk;

impl Interface {
    /// Returns the resource of each slot.
    ///
    /// # Errors
    /// [`Error::Shader`] unless the names are those that the pipeline was made with, and each names an image or a
    /// buffer as the shader declares it.
    pub(super) fn bind<'a>(&self, bindings: &'a dyn Bindings) -> Result<Vec<Bind<'a>>> {
        let error = |problem: String| Error::Shader { shader: self.name.clone(), problem };
        let mut named = Vec::with_capacity(self.slots.len());
        bindings.add(&mut named);
        if named.len() != self.slots.len() || self.slots.iter().any(|s| named.iter().all(|n| n.0 != s.name)) {
            let given: Vec<_> = named.iter().map(|n| n.0).collect();
            return Err(error(self.other_names(&given).unwrap_or_else(|| format!("a name is bound twice: {given:?}"))));
        }
        let find = |s: &Slot| match named.iter().find(|n| n.0 == s.name) {
            Some((_, bind)) if s.kind.is_buffer() == bind.buffer().is_some() => Ok(*bind),
            _ => Err(error(format!("{} (binding {}) needs a {:?}", s.name, s.binding, s.kind))),
        };
        self.slots.iter().map(find).collect()
    }

    /// Returns how the stages use the resources of the slots, by [`Bind::id`].
    pub(super) fn uses(&self, bind: &[Bind<'_>]) -> Vec<(u64, Use)> {
        let slot = |(slot, bound): (&Slot, &Bind<'_>)| {
            let id = bound.id();
            let kind = slot.kind;
            slot.uses.iter().map(move |&(stage, access)| (id, stage_use(stage, kind, access))).collect::<Vec<_>>()
        };
        self.slots.iter().zip(bind).flat_map(slot).collect()
    }
}

fn stage_use(stage: vk::ShaderStageFlags, kind: ResourceKind, access: ResourceAccess) -> Use {
    let read = match kind {
        ResourceKind::SampledImage => vk::AccessFlags2::SHADER_SAMPLED_READ,
        ResourceKind::UniformBuffer => vk::AccessFlags2::UNIFORM_READ,
        ResourceKind::StorageImage | ResourceKind::StorageBuffer => vk::AccessFlags2::SHADER_STORAGE_READ,
    };
    let write = vk::AccessFlags2::SHADER_STORAGE_WRITE;
    let access_flags = match access {
        ResourceAccess::Read => read,
        ResourceAccess::Write => write,
        ResourceAccess::ReadWrite => read | write,
    };
    let stage = match stage {
        vk::ShaderStageFlags::VERTEX => vk::PipelineStageFlags2::VERTEX_SHADER,
        vk::ShaderStageFlags::GEOMETRY => vk::PipelineStageFlags2::GEOMETRY_SHADER,
        vk::ShaderStageFlags::FRAGMENT => vk::PipelineStageFlags2::FRAGMENT_SHADER,
        _ => vk::PipelineStageFlags2::COMPUTE_SHADER,
    };
    Use { stage, access: access_flags, writes: access != ResourceAccess::Read }
}

impl Frame<'_> {
    /// Pushes the descriptors of the bound resources, which are in the order of the interface's slots.
    pub(super) fn push_descriptors(&self, point: vk::PipelineBindPoint, interface: &Interface, bind: &[Bind<'_>]) {
        let images: Vec<_> = (interface.slots.iter().zip(bind))
            .map(|(slot, b)| {
                let sampler = match (slot.kind, b) {
                    (ResourceKind::SampledImage, Bind::BorderlessMap(_)) => self.context.nearest_clamped(),
                    (ResourceKind::SampledImage, Bind::Filtered(_)) => self.context.linear_clamped(),
                    (ResourceKind::SampledImage, _) => self.context.nearest(),
                    _ => vk::Sampler::null(),
                };
                let image = b.image();
                [vk::DescriptorImageInfo {
                    sampler,
                    image_view: image.map_or(vk::ImageView::null(), |i| i.view),
                    image_layout: image.map_or(vk::ImageLayout::UNDEFINED, |i| i.layout),
                }]
            })
            .collect();
        let buffers: Vec<_> = bind
            .iter()
            .map(|b| {
                let (buffer, range) = b.buffer().unwrap_or((vk::Buffer::null(), vk::WHOLE_SIZE));
                [vk::DescriptorBufferInfo { buffer, offset: 0, range }]
            })
            .collect();
        let writes: Vec<_> = (interface.slots.iter().zip(&images).zip(&buffers))
            .map(|((slot, image), buffer)| {
                let write = vk::WriteDescriptorSet::default()
                    .dst_binding(slot.binding)
                    .descriptor_type(slot.kind.descriptor_type());
                match slot.kind {
                    ResourceKind::SampledImage | ResourceKind::StorageImage => write.image_info(image),
                    ResourceKind::UniformBuffer | ResourceKind::StorageBuffer => write.buffer_info(buffer),
                }
            })
            .collect();
        if writes.is_empty() {
            return;
        }
        let push = self.context.device().push_descriptor_set;
        // SAFETY: layout and writes come from one reflection; the resources outlive the execution.
        unsafe { push(self.cmd, point, interface.layout, 0, writes.len() as u32, writes.as_ptr()) };
    }
}
