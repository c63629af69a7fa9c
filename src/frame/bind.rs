//! What is bound to a shader: checked against it, tracked for hazards, and pushed.

use super::Frame;
use crate::gpu::{Buffer, Image, ImageRef, Interface, ResourceAccess, ResourceKind, Slot};
use crate::hazard::Use;
use crate::{Error, Result};
use ash::vk::{self, Handle};

/// Something bound to a shader.
#[derive(Clone, Copy)]
pub enum Bind<'a> {
    /// An image of ours, all of its mip levels; of depth with stencil, the depth.
    Image(&'a Image),
    /// One mip level of an image of ours.
    Mip(&'a Image, u32),
    /// The stencil of an image of ours, for a `usampler2D`.
    Stencil(&'a Image),
    /// Somebody else's image, in the layout that it states; read only.
    Input(&'a ImageRef),
    /// Somebody else's shadow map, for a filter whose window may be wider than the map: outside, its border goes on.
    BorderlessMap(&'a ImageRef),
    /// A buffer.
    Buffer(&'a Buffer),
    /// Somebody else's buffer from its start, that many bytes; read only.
    Foreign(vk::Buffer, u64),
}

impl<'a> Bind<'a> {
    pub(super) fn owned(&self) -> Option<&'a Image> {
        match *self {
            Self::Image(i) | Self::Mip(i, _) | Self::Stencil(i) => Some(i),
            Self::Input(_) | Self::BorderlessMap(_) | Self::Buffer(_) | Self::Foreign(..) => None,
        }
    }

    fn image(&self) -> Option<ImageRef> {
        match *self {
            Self::Image(i) => Some(i.as_ref()),
            Self::Mip(i, level) => Some(i.mip(level)),
            Self::Stencil(i) => Some(i.stencil()),
            Self::Input(i) | Self::BorderlessMap(i) => Some(*i),
            Self::Buffer(_) | Self::Foreign(..) => None,
        }
    }

    /// Handle and size of a buffer.
    fn buffer(&self) -> Option<(vk::Buffer, u64)> {
        match *self {
            Self::Buffer(b) => Some((b.handle(), vk::WHOLE_SIZE)),
            Self::Foreign(buffer, size) => Some((buffer, size)),
            _ => None,
        }
    }

    /// The handle by which hazards are tracked. Vulkan handles of different types may be equal in
    /// theory only: they are pointers on every desktop driver, and a clash merely adds a barrier.
    fn id(&self) -> u64 {
        match self {
            Self::Buffer(b) => b.handle().as_raw(),
            Self::Foreign(b, _) => b.as_raw(),
            _ => self.image().map_or(0, |i| i.image.as_raw()),
        }
    }
}

impl Interface {
    /// An error unless `bind` holds what the shaders declare, in ascending order of their bindings.
    pub(super) fn check(&self, bind: &[Bind<'_>]) -> Result<()> {
        let error = |problem: String| Err(Error::Shader { shader: self.name.clone(), problem });
        if bind.len() != self.slots.len() {
            let names: Vec<_> = self.slots.iter().map(|s| s.name.as_str()).collect();
            return error(format!("{} resources were bound; it declares {names:?}", bind.len()));
        }
        let unfit = |(s, b): &(&Slot, &Bind<'_>)| s.kind.is_buffer() != b.buffer().is_some();
        match self.slots.iter().zip(bind).find(unfit) {
            None => Ok(()),
            Some((s, _)) => error(format!("binding {} ({}) wants {:?}", s.binding, s.name, s.kind)),
        }
    }

    /// What the stages do with what is bound, by [`Bind::id`].
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
    /// Pushes what fits the interface, as [`Interface::check`] has found.
    pub(super) fn push_descriptors(&self, point: vk::PipelineBindPoint, interface: &Interface, bind: &[Bind<'_>]) {
        let images: Vec<_> = (interface.slots.iter().zip(bind))
            .map(|(slot, b)| {
                let sampler = match (slot.kind, b) {
                    (ResourceKind::SampledImage, Bind::BorderlessMap(_)) => self.context.nearest_clamped(),
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
