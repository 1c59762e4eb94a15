//! The pass over a recording behind the player: states to enter it anywhere, and where it is touched.

use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant};

use serde_json::json;
use somatic::internal::page::RecordingEvents;
use somatic::internal::parallel;
use somatic::{Engine, Letter, Result};

use super::super::stdio::say;
use super::recorded::Recorded;
use super::recording::{CHUNK, Recording};
use super::shared::Shared;

/// Parts of the recording that the page shows.
const BINS: usize = 600;
/// Time between two messages.
const INTERVAL: Duration = Duration::from_millis(100);

/// Where a recording is touched, as far as it has been computed.
pub(super) struct Timeline {
    start_s: f64,
    bin_s: f64,
    known: Mutex<Known>,
}

struct Known {
    until_s: f64,
    /// By bin, the largest peak; none where nothing is touched.
    peaks: Vec<Option<f64>>,
    /// By bin, how many frames have other percepts in the recording; none where it holds no percepts.
    differing: Option<Vec<u32>>,
}

impl Timeline {
    /// For a recording before anything has been computed.
    pub(super) fn new(recording: &Recording) -> Self {
        let [start_s, end_s] = recording.span_s();
        let known = Mutex::new(Known { until_s: start_s, peaks: vec![None; BINS], differing: None });
        Self { start_s, bin_s: (end_s - start_s).max(1e-9) / BINS as f64, known }
    }

    fn known(&self) -> MutexGuard<'_, Known> {
        self.known.lock().unwrap_or_else(PoisonError::into_inner)
    }

    fn bin(&self, t_s: f64) -> usize {
        (((t_s - self.start_s) / self.bin_s) as usize).min(BINS - 1)
    }

    /// Adds the percepts of a call.
    fn add(&self, engine: &Engine, recording: &Recording, first: usize) {
        let (percepts, letters) = (engine.percepts(), engine.plan().letters());
        let is_of_pressure = |letter: &Letter| letter.receptor.is_of_pressure();
        let is_shown = |letter: usize| is_of_pressure(&letters[letter]) || !letters.iter().any(is_of_pressure);
        let mut known = self.known();
        for frame in 0..percepts.frames() {
            known.until_s = known.until_s.max(percepts.t_s(frame));
            let peak = match percepts.touches(frame) {
                Some(found) => found.touches.iter().map(|touch| touch.peak).reduce(f64::max),
                // Without the output `peak`, that something is touched.
                None => {
                    let shown = percepts.touched(frame).filter(|percept| is_shown(percept.letter));
                    let peaks = shown.map(|percept| percept.peak.or(percept.total).unwrap_or(1.0));
                    peaks.reduce(f64::max)
                }
            };
            let Some(peak) = peak else { continue };
            for most in &mut known.peaks[recording.bins(first + frame, self.start_s, self.bin_s, BINS)] {
                *most = Some(most.map_or(peak, |most| most.max(peak)));
            }
        }
    }

    /// Adds which frames from `first` on have other percepts in the recording.
    fn add_differing(&self, differs: &[bool], recording: &Recording, first: usize) {
        let mut known = self.known();
        let counts = known.differing.get_or_insert_with(|| vec![0; BINS]);
        for (frame, _) in differs.iter().enumerate().filter(|(_, differs)| **differs) {
            counts[self.bin(recording.frames[first + frame].t_s)] += 1;
        }
    }

    /// The message that holds what is known from bin `first_bin` on.
    pub(super) fn message(&self, first_bin: usize) -> String {
        let known = self.known();
        json!({
            "type": "timeline",
            "computed_until_s": known.until_s,
            "bins": BINS,
            "first_bin": first_bin,
            "peak": known.peaks[first_bin..=self.bin(known.until_s)],
            "differing": known.differing.as_ref().map(|counts| &counts[first_bin..=self.bin(known.until_s)]),
        })
        .to_string()
    }
}

/// Starts the pass on a thread of its own, which compares with what is `recorded` and logs `events`. It ends with the recording.
pub(super) fn start(shared: Shared, recorded: Option<Recorded>, events: RecordingEvents) -> Arc<Timeline> {
    let timeline = Arc::new(Timeline::new(&shared.recording));
    let filled = Arc::clone(&timeline);
    std::thread::spawn(move || {
        // The player's calls share the cores' other threads among each other.
        if let Err(error) = parallel::aside(|| pass(&shared, recorded, events, &filled)) {
            say(&format!("{error}; the recording can be played, but jumps take long"));
        }
    });
    timeline
}

fn pass(
    shared: &Shared,
    mut recorded: Option<Recorded>,
    mut events: RecordingEvents,
    timeline: &Timeline,
) -> Result<()> {
    let Shared { recording, checkpoints, replies, differences, peaks, .. } = shared;
    let mut engine = shared.engine()?;
    let (mut done, mut first_bin) = (0, 0);
    let mut state_at_s = timeline.start_s;
    let mut sent_at = Instant::now();
    for frames in recording.frames.chunks(CHUNK) {
        engine.process(frames)?;
        timeline.add(&engine, recording, done);
        let percepts = engine.percepts();
        events.see(percepts);
        if let Some(recorded) = &mut recorded {
            timeline.add_differing(&recorded.compare(percepts, recording, done, differences)?, recording, done);
        }
        peaks.see(&engine, frames);
        done += frames.len();
        let now_s = frames[frames.len() - 1].t_s;
        if now_s - state_at_s >= checkpoints.spacing_s() {
            state_at_s = now_s;
            checkpoints.push(engine.state()?);
        }
        if sent_at.elapsed() >= INTERVAL || done == recording.frames.len() {
            sent_at = Instant::now();
            replies.all(timeline.message(first_bin));
            first_bin = timeline.bin(now_s);
        }
    }
    Ok(())
}
