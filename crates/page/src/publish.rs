//! The engine's side: hands over frames, percepts and events without ever waiting for a viewer.

use std::collections::HashMap;
use std::sync::{Arc, MutexGuard};
use std::time::Instant;

use super::contacts::{Contacts, RecordingEvents};
use super::exchange::{Exchange, Shared, WAITING_ROWS};
use super::log::{About, Event, EventKind};
use super::scene::PageScene;
use super::series::{Series, Trail};
use super::snapshot::Snapshot;
use crate::signal::{BoardHealth, Frame, Pose, RawValue, Reading};
use somatic_engine::percept::{Percepts, TouchTrails};
use somatic_engine::scene::Plan;

/// Events that wait for their log at most.
const MAX_WAITING_EVENTS: usize = 4096;

/// The newest frame of an engine's call, before its percepts.
#[derive(Clone, Copy, Debug)]
pub struct PageInput<'a> {
    /// The frame.
    pub frame: &'a Frame,
    /// The values that its percepts are made of ([`Engine::values_read`](somatic_engine::Engine::values_read)).
    pub values_read: Option<&'a [RawValue]>,
    /// What is wrong with values that were corrected ([`Engine::values_noted`](somatic_engine::Engine::values_noted)).
    pub values_noted: &'a [(usize, Reading)],
    /// The values that its letters beside pressure are made of ([`Engine::values_sensed`](somatic_engine::Engine::values_sensed)).
    pub values_sensed: &'a [RawValue],
    /// The engine's plan as it is after the call.
    pub plan: &'a Plan,
    /// When the frame arrived, if not just now.
    pub arrived: Option<Instant>,
    /// What the call took a frame, µs.
    pub call_us: f32,
    /// Number of the frame, if not the engine's.
    pub number: Option<u64>,
}

/// Hands frames over to the server. In the steady state it neither allocates nor waits: what the server is just looking at
/// is handed over with the next frame, or by [`Publisher::flush`].
#[derive(Debug)]
pub struct Publisher {
    exchange: Arc<Exchange>,
    snapshot: Box<Snapshot>,
    /// Whether the snapshot has not been handed over.
    is_new: bool,
    /// By the plan's channels, where a frame has their values.
    value_of: Vec<Option<usize>>,
    index_of_link: HashMap<String, u32>,
    /// Poses of the last frame that was not late with them.
    last_poses: Vec<(u32, Pose)>,
    /// Of the last frame; none where a pass over the recording logs them.
    contacts: Option<Contacts>,
    /// Before the first frame.
    no_contacts: Contacts,
    /// Where touches were.
    trails: TouchTrails,
    number: Option<u64>,
    published: u64,
    events: Vec<Event>,
    series: Arc<[Series]>,
    /// Every index of these.
    columns: Vec<usize>,
    trail: Trail,
}

impl Publisher {
    pub(super) fn new(exchange: Arc<Exchange>, scene: &PageScene) -> Self {
        Self {
            exchange,
            snapshot: Box::new(Snapshot::new(&scene.plan)),
            is_new: false,
            value_of: scene.value_of.clone(),
            index_of_link: scene.index_of_link.clone(),
            last_poses: Vec::new(),
            contacts: Some(Contacts::new(&scene.plan)),
            no_contacts: Contacts::new(&scene.plan),
            trails: TouchTrails::default(),
            number: None,
            published: 0,
            events: Vec::with_capacity(MAX_WAITING_EVENTS),
            series: Arc::default(),
            columns: Vec::new(),
            trail: Trail::default(),
        }
    }

    /// Number of viewers: where there are none, what is only for them can be left out.
    #[must_use]
    pub fn viewers(&self) -> usize {
        self.exchange.viewers()
    }

    /// Takes the newest frame of a call; its percepts follow with [`Publisher::publish`].
    pub fn read(&mut self, input: &PageInput<'_>) {
        let snapshot = &mut *self.snapshot;
        snapshot.t_s = input.frame.t_s;
        snapshot.arrived = input.arrived.unwrap_or_else(Instant::now);
        snapshot.call_us = input.call_us;
        snapshot.take_baselines(input.plan);
        self.number = input.number;
        for (channel, (raw, value)) in snapshot.raw.iter_mut().zip(&self.value_of).enumerate() {
            let own = value.and_then(|value| input.frame.values.get(value)).copied().unwrap_or_default();
            *raw = match input.values_read.and_then(|values| values.get(channel)) {
                // The engine makes no difference between stale and missing values.
                Some(read) if !(read.is_missing() && own == RawValue::STALE) => *read,
                _ => own,
            };
        }
        let is_off = |(_, reading): &&(usize, Reading)| matches!(reading, Reading::Value(..));
        let channel = |(taxel, _): &(usize, Reading)| input.plan.body_taxels.binary_search(taxel).ok();
        snapshot.out_of_range.clear();
        snapshot.out_of_range.extend(input.values_noted.iter().filter(is_off).filter_map(channel));
        snapshot.sensed.clear();
        snapshot.sensed.extend_from_slice(input.values_sensed);
        snapshot.poses.clear();
        let links = input.frame.pose.iter();
        snapshot.poses.extend(links.filter_map(|(name, pose)| Some((*self.index_of_link.get(name)?, *pose))));
        // While joints are late, the links that they move stay where they were seen last.
        if input.frame.has_stale_pose {
            let known = snapshot.poses.len();
            for last in &self.last_poses {
                if snapshot.poses[..known].iter().all(|(link, _)| *link != last.0) {
                    snapshot.poses.push(*last);
                }
            }
        }
        self.last_poses.clone_from(&snapshot.poses);
    }

