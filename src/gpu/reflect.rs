//! Declarations of a SPIR-V module: bindings and their access, push constants, specialization constants, and workgroup
//! size.
//!
//! Only features that the shaders of this project use are supported: descriptor set 0, at most one push-constant block,
//! and workgroup sizes that are not specialised. Anything else is an error when the pipeline is made.

use crate::{Error, Result};
use ash::vk;
use std::collections::HashMap;

/// Everything the host needs to bind and dispatch a shader.
#[derive(Clone, Debug)]
pub struct Reflection {
    /// Stage of the module's entry point.
    pub stage: vk::ShaderStageFlags,
    /// Workgroup size of a compute shader; `[1, 1, 1]` otherwise.
    pub local_size: [u32; 3],
    /// Bindings of set 0 in ascending order.
    pub bindings: Vec<Binding>,
    /// The push-constant block.
    pub push: Option<Block>,
    /// Number and name of each specialization constant, in ascending order.
    pub constants: Vec<(u32, String)>,
}

/// One binding of set 0.
#[derive(Clone, Debug)]
pub struct Binding {
    /// Number of the binding.
    pub binding: u32,
    /// Name of the variable, or of the block if the variable has no name.
    pub name: String,
    /// Kind of resource.
    pub kind: ResourceKind,
    /// Access that the shader has.
    pub access: ResourceAccess,
    /// Layout, for uniform and storage buffers.
    pub block: Option<Block>,
}

/// Kinds of resource that the project binds.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ResourceKind {
    /// `uniform sampler2D` and similar types.
    SampledImage,
    /// `uniform image2D` and similar types.
    StorageImage,
    /// `uniform` block.
    UniformBuffer,
    /// `buffer` block.
    StorageBuffer,
}

impl ResourceKind {
    /// True for blocks, false for images.
    pub fn is_buffer(self) -> bool {
        matches!(self, Self::UniformBuffer | Self::StorageBuffer)
    }

    /// The Vulkan descriptor type.
    pub fn descriptor_type(self) -> vk::DescriptorType {
        match self {
            Self::SampledImage => vk::DescriptorType::COMBINED_IMAGE_SAMPLER,
            Self::StorageImage => vk::DescriptorType::STORAGE_IMAGE,
            Self::UniformBuffer => vk::DescriptorType::UNIFORM_BUFFER,
            Self::StorageBuffer => vk::DescriptorType::STORAGE_BUFFER,
        }
    }
}

/// Access of a shader to a resource, according to `readonly` and `writeonly`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ResourceAccess {
    /// The shader only reads.
    Read,
    /// The shader only writes.
    Write,
    /// The shader reads and writes.
    ReadWrite,
}

/// A block of constants.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Block {
    /// Members in declaration order.
    pub members: Vec<Member>,
}

/// A member of a [`Block`].
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Member {
    /// Name in the shader.
    pub name: String,
    /// Offset in bytes.
    pub offset: u32,
}

const MAGIC: u32 = 0x0723_0203;

#[derive(Default)]
struct Module {
    names: HashMap<u32, String>,
    member_names: HashMap<(u32, u32), String>,
    decorations: HashMap<(u32, u32), u32>,
    member_decorations: HashMap<(u32, u32, u32), u32>,
    pointers: HashMap<u32, (u32, u32)>,
    /// Type id -> (opcode, operands after the result id).
    types: HashMap<u32, (u16, Vec<u32>)>,
    /// Variable id -> (pointer type, storage class).
    variables: Vec<(u32, u32, u32)>,
    constants: HashMap<u32, u32>,
    model: Option<u32>,
    local_size: Option<[u32; 3]>,
    local_size_ids: Option<[u32; 3]>,
}

