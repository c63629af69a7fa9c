//! Standard output and error. A reader that has gone away (`| head`) is not an error; a full disk is.

use super::args::JsonArgs;
use edgeshade::{Error, Result};
use std::fmt::Display;
use std::io::{self, IsTerminal as _, Write as _};
use std::path::Path;

/// Destination of a command's text for people: standard output, or standard error if JSON goes to standard output.
pub struct Console {
    to_stderr: bool,
}

impl Console {
    /// Makes the console of a command with the given `--json`.
    pub fn new(json: &JsonArgs) -> Self {
        Self { to_stderr: json.takes_stdout() }
    }

    /// Prints a line. A text that already ends in a line feed gets no second one.
    pub fn say(&self, text: impl Display) -> Result<()> {
        let text = text.to_string();
        let end = if text.ends_with('\n') { "" } else { "\n" };
        if self.to_stderr {
            // If standard error fails, nobody is left to be told.
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

/// Writes a line to standard error.
pub fn note(text: impl Display) {
    let _ = writeln!(io::stderr(), "{text}");
}

/// Writes a line to standard error that begins with the tool's name.
pub fn complain(text: impl Display) {
    note(format_args!("edgeshade: {text}"));
}

/// True if standard error is a terminal, where a progress bar makes sense.
pub fn is_terminal() -> bool {
    io::stderr().is_terminal()
}

/// Largest number of columns of a page of text.
const COLUMNS: usize = 80;

/// Breaks a text at blanks into lines of at most 80 columns. `hang` blanks precede every line but the first. A word
/// longer than a line gets a line of its own.
pub fn wrap(text: &str, hang: usize) -> String {
    let (mut page, mut column) = (String::new(), 0);
    for (i, word) in text.split(' ').enumerate() {
        let length = word.chars().count();
        if i > 0 && column + 1 + length > COLUMNS {
            page.truncate(page.trim_end_matches(' ').len());
            page += &format!("\n{:hang$}{word}", "");
            column = hang + length;
        } else {
            page += if i > 0 { " " } else { "" };
            page += word;
            column += usize::from(i > 0) + length;
        }
    }
    page + "\n"
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn text_is_broken_at_blanks() {
        assert_eq!(wrap("  a b", 4), "  a b\n");
        let words = ["word"; 40].join(" ");
        let page = wrap(&words, 3);
        assert!(page.lines().count() == 3 && page.lines().all(|l| l.chars().count() <= COLUMNS), "{page}");
        assert!(page.lines().skip(1).all(|l| l.starts_with("   w")), "{page}");
        assert_eq!(page.split_whitespace().collect::<Vec<_>>().join(" "), words);
        let long = "x".repeat(100);
        assert_eq!(wrap(&format!("a {long} b"), 2), format!("a\n  {long}\n  b\n"));
    }
}