    /// Takes the percepts of a call, and hands over its newest frame with them.
    pub fn publish(&mut self, percepts: &Percepts) {
        let Some(last) = percepts.frames().checked_sub(1) else { return };
        self.note_contacts(percepts);
        self.pass(percepts);
        self.published += percepts.frames() as u64;
        let snapshot = &mut *self.snapshot;
        snapshot.number = self.number.unwrap_or_else(|| percepts.frame_number(last));
        snapshot.published = self.published;
        snapshot.percepts.clear();
        snapshot.percepts.extend(percepts.touched(last));
        match percepts.touches(last) {
            Some(found) => {
                snapshot.touches.clone_from(found);
                // Viewers that skip frames would miss them: what is not there has ended.
                snapshot.touches.released.clear();
            }
            None => snapshot.touches.clear(),
        }
        snapshot.trails.clone_from(&self.trails);
        let self_contacts = percepts.self_contacts(last);
        snapshot.self_contacts_are_known = self_contacts.is_some();
        snapshot.self_contacts.clear();
        snapshot.self_contacts.extend(self_contacts.into_iter().flatten());
        for frame in 0..if self.series.is_empty() { 0 } else { percepts.frames() } {
            let values = self.series.iter().map(|series| [series.value(percepts, frame); 2]);
            self.trail.push([percepts.t_s(frame); 2], values);
        }
        self.is_new = true;
        self.try_flush();
    }

    /// Takes the percepts of frames that are not shown, on the way to one that is: trails of touches lead through them.
    pub fn pass(&mut self, percepts: &Percepts) {
        for frame in 0..percepts.frames() {
            if let Some(found) = percepts.touches(frame) {
                self.trails.follow(percepts.t_s(frame), found);
            }
        }
    }

    /// Says that the next frame does not follow the last one, as after a seek: what is touched in it begins no touch.
    pub fn jump(&mut self) {
        if let Some(contacts) = &mut self.contacts {
            contacts.jumped = true;
        }
    }

    /// Leaves onsets and releases to a pass over the whole recording, to which it gives what logs them.
    pub fn recording_events(&mut self) -> RecordingEvents {
        self.contacts = None;
        RecordingEvents { exchange: Arc::clone(&self.exchange), contacts: self.no_contacts.clone() }
    }

    /// Logs an event: a message about a board or another notice.
    pub fn event(&mut self, kind: EventKind, t_s: f64, field: Option<usize>, text: String) {
        let about = field.map_or(About::Run, |field| About::Field(field as u32));
        self.add_event(Event { seq: 0, t_s, kind, about, text: Some(text) });
    }

    /// Replaces what is shown of the boards.
    pub fn boards(&self, boards: Vec<BoardHealth>) {
        self.exchange.lock().boards = Some(boards);
        self.exchange.wake_for_viewers();
    }

    /// Hands over what could not be handed over yet, unless it would have to wait again. For whenever no frame follows soon.
    pub fn try_flush(&mut self) {
        if self.is_new || !self.events.is_empty() {
            let exchange = Arc::clone(&self.exchange);
            if let Some(shared) = exchange.try_lock() {
                self.hand_over(shared);
            }
        }
    }

    /// The same, and waits for its turn: some microseconds.
    pub fn flush(&mut self) {
        if self.is_new || !self.events.is_empty() {
            let exchange = Arc::clone(&self.exchange);
            self.hand_over(exchange.lock());
        }
    }

    /// Says that no more frames come, and why.
    pub fn ended(&mut self, reason: &str) {
        self.flush();
        self.exchange.lock().ended = Some(reason.to_owned());
        // Also without viewers: whoever comes later gets it.
        self.exchange.waker().wake();
    }

    fn hand_over(&mut self, mut shared: MutexGuard<'_, Shared>) {
        self.events.drain(..).for_each(|event| shared.log.push(event));
        if std::mem::take(&mut self.is_new) {
            std::mem::swap(&mut self.snapshot, &mut shared.snapshot);
            shared.is_new = true;
        }
        if Arc::ptr_eq(&self.series, &shared.series) {
            shared.trail.append(&self.trail, &self.columns);
            self.trail.clear();
        } else {
            self.series = Arc::clone(&shared.series);
            self.columns = (0..self.series.len()).collect();
            self.trail = Trail::new(self.series.len(), WAITING_ROWS);
        }
        drop(shared);
        self.exchange.wake_for_viewers();
    }

    /// Onsets and releases, unless a pass over the recording logs them.
    fn note_contacts(&mut self, percepts: &Percepts) {
        let Some(mut contacts) = self.contacts.take() else { return };
        contacts.note(percepts, |event| self.add_event(event));
        self.contacts = Some(contacts);
    }

    fn add_event(&mut self, event: Event) {
        if self.events.len() == MAX_WAITING_EVENTS {
            // They are in the log sooner than they would be lost uncounted.
            let exchange = Arc::clone(&self.exchange);
            let mut shared = exchange.lock();
            self.events.drain(..).for_each(|event| shared.log.push(event));
        }
        self.events.push(event);
    }
}
