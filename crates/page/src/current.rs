//! The newest frame as it is sent to viewers.

use super::message::Counts;
use super::poses::Poses;
use super::readings::{Reading, Readings};
use super::scale::Scale;
use super::scene::PageScene;
use super::sense_scale::SenseScales;
use super::snapshot::Snapshot;
use super::touches::TouchPlaces;
use somatic_engine::percept::{Column, Percept, SelfContact, TouchFrame};

/// The newest frame, read when the first viewer wants it.
#[derive(Debug)]
pub(super) struct Current {
    snapshot: Box<Snapshot>,
    is_read: bool,
    readings: Readings,
    poses: Poses,
    /// Of the last frame that was read.
    percepts: Vec<Percept>,
    percept_changes: u64,
    touches: TouchFrame,
    /// 0 where there never was any.
    touch_changes: u64,
    self_contacts: Vec<SelfContact>,
    self_contacts_are_known: bool,
    /// 0 where none were ever known.
    self_contact_changes: u64,
    scale: Scale,
    /// Where there are taxels that measure something else.
    sense_scales: Option<SenseScales>,
    scale_changes: u64,
    counts: Counts,
    of_world: Vec<bool>,
    touch_places: TouchPlaces,
    origin: [f64; 3],
}

impl Current {
    pub(super) fn new(scene: &PageScene) -> Self {
        Self {
            snapshot: Box::new(Snapshot::new(&scene.plan)),
            is_read: true,
            readings: Readings::new(scene.plan.clone(), scene.counts.taxels, &scene.value_of, scene.senses.as_ref()),
            poses: scene.poses.clone(),
            percepts: Vec::new(),
            percept_changes: 0,
            touches: TouchFrame::default(),
            touch_changes: 0,
            self_contacts: Vec::new(),
            self_contacts_are_known: false,
            self_contact_changes: 0,
            scale: scene.scale,
            sense_scales: scene.senses.as_ref().map(|senses| senses.scales),
            scale_changes: 0,
            counts: scene.counts.clone(),
            of_world: scene.of_world.clone(),
            touch_places: scene.touch_places.clone(),
            origin: scene.origin.to_array(),
        }
    }

    /// Takes a newer frame in exchange for the one that it has.
    pub(super) fn swap(&mut self, snapshot: &mut Box<Snapshot>) {
        std::mem::swap(&mut self.snapshot, snapshot);
        self.is_read = false;
    }

    /// Reads the frame, if that has not been done.
    pub(super) fn read(&mut self) {
        if std::mem::replace(&mut self.is_read, true) {
            return;
        }
        let largest = self.readings.read(&self.snapshot);
        let ranges = self.readings.sense_ranges();
        let has_grown = self.sense_scales.as_mut().is_some_and(|scales| scales.grow(ranges));
        self.scale_changes += u64::from(self.scale.grow(largest) | has_grown);
        self.poses.set(&self.snapshot.poses);
        if self.percepts != self.snapshot.percepts {
            self.percepts.clone_from(&self.snapshot.percepts);
            self.percept_changes += 1;
        }
        if self.touches != self.snapshot.touches {
            self.touches.clone_from(&self.snapshot.touches);
            self.touch_changes += 1;
        }
        if self.self_contacts_are_known != self.snapshot.self_contacts_are_known
            || self.self_contacts != self.snapshot.self_contacts
        {
            self.self_contacts_are_known = self.snapshot.self_contacts_are_known;
            self.self_contacts.clone_from(&self.snapshot.self_contacts);
            self.self_contact_changes += 1;
        }
    }

    pub(super) fn snapshot(&self) -> &Snapshot {
        &self.snapshot
    }

    pub(super) fn readings(&self) -> &Readings {
        &self.readings
    }

    pub(super) fn poses(&self) -> &Poses {
        &self.poses
    }

    pub(super) fn percept_changes(&self) -> u64 {
        self.percept_changes
    }

    pub(super) fn touch_changes(&self) -> u64 {
        self.touch_changes
    }

    /// How touches are written.
    pub(super) fn touch_places(&self) -> &TouchPlaces {
        &self.touch_places
    }

    pub(super) fn self_contact_changes(&self) -> u64 {
        self.self_contact_changes
    }

    pub(super) fn scale(&self) -> Scale {
        self.scale
    }

    /// The scales of what is not pressure, if there are such taxels.
    pub(super) fn sense_scales(&self) -> Option<&SenseScales> {
        self.sense_scales.as_ref()
    }

    pub(super) fn scale_changes(&self) -> u64 {
        self.scale_changes
    }

    pub(super) fn counts(&self) -> &Counts {
        &self.counts
    }

    pub(super) fn columns(&self) -> &[&'static Column] {
        &self.counts.columns
    }

    /// What places in the world are relative to, m.
    pub(super) fn origin(&self) -> [f64; 3] {
        self.origin
    }

    /// Whether the places of `percept` are in the world.
    pub(super) fn is_in_world(&self, percept: &Percept) -> bool {
        percept.in_world || self.of_world[percept.field]
    }

    /// What a taxel reads.
    pub(super) fn taxel(&mut self, taxel: usize) -> Reading {
        self.readings.taxel(&self.snapshot, taxel)
    }
}
