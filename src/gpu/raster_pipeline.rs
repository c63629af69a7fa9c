//! Raster pipelines for dynamic rendering.

use super::interface::{Constant, Interface, Module};
use super::{Bindings, Device, Reflection, ResourceAccess, ShaderStruct};
use crate::error::VkContext;
use crate::{Error, Result, shaders};
use ash::vk;
use std::sync::Arc;

/// State of a raster pipeline. Cull mode, front face, viewport and scissor are dynamic. The comparison of the depth
/// test and the depth bias are dynamic too, and start with the values given here.
///
/// By default, a pipeline draws triangle lists without vertex buffers and without depth, and replaces the colours of
/// the targets.
#[derive(Clone, Debug)]
pub struct RasterState<'a> {
    /// Debug name.
    pub name: &'a str,
    /// Vertex shader.
    pub vertex: &'a str,
    /// Geometry shader (needs [`crate::DeviceFeatures::geometry_shader`]).
    pub geometry: Option<&'a str>,
    /// Fragment shader; `None` for a pass that writes depth only. A fragment shader that writes buffers or images needs
    /// [`crate::DeviceFeatures::fragment_stores`].
    pub fragment: Option<&'a str>,
    /// Primitives that the vertices form.
    pub topology: vk::PrimitiveTopology,
    /// `(location, format)` of the vertex attributes; attribute `i` comes from its own tightly packed
    /// buffer, binding `i`.
    pub attributes: &'a [(u32, vk::Format)],
    /// Formats of the colour targets.
    pub colors: &'a [vk::Format],
    /// Operation that combines a fragment's colour with the target's.
    pub blend: Blend,
    /// Channels that are written.
    pub write_mask: vk::ColorComponentFlags,
    /// Depth test; required in a pass with a depth target.
    pub depth: Option<DepthState>,
    /// Stencil test, for a depth target with a stencil.
    pub stencil: Option<StencilState>,
    /// `[constant, slope]` depth bias, in the units of `vkCmdSetDepthBias`. If both are 0, depth bias is disabled and
    /// draws cannot enable it.
    pub bias: [f32; 2],
    /// Clamps depth to the range of the view instead of clipping (needs [`crate::DeviceFeatures::depth_clamp`]).
    pub depth_clamp: bool,
    /// Specialization constants of all stages, by name.
    pub constants: &'a [Constant],
}

impl Default for RasterState<'_> {
    fn default() -> Self {
        Self {
            name: "",
            vertex: "",
            geometry: None,
            fragment: None,
            topology: vk::PrimitiveTopology::TRIANGLE_LIST,
            attributes: &[],
            colors: &[],
            blend: Blend::Replace,
            write_mask: vk::ColorComponentFlags::RGBA,
            depth: None,
            stencil: None,
            bias: [0.0; 2],
            depth_clamp: false,
            constants: &[],
        }
    }
}

/// Operation that combines a fragment's colour with the target's.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Blend {
    /// The fragment's colour replaces the target's.
    #[default]
    Replace,
    /// The fragment's colour is added.
    Add,
    /// The smaller value is kept, in each channel.
    Min,
    /// The larger value is kept, in each channel.
    Max,
}

impl Blend {
    fn attachment(self, write_mask: vk::ColorComponentFlags) -> vk::PipelineColorBlendAttachmentState {
        let op = match self {
            Self::Replace | Self::Add => vk::BlendOp::ADD,
            Self::Min => vk::BlendOp::MIN,
            Self::Max => vk::BlendOp::MAX,
        };
        vk::PipelineColorBlendAttachmentState::default()
            .blend_enable(self != Self::Replace)
            .src_color_blend_factor(vk::BlendFactor::ONE)
            .dst_color_blend_factor(vk::BlendFactor::ONE)
            .color_blend_op(op)
            .src_alpha_blend_factor(vk::BlendFactor::ONE)
            .dst_alpha_blend_factor(vk::BlendFactor::ONE)
            .alpha_blend_op(op)
            .color_write_mask(write_mask)
    }
}

