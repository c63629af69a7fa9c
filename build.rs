//! Embeds the compiled shaders: the committed ones in `spv/` where they fit the sources under `glsl/`, freshly
//! compiled ones otherwise.

use std::path::{Path, PathBuf};
use std::{env, fs};

#[cfg(feature = "shaderc")]
#[path = "build/compile.rs"]
mod compile;
#[path = "build/spv.rs"]
mod spv;
#[path = "build/tree.rs"]
mod tree;

fn main() {
    println!("cargo::rerun-if-env-changed=EDGESHADE_SPV");
    for path in ["build.rs", "build", "glsl", "spv"] {
        // Cargo would take a missing path for a changed one in every build.
        if Path::new(path).exists() {
            println!("cargo::rerun-if-changed={path}");
        }
    }
    if let Err(problems) = build() {
        // Cargo fails the build because of these lines; a failing exit status would add a dump of all the script's
        // output.
        for line in problems.lines() {
            println!("cargo::error={line}");
        }
    }
}

fn build() -> Result<(), String> {
    let package = folder("CARGO_MANIFEST_DIR")?;
    let out = folder("OUT_DIR")?;
    let mode = spv::Mode::parse(env::var("EDGESHADE_SPV").ok().as_deref())?;
    #[cfg(feature = "shaderc")]
    let compile: Option<spv::Compile> = Some(&compile::compile);
    #[cfg(not(feature = "shaderc"))]
    let compile: Option<spv::Compile> = None;
    let plan = spv::run(mode, &spv::Folders { package: &package, out: &out }, compile)?;
    for warning in &plan.warnings {
        println!("cargo::warning={warning}");
    }
    let table = out.join("shaders.rs");
    fs::write(&table, spv::table(&plan)).map_err(|e| format!("{}: {e}", table.display()))
}

fn folder(variable: &str) -> Result<PathBuf, String> {
    env::var_os(variable).map(PathBuf::from).ok_or_else(|| format!("{variable} is not set: run this through Cargo"))
}