mod op {
    pub const NAME: u16 = 5;
    pub const MEMBER_NAME: u16 = 6;
    pub const ENTRY_POINT: u16 = 15;
    pub const EXECUTION_MODE: u16 = 16;
    pub const TYPE_FIRST: u16 = 19;
    pub const TYPE_IMAGE: u16 = 25;
    pub const TYPE_SAMPLED_IMAGE: u16 = 27;
    pub const TYPE_STRUCT: u16 = 30;
    pub const TYPE_POINTER: u16 = 32;
    pub const CONSTANT: u16 = 43;
    pub const VARIABLE: u16 = 59;
    pub const DECORATE: u16 = 71;
    pub const MEMBER_DECORATE: u16 = 72;
    pub const EXECUTION_MODE_ID: u16 = 331;
}

mod decoration {
    pub const SPEC_ID: u32 = 1;
    pub const BLOCK: u32 = 2;
    pub const NON_WRITABLE: u32 = 24;
    pub const NON_READABLE: u32 = 25;
    pub const BINDING: u32 = 33;
    pub const DESCRIPTOR_SET: u32 = 34;
    pub const OFFSET: u32 = 35;
}

mod class {
    pub const UNIFORM_CONSTANT: u32 = 0;
    pub const UNIFORM: u32 = 2;
    pub const PUSH_CONSTANT: u32 = 9;
    pub const STORAGE_BUFFER: u32 = 12;
}

fn string(words: &[u32]) -> String {
    let bytes: Vec<u8> = words.iter().flat_map(|w| w.to_le_bytes()).take_while(|&b| b != 0).collect();
    String::from_utf8_lossy(&bytes).into_owned()
}

impl Module {
    fn parse(code: &[u32]) -> Option<Self> {
        if code.len() < 5 || code[0] != MAGIC {
            return None;
        }
        let mut m = Module::default();
        let mut at = 5;
        while at < code.len() {
            let (count, opcode) = ((code[at] >> 16) as usize, code[at] as u16);
            let o = code.get(at + 1..at + count)?;
            match opcode {
                op::NAME => drop(m.names.insert(*o.first()?, string(&o[1..]))),
                op::MEMBER_NAME => drop(m.member_names.insert((*o.first()?, *o.get(1)?), string(&o[2..]))),
                op::ENTRY_POINT => m.model = Some(*o.first()?),
                op::EXECUTION_MODE if o.get(1) == Some(&17) => m.local_size = o.get(2..5)?.try_into().ok(),
                op::EXECUTION_MODE_ID if o.get(1) == Some(&38) => m.local_size_ids = o.get(2..5)?.try_into().ok(),
                op::DECORATE => drop(m.decorations.insert((*o.first()?, *o.get(1)?), o.get(2).copied().unwrap_or(0))),
                op::MEMBER_DECORATE => {
                    let key = (*o.first()?, *o.get(1)?, *o.get(2)?);
                    m.member_decorations.insert(key, o.get(3).copied().unwrap_or(0));
                }
                op::TYPE_POINTER => drop(m.pointers.insert(*o.first()?, (*o.get(1)?, *o.get(2)?))),
                op::TYPE_FIRST..=op::TYPE_STRUCT => drop(m.types.insert(*o.first()?, (opcode, o[1..].to_vec()))),
                op::CONSTANT => drop(m.constants.insert(*o.get(1)?, *o.get(2)?)),
                op::VARIABLE => m.variables.push((*o.get(1)?, *o.first()?, *o.get(2)?)),
                _ => {}
            }
            at += count.max(1);
        }
        Some(m)
    }

    fn block(&self, ty: u32) -> Option<Block> {
        let (op::TYPE_STRUCT, members) = self.types.get(&ty)? else { return None };
        let members = (0..members.len() as u32)
            .map(|i| {
                Some(Member {
                    name: self.member_names.get(&(ty, i))?.clone(),
                    offset: *self.member_decorations.get(&(ty, i, decoration::OFFSET))?,
                })
            })
            .collect::<Option<_>>()?;
        Some(Block { members })
    }

