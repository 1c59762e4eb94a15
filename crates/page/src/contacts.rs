//! Onsets and releases: of touches of the whole body where these are looked for, else of fields.

use std::sync::Arc;

use super::exchange::Exchange;
use super::log::{About, Event, EventKind};
use crate::signal::Receptor;
use somatic_engine::percept::{Flags, Percepts};
use somatic_engine::scene::Plan;

/// What was touched in the last frame.
#[derive(Clone, Debug)]
pub(super) struct Contacts {
    /// By field.
    in_contact: Vec<bool>,
    /// By field, whether it is looked at: a field that reads a temperature is not touched by that.
    is_pressed: Vec<bool>,
    /// Touches: their ids and links.
    touching: Vec<(u64, u32)>,
    /// Whether the next frame does not follow the last one.
    pub(super) jumped: bool,
}

impl Contacts {
    /// For the fields of `plan` without touches: in letters of pressure, or else of shear, which presses too.
    pub(super) fn new(plan: &Plan) -> Self {
        let receptor = |letter: usize| plan.letters()[letter].receptor;
        let of_pressure = |letter: usize| receptor(letter).is_of_pressure();
        let has_pressure = plan.fields.iter().any(|field| of_pressure(field.letter));
        let is_pressed = |letter: usize| {
            if has_pressure { of_pressure(letter) } else { receptor(letter) == Receptor::Shear }
        };
        Self {
            in_contact: vec![false; plan.fields.len()],
            is_pressed: plan.fields.iter().map(|field| is_pressed(field.letter)).collect(),
            touching: Vec::new(),
            jumped: false,
        }
    }

    /// Adds what begins and ends in `percepts`.
    pub(super) fn note(&mut self, percepts: &Percepts, mut add: impl FnMut(Event)) {
        if percepts.touches(0).is_some() {
            return self.note_touches(percepts, add);
        }
        let fields = percepts.fields().max(1);
        for (frame, flags) in percepts.flags.chunks_exact(fields).enumerate() {
            let jumped = std::mem::take(&mut self.jumped);
            for (field, flags) in flags.iter().enumerate() {
                let touched = self.is_pressed[field] && !flags.contains(Flags::NO_CONTACT);
                if self.in_contact[field] == touched {
                    continue;
                }
                self.in_contact[field] = touched;
                if !jumped {
                    let kind = if touched { EventKind::Onset } else { EventKind::Release };
                    let t_s = percepts.t_s(frame);
                    add(Event { seq: 0, t_s, kind, about: About::Field(field as u32), text: None });
                }
            }
        }
    }

    fn note_touches(&mut self, percepts: &Percepts, mut add: impl FnMut(Event)) {
        let mut before = std::mem::take(&mut self.touching);
        for frame in 0..percepts.frames() {
            let jumped = std::mem::take(&mut self.jumped);
            let now = percepts.touches(frame).map_or(&[][..], |found| &found.touches);
            if !jumped {
                let t_s = percepts.t_s(frame);
                let event = |kind, id, link| Event { seq: 0, t_s, kind, about: About::Touch { id, link }, text: None };
                for &(id, link) in before.iter().filter(|(id, _)| now.iter().all(|touch| touch.id != *id)) {
                    add(event(EventKind::Release, id, link));
                }
                for touch in now.iter().filter(|touch| before.iter().all(|(id, _)| *id != touch.id)) {
                    add(event(EventKind::Onset, touch.id, touch.link));
                }
            }
            before.clear();
            before.extend(now.iter().map(|touch| (touch.id, touch.link)));
        }
        self.touching = before;
    }
}

/// Logs the onsets and releases of a recording, by a pass over all of it: each once, in their order, whatever is played.
#[derive(Debug)]
pub struct RecordingEvents {
    pub(super) exchange: Arc<Exchange>,
    pub(super) contacts: Contacts,
}

impl RecordingEvents {
    /// Takes the percepts of frames that follow those of the call before.
    pub fn see(&mut self, percepts: &Percepts) {
        let mut found = Vec::new();
        self.contacts.note(percepts, |event| found.push(event));
        if !found.is_empty() {
            let mut shared = self.exchange.lock();
            found.into_iter().for_each(|event| shared.log.push(event));
            drop(shared);
            self.exchange.wake_for_viewers();
        }
    }
}
