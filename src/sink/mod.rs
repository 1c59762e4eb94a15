//! Sinks: where percepts go.
//!
//! A sink is told the names of the fields once and sees nothing of bodies or engines.

mod ndjson;
mod spec;

pub use ndjson::NdjsonSink;
pub use spec::SinkSpec;

use crate::error::Result;
use crate::percept::Percepts;

/// Something that takes percepts.
pub trait Sink {
    /// Takes all frames of `percepts`.
    ///
    /// # Errors
    /// They cannot be written; the message names where to.
    fn write(&mut self, percepts: &Percepts) -> Result<Flow>;

    /// Hands on at once what was held back to be written together.
    ///
    /// # Errors
    /// As [`Sink::write`].
    fn flush(&mut self) -> Result<Flow>;

    /// Ends the output and makes it whole. A sink dropped without this leaves no file behind.
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
