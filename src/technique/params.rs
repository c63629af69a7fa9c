//! Parameter tables: one source for the command line, the viewer, the documentation and the shaders.

use super::Info;
use crate::error::unknown;
use crate::{Error, Result};

/// One row of a technique's parameter table.
#[derive(Clone, Copy, Debug)]
pub struct Param {
    /// Name on the command line.
    pub name: &'static str,
    /// Type and range.
    pub kind: ParamKind,
    /// Value when the user says nothing; for a choice its index, for a switch 0 or 1.
    pub default: f64,
    /// Unit, in words.
    pub unit: &'static str,
    /// One line of help.
    pub help: &'static str,
}

/// Type and range of a parameter.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum ParamKind {
    /// A number within bounds, ends included.
    Float {
        /// Smallest.
        min: f64,
        /// Largest.
        max: f64,
    },
    /// A whole number within bounds, ends included.
    Int {
        /// Smallest.
        min: i64,
        /// Largest.
        max: i64,
        /// Odd numbers only.
        odd: bool,
    },
    /// One of several words.
    Choice(&'static [&'static str]),
    /// `on` or `off`.
    Switch,
}

impl Param {
    /// A number.
    pub const fn float(
        name: &'static str,
        min: f64,
        max: f64,
        default: f64,
        unit: &'static str,
        help: &'static str,
    ) -> Self {
        Self { name, kind: ParamKind::Float { min, max }, default, unit, help }
    }

    /// A whole number.
    pub const fn int(
        name: &'static str,
        min: i64,
        max: i64,
        default: i64,
        unit: &'static str,
        help: &'static str,
    ) -> Self {
        Self { name, kind: ParamKind::Int { min, max, odd: false }, default: default as f64, unit, help }
    }

    /// An odd whole number.
    pub const fn odd(
        name: &'static str,
        min: i64,
        max: i64,
        default: i64,
        unit: &'static str,
        help: &'static str,
    ) -> Self {
        Self { name, kind: ParamKind::Int { min, max, odd: true }, default: default as f64, unit, help }
    }

    /// One of several words; `default` is an index.
    pub const fn choice(
        name: &'static str,
        words: &'static [&'static str],
        default: usize,
        help: &'static str,
    ) -> Self {
        Self { name, kind: ParamKind::Choice(words), default: default as f64, unit: "", help }
    }

    /// `on` or `off`.
    pub const fn switch(name: &'static str, default: bool, help: &'static str) -> Self {
        Self { name, kind: ParamKind::Switch, default: if default { 1.0 } else { 0.0 }, unit: "", help }
    }

    /// The allowed values, in words.
    pub fn range(&self) -> String {
        match self.kind {
            ParamKind::Float { min, max } => format!("{min} to {max}"),
            ParamKind::Int { min, max, odd: false } => format!("{min} to {max}"),
            ParamKind::Int { min, max, odd: true } => format!("odd, {min} to {max}"),
            ParamKind::Choice(words) => words.join("|"),
            ParamKind::Switch => "on|off".into(),
        }
    }

    /// A value as the user would write it.
    pub fn show(&self, value: f64) -> String {
        match self.kind {
            ParamKind::Choice(words) => words.get(value as usize).map_or_else(String::new, |w| (*w).into()),
            ParamKind::Switch => if value == 0.0 { "off" } else { "on" }.into(),
            _ => value.to_string(),
        }
    }

    fn parse(&self, text: &str) -> Option<f64> {
        match self.kind {
            ParamKind::Float { min, max } => text.parse().ok().filter(|v| (min..=max).contains(v)),
            ParamKind::Int { min, max, odd } => {
                let v: i64 = text.parse().ok()?;
                ((min..=max).contains(&v) && (!odd || v % 2 != 0)).then_some(v as f64)
            }
            ParamKind::Choice(words) => words.iter().position(|w| *w == text).map(|i| i as f64),
            ParamKind::Switch => match text {
                "on" | "true" | "1" => Some(1.0),
                "off" | "false" | "0" => Some(0.0),
                _ => None,
            },
        }
    }
}

/// Checked values for every row of a table.
#[derive(Clone, Debug, Default)]
pub struct Params {
    table: &'static [Param],
    values: Vec<f64>,
}

impl Params {
    /// Defaults.
    pub fn new(info: &Info) -> Self {
        Self { table: info.params, values: info.params.iter().map(|p| p.default).collect() }
    }

