//! Frames of the skin from the frames that readers deliver.

use std::sync::{Arc, PoisonError};
use std::time::{Duration, Instant};

use super::lines::{Lines, Shared};
use super::merge::{Merge, Pace};
use crate::error::{Error, Result};
use crate::signal::{Frame, RawValue};

/// How often to check whether the lines are closed.
const CLOSE_POLL: Duration = Duration::from_millis(50);

impl Pace {
    /// The pace that `--live-rate` asks for.
    ///
    /// # Errors
    /// It is not a rate.
    pub(in crate::source) fn from_rate(live_rate_hz: Option<f64>) -> Result<Self> {
        match live_rate_hz {
            None => Ok(Self::Fastest),
            Some(0.0) => Ok(Self::Arrival),
            Some(hz) if (0.001..=1e5).contains(&hz) => Ok(Self::Every(hz.recip())),
            Some(hz) => Err(Error::usage(format!("--live-rate {hz} is not a rate; give 0.001 to 100000 Hz, or 0"))),
        }
    }
}

/// The merged frames of all boards.
pub(in crate::source) struct Merged {
    pub(in crate::source) lines: Lines,
    merge: Merge,
    /// Number of values of a frame.
    width: usize,
    start: Instant,
    read_at: Option<Instant>,
}

impl Merged {
    /// Of what is delivered to `shared`, which has begun at `start`, by `merge`, in frames of `width` values.
    pub(in crate::source) fn new(shared: Arc<Shared>, merge: Merge, width: usize, start: Instant) -> Self {
        Self { lines: Lines(shared), merge, width, start, read_at: None }
    }

    /// As [`crate::source::Source::next_frame`].
    pub(in crate::source) fn next_frame(&mut self, frame: &mut Frame) -> Result<bool> {
        let shared = Arc::clone(&self.lines.0);
        let mut state = shared.lock();
        loop {
            if state.closed {
                return Ok(false);
            }
            let due = match state.take() {
                Some((came, read_at)) => {
                    let due = self.merge.take(&came);
                    let (replaced, drift, rate_hz) = self.merge.board_statistics(came.board);
                    let account = &mut state.accounts[came.board];
                    (account.replaced, account.drift, account.rate_hz) = (replaced, drift, rate_hz);
                    self.read_at = Some(read_at);
                    due
                }
                None => {
                    // A frame of silent boards has no time of reading.
                    let has_read_time = self.merge.is_timed() || self.merge.is_waiting();
                    let due = self.merge.tick(self.start.elapsed().as_secs_f64());
                    self.read_at = self.read_at.filter(|_| due.is_none() || has_read_time);
                    due
                }
            };
            if let Some(at_s) = due {
                frame.values.resize(self.width, RawValue::MISSING);
                self.merge.fill(at_s, frame);
                for (board, account) in state.accounts.iter_mut().enumerate() {
                    account.replaced = self.merge.board_statistics(board).0;
                }
                return Ok(true);
            }
            if !state.queue.is_empty() {
                continue;
            }
            if let Some(error) = state.fatal_error() {
                return Err(error);
            }
            let until_due = |due_s: f64| Duration::try_from_secs_f64(due_s - self.start.elapsed().as_secs_f64());
            let wait = self.merge.due_s().map_or(CLOSE_POLL, |due| until_due(due).unwrap_or_default().min(CLOSE_POLL));
            state = shared.arrived.wait_timeout(state, wait).unwrap_or_else(PoisonError::into_inner).0;
        }
    }

    /// As [`crate::source::Source::read_at`].
    pub(in crate::source) fn read_at(&mut self) -> Option<Instant> {
        self.read_at.take()
    }
}

impl Drop for Merged {
    fn drop(&mut self) {
        self.lines.close();
    }
}
