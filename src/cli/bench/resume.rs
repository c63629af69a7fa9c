//! Rows of the scenes that an interrupted run has finished, kept in a file beside the results.

use super::record::{Field, Record, Row};
use crate::cli::console;
use crate::cli::report;
use edgeshade::Result;
use serde_json::{Value, json};
use std::borrow::Cow;
use std::path::PathBuf;

/// The file of a run, and what distinguishes the run from others.
pub struct Unfinished {
    path: PathBuf,
    key: Value,
    /// Scenes that are finished, with their rows.
    scenes: Vec<(String, Vec<Row>)>,
}

impl Unfinished {
    /// Opens the file. Rows of a run with another key are not used.
    pub fn open(path: PathBuf, key: Value) -> Self {
        let text = std::fs::read(&path).unwrap_or_default();
        let found: Value = serde_json::from_slice(&text).unwrap_or_default();
        let scenes = match found["key"] == key {
            true => found["scenes"].as_array().map(|all| all.iter().filter_map(scene).collect()).unwrap_or_default(),
            false => vec![],
        };
        let this = Self { path, key, scenes };
        if !this.scenes.is_empty() {
            let names: Vec<_> = this.scenes.iter().map(|s| s.0.as_str()).collect();
            let path = this.path.display();
            console::note(format_args!("goes on after {}, as {path} says; delete it to begin anew", names.join(", ")));
        }
        this
    }

    /// Rows of a scene that an earlier run has finished.
    pub fn rows(&self, scene: &str) -> Option<Vec<Row>> {
        self.scenes.iter().find(|s| s.0 == scene).map(|s| s.1.clone())
    }

    /// Adds a finished scene to the file.
    pub fn add(&mut self, scene: &str, rows: &[Row]) -> Result<()> {
        self.scenes.push((scene.to_owned(), rows.to_vec()));
        let scene = |(name, rows): &(String, Vec<Row>)| json!({ "scene": name, "rows": rows.iter().map(stored).collect::<Vec<_>>() });
        let scenes: Vec<_> = self.scenes.iter().map(scene).collect();
        report::write(&self.path, &json!({ "key": self.key, "scenes": scenes }))
    }

    /// Removes the file of a run that is complete.
    pub fn finish(self) {
        // There is none if no scene was finished.
        let _ = std::fs::remove_file(self.path);
    }
}

fn stored(row: &Row) -> Value {
    json!({ "label": row.label, "group": row.group, "fields": row.fields, "shown": row.shown })
}

fn scene(value: &Value) -> Option<(String, Vec<Row>)> {
    let rows = value["rows"].as_array()?.iter().map(row).collect::<Option<_>>()?;
    Some((value["scene"].as_str()?.to_owned(), rows))
}

fn row(value: &Value) -> Option<Row> {
    let text = |name: &str| value[name].as_str();
    Some(Row { shown: record(&value["shown"])?, ..Row::new(text("label")?, text("group")?, record(&value["fields"])?) })
}

fn record(value: &Value) -> Option<Record> {
    let fields = value.as_object()?.iter();
    Some(Record(fields.map(|(name, value)| (Cow::Owned(name.clone()), field(name, value))).collect()))
}

/// Parameters of techniques are a value; all other objects are records.
fn field(name: &str, value: &Value) -> Field {
    match record(value).filter(|_| name != "params") {
        Some(record) => Field::Record(record),
        None => Field::Value(value.clone()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rows_come_back_as_they_were_unless_the_run_is_another() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.unfinished.json");
        let inner = Record::of([("mean", 0.5.into()), ("max", Value::Null.into())]);
        let fields = Record::of([
            ("scene", "a".into()),
            ("params", json!({ "width": 3 }).into()),
            ("rmse", 0.123_456_789_012_345_67.into()),
            ("boundary", inner.into()),
        ]);
        let rows = vec![Row::new("pcf width=3", "a, hard", fields).and_shown([("mib", 2.5.into())])];
        let mut first = Unfinished::open(path.clone(), json!({ "frames": 3 }));
        assert_eq!(first.rows("a"), None);
        first.add("a", &rows).unwrap();
        let second = Unfinished::open(path.clone(), json!({ "frames": 3 }));
        assert_eq!((second.rows("a"), second.rows("b")), (Some(rows), None));
        assert_eq!(Unfinished::open(path.clone(), json!({ "frames": 4 })).rows("a"), None);
        second.finish();
        assert!(!path.exists());
        std::fs::write(&path, "{ \"key\"").unwrap();
        assert_eq!(Unfinished::open(path, json!({ "frames": 3 })).rows("a"), None);
    }
}