/// The depth test.
#[derive(Clone, Copy, Debug)]
pub struct DepthState {
    /// Format of the depth target.
    pub format: vk::Format,
    /// Comparison of a fragment's depth with the target's that lets the fragment pass. `ALWAYS` with `write: false` has
    /// no effect.
    pub compare: vk::CompareOp,
    /// True if fragments that pass write their depth.
    pub write: bool,
}

impl DepthState {
    /// Depth test that also writes.
    pub fn new(format: vk::Format, compare: vk::CompareOp) -> Self {
        Self { format, compare, write: true }
    }
}

/// Stencil test and operations for front and back faces. They use all bits, and the reference value is 0.
#[derive(Clone, Copy, Debug)]
pub struct StencilState {
    /// Front faces.
    pub front: StencilFace,
    /// Back faces.
    pub back: StencilFace,
}

/// Stencil test and operations for one kind of face.
#[derive(Clone, Copy, Debug)]
pub struct StencilFace {
    /// Comparison of 0 with the target's value that lets the fragment pass.
    pub compare: vk::CompareOp,
    /// Operation if the stencil test fails.
    pub fail: vk::StencilOp,
    /// Operation if the stencil test passes and the depth test fails.
    pub depth_fail: vk::StencilOp,
    /// Operation if both tests pass.
    pub pass: vk::StencilOp,
}

impl StencilFace {
    /// Operations that change the stencil only where the depth test fails.
    pub fn on_depth_fail(depth_fail: vk::StencilOp) -> Self {
        let keep = vk::StencilOp::KEEP;
        Self { compare: vk::CompareOp::ALWAYS, fail: keep, depth_fail, pass: keep }
    }

    fn state(self) -> vk::StencilOpState {
        vk::StencilOpState {
            fail_op: self.fail,
            pass_op: self.pass,
            depth_fail_op: self.depth_fail,
            compare_op: self.compare,
            compare_mask: 0xFF,
            write_mask: 0xFF,
            reference: 0,
        }
    }
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
    pub(crate) compare: vk::CompareOp,
    pub(crate) bias: [f32; 2],
}

impl RasterPipeline {
    /// Makes the pipeline. Its stages bind the resources `B` and have the push constants `P`.
    ///
    /// # Errors
    /// [`Error::Shader`] unless the stages together declare exactly these names and the state's constants.
    /// [`Error::NoDevice`] if the state needs a feature that the caller's device was made without. Other errors come
    /// from the shaders and the driver.
    pub fn new<B: Bindings, P: ShaderStruct>(device: &Arc<Device>, state: &RasterState<'_>) -> Result<Self> {
        let mut modules = vec![];
        let mut reflections = vec![];
        for shader in [Some(state.vertex), state.geometry, state.fragment].into_iter().flatten() {
            let (module, reflection) = Module::new(device, shaders::find(shader)?)?;
            modules.push((reflection.stage, module));
            reflections.push(reflection);
        }
        check(device, state, &reflections)?;
        let interface = Interface::new::<B, P>(device, state.name, reflections)?;
        let (entries, values) = interface.specialize(state.constants)?;
        let specialization =
            vk::SpecializationInfo::default().map_entries(&entries).data(bytemuck::cast_slice(&values));
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
        let assembly = vk::PipelineInputAssemblyStateCreateInfo::default().topology(state.topology);
        let viewport = vk::PipelineViewportStateCreateInfo::default().viewport_count(1).scissor_count(1);
        let rasterization = vk::PipelineRasterizationStateCreateInfo::default()
            .depth_clamp_enable(state.depth_clamp)
            .depth_bias_enable(state.bias != [0.0; 2])
            .depth_bias_constant_factor(state.bias[0])
            .depth_bias_slope_factor(state.bias[1])
            .line_width(1.0);
        let multisample =
            vk::PipelineMultisampleStateCreateInfo::default().rasterization_samples(vk::SampleCountFlags::TYPE_1);
        let mut depth_stencil = vk::PipelineDepthStencilStateCreateInfo::default();
        if let Some(depth) = state.depth {
            depth_stencil =
                depth_stencil.depth_test_enable(true).depth_write_enable(depth.write).depth_compare_op(depth.compare);
        }
        if let Some(stencil) = state.stencil {
            depth_stencil =
                depth_stencil.stencil_test_enable(true).front(stencil.front.state()).back(stencil.back.state());
        }
        let blend_attachments: Vec<_> = state.colors.iter().map(|_| state.blend.attachment(state.write_mask)).collect();
        let blend = vk::PipelineColorBlendStateCreateInfo::default().attachments(&blend_attachments);
        let dynamic = [
            vk::DynamicState::VIEWPORT,
            vk::DynamicState::SCISSOR,
            vk::DynamicState::CULL_MODE,
            vk::DynamicState::FRONT_FACE,
            vk::DynamicState::DEPTH_COMPARE_OP,
            vk::DynamicState::DEPTH_BIAS,
        ];
        let dynamic = vk::PipelineDynamicStateCreateInfo::default().dynamic_states(&dynamic);
        let depth_format = state.depth.map_or(vk::Format::UNDEFINED, |d| d.format);
        let mut rendering = vk::PipelineRenderingCreateInfo::default()
            .color_attachment_formats(state.colors)
            .depth_attachment_format(depth_format)
            .stencil_attachment_format(if super::has_stencil(depth_format) {
                depth_format
            } else {
                vk::Format::UNDEFINED
            });
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
        let compare = state.depth.map_or(vk::CompareOp::ALWAYS, |d| d.compare);
        Ok(Self { interface, handle, compare, bias: state.bias })
    }
}