    /// Defaults with some of them set by `name=value` pairs; a wrong name or value is an error that lists
    /// what is allowed. The last of several settings of a name counts.
    pub fn parse<'s>(info: &Info, settings: impl IntoIterator<Item = (&'s str, &'s str)>) -> Result<Self> {
        let mut params = Self::new(info);
        for (name, text) in settings {
            params.set(info.id, name, text)?;
        }
        Ok(params)
    }

    /// True if the rows are those of the technique.
    pub fn are_for(&self, info: &Info) -> bool {
        let names = |table: &'static [Param]| table.iter().map(|p| (p.name, p.kind));
        self.values.len() == self.table.len() && names(self.table).eq(names(info.params))
    }

    /// Sets one value from text.
    pub fn set(&mut self, technique: &str, name: &str, text: &str) -> Result<()> {
        let Some(i) = self.table.iter().position(|p| p.name == name) else {
            let names: Vec<_> = self.table.iter().map(|p| p.name).collect();
            let problem = format!("{technique} has no parameter {name:?}");
            return Err(Error::Parameter(unknown(&problem, name, "it has", &names)));
        };
        let param = &self.table[i];
        self.values[i] = param.parse(text).ok_or_else(|| {
            Error::Parameter(format!("{technique}: {name}={text} is not allowed; {name} is {}", param.range()))
        })?;
        Ok(())
    }

    /// Name and value of every row, as the user would write them.
    pub fn show(&self) -> Vec<(&'static str, String)> {
        self.table.iter().zip(&self.values).map(|(p, &v)| (p.name, p.show(v))).collect()
    }

    /// The value of a row: a number, the index of a choice, 0 or 1 of a switch.
    ///
    /// # Panics
    /// If the table has no such row: a technique asks for its own rows only.
    pub fn get(&self, name: &str) -> f64 {
        match self.table.iter().position(|p| p.name == name) {
            Some(i) => self.values[i],
            None => panic!("no parameter {name} in the technique's own table"),
        }
    }

    /// [`Params::get`] as `f32`.
    pub fn float(&self, name: &str) -> f32 {
        self.get(name) as f32
    }

    /// [`Params::get`] of a whole number that is not negative.
    pub fn int(&self, name: &str) -> u32 {
        self.get(name) as u32
    }

    /// [`Params::get`] of a switch.
    pub fn on(&self, name: &str) -> bool {
        self.get(name) != 0.0
    }

    /// The word of a choice.
    pub fn word(&self, name: &str) -> &'static str {
        let param = self.table.iter().find(|p| p.name == name);
        match param.map(|p| p.kind) {
            Some(ParamKind::Choice(words)) => words[self.get(name) as usize],
            _ => panic!("no choice {name} in the technique's own table"),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::technique::{ALL, find};

    #[test]
    fn every_default_is_allowed() {
        for info in ALL {
            for p in info.params {
                assert_eq!(p.parse(&p.show(p.default)), Some(p.default), "{}: {}", info.id, p.name);
                assert!(!p.help.is_empty());
            }
        }
    }

    #[test]
    fn parameters_know_their_technique() {
        let (sm, pcf) = (find("sm").unwrap(), find("pcf").unwrap());
        assert!(Params::new(sm).are_for(sm) && Params::new(pcf).are_for(pcf));
        assert!(!Params::new(sm).are_for(pcf) && !Params::default().are_for(sm));
    }

    #[test]
    fn ids_and_names_are_unique() {
        for (i, info) in ALL.iter().enumerate() {
            assert!(ALL[..i].iter().all(|other| other.id != info.id));
            for (j, p) in info.params.iter().enumerate() {
                assert!(info.params[..j].iter().all(|other| other.name != p.name));
            }
        }
    }

    #[test]
    fn errors_list_what_is_allowed() {
        let pcf = find("pcf").unwrap();
        let text = |settings| Params::parse(pcf, settings).unwrap_err().to_string();
        let error = text([("widht", "3")]);
        assert!(error.contains("did you mean \"width\"? It has: width, "), "{error}");
        assert!(text([("width", "4")]).contains("odd, 1 to 63"));
        assert!(text([("width", "65")]).contains("odd, 1 to 63"));
        assert!(text([("fetch", "teleport")]).contains("loop|gather"));
        assert!(text([("normal_offset", "NaN")]).contains("0 to"));
        assert!(find("pfc").err().unwrap().to_string().contains("sm, pcf"));
        assert_eq!(Params::parse(pcf, [("width", "7"), ("width", "5")]).unwrap().int("width"), 5);
    }
}
