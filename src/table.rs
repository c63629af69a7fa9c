//! Plain-text tables for the terminal.

use std::fmt;

/// Placeholder for a value that does not exist.
const NONE: &str = "-";

/// A table of aligned columns. Columns that hold only numbers are aligned to the right.
///
/// A number may be followed by a unit or a percent sign. A cell counts as a number if it starts with a digit, or with
/// a sign or decimal point and a digit.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Table {
    headers: Vec<String>,
    rows: Vec<Vec<String>>,
}

impl Table {
    /// An empty table with these column headers.
    pub fn new<S: AsRef<str>>(headers: impl IntoIterator<Item = S>) -> Self {
        Self { headers: headers.into_iter().map(|h| clean(h.as_ref())).collect(), rows: Vec::new() }
    }

    /// Appends a row. Missing cells stay blank; cells beyond the headers form columns without a header.
    pub fn row<S: AsRef<str>>(&mut self, cells: impl IntoIterator<Item = S>) -> &mut Self {
        self.rows.push(cells.into_iter().map(|c| clean(c.as_ref())).collect());
        self
    }
}

impl Table {
    /// The table in Markdown. Cells are shown as they are, without markup.
    pub fn markdown(&self) -> String {
        let line = |row: &[String]| {
            let cells: Vec<_> = row.iter().map(|cell| escape_markdown(cell)).collect();
            format!("| {} |\n", cells.join(" | "))
        };
        let rule: String = self.right().into_iter().map(|r| if r { "--:|" } else { "---|" }).collect();
        let rows: String = self.rows.iter().map(|row| line(row)).collect();
        format!("{}|{rule}\n{rows}", line(&self.headers))
    }

    /// Number of columns.
    fn columns(&self) -> usize {
        self.rows.iter().map(Vec::len).chain([self.headers.len()]).max().unwrap_or(0)
    }

    /// Returns, for each column, whether it holds only numbers.
    fn right(&self) -> Vec<bool> {
        let cells = |c| self.rows.iter().map(move |r| cell(r, c)).filter(|v| !v.is_empty() && *v != NONE);
        (0..self.columns()).map(|c| cells(c).next().is_some() && cells(c).all(is_number)).collect()
    }
}

/// The cell of a row in a column; empty if the row is shorter.
fn cell(row: &[String], column: usize) -> &str {
    row.get(column).map_or("", String::as_str)
}

/// Escapes what Markdown would take for markup, and turns control characters into blanks.
pub fn escape_markdown(text: &str) -> String {
    let mut escaped = String::with_capacity(text.len());
    for c in clean(text).chars() {
        if r"\`*_[]<>|&#~$".contains(c) {
            escaped.push('\\');
        }
        escaped.push(c);
    }
    escaped
}

/// A number with `digits` decimal places; `-` if there is none or it is not finite.
pub fn number(value: impl Into<Option<f64>>, digits: usize) -> String {
    let Some(v) = value.into().filter(|v| v.is_finite()) else { return NONE.to_owned() };
    let text = format!("{v:.digits$}");
    // A value that rounds to zero has no sign.
    if text.starts_with('-') && !text.bytes().any(|b| (b'1'..=b'9').contains(&b)) {
        return text[1..].to_owned();
    }
    text
}

/// Turns a cell into a single line without surrounding blanks.
fn clean(cell: &str) -> String {
    cell.trim().chars().map(|c| if c.is_control() { ' ' } else { c }).collect()
}

fn is_number(cell: &str) -> bool {
    let unsigned = cell.trim_start_matches(['+', '-', '\u{2212}']);
    let digits = unsigned.strip_prefix('.').unwrap_or(unsigned);
    cell.len() - unsigned.len() <= 3 && digits.starts_with(|c: char| c.is_ascii_digit())
}

impl fmt::Display for Table {
    /// Writes the headers, a rule and the rows. Every line ends in a line feed, and none in blanks.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let columns = self.columns();
        let widths: Vec<usize> = (0..columns)
            .map(|c| self.rows.iter().chain([&self.headers]).map(|r| cell(r, c).chars().count()).max().unwrap_or(0))
            .collect();
        let right = self.right();
        let mut line = |row: &[String]| {
            let mut text = String::new();
            for c in 0..columns {
                let (value, width) = (cell(row, c), widths[c]);
                let gap = if c == 0 { "" } else { "  " };
                text += &if right[c] { format!("{gap}{value:>width$}") } else { format!("{gap}{value:<width$}") };
            }
            writeln!(f, "{}", text.trim_end())
        };
        line(&self.headers)?;
        let rule: Vec<String> = widths.iter().map(|&w| "─".repeat(w)).collect();
        line(&rule)?;
        self.rows.iter().try_for_each(|row| line(row))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_are_right_aligned_and_text_left() {
        let mut t = Table::new(["technique", "rmse", "gpu ms", "note"]);
        t.row(["sm", "0.12345", "1.5", "3 taps"]).row(["pcf", "-", "10.25", "böse\n"]).row(["rbsm-long"]);
        let expected = "\
technique     rmse  gpu ms  note
─────────  ───────  ──────  ──────
sm         0.12345     1.5  3 taps
pcf              -   10.25  böse
rbsm-long
";
        assert_eq!(t.to_string(), expected);
    }

    #[test]
    fn markdown_shows_cells_without_markup() {
        let mut t = Table::new(["name", "rmse"]);
        t.row(["a|b *c* <i>\n", "-"]).row(["d", "0.5"]);
        assert_eq!(t.markdown(), "| name | rmse |\n|---|--:|\n| a\\|b \\*c\\* \\<i\\> | - |\n| d | 0.5 |\n");
    }

    #[test]
    fn odd_tables_are_printed_too() {
        assert_eq!(Table::new::<&str>([]).to_string(), "\n\n");
        let mut t = Table::new(["a"]);
        t.row(["1", "two"]).row(Vec::<String>::new());
        assert_eq!(t.to_string(), "a\n─  ───\n1  two\n\n");
    }

    #[test]
    fn figures_have_their_digits() {
        assert_eq!(number(0.12345, 3), "0.123");
        assert_eq!(number(-0.0001, 3), "0.000");
        assert_eq!(number(-0.001, 3), "-0.001");
        assert_eq!([number(None, 3), number(f64::NAN, 1), number(Some(f64::INFINITY), 1)], ["-"; 3]);
    }
}
