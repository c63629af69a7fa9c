//! `edgeshade list`.

use super::args::JsonArgs;
use super::console::wrap;
use super::{Outcome, console, report};
use edgeshade::table::Table;
use edgeshade::technique::{ALL, Info, Kind, find};
use serde_json::json;

#[derive(clap::Args)]
#[command(after_help = "Examples:
  edgeshade list              all techniques
  edgeshade list pcf          one of them, with its parameters
  edgeshade list --json       all of them with their parameters, as JSON")]
pub struct Args {
    /// The technique to explain in detail
    #[arg(value_name = "ID")]
    technique: Option<String>,
    #[command(flatten)]
    json: JsonArgs,
}

/// Runs the subcommand.
pub fn run(args: &Args) -> Outcome {
    let one = args.technique.as_deref().map(find).transpose()?;
    let json = |info: &Info| report::technique(info, kind(info));
    let mut found = match one {
        Some(info) => json(info),
        None => json!({ "techniques": ALL.iter().map(json).collect::<Vec<_>>() }),
    };
    found["command"] = json!(report::command());
    args.json.write(&found)?;
    if args.json.takes_stdout() {
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
    let table = |wanted: &str| {
        let mut table = Table::new(["id", wanted]);
        for info in ALL.iter().filter(|info| kind(info) == wanted) {
            table.row([info.id, info.title]);
        }
        table
    };
    format!(
        "{}\n{}\nReferences are made from the scene itself, for comparison.\n\
         `edgeshade list ID` explains a technique and its parameters.\n",
        table("real-time"),
        table("reference")
    )
}

fn detail(info: &Info) -> String {
    let Info { id, title, paper, summary, .. } = info;
    let mut text = wrap(&format!("{id}: {title} ({paper}), {}", kind(info)), 2) + &wrap(summary, 0);
    for need in info.needs {
        text += &wrap(&format!("  needs {}", need.text()), 4);
    }
    if !info.published.is_empty() {
        let settings: Vec<_> = info.published.iter().map(|(name, value)| format!("{name}={value}")).collect();
        text += &wrap(&format!("  preset=published    {}", settings.join(" ")), 6);
    }
    for p in info.params {
        let unit = if p.unit.is_empty() { String::new() } else { format!(" {}", p.unit) };
        // Blanks around the bar allow a line break between two words.
        let range = p.range().replace('|', " | ");
        text += "\n";
        text += &wrap(&format!("  {}={}    {range}{unit}", p.name, p.show(p.default)), 6);
        text += &wrap(&format!("      {}", p.help), 6);
    }
    text
}
