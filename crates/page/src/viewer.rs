//! One viewer: what it has been sent and what is due. No I/O.
//!
//! A frame is made when the viewer has credit and nothing else waits for it, so it is always the newest one. What a viewer
//! does not read changes neither the engine's time nor the memory that it takes here.

use std::collections::VecDeque;
use std::time::{Duration, Instant};

use super::current::Current;
use super::encode::{FrameHead, IN_WORLD, UNKNOWN, Writer, section, write_series};
use super::latency::Latencies;
use super::series::{Series, Trail};
use super::snapshot::Snapshot;
use somatic_engine::percept::{Column, Outputs, Percept};

/// Frames that may be under way.
const CREDIT: usize = 2;
/// Rows of values for plots; those that stand for several frames are two samples each.
const PLOT_ROWS: usize = 2048;
/// Time between two answers about the taxel that is hovered.
const HOVER_PERIOD: Duration = Duration::from_millis(100);

/// What one viewer has and wants.
#[derive(Debug)]
pub(super) struct Viewer {
    under_way: VecDeque<UnderWay>,
    seq: u32,
    skipped: u64,
    /// Frames that had been published with the last one that was sent.
    sent: Sent,
    latencies: Latencies,
    /// Bits of the columns that frames carry, by the scene's columns.
    columns: u64,
    series: Vec<Series>,
    /// Number of times that it has said what it plots.
    series_messages: u32,
    trail: Trail,
    hovered: Option<Hovered>,
    /// Number of the last event that was sent.
    pub(super) seen_event: u64,
    /// Changes of the scale that were sent.
    pub(super) seen_scale: u64,
    /// Changes of the boards that were sent.
    pub(super) seen_boards: u64,
    /// Whether the end has been sent.
    pub(super) seen_end: bool,
}

/// A frame that is not drawn yet.
#[derive(Clone, Copy, Debug)]
struct UnderWay {
    seq: u32,
    sent_at: Instant,
    /// When it arrived, if it was new.
    arrived: Option<Instant>,
}

/// What the last frame of each kind was of.
#[derive(Clone, Copy, Debug, Default)]
struct Sent {
    published: u64,
    pressures: Option<u64>,
    poses: u64,
    percepts: Option<u64>,
    touches: u64,
    self_contacts: u64,
}

#[derive(Clone, Copy, Debug)]
struct Hovered {
    taxel: usize,
    /// When it was last answered, and for which frame.
    answered: Option<(Instant, u64)>,
}

impl Viewer {
    /// One that has seen the events up to number `seen_event`.
    pub(super) fn new(seen_event: u64) -> Self {
        Self {
            under_way: VecDeque::with_capacity(CREDIT),
            seq: 0,
            skipped: 0,
            sent: Sent::default(),
            latencies: Latencies::new(),
            columns: 0,
            series: Vec::new(),
            series_messages: 0,
            trail: Trail::default(),
            hovered: None,
            seen_event,
            seen_scale: 0,
            seen_boards: 0,
            seen_end: false,
        }
    }

    /// The frame `seq` is on the screen, and so is or was every one before it.
    pub(super) fn drawn(&mut self, seq: u32, now: Instant) {
        while let Some(&frame) = self.under_way.front().filter(|frame| frame.seq <= seq) {
            self.under_way.pop_front();
            if let Some(arrived) = frame.arrived.filter(|_| frame.seq == seq) {
                self.latencies.add(now.saturating_duration_since(arrived));
            }
        }
    }

    /// When the oldest frame was sent that it has not drawn.
    pub(super) fn owes_since(&self) -> Option<Instant> {
        self.under_way.front().map(|frame| frame.sent_at)
    }

    pub(super) fn set_columns(&mut self, columns: u64) {
        self.columns = columns;
        // The next frame has them.
        self.sent.percepts = None;
    }

    pub(super) fn set_series(&mut self, series: Vec<Series>) {
        self.series_messages = self.series_messages.wrapping_add(1);
        self.trail = Trail::new(series.len(), PLOT_ROWS);
        self.series = series;
    }

    pub(super) fn series(&self) -> &[Series] {
        &self.series
    }

    /// Takes the values of new frames, which `all` has of the series `of`.
    pub(super) fn take_values(&mut self, all: &Trail, of: &[Series]) {
        let columns: Option<Vec<usize>> =
            self.series.iter().map(|series| of.iter().position(|other| other == series)).collect();
        if let Some(columns) = columns {
            self.trail.append(all, &columns);
        }
    }

    pub(super) fn set_hovered(&mut self, taxel: Option<usize>) {
        self.hovered = taxel.map(|taxel| Hovered { taxel, answered: None });
    }

    /// The taxel that is to be answered now, of the newest frame.
    pub(super) fn due_taxel(&mut self, published: u64, now: Instant) -> Option<usize> {
        let hovered = self.hovered.as_mut()?;
        let is_due = hovered.answered.is_none_or(|(at, of)| of != published && now - at >= HOVER_PERIOD);
        is_due.then(|| {
            hovered.answered = Some((now, published));
            hovered.taxel
        })
    }

    /// When a taxel is due next, if a frame has come since.
    pub(super) fn taxel_due_at(&self, published: u64) -> Option<Instant> {
        let (at, of) = self.hovered?.answered?;
        (of != published).then_some(at + HOVER_PERIOD)
    }

