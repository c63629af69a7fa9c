//! Pipelines: layout from reflection, so a shader's bindings are written down once, in the shader.

use super::{Device, Reflection, ResourceKind, ShaderStruct};
use crate::error::VkContext;
use crate::shaders::{self, Shader};
use crate::{Error, Result};
use ash::vk;
use std::sync::Arc;

/// What compute and raster pipelines share.
pub(crate) struct Interface {
    device: Arc<Device>,
    pub set_layout: vk::DescriptorSetLayout,
    pub layout: vk::PipelineLayout,
    pub kinds: Vec<(u32, ResourceKind)>,
    pub push_stages: vk::ShaderStageFlags,
    pub push_size: u32,
}

impl Interface {
    fn new<P: ShaderStruct>(device: &Arc<Device>, name: &str, stages: &[Reflection]) -> Result<Self> {
        let mut interface = Self {
            device: device.clone(),
            set_layout: vk::DescriptorSetLayout::null(),
            layout: vk::PipelineLayout::null(),
            kinds: vec![],
            push_stages: vk::ShaderStageFlags::empty(),
            push_size: size_of::<P>() as u32,
        };
        let mut bindings: Vec<vk::DescriptorSetLayoutBinding<'_>> = vec![];
        for stage in stages {
            if let Some(block) = &stage.push {
                P::check(name, block)?;
                interface.push_stages |= stage.stage;
            }
            for b in &stage.bindings {
                match bindings.iter_mut().find(|x| x.binding == b.binding) {
                    Some(known) => known.stage_flags |= stage.stage,
                    None => {
                        interface.kinds.push((b.binding, b.kind));
                        bindings.push(
                            vk::DescriptorSetLayoutBinding::default()
                                .binding(b.binding)
                                .descriptor_type(b.kind.descriptor_type())
                                .descriptor_count(1)
                                .stage_flags(stage.stage),
                        );
                    }
                }
            }
        }
        if interface.push_stages.is_empty() != (interface.push_size == 0) {
            let problem = "the host pushes constants that the shader does not declare, or the other way round";
            return Err(Error::Shader { shader: name.into(), problem: problem.into() });
        }
        interface.kinds.sort_by_key(|k| k.0);
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
struct Module<'a> {
    device: &'a Device,
    handle: vk::ShaderModule,
}

impl<'a> Module<'a> {
    fn new(device: &'a Device, shader: &Shader) -> Result<(Self, Reflection)> {
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

fn constant_entries(constants: &[u32]) -> Vec<vk::SpecializationMapEntry> {
    (0..constants.len() as u32).map(|i| vk::SpecializationMapEntry { constant_id: i, offset: 4 * i, size: 4 }).collect()
}

/// A compute pipeline with what its shader says of itself.
pub struct ComputePipeline {
    pub(crate) interface: Interface,
    pub(crate) handle: vk::Pipeline,
    pub(crate) reflection: Reflection,
    pub(crate) shader: &'static str,
}

impl ComputePipeline {
    /// Makes the pipeline of a shader (`pass/sm.comp`) whose push constants are `P` (`()` for none).
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
        let block = self.reflection.bindings.iter().find(|b| b.name == name).and_then(|b| b.block.as_ref());
        match block {
            Some(block) => U::check(self.shader, block),
            None => {
                Err(Error::Shader { shader: self.shader.into(), problem: format!("has no uniform block named {name}") })
            }
        }
    }
}

impl Drop for ComputePipeline {
    fn drop(&mut self) {
        // SAFETY: the owner vouches that no command buffer in flight uses it.
        unsafe { self.interface.device.raw.destroy_pipeline(self.handle, None) };
    }
}

/// Fixed state of a raster pipeline. Cull mode and front face are dynamic.
#[derive(Clone, Debug)]
pub struct RasterState<'a> {
    /// Debug name.
    pub name: &'a str,
    /// Vertex shader.
    pub vertex: &'a str,
    /// Fragment shader; none for a depth-only pass.
    pub fragment: Option<&'a str>,
    /// `(location, format)` of the vertex attributes; attribute `i` comes from its own tightly packed
    /// buffer, binding `i`.
    pub attributes: &'a [(u32, vk::Format)],
    /// Formats of the colour targets.
    pub colors: &'a [vk::Format],
    /// Format of the depth target.
    pub depth: vk::Format,
    /// Depth comparison.
    pub compare: vk::CompareOp,
    /// `[constant, slope]` depth bias, in the units of `vkCmdSetDepthBias`.
    pub bias: [f32; 2],
    /// Clamp depth to the view's range instead of clipping (needs the feature `depthClamp`).
    pub depth_clamp: bool,
    /// Specialization constants 0, 1, 2 ... of both stages.
    pub constants: &'a [u32],
}

fn format_bytes(format: vk::Format) -> u32 {
    match format {
        vk::Format::R32G32_SFLOAT => 8,
        vk::Format::R32G32B32_SFLOAT => 12,
        vk::Format::R32G32B32A32_SFLOAT => 16,
        _ => 4,
    }
}

/// A graphics pipeline for dynamic rendering.
pub struct RasterPipeline {
    pub(crate) interface: Interface,
    pub(crate) handle: vk::Pipeline,
}

impl RasterPipeline {
    /// Makes the pipeline; both stages see the push constants `P`.
    pub fn new<P: ShaderStruct>(device: &Arc<Device>, state: &RasterState<'_>) -> Result<Self> {
        let (vertex, vertex_reflection) = Module::new(device, shaders::find(state.vertex)?)?;
        let mut reflections = vec![vertex_reflection];
        let mut modules = vec![(vk::ShaderStageFlags::VERTEX, vertex)];
        if let Some(fragment) = state.fragment {
            let (module, reflection) = Module::new(device, shaders::find(fragment)?)?;
            modules.push((vk::ShaderStageFlags::FRAGMENT, module));
            reflections.push(reflection);
        }
        let interface = Interface::new::<P>(device, state.name, &reflections)?;
        let entries = constant_entries(state.constants);
        let specialization =
            vk::SpecializationInfo::default().map_entries(&entries).data(bytemuck::cast_slice(state.constants));
        let stages: Vec<_> = modules
            .iter()
            .map(|(stage, m)| {
                vk::PipelineShaderStageCreateInfo::default()
                    .stage(*stage)
                    .module(m.handle)
                    .name(c"main")
                    .specialization_info(&specialization)
            })
            .collect();
        let (bindings, attributes): (Vec<_>, Vec<_>) = (0..)
            .zip(state.attributes)
            .map(|(binding, &(location, format))| {
                let stride = format_bytes(format);
                (
                    vk::VertexInputBindingDescription { binding, stride, input_rate: vk::VertexInputRate::VERTEX },
                    vk::VertexInputAttributeDescription { location, binding, format, offset: 0 },
                )
            })
            .unzip();
        let vertex_input = vk::PipelineVertexInputStateCreateInfo::default()
            .vertex_binding_descriptions(&bindings)
            .vertex_attribute_descriptions(&attributes);
        let assembly =
            vk::PipelineInputAssemblyStateCreateInfo::default().topology(vk::PrimitiveTopology::TRIANGLE_LIST);
        let viewport = vk::PipelineViewportStateCreateInfo::default().viewport_count(1).scissor_count(1);
        let rasterization = vk::PipelineRasterizationStateCreateInfo::default()
            .depth_clamp_enable(state.depth_clamp)
            .depth_bias_enable(state.bias != [0.0; 2])
            .depth_bias_constant_factor(state.bias[0])
            .depth_bias_slope_factor(state.bias[1])
            .line_width(1.0);
        let multisample =
            vk::PipelineMultisampleStateCreateInfo::default().rasterization_samples(vk::SampleCountFlags::TYPE_1);
        let depth_stencil = vk::PipelineDepthStencilStateCreateInfo::default()
            .depth_test_enable(true)
            .depth_write_enable(true)
            .depth_compare_op(state.compare);
        let blend_attachments: Vec<_> = state
            .colors
            .iter()
            .map(|_| vk::PipelineColorBlendAttachmentState::default().color_write_mask(vk::ColorComponentFlags::RGBA))
            .collect();
        let blend = vk::PipelineColorBlendStateCreateInfo::default().attachments(&blend_attachments);
        let dynamic = [
            vk::DynamicState::VIEWPORT,
            vk::DynamicState::SCISSOR,
            vk::DynamicState::CULL_MODE,
            vk::DynamicState::FRONT_FACE,
        ];
        let dynamic = vk::PipelineDynamicStateCreateInfo::default().dynamic_states(&dynamic);
        let mut rendering = vk::PipelineRenderingCreateInfo::default()
            .color_attachment_formats(state.colors)
            .depth_attachment_format(state.depth);
        let info = vk::GraphicsPipelineCreateInfo::default()
            .stages(&stages)
            .vertex_input_state(&vertex_input)
            .input_assembly_state(&assembly)
            .viewport_state(&viewport)
            .rasterization_state(&rasterization)
            .multisample_state(&multisample)
            .depth_stencil_state(&depth_stencil)
            .color_blend_state(&blend)
            .dynamic_state(&dynamic)
            .layout(interface.layout)
            .push_next(&mut rendering);
        // SAFETY: every pointer in `info` outlives the call.
        let handle = unsafe { device.raw.create_graphics_pipelines(device.pipeline_cache, &[info], None) }
            .map_err(|(_, e)| e)
            .context(format!("vkCreateGraphicsPipelines({})", state.name))?[0];
        device.name(handle, state.name);
        Ok(Self { interface, handle })
    }
}

impl Drop for RasterPipeline {
    fn drop(&mut self) {
        // SAFETY: the owner vouches that no command buffer in flight uses it.
        unsafe { self.interface.device.raw.destroy_pipeline(self.handle, None) };
    }
}
