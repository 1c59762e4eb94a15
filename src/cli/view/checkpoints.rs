//! The engine's states along a recording, so that it can be entered anywhere.

use std::sync::{Mutex, MutexGuard, PoisonError};

use somatic::{Engine, EngineState, Percepts, Result};

use super::recording::{CHUNK, Recording};

/// States that are kept at most; where there are more, every second one goes.
const MAX_STATES: usize = 512;
/// Time between two states at first, s.
const SPACING_S: f64 = 10.0;

/// States in the order of their frames.
pub(super) struct Checkpoints {
    states: Mutex<States>,
}

struct States {
    kept: Vec<EngineState>,
    spacing_s: f64,
}

impl Checkpoints {
    /// With the state of `engine` alone, which has processed no frame.
    ///
    /// # Errors
    /// The device was lost.
    pub(super) fn new(engine: &mut Engine) -> Result<Self> {
        let states = States { kept: vec![engine.state()?], spacing_s: SPACING_S };
        Ok(Self { states: Mutex::new(states) })
    }

    fn lock(&self) -> MutexGuard<'_, States> {
        self.states.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// The time between two states, s.
    pub(super) fn spacing_s(&self) -> f64 {
        self.lock().spacing_s
    }

    /// Adds a state that comes after all others.
    pub(super) fn push(&self, state: EngineState) {
        let mut states = self.lock();
        states.kept.push(state);
        if states.kept.len() > MAX_STATES {
            let mut index = 0;
            states.kept.retain(|_| {
                index += 1;
                index % 2 == 1
            });
            states.spacing_s *= 2.0;
        }
    }

    /// The last state before which at most `frames` frames were processed.
    fn before(&self, frames: usize) -> EngineState {
        let states = self.lock();
        let after = states.kept.partition_point(|state| state.frames() <= frames as u64);
        states.kept[after - 1].clone()
    }

    /// Brings `engine`, which has processed `done` frames of `recording`, to where it has processed `frames`, or a chunk
    /// nearer; gives how many it has processed then. The percepts, which `passed` gets, are those of an uninterrupted run, to the bit.
    ///
    /// # Errors
    /// The device was lost.
    pub(super) fn advance(
        &self,
        engine: &mut Engine,
        recording: &Recording,
        (mut done, frames): (usize, usize),
        passed: impl FnOnce(&Percepts),
    ) -> Result<usize> {
        let state = self.before(frames);
        if done > frames || (state.frames() as usize) > done {
            engine.restore(&state)?;
            done = state.frames() as usize;
        }
        let next = frames.min(done + CHUNK);
        if next > done {
            passed(engine.process(&recording.frames[done..next])?);
        }
        Ok(next)
    }
}
