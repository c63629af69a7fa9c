//! Interface of a pipeline's shaders: bindings, push constants and specialization constants. Reflection supplies the
//! layout, so only the shaders contain the numbers of bindings and constants. The host code gives names, which are
//! compared here.

use super::{Bindings, Device, Reflection, ResourceAccess, ResourceKind, ShaderStruct};
use crate::error::VkContext;
use crate::shaders::Shader;
use crate::{Error, Result};
use ash::vk;
use std::sync::Arc;

/// A binding, and how each stage uses it.
pub(crate) struct Slot {
    pub binding: u32,
    pub name: String,
    pub kind: ResourceKind,
    pub uses: Vec<(vk::ShaderStageFlags, ResourceAccess)>,
}

/// A specialization constant: its name in the shader, and the bits of its value.
pub type Constant = (&'static str, u32);

/// Part that compute and raster pipelines have in common.
pub(crate) struct Interface {
    pub(super) device: Arc<Device>,
    pub set_layout: vk::DescriptorSetLayout,
    pub layout: vk::PipelineLayout,
    /// Slots in ascending order of their bindings.
    pub slots: Vec<Slot>,
    pub push_stages: vk::ShaderStageFlags,
    pub push_size: u32,
    /// Number and name of each specialization constant.
    constants: Vec<(u32, String)>,
    stages: Vec<Reflection>,
    /// Name for messages: that of the shader or of the pipeline.
    pub name: String,
}

impl Interface {
    pub(super) fn new<B: Bindings, P: ShaderStruct>(
        device: &Arc<Device>,
        name: &str,
        stages: Vec<Reflection>,
    ) -> Result<Self> {
        let mut interface = Self {
            device: device.clone(),
            set_layout: vk::DescriptorSetLayout::null(),
            layout: vk::PipelineLayout::null(),
            slots: vec![],
            push_stages: vk::ShaderStageFlags::empty(),
            push_size: size_of::<P>() as u32,
            constants: vec![],
            stages,
            name: name.into(),
        };
        for stage in &interface.stages {
            if stage.push.is_some() {
                interface.push_stages |= stage.stage;
            }
            for constant in &stage.constants {
                match interface.constants.iter().find(|c| c.0 == constant.0 || c.1 == constant.1) {
                    Some(known) if known == constant => {}
                    Some(known) => {
                        let problem = format!("constant {known:?} of one stage is {constant:?} in another");
                        return Err(Error::Shader { shader: name.into(), problem });
                    }
                    None => interface.constants.push(constant.clone()),
                }
            }
            for b in &stage.bindings {
                let used = (stage.stage, b.access);
                match interface.slots.iter_mut().find(|s| s.binding == b.binding || s.name == b.name) {
                    Some(s) if (s.binding, s.kind, &s.name) == (b.binding, b.kind, &b.name) => s.uses.push(used),
                    Some(known) => {
                        let problem = format!(
                            "{} (binding {}) is {:?} in one stage, and {} (binding {}) {:?} in another",
                            known.name, known.binding, known.kind, b.name, b.binding, b.kind
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
        interface.check::<B, P>()?;
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

    /// Compares the host's declarations with the shaders.
    pub fn check<B: Bindings, P: ShaderStruct>(&self) -> Result<()> {
        let error = |problem: String| Err(Error::Shader { shader: self.name.clone(), problem });
        let mut declared = vec![];
        B::declare(&mut declared);
        let names: Vec<_> = declared.iter().map(|d| d.name).collect();
        if let Some(problem) = self.other_names(&names) {
            return error(problem);
        }
        for stage in &self.stages {
            for binding in &stage.bindings {
                let check = declared.iter().find(|d| d.name == binding.name).and_then(|d| d.check);
                match (check, &binding.block) {
                    (Some(check), Some(block)) => check(&self.name, block)?,
                    (Some(_), None) => return error(format!("{} is not a uniform block", binding.name)),
                    (None, _) => {}
                }
            }
            if let Some(block) = &stage.push {
                P::check(&self.name, block)?;
            }
        }
        if self.push_stages.is_empty() && size_of::<P>() > 0 {
            return error(format!(
                "the host pushes {}, but the shaders declare no push constants",
                std::any::type_name::<P>()
            ));
        }
        Ok(())
    }

    /// Describes how the given names differ from the names of the resources that the shaders declare. Returns `None` if
    /// they are the same.
    pub fn other_names(&self, given: &[&str]) -> Option<String> {
        let declared: Vec<_> = self.slots.iter().map(|s| s.name.as_str()).collect();
        difference("resources", given, &declared)
    }

    /// Entries and data of the specialization constants. The given names must be exactly those that the shaders
    /// declare.
    pub(super) fn specialize(&self, given: &[Constant]) -> Result<(Vec<vk::SpecializationMapEntry>, Vec<u32>)> {
        let names: Vec<_> = given.iter().map(|g| g.0).collect();
        let declared: Vec<_> = self.constants.iter().map(|c| c.1.as_str()).collect();
        if let Some(problem) = difference("specialization constants", &names, &declared) {
            return Err(Error::Shader { shader: self.name.clone(), problem });
        }
        Ok((entries(&self.constants, given), given.iter().map(|g| g.1).collect()))
    }
}

/// Offset of each constant in the data, which holds the constants in the order in which they are given.
fn entries(declared: &[(u32, String)], given: &[Constant]) -> Vec<vk::SpecializationMapEntry> {
    let place = |name: &str| given.iter().position(|g| g.0 == name).unwrap_or_default() as u32;
    declared
        .iter()
        .map(|(id, name)| vk::SpecializationMapEntry { constant_id: *id, offset: 4 * place(name), size: 4 })
        .collect()
}

/// Describes how the names that the host gives differ from those that the shader declares. Their order does not matter.
fn difference(what: &str, given: &[&str], declared: &[&str]) -> Option<String> {
    let unknown: Vec<_> = given.iter().filter(|g| !declared.contains(g)).collect();
    let missing: Vec<_> = declared.iter().filter(|d| !given.contains(d)).collect();
    let problem = match (unknown.is_empty(), missing.is_empty()) {
        (true, true) if given.len() == declared.len() => return None,
        (true, true) => "one is named twice".into(),
        (false, true) => format!("{unknown:?} unknown"),
        (true, false) => format!("{missing:?} missing"),
        (false, false) => format!("{unknown:?} unknown, {missing:?} missing"),
    };
    Some(format!("the host gives the {what} {given:?}, but the shader declares {declared:?}: {problem}"))
}

impl Drop for Interface {
    fn drop(&mut self) {
        // SAFETY: the owner guarantees that no command buffer in flight uses them.
        unsafe {
            self.device.raw.destroy_pipeline_layout(self.layout, None);
            self.device.raw.destroy_descriptor_set_layout(self.set_layout, None);
        }
    }
}

/// A shader module that lives only while the pipeline is being made.
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
        // SAFETY: a module may be destroyed as soon as the pipeline is made.
        unsafe { self.device.raw.destroy_shader_module(self.handle, None) };
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_alone_decide_which_constant_is_meant() {
        let declared = [(0, "PLANES".to_owned()), (3, "SOFT".to_owned())];
        for given in [[("PLANES", 7), ("SOFT", 9)], [("SOFT", 9), ("PLANES", 7)]] {
            let values: Vec<_> = entries(&declared, &given)
                .iter()
                .map(|e| (e.constant_id, given[e.offset as usize / 4].1, e.size))
                .collect();
            assert_eq!(values, [(0, 7, 4), (3, 9, 4)]);
        }
    }

    #[test]
    fn other_names_are_found_whatever_their_order() {
        let found = |given: &[&str]| difference("resources", given, &["view", "depth"]);
        assert_eq!(found(&["depth", "view"]), None);
        for (given, expected) in [
            (&["view"][..], "[\"depth\"] missing"),
            (&["view", "depth", "normal"], "[\"normal\"] unknown"),
            (&["view", "normal"], "[\"normal\"] unknown, [\"depth\"] missing"),
            (&["view", "depth", "view"], "one is named twice"),
        ] {
            let text = found(given).unwrap_or_default();
            assert!(text.ends_with(expected) && text.contains(&format!("{given:?}")), "{text}");
        }
    }
}
