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
    /// Value if the user sets none. For a choice it is the index of the word, for a switch 0 or 1.
    pub default: f64,
    /// Unit, in words.
    pub unit: &'static str,
    /// One line of help.
    pub help: &'static str,
}

/// Type and range of a parameter.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum ParamKind {
    /// A number within inclusive bounds.
    Float {
        /// Smallest.
        min: f64,
        /// Largest.
        max: f64,
    },
    /// A whole number within inclusive bounds.
    Int {
        /// Smallest.
        min: i64,
        /// Largest.
        max: i64,
        /// True if only odd numbers are allowed.
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

/// Name of the setting that selects where all others start: `default` or `published`.
const PRESET: &str = "preset";

/// Checked values for every row of a table.
#[derive(Clone, Debug, Default)]
pub struct Params {
    table: &'static [Param],
    values: Vec<f64>,
    is_published: bool,
}

impl Params {
    /// The defaults of a technique.
    pub fn new(info: &Info) -> Self {
        let values = info.params.iter().map(|p| p.default).collect();
        Self { table: info.params, values, is_published: false }
    }

    /// The form that the technique's paper describes ([`Info::published`]).
    ///
    /// # Errors
    /// [`Error::Parameter`] if the technique has no such form apart from its defaults.
    pub fn published(info: &Info) -> Result<Self> {
        if info.published.is_empty() {
            let with: Vec<_> = super::ALL.iter().filter(|t| !t.published.is_empty()).map(|t| t.id).collect();
            let with = with.join(", ");
            let problem = format!("{} has no published form apart from its defaults; these have one: {with}", info.id);
            return Err(Error::Parameter(problem));
        }
        let mut params = Self::new(info);
        for (name, text) in info.published {
            params.set(info.id, name, text)?;
        }
        params.is_published = true;
        Ok(params)
    }

    /// The defaults, changed by `name=value` pairs. A wrong name or value is an error that lists what is allowed. If a
    /// name is set several times, the last setting counts. `preset=published` starts from [`Params::published`] instead,
    /// wherever it stands.
    pub fn parse<'s>(info: &Info, settings: impl IntoIterator<Item = (&'s str, &'s str)>) -> Result<Self> {
        let (presets, settings): (Vec<_>, Vec<_>) = settings.into_iter().partition(|(name, _)| *name == PRESET);
        let mut params = match presets.last().map(|p| p.1) {
            None | Some("default") => Self::new(info),
            Some("published") => Self::published(info)?,
            Some(other) => {
                let id = info.id;
                let problem = format!("{id}: {PRESET}={other} is not allowed; {PRESET} is default|published");
                return Err(Error::Parameter(problem));
            }
        };
        for (name, text) in settings {
            params.set(info.id, name, text)?;
        }
        Ok(params)
    }

    /// True if the table has the rows of the technique.
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

    /// True if the values started from [`Params::published`].
    pub fn is_published(&self) -> bool {
        self.is_published
    }

    /// Name and value of every row, as the user would write them.
    pub fn show(&self) -> Vec<(&'static str, String)> {
        self.table.iter().zip(&self.values).map(|(p, &v)| (p.name, p.show(v))).collect()
    }

    /// The value of a row: a number, the index of a choice, or 0 or 1 for a switch.
    ///
    /// # Panics
    /// Panics if the table has no such row. A technique asks only for its own rows.
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
    fn published_forms_are_where_settings_start() {
        let with = ALL.iter().filter(|t| !t.published.is_empty());
        assert!(with.clone().count() >= 10);
        for info in with {
            let published = Params::published(info).unwrap();
            assert_ne!(published.show(), Params::new(info).show(), "{}", info.id);
            // Each of the settings departs from the default.
            for (name, text) in info.published {
                let param = info.params.iter().find(|p| p.name == *name).unwrap();
                assert_ne!(param.parse(text), Some(param.default), "{}: {name}={text}", info.id);
            }
        }
        let rbsm = find("rbsm").unwrap();
        let parsed = |settings: &[(&'static str, &'static str)]| Params::parse(rbsm, settings.iter().copied()).unwrap();
        assert_eq!(parsed(&[("preset", "default")]).show(), Params::new(rbsm).show());
        let changed = parsed(&[("max_distance", "8"), ("preset", "published")]);
        assert!(changed.is_published() && changed.int("max_distance") == 8 && changed.word("receiver") == "fixed");
        let error = |id, word| Params::parse(find(id).unwrap(), [("preset", word)]).unwrap_err().to_string();
        assert!(error("rbsm", "paper").contains("preset is default|published"));
        assert!(error("sm", "published").contains("these have one: "));
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
