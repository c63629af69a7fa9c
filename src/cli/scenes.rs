//! `edgeshade scenes`.

use super::args::JsonArgs;
use super::console::wrap;
use super::{Outcome, console, report};
use edgeshade::Result;
use edgeshade::scene::{load_bytes, shipped};
use serde_json::{Value, json};
use std::path::PathBuf;

#[derive(clap::Args)]
#[command(after_help = "Examples:
  edgeshade scenes                  list the scenes
  edgeshade render knot             render one of them
  edgeshade scenes --write assets   write their .glb files")]
pub struct Args {
    #[command(flatten)]
    json: JsonArgs,
    /// Write the .glb files of all scenes into this folder
    #[arg(long, value_name = "DIR")]
    write: Option<PathBuf>,
}

/// Runs the subcommand.
pub fn run(args: &Args) -> Outcome {
    let written = args.write.as_ref().map(shipped::write_all).transpose()?;
    if args.json.path.is_some() {
        let mut list = shipped::ALL.iter().map(entry).collect::<Result<Vec<_>>>()?;
        for (entry, path) in list.iter_mut().zip(written.iter().flatten()) {
            entry["path"] = json!(path.display().to_string());
        }
        args.json.write(&json!({ "command": report::command(), "scenes": list }))?;
    }
    if args.json.takes_stdout() {
        return Ok(());
    }
    if let Some(paths) = written {
        let lines: String = paths.iter().map(|p| format!("wrote {}\n", p.display())).collect();
        return Ok(console::print(lines)?);
    }
    let mut text = String::new();
    for scene in shipped::ALL {
        let line = format!("{:<11} {:>8} triangles  {}", scene.name, triangles(scene)?, scene.about);
        text += &wrap(&line, 32);
    }
    Ok(console::print(format_args!("{text}\nThe default is {}.\n", shipped::DEFAULT))?)
}

fn triangles(scene: &shipped::Shipped) -> Result<usize> {
    Ok(load_bytes(scene.name, scene.bytes)?.triangles())
}

fn entry(scene: &shipped::Shipped) -> Result<Value> {
    Ok(json!({
        "name": scene.name, "about": scene.about, "triangles": triangles(scene)?,
        "default": scene.name == shipped::DEFAULT,
    }))
}
