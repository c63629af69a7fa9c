//! Compute pipelines.

use super::interface::{Interface, Module, constant_entries};
use super::{Device, Reflection, ShaderStruct};
use crate::error::VkContext;
use crate::{Error, Result, shaders};
use ash::vk;
use std::sync::Arc;

/// A compute pipeline with what its shader says of itself.
pub struct ComputePipeline {
    pub(crate) interface: Interface,
    pub(crate) handle: vk::Pipeline,
    pub(crate) reflection: Reflection,
    pub(crate) shader: &'static str,
}

impl ComputePipeline {
    /// Makes the pipeline of a shader (`filtering/sm.comp`) whose push constants are `P` (`()` for none).
    ///
    /// `constants` are the values of the specialization constants 0, 1, 2 ... in order.
    pub fn new<P: ShaderStruct>(device: &Arc<Device>, shader: &str, constants: &[u32]) -> Result<Self> {
        let shader = shaders::find(shader)?;
        let (module, reflection) = Module::new(device, shader)?;
        let interface = Interface::new::<P>(device, shader.name, std::slice::from_ref(&reflection))?;
        let entries = constant_entries(constants);
        let specialization =
            vk::SpecializationInfo::default().map_entries(&entries).data(bytemuck::cast_slice(constants));
        let stage = vk::PipelineShaderStageCreateInfo::default()
            .stage(vk::ShaderStageFlags::COMPUTE)
            .module(module.handle)
            .name(c"main")
            .specialization_info(&specialization);
        let info = vk::ComputePipelineCreateInfo::default().stage(stage).layout(interface.layout);
        // SAFETY: layout and module are alive and fit each other, both being from one reflection.
        let handle = unsafe { device.raw.create_compute_pipelines(device.pipeline_cache, &[info], None) }
            .map_err(|(_, e)| e)
            .context(format!("vkCreateComputePipelines({})", shader.name))?[0];
        device.name(handle, shader.name);
        Ok(Self { interface, handle, reflection, shader: shader.name })
    }

    /// Checks that the uniform block `name` of the shader is laid out like `U`.
    pub fn check_uniform<U: ShaderStruct>(&self, name: &str) -> Result<()> {
        check_uniform::<U>(self.shader, std::slice::from_ref(&self.reflection), name)
    }
}

/// Checks that the uniform block `name`, wherever one of the stages has it, is laid out like `U`.
pub(super) fn check_uniform<U: ShaderStruct>(shader: &str, stages: &[Reflection], name: &str) -> Result<()> {
    let blocks = stages.iter().flat_map(|s| &s.bindings).filter(|b| b.name == name).filter_map(|b| b.block.as_ref());
    let mut blocks = blocks.peekable();
    if blocks.peek().is_none() {
        return Err(Error::Shader { shader: shader.into(), problem: format!("has no uniform block named {name}") });
    }
    blocks.try_for_each(|block| U::check(shader, block))
}

impl Drop for ComputePipeline {
    fn drop(&mut self) {
        // SAFETY: the owner vouches that no command buffer in flight uses it.
        unsafe { self.interface.device.raw.destroy_pipeline(self.handle, None) };
    }
}
