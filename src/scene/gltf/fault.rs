//! Faults of a file, and warnings about what was left out; both name the place.

use crate::Error;
use std::borrow::Cow;
use std::path::Path;

/// Problem at a place of the file; the entry point adds the file's path.
#[derive(Clone, Debug)]
pub struct Fault {
    place: String,
    problem: String,
}

/// Result type of everything below the entry points.
pub type Loaded<T> = Result<T, Fault>;

/// Returns a fault; place and problem are in the words that the user will read.
pub fn fault(place: impl Into<String>, problem: impl Into<String>) -> Fault {
    Fault { place: place.into(), problem: problem.into() }
}

impl Fault {
    /// Returns the place in the file and the problem there.
    pub fn into_parts(self) -> (String, String) {
        (self.place, self.problem)
    }

    /// Returns the public error.
    pub fn in_file(self, path: &Path) -> Error {
        Error::File { path: path.into(), place: self.place, problem: self.problem }
    }
}

/// Returns `list[index]`, or a fault if the index is out of range.
pub fn entry<'a, T>(list: &'a [T], name: &str, index: usize, place: impl FnOnce() -> String) -> Loaded<&'a T> {
    list.get(index).ok_or_else(|| {
        let problem = match list.len() {
            0 => format!("is {index}, but the file has no {name}"),
            n => format!("is {index}, but the file has {n} {name}: 0 to {}", n - 1),
        };
        fault(place(), problem)
    })
}

/// Returns `name[index]`, with the object's own name if there is one.
pub fn label(list: &str, index: usize, name: Option<&str>) -> String {
    match name {
        Some(name) if !name.is_empty() => format!("{list}[{index}] \"{name}\""),
        _ => format!("{list}[{index}]"),
    }
}

/// Warnings about what was dropped or approximated, one sentence per kind: a file with a million broken triangles
/// gives one line.
#[derive(Debug, Default)]
pub struct Warnings(Vec<Warning>);

#[derive(Debug)]
struct Warning {
    what: Cow<'static, str>,
    amount: usize,
    first: String,
}

impl Warnings {
    /// Adds `amount` cases of `what` at a place.
    pub fn add(&mut self, what: impl Into<Cow<'static, str>>, amount: usize, place: impl FnOnce() -> String) {
        if amount == 0 {
            return;
        }
        let what = what.into();
        match self.0.iter_mut().find(|w| w.what == what) {
            Some(w) => w.amount += amount,
            None => self.0.push(Warning { what, amount, first: place() }),
        }
    }

    /// Appends the warnings of a later part of the file.
    pub fn append(&mut self, later: Self) {
        for w in later.0 {
            self.add(w.what, w.amount, || w.first);
        }
    }

    /// Returns the warnings as sentences.
    pub fn into_sentences(self) -> Vec<String> {
        let sentence = |w: Warning| match w.amount {
            1 => format!("{}: {}", w.first, w.what),
            n => format!("{} and {} more: {}", w.first, n - 1, w.what),
        };
        self.0.into_iter().map(sentence).collect()
    }
}