    /// Access to a variable. SPIR-V decorates an image variable, or every member of a buffer's block, with `readonly`
    /// and `writeonly`.
    fn access(&self, variable: u32, ty: u32) -> ResourceAccess {
        let members = match self.types.get(&ty) {
            Some((op::TYPE_STRUCT, members)) => members.len() as u32,
            _ => 0,
        };
        let has = |d: u32| {
            self.decorations.contains_key(&(variable, d))
                || members > 0 && (0..members).all(|i| self.member_decorations.contains_key(&(ty, i, d)))
        };
        match (has(decoration::NON_WRITABLE), has(decoration::NON_READABLE)) {
            (true, _) => ResourceAccess::Read,
            (_, true) => ResourceAccess::Write,
            _ => ResourceAccess::ReadWrite,
        }
    }
}

impl Reflection {
    /// Reads a module. `name` is for the error message only.
    pub fn new(name: &str, code: &[u32]) -> Result<Self> {
        let error = |problem: &str| Error::Shader { shader: name.into(), problem: problem.into() };
        let m = Module::parse(code).ok_or_else(|| error("is not a SPIR-V module"))?;
        let stage = match m.model {
            Some(0) => vk::ShaderStageFlags::VERTEX,
            Some(3) => vk::ShaderStageFlags::GEOMETRY,
            Some(4) => vk::ShaderStageFlags::FRAGMENT,
            Some(5) => vk::ShaderStageFlags::COMPUTE,
            _ => return Err(error("has no entry point of a known stage")),
        };
        let local_size = match (m.local_size, m.local_size_ids) {
            (Some(size), _) => size,
            (None, Some(ids)) => ids.map(|id| m.constants.get(&id).copied().unwrap_or(0)),
            (None, None) => [1; 3],
        };
        if local_size.contains(&0) {
            return Err(error("has a specialised workgroup size, which is not supported"));
        }
        let mut out = Self { stage, local_size, bindings: vec![], push: None, constants: vec![] };
        for (&(id, _), &number) in m.decorations.iter().filter(|(key, _)| key.1 == decoration::SPEC_ID) {
            out.constants.push((number, m.names.get(&id).cloned().unwrap_or_default()));
        }
        out.constants.sort();
        for &(variable, pointer, class) in &m.variables {
            let Some(&(_, ty)) = m.pointers.get(&pointer) else { continue };
            if class == class::PUSH_CONSTANT {
                out.push = Some(m.block(ty).ok_or_else(|| error("has a push-constant block without names"))?);
                continue;
            }
            let Some(&binding) = m.decorations.get(&(variable, decoration::BINDING)) else { continue };
            if m.decorations.get(&(variable, decoration::DESCRIPTOR_SET)).copied().unwrap_or(0) != 0 {
                return Err(error("uses a descriptor set other than 0"));
            }
            let (kind, access) = match (class, m.types.get(&ty).map(|t| t.0)) {
                (class::UNIFORM_CONSTANT, Some(op::TYPE_SAMPLED_IMAGE)) => {
                    (ResourceKind::SampledImage, ResourceAccess::Read)
                }
                (class::UNIFORM_CONSTANT, Some(op::TYPE_IMAGE)) => (ResourceKind::StorageImage, m.access(variable, ty)),
                (class::UNIFORM, Some(op::TYPE_STRUCT)) => (ResourceKind::UniformBuffer, ResourceAccess::Read),
                (class::STORAGE_BUFFER, Some(op::TYPE_STRUCT)) => (ResourceKind::StorageBuffer, m.access(variable, ty)),
                _ => return Err(error(&format!("binding {binding} is of a kind that is not supported"))),
            };
            let is_block = m.decorations.contains_key(&(ty, decoration::BLOCK));
            let named = |id: u32| m.names.get(&id).filter(|n| !n.is_empty()).cloned();
            let name = named(variable).or_else(|| named(ty)).unwrap_or_default();
            let block = if is_block { m.block(ty) } else { None };
            out.bindings.push(Binding { binding, name, kind, access, block });
        }
        out.bindings.sort_by_key(|b| b.binding);
        if out.bindings.windows(2).any(|w| w[0].binding == w[1].binding) {
            return Err(error("declares a binding twice"));
        }
        Ok(out)
    }
}
