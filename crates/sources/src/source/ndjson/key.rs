//! The keys of a frame as a line of JSON.

use std::fmt;

use serde::de::Visitor;

/// A frame, for messages.
pub(super) const EXAMPLE: &str = "{\"t\":0.5,\"values\":{\"7\":12}}";

#[derive(Clone, Copy)]
pub(super) enum Key {
    Time,
    Values,
    Pose,
    Joints,
}

impl fmt::Display for Key {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Time => "t",
            Self::Values => "values",
            Self::Pose => "pose",
            Self::Joints => "joints",
        })
    }
}

pub(super) struct KeyVisitor;

impl Visitor<'_> for KeyVisitor {
    type Value = Key;

    fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("`t`, `values`, `pose` or `joints`")
    }

    fn visit_str<E: serde::de::Error>(self, key: &str) -> Result<Key, E> {
        match key {
            "t" => Ok(Key::Time),
            "values" => Ok(Key::Values),
            "pose" => Ok(Key::Pose),
            "joints" => Ok(Key::Joints),
            other => Err(E::custom(format!(
                "a frame has no `{other}`; its keys are `t`, `values`, `pose` and `joints`, as in {EXAMPLE}: put the sensors under `values`, by taxel id"
            ))),
        }
    }
}
