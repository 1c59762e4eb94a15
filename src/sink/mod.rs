//! Sinks: where percepts go.
//!
//! A sink is told the names of the fields once and sees nothing of engines; of bodies and frames only recordings do.

mod line;
mod ndjson;
#[cfg(feature = "mcap")]
mod recorded;
#[cfg(feature = "mcap")]
mod scenery;
mod spec;

pub use ndjson::NdjsonSink;
#[cfg(feature = "mcap")]
pub use recorded::RecordingSink;
pub use spec::{SinkSpec, SinkTarget};

use std::str::FromStr;

use crate::body::Body;
use crate::error::{Error, Result, nearest};
use crate::percept::Percepts;
use crate::signal::Frame;

/// Something that takes percepts.
pub trait Sink {
    /// Takes the frames that the next percepts are made of. Sinks of percepts alone do nothing with them.
    ///
    /// # Errors
    /// As [`Sink::write`].
    fn hear(&mut self, _heard: &Heard<'_>) -> Result<Flow> {
        Ok(Flow::Open)
    }

    /// Takes all frames of `percepts`.
    ///
    /// # Errors
    /// They cannot be written; the message names where to.
    fn write(&mut self, percepts: &Percepts) -> Result<Flow>;

    /// Hands on what was held back to be written together: at once, or in a recording within half a second.
    ///
    /// # Errors
    /// As [`Sink::write`].
    fn flush(&mut self) -> Result<Flow>;

    /// Ends the output and makes it whole. A sink dropped without this leaves no file behind, except for a
    /// recording, which stays as far as it got.
    ///
    /// # Errors
    /// As [`Sink::write`].
    fn finish(self: Box<Self>) -> Result<()>;
}

/// Whether there is still anybody at the other end.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[must_use = "writing on after the reader has gone is wasted work"]
pub enum Flow {
    /// Go on.
    Open,
    /// The reader has closed the pipe, which is a normal end.
    Closed,
}

/// What a sink calls a field.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct FieldNames {
    /// The field's name.
    pub field: String,
    /// The link in whose frame its position and normal are given: its anchor.
    pub link: String,
    /// What its taxels are read as, where that is to be said: `sustained` or `change`.
    pub letter: Option<String>,
    /// In which signal, where that is to be said: `raw` or `linear`.
    pub signal: Option<String>,
}

/// Frames, and what can be asked about them.
pub struct Heard<'a> {
    /// The frames.
    pub frames: &'a [Frame],
    /// Puts in place of what the list holds, for one of the frames, taxel ids and their pressures.
    pub pressures: &'a Pressures<'a>,
}

/// Puts taxel ids and pressures of a frame into a list.
pub type Pressures<'a> = dyn Fn(&Frame, &mut Vec<(u32, f64)>) + 'a;

/// What sinks are told before the first frame.
#[derive(Clone, Debug, Default)]
pub struct Session<'a> {
    /// The names of the fields.
    pub names: Vec<FieldNames>,
    /// Whether fields without contact are listed.
    pub all_fields: bool,
    /// The ids of a frame's values, in their order.
    pub taxels: &'a [u32],
    /// The robot.
    pub body: Option<&'a Body>,
    /// Files that a recording is to hold: name, media type, bytes.
    pub attached: Vec<(String, String, Vec<u8>)>,
    /// What recordings hold; none is all.
    pub parts: Vec<Part>,
}

/// What a recording can hold.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Part {
    /// Frames as they came.
    Frames,
    /// Percepts, as in NDJSON.
    Percepts,
    /// What viewers show: taxels with their pressures, touched fields, links.
    View,
}

impl FromStr for Part {
    type Err = Error;

    fn from_str(name: &str) -> Result<Self> {
        let all = [("frames", Self::Frames), ("percepts", Self::Percepts), ("view", Self::View)];
        if let Some((_, part)) = all.iter().find(|(known, _)| *known == name) {
            return Ok(*part);
        }
        let near = nearest(name, all.map(|(name, _)| name)).map(|near| format!("; did you mean `{near}`?"));
        let hint = near.unwrap_or_else(|| "; choose of frames, percepts and view".to_owned());
        Err(Error::usage(format!("a recording has no `{name}`{hint}")))
    }
}
