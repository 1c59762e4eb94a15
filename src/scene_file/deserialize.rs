//! Deserializers of a scene file's values. Each parses in place, so that an error has its line and column.

use std::fmt;
use std::marker::PhantomData;
use std::str::FromStr;

#[cfg(feature = "cli")]
use schemars::JsonSchema;
use serde::de::{Error as _, SeqAccess, Visitor};
use serde::{Deserialize, Deserializer};

use crate::scene::{AskedOutputs, MotionFilter};

// As a schema says it.
/// One text, or a list of them.
#[cfg(feature = "cli")]
#[derive(JsonSchema)]
#[schemars(untagged)]
#[expect(dead_code, reason = "only its schema is of use")]
pub(super) enum OneOrMany {
    One(String),
    Many(Vec<String>),
}

struct Parsed<T>(T);

impl<'de, T: FromStr<Err: fmt::Display>> Deserialize<'de> for Parsed<T> {
    fn deserialize<D: Deserializer<'de>>(from: D) -> Result<Self, D::Error> {
        String::deserialize(from)?.parse().map(Self).map_err(D::Error::custom)
    }
}

/// Takes one text, or a list of them.
struct Texts<T>(PhantomData<T>);

impl<'de, T: FromStr<Err: fmt::Display>> Visitor<'de> for Texts<T> {
    type Value = Vec<T>;

    fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("a text, or a list of texts")
    }

    fn visit_str<E: serde::de::Error>(self, text: &str) -> Result<Vec<T>, E> {
        text.parse().map(|one| vec![one]).map_err(E::custom)
    }

    fn visit_seq<A: SeqAccess<'de>>(self, mut list: A) -> Result<Vec<T>, A::Error> {
        let mut all = Vec::new();
        while let Some(Parsed(one)) = list.next_element()? {
            all.push(one);
        }
        Ok(all)
    }
}

pub(super) fn words<'de, T: FromStr<Err: fmt::Display>, D: Deserializer<'de>>(from: D) -> Result<Vec<T>, D::Error> {
    from.deserialize_any(Texts(PhantomData))
}

pub(super) fn word<'de, T: FromStr<Err: fmt::Display>, D: Deserializer<'de>>(from: D) -> Result<Option<T>, D::Error> {
    Parsed::deserialize(from).map(|Parsed(one)| Some(one))
}

pub(super) fn outputs<'de, D: Deserializer<'de>>(from: D) -> Result<Vec<AskedOutputs>, D::Error> {
    words(from)
}

pub(super) fn batch<'de, D: Deserializer<'de>>(from: D) -> Result<Option<u32>, D::Error> {
    let frames = i64::deserialize(from)?;
    match u32::try_from(frames) {
        Ok(frames @ 1..=65_536) => Ok(Some(frames)),
        _ => Err(D::Error::custom(format!("`batch` is {frames}; it must be between 1 and 65536"))),
    }
}

pub(super) fn window<'de, D: Deserializer<'de>>(from: D) -> Result<Option<String>, D::Error> {
    let text = String::deserialize(from)?;
    MotionFilter::default().with_window(&text).map_err(D::Error::custom)?;
    Ok(Some(text))
}

/// Says in a schema which outputs there are.
#[cfg(feature = "cli")]
pub(super) fn output_names(schema: &mut schemars::Schema) {
    let names: Vec<String> = AskedOutputs::names().collect();
    schema.insert("items".to_owned(), serde_json::json!({"type": "string", "enum": names}));
}
