//! The command-line tool; see `edgeshade --help`.
// Tests may unwrap; nothing else may.
#![cfg_attr(not(test), warn(clippy::unwrap_used))]

mod cli;

fn main() -> std::process::ExitCode {
    cli::main()
}
