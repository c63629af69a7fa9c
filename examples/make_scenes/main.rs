//! Regenerates the scenes of Edgeshade: `cargo run --release --example make_scenes [FOLDER]`.
//!
//! The shipped ones are committed as `assets/<name>.glb`, those for judging alone as `assets/judging/<name>.glb`;
//! `assets` is the default folder. `tests/shipped_scenes.rs` fails if a committed file differs from the generated one.

mod scenes;

use std::path::{Path, PathBuf};
use std::process::ExitCode;

/// Writes scenes to a folder, which is created if missing. The error names the file.
fn write_all(folder: &Path, list: &[(&str, scenes::Stage)]) -> Result<(), String> {
    std::fs::create_dir_all(folder).map_err(|e| format!("{}: {e}", folder.display()))?;
    for (name, stage) in list {
        let path = folder.join(name).with_extension("glb");
        let bytes = scenes::encode(&stage());
        std::fs::write(&path, &bytes).map_err(|e| format!("{}: {e}", path.display()))?;
        println!("wrote {}, {} bytes", path.display(), bytes.len());
    }
    Ok(())
}

fn main() -> ExitCode {
    let mut arguments = std::env::args_os().skip(1);
    let folder = arguments.next().map_or_else(|| Path::new(env!("CARGO_MANIFEST_DIR")).join("assets"), PathBuf::from);
    if arguments.next().is_some() {
        eprintln!("usage: make_scenes [FOLDER]");
        return ExitCode::from(2);
    }
    let written = write_all(&folder, &scenes::ALL).and_then(|()| write_all(&folder.join("judging"), &scenes::JUDGING));
    match written {
        Ok(()) => ExitCode::SUCCESS,
        Err(problem) => {
            eprintln!("{problem}");
            ExitCode::FAILURE
        }
    }
}
