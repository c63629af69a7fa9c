//! Standard output and error. A reader that has gone away (`| head`) is no fault; a full disk is.

use edgeshade::{Error, Result};
use std::fmt::Display;
use std::io::{self, IsTerminal as _, Write as _};
use std::path::Path;

/// Where a command's text for people goes: to standard output, unless JSON goes there.
pub struct Console {
    to_stderr: bool,
}

impl Console {
    /// `json` is the argument of `--json`.
    pub fn new(json: Option<&Path>) -> Self {
        Self { to_stderr: json.is_some_and(is_stdout) }
    }

    /// Prints a line, or what already ends in one.
    pub fn say(&self, text: impl Display) -> Result<()> {
        let text = text.to_string();
        let end = if text.ends_with('\n') { "" } else { "\n" };
        if self.to_stderr {
            // Nobody is left to tell.
            let _ = write!(io::stderr(), "{text}{end}");
            return Ok(());
        }
        print(format_args!("{text}{end}"))
    }
}

/// True for `-`.
pub fn is_stdout(path: &Path) -> bool {
    path.as_os_str() == "-"
}

/// Writes to standard output.
pub fn print(text: impl Display) -> Result<()> {
    let mut out = io::stdout().lock();
    match write!(out, "{text}").and_then(|()| out.flush()) {
        Err(e) if e.kind() != io::ErrorKind::BrokenPipe => Err(Error::Io { path: "standard output".into(), source: e }),
        _ => Ok(()),
    }
}

/// A line on standard error.
pub fn note(text: impl Display) {
    let _ = writeln!(io::stderr(), "{text}");
}

/// A line on standard error that is signed by the tool.
pub fn complain(text: impl Display) {
    note(format_args!("edgeshade: {text}"));
}

/// True where a progress bar makes sense.
pub fn is_terminal() -> bool {
    io::stderr().is_terminal()
}
