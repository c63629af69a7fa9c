//! The command-line tool; see `edgeshade --help`.

mod cli;

fn main() -> std::process::ExitCode {
    cli::main()
}
