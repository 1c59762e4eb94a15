//! The value of a taxel in a frame as a line of JSON, or its three values.

use std::fmt;

use serde::de::{DeserializeSeed, Deserializer, Error as _, IgnoredAny, SeqAccess, Visitor};

use crate::signal::{Channel, RawValue};

/// What a taxel has in a line.
pub(super) enum Given {
    One(RawValue),
    /// Along the normal, t and n × t.
    Three([RawValue; 3]),
}

/// Reads the value of the channel `id`.
pub(super) struct ValueVisitor {
    pub(super) id: u32,
}

impl<'de> Visitor<'de> for ValueVisitor {
    type Value = Given;

    fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "a number, null, \"nan\" or \"inf\" for taxel {}", Channel(self.id))
    }

    fn visit_f64<E>(self, value: f64) -> Result<Given, E> {
        Ok(Given::One(RawValue::new(value)))
    }

    fn visit_i64<E>(self, value: i64) -> Result<Given, E> {
        Ok(Given::One(RawValue::new(value as f64)))
    }

    fn visit_u64<E>(self, value: u64) -> Result<Given, E> {
        Ok(Given::One(RawValue::new(value as f64)))
    }

    fn visit_unit<E>(self) -> Result<Given, E> {
        Ok(Given::One(RawValue::MISSING))
    }

    fn visit_str<E: serde::de::Error>(self, word: &str) -> Result<Given, E> {
        let unsigned = word.strip_prefix('-').unwrap_or(word);
        if unsigned.eq_ignore_ascii_case("nan") || unsigned.eq_ignore_ascii_case("inf") {
            return Ok(Given::One(RawValue::FAULTY));
        }
        Err(E::custom(format!(
            "taxel {} is `{word}`; give a number without quotes, null where it is missing, \"nan\" where it is faulty",
            Channel(self.id)
        )))
    }

    fn visit_seq<A: SeqAccess<'de>>(self, mut seq: A) -> Result<Given, A::Error> {
        let wrong = || {
            let name = Channel(self.id);
            A::Error::custom(format!("taxel {name} has an array; give one number, or three: along its normal, u and v"))
        };
        let mut values = [RawValue::MISSING; 3];
        for value in &mut values {
            let Some(Given::One(own)) = seq.next_element_seed(ValueVisitor { id: self.id })? else {
                return Err(wrong());
            };
            *value = own;
        }
        if seq.next_element::<IgnoredAny>()?.is_some() { Err(wrong()) } else { Ok(Given::Three(values)) }
    }
}

impl<'de> DeserializeSeed<'de> for ValueVisitor {
    type Value = Given;

    fn deserialize<D: Deserializer<'de>>(self, deserializer: D) -> Result<Given, D::Error> {
        deserializer.deserialize_any(self)
    }
}
