//! What every format's reader is: lines in, frames out, without input or output.

use super::layout::Layout;
use crate::error::{Error, Result, failed};
use crate::signal::Frame;

/// Reads frames from lines. An error has no line number; whoever reads the lines adds it.
pub(super) trait Parser: Send {
    /// Takes the next line. `true` if it completes a frame, which is in `to` then.
    ///
    /// # Errors
    /// The line is not what it should be.
    fn line(&mut self, line: &[u8], to: &mut Frame) -> Result<bool>;

    /// Takes the end. `true` if it completes a frame, which is in `to` then.
    ///
    /// # Errors
    /// The last frame is incomplete.
    fn end(&mut self, to: &mut Frame) -> Result<bool>;

    /// Where a line is cut short that ends the file: `true` if what was complete before it was still held back, and is in `to` now.
    fn rest(&mut self, _to: &mut Frame) -> bool {
        false
    }

    /// What of its values was not to be used, in a line.
    fn losses(&self) -> Option<String> {
        None
    }

    /// Goes on after a line that is not what it should be, with the next frame; its own frame counts for the times that a rate
    /// gives. `false` if that is not possible, as nothing marks where the next frame begins.
    fn go_on(&mut self) -> bool {
        false
    }

    /// Whether frames are of several lines, so that [`Parser::go_on`] passes over the rest of one.
    fn is_of_lines(&self) -> bool {
        false
    }

    /// What was understood of its columns, in a line, where that is not plain.
    fn understood(&self) -> Option<String> {
        None
    }

    /// The sensors, known from the first frame on.
    fn layout(&self) -> Layout;
}

/// Where frames without times get theirs: a rate that is given.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Rate {
    hz: Option<f64>,
    first: Option<u32>,
    frames: u64,
}

impl Rate {
    pub(super) fn new(hz: Option<f64>) -> Result<Self> {
        match hz {
            Some(hz) if !(hz.is_finite() && hz > 0.0) => {
                Err(Error::usage(format!("--rate {hz} is not a frame rate; give a positive number of Hz")))
            }
            _ => Ok(Self { hz, first: None, frames: 0 }),
        }
    }

    /// Passes over a frame that is not whole.
    pub(super) fn pass(&mut self) {
        self.frames += 1;
    }

    /// The time of the next frame, which the recording says is at `t_s`, or says to have the number `number`.
    pub(super) fn time_of(&mut self, t_s: Option<f64>, number: Option<u32>) -> Result<f64> {
        let index = match number {
            Some(number) => f64::from(number) - f64::from(*self.first.get_or_insert(number)),
            None => self.frames as f64,
        };
        self.frames += 1;
        match (t_s, self.hz) {
            (Some(_), Some(_)) => Err(Error::usage("the recording has its own times; leave out --rate")),
            (Some(t_s), None) if t_s.is_finite() => Ok(t_s),
            (Some(t_s), None) => Err(failed!("a frame is at {t_s} s; times are finite")),
            (None, Some(hz)) => Ok(index / hz),
            (None, None) => Err(Error::usage("the recording has no times; give its frame rate with --rate HZ")),
        }
    }
}

/// Where a reader of frames of several lines, whose first lines are marked, goes on after a wrong line.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct AfterWrong {
    /// What is left of a frame is passed over.
    is_passing: bool,
    /// The wrong line is the first one of the next frame, and showed that the frame before is not whole.
    has_begun: bool,
}

impl AfterWrong {
    /// Whether a line is passed over, which `begins` a frame or does not.
    pub(super) fn passes(&self, begins: impl FnOnce() -> bool) -> bool {
        self.is_passing && !begins()
    }

    /// A frame begins; `before` is what became of the one before.
    pub(super) fn begin(&mut self, before: &Result<bool>) {
        *self = Self { is_passing: false, has_begun: before.is_err() };
    }

    /// After a wrong line, passes over the rest of its frame; `false` if the next one has begun.
    pub(super) fn pass_rest(&mut self) -> bool {
        self.is_passing = !std::mem::take(&mut self.has_begun);
        self.is_passing
    }
}
