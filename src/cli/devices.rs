//! `edgeshade devices`.

use super::args::JsonArgs;
use super::console::wrap;
use super::{Outcome, console, report};
use edgeshade::host::{self, DeviceInfo};
use serde_json::json;

#[derive(clap::Args)]
#[command(after_help = "Examples:
  edgeshade devices --json
  edgeshade render --device 1        takes the device with that number;
                                     a part of its name does, too")]
pub struct Args {
    #[command(flatten)]
    json: JsonArgs,
}

/// Runs the subcommand.
pub fn run(args: &Args) -> Outcome {
    let devices = host::devices()?;
    args.json.write(&json!({ "command": report::command(), "devices": devices }))?;
    if args.json.takes_stdout() {
        return Ok(());
    }
    if devices.is_empty() {
        return Ok(console::print("No Vulkan device was found.\n")?);
    }
    let device = |(i, d): (usize, &DeviceInfo)| {
        let fit =
            if d.missing.is_empty() { "usable".into() } else { format!("unusable, lacks {}", d.missing.join(", ")) };
        let about = format!("   {}, driver {}, Vulkan {}: {fit}", d.kind, d.driver, d.vulkan);
        wrap(&format!("{i}: {}", d.name), 3) + &wrap(&about, 3)
    };
    Ok(console::print(devices.iter().enumerate().map(device).collect::<String>())?)
}
