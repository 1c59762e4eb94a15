//! A recording in memory, by time.

use std::sync::atomic::{AtomicBool, Ordering};

use somatic::page::Mode;
use somatic::source::Source;
use somatic::{Engine, Error, Frame, Result};

use super::super::stdio::say;

/// Frames that are processed in one call.
pub(super) const CHUNK: usize = 256;
/// Values of which a recording is searched for its largest pressure: a second's work.
const MAX_SEARCHED: usize = 20_000_000;
/// Frames between two looks at whether reading takes long.
const FRAMES_A_LOOK: usize = 4096;

/// All frames of a recording.
pub(super) struct Recording {
    /// The ids of a frame's values, in their order.
    pub(super) taxels: Vec<u32>,
    pub(super) frames: Vec<Frame>,
    /// By frame, the latest time so far, s: rises where recorded time goes back.
    latest_s: Vec<f64>,
    /// What was never read.
    pub(super) losses: Vec<String>,
}

impl Recording {
    /// Reads all of `source`. `None` if `stop` was set meanwhile.
    ///
    /// # Errors
    /// It cannot be read, or has no frames.
    pub(super) fn read(mut source: Box<dyn Source + Send>, stop: &AtomicBool, quiet: bool) -> Result<Option<Self>> {
        let taxels = source.taxels().to_vec();
        let (mut frames, mut latest_s) = (Vec::new(), Vec::new());
        let started = std::time::Instant::now();
        let mut told = 0;
        loop {
            let mut frame = Frame::missing(0.0, taxels.len());
            if !source.next_frame(&mut frame)? {
                break;
            }
            latest_s.push(latest_s.last().map_or(frame.t_s, |&latest: &f64| latest.max(frame.t_s)));
            frames.push(frame);
            if frames.len() % FRAMES_A_LOOK == 0 {
                if stop.load(Ordering::Relaxed) {
                    return Ok(None);
                }
                let seconds = started.elapsed().as_secs();
                if let Some(progress) = source.progress().filter(|_| !quiet && seconds > told) {
                    told = seconds;
                    say(&format!("reading: {:.0} %", 100.0 * progress));
                }
            }
        }
        if frames.is_empty() {
            return Err(Error::failed("the recording has no frames"));
        }
        Ok(Some(Self { taxels, frames, latest_s, losses: source.losses() }))
    }

    /// Times of its first and last frame, s.
    pub(super) fn span_s(&self) -> [f64; 2] {
        [self.latest_s[0], self.latest_s[self.latest_s.len() - 1]]
    }

    pub(super) fn mode(&self) -> Mode {
        let [start_s, end_s] = self.span_s();
        Mode::Recording { start_s, end_s, frames: self.frames.len() as u64 }
    }

    /// The last frame at or before `t_s`, or the first one.
    pub(super) fn index_at(&self, t_s: f64) -> usize {
        self.latest_s.partition_point(|&latest| latest <= t_s).saturating_sub(1)
    }

    /// The largest pressure, unless finding it takes long.
    pub(super) fn largest_pressure(&self, engine: &Engine) -> Option<f64> {
        if self.frames.len() * self.taxels.len() > MAX_SEARCHED {
            return None;
        }
        let mut pressures = Vec::new();
        let largest = self.frames.iter().map(|frame| {
            engine.pressures(frame, &mut pressures);
            pressures.iter().map(|&(_, pressure)| pressure).fold(0.0, f64::max)
        });
        Some(largest.fold(0.0, f64::max)).filter(|&largest| largest > 0.0)
    }
}
