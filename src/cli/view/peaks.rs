//! The highest pressure of each taxel in parts of a recording, as far as the pass behind the player has come.

use std::collections::HashMap;
use std::ops::Range;
use std::sync::{Mutex, MutexGuard, PoisonError};

use somatic::{Body, Engine, Frame};

use super::recording::Recording;

/// Parts at most.
const MAX_PARTS: usize = 600;
/// Values of all parts together at most: 16 MB.
const MAX_VALUES: usize = 4 << 20;

/// By parts of a recording, each of as many frames, the highest pressure of each taxel.
pub(super) struct Peaks {
    /// Frames of a part; the last one may have fewer.
    frames: usize,
    /// By a frame's values, the id of the taxel and its index in the body.
    taxels: Vec<(u32, usize)>,
    known: Mutex<Known>,
}

struct Known {
    /// Parts whose frames have all been seen.
    parts: Vec<Vec<f32>>,
    /// The part that is being filled, and its frames so far.
    filling: (Vec<f32>, usize),
}

impl Peaks {
    /// For `recording` on `body`, with no part known.
    pub(super) fn new(body: &Body, recording: &Recording) -> Self {
        let index_of: HashMap<u32, usize> = body.taxels.iter().enumerate().map(|(at, taxel)| (taxel.id, at)).collect();
        let parts = (MAX_VALUES / body.taxels.len().max(1)).clamp(1, MAX_PARTS);
        let known = Known { parts: Vec::new(), filling: (vec![f32::NAN; body.taxels.len()], 0) };
        Self {
            frames: recording.frames.len().div_ceil(parts),
            // The engine has said already which ids the body lacks.
            taxels: recording.taxels.iter().filter_map(|&id| Some((id, *index_of.get(&id)?))).collect(),
            known: Mutex::new(known),
        }
    }

    fn known(&self) -> MutexGuard<'_, Known> {
        self.known.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Takes in the next `frames`, which `engine` has just processed.
    pub(super) fn see(&self, engine: &Engine, mut frames: &[Frame]) {
        let mut known = self.known();
        while !frames.is_empty() {
            let (most, seen) = &mut known.filling;
            let (of_part, rest) = frames.split_at(frames.len().min(self.frames - *seen));
            self.add(engine, of_part, most);
            *seen += of_part.len();
            frames = rest;
            if *seen == self.frames {
                let empty = vec![f32::NAN; most.len()];
                let full = std::mem::replace(most, empty);
                *seen = 0;
                known.parts.push(full);
            }
        }
    }

    /// Raises `most`, by the body's taxels, to the pressures of `frames`, which `engine` has just processed.
    pub(super) fn add(&self, engine: &Engine, frames: &[Frame], most: &mut [f32]) {
        let mut pressures = Vec::new();
        for frame in frames {
            engine.pressures(frame, &mut pressures);
            // In the order of the frame's values, without those that are not known.
            let mut taxels = self.taxels.iter();
            for &(id, pressure) in &pressures {
                if let Some(&(_, taxel)) = taxels.find(|(of_value, _)| *of_value == id) {
                    most[taxel] = most[taxel].max(pressure as f32);
                }
            }
        }
    }

    /// Raises `most` to the peaks of the whole parts within `shown`. Gives which of its frames these are: none at its end where
    /// there is no such part.
    pub(super) fn of_whole_parts(&self, shown: Range<usize>, most: &mut [f32]) -> Range<usize> {
        let known = self.known();
        let first = shown.start.div_ceil(self.frames);
        let end = (shown.end / self.frames).min(known.parts.len());
        if first >= end {
            return shown.end..shown.end;
        }
        for part in &known.parts[first..end] {
            most.iter_mut().zip(part).for_each(|(most, peak)| *most = most.max(*peak));
        }
        first * self.frames..end * self.frames
    }
}
