//! Values in recipes: lengths with units, globs, ranges of ids.

use std::str::FromStr;

use globset::{GlobBuilder, GlobSet, GlobSetBuilder};
use serde::Deserialize;

use crate::error::{Error, Result, failed};

/// A length over 0: a number of metres, or text with a unit, like `"8 mm"`.
#[derive(Clone, Copy, Debug, PartialEq, Deserialize)]
#[serde(try_from = "NumberOrText")]
pub struct Length {
    /// In m.
    pub metres: f64,
}

#[derive(Deserialize)]
#[serde(untagged, expecting = "a length is a number of metres, or text like \"8 mm\"")]
enum NumberOrText {
    Number(f64),
    Text(String),
}

impl Length {
    fn new(metres: f64) -> Result<Self> {
        if metres.is_finite() && metres > 0.0 {
            return Ok(Self { metres });
        }
        Err(failed!("a length of {metres} m is invalid; write one over 0"))
    }
}

impl FromStr for Length {
    type Err = Error;

    fn from_str(text: &str) -> Result<Self> {
        let read = crate::length::Length::parse(text.trim()).ok().flatten();
        let metres = read.and_then(|length| Some(length.number * length.unit_m?));
        let wrong = || failed!("`{text}` is not a length; write a number and um, mm, cm or m, like 8mm");
        Self::new(metres.ok_or_else(wrong)?)
    }
}

impl TryFrom<NumberOrText> for Length {
    type Error = Error;

    fn try_from(value: NumberOrText) -> Result<Self> {
        match value {
            NumberOrText::Number(metres) => Self::new(metres),
            NumberOrText::Text(text) => text.parse(),
        }
    }
}

/// One name or a list of names.
#[derive(Clone, Debug, Default, Deserialize)]
#[serde(from = "OneOrMany")]
pub(super) struct Names(pub(super) Vec<String>);

#[derive(Deserialize)]
#[serde(untagged, expecting = "write a name, or a list of names")]
enum OneOrMany {
    One(String),
    Many(Vec<String>),
}

impl From<OneOrMany> for Names {
    fn from(names: OneOrMany) -> Self {
        match names {
            OneOrMany::One(name) => Self(vec![name]),
            OneOrMany::Many(names) => Self(names),
        }
    }
}

/// Globs over names (`palm*`, `finger_?`). A name matches if any of them does. `*` also matches slashes.
#[derive(Clone, Debug, Deserialize)]
#[serde(try_from = "Names")]
pub struct Globs {
    text: Vec<String>,
    set: GlobSet,
}

impl Globs {
    /// Whether any of them matches `name`; a name always matches itself, even with brackets in it.
    #[must_use]
    pub fn matches(&self, name: &str) -> bool {
        self.set.is_match(name) || self.text.iter().any(|glob| glob == name)
    }

    /// The globs as text.
    #[must_use]
    pub fn text(&self) -> &[String] {
        &self.text
    }

    pub(super) fn listed(&self) -> String {
        self.text.join("`, `")
    }
}

impl TryFrom<Names> for Globs {
    type Error = Error;

    fn try_from(Names(text): Names) -> Result<Self> {
        let mut set = GlobSetBuilder::new();
        let wrong = |e: &globset::Error| {
            let glob = e.glob().unwrap_or_default();
            failed!("`{glob}` is not a valid glob: {}", e.kind())
        };
        for glob in &text {
            set.add(GlobBuilder::new(glob).build().map_err(|e| wrong(&e))?);
        }
        let set = set.build().map_err(|e| wrong(&e))?;
        Ok(Self { text, set })
    }
}

/// A taxel's id, or an inclusive range of ids, like `"10..=20"`.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize)]
#[serde(try_from = "IdOrRange")]
pub struct Ids {
    /// The lowest.
    pub first: u32,
    /// The highest.
    pub last: u32,
}

#[derive(Deserialize)]
#[serde(untagged, expecting = "write a taxel's id from 0 up, or a range of ids like \"10..=20\"")]
enum IdOrRange {
    Id(u32),
    Range(String),
}

impl TryFrom<IdOrRange> for Ids {
    type Error = Error;

    fn try_from(value: IdOrRange) -> Result<Self> {
        let text = match value {
            IdOrRange::Id(id) => return Ok(Self { first: id, last: id }),
            IdOrRange::Range(text) => text,
        };
        let ends = text.split_once("..=").and_then(|(first, last)| {
            Some(Self { first: first.trim().parse().ok()?, last: last.trim().parse().ok()? })
        });
        ends.filter(|ids| ids.first <= ids.last)
            .ok_or_else(|| failed!("`{text}` is not a range of taxel ids; write one like \"10..=20\""))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[derive(serde::Deserialize)]
    struct Words {
        length: Option<Length>,
        globs: Option<Globs>,
        ids: Option<Vec<Ids>>,
    }

    fn read(text: &str) -> Result<Words, String> {
        crate::error::parse_toml(text).map_err(|e| e.to_string())
    }

    #[test]
    fn lengths_have_units_or_are_metres() {
        for (text, metres) in [("8e-3", 8e-3), ("2", 2.0), ("\"8 mm\"", 8e-3), ("\" 2.5cm\"", 0.025), ("\"3 m\"", 3.0)]
        {
            assert_eq!(read(&format!("length = {text}")).unwrap().length.unwrap().metres, metres, "{text}");
        }
        for (text, why) in
            [("\"8 feet\"", "8 feet"), ("0", "0 m"), ("-1.0", "-1 m"), ("nan", "NaN"), ("true", "a length")]
        {
            assert!(read(&format!("length = {text}")).err().unwrap().contains(why), "{text}");
        }
    }

    #[test]
    fn globs_are_one_or_many() {
        let globs = read("globs = [\"l_*\", \"hand/{a,b}\"]").unwrap().globs.unwrap();
        assert!(globs.matches("l_arm/x") && globs.matches("hand/b") && !globs.matches("r_arm"));
        assert_eq!(read("globs = \"a?\"").unwrap().globs.unwrap().text(), ["a?"]);
        assert!(read("globs = \"a[\"").err().unwrap().contains("`a[`"));
    }

    #[test]
    fn ids_are_numbers_or_ranges() {
        let ids = read("ids = [3, \"10..=12\"]").unwrap().ids.unwrap();
        assert_eq!(ids, [Ids { first: 3, last: 3 }, Ids { first: 10, last: 12 }]);
        for text in ["-1", "\"5..=4\"", "\"5..9\"", "\"x\""] {
            assert!(read(&format!("ids = [{text}]")).is_err(), "{text}");
        }
    }
}
