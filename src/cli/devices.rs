//! `edgeshade devices`.

use super::{Outcome, console, report};
use edgeshade::host;
use edgeshade::table::Table;

#[derive(clap::Args)]
#[command(after_help = "Examples:
  edgeshade devices --json
  edgeshade render --device 1        takes the device with that number;
                                     a part of its name does, too")]
pub struct Args {
    /// Write JSON to standard output
    #[arg(long)]
    json: bool,
}

/// Runs it.
pub fn run(args: &Args) -> Outcome {
    let devices = host::devices()?;
    if args.json {
        return Ok(console::print(report::text(&devices)?)?);
    }
    if devices.is_empty() {
        return Ok(console::print("No Vulkan device was found.\n")?);
    }
    let mut table = Table::new(["", "device", "kind", "driver", "vulkan", "fit"]);
    for (i, d) in devices.iter().enumerate() {
        let fit = if d.missing.is_empty() { "yes".into() } else { format!("no, lacks {}", d.missing.join(", ")) };
        table.row([&i.to_string(), &d.name, d.kind, &d.driver, &d.vulkan, &fit]);
    }
    Ok(console::print(table)?)
}
