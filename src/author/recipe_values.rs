//! Values in recipes: lengths with units, globs, ranges of ids.

use std::fmt;

use serde::de::{Deserialize, Deserializer, Error as _, SeqAccess, Visitor};

use super::glob;

/// A length over 0: a number of metres, or text with a unit, like `"8 mm"`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Length {
    /// In m.
    pub metres: f64,
}

impl<'de> Deserialize<'de> for Length {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        struct Reader;
        impl Visitor<'_> for Reader {
            type Value = f64;

            fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
                f.write_str("a length: a number of metres, or text like \"8 mm\"")
            }

            fn visit_f64<E: serde::de::Error>(self, metres: f64) -> Result<f64, E> {
                Ok(metres)
            }

            fn visit_i64<E: serde::de::Error>(self, metres: i64) -> Result<f64, E> {
                Ok(metres as f64)
            }

            fn visit_u64<E: serde::de::Error>(self, metres: u64) -> Result<f64, E> {
                Ok(metres as f64)
            }

            fn visit_str<E: serde::de::Error>(self, text: &str) -> Result<f64, E> {
                let read = crate::length::Length::parse(text.trim()).ok().flatten();
                let metres = read.and_then(|length| Some(length.number * length.unit_m?));
                metres.ok_or_else(|| {
                    E::custom(format!("`{text}` is no length; write one like \"8 mm\" (um, mm, cm or m)"))
                })
            }
        }
        let metres = deserializer.deserialize_any(Reader)?;
        if metres.is_finite() && metres > 0.0 {
            return Ok(Self { metres });
        }
        Err(D::Error::custom(format!("a length of {metres} m makes no sense here; give one over 0")))
    }
}

/// One glob or several, of which any may match. `*` also matches slashes.
#[derive(Clone, Debug)]
pub struct Globs {
    text: Vec<String>,
    set: glob::Globs,
}

impl Globs {
    /// Whether any of them matches `name`.
    #[must_use]
    pub fn matches(&self, name: &str) -> bool {
        self.set.is_match(name)
    }

    /// The globs as text.
    #[must_use]
    pub fn text(&self) -> &[String] {
        &self.text
    }
}

impl<'de> Deserialize<'de> for Globs {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        struct Reader;
        impl<'de> Visitor<'de> for Reader {
            type Value = Vec<String>;

            fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
                f.write_str("a glob like \"l_*\", or a list of them")
            }

            fn visit_str<E: serde::de::Error>(self, text: &str) -> Result<Vec<String>, E> {
                Ok(vec![text.to_owned()])
            }

            fn visit_seq<A: SeqAccess<'de>>(self, mut list: A) -> Result<Vec<String>, A::Error> {
                let mut text = Vec::new();
                while let Some(next) = list.next_element()? {
                    text.push(next);
                }
                Ok(text)
            }
        }
        let text = deserializer.deserialize_any(Reader)?;
        let set = glob::Globs::new(&text).map_err(D::Error::custom)?;
        Ok(Self { text, set })
    }
}

/// A taxel's id, or an inclusive range of ids, like `"10..=20"`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Ids {
    /// The lowest.
    pub first: u32,
    /// The highest.
    pub last: u32,
}

impl<'de> Deserialize<'de> for Ids {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        struct Reader;
        impl Visitor<'_> for Reader {
            type Value = Ids;

            fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
                f.write_str("a taxel's id, or a range of ids like \"10..=20\"")
            }

            fn visit_i64<E: serde::de::Error>(self, id: i64) -> Result<Ids, E> {
                let id = u32::try_from(id).map_err(|_| E::custom(format!("{id} is no taxel id; they count from 0")))?;
                Ok(Ids { first: id, last: id })
            }

            fn visit_u64<E: serde::de::Error>(self, id: u64) -> Result<Ids, E> {
                self.visit_i64(i64::try_from(id).unwrap_or(i64::MAX))
            }

            fn visit_str<E: serde::de::Error>(self, text: &str) -> Result<Ids, E> {
                let ends = text.split_once("..=").and_then(|(first, last)| {
                    Some(Ids { first: first.trim().parse().ok()?, last: last.trim().parse().ok()? })
                });
                ends.filter(|ids| ids.first <= ids.last)
                    .ok_or_else(|| E::custom(format!("`{text}` is no range of taxel ids; write one like \"10..=20\"")))
            }
        }
        deserializer.deserialize_any(Reader)
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
        toml::from_str(text).map_err(|e: toml::de::Error| e.message().to_owned())
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
