//! `edgeshade list`.

use super::{Outcome, console, report};
use edgeshade::table::Table;
use edgeshade::technique::{ALL, Info, Kind, find};

#[derive(clap::Args)]
#[command(after_help = "Examples:
  edgeshade list              all techniques
  edgeshade list pcf          one of them, with its parameters
  edgeshade list --json       all of them with their parameters, as JSON")]
pub struct Args {
    /// A technique to explain in detail
    #[arg(value_name = "ID")]
    technique: Option<String>,
    /// Write JSON to standard output
    #[arg(long)]
    json: bool,
}

/// Runs it.
pub fn run(args: &Args) -> Outcome {
    let one = args.technique.as_deref().map(find).transpose()?;
    if args.json {
        let json = |info: &Info| report::technique(info, kind(info));
        let text = match one {
            Some(info) => report::text(&json(info)),
            None => report::text(&ALL.iter().map(json).collect::<Vec<_>>()),
        };
        console::print(text?)?;
        return Ok(());
    }
    Ok(console::print(one.map_or_else(all, detail))?)
}

fn kind(info: &Info) -> &'static str {
    match info.kind {
        Kind::RealTime(_) => "real-time",
        Kind::Reference => "reference",
    }
}

fn all() -> String {
    let mut table = Table::new(["id", "technique", "kind", "parameters"]);
    for info in ALL {
        let names: Vec<_> = info.params.iter().map(|p| p.name).collect();
        table.row([info.id, info.title, kind(info), &names.join(" ")]);
    }
    format!("{table}\n`edgeshade list ID` explains one of them.\n")
}

fn detail(info: &Info) -> String {
    let Info { id, title, paper, summary, .. } = info;
    let mut text = format!("{id}: {title} ({paper}), {}\n{summary}\n", kind(info));
    for need in info.needs {
        text += &format!("  needs {}\n", need.text());
    }
    for p in info.params {
        let unit = if p.unit.is_empty() { String::new() } else { format!(" {}", p.unit) };
        text += &format!("\n  {}={}    {}{unit}\n      {}\n", p.name, p.show(p.default), p.range(), p.help);
    }
    text
}
