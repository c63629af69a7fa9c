//! Checks that docs/json.md describes everything that the tool writes as JSON.

use serde_json::Value;
use std::collections::BTreeSet;

/// Objects whose field names are not fixed: parameters of techniques, counts of passes, classes of shapes, specialization
/// constants, what a driver reports about a pipeline, hashes of scenes.
const NAMES_OF_THEIR_OWN: [&str; 6] = ["scene_hashes", "params", "counts", "classes", "constants", "reported"];

/// Panics unless the page describes every field that the subcommand has written, either in the subcommand's section
/// or in one of the sections for shared objects.
pub fn check(subcommand: &str, written: &Value) {
    let page = std::fs::read_to_string(concat!(env!("CARGO_MANIFEST_DIR"), "/docs/json.md")).unwrap();
    let sections = page.split("\n## ").skip(1);
    let mut described = BTreeSet::new();
    let mut is_described = false;
    for section in sections {
        let title = section.lines().next().unwrap_or_default();
        is_described |= title == format!("`{subcommand}`");
        if title == format!("`{subcommand}`") || !title.starts_with('`') {
            let rows = section.lines().filter_map(|line| line.strip_prefix("| `")?.split('`').next());
            described.extend(rows);
        }
    }
    assert!(is_described, "docs/json.md has no section `{subcommand}`");
    let mut found = BTreeSet::new();
    collect(written, &mut found);
    let missing: Vec<_> = found.iter().filter(|name| !described.contains(name.as_str())).collect();
    assert!(missing.is_empty(), "docs/json.md, `{subcommand}`: does not describe {missing:?}");
}

fn collect(value: &Value, found: &mut BTreeSet<String>) {
    match value {
        Value::Array(items) => items.iter().for_each(|item| collect(item, found)),
        Value::Object(fields) => {
            for (name, value) in fields {
                found.insert(name.clone());
                // `list` writes a technique's parameters as an array of objects, whose fields are described.
                if value.is_array() || !NAMES_OF_THEIR_OWN.contains(&name.as_str()) {
                    collect(value, found);
                }
            }
        }
        _ => {}
    }
}
