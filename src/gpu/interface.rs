//! What a pipeline's shaders bind and are pushed: the layout, from reflection, so that a shader's bindings are written
//! down once, in the shader.

use super::{Device, Reflection, ResourceAccess, ResourceKind, ShaderStruct};
use crate::error::VkContext;
use crate::shaders::Shader;
use crate::{Error, Result};
use ash::vk;
use std::sync::Arc;

/// A binding with what each stage does with it.
pub(crate) struct Slot {
    pub binding: u32,
    pub name: String,
    pub kind: ResourceKind,
    pub uses: Vec<(vk::ShaderStageFlags, ResourceAccess)>,
}

/// What compute and raster pipelines share.
pub(crate) struct Interface {
    pub(super) device: Arc<Device>,
    pub set_layout: vk::DescriptorSetLayout,
    pub layout: vk::PipelineLayout,
    /// In ascending order of the bindings.
    pub slots: Vec<Slot>,
    pub push_stages: vk::ShaderStageFlags,
    pub push_size: u32,
    /// For messages: a shader, or a pipeline.
    pub name: String,
}

impl Interface {
    pub(super) fn new<P: ShaderStruct>(device: &Arc<Device>, name: &str, stages: &[Reflection]) -> Result<Self> {
        let mut interface = Self {
            device: device.clone(),
            set_layout: vk::DescriptorSetLayout::null(),
            layout: vk::PipelineLayout::null(),
            slots: vec![],
            push_stages: vk::ShaderStageFlags::empty(),
            push_size: size_of::<P>() as u32,
            name: name.into(),
        };
        for stage in stages {
            if let Some(block) = &stage.push {
                P::check(name, block)?;
                interface.push_stages |= stage.stage;
            }
            for b in &stage.bindings {
                let used = (stage.stage, b.access);
                match interface.slots.iter_mut().find(|s| s.binding == b.binding) {
                    Some(known) if known.kind == b.kind => known.uses.push(used),
                    Some(known) => {
                        let problem = format!(
                            "binding {} is {:?} ({}) in one stage and {:?} ({}) in another",
                            b.binding, known.kind, known.name, b.kind, b.name
                        );
                        return Err(Error::Shader { shader: name.into(), problem });
                    }
                    None => interface.slots.push(Slot {
                        binding: b.binding,
                        name: b.name.clone(),
                        kind: b.kind,
                        uses: vec![used],
                    }),
                }
            }
        }
        if interface.push_stages.is_empty() != (interface.push_size == 0) {
            let problem = "the host pushes constants that the shader does not declare, or the other way round";
            return Err(Error::Shader { shader: name.into(), problem: problem.into() });
        }
        interface.slots.sort_by_key(|s| s.binding);
        let bindings: Vec<_> = (interface.slots.iter())
            .map(|s| {
                let stages = s.uses.iter().fold(vk::ShaderStageFlags::empty(), |all, u| all | u.0);
                vk::DescriptorSetLayoutBinding::default()
                    .binding(s.binding)
                    .descriptor_type(s.kind.descriptor_type())
                    .descriptor_count(1)
                    .stage_flags(stages)
            })
            .collect();
        let info = vk::DescriptorSetLayoutCreateInfo::default()
            .flags(vk::DescriptorSetLayoutCreateFlags::PUSH_DESCRIPTOR_KHR)
            .bindings(&bindings);
        // SAFETY: the bindings outlive the call.
        interface.set_layout = unsafe { device.raw.create_descriptor_set_layout(&info, None) }
            .context(format!("vkCreateDescriptorSetLayout({name})"))?;
        device.name(interface.set_layout, name);
        let set_layouts = [interface.set_layout];
        let ranges =
            [vk::PushConstantRange { stage_flags: interface.push_stages, offset: 0, size: interface.push_size }];
        let info = vk::PipelineLayoutCreateInfo::default()
            .set_layouts(&set_layouts)
            .push_constant_ranges(if interface.push_size > 0 { &ranges } else { &[] });
        // SAFETY: the set layout was just made.
        interface.layout = unsafe { device.raw.create_pipeline_layout(&info, None) }
            .context(format!("vkCreatePipelineLayout({name})"))?;
        device.name(interface.layout, name);
        Ok(interface)
    }
}

impl Drop for Interface {
    fn drop(&mut self) {
        // SAFETY: the owner vouches that no command buffer in flight uses them.
        unsafe {
            self.device.raw.destroy_pipeline_layout(self.layout, None);
            self.device.raw.destroy_descriptor_set_layout(self.set_layout, None);
        }
    }
}

/// A shader module that lives as long as the pipeline is being made.
pub(super) struct Module<'a> {
    device: &'a Device,
    pub handle: vk::ShaderModule,
}

impl<'a> Module<'a> {
    pub fn new(device: &'a Device, shader: &Shader) -> Result<(Self, Reflection)> {
        let code = shader.code()?;
        let reflection = Reflection::new(shader.name, &code)?;
        let info = vk::ShaderModuleCreateInfo::default().code(&code);
        // SAFETY: the code is a SPIR-V module (the reflection has just read it).
        let handle = unsafe { device.raw.create_shader_module(&info, None) }
            .context(format!("vkCreateShaderModule({})", shader.name))?;
        device.name(handle, shader.name);
        Ok((Self { device, handle }, reflection))
    }
}

impl Drop for Module<'_> {
    fn drop(&mut self) {
        // SAFETY: a module may go as soon as the pipeline is made.
        unsafe { self.device.raw.destroy_shader_module(self.handle, None) };
    }
}

/// Specialization constants 0, 1, 2 ... of 32 bits each.
pub(super) fn constant_entries(constants: &[u32]) -> Vec<vk::SpecializationMapEntry> {
    (0..constants.len() as u32).map(|i| vk::SpecializationMapEntry { constant_id: i, offset: 4 * i, size: 4 }).collect()
}
