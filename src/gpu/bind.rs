//! Resources that a pass binds, by the names that they have in the shader.

use super::{Block, Buffer, Image, ImageRef, ShaderStruct};
use crate::Result;
use ash::vk::{self, Handle};

/// Something bound to a shader.
#[derive(Clone, Copy)]
pub enum Bind<'a> {
    /// An image of the library with all its mip levels. A format with depth and stencil is read as depth.
    Image(&'a Image),
    /// The same, read through a sampler that filters within and between levels and repeats the border outside.
    Filtered(&'a Image),
    /// One mip level of an image of the library.
    Mip(&'a Image, u32),
    /// The stencil of an image of the library, for a `usampler2D`.
    Stencil(&'a Image),
    /// An image of the caller, in the layout that its [`ImageRef`] states. Read only.
    Input(&'a ImageRef),
    /// A shadow map of the caller, for a filter whose window may be wider than the map. Outside the map, the sampler
    /// repeats the texels of the map's border.
    BorderlessMap(&'a ImageRef),
    /// A buffer.
    Buffer(&'a Buffer),
    /// The first bytes of a buffer of the caller, and their number. Read only.
    Foreign(vk::Buffer, u64),
}

impl<'a> Bind<'a> {
    pub(crate) fn owned(&self) -> Option<&'a Image> {
        match *self {
            Self::Image(i) | Self::Filtered(i) | Self::Mip(i, _) | Self::Stencil(i) => Some(i),
            Self::Input(_) | Self::BorderlessMap(_) | Self::Buffer(_) | Self::Foreign(..) => None,
        }
    }

    pub(crate) fn image(&self) -> Option<ImageRef> {
        match *self {
            Self::Image(i) | Self::Filtered(i) => Some(i.as_ref()),
            Self::Mip(i, level) => Some(i.mip(level)),
            Self::Stencil(i) => Some(i.stencil()),
            Self::Input(i) | Self::BorderlessMap(i) => Some(*i),
            Self::Buffer(_) | Self::Foreign(..) => None,
        }
    }

    /// Handle and size of a buffer.
    pub(crate) fn buffer(&self) -> Option<(vk::Buffer, u64)> {
        match *self {
            Self::Buffer(b) => Some((b.handle(), vk::WHOLE_SIZE)),
            Self::Foreign(buffer, size) => Some((buffer, size)),
            _ => None,
        }
    }

    /// Key by which hazards are tracked. Handles of different Vulkan types could be equal in theory. On desktop drivers
    /// they are pointers and therefore differ, and a clash would only add a barrier.
    pub(crate) fn id(&self) -> u64 {
        match self {
            Self::Buffer(b) => b.handle().as_raw(),
            Self::Foreign(b, _) => b.as_raw(),
            _ => self.image().map_or(0, |i| i.image.as_raw()),
        }
    }
}

/// A resource that the host declares for a shader.
#[derive(Clone, Copy)]
pub struct Declared {
    /// Name in the shader: that of the variable, or of the block if the variable has none.
    pub name: &'static str,
    /// Compares the block's layout with the host's struct; only for uniform buffers.
    pub check: Option<fn(&str, &Block) -> Result<()>>,
}

impl Declared {
    /// Declares an image, or a buffer without a struct of its own.
    pub fn new(name: &'static str) -> Self {
        Self { name, check: None }
    }

    /// Declares a uniform block that is laid out like `U`.
    pub fn uniform<U: ShaderStruct>(name: &'static str) -> Self {
        Self { name, check: Some(U::check) }
    }
}

/// Resources of a pass by their names in the shader. `bindings!` makes the implementations. A pipeline is made with
/// such a type, whose names are compared with the SPIR-V, and a pass binds a value of this type. A resource that is
/// swapped, added or forgotten is therefore a compile error or an error at preparation.
pub trait Bindings {
    /// Appends the resources that the shader must declare.
    fn declare(all: &mut Vec<Declared>)
    where
        Self: Sized;

    /// Appends the bound resources with their names.
    fn add<'a>(&'a self, all: &mut Vec<(&'static str, Bind<'a>)>);
}

impl Bindings for () {
    fn declare(_: &mut Vec<Declared>) {}

    fn add<'a>(&'a self, _: &mut Vec<(&'static str, Bind<'a>)>) {}
}

/// Declares structs whose fields are the resources of a shader and have the shader's names. `..field: Type` includes
/// the resources of another such struct.
macro_rules! bindings {
    ($($(#[$meta:meta])* $vis:vis struct $name:ident { $(..$group:ident: $type:ident,)* $($field:ident),* $(,)? })*) => {$(
        $(#[$meta])*
        // Blocks have names in camel case.
        #[allow(non_snake_case)]
        #[derive(Clone, Copy)]
        $vis struct $name<'a> { $(pub(crate) $group: $type<'a>,)* $(pub(crate) $field: $crate::gpu::Bind<'a>,)* }
        impl $crate::gpu::Bindings for $name<'_> {
            fn declare(all: &mut Vec<$crate::gpu::Declared>) {
                $(<$type<'_> as $crate::gpu::Bindings>::declare(all);)*
                $(all.push($crate::gpu::Declared::new(stringify!($field)));)*
            }

            fn add<'a>(&'a self, all: &mut Vec<(&'static str, $crate::gpu::Bind<'a>)>) {
                $($crate::gpu::Bindings::add(&self.$group, all);)*
                $(all.push((stringify!($field), self.$field));)*
            }
        }
    )*};
}
pub(crate) use bindings;
