//! Rows of named figures in the order in which they are written, with means and tables of them.

use super::judge::Variant;
use crate::cli::stats::PassStats;
use edgeshade::table::number;
use serde::{Serialize, Serializer};
use serde_json::Value;
use std::borrow::Cow;

/// Name of a field: known beforehand, or read from a file.
pub type Name = Cow<'static, str>;

/// Named fields in the order in which they are written.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Record(pub Vec<(Name, Field)>);

/// A value, or an object or list whose fields keep their order.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[serde(untagged)]
pub enum Field {
    Value(Value),
    Record(Record),
    Passes(Vec<PassStats>),
    Rows(Vec<Row>),
}

impl<T: Into<Value>> From<T> for Field {
    fn from(value: T) -> Self {
        Self::Value(value.into())
    }
}

impl From<Record> for Field {
    fn from(record: Record) -> Self {
        Self::Record(record)
    }
}

impl Serialize for Record {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.collect_map(self.0.iter().map(|(name, field)| (name, field)))
    }
}

impl Record {
    pub fn of<const N: usize>(fields: [(&'static str, Field); N]) -> Self {
        Self::default().and(fields)
    }

    /// Appends fields.
    pub fn and<N: Into<Name>>(mut self, more: impl IntoIterator<Item = (N, Field)>) -> Self {
        self.0.extend(more.into_iter().map(|(name, field)| (name.into(), field)));
        self
    }

    /// Replaces the fields that `other` has too.
    pub fn replace(&mut self, other: Self) {
        for (name, field) in other.0 {
            if let Some(mine) = self.0.iter_mut().find(|f| f.0 == name) {
                mine.1 = field;
            }
        }
    }

    /// Copies the fields of these names.
    pub fn only(&self, names: &[&str]) -> Self {
        Self(self.0.iter().filter(|f| names.contains(&&*f.0)).cloned().collect())
    }

    /// The field with this name, or with a path such as `boundary.mean`; null if there is none.
    pub fn get(&self, path: &str) -> &Field {
        static NULL: Field = Field::Value(Value::Null);
        let (name, rest) = path.split_once('.').unwrap_or((path, ""));
        match self.0.iter().find(|f| f.0 == name) {
            Some((_, Field::Record(record))) if !rest.is_empty() => record.get(rest),
            found => found.map_or(&NULL, |f| &f.1),
        }
    }

    pub fn number(&self, name: &str) -> Option<f64> {
        if let Field::Value(value) = self.get(name) { value.as_f64() } else { None }
    }

    /// The text in a field; empty if the field holds something else.
    pub fn text(&self, name: &str) -> &str {
        if let Field::Value(Value::String(text)) = self.get(name) { text } else { "" }
    }
}

/// Figures of one variant in one place, a mean over such rows, or a conclusion from them.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Row {
    /// Name of the variant.
    #[serde(skip)]
    pub label: String,
    /// Name of the group; rows of one group are compared with each other.
    #[serde(skip)]
    pub group: String,
    #[serde(flatten)]
    pub fields: Record,
    /// Fields that only tables show; they hide fields of the same name in the JSON.
    #[serde(skip)]
    pub shown: Record,
}

impl Row {
    pub fn new(label: &str, group: &str, fields: Record) -> Self {
        Self { label: label.to_owned(), group: group.to_owned(), fields, shown: Record::default() }
    }

    /// A row with technique and settings between `place` and `figures`.
    pub fn of<const N: usize>(
        place: [(&'static str, Field); N],
        variant: &Variant,
        group: &str,
        figures: Record,
    ) -> Self {
        Self::new(&variant.label, group, Record::of(place).and(variant.fields()).and(figures.0))
    }

    pub fn and_shown<const N: usize>(self, shown: [(&'static str, Field); N]) -> Self {
        Self { shown: self.shown.and(shown), ..self }
    }

    pub fn number(&self, name: &str) -> Option<f64> {
        self.shown.number(name).or_else(|| self.fields.number(name))
    }

    /// The text in a field; empty if the field holds something else.
    pub fn text(&self, name: &str) -> &str {
        match self.shown.text(name) {
            _ if name == "label" => &self.label,
            "" => self.fields.text(name),
            text => text,
        }
    }
}

/// Rows of the same group, one group after another.
pub fn groups(rows: &[Row]) -> impl Iterator<Item = &[Row]> {
    rows.chunk_by(|a, b| a.group == b.group)
}

/// Rows of the same scene, one scene after another.
pub fn by_scene(rows: &[Row]) -> impl Iterator<Item = &[Row]> {
    rows.chunk_by(|a, b| a.text("scene") == b.text("scene"))
}

/// Completes every key with the mean of each column over the rows that have its label and its fields, where null
/// stands for any value. `count` returns the fields that say how many rows there are.
pub fn means(rows: &[Row], keys: Vec<Row>, columns: &[Column], count: impl Fn(&[&Row]) -> Record) -> Vec<Row> {
    let one = |key: Row| {
        let is_any = |field: &Field| *field == Field::Value(Value::Null);
        let is_here = |r: &&Row| key.fields.0.iter().all(|(name, field)| is_any(field) || r.fields.get(name) == field);
        let mine: Vec<_> = rows.iter().filter(|r| r.label == key.label).filter(is_here).collect();
        let figure = |c: &Column| (c.1, mean(mine.iter().map(|r| r.number(c.1))).into());
        Row { fields: key.fields.clone().and(count(&mine).0).and(columns.iter().map(figure)), ..key }
    };
    keys.into_iter().map(one).collect()
}

/// Mean of the values that exist; `None` if there are none.
fn mean(values: impl IntoIterator<Item = Option<f64>>) -> Option<f64> {
    let (mut sum, mut count) = (0.0, 0);
    for v in values.into_iter().flatten() {
        sum += v;
        count += 1;
    }
    (count > 0).then(|| sum / f64::from(count))
}

/// A column of a table: its head, the name of its figures, and their number of decimal places. The head of a text
/// column begins with `<`. Values under a head that ends in `%` are shares.
pub type Column = (&'static str, &'static str, usize);

/// A table with one line for each row.
pub fn table<'r>(columns: &[Column], rows: impl IntoIterator<Item = &'r Row>) -> String {
    let heads: Vec<_> = columns.iter().map(|c| c.0).collect();
    let cell = |row: &Row, &(head, name, digits): &Column| match row.text(name) {
        "" => number(row.number(name).map(|v| if head.ends_with('%') { 100.0 * v } else { v }), digits),
        text => text.to_owned(),
    };
    plain_table(&heads.join(" | "), rows.into_iter().map(|r| columns.iter().map(|c| cell(r, c)).collect()))
}

/// A section with a table for every scene.
pub fn tables_by_scene(columns: &[Column], rows: &[Row]) -> String {
    by_scene(rows).map(|rows| format!("\n## {}\n\n{}", rows[0].text("scene"), table(columns, rows))).collect()
}

/// A table of cells; the heads are separated by ` | `.
pub fn plain_table(heads: &str, rows: impl IntoIterator<Item = Vec<String>>) -> String {
    let rules = heads.split(" | ").map(|head| if head.starts_with('<') { "---|" } else { "--:|" });
    let mut text = format!("| {} |\n|{}\n", heads.replace('<', ""), rules.collect::<String>());
    rows.into_iter().for_each(|cells| text += &format!("| {} |\n", cells.join(" | ")));
    text
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn means_leave_out_what_is_not_there() {
        assert_eq!(mean([Some(1.0), None, Some(2.0)]), Some(1.5));
        assert_eq!(mean([None]), None);
    }
}
