//! Compute pipelines.

use super::interface::{Constant, Interface, Module};
use super::{Bindings, Device, ShaderStruct};
use crate::error::VkContext;
use crate::{Result, shaders};
use ash::vk;
use std::sync::Arc;

/// A compute pipeline with the interface of its shader.
pub struct ComputePipeline {
    pub(crate) interface: Interface,
    pub(crate) handle: vk::Pipeline,
    pub(crate) local_size: [u32; 3],
}

impl ComputePipeline {
    /// Makes the pipeline of a shader, such as `filtering/sm.comp`. The shader binds the resources `B` and has the push
    /// constants `P`; `()` stands for none.
    ///
    /// # Errors
    /// [`crate::Error::Shader`] unless the shader declares the resources of `B`, the members of `P` and the specialization
    /// `constants`, each by its name, and no others.
    pub fn new<B: Bindings, P: ShaderStruct>(
        device: &Arc<Device>,
        shader: &str,
        constants: &[Constant],
    ) -> Result<Self> {
        let shader = shaders::find(shader)?;
        let (module, reflection) = Module::new(device, shader)?;
        let local_size = reflection.local_size;
        let interface = Interface::new::<B, P>(device, shader.name, vec![reflection])?;
        let (entries, values) = interface.specialize(constants)?;
        let specialization =
            vk::SpecializationInfo::default().map_entries(&entries).data(bytemuck::cast_slice(&values));
        let stage = vk::PipelineShaderStageCreateInfo::default()
            .stage(vk::ShaderStageFlags::COMPUTE)
            .module(module.handle)
            .name(c"main")
            .specialization_info(&specialization);
        let info = vk::ComputePipelineCreateInfo::default().stage(stage).layout(interface.layout);
        // SAFETY: layout and module are alive, and they fit each other, because both come from one reflection.
        let handle = unsafe { device.raw.create_compute_pipelines(device.pipeline_cache, &[info], None) }
            .map_err(|(_, e)| e)
            .context(format!("vkCreateComputePipelines({})", shader.name))?[0];
        device.name(handle, shader.name);
        Ok(Self { interface, handle, local_size })
    }
}

impl Drop for ComputePipeline {
    fn drop(&mut self) {
        // SAFETY: the owner guarantees that no command buffer in flight uses it.
        unsafe { self.interface.device.raw.destroy_pipeline(self.handle, None) };
    }
}
