//! A recording in memory, by time.

use std::ops::Range;
use std::sync::atomic::{AtomicBool, Ordering};

use somatic::internal::page::Mode;
use somatic::internal::scene::{SenseRanges, SensedTaxels};
use somatic::source::Source;
use somatic::{Body, Engine, Error, Frame, Result};

use super::super::stdio::say;

/// Frames that are processed in one call.
pub(super) const CHUNK: usize = 256;
/// Most values that are searched for a recording's largest pressure: a second's work.
const MAX_SEARCHED: usize = 20_000_000;
/// Time for which a frame is shown in bins after its own at most, s.
const MAX_HELD_S: f64 = 1.0;
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
        let mut shown_s = 0;
        loop {
            let mut frame = Frame::missing(0.0, taxels.len());
            let is_there = source.next_frame(&mut frame)?;
            source.notices().iter().filter(|_| !quiet).for_each(|notice| say(notice));
            if !is_there {
                break;
            }
            latest_s.push(latest_s.last().map_or(frame.t_s, |&latest: &f64| latest.max(frame.t_s)));
            frames.push(frame);
            if frames.len() % FRAMES_A_LOOK == 0 {
                if stop.load(Ordering::Relaxed) {
                    return Ok(None);
                }
                let seconds = started.elapsed().as_secs();
                if let Some(progress) = source.progress().filter(|_| !quiet && seconds > shown_s) {
                    shown_s = seconds;
                    say(&format!("reading: {:.0} %", 100.0 * progress));
                }
            }
        }
        source.closing().iter().filter(|_| !quiet).for_each(|line| say(line));
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

    /// Which of `count` bins of `width_s` seconds, the first from `from_s` on, show frame `index`: those up to the next frame,
    /// unless that comes late.
    pub(super) fn bins(&self, index: usize, from_s: f64, width_s: f64, count: usize) -> Range<usize> {
        let bin = |t_s: f64| (((t_s - from_s) / width_s).max(0.0) as usize).min(count - 1);
        let t_s = self.frames[index].t_s;
        let next_s = self.frames.get(index + 1).map(|next| next.t_s).filter(|next_s| next_s - t_s < MAX_HELD_S);
        let first = bin(t_s);
        first..next_s.map_or(first, bin).max(first + 1)
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

    /// The temperatures, distances and tangential forces that taxels of `body` read, unless finding them takes long.
    pub(super) fn sense_ranges(&self, engine: &Engine, body: &Body) -> SenseRanges {
        let mut ranges = SenseRanges::default();
        let sensed = SensedTaxels::new(engine.plan(), body);
        if sensed.channels().is_empty() || self.frames.len() * self.taxels.len() > MAX_SEARCHED {
            return ranges;
        }
        let mut values = Vec::new();
        for frame in &self.frames {
            engine.sensed_alone(frame, &sensed, &mut values);
            values.iter().for_each(|value| ranges.see(value));
        }
        ranges
    }
}

#[cfg(test)]
mod tests {
    use somatic::source::CsvSource;

    use super::*;

    fn recording(rows: &str) -> Recording {
        let source = CsvSource::from_reader("a", std::io::Cursor::new(format!("t,4\n{rows}")), None, None).unwrap();
        Recording::read(Box::new(source), &AtomicBool::new(false), true).unwrap().unwrap()
    }

    #[test]
    fn a_frame_is_found_by_time_and_shown_until_the_next() {
        let recording = recording("0,1\n0.1,2\n0.2,3\n5,4\n4,5\n6,6\n");
        assert_eq!(
            [-1.0, 0.0, 0.15, 0.2, 4.9, 5.0, 5.5, 9.0].map(|t_s| recording.index_at(t_s)),
            [0, 0, 1, 2, 2, 4, 4, 5]
        );
        assert_eq!(recording.span_s(), [0.0, 6.0]);
        let bins = |index| recording.bins(index, 0.0, 0.05, 200);
        assert_eq!([bins(0), bins(1), bins(2), bins(3)], [0..2, 2..4, 4..5, 100..101]);
        assert_eq!(recording.bins(5, 0.0, 1.0, 6), 5..6);
    }

    #[test]
    fn a_recording_without_frames_is_refused() {
        let source = CsvSource::from_reader("a", &b"t,4\n"[..], None, None).unwrap();
        assert!(Recording::read(Box::new(source), &AtomicBool::new(false), true).is_err());
    }
}
