//! Frames that are played again and again, and how long engines take for them.

use std::hint::black_box;
use std::time::Instant;

use somatic::{Agreement, Engine, Frame, Result};

/// Rounds that are measured, in which every plan has its turn.
const ROUNDS: usize = 15;
/// A round's turn, s.
const TURN_S: f64 = 2e-3;
/// From the last frame to the first one of the next time, s.
const STEP_S: f64 = 0.01;

/// Frames as calls get them, again and again, in a time that goes on.
pub(super) struct Played {
    pub(super) calls: Vec<Vec<Frame>>,
}

impl Played {
    /// Puts all frames after what was.
    fn again(&mut self) {
        let times = || self.calls.iter().flatten().map(|frame| frame.t_s);
        let (first, last) = (times().fold(f64::INFINITY, f64::min), times().fold(f64::NEG_INFINITY, f64::max));
        let later = last - first + STEP_S;
        self.calls.iter_mut().flatten().for_each(|frame| frame.t_s += later);
    }

    /// How near its percepts are to the reference's.
    pub(super) fn compared(&mut self, engine: &mut Engine) -> Result<Agreement> {
        let mut sum = Agreement::default();
        for frames in &self.calls {
            sum.merge(engine.process_and_compare(frames)?.1);
        }
        Ok(sum)
    }
}

/// The median time of a frame on each of `engines`, which take turns, µs.
pub(super) fn measured(engines: &mut [Engine], played: &mut Played) -> Result<Vec<f64>> {
    let mut times = vec![Vec::with_capacity(ROUNDS); engines.len()];
    for round in 0..=ROUNDS {
        for (engine, times) in engines.iter_mut().zip(&mut times) {
            let (mut took_s, mut frames) = (0.0, 0);
            while took_s < TURN_S {
                played.again();
                let start = Instant::now();
                for call in &played.calls {
                    black_box(engine.process(black_box(call))?);
                    frames += call.len();
                }
                took_s += start.elapsed().as_secs_f64();
            }
            // The first round warms up.
            if round > 0 {
                times.push(took_s * 1e6 / frames as f64);
            }
        }
    }
    let median = |mut times: Vec<f64>| {
        times.sort_by(f64::total_cmp);
        times[times.len() / 2]
    };
    Ok(times.into_iter().map(median).collect())
}
