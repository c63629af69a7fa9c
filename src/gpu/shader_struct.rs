//! Constants shared with GLSL: `repr(C)` structs whose member offsets are compared with the shader's.

use super::Block;
use crate::{Error, Result};

/// A `repr(C)` struct that mirrors a GLSL block in scalar layout. `shader_struct!` declares such structs.
pub trait ShaderStruct: bytemuck::Pod {
    /// Member names and byte offsets, in declaration order.
    const MEMBERS: &'static [(&'static str, usize)];

    /// Compares every member's name and offset with the reflected block.
    fn check(shader: &str, block: &Block) -> Result<()> {
        let ours = Self::MEMBERS.iter().map(|&(n, o)| (n, o as u32));
        let theirs = block.members.iter().map(|m| (m.name.as_str(), m.offset));
        if ours.clone().eq(theirs.clone()) {
            return Ok(());
        }
        let problem = format!(
            "{} differs from the shader's block: the host has {:?}, the shader {:?}",
            std::any::type_name::<Self>(),
            ours.collect::<Vec<_>>(),
            theirs.collect::<Vec<_>>()
        );
        Err(Error::Shader { shader: shader.into(), problem })
    }
}

impl ShaderStruct for () {
    const MEMBERS: &'static [(&'static str, usize)] = &[];
}

/// Declares a `repr(C)` struct and its table of member offsets.
macro_rules! shader_struct {
    ($(#[$meta:meta])* $vis:vis struct $name:ident { $($(#[$field_meta:meta])* $field:ident: $ty:ty,)* }) => {
        $(#[$meta])*
        #[derive(Clone, Copy, Debug, Default, bytemuck::Pod, bytemuck::Zeroable)]
        #[repr(C)]
        $vis struct $name { $($(#[$field_meta])* pub(crate) $field: $ty,)* }
        impl $crate::gpu::ShaderStruct for $name {
            const MEMBERS: &'static [(&'static str, usize)] =
                &[$((stringify!($field), std::mem::offset_of!($name, $field)),)*];
        }
    };
}
pub(crate) use shader_struct;
