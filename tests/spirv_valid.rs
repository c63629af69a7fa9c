//! Checks with `spirv-val` (SPIRV-Tools) every embedded shader, the one of `glsl/README.md` and those of the example
//! engine. Skips with a message if the tool is not installed.
#![allow(missing_docs)]

use std::io::{ErrorKind, Write};
use std::process::{Command, Stdio};

/// Output of `spirv-val`, empty for a valid module; `None` if the tool is not installed.
fn validate(spirv: &[u8]) -> Option<String> {
    let child = Command::new("spirv-val")
        .args(["--target-env", "vulkan1.3", "--scalar-block-layout", "-"])
        .stdin(Stdio::piped())
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn();
    let mut child = match child {
        Err(e) if e.kind() == ErrorKind::NotFound => return None,
        child => child.unwrap(),
    };
    child.stdin.take().unwrap().write_all(spirv).unwrap();
    let output = child.wait_with_output().unwrap();
    let said = [output.stdout, output.stderr].concat();
    let said = String::from_utf8_lossy(&said).into_owned();
    assert_eq!(output.status.success(), said.is_empty(), "{}: {said}", output.status);
    Some(said)
}

#[test]
fn every_shader_is_valid() {
    let mut shaders: Vec<_> = edgeshade::shaders::all().iter().map(|s| (s.name.to_owned(), s.spirv.to_vec())).collect();
    assert!(!shaders.is_empty());
    for entry in std::fs::read_dir(concat!(env!("CARGO_MANIFEST_DIR"), "/examples/embed")).unwrap() {
        let path = entry.unwrap().path();
        if path.extension().is_some_and(|e| e == "spv") {
            shaders.push((path.display().to_string(), std::fs::read(path).unwrap()));
        }
    }
    let example = concat!(env!("CARGO_MANIFEST_DIR"), "/spv/example/foreign.comp.spv");
    shaders.push((example.into(), std::fs::read(example).unwrap()));
    let mut problems = Vec::new();
    for (name, spirv) in &shaders {
        let Some(said) = validate(spirv) else {
            eprintln!("skipped: no spirv-val; `scripts/setup.sh build-shaders` installs it");
            return;
        };
        if !said.is_empty() {
            problems.push(format!("{name}: {said}"));
        }
    }
    assert!(problems.is_empty(), "{}", problems.join("\n"));

    // The check can fail: a truncated module is rejected.
    let cut = &shaders[0].1[..shaders[0].1.len() - 4];
    assert_ne!(validate(cut).as_deref(), Some(""));
}
