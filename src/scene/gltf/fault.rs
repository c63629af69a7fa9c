//! What is wrong with a file, and what was left out of it: both name the place.

use crate::Error;
use std::borrow::Cow;
use std::path::Path;

/// A problem at a place of the file; the entry point adds the file's path.
#[derive(Clone, Debug)]
pub struct Fault {
    place: String,
    problem: String,
}

/// Result of everything below the entry points.
pub type Loaded<T> = Result<T, Fault>;

/// A problem at a place, both in the words that the user will read.
pub fn fault(place: impl Into<String>, problem: impl Into<String>) -> Fault {
    Fault { place: place.into(), problem: problem.into() }
}

impl Fault {
    /// The place in the file, and what is wrong there.
    pub fn into_parts(self) -> (String, String) {
        (self.place, self.problem)
    }

    /// The public error.
    pub fn in_file(self, path: &Path) -> Error {
        Error::File { path: path.into(), place: self.place, problem: self.problem }
    }
}

/// `list[index]`, or the fault that the index is out of range.
pub fn entry<'a, T>(list: &'a [T], name: &str, index: usize, place: impl FnOnce() -> String) -> Loaded<&'a T> {
    list.get(index).ok_or_else(|| {
        let problem = match list.len() {
            0 => format!("is {index}, but the file has no {name}"),
            n => format!("is {index}, but the file has {n} {name}: 0 to {}", n - 1),
        };
        fault(place(), problem)
    })
}

/// `name[index]`, with the user's own name for it if there is one.
pub fn label(list: &str, index: usize, name: Option<&str>) -> String {
    match name {
        Some(name) if !name.is_empty() => format!("{list}[{index}] \"{name}\""),
        _ => format!("{list}[{index}]"),
    }
}

/// What was dropped or approximated, one sentence a kind: a file with a million broken triangles
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
    /// Notes `amount` cases of `what` at a place.
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

    /// Appends the notes of a later part of the file.
    pub fn append(&mut self, later: Self) {
        for w in later.0 {
            self.add(w.what, w.amount, || w.first);
        }
    }

    /// The sentences.
    pub fn into_sentences(self) -> Vec<String> {
        let sentence = |w: Warning| match w.amount {
            1 => format!("{}: {}", w.first, w.what),
            n => format!("{} and {} more: {}", w.first, n - 1, w.what),
        };
        self.0.into_iter().map(sentence).collect()
    }
}
