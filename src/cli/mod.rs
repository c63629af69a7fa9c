//! The command line: one file for each subcommand, and the parts that they share.

mod args;
mod bench;
mod compare;
mod console;
mod devices;
mod edt;
mod explain;
mod html;
mod list;
mod pipelines;
mod progress;
mod render;
mod report;
mod scenes;
mod stage;
mod stats;
mod techniques;
mod truth;
mod view;

use clap::{Parser, Subcommand};
use edgeshade::{Error, host::Host};
use std::process::ExitCode;
use std::time::Instant;

#[derive(Parser)]
#[command(
    name = "edgeshade",
    version,
    about = "Real-time shadows on Vulkan: render them, measure them against ray-traced truth, time every pass",
    after_help = "Examples:
  edgeshade render                   the default scene to shadow.png, and the
                                     time of every pass
  edgeshade render fence -t sm -o fence.png
  edgeshade compare jenga -t sm,pcf -o out
                                     error figures and a contact sheet in out/
  edgeshade list pcf                 parameters of a technique

For help on a subcommand: edgeshade render --help.
Content and units of JSON files: docs/json.md in the source package.
Exit status: 0 success, 1 failure, 2 wrong usage."
)]
struct Cli {
    #[command(subcommand)]
    command: Command,
}

#[derive(Subcommand)]
enum Command {
    /// Render a scene to a picture and print the GPU time of every pass
    Render(Box<render::Args>),
    /// Compare techniques with the truth: figures, a contact sheet, JSON
    Compare(Box<compare::Args>),
    /// Measure suites of variants, interleaved in one run
    Bench(bench::Args),
    /// Compute the exact Euclidean distance transform of a mask, with the nearest seed of every pixel
    Edt(Box<edt::Args>),
    /// List the techniques and their parameters
    List(list::Args),
    /// List the Vulkan devices
    Devices(devices::Args),
    /// List the pipelines of techniques with their compiler's statistics; submits nothing to the device
    Pipelines(Box<pipelines::Args>),
    /// List the scenes that come with Edgeshade, or write their files
    Scenes(scenes::Args),
}

/// Reason why a run ended without success.
enum Failure {
    Error(Error),
    /// The validation layer has reported faults; its messages are already printed.
    Validation(usize),
    /// Pipelines that are worse than the table or over the budget; they are already printed.
    Pipelines(usize),
}

impl From<Error> for Failure {
    fn from(error: Error) -> Self {
        Self::Error(error)
    }
}

impl Failure {
    fn exit_code(&self) -> u8 {
        match self {
            Self::Error(Error::Parameter(_) | Error::Usage(_)) => 2,
            _ => 1,
        }
    }
}

type Outcome = Result<(), Failure>;

/// Runs the tool.
pub fn main() -> ExitCode {
    let started = Instant::now();
    provide_runtime_folder();
    let cli = Cli::try_parse().unwrap_or_else(|e| e.exit());
    let outcome = match cli.command {
        Command::Render(args) => render::run(&args, started),
        Command::Compare(args) => compare::run(&args),
        Command::Bench(args) => bench::run(&args),
        Command::Edt(args) => edt::run(&args),
        Command::List(args) => list::run(&args),
        Command::Devices(args) => devices::run(&args),
        Command::Pipelines(args) => pipelines::run(&args),
        Command::Scenes(args) => scenes::run(&args),
    };
    let Err(failure) = outcome else { return ExitCode::SUCCESS };
    match &failure {
        Failure::Error(error) => console::complain(error),
        Failure::Pipelines(n) => console::complain(format_args!(
            "faults of pipelines: {n}. Mend them; or, if they are right, write the figures with --write, name by hand what stays \
             over the budget, and say in the commit why"
        )),
        Failure::Validation(1) => console::complain("the validation layer has reported a fault"),
        Failure::Validation(n) => console::complain(format_args!("the validation layer has reported {n} faults")),
    }
    ExitCode::from(failure.exit_code())
}

/// Sets `XDG_RUNTIME_DIR` if it is missing. Mesa's drivers complain about that on every start, though nothing here
/// needs it.
fn provide_runtime_folder() {
    if cfg!(target_os = "linux") && std::env::var_os("XDG_RUNTIME_DIR").is_none() {
        // SAFETY: this is the first statement of `main`, so no other thread runs yet.
        unsafe { std::env::set_var("XDG_RUNTIME_DIR", std::env::temp_dir()) };
    }
}

/// Closes the device and prints the messages of the validation layer, including those from destroying the last
/// object.
fn close(host: Host) -> Outcome {
    let messages = host.messages().clone();
    drop(host);
    let messages = messages.all();
    for message in &messages {
        console::note(message);
    }
    if messages.is_empty() { Ok(()) } else { Err(Failure::Validation(messages.len())) }
}
