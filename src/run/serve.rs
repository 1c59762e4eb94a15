//! Hands frames and percepts to sinks.

use super::observer::{Observer, Remark};
use crate::error::Result;
use crate::percept::Percepts;
use crate::sink::{Flow, InputFrames, Sink};

/// The sinks of a run.
pub(super) struct Sinks {
    pub(super) open: Vec<Box<dyn Sink + Send>>,
    /// Whether somebody waits for every frame.
    pub(super) is_live: bool,
    /// Whether one could not go on.
    pub(super) has_failed: bool,
}

impl Sinks {
    /// Does something with each sink that somebody reads. While somebody waits for every frame, a sink that fails is reported and
    /// left out, and the others go on; the last one that fails is an error.
    pub(super) fn each(
        &mut self,
        observer: &mut dyn Observer,
        mut act: impl FnMut(&mut dyn Sink) -> Result<Flow>,
    ) -> Result<()> {
        let mut index = 0;
        while index < self.open.len() {
            match act(&mut *self.open[index]) {
                Ok(Flow::Open) => index += 1,
                Ok(Flow::Closed) => self.open.remove(index).finish()?,
                Err(error) if self.is_live && self.open.len() > 1 => {
                    observer.remark(Remark::Warning, &format!("{error}; continuing without it"));
                    self.has_failed = true;
                    drop(self.open.remove(index));
                }
                Err(error) => return Err(error),
            }
        }
        Ok(())
    }

    /// Gives every sink the frames and what the engine made of them.
    pub(super) fn give(
        &mut self,
        observer: &mut dyn Observer,
        input: &InputFrames<'_>,
        percepts: &Percepts,
    ) -> Result<()> {
        let flush = self.is_live;
        self.each(observer, |sink| {
            for flow in [sink.write_input(input)?, sink.write(percepts)?] {
                if flow == Flow::Closed {
                    return Ok(flow);
                }
            }
            if flush { sink.flush() } else { Ok(Flow::Open) }
        })
    }

    /// Gives every sink percepts that limbs have computed.
    pub(super) fn give_lines(&mut self, observer: &mut dyn Observer, lines: &[String]) -> Result<()> {
        self.each(observer, |sink| match sink.write_percepts_of_limbs(lines)? {
            Flow::Open => sink.flush(),
            Flow::Closed => Ok(Flow::Closed),
        })
    }
}
