//! Techniques as the user writes them, such as `pcf:width=7,skip=off`.

use super::args::{setting, usage};
use edgeshade::technique::{self, Info, Kind, Params};
use edgeshade::{Error, Result};

/// A technique with its settings.
#[derive(Clone)]
pub struct Choice {
    pub info: &'static Info,
    pub params: Params,
}

impl Choice {
    /// Checks the id, and the names and values of the settings.
    pub fn new(id: &str, settings: &[(String, String)]) -> Result<Self> {
        let info = technique::find(id)?;
        let params = Params::parse(info, settings.iter().map(|(n, v)| (n.as_str(), v.as_str())))?;
        Ok(Self { info, params })
    }

    /// True for references, which are made from the scene instead of a shadow map.
    pub fn is_reference(&self) -> bool {
        matches!(self.info.kind, Kind::Reference)
    }

    /// True if the result depends on the size of the shadow map.
    pub fn uses_map(&self) -> bool {
        !matches!(self.info.id, "ray-traced" | "fixed-penumbra")
    }

    /// The preset, and settings that differ from it or from the defaults; `-` if there are none.
    pub fn settings(&self) -> String {
        let published = Params::published(self.info).ok().filter(|_| self.params.is_published());
        let mut shown: Vec<_> = published.iter().map(|_| "preset=published".to_owned()).collect();
        let usual = published.unwrap_or_else(|| Params::new(self.info)).show();
        let changed = self.params.show().into_iter().zip(usual).filter(|(mine, usual)| mine.1 != usual.1);
        shown.extend(changed.map(|((name, value), _)| format!("{name}={value}")));
        if shown.is_empty() { "-".into() } else { shown.join(" ") }
    }
}

/// True for the references that `--samples` applies to.
pub fn takes_samples(info: &Info) -> bool {
    matches!(info.kind, Kind::Reference) && info.params.iter().any(|p| p.name == "samples")
}

/// Parses the values of `-t`. `samples` applies to those references that have such a parameter and do not set it
/// themselves.
pub fn parse(texts: &[String], samples: Option<u32>) -> Result<Vec<Choice>> {
    let mut found: Vec<(&str, Vec<(String, String)>)> = vec![];
    for text in texts {
        let mut goes_on = false;
        for item in text.split(',').map(str::trim) {
            let (id, first) = match item.split_once(':') {
                Some((id, first)) => (id.trim(), Some(first)),
                None if item.contains('=') => ("", Some(item)),
                None => (item, None),
            };
            if id.is_empty() && (!goes_on || !item.contains('=') || item.starts_with(':')) {
                return usage(format!(
                    "-t {text}: {item:?} is no technique; it must be ID or ID:name=value,name=value"
                ));
            }
            if !id.is_empty() {
                found.push((id, vec![]));
                goes_on = true;
            }
            if let (Some(setting_text), Some((_, settings))) = (first, found.last_mut()) {
                settings.push(setting(setting_text).map_err(|e| Error::Usage(format!("-t {text}: {e}")))?);
            }
        }
    }
    let mut choices = vec![];
    for (id, mut settings) in found {
        if id == "all" {
            let is_published = match &settings[..] {
                [] => false,
                [(name, value)] if name == "preset" && value == "published" => true,
                _ => {
                    return usage(
                        "-t all takes no settings but preset=published, because techniques have different ones",
                    );
                }
            };
            for info in technique::ALL.iter().filter(|t| matches!(t.kind, Kind::RealTime(_))) {
                if is_published && info.published.is_empty() {
                    continue;
                }
                let params = if is_published { Params::published(info)? } else { Params::new(info) };
                choices.push(Choice { info, params });
            }
            continue;
        }
        if let Some(n) = samples.filter(|_| technique::find(id).is_ok_and(takes_samples)) {
            settings.insert(0, ("samples".into(), n.to_string()));
        }
        choices.push(Choice::new(id, &settings)?);
    }
    Ok(choices)
}

/// Adds, behind each technique at its defaults, the technique's published form, unless it has none apart from them.
pub fn with_published(choices: Vec<Choice>) -> Result<Vec<Choice>> {
    let mut all = vec![];
    for choice in choices {
        let info = choice.info;
        let has_one = choice.settings() == "-" && !info.published.is_empty();
        all.push(choice);
        if has_one {
            all.push(Choice { info, params: Params::published(info)? });
        }
    }
    Ok(all)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn shown(text: &str) -> Vec<String> {
        let choices = parse(&[text.into()], Some(64)).unwrap();
        choices.iter().map(|c| format!("{} {}", c.info.id, c.settings())).collect()
    }

    #[test]
    fn settings_belong_to_the_technique_before_them() {
        assert_eq!(shown("sm,pcf"), ["sm -", "pcf -"]);
        assert_eq!(shown("pcf:width=7,skip=off,sm"), ["pcf width=7 skip=off", "sm -"]);
        assert_eq!(shown("pcf:width=7,pcf:width=9"), ["pcf width=7", "pcf width=9"]);
        assert_eq!(shown("ray-traced,ray-traced:samples=16"), ["ray-traced samples=64", "ray-traced samples=16"]);
        assert_eq!(shown("fixed-penumbra:penumbra=0.5"), ["fixed-penumbra penumbra=0.5"]);
        assert_eq!(shown("rbsm:preset=published,max_distance=8"), ["rbsm preset=published max_distance=8"]);
        let published = shown("all:preset=published");
        assert!(published.len() >= 10 && published.iter().all(|t| t.ends_with(" preset=published")), "{published:?}");
        assert!(shown("all").len() >= 2 && !shown("all").iter().any(|t| t.contains("ray-traced")));
    }

    #[test]
    fn published_forms_stand_beside_the_defaults() {
        let choices = with_published(parse(&["sm,rbsm,rbsm-star:max_distance=8".into()], None).unwrap()).unwrap();
        let shown: Vec<_> = choices.iter().map(|c| format!("{} {}", c.info.id, c.settings())).collect();
        assert_eq!(shown, ["sm -", "rbsm -", "rbsm preset=published", "rbsm-star max_distance=8"]);
    }

    #[test]
    fn wrong_ones_are_refused() {
        for bad in [
            "",
            ",",
            "width=7",
            "pcf:",
            "pcf:width",
            "pcf:width=8",
            "sm,",
            "sm,:a=1",
            "all:width=7",
            "all:preset=paper",
            "sm:preset=published",
            "all,width=7",
            "nope",
        ] {
            assert!(parse(&[bad.into()], None).is_err(), "{bad:?}");
        }
    }
}
