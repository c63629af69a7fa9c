//! Resources that a pass binds, by the names that they have in the shader.

use super::{Block, Buffer, Image, ImageRef, ShaderStruct};
use crate::Result;
use ash::vk::{self, Handle};

/// Something bound to a shader.
#[derive(Clone, Copy)]
pub enum Bind<'a> {
    /// An image of ours, all of its mip levels; of depth with stencil, the depth.
    Image(&'a Image),
    /// The same, read through a sampler that filters within and between levels; outside, its border goes on.
    Filtered(&'a Image),
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

    /// The handle by which hazards are tracked. Vulkan handles of different types may be equal in
    /// theory only: they are pointers on every desktop driver, and a clash merely adds a barrier.
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
    /// Its name in the shader: that of the variable, or of the block where the variable has none.
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

/// Resources by their names in the shader. A pipeline is made with the type, which is compared with the SPIR-V, and a pass
/// binds a value of it: to swap, add or forget one is an error of the compiler or of the preparation. Made by `bindings!`.
pub trait Bindings {
    /// Appends what the shader has to declare.
    fn declare(all: &mut Vec<Declared>)
    where
        Self: Sized;

    /// Appends what is bound, by name.
    fn add<'a>(&'a self, all: &mut Vec<(&'static str, Bind<'a>)>);
}

impl Bindings for () {
    fn declare(_: &mut Vec<Declared>) {}

    fn add<'a>(&'a self, _: &mut Vec<(&'static str, Bind<'a>)>) {}
}

/// Declares structs whose fields are the resources of a shader, named as there; `..field: Type` takes over those of another
/// such struct.
macro_rules! bindings {
    ($($(#[$meta:meta])* $vis:vis struct $name:ident { $(..$group:ident: $type:ident,)* $($field:ident),* $(,)? })*) => {$(
        $(#[$meta])*
        // Blocks are in camel case.
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
