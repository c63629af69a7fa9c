//! Compiles one shader with shaderc. The text of this file is part of every shader's hash: run `make spv` after a change.
//!
//! Optimisation level zero: the optimiser strips the names that reflection, validation messages and captures need,
//! and drivers optimise again anyway. No further debug information: it would put the source text into the binary.

use shaderc::{
    CompileOptions, Compiler, EnvVersion, OptimizationLevel, ResolvedInclude, ShaderKind, SourceLanguage, SpirvVersion,
    TargetEnv,
};

use super::tree::{Tree, stage};

/// The compiler lists files as `glsl/room/name.comp`, the way they are found from the package's root.
const PREFIX: &str = "glsl/";

/// SPIR-V bytes of `shader`; the error is the compiler's own, with file and line.
pub fn compile(tree: &Tree, shader: &str) -> Result<Vec<u8>, String> {
    let kind = match stage(shader) {
        Some("comp") => ShaderKind::Compute,
        Some("vert") => ShaderKind::Vertex,
        Some("frag") => ShaderKind::Fragment,
        Some("geom") => ShaderKind::Geometry,
        _ => return Err(format!("shader glsl/{shader}: unknown stage")),
    };
    let named = |e: shaderc::Error| match e {
        shaderc::Error::CompilationError(_, log) => format!("shader glsl/{shader}:\n{}", log.trim_end()),
        e => format!("shader glsl/{shader}: {e}"),
    };
    let compiler = Compiler::new().map_err(named)?;
    let mut options = CompileOptions::new().map_err(named)?;
    options.set_source_language(SourceLanguage::GLSL);
    options.set_target_env(TargetEnv::Vulkan, EnvVersion::Vulkan1_3 as u32);
    options.set_target_spirv(SpirvVersion::V1_5);
    options.set_optimization_level(OptimizationLevel::Zero);
    // A warning in a shader of this package is a mistake: the committed modules are made with none.
    options.set_warnings_as_errors();
    options.set_include_callback(|name, _, from, _| {
        let resolved_name = tree.resolve(from.strip_prefix(PREFIX).unwrap_or(from), name)?;
        let content = tree.read(&resolved_name)?;
        Ok(ResolvedInclude { resolved_name: format!("{PREFIX}{resolved_name}"), content })
    });
    let text = tree.read(shader)?;
    let module = compiler
        .compile_into_spirv(&text, kind, &format!("{PREFIX}{shader}"), "main", Some(&options))
        .map_err(named)?;
    Ok(module.as_binary_u8().to_vec())
}
