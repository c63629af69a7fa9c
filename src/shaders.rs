//! The SPIR-V modules that `build.rs` embeds, found by the paths of their sources under `glsl/`.

use crate::{Error, Result};

include!(concat!(env!("OUT_DIR"), "/shaders.rs"));

/// One compiled shader; its entry point is `main`.
#[derive(Clone, Copy)]
pub struct Shader {
    /// Path of its source under `glsl/`, such as `filtering/sm.comp`.
    pub name: &'static str,
    /// The module's bytes: SPIR-V 1.5 for Vulkan 1.3, with names.
    pub spirv: &'static [u8],
}

impl Shader {
    /// The module as words in the machine's byte order, as `vkCreateShaderModule` expects it.
    ///
    /// # Errors
    /// [`Error::Shader`] if the bytes are not SPIR-V.
    pub fn code(&self) -> Result<Vec<u32>> {
        ash::util::read_spv(&mut std::io::Cursor::new(self.spirv))
            .map_err(|e| Error::Shader { shader: self.name.into(), problem: format!("not SPIR-V: {e}") })
    }
}

/// Every embedded shader, sorted by name.
pub fn all() -> &'static [Shader] {
    TABLE
}

/// Shaders of the crate's own tests.
#[cfg(test)]
const TESTS: &[Shader] = &[
    Shader { name: "test/quads.frag", spirv: include_bytes!("../spv/test/quads.frag.spv") },
    Shader { name: "test/quads.geom", spirv: include_bytes!("../spv/test/quads.geom.spv") },
    Shader { name: "test/quads.vert", spirv: include_bytes!("../spv/test/quads.vert.spv") },
    Shader { name: "test/quads_count.frag", spirv: include_bytes!("../spv/test/quads_count.frag.spv") },
    Shader { name: "test/stencil.comp", spirv: include_bytes!("../spv/test/stencil.comp.spv") },
];

/// The shader whose source is `glsl/<path>`.
pub(crate) fn find(path: &str) -> Result<&'static Shader> {
    #[cfg(test)]
    if let Some(shader) = TESTS.iter().find(|s| s.name == path) {
        return Ok(shader);
    }
    TABLE
        .binary_search_by(|shader| shader.name.cmp(path))
        .map(|i| &TABLE[i])
        .map_err(|_| Error::Shader { shader: path.into(), problem: format!("not embedded; there are: {}", names()) })
}

fn names() -> String {
    TABLE.iter().map(|shader| shader.name).collect::<Vec<_>>().join(", ")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_shader_is_found_and_reads_as_spirv() {
        assert!(TABLE.is_sorted_by(|a, b| a.name < b.name));
        for shader in all() {
            assert_eq!(find(shader.name).unwrap().name, shader.name);
            assert_eq!(shader.code().unwrap()[0], 0x0723_0203, "{}", shader.name);
        }
    }

    #[test]
    fn an_unknown_shader_is_named() {
        let problem = find("filtering/no-such.comp").err().unwrap().to_string();
        assert!(problem.contains("filtering/no-such.comp"), "{problem}");
    }

    #[test]
    fn a_broken_module_is_an_error() {
        assert!(Shader { name: "x", spirv: &[1, 2, 3] }.code().is_err());
        assert!(Shader { name: "x", spirv: &[0; 20] }.code().is_err());
    }
}
