//! Frames to measure on.

use std::time::Duration;

use crate::body::Body;
use crate::signal::{Channel, Frame, RawValue};
use crate::source::Truth;

/// Frames, and their truth if known.
#[derive(Clone, Debug, Default)]
pub struct TestFrames {
    /// Their source, for display.
    pub source: String,
    /// The ids of their taxels.
    pub taxels: Vec<u32>,
    /// The frames.
    pub frames: Vec<Frame>,
    /// Per frame; empty if unknown.
    pub truth: Vec<Vec<Truth>>,
}

/// Values that made-up frames hold, about, and how far apart these are, s.
const MADE_UP_VALUES: usize = 1 << 22;
const MADE_UP_STEP_S: f64 = 0.01;

impl TestFrames {
    /// Frames for a body that nobody has recorded, or cannot be read again, in which every channel has a value, each time another: enough
    /// for a call of `at_once`, and for motion.
    #[must_use]
    pub fn made_up(body: &Body, at_once: usize) -> Self {
        let taxels = Channel::all_of(body);
        let count = at_once.max((MADE_UP_VALUES / taxels.len().max(1)).clamp(2, 64));
        let values = |frame| (0..taxels.len()).map(|index| made_up_value(index, frame)).collect();
        let made = |frame| Frame { t_s: frame as f64 * MADE_UP_STEP_S, values: values(frame), ..Frame::default() };
        let frames = (0..count).map(made).collect();
        Self { source: "made-up values".to_owned(), taxels, frames, truth: Vec::new() }
    }
}

/// The value of channel `index` of a body in made-up frame `frame`.
pub(super) fn made_up_value(index: usize, frame: usize) -> RawValue {
    RawValue::new(((index * 7 + frame * 131) % 977 + 1) as f64)
}

/// Time of a turn of what is measured beside others, about.
pub(super) const TURN_TIME: Duration = Duration::from_micros(1500);

/// Calls of some frames each, which are repeated with continuing times.
pub(super) struct Calls {
    pub(super) calls: Vec<Vec<Frame>>,
    times_s: Vec<Vec<f64>>,
    period_s: f64,
}

impl Calls {
    pub(super) fn new(frames: &[Frame], at_once: usize) -> Self {
        let calls: Vec<Vec<Frame>> = frames.chunks(at_once).map(<[Frame]>::to_vec).collect();
        let times_s = calls.iter().map(|call| call.iter().map(|frame| frame.t_s).collect()).collect();
        let times = || frames.iter().map(|frame| frame.t_s);
        let (first, last) = (times().fold(f64::INFINITY, f64::min), times().fold(f64::NEG_INFINITY, f64::max));
        let step = if frames.len() > 1 { (last - first) / (frames.len() - 1) as f64 } else { 0.0 };
        Self { calls, times_s, period_s: last - first + if step > 0.0 { step } else { 0.01 } }
    }

    /// Call `index` in pass `passes`.
    pub(super) fn at(&mut self, index: usize, passes: u32) -> &[Frame] {
        let later = self.period_s * f64::from(passes);
        for (frame, t_s) in self.calls[index].iter_mut().zip(&self.times_s[index]) {
            frame.t_s = t_s + later;
        }
        &self.calls[index]
    }
}