/// Rejects shaders that break the rules of this project, and states that need features which the device was made
/// without.
fn check(device: &Device, state: &RasterState<'_>, stages: &[Reflection]) -> Result<()> {
    let expected = [Some(vk::ShaderStageFlags::VERTEX), state.geometry.map(|_| vk::ShaderStageFlags::GEOMETRY)];
    let expected = expected.into_iter().chain([state.fragment.map(|_| vk::ShaderStageFlags::FRAGMENT)]).flatten();
    let fail = |problem: String| Err(Error::Shader { shader: state.name.into(), problem });
    if !expected.eq(stages.iter().map(|s| s.stage)) {
        return fail("a shader belongs to another stage than the one it is used for".into());
    }
    let writes = |s: &&Reflection| s.bindings.iter().any(|b| b.access != ResourceAccess::Read);
    let written: Vec<_> = stages.iter().filter(writes).map(|s| s.stage).collect();
    if let Some(stage) = written.iter().find(|s| **s != vk::ShaderStageFlags::FRAGMENT) {
        return fail(format!("a buffer or image of the {stage:?} stage must be declared readonly"));
    }
    if state.stencil.is_some() && !state.depth.is_some_and(|d| super::has_stencil(d.format)) {
        return fail("its state has a stencil test, but its depth target has no stencil".into());
    }
    let has = device.features;
    let lacks = [
        (true, has.dynamic_rendering, "dynamicRendering"),
        (state.geometry.is_some(), has.geometry_shader, "geometryShader"),
        (state.depth_clamp, has.depth_clamp, "depthClamp"),
        (!written.is_empty(), has.fragment_stores, "fragmentStoresAndAtomics"),
    ];
    match lacks.iter().find(|(needed, there, _)| *needed && !there) {
        None => Ok(()),
        Some((.., feature)) => Err(Error::NoDevice(format!(
            "{} needs the feature {feature}, which this device lacks according to ContextDesc::features",
            state.name
        ))),
    }
}

impl Drop for RasterPipeline {
    fn drop(&mut self) {
        // SAFETY: the owner guarantees that no command buffer in flight uses it.
        unsafe { self.interface.device.raw.destroy_pipeline(self.handle, None) };
    }
}