    /// Whether the frame that makes `published` is to be sent.
    pub(super) fn wants_frame(&self, published: u64) -> bool {
        self.under_way.len() < CREDIT && published > 0 && (published != self.sent.published || self.is_incomplete())
    }

    /// Whether it has been sent the frame that makes `published`.
    pub(super) fn has(&self, published: u64) -> bool {
        self.sent.published == published
    }

    /// Whether the last frame lacked what has been asked for since.
    fn is_incomplete(&self) -> bool {
        self.sent.percepts.is_none() && self.seq > 0
    }

    /// The newest frame.
    pub(super) fn frame(&mut self, current: &Current, newest_event: u64) -> Vec<u8> {
        let snapshot = current.snapshot();
        // The first one may have been there for long, and one that is sent again has.
        let is_new = self.sent.published > 0 && self.sent.published != snapshot.published;
        if is_new {
            self.skipped += snapshot.published.saturating_sub(self.sent.published + 1);
        }
        self.seq += 1;
        let mut sections = 0;
        let mut set = |bit, needed: bool| sections |= if needed { bit } else { 0 };
        let pressures = self.sent.pressures != Some(current.readings().changes());
        let poses = self.sent.poses != current.poses().changes();
        let percepts = self.sent.percepts != Some(current.percept_changes());
        let touches = self.sent.touches != current.touch_changes();
        let self_contacts = self.sent.self_contacts != current.self_contact_changes();
        set(section::PRESSURES, pressures);
        set(section::SHEARS, pressures && !current.readings().shears().is_empty());
        set(section::POSES, poses);
        set(section::PERCEPTS, percepts);
        set(section::TOUCHES, touches);
        set(section::SELF_CONTACTS, self_contacts);
        set(section::SERIES, !self.trail.is_empty());
        let head = FrameHead {
            sections,
            seq: self.seq,
            number: snapshot.number,
            t_s: snapshot.t_s,
            skipped: u32::try_from(self.skipped).unwrap_or(u32::MAX),
            latency_ms: self.latencies.percentiles_ms(),
            fields: snapshot.percepts.len() as u32,
            touches: snapshot.touches.touches.len() as u32,
            samples: self.trail.samples() as u32,
            newest_event: u32::try_from(newest_event).unwrap_or(u32::MAX),
            columns: if percepts { self.columns } else { 0 },
            call_us: snapshot.call_us,
            answered_series: self.series_messages,
        };
        let mut to = head.write();
        if pressures {
            to.f32s(current.readings().pressures());
            to.bytes(current.readings().health());
            to.pad();
            to.f32s(current.readings().shears());
        }
        if poses {
            to.f32s(current.poses().seven().as_flattened());
            to.pad();
        }
        if percepts {
            self.write_percepts(&mut to, current);
        }
        if touches {
            current.touch_places().write(&mut to, &snapshot.touches, &snapshot.trails, snapshot.t_s);
        }
        if self_contacts {
            write_self_contacts(&mut to, current);
        }
        if sections & section::SERIES != 0 {
            write_series(&mut to, &self.trail);
            self.trail.clear();
        }
        self.sent = Sent {
            published: snapshot.published,
            pressures: Some(current.readings().changes()),
            poses: current.poses().changes(),
            percepts: Some(current.percept_changes()),
            touches: current.touch_changes(),
            self_contacts: current.self_contact_changes(),
        };
        let arrived = is_new.then_some(snapshot.arrived);
        self.under_way.push_back(UnderWay { seq: self.seq, sent_at: Instant::now(), arrived });
        to.finish()
    }

    fn write_percepts(&self, to: &mut Writer, current: &Current) {
        let percepts = &current.snapshot().percepts;
        percepts.iter().for_each(|percept| to.u32(percept.field as u32));
        percepts.iter().for_each(|percept| to.u32(percept.flags.bits()));
        for percept in percepts {
            let bit = |(index, column): (usize, &&Column)| percept.value(column).map_or(0, |_| 1 << index);
            let present: u64 = current.columns().iter().enumerate().map(bit).sum();
            to.u64(present | if current.is_in_world(percept) { IN_WORLD } else { 0 });
        }
        for (index, column) in current.columns().iter().enumerate() {
            if self.columns & (1 << index) == 0 {
                continue;
            }
            for percept in percepts {
                let value = value(percept, column, current);
                (0..column.components).for_each(|component| to.f32(value[component]));
            }
        }
        to.pad();
    }
}

/// A quantity as frames carry it; NaN where it is absent.
fn value(percept: &Percept, column: &Column, current: &Current) -> [f32; 3] {
    let Some(value) = percept.value(column) else { return [f32::NAN; 3] };
    let is_place = column.output == Outputs::POSITION && current.is_in_world(percept);
    let from = if is_place { current.origin() } else { [0.0; 3] };
    std::array::from_fn(|i| (value[i] - from[i]) as f32)
}

fn write_self_contacts(to: &mut Writer, current: &Current) {
    let Snapshot { self_contacts, self_contacts_are_known, .. } = current.snapshot();
    to.u32(if *self_contacts_are_known { self_contacts.len() as u32 } else { UNKNOWN });
    for contact in self_contacts {
        to.u32(contact.id as u32);
        for side in &contact.sides {
            to.u32(side.link);
            to.u32(side.touch as u32);
            to.f32(side.total as f32);
        }
        (0..3).for_each(|i| to.f32((contact.position[i] - current.origin()[i]) as f32));
        to.f32(contact.distance as f32);
        to.f32(contact.angle as f32);
    }
    to.pad();
}
