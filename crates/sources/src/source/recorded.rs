//! Recordings in MCAP as a source.

use super::Source;
use crate::error::Result;
use crate::recording::Reader;
use crate::signal::Frame;

impl Source for Reader {
    fn taxels(&self) -> &[u32] {
        Self::taxels(self)
    }

    fn next_frame(&mut self, frame: &mut Frame) -> Result<bool> {
        Self::next_frame(self, frame)
    }

    fn progress(&self) -> Option<f64> {
        Some(Self::progress(self))
    }

    fn skip_to(&mut self, t_s: f64) {
        Self::skip_to(self, t_s);
    }

    fn report_stale(&mut self) {
        Self::report_stale(self);
    }

    fn has_stale(&self) -> bool {
        Self::has_stale(self)
    }

    fn notices(&mut self) -> Vec<String> {
        Self::notices(self)
    }

    fn losses(&self) -> Vec<String> {
        Self::losses(self)
    }
}
