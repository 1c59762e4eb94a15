//! Who watches a run.

use std::time::Instant;

use super::feed::FrameInfo;
use crate::engine::{Engine, EngineState};
use crate::signal::Frame;
use crate::sink::{News, Question};

/// How a remark is shown.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Remark {
    /// Of the frames: where a table fills the terminal, it may be left out.
    Note,
    /// Of the run itself.
    Warning,
}

/// Somebody who watches a run, beside its sinks. Of all of this nothing has to be looked at.
pub trait Observer {
    /// Whether somebody still looks when the last reader of the sinks has gone.
    fn is_watching(&self) -> bool {
        false
    }

    /// Something is to be said.
    fn remark(&mut self, _kind: Remark, _text: &str) {}

    /// Viewers ask why percepts of `frames`, which come next, are what they are; the engine's state before them is `state`.
    fn asked(&mut self, _questions: Vec<Question>, _state: EngineState, _frames: &[Frame]) {}

    /// `frames` went through the engine.
    fn computed(&mut self, _engine: &Engine, _frames: &[Frame], _info: &FrameInfo) {}

    /// Another recording begins, called `name`: frames of `taxels`, which go through `engine`.
    fn began(&mut self, _name: &str, _engine: &Engine, _taxels: &[u32]) {}

    /// All sinks have what was read at these times.
    fn written(&mut self, _read_at: &[Instant]) {}

    /// Percepts that limbs have computed since the last call, a line of NDJSON each, and when each was read.
    fn percepts_of_limbs(&mut self) -> Option<(Vec<String>, Vec<Instant>)> {
        None
    }

    /// News of boards for the sinks, if there is any; called once a turn.
    fn news(&mut self) -> Option<News> {
        None
    }

    /// A turn is over: some 25 times a second, or once a call of the engine.
    fn turned(&mut self) {}
}

impl Observer for () {}
